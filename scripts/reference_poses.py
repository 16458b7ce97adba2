#!/usr/bin/env python3
"""Poses of a UR5's flange by an independent implementation, which the tests compare Nudge's forward kinematics with.

    pip install pin==4.1.0 example-robot-data==6.0.0
    scripts/reference_poses.py > core/src/arm/ur5_reference.csv

One line per configuration: six joint angles (rad, shoulder pan to wrist 3), then position (m) and quaternion (x, y, z, w)
of the frame `tool0` in the frame `base_link`.
"""
import sys

from importlib.metadata import files

import numpy as np
import pinocchio

urdf = next(file for file in files("example-robot-data") if file.name == "ur5_robot.urdf")
model = pinocchio.buildModelFromUrdf(str(urdf.locate()))
data = model.createData()
names = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"]
assert [model.names[i] for i in range(1, model.njoints)] == [f"{name}_joint" for name in names]
base, tool = model.getFrameId("base_link"), model.getFrameId("tool0")

print(f"# pinocchio {pinocchio.__version__}, example-robot-data's UR5: {', '.join(names)}; x, y, z; qx, qy, qz, qw")
random = np.random.default_rng(5)
for _ in range(500):
    joints = random.uniform(-np.pi, np.pi, 6)
    pinocchio.framesForwardKinematics(model, data, joints)
    pose = data.oMf[base].inverse() * data.oMf[tool]
    numbers = [*joints, *pose.translation, *pinocchio.Quaternion(pose.rotation).coeffs()]
    sys.stdout.write(",".join(f"{number:.12g}" for number in numbers) + "\n")
