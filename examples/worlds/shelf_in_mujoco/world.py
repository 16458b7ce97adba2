"""The shelf as MuJoCo simulates it: objects settle, a motion of the arm is carried out, what falls is taken away.

Every number here is of Nudge's built-in simulator (core/src/world), so that two physics engines differ and not two worlds.
"""

from dataclasses import dataclass

import mujoco
import numpy as np

from . import WorldError
from .camera import Camera
from .cup import OPEN, Cup
from .model import ARM, BY_HAND, TIME_STEP_S, TOUCHED, document
from .motion import JOINT_SPEED, Timed, along
from .shapes import BACKGROUND

# Force on the arm, newtons, from which it counts as blocked, and for how long, seconds.
BLOCKING_FORCE_N = 60.0
BLOCKED_S = 8 / 240
# At rest: no point faster than this, m/s, for so long, seconds; what still moves later than that is stopped.
REST_SPEED_M_S = 0.005
REST_S = 0.2
SETTLE_LIMIT_S = 4.0
# How far below the board a centre of mass must be for the object to be taken away, metres.
FALL_M = 0.10
# Largest speed of the tip on the way back, and with something in hand, m/s.
WAY_BACK_M_S = 0.50
CARRY_M_S = 0.15
# Poses along a straight line are at most so far apart, metres; a joint that turns by more between two jumps, radians.
LINE_STEP_M = 0.01
JUMP_RAD = 0.35
# Shares of speed lost per second, stand-ins for rolling resistance.
LINEAR_DAMPING = 0.1
ANGULAR_DAMPING = 1.0


@dataclass
class Moved:
    """What became of a motion."""

    # Stops before the retreat that the arm passed.
    passed: int = 0
    stalled: bool = False
    # How holding something ended (`no_seal`, `came_off`, `set_down`, `stowed`), and which object it was.
    grip: str | None = None
    object: int | None = None
    # The largest force, newtons, and moment about the cup, newton metres, with which it was loaded.
    load: tuple[float, float] = (0.0, 0.0)


@dataclass
class Ride:
    """How a path ended: where the arm is, when it stopped, seconds since it began, and what a cup that feels met then."""

    joints: np.ndarray
    stopped_s: float | None = None
    touch: int | str = OPEN


