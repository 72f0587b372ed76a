"""Residuals of all windows, from which each window's own start is eliminated."""

# The start of a window is known from its samples alone. At each value of the free numbers it is solved for, and the
# residuals are projected onto what it cannot explain (variable projection; Golub and Pereyra 1973). What is left
# depends on the free numbers only, and keeps cost and gradient.

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np

from cosim.errors import IdentificationError
from cosim.identification import measurements
from cosim.identification.actuation import CommandedForces, error_wrenches
from cosim.identification.command_errors import Whitener, most_likely_errors, whitener
from cosim.identification.log import Log, Topic, half_turns, measured_turns
from cosim.identification.parameters import Parameter, Setting, setting_of
from cosim.identification.shooting import NO_DIRECTIONS, STATE_SIZE, Directions, Motion, Shooter
from cosim.identification.windows import Window
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

Result = TypeVar("Result")

_START_DEVIATIONS = (10.0, 10.0, 10.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0, 2.0)  # m, rad, m/s, rad/s
_TURNS = ("attitude", "angular_velocity")  # topics that may be inputs
_MOTION_KINDS = ("plant", "lag", "thrust", "asymmetry", "phase", "current", "force")
_FORCES = range(12, 15)  # indices of a window's force behind those of its state
_FORCE = 0.5  # N, standard deviation of a random force before any residual is known
_MIN_FORCE = 0.01  # N
_SOLVED = 0.05  # of a start's standard deviation: what is left is linear
_MAX_SOLVES = 12


@dataclass(frozen=True)
class Reduced:
    """Residuals of one window without its start."""

    residual: Array  # (rows,) at the best start, in standard deviations, weighted
    jacobian: Array  # (rows, parameters)
    times: Array  # (rows,) s since the window's start


@dataclass
class _Start:
    """The best start of a window, and how it changes with the free numbers about where it was found."""

    state: Array  # (13,), or (16,) with a force
    values: Array
    slope: Array  # (starts, parameters)


