#!/usr/bin/env python3
"""How the MuJoCo world agrees with the built-in simulator, as tables. Needs `pip install mujoco numpy zstandard`.

    compare_mujoco.py images EPISODE...     the same views in both: the looks of built-in episodes before their first push
    compare_mujoco.py pushes EPISODE...     the same motions in both: the pushes of built-in episodes
    compare_mujoco.py picks EPISODE...      the same for picks, each from where the objects stood before it
    compare_mujoco.py scores EPISODE THERE TRUTH    the last maps of a built-in episode and of one in MuJoCo (THERE), of which
                                            the world wrote the truth (--truth TRUTH)
"""

import argparse
import json
import os
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


# A footprint that shares less than this with what it was has not only been moved along.
SAME_FOOTPRINT = 0.8


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


class There:
    """The same scene in MuJoCo, where the episode's motions are carried out one after the other."""

    def __init__(self, scene: dict):
        self.scene, self.shelf = scene, Shelf(scene)

    def standing(self) -> tuple[dict, np.ndarray]:
        """Middles and heights of the objects, and where their origins are."""
        poses = self.shelf.poses()
        truth = Truth(self.shelf, self.scene, poses)
        found = middles(truth.objects, truth.occupancy, truth.voxel_m)
        return found, np.array([pose["position"] for pose in poses])

    def push(self, step: dict) -> dict:
        """Ways of the middles, how many toppled, the sum of displacements, mm, how many left the shelf, whether it stalled."""
        before, origins = self.standing()
        gone = int(self.shelf.gone.sum())
        stalled = self.shelf.carry_out(motion_of(step)).stalled
        after, moved_origins = self.standing()
        ways, toppled = moved(before, after)
        way_mm = 1000 * np.linalg.norm(moved_origins - origins, axis=1)[~self.shelf.gone].sum()
        left = int(self.shelf.gone.sum()) - gone
        return {"ways": ways, "toppled": toppled, "sum": float(way_mm), "left": left, "stalled": stalled}


def pushes_here(folder: Path, episode: dict):
    """Per push of a built-in episode its step, and the same of what it did."""
    voxel_m, last = episode["scene"]["shelf"]["voxel_m"], 0
    for step in filter(is_push, episode["steps"]):
        truths = [builtin_truth(folder, index, voxel_m) for index in (last, step["index"])]
        ways, toppled = moved(*truths)
        done = {"sum": 1000 * step["displacement_m"], "left": len(step["dropped"]), "stalled": step["push"]["stalled"]}
        yield step, {"ways": ways, "toppled": toppled, **done}
        last = step["index"]


def differences(here: dict, there: dict) -> list[float]:
    """How far apart the ways of the objects are that moved in either, mm."""
    ways = here["ways"], there["ways"]
    either = (far(ways[0]) | far(ways[1])) & ways[0].keys() & ways[1].keys()
    return [1000 * float(np.linalg.norm(ways[0][at] - ways[1][at])) for at in sorted(either)]


def pushes(folders: list[Path]) -> None:
    """Compares what the pushes of episodes do: here in the built-in simulator, there in MuJoCo. The first push of an episode
    meets the same shelf in both, a later one what the pushes before have left."""
    table("episode, push", "moved", "sum, mm", "differ in the mean, mm", "at most, mm", "toppled", "left", "stalled")
    rows: list[tuple[int, float, float, list[float]]] = []
    for folder in folders:
        episode = read_episode(folder)
        there = There(episode["scene"])
        for number, (step, here) in enumerate(pushes_here(folder, episode), start=1):
            other = there.push(step)
            off = differences(here, other)
            rows.append((number, here["sum"], other["sum"], off))
            stalled = " / ".join("yes" if told["stalled"] else "no" for told in (here, other))
            row(
                f"`{folder.name}`, {number}",
                f"{len(far(here['ways']))} / {len(far(other['ways']))}",
                f"{here['sum']:.0f} / {other['sum']:.0f}",
                f"{np.mean(off):.1f}" if off else "–",
                f"{max(off):.1f}" if off else "–",
                f"{here['toppled']} / {other['toppled']}",
                f"{here['left']} / {other['left']}",
                stalled,
            )
    for name, some in [("first", [r for r in rows if r[0] == 1]), ("later", [r for r in rows if r[0] > 1])]:
        if some:
            summary(name, some)


def summary(name: str, rows: list[tuple[int, float, float, list[float]]]) -> None:
    """What some pushes say together."""
    sums = np.array([(here, there) for _, here, there, _ in rows])
    off = [way for *_, ways in rows for way in ways]
    here_mm, there_mm = sums.sum(axis=0)
    print(f"\n{len(rows)} {name} pushes: displacements sum up to {here_mm:.0f} mm here, {there_mm:.0f} mm there.")
    if len(rows) > 2:
        print(f"Correlation of the pushes' sums: {np.corrcoef(*sums.T)[0, 1]:.3f}.")
    if off:
        middle, tail = np.quantile(off, [0.5, 0.9])
        print(f"{len(off)} objects moved; ways differ by {middle:.1f} mm in the median, {tail:.1f} mm for nine of ten.")


