"""Timed paths of the joints (core/src/arm/motion.rs). Angles in radians, lengths in metres, times in seconds."""

import numpy as np

# Time in which the arm comes to its full speed, and how many stops stand for it: a path starts and ends at rest.
RAMP_S = 0.15
RAMP_STOPS = 4
# Largest speed of a joint, rad/s.
JOINT_SPEED = 3.0


class Timed:
    """A path of the joints: straight from stop to stop."""

    def __init__(self, at_s, joints):
        self.at_s, self.joints = np.asarray(at_s, float), np.asarray(joints, float)

    def at(self, time_s: float) -> np.ndarray:
        """The joints at a time, seconds since it began."""
        return np.array([np.interp(time_s, self.at_s, values) for values in self.joints.T])

    def before(self, stopped_s: float | None) -> int:
        """How many stops were passed before it stopped; all of them where it did not."""
        return len(self.at_s) if stopped_s is None else int((self.at_s < stopped_s).sum())

    def then(self, other: "Timed") -> "Timed":
        """This path and then another that begins where it ends."""
        at_s = np.concatenate([self.at_s, self.at_s[-1] + other.at_s[1:]])
        return Timed(at_s, np.concatenate([self.joints, other.joints[1:]]))


def along(path: list[np.ndarray], tips: list[np.ndarray], tip_m_s: float) -> Timed:
    """The fastest way through configurations, where the tips are, in which the tip is not faster than that; it starts and ends
    at rest."""
    times = [0.0]
    for (a, b), (tip_a, tip_b) in zip(zip(path, path[1:]), zip(tips, tips[1:])):
        times.append(times[-1] + max(np.abs(b - a).max() / JOINT_SPEED, np.linalg.norm(tip_b - tip_a) / tip_m_s, 1e-9))
    cruise, total = Timed(times, path), times[-1]
    ramp = 0.5 * min(RAMP_S, total)
    within = [ramp * (stop / RAMP_STOPS) ** 2 for stop in range(1, RAMP_STOPS + 1)]
    at = np.unique(np.concatenate([times, within, [total - time_s for time_s in within]]))
    return Timed([ramped(time_s, total) for time_s in at], [cruise.at(time_s) for time_s in at])


def ramped(at_s: float, total_s: float) -> float:
    """When a point is passed that would be passed then at full speed, with constant acceleration at both ends."""
    ramp = min(RAMP_S, total_s)
    if at_s <= 0.5 * ramp:
        return (2.0 * at_s * ramp) ** 0.5
    if at_s >= total_s - 0.5 * ramp:
        return total_s + ramp - (2.0 * max(total_s - at_s, 0.0) * ramp) ** 0.5
    return at_s + 0.5 * ramp
