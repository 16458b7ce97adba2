#!/usr/bin/env python3
"""Whether two episodes' directories hold the same: beliefs and truths byte for byte, and everything in episode.json but what
the clock and the number of threads say. With one directory: whether every file in it is whole.

    same_episode.py ONE TWO
    same_episode.py ONE

Prints the first difference and ends with 1. Needs Python's standard library alone.
"""

import json
import pathlib
import sys
import zipfile


def document(path):
    record = json.loads((path / "episode.json").read_text())
    for maker in [record.get("made_by")] + [later["made_by"] for later in record.get("also_made_by", [])]:
        if maker:
            maker.pop("threads", None)
    for step in record["steps"]:
        step["seconds"] = None
    return record


def archives(path):
    return sorted(file.relative_to(path) for file in path.glob("*/*.npz") if not file.name.startswith("."))


def whole(path):
    """Why a file under its final name is not whole, or None."""
    try:
        if (path / "episode.json").exists():
            document(path)
        for name in archives(path):
            if zipfile.ZipFile(path / name).testzip():
                return f"{name}: a checksum is wrong"
    except (OSError, ValueError, KeyError, zipfile.BadZipFile) as error:
        return f"{path}: {error}"
    picture = path / "summary.png"
    if picture.exists() and not picture.read_bytes().endswith(b"IEND\xaeB`\x82"):
        return "summary.png: has no end"
    return None


def difference(one, two):
    if archives(one) != archives(two):
        return "they have other files"
    for name in archives(one):
        if (one / name).read_bytes() != (two / name).read_bytes():
            return f"{name} differs"
    a, b = document(one), document(two)
    for key in sorted(a.keys() | b.keys()):
        if a.get(key) != b.get(key):
            steps = [at for at, pair in enumerate(zip(a["steps"], b["steps"]), 1) if pair[0] != pair[1]]
            return f"episode.json: {key} differs" + (f", first at step {steps[0]}" if key == "steps" and steps else "")
    return None


paths = [pathlib.Path(argument) for argument in sys.argv[1:]]
if len(paths) not in (1, 2):
    sys.exit(__doc__)
found = next((fault for fault in map(whole, paths) if fault), None)
found = found or (len(paths) == 2 and difference(*paths)) or None
if found:
    print(found)
    sys.exit(1)
