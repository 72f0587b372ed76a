"""Findings of an identification as text: its reliability, what the runs do not determine, and the next maneuver."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from cosim.errors import IdentificationError
from cosim.identification.fit import STAGES, Fit
from cosim.identification.intervals import DISAGREES
from cosim.identification.log import UNITS, Log, command_spans
from cosim.identification.parameters import NUISANCES, RANDOM_FORCE

_USELESS = 10.0  # chi2 per degree of freedom, above which nothing was identified
_MAX_CORRELATION = 0.95  # magnitude of the correlation, above which runs do not separate two numbers
_MAX_SCALE = 0.05  # relative error of the DVL's scale, above which a warning names it
_MAX_LISTED = 6  # names in a list
MIN_CAUSE_FRACTION = 0.1  # fraction of the unexplained residuals, above which a cause is named
_WEAK = 0.1  # ratio of nominal to prior deviation, above which a maneuver is advised
_LATE = 0.15  # s, delay of samples above which a delay is named as a cause: a lag of the thrusters is seldom longer
_SLOW = 0.2  # s, time between changes of the commands, from which on added mass and lag are not determined
_SLOW_SAMPLES = 0.03  # s, time between samples of servo outputs, from which on a warning names their rate
_MAX_DELAY_CORRELATION = 0.9  # magnitude of the correlation of a delay and the lag, above which the fit is refused
_NEEDS = {  # motion that determines the numbers of a key
    "hydrodynamics.added_mass": "quick changes of speed along and about the axis: steps of full stick, a second each",
    "hydrodynamics.linear_damping": "slow and fast motion along the axis, each held for some seconds",
    "hydrodynamics.quadratic_damping": "slow and fast motion along the axis, each held for some seconds",
    "hydrostatics.buoyancy": "vertical motion up and down at the same thrust, or ten seconds without thrust",
    "hydrostatics.center_of_buoyancy": "roll and pitch of 20 degrees or more, to both sides, held for some seconds",
    "rigid_body.center_of_gravity": "roll and pitch of 20 degrees or more, to both sides, held for some seconds",
    "thrusters.time_constant": "steps of thrust, with angular velocities at 20 Hz or more",
    "thrusters.delay": "steps of thrust, with velocities at 5 Hz or more",
    "sensors.dvl_position": "quick turns about all axes",
    "thrusters.matrix": "a force that is known: a bollard pull of each thruster",
}  # fmt: skip


def verdict(fit: Fit) -> str:
    """Return a sentence about the count of determined numbers and the quality of the fit."""
    free = fit.vehicle_indices()
    determined = len(free) - len(fit.undetermined())
    seconds = sum(window.steps for window in fit.windows) * fit.step
    return (
        f"{determined} of {len(free)} numbers are determined by {seconds:.0f} s of motion in {len(fit.windows)} "
        f"window{'s' if len(fit.windows) > 1 else ''}; chi² is {fit.intervals.chi2:.2f} by degrees of freedom."
    )


def shared_nuisances(fit: Fit) -> Iterator[str]:
    """Yield a sentence with the nuisances that all runs share."""
    numbers = zip(fit.parameters, fit.values, fit.intervals.half, strict=True)
    shared = [f"{p.name} {x:.3g} ± {half:.2g} {p.unit}".rstrip() for p, x, half in numbers
              if p.is_nuisance and p.run is None and p.kind != "phase"]  # fmt: skip
    if shared:
        yield f"Also estimated: {'; '.join(shared)}."


def warnings(fit: Fit, logs: Sequence[Log]) -> Iterator[str]:
    """Yield the warnings that a user must read before using the numbers."""
    if fit.intervals.chi2 > _USELESS:
        yield (
            f"Do not use these numbers: chi² is {fit.intervals.chi2:.0f} by degrees of freedom, and no better were "
            "found. Free fewer numbers, start from a vehicle that is nearer, or drive more maneuvers."
        )
    elif fit.intervals.chi2 > DISAGREES:
        worst, size = fit.worst_topic()
        yield (
            f"The model does not explain these runs to within the sensors' noise: chi² is {fit.intervals.chi2:.2f} by "
            f"degrees of freedom, and more than {DISAGREES} says that something is missing in it. Worst is the "
            f"{worst.replace('_', ' ')}: its residuals are {size:.1f} times its noise. The intervals are those of a "
            "jackknife, and hold as far as the pieces of the runs are alike."
        )
    if fit.intervals.chi2 > DISAGREES and not fit.turns_measured:
        yield _cause(fit, any(slow_commands(log) for log in logs))
    if fit.forces is not None:
        sizes = ", ".join(f"{x:.2g}" for x in np.sqrt(np.mean(np.square(fit.forces), axis=0)))
        yield (
            f"A force that changes in time was also estimated, constant within windows of {STAGES[0]:g} s: {sizes} N "
            "north, east and down (root mean square). Its mean over the runs looks like weight less buoyancy or a "
            "current; longer runs make that smaller."
        )
    elif not fit.turns_measured and fit.command_error is None and fit.windows[0].steps * fit.step < 0.5 * STAGES[-1]:
        yield (
            f"Predictions over {STAGES[-1]:g} s fail, as they do where a motion is unstable without its control: the "
            f"numbers are those of windows of {STAGES[0]:g} s."
        )
    scale = [float(x) for p, x in zip(fit.parameters, fit.values, strict=True) if p.kind == "scale"]
    if scale and abs(scale[0]) > _MAX_SCALE:
        yield (
            f"The DVL's velocities are {100 * scale[0]:+.0f} % off by the other sensors: check its speed of sound and "
            "mounting before you use the numbers."
        )
    undetermined = [fit.parameters[i].name for i in fit.undetermined()]
    if undetermined:
        yield (
            f"These numbers rest on what was known before, not on the runs: {_list(undetermined)}. Nothing in these "
            "logs excites them enough."
        )
    if pairs := [f"{one} and {other}" for one, other in fit.correlated(_MAX_CORRELATION)]:
        yield f"These runs hardly separate (correlation above {_MAX_CORRELATION}): {_list(pairs[:_MAX_LISTED])}."
    if not any(p.kind == "thrust" for p in fit.parameters):
        yield (
            "All is in units of the thrust that the start vehicle's thrusters give. If they give 5 % more, damping, "
            "mass with added mass, and weight less buoyancy are 5 % greater."
        )
    losses = [float(x) for p, x in zip(fit.parameters, fit.values, strict=True) if p.kind == "asymmetry"]
    if losses:
        yield (
            f"Thrusters give {100.0 * min(losses):.0f} to {100.0 * max(losses):.0f} % less backward than forward. A "
            "vehicle's file has no number for that: correct the curve from pulse to force that imports runs."
        )
    if fit.rejected:
        counts = "; ".join(f"{n} since {reason}" for reason, n in fit.rejected.most_common())
        yield f"{fit.rejected.total()} windows were rejected: {counts}."
    if fit.outliers:
        yield f"{fit.outliers} of {fit.samples} measured components are outliers, and count by Huber's weights."
    yield from filter(None, map(slow_commands, logs))
    needed = {"velocity", "depth"} | (set() if fit.turns_measured else {"angular_velocity"})
    missing = needed - {topic.name for log in logs for topic in log.topics}
    for name in sorted(missing):
        yield f"There are no samples of {name.replace('_', ' ')} in these runs."


def slow_commands(log: Log) -> str:
    """Return a warning about slowly sampled commands of a run; empty if they are fast enough."""
    if log.sampled:
        period = float(np.median(np.diff(log.times)))
        if period < _SLOW_SAMPLES:
            return ""
        logged = f"Servo outputs of {log.name} are logged at {1.0 / period:.2g} Hz"
        if period > _SLOW:
            return f"{logged}: they determine damping and weight less buoyancy, not added mass, lag or delays."
        return (
            f"{logged}. What thrust did in between counts as noise, which makes the intervals as wide as they are. "
            "Telemetry with SERVO_OUTPUT_RAW at 50 Hz makes them smaller: an ArduSub's .BIN has 10 Hz, which no "
            "parameter changes."
        )
    spans = command_spans(log)
    period = float(np.quantile(spans, 0.05)) if len(spans) else 0.0
    if period < _SLOW:
        return ""
    return (
        f"Commands of {log.name}, sampled at {1.0 / period:.2g} Hz, show changes of thrust up to {period:.1g} s late: "
        "they determine damping and weight less buoyancy where thrust rests for seconds, not added mass, lag or delays."
    )


def _cause(fit: Fit, slow: bool) -> str:
    """Return the likely causes of a poor fit as text, with the flags that would estimate them."""
    late = {name: x for name, x in fit.delays.items() if x > _LATE}
    if late and not slow and not any(p.kind == "delay" for p in fit.parameters):
        delays = ", ".join(f"{name.replace('_', ' ')} {x:.2f} s" for name, x in late.items())
        return f"Samples come late behind the commands: {delays}. Estimate that, too: {_nuisance_flag(fit, 'delay')}."
    named = [cause for cause in fit.causes if cause.fraction > MIN_CAUSE_FRACTION]
    if named:
        causes = ", ".join(f"{_CAUSES[c.flag.split()[1]]} ({100 * c.fraction:.0f} %: {c.flag})" for c in named[:3])
        return (
            f"What would explain most of that, in one step of the fit: {causes}. A flag takes the place of what it "
            f"names now, {_nuisance_flag(fit)}: give it whole."
        )
    if fit.forces is not None:
        return "The force may change within windows too: no delay, scale or factor of a thruster explains the rest."
    if slow:
        return "The commands are sampled too slowly to explain these runs, see below."
    return (
        "No delay, scale, force or factor of a thruster explains that: look for a current or an error of a sensor "
        "that changes in time, and for parts that the model has not."
    )


def _nuisance_flag(fit: Fit, *more: str) -> str:
    """Return the flag ``--nuisance`` with the nuisances of a fit and further ones."""
    kinds = {p.kind for p in fit.parameters}
    named = [name for name in NUISANCES if name in kinds]
    return " ".join(["--nuisance", *named, *([RANDOM_FORCE] if fit.forces is not None else []), *more])


_CAUSES = {
    "delay": "late samples", "scale": "the DVL's scale", "force": "a constant force, as of a tether",
    "asymmetry": "thrusters that are weaker backward", "thrusters.matrix": "unequal thrusters",
    "hydrostatics.trim": "a constant force on the body, as of a mounted tether",
    "thrusters.time_constant": "a lag of the thrusters", "current": "a current",
    "sensors.dvl_position": "the DVL's lever arm",
    "bias": "biases of the gyro", "phase": "commands that change early or late between samples",
    "random_force": "a force that changes in time, such as of waves or a tether",
}  # fmt: skip


def require_distinguishable(fit: Fit) -> None:
    """Refuse a fit of a delay and the thrusters' lag that the runs do not separate."""
    lags, delays = ([i for i, p in enumerate(fit.parameters) if p.kind == kind] for kind in ("lag", "delay"))
    for lag, delay in itertools.product(lags, delays):
        size = abs(float(fit.intervals.correlation[lag, delay]))
        if size > _MAX_DELAY_CORRELATION:
            raise IdentificationError(
                f"{fit.parameters[lag].name} and the {fit.parameters[delay].name} are not separated by these runs "
                f"(correlation {size:.2f}), expected one of the two: --free without the time constant, or "
                "without a delay"
            )


