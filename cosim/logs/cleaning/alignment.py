"""Clocks of several logs of one run: joined by their times, or by the correlation of two signals."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.ndimage import uniform_filter1d
from scipy.signal import correlate, detrend

from cosim.errors import ImportLogError
from cosim.logs.frames import euler_zyx
from cosim.logs.spool import LogContents, Source
from cosim.simulation.signals import Array

_PERIOD = 0.02  # s, of signals that are correlated
_SMOOTH = 0.2  # s
_MIN_CORRELATION = 0.5
_MAX_ELSEWHERE = 1.0 / 1.5  # of the peak, maximum correlation at offsets that are more than `_PEAK_WIDTH` away
_PEAK_WIDTH = 2.0  # s
_MIN_OVERLAP = 5.0  # s
_ABSOLUTE = 1e8  # s, from which on times are those of a calendar
_MAX_SIGNAL = 36_000.0  # s


def _turn(times: Array, quaternions: Array) -> Array:
    angles = np.unwrap(euler_zyx(quaternions), axis=0)
    return np.gradient(angles, times, axis=0)


# quantity: signals that another log may have too; commands go with the accelerations that they cause
_SIGNALS: dict[str, tuple[tuple[str, Callable[[Array, Array], Array]], ...]] = {
    "depth": (("depth", lambda t, x: np.gradient(x, t, axis=0)),),
    "position": (("depth", lambda t, x: np.gradient(x[:, 2:3], t, axis=0)),),
    "rates": (("turn rates", lambda t, x: x), ("acceleration", lambda t, x: np.gradient(x, t, axis=0)[:, 2:])),
    "gyro": (("turn rates", lambda t, x: x),),
    "attitude": (("turn rates", _turn),),
    "velocity": (("velocity", lambda t, x: x), ("push", lambda t, x: np.gradient(x, t, axis=0))),
    "dvl": (("velocity", lambda t, x: x), ("push", lambda t, x: np.gradient(x, t, axis=0))),
    "wrench": (("push", lambda t, x: x[:, :3]), ("acceleration", lambda t, x: x[:, 5:])),
}


def clock_offset(first: LogContents, other: LogContents) -> tuple[float, str]:
    """Return the offset [s] that puts another log on the first one's clock, and how it was found in words."""
    spans = [_span(contents) for contents in (first, other)]
    overlap = min(end for _, end in spans) - max(start for start, _ in spans)
    shortest = min(end - start for start, end in spans)
    overlaps = overlap > min(_MIN_OVERLAP, 0.5 * shortest)
    lead = f"its times begin {spans[1][0] - spans[0][0]:+.2f} s from where those of the first log begin"
    if overlaps and max(spans[0][0], spans[1][0]) > _ABSOLUTE:
        return 0.0, f"by their times, which overlap for {overlap:.4g} s"
    if min(spans[0][0], spans[1][0]) > _ABSOLUTE:
        raise ImportLogError(
            f"{lead}, and overlap for {max(0.0, overlap):.4g} s: expected logs of one run, with clocks that agree"
        )
    best, offset, name = _MIN_CORRELATION, 0.0, ""
    signals = [_signals(contents) for contents in (first, other)]
    for what in signals[0].keys() & signals[1].keys():
        lag, size = _lag(signals[0][what], signals[1][what])
        if size > best:
            best, offset, name = size, lag, what
    if overlaps and (not name or abs(offset) < 2.0 * _SMOOTH):
        return 0.0, f"by their times, which overlap for {overlap:.4g} s"
    if not name:
        raise ImportLogError(
            f"{lead}, and no signal of both correlates above {_MIN_CORRELATION:g} at one offset alone: "
            "expected one clock, or depth, velocity or turn rates in both"
        )
    return offset, f"by the correlation of their {name} ({best:.2f}): {offset:+.2f} s"


def _span(contents: LogContents) -> tuple[float, float]:
    """Return first and last time of writing [s]."""
    ends = [_ends(source) for source in contents.sources.values() if source.count]
    if not ends:
        raise ImportLogError("holds no sample of a mapped quantity")
    return min(start for start, _ in ends), max(end for _, end in ends)


def _ends(source: Source) -> tuple[float, float]:
    spans = [(float(block[:, 1].min()), float(block[:, 1].max())) for block in source.blocks()]
    return min(start for start, _ in spans), max(end for _, end in spans)


def _signals(contents: LogContents) -> dict[str, tuple[float, Array]]:
    """Return start [s] and even samples, (n, c), of the signals of a log, by name."""
    signals = {}
    for quantity, entries in _SIGNALS.items():
        source = contents.best(quantity)
        if source is None or source.count < _MIN_OVERLAP:
            continue
        rows = np.concatenate([*source.blocks()])
        times, first = np.unique(rows[:, 1], return_index=True)
        if times[-1] - times[0] > _MAX_SIGNAL or len(times) < 2:
            continue
        even = np.arange(times[0], times[-1], _PERIOD)
        width = max(1, round(_SMOOTH / _PERIOD))
        values = np.column_stack([np.interp(even, times, x) for x in rows[first, 2:].T])
        values = uniform_filter1d(values, width, axis=0, mode="nearest")
        for name, signal in entries:
            signals[name] = float(times[0]), signal(even, values)
    return signals


def _lag(first: tuple[float, Array], other: tuple[float, Array]) -> tuple[float, float]:
    """Return the time [s] to add to the other signal's times, and the mean correlation there; 0 if not unique."""
    total: Array | float = 0.0
    min_overlap = round(_MIN_OVERLAP / _PERIOD)
    for x, y in zip(detrend(first[1], axis=0).T, detrend(other[1], axis=0).T, strict=False):
        ones = correlate(np.ones(len(x)), np.ones(len(y)), method="fft")
        energy = np.sqrt(np.maximum(
            correlate(x * x, np.ones(len(y)), method="fft") * correlate(np.ones(len(x)), y * y, method="fft"), 1e-12
        ))  # fmt: skip
        total = total + np.where(
            ones > max(min_overlap, 0.5 * min(len(x), len(y))), correlate(x, y, method="fft") / energy, 0.0
        )
    mean = np.asarray(total) / min(first[1].shape[1], other[1].shape[1])
    peak = int(np.argmax(mean))
    is_elsewhere = np.abs(np.arange(len(mean)) - peak) > _PEAK_WIDTH / _PERIOD
    is_unique = np.max(mean, where=is_elsewhere, initial=0.0) <= _MAX_ELSEWHERE * mean[peak]
    shift = (peak - (len(other[1]) - 1)) * _PERIOD
    return first[0] + shift - other[0], float(mean[peak]) if is_unique else 0.0
