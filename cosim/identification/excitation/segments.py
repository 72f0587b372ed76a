"""Candidate segments of stick input, multisines and steps, from which a design chooses."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
StickMode = Literal["manual", "stabilize", "depth_hold"]

PERIOD = 0.1  # s, between two stick values
SECONDS = 20.0  # s, duration of a segment

_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
_GROUPS: tuple[tuple[int, ...], ...] = (
    (0, 1, 2, 3, 4, 5), (0, 5), (1, 5), (1, 3), (0, 4), (2, 4), (3, 4, 5), (0, 1, 2), (0,), (1,), (2,),
)  # fmt: skip
_BANDS = ((0.05, 0.5), (0.2, 1.5))  # Hz, frequency bands of the multisines
_DWELLS = ((2.0, 4.0), (0.8, 2.5))  # s, shortest and longest time for which a step is held
_SINES = 7  # most sines of each axis
_YAW_RATE = 0.25  # factor on the yaw stick in modes where it commands a rate: a full stick is 202 deg/s
_MOMENT = 0.5  # factor on the sticks of roll, pitch and yaw in manual mode, where they command moments
_SHARED = 0.7  # factor on each stick in segments that move several axes


@dataclass(frozen=True)
class Segment:
    """A piece of stick input."""

    title: str
    mode: StickMode
    sticks: Array  # (n, 6) sticks X Y Z K M N, -1 to 1, each row held for `PERIOD`

    def scaled(self, part: float) -> Segment:
        """Return the segment with all sticks multiplied by a factor."""
        return Segment(self.title, self.mode, part * self.sticks)


def candidates(axes: NDArray[np.bool_], rng: np.random.Generator, draws: int) -> Iterator[Segment]:
    """Yield multisines and steps on all groups of axes, in each stick mode; axes (6,)."""
    groups = dict.fromkeys(tuple(i for i in group if axes[i]) for group in _GROUPS)
    modes: tuple[StickMode, ...] = ("manual", "stabilize", "depth_hold")
    for group in (group for group in groups if group):
        for mode in modes:
            for _ in range(draws):
                for low, high in _BANDS:
                    title = f"{_named(group)}: multisine of {low:g} to {high:g} Hz"
                    yield Segment(title, mode, _spread(_multisine(low, high, len(group), rng), group, mode))
                for least, most in _DWELLS:
                    title = f"{_named(group)}: steps of {least:g} to {most:g} s"
                    yield Segment(title, mode, _spread(_steps(least, most, len(group), rng), group, mode))


def _named(group: tuple[int, ...]) -> str:
    return "all axes" if len(group) == len(_AXES) else " and ".join(_AXES[i] for i in group)


def _spread(values: Array, group: tuple[int, ...], mode: StickMode) -> Array:
    """Return the sticks of all axes, shape (n, 6), from those of a group, (n, axes), scaled for the mode."""
    sticks = np.zeros((len(values), 6))
    sticks[:, list(group)] = values * (1.0 if len(group) == 1 else _SHARED)
    if mode == "manual":
        sticks[:, 3:] *= _MOMENT
    else:
        sticks[:, 5] *= _YAW_RATE
    return sticks


def _multisine(low: float, high: float, count: int, rng: np.random.Generator) -> Array:
    """Return zero-mean sums of sines, whole periods of each, with a greatest value of 1; shape (n, count)."""
    n = round(SECONDS / PERIOD)
    turns = np.unique(np.round(np.geomspace(low, high, _SINES) * SECONDS).clip(1))
    phases = rng.uniform(0.0, 2.0 * np.pi, (len(turns), count))
    grid = np.arange(n) / n
    waves = np.sin(2.0 * np.pi * turns[:, None, None] * grid[:, None] + phases[:, None, :]).sum(axis=0)
    result: Array = waves / np.abs(waves).max(axis=0)
    return result


def _steps(least: float, most: float, count: int, rng: np.random.Generator) -> Array:
    """Return steps to random levels, shape (n, count); the second half is the first with opposite sign."""
    half = round(SECONDS / PERIOD) // 2
    result = np.zeros((2 * half, count))
    for axis in range(count):
        at, sign = 0, rng.choice((-1.0, 1.0))
        while at < half:
            held = round(rng.uniform(least, most) / PERIOD)
            result[at : min(at + held, half), axis] = sign * rng.choice((0.0, 0.5, 1.0, 1.0))
            at, sign = at + held, -sign
        result[half:, axis] = -result[:half, axis]
    return result
