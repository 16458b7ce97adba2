"""Maps by PyPI's OctoMap bindings (pyoctomap), an implementation of the format that is not Nudge's.

    octomap_maps.py write DIR     writes DIR/box.bt, DIR/box.ot and DIR/coarse.bt: a box in a shelf that is seen free
    octomap_maps.py read FILE     prints, as JSON, the resolution and per voxel of 5 mm of a shelf of 0.2 x 0.1 x 0.1 m, in
                                  the order x, y, z: 1 occupied, -1 free, 0 unknown
"""

import json
import sys
from pathlib import Path

import numpy as np
import pyoctomap

# Voxels of 5 mm from x = -0.1, y = 0, z = 0 on.
DIMS = (40, 20, 20)
VOXEL_M = 0.005


def centers(dims, voxel_m):
    for x, y, z in np.ndindex(*dims):
        yield (x, y, z), np.array([(x + 0.5) * voxel_m - 0.1, (y + 0.5) * voxel_m, (z + 0.5) * voxel_m])


def box(voxel_m):
    """A box of 4 x 4 x 5 cm in the middle; nothing is known behind it and above z = 8 cm."""
    tree = pyoctomap.OcTree(voxel_m)
    dims = [round(n * VOXEL_M / voxel_m) for n in DIMS]
    for _, at in centers(dims, voxel_m):
        if at[2] > 0.08 or (abs(at[0]) < 0.02 and at[1] > 0.06):
            continue
        inside = abs(at[0]) < 0.02 and 0.02 < at[1] < 0.06 and at[2] < 0.05
        for _ in range(3 if inside else 2):
            tree.updateNode(at, bool(inside))
    tree.updateInnerOccupancy()
    return tree


def write(folder: Path) -> None:
    box(VOXEL_M).write(str(folder / "box.ot"))
    box(VOXEL_M).writeBinary(str(folder / "box.bt"))
    box(2 * VOXEL_M).writeBinary(str(folder / "coarse.bt"))


def read(path: str) -> None:
    tree = pyoctomap.OcTree(0.1)
    if not tree.readBinary(path):
        sys.exit(f"{path}: octomap does not read it")
    voxels = []
    for _, at in centers(DIMS, VOXEL_M):
        node = tree.search(at)
        voxels.append(0 if node is None else 1 if tree.isNodeOccupied(node) else -1)
    print(json.dumps({"resolution": tree.getResolution(), "nodes": tree.size(), "voxels": voxels}))


if __name__ == "__main__":
    {"write": lambda: write(Path(sys.argv[2])), "read": lambda: read(sys.argv[2])}[sys.argv[1]]()
