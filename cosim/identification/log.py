"""The recorded data of a run for identification: commands, and samples of each topic with their noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.interpolate import UnivariateSpline

from cosim.errors import IdentificationError
from cosim.results.log_facts import ATTITUDE_TIME, COMMAND_TIME, IMPORT, TopicFacts, load_log_facts
from cosim.results.record import Record, load_record
from cosim.results.run_result import SCENARIO
from cosim.simulation.signals import Array
from plant_fmu.toml_tables import read_toml
from plant_fmu.vehicle import Vehicle

TOPICS = ("velocity", "angular_velocity", "depth", "attitude", "position")
UNITS = {"velocity": "m/s", "angular_velocity": "rad/s", "depth": "m", "attitude": "rad", "position": "m"}
AXES = {"velocity": "uvw", "angular_velocity": "pqr", "depth": "z", "attitude": "xyz", "position": "xyz"}
SENSORS_OF = dict(zip(TOPICS, ("dvl", "imu", "depth_sensor", "compass", "usbl"), strict=True))
# elements of a motion's state that a topic measures: position, quaternion, velocity [m/s, rad/s]
STATES = {
    "velocity": slice(7, 10), "angular_velocity": slice(10, 13), "depth": slice(2, 3), "attitude": slice(3, 7),
    "position": slice(0, 3),
}  # fmt: skip
# smallest standard deviations of noise that is estimated from samples, in the units of `UNITS`
_MIN_NOISE = {"velocity": 1e-3, "angular_velocity": 1e-3, "depth": 1e-3, "attitude": 1e-2, "position": 5e-3}
_MAX_RATE = 50.0  # Hz; faster topics are averaged over blocks
_MIN_SAMPLES = 20  # number of samples of a topic, and of commands
_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # fourth difference: its variance is 70 times that of white noise
_MAD = 1.4826  # standard deviation of a normal distribution, in median absolute deviations

# (4, 12) rows of `half_turns`, flat, by each component of the quaternion
_HALF_TURNS = np.array([
    [0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1], [-1, 0, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0],
    [0, 0, 0, -1, -1, 0, 0, 0, 0, 1, 0, 0], [0, 0, 1, 0, 0, -1, 0, 0, -1, 0, 0, 0],
], float)  # fmt: skip
_SAMPLED = ("pulses", "effort")  # quantities of commands that an autopilot logs slower than it changes them
_MEANS = ("VISO", "VISION_POSITION_DELTA")  # DVL messages with the displacement since the last message

# topic: columns that may hold it, in order of preference, by prefix and axes, and the column of their samples' times
_COLUMNS: dict[str, tuple[tuple[str, str, str], ...]] = {
    "velocity": (("measured.velocity.", "uvw", "measured.time.dvl"), ("sensed.", "uvw", ""), ("velocity.", "uvw", "")),
    "angular_velocity": (("measured.angular_velocity.", "pqr", "measured.time.imu"), ("velocity.", "pqr", "")),
    "depth": (("measured.depth", "", "measured.time.depth_sensor"), ("position.", "z", "")),
    "attitude": (
        ("measured.attitude.e", "0123", ATTITUDE_TIME), ("sensed.e", "0123", ""), ("quaternion.e", "0123", ""),
    ),
    "position": (
        ("measured.position.", "xyz", "measured.time.usbl"), ("sensed.", "xyz", ""), ("position.", "xyz", ""),
    ),
}  # fmt: skip


@dataclass(frozen=True)
class Topic:
    """The samples of one sensor."""

    name: str  # one of `TOPICS`
    times: Array  # (n,) s, rising
    values: Array  # (n, m) in the unit of `UNITS`; attitudes are quaternions from body to world, scalar first
    noise: Array  # (c,) standard deviation of each component of the residual, in the unit of `UNITS`
    shift: float = 0.0  # s, delay that was subtracted from the time stamps
    # s, for averaged samples: a value is compared with the mean of the motion at `spread` before and after its time
    spread: float = 0.0

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of the residual."""
        return tuple(AXES[self.name])

    @property
    def offsets(self) -> tuple[float, ...]:
        """Offsets from a sample's time at which the motion is averaged [s]."""
        return (-self.spread, self.spread) if self.spread else (0.0,)


