"""The published forces and revolutions of Blue Robotics' T200 thruster by pulse and voltage, for C and Python."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

STANDARD_GRAVITY = 9.80665  # m/s2, by which a kilogram-force is defined
# us; at bollard, from the maker's performance table of September 2019, at some of its pulses
PULSES = np.array([
    1100, 1148, 1200, 1248, 1300, 1348, 1400, 1440, 1460, 1468, 1500, 1532, 1540, 1560, 1600, 1648, 1700, 1748, 1800,
    1848, 1900,
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
# rev/min at the same pulses, signed as the force; the table calls what is below 300 unsteady, and 0
RPM = np.array([
    [-2662, -2472, -2198, -1936, -1615, -1294, -883, -504, 0, 0, 0, 0, 0, 500, 873, 1250, 1596, 1889, 2179, 2436,
     2668],
    [-2976, -2755, -2457, -2159, -1815, -1470, -1023, -597, -346, 0, 0, 0, 342, 592, 1009, 1424, 1796, 2118, 2456, 2751,
     2995],
    [-3233, -3004, -2697, -2366, -1995, -1625, -1150, -683, -400, 0, 0, 0, 399, 675, 1136, 1562, 1967, 2312, 2693, 3011,
     3279],
    [-3465, -3223, -2865, -2548, -2140, -1738, -1246, -758, -450, -317, 0, 308, 441, 749, 1237, 1699, 2129, 2498, 2888,
     3242, 3533],
    [-3643, -3420, -2985, -2638, -2218, -1796, -1308, -823, -501, -357, 0, 347, 494, 805, 1267, 1716, 2171, 2577, 2985,
     3417, 3742],
    [-3783, -3498, -3046, -2679, -2229, -1779, -1315, -876, -547, -389, 0, 379, 532, 857, 1273, 1685, 2186, 2621, 3088,
     3561, 3931],
], float)  # fmt: skip


def force_of_pulse(pulses: NDArray[np.float64], voltages: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the force of a T200 at rest, linear between the published points; pulses [us], voltages [V]."""
    # with returns [N]
    position = np.clip((voltages - VOLTAGES[0]) / 2.0, 0.0, len(VOLTAGES) - 1.0)
    row = np.minimum(np.nan_to_num(position).astype(int), len(VOLTAGES) - 2)
    fraction = position - row
    rows = np.array([np.interp(pulses, PULSES, row) for row in FORCES])
    low, high = (np.take_along_axis(rows, (row + k)[None], axis=0)[0] for k in (0, 1))
    force: NDArray[np.float64] = low + fraction * (high - low)
    return force


def t200_header() -> str:
    """Return the C header ``t200.h`` with the published points."""
    forces, turns = (", ".join(f"{{{', '.join(map(repr, row))}}}" for row in rows.tolist()) for rows in (FORCES, RPM))
    pulses = ", ".join(map(repr, PULSES.tolist()))
    return "\n".join([
        "/* Forces of a T200 at bollard [N] and its revolutions [rev/min] by pulse [us] and supply",
        "   voltage [V], of Blue Robotics: generated. */",
        "#ifndef T200_H",
        "#define T200_H",
        "",
        f"#define T200_FIRST_VOLTAGE {float(VOLTAGES[0])!r}",
        f"#define T200_VOLTAGE_STEP {float(VOLTAGES[1] - VOLTAGES[0])!r}",
        f"enum {{ N_T200_PULSES = {PULSES.size}, N_T200_VOLTAGES = {VOLTAGES.size} }};",
        f"static const double T200_PULSES[N_T200_PULSES] = {{{pulses}}};",
        f"static const double T200_FORCES[N_T200_VOLTAGES][N_T200_PULSES] = {{{forces}}};",
        f"static const double T200_RPM[N_T200_VOLTAGES][N_T200_PULSES] = {{{turns}}};",
        "",
        "#endif",
        "",
    ])  # fmt: skip
