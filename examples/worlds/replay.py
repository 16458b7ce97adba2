#!/usr/bin/env python3
"""Serves a recording as a world for `nudge run --world`: the smallest program that speaks docs/world-protocol.md.

    nudge run shelf.toml --world "python3 examples/worlds/replay.py RECORDING" --policy mem-no-push --budget 20

RECORDING is a plain folder (docs/bring-your-own.md) whose frame is the board's, with poses as `x y z qx qy qz qw`. Nothing can
be moved in it. Needs no package.
"""

import json
import shutil
import sys
from pathlib import Path


def main(recording):
    intrinsics = json.loads((recording / "intrinsics.json").read_text())
    camera = {key: intrinsics[key] for key in ["width", "height", "fx", "fy", "cx", "cy"]}
    unit_m = 1.0 / intrinsics.get("depth_scale", 1000)
    frames = []
    for pose in sorted((recording / "pose").glob("*.txt")):
        numbers = [float(word) for word in pose.read_text().split()]
        images = [recording / "depth" / f"{pose.stem}.{end}" for end in ["npy", "png"]]
        depth = next((image for image in images if image.is_file()), None)
        if len(numbers) == 7 and depth:
            frames.append((numbers[:3], numbers[3:], depth, recording / "label" / f"{pose.stem}.png"))
    folder = None
    for line in sys.stdin:
        request = json.loads(line)
        answer = {"id": request["id"]}
        if "begin" in request:
            folder = Path(request["begin"]["folder"])
            poses = [{"position": position, "quaternion": quaternion} for position, quaternion, _, _ in frames]
            answer["ready"] = {"protocol": 1, "views": {"camera": camera, "poses": poses}}
        elif "look" in request:
            _, _, depth, label = frames[request["look"]["view"]]
            shutil.copy(depth, folder / depth.name)
            answer["frame"] = {"depth": depth.name, "depth_unit_m": unit_m}
            if label.is_file():
                shutil.copy(label, folder / f"label-{label.name}")
                answer["frame"]["labels"] = f"label-{label.name}"
        elif "end" in request:
            return
        else:
            answer["error"] = "nothing can be moved in a recording"
        print(json.dumps(answer), flush=True)


main(Path(sys.argv[1]))
