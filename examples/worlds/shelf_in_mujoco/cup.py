"""A suction cup: when it seals on an object, and when what it holds comes off (core/src/world/physics/suction.rs).

Its rim is at the arm's tool, which points along its z. What it holds is welded to the hand; the force of that weld is the load.
"""

import mujoco
import numpy as np

from .model import BY_HAND, OBJECTS, TIME_STEP_S, TOUCHED

# How far the bellows gives way, and how far before the rim the lip still meets a surface, metres.
STROKE_M = 0.008
LIP_M = 0.002
# Load and moment about the cup's middle from which what it holds comes off, newtons and newton metres, and for how long.
PULL_N = 30.0
BEND_NM = 1.5
LOADED_S = 8 / 240
# Points of the rim that have to meet the object, and how far behind it their rays begin, metres.
RIM_POINTS = 16
BEHIND_M = 0.03
EQUALITY = int(mujoco.mjtConstraint.mjCNSTR_EQUALITY)

# What the cup meets: nothing that holds, or more than the bellows gives way. A number is that of the object it seals on.
OPEN = "open"
PRESSED = "pressed"


class Cup:
    """The cup of an arm. `radius_m` is its rim's; `object_of` the number of the object that a body is, -1 for none."""

    def __init__(self, model, data, radius_m: float, object_of: np.ndarray, tool: int):
        self.model, self.data, self.object_of, self.tool = model, data, object_of, tool
        angles = 2 * np.pi * np.arange(RIM_POINTS) / RIM_POINTS
        self.rim = np.column_stack([radius_m * np.cos(angles), radius_m * np.sin(angles), np.full(RIM_POINTS, -BEHIND_M)])
        self.groups = np.zeros(6, np.uint8)
        self.groups[OBJECTS] = 1
        self.held: int | None = None
        self.loaded_s = 0.0
        # The largest force and moment while it held something last.
        self.most = np.zeros(2)

    def place(self) -> tuple[np.ndarray, np.ndarray]:
        """Where the rim's middle is, and how it is turned."""
        return self.data.xpos[self.tool].copy(), self.data.xmat[self.tool].reshape(3, 3).copy()

    def touch(self) -> int | str:
        """The number of the object that all of the rim meets within the bellows' stroke, or `OPEN`, or `PRESSED`."""
        mujoco.mj_kinematics(self.model, self.data)
        middle, turn = self.place()
        geom, met = np.zeros(1, np.int32), []
        for point in self.rim @ turn.T + middle:
            way = mujoco.mj_ray(self.model, self.data, point, turn[:, 2], self.groups, True, -1, geom, None)
            found = geom[0] >= 0 and way <= BEHIND_M + LIP_M
            met.append((int(self.object_of[self.model.geom_bodyid[geom[0]]]), way) if found else None)
        if any(one is not None and one[1] < BEHIND_M - STROKE_M for one in met):
            return PRESSED
        objects = {None if one is None else one[0] for one in met}
        return OPEN if None in objects or len(objects) > 1 else objects.pop()

    def hold(self, at: int) -> None:
        """Welds an object to the hand, as they are to each other now; the two touch no more."""
        model, data, body = self.model, self.data, self.model.body(f"object{at}").id
        middle, turn = self.place()
        thing, to_thing, between = data.xmat[body].reshape(3, 3), np.zeros(4), np.zeros(4)
        mujoco.mju_negQuat(to_thing, data.xquat[self.tool])
        mujoco.mju_mulQuat(between, to_thing, data.xquat[body])
        weld = model.equality(f"cup{at}").id
        # The rim's middle in the object's frame and in the hand's, and how the object is turned to the hand.
        model.eq_data[weld, :10] = [*(thing.T @ (middle - data.xpos[body])), 0.0, 0.0, 0.0, *between]
        data.eq_active[weld] = 1
        model.geom_conaffinity[model.geom_bodyid == body] = TOUCHED
        self.held, self.loaded_s, self.most = at, 0.0, np.zeros(2)

    def load(self) -> tuple[float, float]:
        """Force and moment about the cup's middle in the last step, newtons and newton metres; 0 where nothing is held."""
        model, data = self.model, self.data
        if self.held is None:
            return 0.0, 0.0
        weld, body = model.equality(f"cup{self.held}").id, model.body(f"object{self.held}").id
        rows = (data.efc_type == EQUALITY) & (data.efc_id == weld)
        push = np.zeros(model.nv)
        mujoco.mj_mulJacTVec(model, data, push, np.where(rows, data.efc_force, 0.0))
        # A free body's force is along the world's axes and acts at its origin; its moment is along its own axes.
        first = model.body_dofadr[body]
        force, own = push[first : first + 3], push[first + 3 : first + 6]
        moment = data.xmat[body].reshape(3, 3) @ own + np.cross(data.xpos[body] - data.xpos[self.tool], force)
        return float(np.linalg.norm(force)), float(np.linalg.norm(moment))

    def comes_off(self) -> bool:
        """Whether what is held comes off now, loaded with more than it bears for a while. To be asked after every step."""
        force_n, moment_nm = self.load()
        self.most = np.maximum(self.most, [force_n, moment_nm])
        self.loaded_s = self.loaded_s + TIME_STEP_S if force_n > PULL_N or moment_nm > BEND_NM else 0.0
        return self.loaded_s >= LOADED_S

    def let_go(self) -> None:
        """Switches suction off."""
        if self.held is None:
            return
        self.data.eq_active[self.model.equality(f"cup{self.held}").id] = 0
        geoms = self.model.geom_bodyid == self.model.body(f"object{self.held}").id
        # What was taken away touches nothing any more.
        self.model.geom_conaffinity[geoms] = np.where(self.model.geom_contype[geoms] > 0, TOUCHED | BY_HAND, 0)
        self.held = None
