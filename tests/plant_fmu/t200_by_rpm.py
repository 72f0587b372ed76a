"""The force of a T200 by its revolutions, worked out from the published points apart from the C."""

import numpy as np

from plant_fmu.t200 import FORCES, RPM, VOLTAGES


def force_of_rpm(rpm, voltages):
    """Return forces [N] of revolutions [rev/min] with the sign of the force, at voltages [V] cut at 10 and 20.

    A published point keeps its force and its revolutions together at voltages between the published ones.
    """
    forces = []
    for turns, voltage in zip(rpm, voltages, strict=True):
        points, force = (
            [np.interp(voltage, VOLTAGES, column) for column in table.T] for table in (RPM, FORCES)
        )  # NaN for NaN
        forces.append(np.interp(turns, points, force) if np.isfinite(points).all() else np.nan)
    return np.array(forces)