@dataclass(frozen=True)
class Log:
    """Commands and measurements of one run."""

    name: str
    times: Array  # (rows,) s, times of the commands
    thrust: Array  # (rows, thrusters) N, commanded forces
    wrench: Array  # (rows, 6) N, N m, body frame, commanded in addition to the thrusters
    topics: tuple[Topic, ...]
    sampled: bool = False  # True if commands also change between the rows; False if each is held until the next

    def topic(self, name: str) -> Topic | None:
        """Return a topic by its name, or None if the run does not have it."""
        return next((topic for topic in self.topics if topic.name == name), None)


def make_topic(name: str, times: Array, values: Array, noise: float | None = None) -> Topic:
    """Return a topic from samples; estimate its noise from them if it is not given; times (n,) [s], values (n, m)."""
    if name == "attitude":
        values = _continuous(values)
    # twice the vector part of a quaternion, since its noise is that of small angles
    components = values if name != "attitude" else 2.0 * values[:, 1:]
    deviations = _noise_of(components) if noise is None else np.full(components.shape[1], float(noise))
    period, spread = float(np.median(np.diff(times))), 0.0
    block = max(1, round((1.0 / _MAX_RATE) / period))
    if block > 1:
        spread = period * float(np.sqrt((block**2 - 1) / 12.0))  # deviation of a block's times: exact for cubic motion
        count = len(times) // block
        times = times[: count * block].reshape(count, block).mean(axis=1)
        values = values[: count * block].reshape(count, block, -1).mean(axis=1)
        deviations = deviations / np.sqrt(block)
    if name == "attitude":
        values = values / np.linalg.norm(values, axis=1, keepdims=True)
    return Topic(name, times, values, np.maximum(deviations, _MIN_NOISE[name] if noise is None else 0.0), spread=spread)


def _noise_of(values: Array) -> Array:
    """Return the standard deviation of white noise in each column, from its fourth differences."""
    rough = np.abs(np.stack([np.convolve(x, _DIFFERENCE, "valid") for x in values.T], axis=1))
    deviations: Array = _MAD * np.median(rough, axis=0) / np.sqrt(np.square(_DIFFERENCE).sum())
    return deviations


def command_spans(log: Log) -> Array:
    """Return the times between changes of the commands [s]."""
    commands = np.concatenate([log.thrust, log.wrench], axis=1)
    return np.diff(log.times[1:][(np.diff(commands, axis=0) != 0.0).any(axis=1)])


def load_log(folder: Path, vehicle: Vehicle) -> Log:
    """Load commands and measurements of a run."""
    record = load_record(folder)
    thrusters = [f"thrust[{i + 1}]" for i in range(vehicle.n_thrusters)]
    wrench = [f"wrench.{name}" for name in "XYZKMN"]
    if missing := [name for name in (*thrusters, *wrench) if name not in record.units]:
        raise IdentificationError(f"{folder}: has no column {missing[0]!r}, expected the commands of {vehicle.name}")
    if f"thrust[{vehicle.n_thrusters + 1}]" in record.units:
        raise IdentificationError(f"{folder}: has more thrusters than the {vehicle.n_thrusters} of {vehicle.name}")
    time = record["time"]
    commands = record.stack([*thrusters, *wrench])
    known = np.isfinite(commands).all(axis=1)
    if known.sum() < _MIN_SAMPLES or not np.any(commands[known]):
        raise IdentificationError(f"{folder}: the thrusters are never driven, expected commands")
    facts = load_log_facts(folder).topics if (folder / IMPORT).exists() else ()
    topics = tuple(_with_mean(topic, facts) for topic in _topics(record, time))
    names = {topic.name for topic in topics}
    for required in (("attitude",), ("velocity", "position")):
        if not names & {*required}:
            what = " or ".join(required)
            raise IdentificationError(f"{folder}: has no {what} that changes, expected at least {_MIN_SAMPLES} samples")
    n = vehicle.n_thrusters
    _require_steady_actuators(folder, bool(np.any(commands[known, n:])))
    sampled = any(fact.quantity in _SAMPLED for fact in facts)
    if COMMAND_TIME in record.units:
        time = record[COMMAND_TIME]
        known &= np.isfinite(time) & (np.diff(np.maximum.accumulate(np.nan_to_num(time)), prepend=-np.inf) > 0.0)
    return Log(folder.name, time[known], commands[known, :n], commands[known, n:], topics, sampled)


