"""A shelf of Nudge in MuJoCo: what `mujoco_shelf.py` and `compare_mujoco.py` are made of."""


class WorldError(Exception):
    """What is wrong with a request, in one line."""
