"""What is really there as Nudge's maps have it, and the scores of a belief (core/src/world/truth.rs, core/src/score.rs)."""

import mujoco
import numpy as np

from .camera import rotation
from .shapes import BACKGROUND

# The scored volume is the grid below this height, metres.
SCORED_HEIGHT_M = 0.27


def planes(model, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    """Outward normals [F, 3] and offsets [F] of a convex mesh, in its body's frame."""
    first, count = model.mesh_vertadr[mesh], model.mesh_vertnum[mesh]
    matrix = np.zeros(9)
    mujoco.mju_quat2Mat(matrix, model.mesh_quat[mesh])
    corners = model.mesh_vert[first : first + count] @ matrix.reshape(3, 3).T + model.mesh_pos[mesh]
    first, count = model.mesh_faceadr[mesh], model.mesh_facenum[mesh]
    a, b, c = np.moveaxis(corners[model.mesh_face[first : first + count]], 1, 0)
    normals = np.cross(b - a, c - a)
    length = np.linalg.norm(normals, axis=1)
    keep = length > 1e-12
    normals = normals[keep] / length[keep][:, None]
    return normals, (normals * a[keep]).sum(axis=1)


class Truth:
    """Occupancy [W, D, H], and per floor cell the class and the number of the tallest object, -1 for none."""

    def __init__(self, shelf, scene: dict, poses: list[dict]):
        voxel = scene["shelf"]["voxel_m"]
        dims = np.maximum(np.round(np.asarray(scene["shelf"]["size"]) / voxel).astype(int), 1)
        self.voxel_m, self.origin = voxel, np.array([-0.5 * dims[0] * voxel, 0.0, 0.0])
        self.occupancy = np.zeros(dims, bool)
        self.labels = np.full(dims[:2], BACKGROUND)
        self.objects = np.full(dims[:2], -1)
        self.tops = np.zeros(dims[:2], int)
        for at, (thing, pose) in enumerate(zip(shelf.things, poses)):
            for part in range(0 if pose["gone"] else len(thing.parts)):
                self.fill(shelf.model, at, thing, part, pose)

    def fill(self, model, at: int, thing, part: int, pose: dict) -> None:
        """Fills the voxels whose centres are in a part of an object."""
        turn, place = rotation(pose["quaternion"]), np.asarray(pose["position"])
        normals, offsets = planes(model, model.mesh(f"object{at}.{part}").id)
        corners = thing.parts[part] @ turn.T + place
        low = np.floor((corners.min(axis=0) - self.origin) / self.voxel_m).astype(int).clip(0, self.occupancy.shape)
        high = np.ceil((corners.max(axis=0) - self.origin) / self.voxel_m).astype(int).clip(0, self.occupancy.shape)
        axes = [self.origin[k] + (np.arange(low[k], high[k]) + 0.5) * self.voxel_m for k in range(3)]
        points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
        inside = (((points - place) @ turn) @ normals.T <= offsets + 1e-9).all(axis=-1)
        box = tuple(slice(a, b) for a, b in zip(low, high))
        self.occupancy[box] |= inside
        levels = np.arange(low[2], high[2]) + 1
        tops = (inside * levels).max(axis=-1, initial=0)
        taller = tops > self.tops[box[:2]]
        for image, value in [(self.tops, tops), (self.labels, thing.label), (self.objects, at)]:
            image[box[:2]] = np.where(taller, value, image[box[:2]])


def middles(objects: np.ndarray, occupancy: np.ndarray, voxel_m: float) -> dict[int, tuple[np.ndarray, float]]:
    """Of every object the middle of its floor cells and its height there, metres."""
    height = occupancy.shape[2]
    tops = np.where(occupancy.any(axis=2), height - np.argmax(occupancy[:, :, ::-1], axis=2), 0)
    found = {}
    for at in np.unique(objects[(objects >= 0) & (objects < 65535)]):
        cells = np.argwhere(objects == at)
        found[int(at)] = ((cells.mean(axis=0) + 0.5) * voxel_m, float(tops[objects == at].max() * voxel_m))
    return found


def mean_iou(truth: np.ndarray, told: np.ndarray, classes: int) -> tuple[float, list[float | None]]:
    """The mean IoU over the classes in truth or map, and the IoU of each."""
    ious: list[float | None] = []
    for number in range(classes):
        both, either = ((truth == number) & (told == number)).sum(), ((truth == number) | (told == number)).sum()
        ious.append(float(both / either) if either else None)
    present = [iou for iou in ious if iou is not None]
    return float(np.mean(present)) if present else 1.0, ious


def scores(belief, occupancy: np.ndarray, labels: np.ndarray, voxel_m: float) -> dict[str, float]:
    """Occupancy IoU, occupied IoU and semantic mIoU of a belief (`beliefs/NNN.npz`)."""
    levels = min(int(np.ceil(SCORED_HEIGHT_M / voxel_m - 0.5)), occupancy.shape[2])
    evidence = belief["occupancy"][:, :, :levels].astype(np.float32)
    told = evidence[..., 0] > evidence[..., 1]
    iou, (_, occupied) = mean_iou(occupancy[:, :, :levels].astype(int), told.astype(int), 2)
    semantic, _ = mean_iou(labels, np.argmax(belief["semantics"], axis=-1), BACKGROUND + 1)
    return {"occupancy_iou": iou, "occupied_iou": 1.0 if occupied is None else occupied, "semantic_miou": semantic}