def measured_turns(log: Log, times: Array) -> Array:
    """Return quaternion and angular velocity [rad/s] at times [s], shape (n, 7), as an AHRS has measured them."""
    attitude, rates = log.topic("attitude"), log.topic("angular_velocity")
    if attitude is None:
        raise IdentificationError(f"{log.name}: has no attitude, expected it as an input")
    noise = _noise_of(attitude.values)
    splines = [
        UnivariateSpline(attitude.times, x, s=len(x) * d**2) for x, d in zip(attitude.values.T, noise, strict=True)
    ]
    inside = np.clip(times, attitude.times[0], attitude.times[-1])
    values, slopes = (np.column_stack([f(inside) for f in fs]) for fs in (splines, [f.derivative() for f in splines]))
    length = np.linalg.norm(values, axis=1, keepdims=True)
    quaternions = values / length
    omega = 2.0 * np.einsum("nij,nj->ni", half_turns(quaternions), slopes / length)
    if rates is not None:
        omega = np.column_stack([np.interp(times, rates.times, x) for x in rates.values.T])
    return np.hstack([quaternions, omega])


def half_turns(quaternions: Array) -> Array:
    """Return matrices (..., 3, 4) from r to the vector part of conj(q) r; their rows are q times the unit vectors."""
    # Twice that vector part is the rotation from q to r [rad, body frame], if it is small.
    result: Array = (quaternions @ _HALF_TURNS).reshape(*quaternions.shape[:-1], 3, 4)
    return result


def _with_mean(topic: Topic, facts: Sequence[TopicFacts]) -> Topic:
    """Return a topic with the spread of its values, if these are means over the time since the last sample."""
    if topic.name != "velocity" or not any(f.quantity == "dvl" and f.source in _MEANS for f in facts):
        return topic
    period = float(np.median(np.diff(topic.times)))
    return replace(topic, spread=float(np.hypot(topic.spread, period / np.sqrt(12.0))))


def _require_steady_actuators(folder: Path, has_wrench: bool) -> None:
    """Refuse a run whose scenario has failing thrusters, or limits or lags a commanded wrench."""
    tables = read_toml(folder / SCENARIO) if (folder / SCENARIO).exists() else {}
    if tables.get("failures"):
        raise IdentificationError(f"{folder}: thrusters fail in it ({SCENARIO}: failures), expected runs without")
    limit = tables.get("limit", {})
    if has_wrench and (limit.get("force", np.inf) < np.inf or limit.get("time_constant", 0.0) > 0.0):
        raise IdentificationError(
            f"{folder}: its wrench has a limit or a lag ({SCENARIO}: limit), expected commands of thrusters"
        )


def _topics(record: Record, time: Array) -> Iterator[Topic]:
    has_velocity = False
    for name in TOPICS:
        if name == "position" and has_velocity:
            continue
        for prefix, axes, stamp in _COLUMNS[name]:
            columns = [prefix + axis for axis in axes] or [prefix]
            if not all(column in record.units for column in columns):
                continue
            times, values = _samples(record, time, columns, stamp if stamp in record.units else "")
            if len(times) >= _MIN_SAMPLES:
                has_velocity |= name == "velocity"
                yield make_topic(name, times, values)
                break


def _samples(record: Record, time: Array, columns: Sequence[str], stamp: str) -> tuple[Array, Array]:
    """Return times [s], (n,), and values, (n, m), of the samples, without the rows that repeat the last sample."""
    values, times = record.stack(columns), record[stamp] if stamp else time
    known = np.isfinite(values).all(axis=1) & np.isfinite(times) & (times >= time[0] - 1.0)
    values, times = values[known], times[known]
    is_new = np.diff(times) > 0.0 if stamp else (np.diff(values, axis=0) != 0.0).any(axis=1)
    first = np.ones(min(1, len(times)), bool)
    values, times = (x[np.concatenate([first, is_new])] for x in (values, times))
    is_later = np.concatenate([first, np.diff(np.maximum.accumulate(times)) > 0.0])
    return times[is_later], values[is_later]


def _continuous(quaternions: Array) -> Array:
    """Return unit quaternions, shape (n, 4), with signs that do not jump from one to the next."""
    units = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    signs = np.where(np.sum(units[1:] * units[:-1], axis=1) < 0.0, -1.0, 1.0)
    result: Array = units * np.concatenate([[1.0], np.cumprod(signs)])[:, None]
    return result
