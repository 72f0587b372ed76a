"""Validation: errors of predictions from start states that the samples give; and choice of a structure by them."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.spatial.transform import Rotation

from cosim.errors import IdentificationError
from cosim.identification.delays import move_back, usual_delays
from cosim.identification.fit import Fit, fit, single_thread
from cosim.identification.log import TOPICS, Log
from cosim.identification.measurements import NO_ERRORS, residual
from cosim.identification.parameters import (
    TRANSLATION_FREE,
    Parameter,
    free_parameters,
    nuisances,
    with_mean_nuisances,
    with_values,
)
from cosim.identification.residuals import Residuals, normal_equations
from cosim.identification.windows import cut_windows
from cosim.simulation.signals import Array
from plant_fmu.vehicle import Vehicle

HORIZONS = (2.0, 5.0, 10.0)  # s, lengths of the predictions
AUTO = "auto"  # in place of names of nuisances
_COUPLINGS = tuple(f"hydrodynamics.added_mass.{i}.{j}" for i in (1, 2, 3) for j in range(i + 1, 7))
_HORIZONS = (2.0, 5.0)  # s, of the predictions that are compared
_TRIM = ("hydrostatics.trim.1", "hydrostatics.trim.2")  # forward and right: the vertical one is that of the buoyancy
_LEVER = tuple(f"sensors.dvl_position.{i}" for i in (1, 2, 3))
_FOLDS = 2
_MIN_GAIN = 1e-3
_CLEAR = 1.0  # standard errors of the mean over the runs, by which a choice must be better


@dataclass(frozen=True)
class Prediction:
    """Errors of the predictions of one topic over one horizon, by component, in the topic's unit."""

    topic: str
    horizon: float  # s
    turns_measured: bool  # True if attitude and angular velocity are inputs, as measured; False if they are predicted
    windows: int  # number of predicted windows
    identified: Array  # (c,) root mean square errors of the identified vehicle
    start_vehicle: Array  # (c,) those of the vehicle with the start values
    constant_velocity: Array  # (c,) SI, those of a prediction with constant velocity
    r2: Array  # (c,) coefficient of determination of the identified vehicle: 1 less squared errors by total variation
    scores: Array  # (runs,) mean of r2 over the components, of each run; NaN for runs without a window


def validate(
    logs: Sequence[Log], vehicle: Vehicle, parameters: Sequence[Parameter], values: Array, step: float,
    horizons: Sequence[float] = HORIZONS, modes: Sequence[bool] = (False, True), compare: bool = True,
) -> list[Prediction]:  # fmt: skip
    """Predict windows of runs from their sampled start states alone, and compare with the samples; step [s]."""
    # `modes`: with attitude and angular velocity predicted (False), and with those that were measured as inputs (True).
    # `compare`: the errors of the start vehicle and of a constant velocity too.
    starts = np.array([p.start if not p.is_nuisance else x for p, x in zip(parameters, values, strict=True)])
    logs = [move_back(log, _delays(vehicle, parameters, values)) for log in logs]
    predictions = []
    for horizon, measured in itertools.product(horizons, modes):
        windows, _ = cut_windows(logs, vehicle, step, horizon)
        problem = Residuals(logs, vehicle, parameters, windows, step, turns_measured=measured)
        settings = [problem.settings(x) for x in ((values, starts) if compare else (values,))]
        rows: dict[str, list[tuple[int, Array, tuple[Array, ...]]]] = {}
        for i, window in enumerate(problem.windows):
            try:
                predicted = [problem.errors(i, setting) for setting in settings]
            except IdentificationError:
                continue  # one of the two predictions does not stay finite
            for topic in window.topics:
                errors = [x[topic.name] for x in predicted]
                if compare:
                    states = _constant_velocity(window.start, topic.times)
                    errors.append(residual(topic, states, NO_ERRORS) * topic.noise)
                rows.setdefault(topic.name, []).append((window.run, topic.values, tuple(errors)))
        names = [name for name in TOPICS if name in rows]
        predictions += [_summarize(name, horizon, measured, rows[name], len(logs)) for name in names]
    return predictions


def predicted_samples(log: Log, fit: Fit, vehicle: Vehicle, horizon: float) -> tuple[Array, Array, Array]:
    """Return times [s], (n,), measured and predicted velocities, (n, 3), where a run is predicted; horizon [s]."""
    parameters, values = with_mean_nuisances(fit.parameters, fit.values)
    corrected_log = move_back(log, _delays(vehicle, parameters, values))
    windows, _ = cut_windows([corrected_log], vehicle, fit.step, horizon)
    problem = Residuals([corrected_log], vehicle, parameters, windows, fit.step, turns_measured=fit.turns_measured)
    settings = problem.settings(values)
    parts = [(np.zeros(0), np.zeros((0, 3)), np.zeros((0, 3)))]
    for i, window in enumerate(problem.windows if log.topic("velocity") else ()):
        topic = next(t for t in window.topics if t.name == "velocity")
        try:
            error = problem.errors(i, settings)["velocity"]
        except IdentificationError:
            continue  # the prediction does not stay finite
        parts.append((topic.times + window.begin, topic.values, topic.values + error))
    times, measured, predicted = (np.concatenate(x) for x in zip(*parts, strict=True))
    return times, measured, predicted