def stood(first: np.ndarray, now: np.ndarray, voxel_m: float) -> tuple[dict[int, np.ndarray], set[int], list[int]]:
    """What has become of the objects of an episode, from two maps of them: how far each has moved that has, metres, which are
    gone, and which do not stand as they did."""
    moves, gone, turned = {}, set(), []
    for at in np.unique(first[first < 65535]).tolist():
        cells, there = np.argwhere(first == at), np.argwhere(now == at)
        if len(there) == 0:
            gone.add(at)
            continue
        way = there.mean(axis=0) - cells.mean(axis=0)
        if np.linalg.norm(way) * voxel_m > 0.5 * MOVED_M:
            moves[at] = way * voxel_m
        both = set(map(tuple, cells + np.round(way).astype(int))) & set(map(tuple, there))
        if len(both) < SAME_FOOTPRINT * max(len(cells), len(there)):
            turned.append(at)
    return moves, gone, turned


def carried_there(scene: dict, step: dict, moves: dict[int, np.ndarray], gone: set[int]) -> dict:
    """What a pick does in MuJoCo, with the objects standing so: the end of the grip, the object, the load on the cup, by how much
    the others were displaced in sum, mm, and how many left the shelf."""
    shelf = Shelf(scene)
    for at, way in moves.items():
        shelf.data.qpos[shelf.at_qpos[at] :][:2] += way
    for at in gone:
        shelf.take_away(at)
    shelf.settle()
    origins, left = np.array([pose["position"] for pose in shelf.poses()]), int(shelf.gone.sum())
    moved = shelf.carry_out(motion_of(step))
    ways = np.linalg.norm(np.array([pose["position"] for pose in shelf.poses()]) - origins, axis=1)
    ways[shelf.gone] = 0.0
    if moved.grip == "set_down":
        ways[moved.object] = 0.0
    name = None if moved.object is None else shelf.things[moved.object].name
    left = int((shelf.gone & ~shelf.stowed).sum() - left)
    end = "stalled" if moved.stalled else moved.grip
    return {"end": end, "object": name, "load": moved.load, "sum": 1000 * float(ways.sum()), "left": left}


def picks(folders: list[Path]) -> None:
    """Compares what the picks of episodes do: here in the built-in simulator, there in MuJoCo, each from where the objects stood
    before it here. What stood otherwise than moved along cannot be put there from the files: such picks are left out."""
    table("episode, step", "end", "object", "displaced, mm", "left", "pull, N", "moment, Nm")
    rows: list[tuple[dict, dict]] = []
    out = 0
    for folder in folders:
        episode = read_episode(folder)
        scene, last = episode["scene"], 0
        first = np.load(folder / "truth" / "000.npz")["objects"]
        for step in filter(is_push, episode["steps"]):
            before, last = last, step["index"]
            moves, gone, turned = stood(first, np.load(folder / "truth" / f"{before:03}.npz")["objects"], scene["shelf"]["voxel_m"])
            if step["action"]["kind"] != "pick" or turned:
                out += step["action"]["kind"] == "pick"
                continue
            grip = step["push"].get("grip") or {"end": "stalled", "object": None}
            here = {**grip, "sum": 1000 * step["displacement_m"], "left": len(step["dropped"])}
            there = carried_there(scene, step, moves, gone)
            rows.append((here, there))
            both = [f"{here[name]} / {there[name]}" for name in ("end", "object")]
            sums = f"{here['sum']:.1f} / {there['sum']:.1f}"
            load = ["{:.1f}".format(there["load"][0]), "{:.2f}".format(there["load"][1])] if there["object"] else ["–", "–"]
            row(f"`{folder.name}`, {last}", *both, sums, f"{here['left']} / {there['left']}", *load)
    picks_in_all(rows, out)


def picks_in_all(rows: list[tuple[dict, dict]], out: int) -> None:
    """What picks say together."""
    same = [here["end"] == there["end"] and here["object"] == there["object"] for here, there in rows]
    print(f"\n{sum(same)} of {len(rows)} picks end the same and with the same object; {out} left out.")
    for pair in sorted({(here["end"], there["end"]) for here, there in rows}):
        count = sum((here["end"], there["end"]) == pair for here, there in rows)
        print(f"{pair[0]} here, {pair[1]} there: {count}.")
    sums = np.array([(here["sum"], there["sum"]) for here, there in rows]).reshape(-1, 2)
    print("Objects displaced in sum, mm: {:.1f} here, {:.1f} there.".format(*sums.sum(axis=0)))


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
    table("shelf", "actions", "pushes", "IoU", "occupied IoU", "mIoU")
    row(f"`{episode['scene']['name']}`", steps, f"{count[0]} / {count[1]}", *cells)


def main() -> None:
    """Does what was typed."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("what", choices=["images", "pushes", "picks", "scores"])
    parser.add_argument("paths", nargs="+", type=Path)
    parser.add_argument("--renderer", choices=["rays", "gl"], default="rays")
    typed = parser.parse_args()
    if typed.what == "images":
        images(typed.paths, typed.renderer)
    elif typed.what == "pushes":
        pushes(typed.paths)
    elif typed.what == "picks":
        picks(typed.paths)
    else:
        compare_scores(*typed.paths)


main()
