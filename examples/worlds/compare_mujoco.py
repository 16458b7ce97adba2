#!/usr/bin/env python3
"""How the MuJoCo world agrees with the built-in simulator, as tables. Needs `pip install mujoco numpy zstandard`.

    compare_mujoco.py images EPISODE...     the same views in both: the looks of built-in episodes before their first push
    compare_mujoco.py pushes EPISODE...     the same motion in both: the first push of built-in episodes
    compare_mujoco.py scores EPISODE THERE TRUTH    the last maps of a built-in episode and of one in MuJoCo (THERE), of which
                                            the world wrote the truth (--truth TRUTH)
"""

import argparse
import json
import os
import sys
from pathlib import Path

os.environ.setdefault("MUJOCO_GL", "disable")

import numpy as np

from shelf_in_mujoco.frames import motion_of, read_episode, read_frame
from shelf_in_mujoco.truth import Truth, middles, scores
from shelf_in_mujoco.world import Shelf

# Depths agree within this, metres.
NEAR_M = 0.005
# An object has moved by more than this, metres; it is toppled when it is lower by this share.
MOVED_M = 0.005
TOPPLED = 0.25


def is_push(step: dict) -> bool:
    """Whether the arm moved something on purpose."""
    return step["action"]["kind"] != "look"


def row(*cells) -> None:
    """Prints a row of a table."""
    print("| " + " | ".join(f"{cell:.2f}" if isinstance(cell, float) else str(cell) for cell in cells) + " |", flush=True)


def table(*names: str) -> None:
    """Prints a table's head."""
    row(*names)
    row(*["---"] * len(names))


def images(folders: list[Path], renderer: str) -> None:
    """Compares pixels, in per cent of all."""
    table("shelf", "views", "depth within 5 mm, %", "within 1 mm, %", "class the same, %", "depth within 5 mm and class, %")
    sums, views = np.zeros(4), 0
    for folder in folders:
        episode = read_episode(folder)
        shelf = Shelf(episode["scene"], renderer)
        shares = []
        for step in episode["steps"]:
            if is_push(step):
                break
            filed = read_frame(folder / "frames" / f"{step['index']:03}.frame")
            depth, labels = shelf.look(filed["position"], filed["quaternion"], filed["camera"])
            off = np.abs(depth - filed["depth"])
            same = labels == filed["labels"]
            shares.append([np.mean(image) for image in (off < NEAR_M, off < 0.001, same, (off < NEAR_M) & same)])
        shelf.camera.close()
        row(f"`{episode['scene']['name']}`", len(shares), *(f"{100 * share:.3f}" for share in np.mean(shares, axis=0)))
        sums, views = sums + np.sum(shares, axis=0), views + len(shares)
    row("all", views, *(f"{100 * share:.3f}" for share in sums / views))


def builtin_truth(folder: Path, index: int, voxel_m: float) -> dict:
    """The middles and heights of the objects after so many actions."""
    filed = np.load(folder / "truth" / f"{index:03}.npz")
    return middles(filed["objects"].astype(int), filed["occupancy"].astype(bool), voxel_m)


def moved(before: dict, after: dict) -> tuple[dict[int, np.ndarray], int]:
    """How far the middle of every object moved, metres, and how many are toppled."""
    both = before.keys() & after.keys()
    ways = {at: after[at][0] - before[at][0] for at in both}
    return ways, sum(after[at][1] < (1 - TOPPLED) * before[at][1] for at in both)


def far(ways: dict[int, np.ndarray]) -> set[int]:
    """The objects that moved."""
    return {at for at, way in ways.items() if np.linalg.norm(way) > MOVED_M}


def push_there(scene: dict, step: dict) -> tuple[dict, int, float, int, bool]:
    """Carries a step's motion out in MuJoCo: ways of the objects' middles, how many toppled, the sum of all displacements,
    metres, how many left the shelf, and whether the arm stalled."""
    shelf, voxel_m = Shelf(scene), scene["shelf"]["voxel_m"]

    def standing() -> tuple[dict, np.ndarray]:
        poses = shelf.poses()
        truth = Truth(shelf, scene, poses)
        return middles(truth.objects, truth.occupancy, voxel_m), np.array([pose["position"] for pose in poses])

    before, origins = standing()
    _, stalled = shelf.carry_out(motion_of(step))
    after, moved_origins = standing()
    ways, toppled = moved(before, after)
    total_m = float(np.linalg.norm(moved_origins - origins, axis=1)[~shelf.gone].sum())
    return ways, toppled, total_m, int(shelf.gone.sum()), stalled


