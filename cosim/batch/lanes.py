"""Flights in parallel SIMD lanes: plant, law and arbiter in C, with a vehicle in each lane of a vector register.

There is no FMU in the loop. The plant is compiled again from the sources of the FMU, so that each lane gives the
FMU's results.
"""

from __future__ import annotations

import ctypes
from types import TracebackType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from controller.allocation import Allocation
from controller.regions import pack
from cosim.batch.lanes_library import lanes_library
from cosim.batch.lanes_rows import Array, Rows, require_lanes
from cosim.batch.outcome import BatchResult, Outcomes, empty_outcomes
from cosim.batch.variation import Variation
from cosim.results.summary import SETTLED_FOR

_REFUSAL = 512  # bytes of a message
_METRICS = (
    "first_inside", "last_entered", "inside", "least_clearance", "least_angle", "goal_clearance", "weighted_violation",
    "effort", "max_force", "max_speed", "final_x", "final_y", "final_z", "phi1", "phi2", "phi3", "phi4", "stopped",
)  # fmt: skip
_SAME = _METRICS[_METRICS.index("weighted_violation") : _METRICS.index("stopped")]  # outcomes of the same name


class Batch(ctypes.Structure):
    """The struct of csrc/lanes.h."""

    _fields_ = (
        *((name, ctypes.c_int) for name in (
            "n_rows", "width", "n_reals", "n_integers", "n_regions", "n_numbers", "steps", "control_every",
            "arbiter_every", "moving", "thrusters", "keep_direction",
        )),
        *((name, ctypes.c_double) for name in ("step", "period", "substep")),
        *((name, ctypes.c_void_p) for name in (
            "reals", "integers", "kinds", "signs", "offsets", "criteria", "hard", "priorities", "inverse", "lower",
            "upper", "rows", "marks", "refusals",
        )),
    )  # fmt: skip


