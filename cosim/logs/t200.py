"""The force of a T200 thruster by pulse and voltage, as Blue Robotics publishes it."""

from __future__ import annotations

import numpy as np

from cosim.simulation.signals import Array
from plant_fmu.t200 import FORCES, PULSES, VOLTAGES


def force_of_pulse(pulses: Array, voltages: Array) -> Array:
    """Return the force of a T200 at rest, linear between the published points.

    Parameters
    ----------
    pulses : ndarray
        [us], cut at 1100 and 1900.
    voltages : ndarray of the same shape
        [V], cut at 10 and 20.

    Returns
    -------
    ndarray
        [N], above 0 where the pulse is above neutral; NaN where pulse or voltage is.

    Examples
    --------
    >>> import numpy as np
    >>> force_of_pulse(np.array([1900.0, 1500.0]), np.array([16.0, 16.0])).round(2).tolist()
    [51.48, 0.0]
    """
    at = np.clip((voltages - VOLTAGES[0]) / 2.0, 0.0, len(VOLTAGES) - 1.0)
    whole = np.minimum(np.nan_to_num(at).astype(int), len(VOLTAGES) - 2)
    part = at - whole
    rows = np.array([np.interp(pulses, PULSES, row) for row in FORCES])
    low, high = (np.take_along_axis(rows, (whole + k)[None], axis=0)[0] for k in (0, 1))
    force: Array = low + part * (high - low)
    return force
