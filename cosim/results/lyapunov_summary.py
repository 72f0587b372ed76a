"""Summary of the Lyapunov function V of the paper's law in a run."""

from __future__ import annotations

from typing import Any

import numpy as np

from cosim.results.record import Rows
from cosim.simulation.lyapunov_signals import FORMS
from cosim.simulation.signals import Array

ROUNDING = 1e-12  # part of the greatest |V| of a run: a smaller rise between two steps is not counted


def summarize_lyapunov(record: Rows) -> dict[str, Any] | None:
    """Summarize V [N m] over a run."""
    if "lyapunov.rate" not in record.units:
        return None
    return {form: _summarize_form(record, f"lyapunov.{form}") for form in FORMS}


def _summarize_form(record: Rows, name: str) -> dict[str, Any]:
    minimum, size = np.inf, 0.0
    for block in record.blocks([name]):
        minimum, size = np.minimum(minimum, block[name].min()), np.maximum(size, np.abs(block[name]).max())
    threshold = ROUNDING * float(size)
    before: tuple[Array, Array] = np.empty(0), np.empty(0)  # the row before a block
    rises, first_rise, first_negative = 0, None, None
    for block in record.blocks(["time", name]):
        time, V = np.concatenate([before[0], block["time"]]), np.concatenate([before[1], block[name]])
        rising, below = np.flatnonzero(np.diff(V) > threshold), np.flatnonzero(V < 0.0)
        first_rise = float(time[rising[0]]) if rising.size and not rises else first_rise
        first_negative = float(time[below[0]]) if below.size and first_negative is None else first_negative
        rises, before = rises + len(rising), (time[-1:], V[-1:])
    return {
        "start": record.value(name, 0),
        "end": record.value(name, -1),
        "least": float(minimum),
        "threshold": threshold,
        "increases": rises,
        "first_rise": first_rise,
        "first_negative": first_negative,
    }