def advice(fit: Fit) -> Iterator[str]:
    """Yield the maneuvers to drive next, for the numbers that are determined worst."""
    worst: dict[str, float] = {}
    for i in fit.vehicle_indices():
        key, ratio = ".".join(fit.parameters[i].name.split(".")[:2]), float(fit.intervals.prior_fraction[i])
        if ratio > _WEAK:
            worst[key] = max(worst.get(key, 0.0), ratio)
    for key in sorted(worst, key=lambda key: -worst[key])[:3]:
        yield f"For {key}: {_NEEDS.get(key, 'motion along and about all axes')}."
    if not worst:
        yield "These runs determine every free number; more runs make the intervals smaller."


def topic_rows(logs: Sequence[Log]) -> Iterator[tuple[str, ...]]:
    """Yield a row for each topic of each run: samples, rate, noise."""
    for log in logs:
        for topic in log.topics:
            rate = (len(topic.times) - 1) / max(1e-9, float(topic.times[-1] - topic.times[0]))
            noise = ", ".join(f"{x:.2g}" for x in np.unique(topic.noise.round(6)))
            name, count = topic.name.replace("_", " "), f"{len(topic.times)}"
            yield log.name, name, count, f"{rate:.1f}", f"{noise} {UNITS[topic.name]}"


def _list(names: Sequence[str]) -> str:
    more = f" and {len(names) - _MAX_LISTED} more" if len(names) > _MAX_LISTED else ""
    return ", ".join(names[:_MAX_LISTED]) + more