def _delays(vehicle: Vehicle, parameters: Sequence[Parameter], values: Array) -> dict[str, float]:
    """Return the delays [s] by topic."""
    return usual_delays(vehicle) | {
        name: float(x) for p, x in zip(parameters, values, strict=True) if p.kind == "delay" for name in p.topics
    }


def _summarize(
    name: str, horizon: float, measured: bool, rows: Sequence[tuple[int, Array, tuple[Array, ...]]], runs: int
) -> Prediction:
    """Return the errors of a topic from run, samples and errors of each window."""
    of_run = np.concatenate([np.full(len(values), run) for run, values, _ in rows])
    samples = np.concatenate([values for _, values, _ in rows])
    errors = [np.concatenate(e) for e in zip(*(e for _, _, e in rows), strict=True)]
    # quaternions have no such coefficient by axis; positions and depth have that about their mean
    spread = np.sum(np.square(samples - samples.mean(axis=0)), axis=0) if name != "attitude" else np.full(3, np.nan)
    r2 = 1.0 - np.sum(np.square(errors[0]), axis=0) / spread
    squares = [np.sum(np.square(errors[0][of_run == run]), axis=0) * len(of_run) for run in range(runs)]
    counts = np.bincount(of_run, minlength=runs)
    scores = [np.mean(1.0 - s / (n * spread)) if n else np.nan for s, n in zip(squares, counts, strict=True)]
    identified, *others = (np.sqrt(np.mean(np.square(e), axis=0)) for e in errors)
    start, constant = others or (np.full_like(identified, np.nan),) * 2
    return Prediction(name, horizon, measured, len(rows), identified, start, constant, r2, np.array(scores))


def _constant_velocity(start: Array, times: Array) -> Array:
    """Return the states of a motion with the constant velocities of its start, shape (n, 13); times (n,) [s]."""
    attitude = Rotation.from_quat(start[3:7], scalar_first=True)
    position = start[:3] + times[:, None] * attitude.apply(start[7:10])
    turned = attitude * Rotation.from_rotvec(times[:, None] * start[10:13])
    velocity = np.broadcast_to(start[7:], (len(times), 6))
    return np.hstack([position, turned.as_quat(scalar_first=True), velocity])


@dataclass(frozen=True)
class Choice:
    """A candidate and its effect on the prediction of runs that were not fitted."""

    name: str
    gain: float  # mean change of the coefficient of determination over the runs
    error: float  # standard error of that mean
    is_taken: bool


@dataclass(frozen=True)
class Structure:
    """The chosen structure."""

    vehicle: Vehicle  # start vehicle, without the damping that is left out
    parameters: tuple[Parameter, ...]
    choices: tuple[Choice, ...]
    delays: dict[str, float]  # s, of the samples behind the commands, by topic

    def summary(self) -> str:
        """Return what was chosen and what not, in sentences."""
        taken, left = (
            ", ".join(f"{c.name} ({c.gain:+.3f} ± {c.error:.3f})" for c in self.choices if c.is_taken == is_taken)
            for is_taken in (True, False)
        )
        return (
            "Chosen by how well runs that were not fitted are predicted 2 and 5 s ahead (change of R², with its "
            f"standard error over the runs): {taken or 'nothing beside the delay'}. Left out: {left or 'nothing'}."
        )


@dataclass(frozen=True)
class _Fold:
    """Normal equations of all candidates at a fit of some runs, and the runs to predict."""

    parameters: Sequence[Parameter]
    values: Array  # (p,) of the fit; candidates that are not fitted at their starts
    information: Array  # (p, p)
    score: Array  # (p,)
    test: Sequence[Log]
    runs: Sequence[int]  # indices of the runs to predict
    step: float  # s

    @property
    def delay(self) -> float:
        """Fitted delay of the samples behind the commands [s]."""
        return next(float(x) for p, x in zip(self.parameters, self.values, strict=True) if p.kind == "delay")

    def step_to(self, free: Sequence[str], zero: Sequence[str]) -> Array:
        """Return the best values of the free parameters, those of others at their starts or zero, by one step."""
        names = [_shared(p) for p in self.parameters]
        fixed = np.array([0.0 if name in zero else p.start for name, p in zip(names, self.parameters, strict=True)])
        move = np.array([name not in free or name in zero for name in names])
        change = np.where(move, fixed - self.values, 0.0)
        left = ~move
        right = -self.score[left] - self.information[np.ix_(left, move)] @ change[move]
        change[left] = np.linalg.solve(self.information[np.ix_(left, left)], right)
        low, high = (np.array([getattr(p, name) for p in self.parameters]) for name in ("min", "max"))
        values: Array = np.clip(self.values + change, low, high)
        return values


