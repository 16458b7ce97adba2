"""The arm of a scene: its URDF file as bodies of MuJoCo. Lengths in metres, angles in radians."""

import math
import xml.etree.ElementTree as ET
from dataclasses import dataclass

import numpy as np

from . import WorldError
from .shapes import ROOT

SHIPPED = ROOT / "assets" / "robots" / "ur5_2f85.urdf"
# What a tool's link is called where the scene does not say.
TOOL_LINKS = ["tool", "tool0", "tcp", "ee_link", "tool_link"]
# A link with a cylinder as wide as the rim, of a hand that holds by suction.
CUP_LINK = "suction_cup"
# So much added to the arm's inertia, kg m^2, that nothing it touches changes how it moves.
ARMATURE = 1e4


@dataclass
class Robot:
    """An arm as parts of a model."""

    body: ET.Element
    meshes: list[ET.Element]
    # The joints from the base to the tool.
    joints: list[str]
    # The link that is the tool, and the radius of the suction cup's rim, metres, where there is one.
    tool: str
    cup_m: float | None


def text(numbers) -> str:
    """Numbers as an attribute."""
    return " ".join(repr(float(number)) for number in np.ravel(numbers))


def quaternion(rpy) -> list[float]:
    """w, x, y, z of a URDF's fixed-axis roll, pitch and yaw."""
    (cr, sr), (cp, sp), (cy, sy) = [(math.cos(0.5 * angle), math.sin(0.5 * angle)) for angle in rpy]
    return [
        cr * cp * cy + sr * sp * sy,
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
    ]


def numbers(element: ET.Element | None, name: str, default: str) -> list[float]:
    """An attribute's numbers."""
    value = default if element is None else element.get(name, default)
    return [float(word) for word in value.split()]


def frame(element: ET.Element) -> dict[str, str]:
    """The pose of an element's `origin` as attributes of MuJoCo."""
    origin = element.find("origin")
    rpy = numbers(origin, "rpy", "0 0 0")
    return {"pos": text(numbers(origin, "xyz", "0 0 0")), "quat": text(quaternion(rpy))}


