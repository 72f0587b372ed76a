"""The published forces and revolutions of Blue Robotics' T200 thruster by pulse and voltage, for C and Python."""

from __future__ import annotations

from importlib import resources

import numpy as np
from numpy.typing import NDArray

STANDARD_GRAVITY = 9.80665  # m/s2, by which a kilogram-force is defined
_LINES = (resources.files("plant_fmu") / "t200.csv").read_text(encoding="utf-8").splitlines()
_TABLE = np.loadtxt(_LINES, delimiter=",", skiprows=4).T
VOLTAGES = np.array([10.0, 12.0, 14.0, 16.0, 18.0, 20.0])  # V
PULSES: NDArray[np.float64] = _TABLE[0]  # us
FORCES: NDArray[np.float64] = STANDARD_GRAVITY * _TABLE[1:7]  # N, a row for each voltage
RPM: NDArray[np.float64] = _TABLE[7:]  # rev/min, signed as the force


def force_of_pulse(pulses: NDArray[np.float64], voltages: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the force [N] of a T200 at rest, linear between the published points; pulses [us], voltages [V]."""
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
