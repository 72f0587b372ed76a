"""The recorded data of a run for identification: commands, and samples of each topic with their noise."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.results.log_facts import COMMAND_TIME, IMPORT, TopicFacts, load_log_facts
from cosim.results.record import Record, load_record
from cosim.results.run_result import SCENARIO
from plant_fmu.toml_tables import read_toml
from plant_fmu.vehicle import Vehicle

Array = NDArray[np.float64]

TOPICS = ("velocity", "angular_velocity", "depth", "attitude", "position")
UNITS = {"velocity": "m/s", "angular_velocity": "rad/s", "depth": "m", "attitude": "rad", "position": "m"}
_AXES = {"velocity": "uvw", "angular_velocity": "pqr", "depth": "z", "attitude": "xyz", "position": "xyz"}
_LEAST_NOISE = {"velocity": 1e-3, "angular_velocity": 1e-3, "depth": 1e-3, "attitude": 1e-2, "position": 5e-3}
_MOST_SAMPLES = 50.0  # Hz; faster topics are averaged over blocks
_FEWEST = 20  # samples of a topic
_DIFFERENCE = np.array([1.0, -4.0, 6.0, -4.0, 1.0])  # whose variance on white noise is 70 times that of the noise
_MAD = 1.4826  # standard deviation of a normal distribution, in median absolute deviations

_SAMPLED = ("pulses", "effort")  # commands that an autopilot logs slower than it changes them

_MEANS = ("VISO", "VISION_POSITION_DELTA")  # DVL messages that have how far it went since the last one

# of each topic the columns that may hold it, the first that do are taken; and where the times of their samples stand
_COLUMNS: dict[str, tuple[tuple[tuple[str, ...], str], ...]] = {
    "velocity": (
        (tuple(f"measured.velocity.{name}" for name in "uvw"), "measured.time.dvl"),
        (tuple(f"sensed.{name}" for name in "uvw"), ""),
        (tuple(f"velocity.{name}" for name in "uvw"), ""),
    ),
    "angular_velocity": (
        (tuple(f"measured.angular_velocity.{name}" for name in "pqr"), "measured.time.imu"),
        (tuple(f"velocity.{name}" for name in "pqr"), ""),
    ),
    "depth": ((("measured.depth",), "measured.time.depth_sensor"), (("position.z",), "")),
    "attitude": (
        (tuple(f"sensed.e{i}" for i in range(4)), ""),
        (tuple(f"quaternion.e{i}" for i in range(4)), ""),
    ),
    "position": (
        (tuple(f"measured.position.{axis}" for axis in "xyz"), "measured.time.usbl"),
        (tuple(f"sensed.{axis}" for axis in "xyz"), ""),
        (tuple(f"position.{axis}" for axis in "xyz"), ""),
    ),
}


@dataclass(frozen=True)
class Topic:
    """The samples of one sensor."""

    name: str  # of TOPICS
    times: Array  # (n,) s, rising
    values: Array  # (n, m): m/s, rad/s, m, or a quaternion
    noise: Array  # (c,) standard deviation of each component of the residual
    shift: float = 0.0  # s, by which the stamps are moved back
    spread: float = 0.0  # s, before and after each time: a value is the mean of two there, which averages of many equal

    @property
    def components(self) -> tuple[str, ...]:
        """Names of the components of its residual."""
        return tuple(_AXES[self.name])

    @property
    def offsets(self) -> tuple[float, ...]:
        """Times about that of a sample whose mean it is [s]."""
        return (-self.spread, self.spread) if self.spread else (0.0,)


@dataclass(frozen=True)
class Log:
    """One run."""

    name: str
    times: Array  # (rows,) s, of the commands
    thrust: Array  # (rows, thrusters) N, commanded
    wrench: Array  # (rows, 6) N, N m, commanded beside the thrusters
    topics: tuple[Topic, ...]
    sampled: bool = False  # commands are samples, between which they change; else each is held until the next

    def topic(self, name: str) -> Topic | None:
        """Return a topic by its name, None where the run has none."""
        return next((topic for topic in self.topics if topic.name == name), None)


def make_topic(name: str, times: Array, values: Array, noise: float | None = None) -> Topic:
    """Return a topic whose noise, where it is not known, is estimated from its samples.

    Parameters
    ----------
    name : str
        Of `TOPICS`.
    times : ndarray, shape (n,)
        [s], rising.
    values : ndarray, shape (n, m)
        Without gaps.
    noise : float, optional
        Standard deviation of each component; default: that of fourth differences, by their median, and at the least
        1 mm/s, 1 mrad/s, 1 mm, of positions 5 mm, and of attitudes, which filters smooth, 10 mrad.

    Returns
    -------
    Topic
        The topic, averaged over blocks to 50 Hz at the most.
    """
    if name == "attitude":
        values = _continuous(values)
    components = values if name != "attitude" else _rotation_vectors(values)
    if noise is None:
        rough = np.abs(np.stack([np.convolve(x, _DIFFERENCE, "valid") for x in components.T], axis=1))
        deviations = _MAD * np.median(rough, axis=0) / np.sqrt(np.square(_DIFFERENCE).sum())
    else:
        deviations = np.full(components.shape[1], float(noise))
    period, spread = float(np.median(np.diff(times))), 0.0
    block = max(1, round((1.0 / _MOST_SAMPLES) / period))
    if block > 1:
        spread = period * float(np.sqrt((block**2 - 1) / 12.0))  # their standard deviation: exact for cubic motion
        count = len(times) // block
        times = times[: count * block].reshape(count, block).mean(axis=1)
        values = values[: count * block].reshape(count, block, -1).mean(axis=1)
        deviations = deviations / np.sqrt(block)
    if name == "attitude":
        values = values / np.linalg.norm(values, axis=1, keepdims=True)
    least = _LEAST_NOISE[name] if noise is None else 0.0
    return Topic(name, times, values, np.maximum(deviations, least), spread=spread)


def command_period(log: Log) -> float:
    """Return the time between changes of the commands that one in twenty falls short of [s]; 0 without changes."""
    commands = np.concatenate([log.thrust, log.wrench], axis=1)
    spans = np.diff(log.times[1:][(np.diff(commands, axis=0) != 0.0).any(axis=1)])
    return float(np.quantile(spans, 0.05)) if len(spans) else 0.0


def load_log(folder: Path, vehicle: Vehicle) -> Log:
    """Read what a run recorded.

    Parameters
    ----------
    folder : Path
        The run folder.
    vehicle : Vehicle
        Which of its columns are the thrusters' commands follows from the number of thrusters.

    Returns
    -------
    Log
        Topics that the run does not have are left out; positions are taken where there are no velocities.

    Raises
    ------
    RunError
        If it cannot be read.
    TableError
        If its scenario cannot be read.
    IdentificationError
        If it has no commands, no attitude, or neither velocities nor positions; if its scenario has failures of
        thrusters, or a limit or lag of the wrench that it commands.
    """
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
    if known.sum() < _FEWEST or not np.any(commands[known]):
        raise IdentificationError(f"{folder}: the thrusters rest, expected commands")
    facts = load_log_facts(folder).topics if (folder / IMPORT).exists() else ()
    topics = tuple(_with_mean(topic, facts) for topic in _topics(record, time))
    names = {topic.name for topic in topics}
    for needed, said in (({"attitude"}, "attitude"), ({"velocity", "position"}, "velocity or position")):
        if not names & needed:
            raise IdentificationError(f"{folder}: has no {said} that changes, expected {_FEWEST} samples at the least")
    n = vehicle.n_thrusters
    _require_steady_actuators(folder, bool(np.any(commands[known, n:])))
    sampled = any(fact.quantity in _SAMPLED for fact in facts)
    if COMMAND_TIME in record.units:
        time = record[COMMAND_TIME]
        known &= np.isfinite(time) & (np.diff(np.maximum.accumulate(np.nan_to_num(time)), prepend=-np.inf) > 0.0)
    return Log(folder.name, time[known], commands[known, :n], commands[known, n:], topics, sampled)


def _with_mean(topic: Topic, facts: Sequence[TopicFacts]) -> Topic:
    """Return a topic that knows of its values whether each is the mean of the time since the last."""
    if topic.name != "velocity" or not any(f.quantity == "dvl" and f.source in _MEANS for f in facts):
        return topic
    period = float(np.median(np.diff(topic.times)))
    return replace(topic, spread=float(np.hypot(topic.spread, period / np.sqrt(12.0))))


def _require_steady_actuators(folder: Path, has_wrench: bool) -> None:
    """Refuse a run of which the scenario says that commands do not come to what the prediction takes them for."""
    file = folder / SCENARIO
    if not file.exists():
        return
    tables = read_toml(file)
    if tables.get("failures"):
        raise IdentificationError(f"{folder}: thrusters fail in it ({SCENARIO}: failures), expected runs without")
    limit = tables.get("limit", {})
    if has_wrench and (limit.get("force", np.inf) < np.inf or limit.get("time_constant", 0.0) > 0.0):
        raise IdentificationError(
            f"{folder}: its wrench has a limit or a lag ({SCENARIO}: limit), expected commands of thrusters"
        )


def _topics(record: Record, time: Array) -> Iterator[Topic]:
    found = set()
    for name in TOPICS:
        if name == "position" and "velocity" in found:
            continue
        for columns, stamp in _COLUMNS[name]:
            if not all(column in record.units for column in columns):
                continue
            times, values = _samples(record, time, columns, stamp if stamp in record.units else "")
            if len(times) >= _FEWEST:
                found.add(name)
                yield make_topic(name, times, values)
                break


def _samples(record: Record, time: Array, columns: Sequence[str], stamp: str) -> tuple[Array, Array]:
    """Return the samples alone, without the rows that hold the last one, with their times."""
    values, times = record.stack(columns), record[stamp] if stamp else time
    known = np.isfinite(values).all(axis=1) & np.isfinite(times) & (times >= time[0] - 1.0)
    values, times = values[known], times[known]
    if not len(times):
        return times, values
    fresh = np.diff(times) > 0.0 if stamp else (np.diff(values, axis=0) != 0.0).any(axis=1)
    keep = np.concatenate([[True], fresh])
    values, times = values[keep], times[keep]
    rising = np.concatenate([[True], np.diff(np.maximum.accumulate(times)) > 0.0])
    return times[rising], values[rising]


def _continuous(quaternions: Array) -> Array:
    """Return unit quaternions without the jumps of their sign."""
    units = quaternions / np.linalg.norm(quaternions, axis=1, keepdims=True)
    signs = np.where(np.sum(units[1:] * units[:-1], axis=1) < 0.0, -1.0, 1.0)
    result: Array = units * np.concatenate([[1.0], np.cumprod(signs)])[:, None]
    return result


def _rotation_vectors(quaternions: Array) -> Array:
    """Return, of each sample, twice the vector part: as rough as the angles of a small rotation."""
    result: Array = 2.0 * quaternions[:, 1:]
    return result
