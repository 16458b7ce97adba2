"""Reads what an episode of Nudge files: frames, motions. Needs `pip install zstandard`.

A frame file is a line of JSON and then compressed bytes: depth (core/src/camera/depth_code.rs), labels, objects.
"""

import json
from pathlib import Path

import numpy as np
import zstandard

# Columns beside the image and rows above it that predictions may look at, and how many fronts that is.
MARGIN, ABOVE, EARLIER = 2, 2, 5
# Predictions per pixel, and the squared error that is as good as none.
WAYS = 5
EXACT = 1e-15


def read_frame(path: Path) -> dict:
    """Pose and camera (as the protocol has it), `depth` (float32, metres) and `labels`, [H, W]."""
    head, content = path.read_bytes().split(b"\n", 1)
    told = json.loads(head)
    pinhole = told["intrinsics"]
    width, height = pinhole["width"], pinhole["height"]
    content = zstandard.ZstdDecompressor().decompress(content, max_output_size=16 * width * height)
    depth, used = read_depth(np.frombuffer(content, np.uint8), width, height)
    labels = np.frombuffer(content, np.uint8, width * height, used).reshape(height, width)
    (fx, fy), (cx, cy) = pinhole["focal_px"], pinhole["principal_px"]
    camera = {"width": width, "height": height, "fx": fx, "fy": fy, "cx": cx - 0.5, "cy": cy - 0.5}
    camera["distortion"] = pinhole["distortion"]
    pose = {key: told[key] for key in ["position", "quaternion"]}
    return {**pose, "camera": camera, "depth": depth, "labels": labels}


def read_depth(content: np.ndarray, width: int, height: int) -> tuple[np.ndarray, int]:
    """The depth image, and how many bytes it took."""
    pixels = width * height
    there = np.unpackbits(content[: -(-pixels // 8)], bitorder="little")[:pixels].astype(bool)
    used, readings = -(-pixels // 8), int(there.sum())
    planes = content[used : used + 4 * readings].reshape(4, readings).astype(np.uint32)
    counts = planes[0] | planes[1] << 8 | planes[2] << 16 | planes[3] << 24
    off = np.zeros(pixels, np.int32)
    off[there] = (counts >> 1).astype(np.int32) ^ -(counts & 1).astype(np.int32)
    shape = (height, width)
    return unfold(there.reshape(shape), off.reshape(shape)), used + 4 * readings


def unfold(there: np.ndarray, off: np.ndarray) -> np.ndarray:
    """Depth from how far it is off its prediction, in units of a float32's last digit.

    A pixel waits for its left neighbour and the one above to the right, so all with the same `column + 2 row`, a front, go at
    once: arrays here are [front, row], and a neighbour is so many fronts and rows before.
    """
    height, width = there.shape
    rows, columns = np.mgrid[:height, :width]
    fronts = columns + 2 * rows
    skewed_there, skewed_off = np.zeros((fronts.max() + 1, height), bool), np.zeros((fronts.max() + 1, height), np.int32)
    skewed_there[fronts, rows], skewed_off[fronts, rows] = there, off
    skewed = np.zeros(skewed_there.shape, np.float32)
    # Two rows above the image, and fronts for the columns beside it.
    inverse = np.ones((EARLIER + len(skewed) + MARGIN, ABOVE + height))
    errors = np.zeros((EARLIER + len(skewed) + MARGIN, ABOVE + height, WAYS))
    for front in range(len(skewed)):
        low, high = max(0, (front - width + 2) // 2), min(height - 1, front // 2) + 1
        row, here = slice(ABOVE + low, ABOVE + high), EARLIER + front
        above, top = slice(row.start - 1, row.stop - 1), slice(row.start - 2, row.stop - 2)
        if front == 2 * (high - 1):
            inverse[here - MARGIN : here, row.stop - 1] = inverse[here - 2, row.stop - 2]
        left, up, corner = inverse[here - 1, row], inverse[here - 2, above], inverse[here - 3, above]
        ways = np.stack([
            left + up - corner,
            2.0 * left - inverse[here - 2, row],
            2.0 * up - inverse[here - 4, top],
            left + 0.5 * (inverse[here - 1, above] - corner),
            up + 0.5 * (left - inverse[here - 5, top]),
        ], axis=-1)
        error = errors[here - 1, row] + errors[here - 2, above] + errors[here - 1, above]
        expected = predicted(ways, 1.0 / (error * error + EXACT))
        is_there = skewed_there[front, low:high]
        found = (expected.view(np.int32) + skewed_off[front, low:high]).view(np.float32)
        skewed[front, low:high] = np.where(is_there, found, 0.0)
        true = 1.0 / np.where(is_there, found, expected).astype(np.float64)
        inverse[here, row] = true
        errors[here, row] = np.where(is_there[:, None], np.abs(ways - true[:, None]) / true[:, None], 0.0)
        if front == 2 * low + width - 1:
            inverse[here + 1 : here + 1 + MARGIN, row.start] = true[0]
    return skewed[fronts, rows]


def predicted(ways: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """The depth to be expected; sums in the order that the file's writer has, so that every bit is the same."""
    total, weight = np.zeros(len(ways)), np.zeros(len(ways))
    for way in range(WAYS):
        total = total + weights[:, way] * ways[:, way]
        weight = weight + weights[:, way]
    inverse = total / weight
    return np.where(inverse > 1e-6, 1.0 / np.maximum(inverse, 1e-6), 1.0).astype(np.float32)


def read_episode(folder: Path) -> dict:
    """`episode.json`."""
    return json.loads((folder / "episode.json").read_text(encoding="utf-8"))


def motion_of(step: dict) -> dict:
    """The motion of a step as the protocol has it."""
    filed = step["decision"]["motion"]
    phases = filed.get("phases")
    if phases is None:
        kinds = [("approach", filed["way_in"]), ("contact", filed["push"])]
        phases = [{"kind": kind, "opening_m": 0.0, "motion": motion} for kind, motion in kinds]
    told = []
    for phase in phases:
        stops = phase["motion"]["stops"]
        way = {"at_s": [stop["at_s"] for stop in stops], "joints": [stop["joints"] for stop in stops]}
        told.append({"kind": phase["kind"], "opening_m": phase["opening_m"], **way})
    return {"phases": told}