class Shelf:
    """A scene in MuJoCo."""

    def __init__(self, scene: dict, camera: str = "rays"):
        text, self.things, robot = document(scene)
        try:
            self.model = mujoco.MjModel.from_xml_string(text)
        except ValueError as error:
            raise WorldError(f"MuJoCo does not take the scene: {' '.join(str(error).split())}") from None
        self.size = np.asarray(scene["shelf"]["size"], float)
        self.data, self.scratch = mujoco.MjData(self.model), mujoco.MjData(self.model)
        model, count = self.model, len(self.things)
        self.bodies = np.array([model.body(f"object{at}").id for at in range(count)], int)
        joints = [model.joint(f"object{at}") for at in range(count)]
        self.at_qpos = np.array([joint.qposadr[0] for joint in joints], int)
        self.at_qvel = np.array([joint.dofadr[0] for joint in joints], int)
        self.arm_joints = robot.joints
        arm = [model.joint(f"arm/{name}") for name in robot.joints]
        self.arm_qpos = np.array([joint.qposadr[0] for joint in arm], int)
        self.arm_qvel = np.array([joint.dofadr[0] for joint in arm], int)
        self.tip = model.site("arm/tip").id
        self.gone = np.zeros(count, bool)
        self.stowed = np.zeros(count, bool)
        self.is_arm = model.geom_group == ARM
        tool = model.body(f"arm/{robot.tool}").id
        self.is_hand = self.is_arm & (model.body_weldid[model.geom_bodyid] == model.body_weldid[tool])
        object_of = np.full(model.nbody, -1)
        object_of[self.bodies] = np.arange(count)
        self.cup = None if robot.cup_m is None else Cup(model, self.data, robot.cup_m, object_of, tool)
        self.weigh()
        self.let_arm_touch(False)
        self.camera = Camera(model, self.labels(), camera)
        self.settle()

    def labels(self) -> np.ndarray:
        """The class of every geom."""
        labels = np.full(self.model.ngeom, BACKGROUND)
        for body, thing in zip(self.bodies, self.things):
            labels[self.model.geom_bodyid == body] = thing.label
        return labels

    def weigh(self) -> None:
        """Gives the objects their masses and what slows them."""
        model = self.model
        self.reach = np.zeros(len(self.things))
        for at, (body, thing) in enumerate(zip(self.bodies, self.things)):
            share = thing.mass_kg / model.body_mass[body]
            model.body_mass[body] *= share
            model.body_inertia[body] *= share
            damping = model.dof_damping[self.at_qvel[at] :][:6]
            damping[:3] = LINEAR_DAMPING * thing.mass_kg
            damping[3:] = ANGULAR_DAMPING * model.body_inertia[body].mean()
            self.reach[at] = max(np.linalg.norm(part - model.body_ipos[body], axis=1).max() for part in thing.parts)
        mujoco.mj_setConst(model, self.data)

    def settle(self) -> None:
        """Lets the objects come to rest, and takes their last speed from them."""
        model, data = self.model, self.data
        still = 0
        for _ in range(round(SETTLE_LIMIT_S / TIME_STEP_S)):
            self.hold_arm(data.qpos[self.arm_qpos], 0.0)
            mujoco.mj_step(model, data)
            self.note_drops()
            still = still + 1 if self.fastest() < REST_SPEED_M_S else 0
            if still * TIME_STEP_S >= REST_S:
                break
        for at in self.at_qvel:
            data.qvel[at : at + 6] = 0.0
        mujoco.mj_forward(model, data)
        outside = (data.xipos[self.bodies] < [-0.5 * self.size[0], 0.0, 0.0]).any(axis=1)
        outside |= (data.xipos[self.bodies, :2] > [0.5 * self.size[0], self.size[1]]).any(axis=1)
        for at in np.flatnonzero(outside & ~self.gone):
            self.take_away(at)
        mujoco.mj_forward(model, data)

    def fastest(self) -> float:
        """An upper bound on the speed of the fastest point of any object, m/s."""
        if self.gone.all():
            return 0.0
        speeds = self.data.qvel[self.at_qvel[:, None] + np.arange(6)]
        linear, angular = np.linalg.norm(speeds[:, :3], axis=1), np.linalg.norm(speeds[:, 3:], axis=1)
        return float((linear + self.reach * angular)[~self.gone].max())

    def note_drops(self) -> None:
        """Takes away what has fallen past the board."""
        fallen = (self.data.xipos[self.bodies, 2] < -FALL_M) & ~self.gone
        for at in np.flatnonzero(fallen):
            self.take_away(at)

    def take_away(self, at: int) -> None:
        """Puts an object where it meets nothing, weightless."""
        model, data, body = self.model, self.data, self.bodies[at]
        self.gone[at] = True
        if self.cup is not None and self.cup.held == at:
            self.cup.let_go()
        geoms = model.geom_bodyid == body
        model.geom_contype[geoms] = model.geom_conaffinity[geoms] = 0
        model.body_gravcomp[body] = 1.0
        data.qpos[self.at_qpos[at] :][:3] = [10.0 + at, 10.0, -10.0]
        data.qvel[self.at_qvel[at] :][:6] = 0.0

    def hold_arm(self, joints, speeds) -> None:
        """Puts the arm there, at these speeds: nothing that it touches changes how it moves."""
        self.data.qpos[self.arm_qpos] = joints
        self.data.qvel[self.arm_qvel] = speeds

    def let_arm_touch(self, touches: bool) -> None:
        """Whether objects feel the arm: only while it moves."""
        self.model.geom_contype[self.is_arm] = TOUCHED if touches else 0
        self.model.geom_contype[self.is_hand] = BY_HAND if touches else 0

    def force_on_arm_n(self) -> float:
        """Sum of the normal forces on the arm, newtons."""
        contacts = self.data.contact
        if len(contacts.geom) == 0:
            return 0.0
        touching = self.is_arm[contacts.geom].any(axis=1) & (contacts.efc_address >= 0)
        return float(self.data.efc_force[contacts.efc_address[touching]].sum())

    def carry_out(self, move: dict) -> Moved:
        """Carries out a motion of the protocol, and lets the objects come to rest."""
        phases = move.get("phases") or []
        self.check(move, phases)
        order = self.order(move.get("joint_names"))
        ways = [(phase["kind"], Timed(phase["at_s"], np.asarray(phase["joints"], float)[:, order])) for phase in phases]
        self.let_arm_touch(True)
        moved, way_back = self.outward([(kind, way) for kind, way in ways if kind != "retreat"])
        if self.cup is not None:
            if moved.object is not None:
                moved.load = tuple(self.cup.most.tolist())
            self.cup.let_go()
        retreats = [way for kind, way in ways if kind == "retreat"]
        is_done = not moved.stalled and moved.grip in (None, "set_down", "stowed")
        for way in retreats if retreats and is_done else [self.way_back(way_back)]:
            self.ride(way)
        self.let_arm_touch(False)
        self.settle()
        return moved

    def outward(self, ways: list[tuple[str, Timed]]) -> tuple[Moved, list[np.ndarray]]:
        """Carries out the phases before the retreat. Returns what became of them, and the configurations that were passed."""
        moved, passed = Moved(), []
        carries = any(kind == "carry" for kind, _ in ways)
        sealed_at = None
        for kind, way in ways:
            feels = carries and kind == "contact"
            if kind == "stow" and moved.grip is not None:
                self.stow()
                moved.grip = "stowed"
            # The way with what the cup holds begins where it sealed.
            ridden = way if sealed_at is None else self.lifted_from(sealed_at, way)
            ride, sealed_at = self.ride(ridden, feels), None
            passed.extend(ridden.joints[: ridden.before(ride.stopped_s)])
            last = ride.joints
            if feels and isinstance(ride.touch, int):
                moved.grip, moved.object = "set_down", ride.touch
                self.cup.hold(ride.touch)
                sealed_at = last
            elif feels:
                moved.grip = "no_seal"
            elif ride.stopped_s is not None:
                moved.stalled = moved.grip is None
                moved.grip = moved.grip and "came_off"
            is_over = moved.grip == "no_seal" or (ride.stopped_s is not None and sealed_at is None)
            moved.passed += way.before(ride.stopped_s if is_over else None)
            if is_over:
                break
        return moved, [*passed, last]

    def stow(self) -> None:
        """Lays what the cup holds down beside the robot."""
        if self.cup.held is not None:
            self.stowed[self.cup.held] = True
            self.take_away(self.cup.held)

    def check(self, move: dict, phases: list[dict]) -> None:
        """Refuses what cannot be carried out here."""
        if not any(phase["kind"] != "retreat" for phase in phases):
            raise WorldError("a motion without a way out")
        for phase in phases:
            kind, at_s, joints = phase["kind"], phase["at_s"], phase["joints"]
            if kind not in ("approach", "contact", "carry", "stow", "retreat"):
                raise WorldError(f"a phase `{kind}` is not known here")
            if kind in ("carry", "stow") and self.cup is None:
                raise WorldError(f"a phase `{kind}`: nothing can be held in this world by an arm without a suction cup")
            if phase.get("opening_m", 0.0) != 0.0:
                raise WorldError("the fingers do not open in this world")
            if not at_s or len(at_s) != len(joints) or any(len(stop) != len(self.arm_joints) for stop in joints):
                raise WorldError(f"a phase `{kind}` whose stops are not {len(self.arm_joints)} joints each")

    def order(self, names: list[str] | None) -> list[int]:
        """Where the arm's joints are in the stops of a motion. What was done before comes without names, in the chain's order."""
        if not names:
            return list(range(len(self.arm_joints)))
        if sorted(names) != sorted(self.arm_joints):
            raise WorldError(f"the joints {', '.join(names)}, where the arm has {', '.join(self.arm_joints)}")
        return [names.index(name) for name in self.arm_joints]

    def ride(self, way: Timed, feels: bool = False) -> Ride:
        """Moves the arm along a path, until it is blocked or loses what it holds; an arm that feels, until its cup seals or its
        bellows gives way no farther."""
        steps = int(np.ceil(way.at_s[-1] / TIME_STEP_S))
        joints, pressed = way.at(0.0), 0
        for step in range(1, steps + 1):
            ahead = way.at(step * TIME_STEP_S)
            self.hold_arm(joints, (ahead - joints) / TIME_STEP_S)
            mujoco.mj_step(self.model, self.data)
            joints = ahead
            pressed = pressed + 1 if self.force_on_arm_n() > BLOCKING_FORCE_N else 0
            stops = pressed * TIME_STEP_S >= BLOCKED_S
            if stops:
                pressed = 0
            if self.cup is not None and self.cup.held is not None:
                stops |= self.cup.comes_off()
            touch = self.feel(joints) if feels else OPEN
            if touch != OPEN or (stops and step < steps):
                return Ride(joints, step * TIME_STEP_S, touch)
            self.note_drops()
        self.hold_arm(joints, 0.0)
        return Ride(joints)

    def feel(self, joints: np.ndarray) -> int | str:
        """What the cup meets with the arm there."""
        self.hold_arm(joints, 0.0)
        return self.cup.touch()

    def lifted_from(self, start: np.ndarray, way: Timed) -> Timed:
        """The first way with something in hand, from where the cup sealed: the same, straight and without turning, and then to
        where that way ends."""
        last = way.joints[-1]
        lift = self.line(start, self.tip_at(last) - self.tip_at(way.joints[0]))
        lifted, drawn = [along(path, [self.tip_at(at) for at in path], CARRY_M_S) for path in (lift, [lift[-1], last])]
        return lifted.then(drawn)

    def line(self, start: np.ndarray, travel: np.ndarray) -> list[np.ndarray]:
        """Configurations along a straight line of the tip, without turning it, as far as the joints follow."""
        path, steps = [start], int(np.ceil(np.linalg.norm(travel) / LINE_STEP_M - 1e-6))
        tip = self.tip_at(start)
        turn = self.scratch.site_xmat[self.tip].reshape(3, 3).copy()
        for step in range(1, steps + 1):
            joints = self.reached(path[-1], tip + travel * step / steps, turn)
            if joints is None or np.abs(joints - path[-1]).max() > JUMP_RAD:
                break
            path.append(joints)
        return path

    def reached(self, start: np.ndarray, place: np.ndarray, turn: np.ndarray) -> np.ndarray | None:
        """The configuration near another in which the tip is there, turned so: by Newton's method."""
        model, data, joints = self.model, self.scratch, start.copy()
        shift, spin = np.zeros((3, model.nv)), np.zeros((3, model.nv))
        for _ in range(20):
            off = np.concatenate([place - self.tip_at(joints), np.zeros(3)])
            now = data.site_xmat[self.tip].reshape(3, 3)
            # The three axes' cross products are twice the turn that is left, where it is small.
            off[3:] = 0.5 * np.cross(now.T, turn.T).sum(axis=0)
            if np.abs(off).max() < 1e-9:
                return joints
            mujoco.mj_comPos(model, data)
            mujoco.mj_jacSite(model, data, shift, spin, self.tip)
            jacobian = np.concatenate([shift, spin])[:, self.arm_qvel]
            joints = joints + np.linalg.lstsq(jacobian, off, rcond=1e-9)[0]
        return None

    def way_back(self, passed: list[np.ndarray]) -> Timed:
        """The way through these stops, backwards."""
        path = passed[::-1]
        tips = [self.tip_at(joints) for joints in path]
        at_s = [0.0]
        for (a, b), (tip_a, tip_b) in zip(zip(path, path[1:]), zip(tips, tips[1:])):
            step = max(np.abs(b - a).max() / JOINT_SPEED, np.linalg.norm(tip_b - tip_a) / WAY_BACK_M_S)
            at_s.append(at_s[-1] + max(step, 1e-6))
        return Timed(at_s, path)

    def tip_at(self, joints: np.ndarray) -> np.ndarray:
        """Where the finger tip is, metres."""
        self.scratch.qpos[self.arm_qpos] = joints
        mujoco.mj_kinematics(self.model, self.scratch)
        return self.scratch.site_xpos[self.tip].copy()

    def look(self, position, quaternion, camera: dict) -> tuple[np.ndarray, np.ndarray]:
        """Depth (float32, metres) and labels (uint8) from there. The arm is not in the picture."""
        return self.camera.image(self.data, position, quaternion, camera)

    def poses(self) -> list[dict]:
        """Where the objects are: position, quaternion x, y, z, w, whether it has left the shelf, and if to beside the robot."""
        found = []
        for at, thing in enumerate(self.things):
            place = self.data.qpos[self.at_qpos[at] :][:7]
            quaternion = [*place[4:7].tolist(), float(place[3])]
            found.append({
                "object": thing.name,
                "position": place[:3].tolist(),
                "quaternion": quaternion,
                "gone": bool(self.gone[at]),
                "stowed": bool(self.stowed[at]),
            })
        return found
