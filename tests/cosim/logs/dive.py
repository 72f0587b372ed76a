"""A dive that is known in formulas, for logs that the tests write."""

import numpy as np

from cosim.logs.frames import quaternions_of_angles

NEUTRAL = 1500.0


class Dive:
    """Position, attitude, velocities and commands at times, NED and FRD."""

    def __init__(self, times):
        t = self.times = np.asarray(times, float)
        self.yaw, self.pitch, self.roll = 0.5 * np.sin(0.3 * t), 0.1 * np.sin(0.5 * t), 0.05 * np.cos(0.4 * t)
        self.position = np.column_stack([np.sin(0.2 * t), np.cos(0.2 * t), 3.0 + 0.5 * np.sin(0.1 * t)])
        self.velocity_world = np.column_stack([0.2 * np.cos(0.2 * t), -0.2 * np.sin(0.2 * t), 0.05 * np.cos(0.1 * t)])
        self.quaternion = quaternions_of_angles(np.column_stack([self.yaw, self.pitch, self.roll]), "ZYX")
        self.rates = np.column_stack([0.1 * np.sin(t), 0.1 * np.cos(t), 0.15 * np.cos(0.3 * t)])
        self.thrust = np.column_stack([10.0 * np.sin(0.5 * t + i) for i in range(8)])


def assert_flown(record, dive, bound, known=0.99):
    """Check that position, attitude and thrust of a record are those of a dive."""
    for names, expected in (
        ([f"position.{a}" for a in "xyz"], dive.position),
        (["attitude.roll", "attitude.pitch", "attitude.yaw"], np.column_stack([dive.roll, dive.pitch, dive.yaw])),
        ([f"thrust[{i}]" for i in range(1, 9)], dive.thrust),
    ):
        signals = record.stack(names)
        rows = np.isfinite(signals).all(axis=1)
        assert rows.mean() >= known and np.abs(signals - expected)[rows].max() < bound, names