class LanesFlyer:
    """Flies variations of a scenario in parallel, as many as the machine has lanes.

    Parameters
    ----------
    variation : Variation
        The variation: with the paper's law and criteria, the closed engine, any shapes, wrench or thrusters, and
        without noise, failures and commands.

    Raises
    ------
    RunError
        If the scenario, or a key that varies, needs a feature that only the fused loop has.
    BuildError
        If there is no C compiler for the library.
    """

    def __init__(self, variation: Variation) -> None:
        require_lanes(variation.base)
        self.variation = variation
        self._rows = Rows(variation)
        library: Any = lanes_library(variation.base.vehicle)
        self.lanes: int = library.lanes_count()
        self._fly: Any = library.lanes_fly
        self._fly.argtypes, self._fly.restype = [ctypes.POINTER(Batch)], ctypes.c_int
        self._batch, self._kept = Batch(), dict[str, NDArray[Any]]()
        self._set_constant_fields()

    def _set_constant_fields(self) -> None:
        """Set the fields that are the same for all rows."""
        base, rows, b = self.variation.base, self._rows, self._batch
        packed, thrusters = pack(rows.regions), base.actuation.through == "thrusters"
        b.width, b.n_reals, b.n_integers = rows.base.size, len(rows.reals), len(rows.integers)
        b.n_regions, b.n_numbers = packed.kinds.size, packed.numbers.size
        b.steps, b.control_every, b.arbiter_every = base.steps, base.control_every, base.arbiter_every
        b.step, b.period, b.substep = base.time.step, base.time.control, base.plant.substep
        self._point("reals", rows.references(rows.reals))
        self._point("integers", rows.references(rows.integers))
        self._point("kinds", packed.kinds.astype(np.intc))
        self._point("signs", packed.signs)
        self._point("offsets", packed.offsets.astype(np.intc))
        self._point("criteria", np.array([-1, *base.criterion_places], np.intc))
        self._point("hard", packed.hard.astype(np.intc))
        self._point("priorities", np.array([0.0, *(secondary.priority for secondary in base.regions)]))
        if thrusters:
            v = base.vehicle
            allocation = Allocation(v.thruster_matrix, v.thrust_min, v.thrust_max, base.actuation.limits).arguments
            inverse, lower, upper, b.keep_direction = allocation
            b.thrusters = v.n_thrusters
            for name, numbers in (("inverse", inverse), ("lower", lower), ("upper", upper)):
                self._point(name, np.ascontiguousarray(numbers, dtype=float))

    def _point(self, name: str, numbers: NDArray[Any]) -> None:
        """Store an array, and set the batch's pointer to it."""
        self._kept[name] = numbers
        setattr(self._batch, name, numbers.ctypes.data)

    def fly(self, values: Array, seeds: NDArray[np.int64]) -> BatchResult:
        """Fly a batch.

        Parameters
        ----------
        values : ndarray, shape (rows, keys)
            Values of the keys that vary, in their units.
        seeds : ndarray of int, shape (rows,)
            Seed of each row; it is checked, but has no effect, since lanes have no noise.

        Returns
        -------
        BatchResult
            Outcome of each row, or the reason why it was refused.
        """
        outcomes = empty_outcomes(len(seeds))
        rows, refused = self._rows.fill(
            np.asarray(values, dtype=float).reshape(len(seeds), len(self.variation.keys)), seeds
        )
        flown = np.array([at for at in range(len(seeds)) if at not in refused], np.intp)
        metrics, reasons = self._fly_rows(np.ascontiguousarray(rows[flown]))
        good = np.array([not reason for reason in reasons], np.bool_)
        refused |= {int(at): reason for at, reason in zip(flown, reasons, strict=True) if reason}
        outcomes[flown[good]] = self._outcomes(metrics[good])
        return BatchResult(outcomes, dict(sorted(refused.items())))

    def _fly_rows(self, rows: Array) -> tuple[Array, list[str]]:
        """Fly rows; return their metrics, shape (rows, metrics), and the plant's reasons for refusing them or ""."""
        n, b = len(rows), self._batch
        n_regions = b.n_regions
        b.n_rows, b.moving = n, bool(rows[:, rows.shape[1] - 3 * n_regions :].any())
        metrics, refusals = np.zeros((n, len(_METRICS))), np.zeros(n, f"S{_REFUSAL}")
        self._point("rows", rows)
        self._point("marks", metrics)
        self._point("refusals", refusals)
        if not self._fly(ctypes.byref(b)):
            raise MemoryError("no memory for the lanes")
        return metrics, [reason.decode("utf-8", "replace") for reason in refusals.tolist()]

    def _outcomes(self, metrics: Array) -> Outcomes:
        """Convert metrics to outcomes."""
        step, steps = self._batch.step, self._batch.steps
        by_name = dict(zip(_METRICS, metrics.T, strict=True))

        def when(at: Array) -> Array:
            return np.where(at >= 0.0, at * step, np.nan)

        out = empty_outcomes(len(metrics))
        inside, stopped = by_name["inside"] > 0.0, by_name["stopped"]
        last = np.where(stopped >= 0.0, stopped, steps)
        out["reached"], out["reach_time"] = by_name["first_inside"] >= 0.0, when(by_name["first_inside"])
        out["settled"] = inside & ((last - by_name["last_entered"]) * step >= SETTLED_FOR)
        out["settle_time"] = when(by_name["last_entered"])
        out["violated"] = (by_name["least_clearance"] < 0.0) | (by_name["least_angle"] < 0.0)
        out["min_clearance"], out["closest_to_goal"] = by_name["least_clearance"], -by_name["goal_clearance"]
        out["stopped_at"] = when(stopped)
        for name in _SAME:
            out[name] = by_name[name]
        return out

    def close(self) -> None:
        """Do nothing: a library stays loaded."""

    def __enter__(self) -> LanesFlyer:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()
