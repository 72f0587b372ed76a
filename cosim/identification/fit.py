"""The fit: robust least squares of prediction errors, in short and then long windows, with priors."""

from __future__ import annotations

import contextlib
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from cosim.errors import IdentificationError
from cosim.identification.causes import Cause, find_causes
from cosim.identification.delays import delay_of, find_delays, move_back, usual_delays, within_margins
from cosim.identification.intervals import DISAGREES, MAX_PRIOR_FRACTION, Intervals, estimate_intervals
from cosim.identification.log import Log, command_spans
from cosim.identification.parameters import Parameter
from cosim.identification.residuals import Reduced, Residuals, of_windows
from cosim.identification.windows import MARGINS, Window, cut_windows
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

MAX_STEP, MIN_STEP = 0.03, 0.015  # s, bounds of the integration step
_MAX_TRANSLATION_STEP = 0.04  # s, where attitude and angular velocity are inputs: what is left is slow
STAGES = (4.0, 20.0)  # s, lengths of windows: short ones converge from distant starts, long ones separate the numbers
# relative decrease of the cost that ends a round: the very first one, the others, the last one of a stage
_FIRST_PRECISION, _ROUND_PRECISION, _LAST_PRECISION = 0.1, 1e-2, 1e-6
_FAR = 0.03  # weight of all residuals in the first round: sampled starts are off by some 30 deviations of the noise
_MAX_EVALUATIONS = 20  # of a round
_ROUNDS = (3, 2)  # rounds of each stage, with new weights between them; the very first one keeps the sampled starts
_HUBER = 3.0  # standard deviations, from which on the cost of a residual is linear
_OUTLIER = 6.0  # standard deviations, beyond which a component of a sample is called an outlier
_MIN_DISTANCE = 0.05  # prior deviations, distance of a start value from its bound


@dataclass(frozen=True)
class Fit:
    """Result of an identification."""

    parameters: tuple[Parameter, ...]
    values: Array  # (p,) fitted values of the parameters, in their units
    intervals: Intervals
    windows: tuple[Window, ...]  # windows of the last stage
    rejected: Counter[str]  # counts of rejected windows of the last stage, by the rule that rejected them
    residuals: tuple[Reduced, ...]  # weighted residuals of each window
    outliers: int  # number of components of samples that are outliers
    samples: int  # number of components of all samples
    step: float  # s, integration step
    delays: dict[str, float]  # s, start values of the delays by topic, from `find_delays`
    causes: tuple[Cause, ...] = ()  # causes of a poor fit, the greatest first
    command_error: float | None = None  # errors of sampled commands, relative to those of steps at random times
    forces: Array | None = None  # (windows, 3) N, NED, random force of each window, if it is estimated
    logs: tuple[Log, ...] = ()  # runs, with times of samples that are corrected by `delays`
    weights: tuple[Array, ...] = ()  # of the rows of each window
    turns_measured: bool = False  # True if attitude and angular velocity were inputs

    def vehicle_indices(self) -> list[int]:
        """Return the indices of the vehicle's own parameters."""
        return [i for i, p in enumerate(self.parameters) if not p.is_nuisance]

    def free_keys(self) -> list[str]:
        """Return the keys of the vehicle's file that are free, each once."""
        return list(dict.fromkeys(".".join(self.parameters[i].name.split(".")[:2]) for i in self.vehicle_indices()))

    def undetermined(self) -> list[int]:
        """Return the indices of the vehicle's parameters that rest on their priors."""
        return [i for i in self.vehicle_indices() if self.intervals.prior_fraction[i] > MAX_PRIOR_FRACTION]

    def correlated(self, threshold: float) -> Iterator[tuple[str, str]]:
        """Yield pairs whose correlation exceeds a threshold in magnitude, the greatest first; no pairs of nuisances."""
        size = np.abs(np.triu(self.intervals.correlation, 1))
        for i, j in sorted(np.argwhere(size > threshold), key=lambda pair: -size[tuple(pair)]):
            one, other = self.parameters[i], self.parameters[j]
            if not (one.is_nuisance and other.is_nuisance):
                yield one.name, other.name

    def residuals_by_topic(self) -> dict[str, Array]:
        """Return the residuals of each topic, shape (samples, components), in standard deviations of the noise."""
        residuals: dict[str, list[Array]] = {}
        for window, reduced in zip(self.windows, self.residuals, strict=True):
            for name, rows in window.by_topic(reduced.residual).items():
                residuals.setdefault(name, []).append(rows)
        return {name: np.concatenate(rows) for name, rows in residuals.items()}

    def worst_topic(self) -> tuple[str, float]:
        """Return the topic with the greatest residuals, and their root mean square in standard deviations of noise."""
        rms = {name: float(np.sqrt(np.mean(np.square(rows)))) for name, rows in self.residuals_by_topic().items()}
        worst = max(rms, key=lambda name: rms[name])
        return worst, rms[worst]