def pushes(folders: list[Path]) -> None:
    """Compares what the first push of episodes does: here in the built-in simulator, there in MuJoCo."""
    table("episode", "moved", "sum, mm", "differ in the mean, mm", "at most, mm", "toppled", "left", "stalled")
    differences, totals = [], []
    for folder in folders:
        episode = read_episode(folder)
        step = next((step for step in episode["steps"] if is_push(step)), None)
        if step is None:
            print(f"{folder}: nothing was pushed", file=sys.stderr)
            continue
        voxel_m = episode["scene"]["shelf"]["voxel_m"]
        ways, toppled = moved(builtin_truth(folder, 0, voxel_m), builtin_truth(folder, step["index"], voxel_m))
        there, toppled_there, total_m, left, stalled = push_there(episode["scene"], step)
        either = [at for at in far(ways) | far(there) if at in ways and at in there]
        off = [1000 * float(np.linalg.norm(ways[at] - there[at])) for at in either]
        differences.extend(off)
        totals.append((1000 * step["displacement_m"], 1000 * total_m))
        row(
            f"`{folder.name}`",
            f"{len(far(ways))} / {len(far(there))}",
            f"{totals[-1][0]:.0f} / {totals[-1][1]:.0f}",
            f"{np.mean(off):.1f}" if off else "–",
            f"{max(off):.1f}" if off else "–",
            f"{toppled} / {toppled_there}",
            f"{len(step['dropped'])} / {left}",
            f"{'yes' if step['push']['stalled'] else 'no'} / {'yes' if stalled else 'no'}",
        )
    if totals:
        summary(np.array(totals), np.array(differences))


def summary(totals: np.ndarray, differences: np.ndarray) -> None:
    """What the pushes say together."""
    here_mm, there_mm = totals.sum(axis=0)
    print(f"\n{len(totals)} pushes: displacements sum up to {here_mm:.0f} mm here, {there_mm:.0f} mm there.")
    if len(totals) > 2:
        print(f"Correlation of the pushes' sums: {np.corrcoef(*totals.T)[0, 1]:.3f}.")
    if len(differences):
        middle, tail = np.quantile(differences, [0.5, 0.9])
        print(f"{len(differences)} objects moved; ways differ by {middle:.1f} mm in the median, {tail:.1f} mm for nine of ten.")


def judged(there: Path, truth_file: Path, scene: dict) -> dict[str, float]:
    """The scores of the last belief of an episode in MuJoCo."""
    lines = truth_file.read_text(encoding="utf-8").splitlines()
    truth = Truth(Shelf(scene), scene, json.loads(lines[-1]))
    belief = np.load(sorted((there / "beliefs").glob("*.npz"))[-1])
    return scores(belief, truth.occupancy, truth.labels, truth.voxel_m)


def compare_scores(folder: Path, there: Path, truth_file: Path) -> None:
    """Prints one row: scores after the last action in both."""
    episode, other = read_episode(folder), read_episode(there)
    last = episode["steps"][-1]["scores"]
    mine = judged(there, truth_file, episode["scene"])
    count = [sum(map(is_push, record["steps"])) for record in (episode, other)]
    names = ["occupancy_iou", "occupied_iou", "semantic_miou"]
    steps = f"{len(episode['steps'])} / {len(other['steps'])}"
    cells = [f"{last[name]:.3f} / {mine[name]:.3f}" for name in names]
    row(f"`{episode['scene']['name']}`", steps, f"{count[0]} / {count[1]}", *cells)


def main() -> None:
    """Does what was typed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["images", "pushes", "scores"])
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--renderer", choices=["rays", "gl"], default="rays")
    typed = parser.parse_args()
    if typed.what == "images":
        images(typed.paths, typed.renderer)
    elif typed.what == "pushes":
        pushes(typed.paths)
    else:
        compare_scores(*typed.paths)


main()