@single_thread()
def choose_structure(logs: Sequence[Log], vehicle: Vehicle, keys: Sequence[str] | None) -> Structure:
    """Choose nuisances, couplings and damping so that runs that were not fitted are predicted best."""
    if len(logs) < 2 * _FOLDS:
        raise IdentificationError(f"--nuisance {AUTO}: has {len(logs)} runs, expected {2 * _FOLDS} or more to compare")
    base = [_shared(p) for p in free_parameters(vehicle, (*(keys or TRANSLATION_FREE), "thrusters.delay"))]
    groups = {
        "trim": [key for key in _TRIM if key not in base],
        "current": [_shared(p) for p in nuisances(("current",), logs)],
        "lever": [key for key in _LEVER if key not in base],
        "scale": [_shared(p) for p in nuisances(("scale",), logs)],
        "coupled added mass": [] if keys else [_shared(p) for p in free_parameters(vehicle, _COUPLINGS)],
    }
    taken, zero = {*base}, set[str]()
    folds = [
        _fold(logs, vehicle, base, [name for group in groups.values() for name in group], k) for k in range(_FOLDS)
    ]
    best, choices = _scores(folds, vehicle, taken, zero, len(logs)), list[Choice]()
    for name, group in groups.items():
        if group:
            scores = _scores(folds, vehicle, taken | {*group}, zero, len(logs))
            choices.append(_compare(name, best, scores))
            if choices[-1].is_taken:
                taken, best = taken | {*group}, scores
    for kind in ("linear", "quadratic") if not keys else ():
        removed = {name for name in base if f".{kind}_damping." in name}
        scores = _scores(folds, vehicle, taken, zero | removed, len(logs))
        # the simpler structure is taken where it is not worse
        choice = _compare(f"no {kind} damping", best, scores)
        choices.append(replace(choice, is_taken=choice.gain > 0.0 and not zero))
        if choices[-1].is_taken:
            zero, best = zero | removed, scores
    every = free_parameters(
        vehicle, (*(keys or TRANSLATION_FREE), "thrusters.delay", *_TRIM, *_LEVER, *(() if keys else _COUPLINGS))
    )
    every += nuisances(("current", "scale"), logs)
    absent = [p for p in every if _shared(p) in zero]
    return Structure(
        with_values(vehicle, absent, np.zeros(len(absent))),
        tuple(p for p in every if _shared(p) in taken - zero),
        tuple(choices), dict.fromkeys(TOPICS, float(np.mean([fold.delay for fold in folds]))),
    )  # fmt: skip


def _fold(logs: Sequence[Log], vehicle: Vehicle, base: Sequence[str], candidates: Sequence[str], k: int) -> _Fold:
    """Fit the base to the runs that are not of fold k, and linearize all candidates there."""
    train = [log for run, log in enumerate(logs) if run % _FOLDS != k]
    runs = [run for run in range(len(logs)) if run % _FOLDS == k]
    known = {p.name: p for p in free_parameters(vehicle, [n for n in (*base, *candidates) if "." in n])}
    parameters = [known[name] for name in base]
    done = fit(train, vehicle, parameters, turns_measured=True)
    added = [known[name] for name in candidates if name in known]
    added += [p for p in nuisances(("current", "scale"), train) if _shared(p) in candidates]
    every = [*done.parameters, *added]
    values = np.concatenate([done.values, [p.start for p in added]])
    problem = Residuals(done.logs, vehicle, every, done.windows, done.step, turns_measured=True)
    problem.weights = list(done.weights)
    information, score, *_ = normal_equations(problem, values)
    return _Fold(every, values, information, score, [logs[run] for run in runs], runs, done.step)


def _scores(folds: Sequence[_Fold], vehicle: Vehicle, free: set[str], zero: set[str], runs: int) -> Array:
    """Return the mean coefficient of determination of the velocities of each run, from fits of the others."""
    scores = np.full(runs, np.nan)
    for fold in folds:
        values = fold.step_to([*free], [*zero])
        predictions = validate(
            fold.test,
            vehicle,
            *with_mean_nuisances(fold.parameters, values),
            fold.step,
            _HORIZONS,
            (True,),
            compare=False,
        )
        by_horizon = [p.scores for p in predictions if p.topic in ("velocity", "position")]
        scores[[*fold.runs]] = np.mean(by_horizon, axis=0) if by_horizon else -np.inf
    return scores


def _compare(name: str, before: Array, after: Array) -> Choice:
    known = np.isfinite(before) & np.isfinite(after)
    gains = (after - before)[known]
    error = float(np.std(gains, ddof=1) / np.sqrt(len(gains))) if len(gains) > 1 else np.inf
    gain = float(np.mean(gains)) if len(gains) else -np.inf
    return Choice(name, gain, error, gain > max(_MIN_GAIN, _CLEAR * error))


def _shared(p: Parameter) -> str:
    """Return the name of a parameter without its run."""
    return p.name.partition(" of run ")[0]