@contextlib.contextmanager
def single_thread() -> Iterator[None]:
    """Limit linear algebra to one thread: the matrices are small, and further threads would mostly wait."""
    with threadpool_limits(1):
        yield


@single_thread()
def fit(
    logs: Sequence[Log], vehicle: Vehicle, parameters: Sequence[Parameter],
    progress: Callable[[float], None] = lambda fraction: None, random_force: bool = False,
    turns_measured: bool = False, delays: dict[str, float] | None = None,
) -> Fit:  # fmt: skip
    """Fit the free parameters so that windows of runs are predicted best; delays [s] by topic, where they are known."""
    step = integration_step(logs, MAX_STEP if not turns_measured else _MAX_TRANSLATION_STEP)
    delays = find_delays(logs, vehicle, step) if delays is None else delays
    values, margins = _inside_bounds(parameters), (0.0, 0.0)
    if any(p.kind == "delay" for p in parameters):
        margins = MARGINS
        logs = [move_back(log, delays) for log in logs]
        parameters = [within_margins(p, delays) for p in parameters]
        is_delay = np.array([p.kind == "delay" for p in parameters])
        values = np.where(is_delay, [delay_of(p, delays) for p in parameters], values)
    elif vehicle.command_delay:
        logs = [move_back(log, usual_delays(vehicle)) for log in logs]
    stages = tuple(zip(STAGES, _ROUNDS, strict=True))
    if (
        turns_measured or random_force or any(log.sampled for log in logs)
    ):  # noise covers the additional information of long windows
        stages = ((STAGES[0], _ROUNDS[0] + 1),)
    total, evaluations, finished = _MAX_EVALUATIONS * sum(rounds for _, rounds in stages), 0, 0

    def on_evaluation() -> None:
        nonlocal evaluations
        evaluations += 1
        progress((finished + min(evaluations, _MAX_EVALUATIONS)) / total)

    fits: list[Fit] = []
    for length, rounds in stages:
        windows, rejected = cut_windows(logs, vehicle, step, length, margins)
        if not windows:
            raise IdentificationError(_no_window(rejected))
        problem = Problem(Residuals(logs, vehicle, parameters, windows, step, random_force, turns_measured))
        residuals = problem.residuals
        for k in range(rounds):
            is_last, evaluations = k == rounds - 1, 0
            precision = _LAST_PRECISION if is_last else _ROUND_PRECISION
            residuals.holds_starts = not fits and k == 0
            if residuals.holds_starts:  # residuals are those of wrong starts: numbers stay near their priors
                precision = _FIRST_PRECISION
                residuals.weights = [np.full(len(w), _FAR) for w in residuals.weights]
            try:
                values = problem.solve(values, on_evaluation, precision)
            except IdentificationError:
                if not fits:
                    raise
                return fits[0]  # the motion over long windows does not stay finite
            finished += _MAX_EVALUATIONS
            if not is_last:
                problem.reweigh()
                if not residuals.holds_starts:
                    residuals.update_force_deviation()
                    residuals.update_command_errors(values)
        result = replace(
            _result(problem, values, rejected, step, delays), logs=tuple(logs), turns_measured=turns_measured
        )
        if result.intervals.chi2 > DISAGREES and not turns_measured:
            result = replace(result, causes=tuple(find_causes(logs, vehicle, residuals, values, step)))
        fits.append(result)
    progress(1.0)
    first, last = fits[0], fits[-1]
    return last if last.intervals.chi2 <= max(DISAGREES, first.intervals.chi2) else first


def _result(problem: Problem, values: Array, rejected: Counter[str], step: float, delays: dict[str, float]) -> Fit:
    parameters, windows, reduced = problem.residuals.parameters, problem.residuals.windows, problem.reduced
    plain = [r.residual[: len(w)] / w for r, w in zip(reduced, problem.residuals.weights, strict=True)]
    forced = problem.residuals.force_deviation is not None
    correlated = forced or problem.residuals.command_error is not None
    intervals = estimate_intervals(parameters, values, reduced, windows, problem.residuals.eliminated, correlated)
    return Fit(
        parameters, values, intervals, tuple(windows), rejected, tuple(reduced),
        sum(int((np.abs(r) > _OUTLIER).sum()) for r in plain), sum(map(len, plain)), step, delays,
        command_error=problem.residuals.command_error, forces=problem.residuals.forces() if forced else None,
        weights=tuple(problem.residuals.weights),
    )  # fmt: skip


