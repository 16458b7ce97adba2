"""The model of a scene: shelf, objects and arm as MJCF. Lengths in metres, masses in kg, times in seconds."""

import math
import xml.etree.ElementTree as ET

from .robot import ARMATURE, Robot, robot_of, text
from .shapes import Thing, things_of

TIME_STEP_S = 0.002
# Thickness of the panels outside of the shelf's interior.
PANEL_M = 0.02
SHELF_FRICTION = 0.5
TOOL_FRICTION = 0.4
# Groups of geoms: what is seen, and the arm, which is not.
PANELS, OBJECTS, ARM = 1, 2, 3
# Bits of what touches objects: what always does, and the hand, which does not touch what its suction cup holds.
TOUCHED, BY_HAND = 1, 2
# Stiffness of what holds an object on the cup: as that of a contact.
WELD = {"solref": "0.006 1", "solimp": "0.95 0.99 0.0005"}

FRAME = f"""
<mujoco model="shelf">
  <compiler angle="radian" boundmass="0.001" boundinertia="1e-7"/>
  <option timestep="{TIME_STEP_S}" integrator="implicitfast" cone="elliptic" impratio="10" gravity="0 0 -9.81"/>
  <size memory="256M"/>
  <statistic center="0 0.2 0.2" extent="1" meansize="0.05"/>
  <visual>
    <map znear="0.01" zfar="10"/>
    <quality offsamples="0" shadowsize="0" numslices="64"/>
  </visual>
  <default>
    <geom solref="0.006 1" solimp="0.95 0.99 0.0005"/>
    <default class="arm">
      <joint armature="{ARMATURE}" damping="0"/>
      <geom group="{ARM}" contype="1" conaffinity="0" priority="1" density="100"/>
    </default>
  </default>
  <asset/>
  <worldbody>
    <camera name="eye" focalpixel="400 400" sensorsize="0.01 0.01" resolution="640 480" pos="0 0 0"/>
  </worldbody>
</mujoco>
"""


def panels(size) -> list[tuple[list[float], list[float]]]:
    """The lowest and highest corners of board, back, left and right wall, and ceiling; the front is open."""
    x, y, z, t = 0.5 * size[0], size[1], size[2], PANEL_M
    return [
        ([-x - t, 0.0, -t], [x + t, y + t, 0.0]),
        ([-x - t, y, 0.0], [x + t, y + t, z]),
        ([-x - t, 0.0, 0.0], [-x, y, z]),
        ([x, 0.0, 0.0], [x + t, y, z]),
        ([-x - t, 0.0, z], [x + t, y + t, z + t]),
    ]


def add_shelf(world: ET.Element, size) -> None:
    """Adds the panels, which stand still."""
    for number, (low, high) in enumerate(panels(size)):
        middle = text([0.5 * (a + b) for a, b in zip(low, high)])
        half = text([0.5 * (b - a) for a, b in zip(low, high)])
        place = {"pos": middle, "size": half, "group": str(PANELS), "contype": "1", "conaffinity": "0"}
        friction = f"{SHELF_FRICTION} 0.005 0.0001"
        ET.SubElement(world, "geom", name=f"panel{number}", type="box", friction=friction, **place)


def add_thing(world: ET.Element, assets: ET.Element, number: int, thing: Thing) -> None:
    """Adds an object as a free body. Every convex part is a mesh too, for its faces."""
    half = 0.5 * thing.yaw
    turn = [math.cos(half), 0.0, 0.0, math.sin(half)]
    body = ET.SubElement(world, "body", name=f"object{number}", pos=text([*thing.position, 0.0]), quat=text(turn))
    ET.SubElement(body, "freejoint", name=f"object{number}")
    common = {"group": str(OBJECTS), "contype": "1", "conaffinity": str(TOUCHED | BY_HAND)}
    common["friction"] = f"{thing.friction} 0.005 0.0001"
    for part, corners in enumerate(thing.parts):
        name = f"object{number}.{part}"
        ET.SubElement(assets, "mesh", name=name, vertex=text(corners), inertia="convex")
        if thing.primitive is None:
            ET.SubElement(body, "geom", type="mesh", mesh=name, **common)
    if thing.primitive:
        kind, *sizes = thing.primitive
        size = text(sizes[0]) if kind == "box" else text(sizes)
        height = sizes[0][2] if kind == "box" else sizes[1]
        ET.SubElement(body, "geom", type=kind, size=size, pos=text([0, 0, height]), **common)


def add_cup(root: ET.Element, tool: str, count: int) -> None:
    """Adds what can hold an object on the cup, off as yet, for each of so many."""
    equality = ET.SubElement(root, "equality")
    for number in range(count):
        ends = {"name": f"cup{number}", "body1": f"arm/{tool}", "body2": f"object{number}"}
        ET.SubElement(equality, "weld", active="false", **ends, **WELD)


def document(scene: dict) -> tuple[str, list[Thing], Robot]:
    """The model's text, with the objects and the arm that are in it."""
    things, robot = things_of(scene), robot_of(scene)
    root = ET.fromstring(FRAME)
    world, assets = root.find("worldbody"), root.find("asset")
    add_shelf(world, scene["shelf"]["size"])
    for number, thing in enumerate(things):
        add_thing(world, assets, number, thing)
    assets.extend(robot.meshes)
    world.append(robot.body)
    if robot.cup_m is not None:
        add_cup(root, robot.tool, len(things))
    # A contact has the mean of both sides in Nudge; MuJoCo takes the arm's number, which has priority.
    objects = [thing.friction for thing in things] or [SHELF_FRICTION]
    mean = 0.5 * (TOOL_FRICTION + sum(objects) / len(objects))
    root.find("default/default/geom").set("friction", f"{mean} 0.005 0.0001")
    return ET.tostring(root, encoding="unicode"), things, robot
