"""The objects of a scene as convex parts: the catalogue's shapes, scaled, or the parts of a mesh. Lengths in metres."""

import math
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from . import WorldError

ROOT = Path(__file__).resolve().parents[3]
CATALOG = ROOT / "assets" / "catalog.toml"
BACKGROUND = 14
# Corners of a round section; they lie on the circle.
SIDES = 32


@dataclass
class Thing:
    """An object where the scene puts it: it stands on the board, its origin is the centre of its footprint."""

    name: str
    label: int
    position: tuple[float, float]
    yaw: float
    mass_kg: float
    friction: float
    # Corners of the convex parts, each [N, 3].
    parts: list[np.ndarray]
    # ("box", half sizes) or ("cylinder", radius, half height) where the shape is exactly that.
    primitive: tuple | None = field(default=None)


def rounded_rectangle(size, radius: float) -> np.ndarray:
    """The outline of a rectangle with arcs for corners, counter-clockwise, [N, 2]."""
    half = 0.5 * np.asarray(size[:2], float) - radius
    quarter = SIDES // 4
    points: list[tuple[float, float]] = []
    for corner, (sx, sy) in enumerate([(1, 1), (-1, 1), (-1, -1), (1, -1)]):
        for step in range(quarter + 1):
            angle = 2 * math.pi * (corner * quarter + step) / SIDES
            point = (sx * half[0] + radius * math.cos(angle), sy * half[1] + radius * math.sin(angle))
            if all(math.dist(point, other) > 1e-6 for other in points[-1:] + points[:1]):
                points.append(point)
    return np.array(points)


def layers(*pairs) -> np.ndarray:
    """The corners of outlines at heights: (outline, z) each."""
    return np.concatenate([np.column_stack([outline, np.full(len(outline), z)]) for outline, z in pairs])


def catalogue_parts(shape: dict) -> list[np.ndarray]:
    """The convex parts of a shape of the catalogue."""
    kind = shape["kind"]
    if kind == "cylinder":
        circle = rounded_rectangle([2 * shape["radius_m"]] * 2, shape["radius_m"])
        return [layers((circle, 0.0), (circle, shape["height_m"]))]
    x, y, z = shape["size_m"]
    if kind == "box":
        section = rounded_rectangle((x, y), 0.0)
        return [layers((section, 0.0), (section, z))]
    if kind == "rounded_box":
        section = rounded_rectangle((x, y), shape["corner_radius_m"])
        return [layers((section, 0.0), (section, z))]
    if kind == "bottle":
        section = rounded_rectangle((x, y), 0.5 * min(x, y))
        neck = rounded_rectangle([2 * shape["neck_radius_m"]] * 2, shape["neck_radius_m"])
        body = layers((section, 0.0), (section, shape["body_m"]), (neck, shape["neck_from_m"]))
        return [body, layers((neck, shape["neck_from_m"]), (neck, z))]
    if kind == "carton":
        walls, seal = rounded_rectangle((x, y), 0.0), rounded_rectangle((x, shape["seal_m"]), 0.0)
        body = layers((walls, 0.0), (walls, shape["walls_m"]), (seal, shape["ridge_m"]))
        return [body, layers((seal, shape["ridge_m"]), (seal, z))]
    raise WorldError(f"the catalogue's shape `{kind}` is not known here")


def primitive_of(shape: dict, scale: np.ndarray) -> tuple | None:
    """The shape as a box or a cylinder of MuJoCo's own, if it is one."""
    if shape["kind"] == "box":
        return ("box", 0.5 * np.asarray(shape["size_m"]) * scale)
    if shape["kind"] == "cylinder" and abs(scale[0] - scale[1]) < 1e-6:
        return ("cylinder", shape["radius_m"] * scale[0], 0.5 * shape["height_m"] * scale[2])
    return None


def read_catalogue() -> list[dict]:
    """The classes in their fixed order: their position is their label."""
    try:
        return tomllib.loads(CATALOG.read_text(encoding="utf-8"))["class"]
    except (OSError, KeyError, ValueError) as error:
        raise WorldError(f"{CATALOG}: {error}") from None


def things_of(scene: dict) -> list[Thing]:
    """The objects of a scene, in its order."""
    classes = read_catalogue()
    labels = {known["name"]: label for label, known in enumerate(classes)}
    return [thing_of(scene, at, placed, classes, labels) for at, placed in enumerate(scene["objects"])]


def thing_of(scene: dict, at: int, placed: dict, classes: list[dict], labels: dict[str, int]) -> Thing:
    """One object of a scene."""
    name = placed["class"]
    if name not in labels:
        raise WorldError(f"object {at} is of the unknown class `{name}`; there are {', '.join(labels)}")
    known = classes[labels[name]]
    scale = np.asarray(placed.get("scale", [1.0, 1.0, 1.0]), float)
    own, meshes = placed.get("mesh"), scene.get("meshes", {})
    if own is not None and own not in meshes:
        raise WorldError(f"object {at} has the mesh `{own}`, which is not in the scene")
    mesh = meshes.get(own if own is not None else name)
    parts = mesh["parts"] if mesh else catalogue_parts(known["shape"])
    return Thing(
        name=f"{name}#{at}",
        label=labels[name],
        position=(float(placed["position"][0]), float(placed["position"][1])),
        yaw=math.radians(placed.get("yaw_deg", 0.0)),
        mass_kg=known["mass_kg"] * float(np.prod(scale)),
        friction=known["friction"],
        parts=[np.asarray(part, float) * scale for part in parts],
        primitive=None if mesh else primitive_of(known["shape"], scale),
    )