class Problem:
    """Problem for `scipy.optimize.least_squares`, with each window's rows reduced by QR to at most p + 1."""

    def __init__(self, residuals: Residuals) -> None:
        self.residuals = residuals
        self.reduced: list[Reduced] = []
        self._known: tuple[bytes, Array, Array] | None = None
        self._min_cost = np.inf  # smallest cost since the weights changed
        parameters = residuals.parameters
        self._start = np.array([p.start for p in parameters])
        self._deviation = np.array([p.deviation for p in parameters])
        self._bounds = np.array([p.min for p in parameters]), np.array([p.max for p in parameters])

    def solve(self, values: Array, on_evaluation: Callable[[], None], precision: float) -> Array:
        """Return the best values, searched from `values`; IdentificationError if these predict no finite motion."""

        def residual(x: Array) -> Array:
            on_evaluation()
            return self._evaluate(x)[0]

        self._known, self._min_cost = None, np.inf
        self._evaluate(values)
        solution = least_squares(
            residual, values, lambda x: self._evaluate(x)[1], bounds=self._bounds, x_scale=self._deviation,
            ftol=precision, xtol=1e-7, gtol=1e-9, max_nfev=_MAX_EVALUATIONS,
        )  # fmt: skip
        result: Array = solution.x
        self._evaluate(result)
        return result

    def reweigh(self) -> None:
        """Set the weights of the residuals by Huber's function of their present values."""
        for i, reduced in enumerate(self.reduced):
            size = np.abs(reduced.residual[: len(self.residuals.weights[i])] / self.residuals.weights[i])
            self.residuals.weights[i] = np.sqrt(np.minimum(1.0, _HUBER / np.maximum(size, 1e-12)))

    def _evaluate(self, values: Array) -> tuple[Array, Array]:
        """Return residuals, (n,), and their derivatives, (n, p), the prior's last; NaN if the motion is not finite."""
        key = values.tobytes()
        if self._known is None or self._known[0] != key:
            settings = self.residuals.settings(values)
            p = len(values)
            try:
                reduced = of_windows(lambda i: self.residuals.reduced(i, settings, values), self.residuals)
            except IdentificationError as error:
                if self._known is None:
                    raise IdentificationError("the start vehicle predicts no finite motion") from error
                return np.full_like(self._known[1], np.nan), np.full_like(self._known[2], np.nan)
            few = [np.linalg.qr(np.column_stack([r.jacobian, r.residual]), mode="r") for r in reduced]
            rows_of_all = np.concatenate([*few, np.column_stack([
                np.diag(1.0 / self._deviation), (values - self._start) / self._deviation
            ])])  # fmt: skip
            cost = float(rows_of_all[:, p] @ rows_of_all[:, p])
            if cost <= self._min_cost:
                self._min_cost = cost
                self.residuals.keep_starts()
            self.reduced = reduced
            self._known = key, rows_of_all[:, p], rows_of_all[:, :p]
        return self._known[1], self._known[2]


def integration_step(logs: Sequence[Log], longest: float = MAX_STEP) -> float:
    """Return an integration step that fits the usual time between changes of the commands, 15 ms to `longest` [s]."""
    spans = np.concatenate([command_spans(log) for log in logs])
    usual = float(np.median(spans)) if len(spans) else MAX_STEP
    if usual >= longest:
        return usual / math.ceil(usual / longest - 1e-6)
    return usual * (math.ceil(MIN_STEP / usual - 1e-6) if longest == MAX_STEP else int(longest / usual + 1e-6))


def _inside_bounds(parameters: Sequence[Parameter]) -> Array:
    """Return the start values, moved away from their bounds."""
    return np.array([
        np.clip(p.start, p.min + _MIN_DISTANCE * p.deviation, p.max - _MIN_DISTANCE * p.deviation) for p in parameters
    ])  # fmt: skip


def _no_window(rejected: Counter[str]) -> str:
    if not rejected:
        return f"no run is long enough, expected {STAGES[-1]:g} s of commands with samples"
    return f"no window is left: {'; '.join(f'{n} since {reason}' for reason, n in rejected.most_common())}"