class Reader:
    """Walks through a URDF file from its root."""

    def __init__(self, source: str, document: str, hulls: dict, tool: str | None):
        self.source, self.hulls, self.meshes = source, hulls, []
        try:
            root = ET.fromstring(document)
        except ET.ParseError as error:
            raise WorldError(f"{source}: no URDF file: {error}") from None
        self.links = {link.get("name"): link for link in root.findall("link")}
        joints = root.findall("joint")
        self.above = {joint.find("child").get("link"): joint for joint in joints}
        self.below: dict[str, list[ET.Element]] = {}
        for joint in joints:
            self.below.setdefault(joint.find("parent").get("link"), []).append(joint)
        roots = [name for name in self.links if name not in self.above]
        names = [tool] if tool else TOOL_LINKS
        self.tool = next((name for name in names if name in self.links), None)
        if len(roots) != 1 or self.tool is None:
            raise WorldError(f"{source}: needs one root link and a link `{names[0]}`")
        self.root = roots[0]
        self.chain = self.joints_to(self.tool)

    def joints_to(self, link: str) -> list[str]:
        """The moving joints from the root to a link."""
        chain: list[str] = []
        while link in self.above:
            joint = self.above[link]
            if joint.get("type") != "fixed":
                chain.insert(0, joint.get("name"))
            link = joint.find("parent").get("link")
        return chain

    def robot(self, placement: dict) -> Robot:
        """The arm where the scene puts it. The base and what is fixed to it meet nothing."""
        yaw = math.radians(placement.get("yaw_deg", 0.0))
        where = {"pos": text(placement.get("base", [0.0, -0.70, -0.015])), "quat": text(quaternion([0, 0, yaw]))}
        return Robot(self.body(self.root, where, moves=False), self.meshes, self.chain, self.tool, self.cup())

    def cup(self) -> float | None:
        """The radius of the suction cup's rim, metres, if the hand has one."""
        if CUP_LINK not in self.links:
            return None
        cylinders = self.links[CUP_LINK].iterfind("collision/geometry/cylinder")
        radii = [float(cylinder.get("radius")) for cylinder in cylinders]
        if not radii or self.joints_to(CUP_LINK) != self.chain:
            raise WorldError(f"{self.source}: `{CUP_LINK}` must be fixed to the hand and have a cylinder as wide as its rim")
        return max(radii)

    def body(self, link: str, where: dict[str, str], moves: bool) -> ET.Element:
        """A link with what hangs from it."""
        body = ET.Element("body", name=f"arm/{link}", gravcomp="1", **where)
        if link == self.tool:
            ET.SubElement(body, "site", name="arm/tip", group="5")
        for joint in self.below.get(link, []):
            name, child = joint.get("name"), joint.find("child").get("link")
            turns = name in self.chain
            below = self.body(child, frame(joint), moves or turns)
            if turns:
                below.insert(0, self.joint(joint))
            body.append(below)
        if moves:
            body.extend(self.shapes(link))
        return body

    def joint(self, joint: ET.Element) -> ET.Element:
        """A joint that goes where it is sent."""
        kind = {"revolute": "hinge", "continuous": "hinge", "prismatic": "slide"}.get(joint.get("type"))
        if kind is None:
            raise WorldError(f"{self.source}: joint {joint.get('name')} is {joint.get('type')}")
        axis = text(numbers(joint.find("axis"), "xyz", "1 0 0"))
        return ET.Element("joint", {"name": f"arm/{joint.get('name')}", "type": kind, "axis": axis, "class": "arm"})

    def shapes(self, link: str) -> list[ET.Element]:
        """The collision shapes of a link; its visuals where it has none."""
        found = self.links[link].findall("collision")
        stand_in = not found
        geoms = []
        for shape in found or self.links[link].findall("visual"):
            geom = self.shape(shape.find("geometry")[0], frame(shape), stand_in)
            if geom is not None:
                geoms.append(geom)
        return geoms

    def shape(self, shape: ET.Element, where: dict[str, str], stand_in: bool) -> ET.Element | None:
        """One collision shape."""
        size = {
            "box": lambda: [0.5 * side for side in numbers(shape, "size", "")],
            "cylinder": lambda: [float(shape.get("radius")), 0.5 * float(shape.get("length"))],
            "capsule": lambda: [float(shape.get("radius")), 0.5 * float(shape.get("length"))],
            "sphere": lambda: [float(shape.get("radius"))],
        }
        if shape.tag in size:
            return ET.Element("geom", {"type": shape.tag, "size": text(size[shape.tag]()), "class": "arm", **where})
        file = shape.get("filename", "")
        if file not in self.hulls:
            if stand_in:
                return None
            raise WorldError(f"{self.source}: the mesh `{file}` is not in the scene")
        name = f"arm/mesh{len(self.meshes)}"
        corners = np.asarray(self.hulls[file], float) * numbers(shape, "scale", "1 1 1")
        self.meshes.append(ET.Element("mesh", name=name, vertex=text(corners)))
        return ET.Element("geom", {"type": "mesh", "mesh": name, "class": "arm", **where})


def robot_of(scene: dict) -> Robot:
    """The arm of a scene: its own URDF file, or the one that comes with Nudge."""
    placement = scene.get("robot") or {}
    own = placement.get("urdf")
    if own:
        reader = Reader(own["source"], own["text"], own.get("meshes", {}), own.get("tool"))
    else:
        try:
            reader = Reader(SHIPPED.name, SHIPPED.read_text(encoding="utf-8"), {}, None)
        except OSError as error:
            raise WorldError(f"{SHIPPED}: {error.strerror}") from None
    return reader.robot(placement)
