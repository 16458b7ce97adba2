"""The shelf as MuJoCo simulates it: objects settle, a motion of the arm is carried out, what falls is taken away.

Every number here is of Nudge's built-in simulator (core/src/world), so that two physics engines differ and not two worlds.
"""

import mujoco
import numpy as np

from . import WorldError
from .camera import Camera
from .model import ARM, TIME_STEP_S, document
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
# Largest speed on the way back, of the tip, m/s, and of a joint, rad/s.
WAY_BACK_M_S = 0.50
JOINT_SPEED = 3.0
# Shares of speed lost per second, stand-ins for rolling resistance.
LINEAR_DAMPING = 0.1
ANGULAR_DAMPING = 1.0


class Timed:
    """A path of the joints: straight from stop to stop."""

    def __init__(self, at_s, joints):
        self.at_s, self.joints = np.asarray(at_s, float), np.asarray(joints, float)

    def at(self, time_s: float) -> np.ndarray:
        """The joints at a time, seconds since it began."""
        return np.array([np.interp(time_s, self.at_s, values) for values in self.joints.T])


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
        self.is_arm = model.geom_group == ARM
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
        self.model.geom_contype[self.is_arm] = int(touches)

    def force_on_arm_n(self) -> float:
        """Sum of the normal forces on the arm, newtons."""
        contacts = self.data.contact
        if len(contacts.geom) == 0:
            return 0.0
        touching = self.is_arm[contacts.geom].any(axis=1) & (contacts.efc_address >= 0)
        return float(self.data.efc_force[contacts.efc_address[touching]].sum())

    def carry_out(self, move: dict) -> tuple[int, bool]:
        """Carries out a motion of the protocol. Returns how many stops before the retreat it passed, and whether it stalled."""
        phases = move.get("phases") or []
        self.check(move, phases)
        outward = [phase for phase in phases if phase["kind"] != "retreat"]
        order = self.order(move.get("joint_names"))
        passed: list[np.ndarray] = []
        last, stalled = None, False
        self.let_arm_touch(True)
        for phase in outward:
            way = Timed(phase["at_s"], np.asarray(phase["joints"], float)[:, order])
            last, blocked_s = self.ride(way)
            passed.extend(way.joints[way.at_s < (np.inf if blocked_s is None else blocked_s)])
            if blocked_s is not None:
                stalled = True
                break
        count = len(passed)
        retreats = [phase for phase in phases if phase["kind"] == "retreat"]
        if retreats and not stalled:
            for phase in retreats:
                self.ride(Timed(phase["at_s"], np.asarray(phase["joints"], float)[:, order]))
        else:
            self.ride(self.way_back([*passed, last]))
        self.let_arm_touch(False)
        self.settle()
        return count, stalled

    def check(self, move: dict, phases: list[dict]) -> None:
        """Refuses what cannot be carried out here."""
        if not any(phase["kind"] != "retreat" for phase in phases):
            raise WorldError("a motion without a way out")
        for phase in phases:
            kind, at_s, joints = phase["kind"], phase["at_s"], phase["joints"]
            if kind not in ("approach", "contact", "retreat"):
                raise WorldError(f"a phase `{kind}`: nothing can be held in this world")
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

    def ride(self, way: Timed) -> tuple[np.ndarray, float | None]:
        """Moves the arm along a path. Returns where it is then, and when it was blocked, seconds since it began."""
        steps = int(np.ceil(way.at_s[-1] / TIME_STEP_S))
        joints, pressed = way.at(0.0), 0
        for step in range(1, steps + 1):
            ahead = way.at(step * TIME_STEP_S)
            self.hold_arm(joints, (ahead - joints) / TIME_STEP_S)
            mujoco.mj_step(self.model, self.data)
            joints = ahead
            pressed = pressed + 1 if self.force_on_arm_n() > BLOCKING_FORCE_N else 0
            if pressed * TIME_STEP_S >= BLOCKED_S:
                pressed = 0
                if step < steps:
                    return joints, step * TIME_STEP_S
            self.note_drops()
        self.hold_arm(joints, 0.0)
        return joints, None

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
        """Where the objects are: position, quaternion x, y, z, w, and whether it has left the shelf."""
        found = []
        for at, thing in enumerate(self.things):
            place = self.data.qpos[self.at_qpos[at] :][:7]
            quaternion = [*place[4:7].tolist(), float(place[3])]
            found.append({
                "object": thing.name,
                "position": place[:3].tolist(),
                "quaternion": quaternion,
                "gone": bool(self.gone[at]),
            })
        return found
