"""Cleaning of samples: duplicates, disorder, bursts, held values, outliers; count of gaps."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from cosim.errors import ImportLogError
from cosim.logs.cleaning.sample_times import Index, Keys, drop_duplicates, drop_held, longest_freeze, put_in_order
from cosim.logs.quantities import QUANTITIES
from cosim.logs.spool import BLOCK, Source
from cosim.simulation.signals import Array

Convert = Callable[[Array], Array]

_GAP_PERIODS, _MIN_GAP = 3.0, 0.3  # periods, s: a pause longer than both is a gap
_MAX_LISTED = 100  # maximum number of listed gaps
_MAX_IMPLAUSIBLE = 0.1  # maximum fraction of implausible samples, which are left out; more indicate a wrong unit
_NEIGHBORS, _LONELY = 5, 10.0  # samples, s: distance of a time from the median about it, beyond which it is damaged
_JUMP = 20.0  # usual changes between samples, beyond which a sample that its neighbors do not share is an outlier
_AROUND = 7  # samples, width of the median that an outlier is compared with
_NOT_SPIKY = ("position", "velocity_world", "velocity", "rates", "dvl", "depth", "altitude", "attitude", "fix")
_SURVEYED = 2**14  # changes between samples that say how large these usually are
_FROZEN, _FROZEN_SAMPLES = 1.0, 10  # s, samples: a sensor with noise that repeats a value longer is suspected


@dataclass
class Topic:
    """A cleaned quantity of a log: its file has a time [s] and the components of each sample."""

    quantity: str
    name: str  # name of the source
    path: Path
    size: int  # number of components
    count: int = 0  # number of samples
    start: float = 0.0  # s, time of the first sample
    end: float = 0.0  # s, time of the last sample
    period: float = 0.0  # s, median time between samples
    duplicates: int = 0  # number of removed samples that repeat time and value
    held: int = 0  # number of removed repeats of held values
    burst: int = 0  # number of samples of bursts, moved in time
    sorted: int = 0  # number of samples that came after a later one
    late: int = 0  # number of removed samples at the time of another one
    broken: int = 0  # number of omitted samples without valid numbers
    outliers: int = 0  # number of omitted samples far from their neighbors
    hold: float = 0.0  # s, longest time for which a value is held
    frozen: str = ""  # suspicion that a sensor has repeated a value, in a sentence
    gap_count: int = 0
    gaps: list[tuple[float, float]] = field(default_factory=list)  # s, start and end of the longest gaps

    @property
    def longest(self) -> float:
        """Longest time between samples [s] that is not a gap."""
        return max(_GAP_PERIODS * self.period, _MIN_GAP, 1.5 * self.hold)

    @property
    def rate(self) -> float:
        """Rate of the samples [Hz]; 0 if the period is unknown."""
        return 1.0 / self.period if self.period else 0.0


def clean(source: Source, times: Callable[[Array, Array], Array], convert: Convert | None, folder: Path) -> Topic:
    """Clean a source's samples, and write them as a topic; times (n,) [s], convert (n, size)."""
    quantity = QUANTITIES[source.quantity]
    topic = Topic(source.quantity, source.name, folder / f"{source.quantity}.topic", 0, broken=source.broken)
    stamps, keys, usual = _survey(source, times)
    odd = np.abs(stamps - median_filter(stamps, _NEIGHBORS, mode="nearest")) > _LONELY
    odd &= odd.mean() < _MAX_IMPLAUSIBLE  # else the rows are out of order
    topic.broken += int(np.count_nonzero(odd))
    known = np.flatnonzero(~odd)
    index = known[drop_duplicates(stamps[known], keys[known])]
    topic.duplicates = len(known) - len(index)
    order, at, topic.burst = put_in_order(stamps[index])
    topic.sorted = int(np.count_nonzero(np.diff(stamps[index]) < 0.0)) if not topic.burst else 0
    index = index[order]
    rising = at > np.concatenate([[-np.inf], np.maximum.accumulate(at)[:-1]])
    topic.late = int(np.count_nonzero(~rising))
    index, at = index[rising], at[rising]
    if quantity.kind in ("sensor", "state"):
        fresh, stretch = drop_held(keys[index])
        topic.held = len(index) - len(fresh)
        topic.hold = stretch * float(np.median(np.diff(at))) if topic.held else 0.0
        if not topic.held and len(index):
            topic.frozen = _freeze(topic, at, keys[index])
        index, at = index[fresh], at[fresh]
    kept = _write(source, topic, index, at, convert, usual)
    topic.count = len(kept)
    if topic.count:
        topic.start, topic.end = float(kept[0]), float(kept[-1])
    steps = np.diff(kept)
    topic.period = float(np.median(steps)) if steps.size else 0.0
    gaps = np.flatnonzero(steps > topic.longest)
    topic.gap_count = len(gaps)
    longest = np.sort(gaps[np.argsort(-steps[gaps])[:_MAX_LISTED]])
    topic.gaps = [(float(kept[i]), float(kept[i + 1])) for i in longest]
    return topic