class Residuals:
    """The residuals of windows as a function of the free numbers; step [s]."""

    def __init__(
        self,
        logs: Sequence[Log],
        vehicle: Vehicle,
        parameters: Sequence[Parameter],
        windows: Sequence[Window],
        step: float,
        random_force: bool = False,
        turns_measured: bool = False,
    ) -> None:
        if turns_measured:  # then they are inputs, and no measurements to explain
            kept = ((w, tuple(t for t in w.topics if t.name not in _TURNS)) for w in windows)
            windows = [replace(w, topics=topics) for w, topics in kept]
        self.parameters, self.windows = tuple(parameters), tuple(windows)
        self._shooter, self._step = Shooter(vehicle), step
        self._vehicle = vehicle
        self._forces = [CommandedForces(log, vehicle, step) for log in logs]
        has_position = any(topic.name == "position" for log in logs for topic in log.topics)
        has_depth = has_position or any(topic.name == "depth" for log in logs for topic in log.topics)
        # coordinates of a start that are solved for: of its state, and of its force behind them
        known = [*((0, 1) if has_position else ()), *((2,) if has_depth else ())]
        known += range(6, 9) if turns_measured else range(3, 12)
        # quaternion and angular velocity at the ends of each run's steps, where they are inputs
        self._turns = [
            measured_turns(log, forces.start + step * np.arange(forces.steps + 1)) if turns_measured else None
            for log, forces in zip(logs, self._forces, strict=True)
        ]
        self._starts = [*known, *(_FORCES if random_force else ())]
        self.force_deviation = np.full(3, _FORCE) if random_force else None  # N, north, east, down
        # (12, starts) derivatives of the weak prior of a start
        self._prior: Array = np.eye(len(known), len(self._starts)) / np.array(_START_DEVIATIONS)[known][:, None]
        self.holds_starts = False  # as samples have them, while the free numbers are far off
        self._found: dict[int, _Start] = {}
        self._tried: dict[int, _Start] = {}
        self.weights: list[Array] = [np.ones(len(window.topic_names)) for window in windows]
        self.command_error: float | None = None  # factor of the errors of sampled commands; None where it is unknown
        self.whiteners: list[Whitener | None] = [None] * len(windows)
        self._noise_parts: dict[str, float] = {}  # part of the noise of its samples that a topic has, by its name

    def settings(self, values: Array) -> list[Setting]:
        """Return the settings of each run by the free numbers."""
        return [
            setting_of(self.parameters, values, run, forces, self._vehicle) for run, forces in enumerate(self._forces)
        ]

    def raw(self, i: int, settings: Sequence[Setting], start: Array, full: bool) -> tuple[Array, Array, Array]:
        """Return residuals of a window from a start, with derivatives by the start and, if `full`, the free numbers."""
        # Units of arguments: start [N, NED]
        window = self.windows[i]
        setting = settings[window.run]
        inside = slice(window.first, window.first + window.steps)
        moving = [j for j, p in enumerate(self.parameters) if full and self._changes_motion(p, window.run)]
        n, residuals, starts, rows = len(self._starts), [], [], []
        for topic, sampled, along in self._sampled(i, setting, start, self._directions(moving, setting, inside, start)):
            residuals.append(measurements.residual(topic, sampled.states, setting.errors).ravel())
            starts.append(along[:, :n])
            jacobian = np.zeros((len(along), len(self.parameters)))
            jacobian[:, moving] = along[:, n:]
            if full:
                self._add_errors(jacobian, topic, sampled, setting, window.run)
            rows.append(jacobian)
        per_noise, whiten = self._per_noise(window), self.whiteners[i] or (lambda values: values)
        return (
            whiten(per_noise * np.concatenate(residuals)),
            whiten(per_noise[:, None] * np.concatenate(starts)),
            whiten(per_noise[:, None] * np.concatenate(rows)),
        )

    def errors(self, i: int, settings: Sequence[Setting]) -> dict[str, Array]:
        """Return prediction less sample of each topic of a window from its sampled start, in the topic's unit."""
        setting = settings[self.windows[i].run]
        return {
            topic.name: measurements.residual(topic, sampled.states, setting.errors) * topic.noise
            for topic, sampled, _ in self._sampled(i, setting, self.windows[i].start, NO_DIRECTIONS)
        }

    def _sampled(
        self, i: int, setting: Setting, start: Array, directions: Directions
    ) -> Iterator[tuple[Topic, Motion, Array]]:
        """Yield each topic of a window, the motion at its samples, and its residuals' derivatives along directions."""
        window = self.windows[i]
        inside, turns = slice(window.first, window.first + window.steps), self._turns[window.run]
        times = [
            topic.times + topic.shift - setting.delays.get(topic.name, topic.shift) + off
            for topic in window.topics for off in topic.offsets
        ]  # fmt: skip
        order = np.argsort(np.concatenate(times), kind="stable")
        motion = self._shooter.predict(
            setting.plant, start[:13], setting.actuation.wrench[inside], self._step, np.concatenate(times)[order],
            directions, setting.force + (start[13:] if len(start) > 13 else 0.0),
            None if turns is None else turns[window.first : window.first + window.steps + 1],
        )  # fmt: skip
        back = np.empty_like(order)
        back[order] = np.arange(len(order))
        count = 0
        for topic in window.topics:
            size, several = len(topic.times), len(topic.offsets)
            at = back[count : count + several * size].reshape(several, size)
            count += several * size
            parts = (motion.states, motion.rates, motion.tangents)
            sampled = Motion(*(x[at[0]] if several == 1 else x[at].mean(axis=0) for x in parts))
            along = measurements.derivative(topic, sampled.states, sampled.tangents, setting.errors)
            yield topic, sampled, along.reshape(size * len(topic.components), -1)

    def weigh_as(self, other: Residuals) -> None:
        """Take weights, noise and errors of the commands from residuals of the same windows."""
        self.weights, self.whiteners, self._noise_parts = other.weights, other.whiteners, other._noise_parts

    def update_command_errors(self, values: Array) -> None:
        """Weight the residuals by the uncertainty of sampled commands, at its most likely size."""
        # Where commands are not known, the noise of a topic is not known from its samples' differences, which contain
        # the motion: that is its upper bound. The likelihood gives both, the noise of each topic and the size of the
        # errors.
        if not any(forces.impulses for forces in self._forces):
            return
        settings = self.settings(values)
        starts = of_windows(lambda i: self.solve_start(i, settings, values), self)
        self.whiteners = [None] * len(self.windows)
        by_impulses, left, projected = list[Array](), list[Array](), list[Array]()
        for i, start in enumerate(starts):
            residual, by_start, _ = self.raw(i, settings, start, full=False)
            by = self._by_impulse(i, settings, start)
            q, _ = np.linalg.qr(by_start)
            left.append(residual - q @ (q.T @ residual))
            projected.append(by - q @ (q.T @ by))
            by_impulses.append(by)
        which = [window.topic_names for window in self.windows]
        self.command_error, parts = most_likely_errors(left, projected, which, self._noise_parts)
        before = [self._per_noise(window) for window in self.windows]
        self._noise_parts = parts
        for i, by in enumerate(by_impulses):
            by *= (self._per_noise(self.windows[i]) / before[i])[:, None]
            self.whiteners[i] = whitener(by, self.command_error)

    def _per_noise(self, window: Window) -> Array:
        """Return the factor of each row by which the noise of its topic is less than that of its samples."""
        parts = [1.0 / self._noise_parts.get(topic.name, 1.0) for topic in window.topics]
        return np.repeat(parts, [len(topic.times) * len(topic.components) for topic in window.topics])

    def _by_impulse(self, i: int, settings: Sequence[Setting], start: Array) -> Array:
        """Return the residuals of a window by the impulses that sampled commands leave open."""
        window = self.windows[i]
        setting, impulses = settings[window.run], self._forces[window.run].impulses
        if impulses is None:
            return np.zeros((len(self.weights[i]), 0))
        pushed = error_wrenches(impulses, setting.actuation.lag, self._step, window.first * self._step, window.steps)
        n = len(pushed)
        directions = Directions(np.zeros((n, STATE_SIZE)), [None] * n, range(n), np.zeros((n, 3)), pushed)
        along = np.concatenate([along for _, _, along in self._sampled(i, setting, start, directions)])
        result: Array = self._per_noise(window)[:, None] * along
        return result

    @staticmethod
    def _changes_motion(p: Parameter, run: int) -> bool:
        """Return True if a parameter changes the motion of a run, and not only its measurements."""
        return p.run in (None, run) and p.kind in _MOTION_KINDS

    def _directions(self, moving: Sequence[int], setting: Setting, inside: slice, start: Array) -> Directions:
        n, count = len(self._starts), len(self._starts) + len(moving)
        tangents, force = np.zeros((count, STATE_SIZE)), np.zeros((count, 3))
        tangents[:n], force[:n] = np.split(self._basis(start), [STATE_SIZE], axis=1)
        names: list[str | None] = [None] * count
        inputs: list[int | None] = [None] * count
        wrenches: list[Array] = []
        for row, j in enumerate(moving, n):
            p = self.parameters[j]
            if p.kind in ("plant", "current"):
                names[row] = p.plant
            elif p.kind == "force":
                force[row, p.index] = 1.0
            else:
                inputs[row] = len(wrenches)
                actuation = setting.actuation
                changes = {
                    "lag": actuation.by_lag[None], "thrust": actuation.by_scale, "asymmetry": actuation.by_loss,
                    "phase": actuation.by_changes,
                }  # fmt: skip
                wrenches.append(changes[p.kind][p.index][inside])
        wrench = np.stack(wrenches) if wrenches else np.empty((0, 0, 2, 6))
        return Directions(tangents, names, inputs, force, wrench)

    def _add_errors(self, jacobian: Array, topic: Topic, motion: Motion, setting: Setting, run: int) -> None:
        """Write the derivatives by what changes no motion."""
        for j, p in enumerate(self.parameters):
            if p.run not in (None, run):
                continue
            if p.kind == "delay" and topic.name in p.topics:
                late = measurements.derivative(topic, motion.states, -motion.rates[:, None], setting.errors)
                jacobian[:, j] = late.ravel()
            elif p.kind in ("lever", "scale", "bias"):
                by = measurements.derivative_by_errors(topic, motion.states, setting.errors, p.kind, p.index)
                if by is not None:
                    jacobian[:, j] = by.ravel()

    def solve_start(self, i: int, settings: Sequence[Setting], values: Array) -> Array:
        """Return the best start of a window, shape (13,), or (16,) with a force."""
        known = self._found.get(i)
        state = self.windows[i].start
        if self.force_deviation is not None:
            state = np.concatenate([state, np.zeros(3)])
        if self.holds_starts:
            return state
        if known is not None:
            state = self._add_step(known.state, known.slope @ (values - known.values))
        weight, best, base, step = self.weights[i], np.inf, state, np.zeros(len(self._starts))
        for _ in range(_MAX_SOLVES):
            try:
                residual, by_start, _ = self.raw(i, settings, state, full=False)
                left, by_start = self._with_prior(weight * residual, weight[:, None] * by_start, state)
                cost = float(left @ left)
            except IdentificationError:  # no motion from there
                if best == np.inf:
                    raise
                cost = np.inf
            if cost > best + 1.0:  # too far
                step = 0.5 * step
                state = self._add_step(base, step)
                continue
            best, base, step = cost, state, self._step_of(left, by_start)
            state = self._add_step(base, step)
            if float(np.sum(np.square(by_start @ step))) < _SOLVED**2:
                break
        return state

    def keep_starts(self) -> None:
        """Search for starts from now on about those of the last evaluation, as is right where that was the best."""
        self._found = dict(self._tried)

    def reduced(self, i: int, settings: Sequence[Setting], values: Array) -> Reduced:
        """Return the residuals of a window without its start, and with their derivatives."""
        state = self.solve_start(i, settings, values)
        residual, by_start, jacobian = self.raw(i, settings, state, full=True)
        weight = self.weights[i]
        left: Array = weight * residual
        by_start, jacobian = weight[:, None] * by_start, weight[:, None] * jacobian
        left, by_start = self._with_prior(left, by_start, state)
        times = self._row_times(i)
        if added := len(left) - len(times):
            jacobian = np.concatenate([jacobian, np.zeros((added, jacobian.shape[1]))])
            times = np.concatenate([times, np.zeros(added)])
        q, r = np.linalg.qr(np.concatenate([by_start, self._prior]))
        top = q[: len(by_start)]
        slope: Array = -np.linalg.solve(r, top.T @ jacobian)
        if self.holds_starts:
            return Reduced(left, jacobian, times)
        self._tried[i] = _Start(state, values.copy(), slope)
        step: Any = -np.linalg.solve(r, top.T @ left)
        best: Any = left + by_start @ step
        return Reduced(best, jacobian + by_start @ slope, times)

    @property
    def eliminated(self) -> int:
        """Unknowns of each window that are eliminated."""
        return len(self._starts)

    def forces(self) -> Array:
        """Return the force of each window as eliminated last, shape (windows, 3) [N, NED]."""
        return np.array([self._tried[i].state[13:] for i in range(len(self.windows))])

    def update_force_deviation(self) -> None:
        """Take the deviation of the random force from the windows' forces."""
        if self.force_deviation is not None:
            self.force_deviation = np.maximum(_MIN_FORCE, np.sqrt(np.mean(np.square(self.forces()), axis=0)))

    def _with_prior(self, left: Array, by_start: Array, state: Array) -> tuple[Array, Array]:
        """Return residuals and derivatives by the start, with those of the prior of a window's force behind them."""
        if self.force_deviation is None:
            return left, by_start
        rows = np.zeros((3, by_start.shape[1]))
        rows[:, -3:] = np.diag(1.0 / self.force_deviation)
        return np.concatenate([left, state[13:] / self.force_deviation]), np.concatenate([by_start, rows])

    def _basis(self, start: Array) -> Array:
        """Return the change of state and force of a start along each of its coordinates, shape (starts, 16)."""
        rows = np.zeros((_FORCES.stop, STATE_SIZE + len(_FORCES)))
        rows[[0, 1, 2, *range(6, 15)], [0, 1, 2, *range(7, 16)]] = 1.0
        rows[3:6, 3:7] = 0.5 * half_turns(start[3:7])
        return rows[self._starts]

    def _row_times(self, i: int) -> Array:
        return np.concatenate([np.repeat(t.times, len(t.components)) for t in self.windows[i].topics])

    def _step_of(self, residual: Array, by_start: Array) -> Array:
        normal = by_start.T @ by_start + self._prior.T @ self._prior
        step: Array = np.asarray(-np.linalg.solve(normal, by_start.T @ residual), float)
        return step

    def _add_step(self, state: Array, step: Array) -> Array:
        """Return a start that is moved along its own directions."""
        moved: Array = state + (step @ self._basis(state))[: len(state)]
        moved[3:7] /= np.linalg.norm(moved[3:7])
        return moved


def of_windows(function: Callable[[int], Result], problem: Residuals) -> list[Result]:
    """Return a function's results for the index of each window; what is compiled in it runs on all processors."""
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        return list(pool.map(function, range(len(problem.windows))))


def normal_equations(problem: Residuals, values: Array) -> tuple[Array, Array, float, int]:
    """Return information, score, sum of squares and number of residuals, with the priors in the first two."""
    settings = problem.settings(values)
    reduced = of_windows(lambda i: problem.reduced(i, settings, values), problem)
    deviation, start = (np.array([getattr(p, name) for p in problem.parameters]) for name in ("deviation", "start"))
    information = np.diag(deviation**-2.0) + sum(r.jacobian.T @ r.jacobian for r in reduced)
    score = (values - start) / deviation**2 + sum(r.jacobian.T @ r.residual for r in reduced)
    squares = sum(float(r.residual @ r.residual) for r in reduced)
    return information, score, squares, sum(len(r.residual) for r in reduced)
