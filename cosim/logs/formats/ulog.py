"""ULog files of PX4, by pyulog."""

from __future__ import annotations

import contextlib
import io
import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ImportLogError
from cosim.logs.column_map import ColumnMap
from cosim.logs.format import LogFormat, Moved
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import kind_of
from cosim.simulation.signals import Array

# topic: quantities and their fields, in SI units, NED and FRD
_TOPICS: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "vehicle_attitude": (
        ("attitude", ("q[0]", "q[1]", "q[2]", "q[3]")),
        ("rates", ("rollspeed", "pitchspeed", "yawspeed")),
    ),
    "vehicle_angular_velocity": (("rates", ("xyz[0]", "xyz[1]", "xyz[2]")),),
    "vehicle_local_position": (("position", ("x", "y", "z")), ("velocity_world", ("vx", "vy", "vz"))),
    "sensor_combined": (
        ("gyro", ("gyro_rad[0]", "gyro_rad[1]", "gyro_rad[2]")),
        ("acceleration", ("accelerometer_m_s2[0]", "accelerometer_m_s2[1]", "accelerometer_m_s2[2]")),
    ),
    "actuator_outputs": (("pulses", tuple(f"output[{i}]" for i in range(16))),),
    "actuator_motors": (("effort", tuple(f"control[{i}]" for i in range(12))),),
    "battery_status": (("voltage", ("voltage_v",)),),
    "distance_sensor": (("altitude", ("current_distance",)),),
}
_DOWNWARDS = 25
_FAILURES = (TypeError, ValueError, KeyError, IndexError, struct.error, UnicodeDecodeError, OverflowError, EOFError)


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a log of PX4, as specified by `LogFormat`; raise ImportLogError for another file."""
    from pyulog import ULog
    from pyulog.core import ULogException

    try:
        with path.open("rb") as file, contextlib.redirect_stdout(io.StringIO()):  # it prints what is damaged
            log = ULog(file, list(_TOPICS), True)
    except (ULogException, *_FAILURES) as error:
        raise ImportLogError(f"cannot be read as a ULog file: {error}") from error
    contents.autopilot = "px4"
    contents.parameters |= {name: float(value) for name, value in log.initial_parameters.items()}
    contents.kind = kind_of(int(contents.parameters.get("MAV_TYPE", 0)))
    names = {f"{data.name}[{data.multi_id}]" for data in log.data_list}
    with np.errstate(invalid="ignore"):  # by signalling NaN of damaged samples
        for data in log.data_list:
            _take(data, contents, f"{data.name}[{data.multi_id}]")
            moved(1.0)
    for name in log.message_formats:
        if name not in _TOPICS and not any(known.startswith(f"{name}[") for known in names):
            contents.unread[name] += 1
    if log.dropouts:
        lost = sum(dropout.duration for dropout in log.dropouts) * 1e-3
        contents.remarks.append(f"The log says that it lost data {len(log.dropouts)} times, {lost:.3g} s in all.")
    if log.file_corruption:
        contents.remarks.append("The file is damaged; what could be read of it is here.")
    contents.preferences |= {"rates": ("vehicle_angular_velocity[0]", "vehicle_attitude[0]")}


def _take(data: Any, contents: LogContents, name: str) -> None:
    """Add the samples of a topic to the contents."""
    fields: dict[str, Array] = data.data
    times = np.asarray(fields["timestamp"], float) * 1e-6
    valid: NDArray[np.bool_] = np.ones(len(times), bool)
    if data.name == "distance_sensor" and "orientation" in fields:
        valid &= fields["orientation"] == _DOWNWARDS
    for quantity, columns in _TOPICS[data.name]:
        here = [column for column in columns if column in fields]
        if quantity in ("pulses", "effort"):
            values = np.column_stack([np.asarray(fields[c], float) for c in here]) if here else np.empty((0, 0))
            used = np.asarray(np.isfinite(values).any(axis=0)).tolist()
            here = [column for column, is_used in zip(here, used, strict=True) if is_used]
        elif len(here) < len(columns):
            continue
        if not here or not valid.any():
            continue
        values = np.column_stack([np.asarray(fields[column], float) for column in here])[valid]
        source = contents.source(quantity, name, len(here))
        source.put_many(times[valid], values)


FORMAT = LogFormat((".ulg",), read, needs=("pyulog>=1.0",))
