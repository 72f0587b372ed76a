"""Convert the topics of a log to rows of a record, block by block."""

from __future__ import annotations

import contextlib
import functools
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cosim.logs.cleaning.topics import Topic
from cosim.logs.forces import CommandForces
from cosim.logs.frames import euler_zyx, rotate_to_body
from cosim.logs.resampling import TopicReader
from cosim.results.log_facts import ATTITUDE, ATTITUDE_TIME, COMMAND_TIME
from cosim.scenario.scenario import Scenario
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.signals import Array, Column

Put = Callable[[Sequence[str], Array], None]
Readers = Mapping[str, TopicReader]

BLOCK = 4096  # rows that are made at once
_SPAN = 60.0  # s, maximum duration of these rows: at a low rate, the samples between rows are in memory too
_POSITION, _QUATERNION = [f"position.{a}" for a in "xyz"], [f"quaternion.e{i}" for i in range(4)]
_WRENCH = "XYZKMN"
_SAMPLES = {  # quantity: columns of its samples, time column, and quantities in whose absence these are of it
    "velocity": (tuple(f"measured.velocity.{a}" for a in "uvw"), "measured.time.dvl", ("dvl", "altitude")),
    "rates": (tuple(f"measured.angular_velocity.{a}" for a in "pqr"), "measured.time.imu", ("gyro", "acceleration")),
    "position": (tuple(f"measured.position.{a}" for a in "xyz"), "measured.time.usbl", ("fix",)),
    "attitude": (ATTITUDE, ATTITUDE_TIME, ()),
}
_SENSORS = {  # quantity: columns, and name of the sensor's time column
    "depth": (("measured.depth",), "depth_sensor"),
    "dvl": (tuple(f"measured.velocity.{a}" for a in "uvw"), "dvl"),
    "altitude": (("measured.altitude",), "dvl"),
    "acceleration": (tuple(f"measured.acceleration.{a}" for a in "xyz"), "imu"),
    "gyro": (tuple(f"measured.angular_velocity.{a}" for a in "pqr"), "imu"),
    "heading": (("measured.heading",), "compass"),
    "fix": (tuple(f"measured.position.{a}" for a in "xyz"), "usbl"),
}