def _survey(source: Source, times: Callable[[Array, Array], Array]) -> tuple[Array, Keys, Array]:
    """Return times [s], keys that equal values share, and the usual changes between samples, (size,)."""
    stamps, keys, changes = list[Array](), list[Keys](), list[Array]()
    for block in source.blocks():
        values = block[:, 2:] + 0.0  # no negative zeros
        stamps.append(times(block[:, 0], block[:, 1]))
        odd = np.uint64(2) * np.arange(source.size, dtype=np.uint64) + np.uint64(0x9E3779B97F4A7C15)
        with np.errstate(over="ignore"):
            keys.append(np.bitwise_xor.reduce(np.ascontiguousarray(values).view(np.uint64) * odd, axis=1))
        steps = np.abs(np.diff(_continuous(source.quantity, values), axis=0))
        changes.append(steps[:: max(1, source.count // _SURVEYED)].copy())
    pooled = np.concatenate(changes) if changes else np.zeros((0, source.size))
    usual = np.array([np.quantile(x[x > 0.0], 0.9) if np.any(x > 0.0) else np.inf for x in pooled.T])
    return np.concatenate(stamps or [np.zeros(0)]), np.concatenate(keys or [np.zeros(0, np.uint64)]), usual


def _write(source: Source, topic: Topic, index: Index, at: Array, convert: Convert | None, usual: Array) -> Array:
    """Write the samples of an index at times [s] without implausible ones and outliers; return the times left [s]."""
    kept, worst, implausible = list[Array](), 0.0, 0
    limit = QUANTITIES[source.quantity].max
    with topic.path.open("wb") as file:
        for first in range(0, len(index), BLOCK):
            values, stamps = source.rows(index[first : first + BLOCK])[:, 2:], at[first : first + BLOCK]
            spikes = _outliers(topic.quantity, values, usual)
            values = values if convert is None else convert(values)
            size = np.abs(values).max(axis=1)
            worst, odd = max(worst, float(size.max())), size > limit
            implausible += int(np.count_nonzero(odd))
            topic.outliers += int(np.count_nonzero(odd | spikes))
            values, stamps = values[~(odd | spikes)], stamps[~(odd | spikes)]
            topic.size = values.shape[1]
            np.column_stack([stamps, values]).tofile(file)
            kept.append(stamps)
    if implausible > _MAX_IMPLAUSIBLE * len(index):
        quantity = QUANTITIES[source.quantity]
        raise ImportLogError(
            f"{source.name}: {source.quantity} reaches {worst:.4g} {quantity.unit}".rstrip()
            + f", expected at most {quantity.max:.4g}: check its unit and frame"
        )
    return np.concatenate(kept or [np.zeros(0)])


def _outliers(quantity: str, values: Array, usual: Array) -> NDArray[np.bool_]:
    """Return True for samples that are much farther from the median about them than samples usually change."""
    if quantity not in _NOT_SPIKY or len(values) < _AROUND:
        return np.zeros(len(values), bool)
    values = _continuous(quantity, values)
    spikes: NDArray[np.bool_] = np.any(
        np.abs(values - median_filter(values, (_AROUND, 1), mode="mirror")) > _JUMP * usual, axis=1
    )
    return spikes


def _continuous(quantity: str, values: Array) -> Array:
    """Return quaternions with signs that do not jump; other values as they are."""
    if quantity != "attitude" or len(values) < 2:
        return values
    signs = np.where(np.sum(values[1:] * values[:-1], axis=1) < 0.0, -1.0, 1.0)
    result: Array = values * np.concatenate([[1.0], np.cumprod(signs)])[:, None]
    return result


def _freeze(topic: Topic, at: Array, keys: Keys) -> str:
    """Return a suspicion if a value of a quantity that otherwise changes with every sample is repeated for long."""
    first, length = longest_freeze(keys)
    seconds = float(at[first + length - 1] - at[first])
    others = np.count_nonzero(keys[1:] == keys[:-1]) - (length - 1)
    if length < _FROZEN_SAMPLES or seconds < _FROZEN or others > 0.05 * len(keys) or length > 0.5 * len(keys):
        return ""
    return (
        f"repeats one value {length} times, for {seconds:.3g} s from "
        f"{at[first] - at[0]:.4g} s on: where the sensor had no lock, name its marker in the map, as in "
        "invalid = [0.0]."
    )
