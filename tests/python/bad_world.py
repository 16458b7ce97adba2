"""A world that serves a recording through examples/worlds/replay.py and misbehaves at its third look, or at another.

    bad_world.py REPLAY RECORDING KIND [LOOK]
"""

import json
import os
import subprocess
import sys
import time
from pathlib import Path

replay, recording, kind, *look = sys.argv[1:]
served = subprocess.Popen([sys.executable, replay, recording], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
looks, folder = 0, None
for line in sys.stdin:
    request = json.loads(line)
    if "end" in request:
        break
    served.stdin.write(line)
    served.stdin.flush()
    answer = served.stdout.readline()
    folder = Path(request["begin"]["folder"]) if "begin" in request else folder
    looks += "look" in request
    if looks == int(*look or [3]):
        told = json.loads(answer)
        if kind == "late":
            time.sleep(15)
        elif kind == "twice":
            answer += answer
        elif kind == "crash":
            os._exit(3)
        elif kind == "nonsense":
            answer = "moving the camera now ...\n"
        elif kind == "other-id":
            answer = json.dumps({**told, "id": 77}) + "\n"
        elif kind == "other-answer":
            answer = json.dumps({"id": told["id"], "moved": {}}) + "\n"
        elif kind == "outside":
            answer = json.dumps({"id": told["id"], "frame": {"depth": "../secret.npy"}}) + "\n"
        elif kind == "huge":
            with open(folder / "huge.npy", "wb") as file:
                file.truncate(2 << 30)
            answer = json.dumps({"id": told["id"], "frame": {"depth": "huge.npy"}}) + "\n"
        elif kind == "error":
            answer = json.dumps({"id": told["id"], "error": "emergency stop"}) + "\n"
        elif kind == "long":
            answer = "x" * (20 << 20) + "\n"
    sys.stdout.write(answer)
    sys.stdout.flush()
served.stdin.close()