@dataclass(frozen=True)
class RowMaker:
    """Make the rows of a record from topics."""

    scenario: Scenario
    columns: list[Column]
    topics: Mapping[str, Topic]
    commands: CommandForces | None
    voltage: float  # V
    start: float  # s

    def blocks(self) -> Generator[Array]:
        """Yield the rows of the whole run in order, each block of shape (n, columns)."""
        index = {column.name: i for i, column in enumerate(self.columns)}
        step, rows = self.scenario.time.step, self.scenario.steps + 1
        count = max(1, min(BLOCK, int(_SPAN / step)))
        has_regions = self.scenario.has_goal or self.scenario.regions
        region_columns = _RegionColumns(self.scenario, index) if has_regions else None
        with contextlib.ExitStack() as stack:
            readers = {n: stack.enter_context(contextlib.closing(TopicReader(t))) for n, t in self.topics.items()}
            for first in range(0, rows, count):
                time = np.arange(first, min(first + count, rows)) * np.float64(step)
                block = np.full((len(time), len(index)), np.nan)
                self._fill(functools.partial(_put, block, index), readers, time)
                if region_columns is not None:
                    region_columns.put(block)
                yield block

    def _fill(self, put: Put, readers: Readers, time: Array) -> None:
        put(["time"], time[:, None])
        log_time = time + self.start
        self._put_motion(put, readers, log_time)
        for quantity, (names, sensor) in _SENSORS.items():
            if quantity in readers:
                values, when = readers[quantity].hold(log_time)
                put(names, values)
                put([f"measured.time.{sensor}"], (when - self.start)[:, None])
                if quantity == "altitude":
                    put(["altitude"], values)
        for quantity, (names, stamp, others) in _SAMPLES.items():
            if quantity in readers and not any(other in readers for other in others):
                values, when = readers[quantity].hold(log_time)
                put(names, values)
                put([stamp], (when - self.start)[:, None])
        if self.commands is not None:
            self._put_commands(put, readers, log_time, self.commands)

    @staticmethod
    def _put_motion(put: Put, readers: Readers, times: Array) -> None:
        if "position" in readers:
            put(_POSITION, readers["position"].interpolate(times))
        elif "depth" in readers:
            put(["position.z"], readers["depth"].interpolate(times))
        quaternions = readers["attitude"].interpolate(times) if "attitude" in readers else None
        if quaternions is not None:
            put(_QUATERNION, quaternions)
            put([f"attitude.{name}" for name in ("roll", "pitch", "yaw")], euler_zyx(quaternions))
        if "velocity" in readers:
            put([f"velocity.{a}" for a in "uvw"], readers["velocity"].interpolate(times))
        elif "velocity_world" in readers and quaternions is not None:
            over_ground = readers["velocity_world"].interpolate(times)
            put([f"velocity.{a}" for a in "uvw"], rotate_to_body(quaternions, over_ground))
        rates = readers.get("rates") or readers.get("gyro")
        if rates is not None:
            put([f"velocity.{a}" for a in "pqr"], rates.interpolate(times))

    def _put_commands(self, put: Put, readers: Readers, times: Array, commands: CommandForces) -> None:
        values, when = readers[commands.quantity].hold(times)
        put([COMMAND_TIME], (when - self.start)[:, None])
        volts = np.full(len(times), self.voltage)
        if "voltage" in readers and not np.isfinite(self.voltage):
            volts = readers["voltage"].hold(times)[0][:, 0]
        forces = commands.forces(values, volts)
        vehicle = self.scenario.vehicle
        if commands.through == "wrench":
            put([f"wrench.{a}" for a in _WRENCH], forces)
            put([f"thrust[{i + 1}]" for i in range(vehicle.n_thrusters)], np.zeros((len(times), vehicle.n_thrusters)))
            for kind in ("command", "actuation"):
                put([f"{kind}.{a}" for a in _WRENCH], forces)
            return
        acting = np.clip(forces, vehicle.thrust_min, vehicle.thrust_max)
        names = [str(i + 1) for i in range(vehicle.n_thrusters)]
        put([f"thrust[{i}]" for i in names], forces)
        put([f"thruster_force[{i}]" for i in names], acting)
        put([f"wrench.{a}" for a in _WRENCH], np.zeros((len(times), 6)))
        put([f"command.{a}" for a in _WRENCH], forces @ vehicle.thruster_matrix.T)
        put([f"actuation.{a}" for a in _WRENCH], acting @ vehicle.thruster_matrix.T)
        saturated = np.where(np.isnan(forces), np.nan, acting != forces)
        put([f"thrust_saturated[{i}]" for i in names], saturated)
        put(["allocation_saturated"], saturated.max(axis=1, keepdims=True, initial=0.0))


def _put(rows: Array, index: Mapping[str, int], names: Sequence[str], values: Array) -> None:
    rows[:, [index[name] for name in names]] = values


class _RegionColumns:
    """Evaluate the goal and the regions of a scenario at the poses of rows."""

    def __init__(self, scenario: Scenario, columns: Mapping[str, int]) -> None:
        names = [*(["goal"] if scenario.has_goal else []), *(s.region.name for s in scenario.regions)]
        self._first = 0 if scenario.has_goal else 1
        self._values = [columns[f"{name}.value"] for name in names]
        self._clearances = [columns[f"{name}.clearance"] for name in names]
        self._shifts = [columns[f"{name}.shift.{a}"] for name in scenario.moving for a in "xyz"]
        self._position, self._quaternion = [columns[n] for n in _POSITION], [columns[n] for n in _QUATERNION]
        self._environment = RegionEnvironment(scenario)
        self._shift: Array = np.zeros((len(scenario.moving), 3))
        self._time = columns["time"]

    def put(self, rows: Array) -> None:
        """Write values, clearances and shifts into rows; NaN where the pose is unknown."""
        known = np.asarray(np.isfinite(rows[:, [*self._position, *self._quaternion]]).all(axis=1))
        for k, row in enumerate(rows):
            self._environment.update_positions(float(row[self._time]), self._shift)
            row[self._shifts] = self._shift.ravel()
            if known[k]:
                values, clearances = self._environment.evaluate(row[self._position], row[self._quaternion])
                row[self._values], row[self._clearances] = values[self._first :], clearances[self._first :]
