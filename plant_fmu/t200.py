"""The published force of Blue Robotics' T200 thruster by pulse and voltage, for C and Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STANDARD_GRAVITY = 9.80665  # m/s2, of a kilogram-force
# us; at bollard, from the maker's performance table of September 2019, at some of its pulses
PULSES = np.array([
    1100, 1150, 1200, 1250, 1300, 1350, 1400, 1440, 1460, 1468, 1500, 1532, 1540, 1560, 1600, 1650, 1700, 1750, 1800,
    1850, 1900,
], float)  # fmt: skip
VOLTAGES = np.array([10.0, 12.0, 14.0, 16.0, 18.0, 20.0])  # V
_KILOGRAMS = np.array([  # kgf, forward where the pulse is above 1500 us; a row a voltage
    [-2.31, -1.95, -1.54, -1.17, -0.80, -0.51, -0.24, -0.07, 0, 0, 0, 0, 0, 0.09, 0.29, 0.61, 0.97, 1.43, 1.91, 2.45,
     2.93],
    [-2.90, -2.44, -1.95, -1.47, -1.02, -0.66, -0.32, -0.11, -0.04, 0, 0, 0, 0.04, 0.13, 0.39, 0.79, 1.28, 1.82, 2.46,
     3.08, 3.71],
    [-3.52, -3.00, -2.35, -1.76, -1.24, -0.81, -0.40, -0.15, -0.05, 0, 0, 0, 0.06, 0.18, 0.50, 0.97, 1.55, 2.16, 2.99,
     3.77, 4.52],
    [-4.07, -3.52, -2.71, -2.08, -1.44, -0.94, -0.48, -0.18, -0.07, -0.04, 0, 0.04, 0.08, 0.22, 0.60, 1.14, 1.82, 2.58,
     3.42, 4.38, 5.25],
    [-4.59, -3.91, -2.96, -2.25, -1.56, -1.01, -0.53, -0.21, -0.08, -0.05, 0, 0.05, 0.09, 0.25, 0.63, 1.18, 1.92, 2.74,
     3.72, 4.92, 6.02],
    [-5.04, -4.16, -3.13, -2.31, -1.58, -0.99, -0.53, -0.24, -0.09, -0.05, 0, 0.06, 0.11, 0.29, 0.64, 1.12, 1.92, 2.83,
     3.96, 5.39, 6.72],
])  # fmt: skip

FORCES: NDArray[np.float64] = STANDARD_GRAVITY * _KILOGRAMS  # N


def force_of_pulse(pulses: NDArray[np.float64], voltages: NDArray[np.float64]) -> NDArray[np.float64]:
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
    force: NDArray[np.float64] = low + part * (high - low)
    return force


def t200_header() -> str:
    """Return the C header ``t200.h`` with the published points."""
    rows = ", ".join(f"{{{', '.join(map(repr, row))}}}" for row in FORCES.tolist())
    return "\n".join([
        "/* Forces of a T200 at bollard [N] by pulse [us] and supply voltage [V], of Blue Robotics: generated. */",
        "#ifndef T200_H",
        "#define T200_H",
        "",
        f"#define T200_FIRST_VOLTAGE {float(VOLTAGES[0])!r}",
        f"#define T200_VOLTAGE_STEP {float(VOLTAGES[1] - VOLTAGES[0])!r}",
        f"enum {{ N_T200_PULSES = {PULSES.size}, N_T200_VOLTAGES = {VOLTAGES.size} }};",
        f"static const double T200_PULSES[N_T200_PULSES] = {{{', '.join(map(repr, PULSES.tolist()))}}};",
        f"static const double T200_FORCES[N_T200_VOLTAGES][N_T200_PULSES] = {{{rows}}};",
        "",
        "#endif",
        "",
    ])  # fmt: skip
