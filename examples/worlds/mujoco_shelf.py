#!/usr/bin/env python3
"""The scene in MuJoCo, as a world for `nudge run --world` (docs/world-protocol.md).

    nudge run shelf.toml --world "python3 examples/worlds/mujoco_shelf.py" --policy mem --budget 20

    nudge run shelf.toml --world "python3 examples/worlds/mujoco_shelf.py" --policy mem-pick --place tray --arm suction

Looks are rendered by MuJoCo; pushes, and picks by an arm with a suction cup, are carried out in its physics. Needs Python 3.11,
`pip install mujoco numpy`.
"""

import argparse
import json
import os
import sys
from pathlib import Path

PROTOCOL = 1


def arguments() -> argparse.Namespace:
    """What was typed."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--renderer",
        choices=["rays", "gl"],
        default="rays",
        help="how images are made: by casting rays on the processor, or by OpenGL (on Linux MUJOCO_GL is egl unless set)",
    )
    parser.add_argument("--truth", type=Path, help="write where the objects really are to this file, a line per motion")
    return parser.parse_args()


def first_id() -> int:
    """The number of the request that waits, so that it can be answered."""
    try:
        return json.loads(sys.stdin.readline())["id"] if not sys.stdin.isatty() else 0
    except (ValueError, KeyError, TypeError):
        return 0


def give_up(words: str) -> None:
    """Ends in one line, before there is a world."""
    print(json.dumps({"id": first_id(), "error": words}), flush=True)
    sys.exit(2)


class Server:
    """Answers requests about one shelf."""

    def __init__(self, typed: argparse.Namespace, make_shelf):
        self.typed, self.make_shelf = typed, make_shelf
        self.shelf, self.folder = None, Path()

    def answer(self, request: dict) -> dict:
        """The answer to a request, without its number."""
        if "begin" in request:
            return self.begin(request["begin"])
        if self.shelf is None:
            raise KeyError("begin")
        if "look" in request:
            return self.look(request["look"])
        moved = self.shelf.carry_out(request["move"])
        self.tell_truth("a")
        grip = {"grip": moved.grip} if moved.grip else {}
        return {"moved": {"passed": moved.passed, "stalled": moved.stalled, **grip}}

    def begin(self, begin: dict) -> dict:
        """Builds the world, and carries out again what was done."""
        from shelf_in_mujoco import WorldError

        if begin["protocol"] != PROTOCOL:
            raise WorldError(f"this world speaks protocol {PROTOCOL}, asked was {begin['protocol']}")
        self.folder = Path(begin["folder"])
        self.shelf = self.make_shelf(begin["scene"], self.typed.renderer)
        self.tell_truth("w")
        for move in begin.get("done", []):
            self.shelf.carry_out(move)
            self.tell_truth("a")
        return {"ready": {"protocol": PROTOCOL}}

    def look(self, look: dict) -> dict:
        """Takes an image. The files are overwritten by the next."""
        import numpy as np

        depth, labels = self.shelf.look(look["position"], look["quaternion"], look["camera"])
        np.save(self.folder / "depth.npy", depth)
        np.save(self.folder / "labels.npy", labels)
        return {"frame": {"depth": "depth.npy", "labels": "labels.npy"}}

    def tell_truth(self, mode: str) -> None:
        """Writes where the objects are."""
        if self.typed.truth:
            with open(self.typed.truth, mode, encoding="utf-8") as file:
                file.write(json.dumps(self.shelf.poses()) + "\n")


def words_of(error: Exception) -> str:
    """What went wrong, in one line."""
    from shelf_in_mujoco import WorldError

    words = " ".join(str(error).split())
    if isinstance(error, (WorldError, OSError)):
        return words
    if isinstance(error, KeyError):
        return f"a request without {words}"
    return f"a request that cannot be answered ({type(error).__name__}: {words})"


def main() -> None:
    """Answers a line for a line until there are no more."""
    typed = arguments()
    if typed.renderer == "rays":
        os.environ["MUJOCO_GL"] = "disable"
    elif sys.platform == "linux":
        os.environ.setdefault("MUJOCO_GL", "egl")
    try:
        from shelf_in_mujoco.world import Shelf
    except ModuleNotFoundError as error:
        package = "Python 3.11" if error.name == "tomllib" else f"`pip install mujoco numpy` ({error.name} is missing)"
        give_up(f"this world needs {package}")
    server = Server(typed, Shelf)
    for line in sys.stdin:
        try:
            request = json.loads(line)
            answer = {"id": request["id"]}
        except (ValueError, KeyError, TypeError):
            print("mujoco_shelf.py: a line that is no request", file=sys.stderr)
            sys.exit(2)
        if "end" in request:
            break
        try:
            answer |= server.answer(request)
        except Exception as error:  # Whatever a request does to the world is told to who asked.
            answer["error"] = words_of(error)
        print(json.dumps(answer), flush=True)
    if server.shelf is not None:
        server.shelf.camera.close()


main()
