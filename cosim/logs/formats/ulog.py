"""ULog files of PX4."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.logs.column_map import ColumnMap
from cosim.logs.format import LogFormat, Moved
from cosim.logs.spool import LogContents
from cosim.logs.ulog_messages import ULogMessages
from cosim.logs.vehicle_messages import kind_of

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
_DOWNWARDS = 25  # orientation of a distance sensor: MAV_SENSOR_ROTATION_PITCH_270


def read(path: Path, columns: ColumnMap | None, contents: LogContents, moved: Moved) -> None:
    """Read a log of PX4, as specified by `LogFormat`; raise ImportLogError for another file."""
    log = ULogMessages(path, frozenset(_TOPICS))
    used: dict[tuple[str, str], list[str]] = {}
    names = set()
    for name, samples in log.blocks(moved):
        names.add(name.split("[")[0])
        _take(samples, contents, name, used)
    contents.autopilot = "px4"
    contents.parameters |= log.parameters
    contents.kind = kind_of(int(contents.parameters.get("MAV_TYPE", 0)))
    for name in log.formats - names - set(_TOPICS):
        contents.unread[name] += 1
    if log.dropouts:
        contents.remarks.append(
            f"The log says that it lost data {len(log.dropouts)} times, {sum(log.dropouts):.3g} s in all."
        )
    if log.is_damaged:
        contents.remarks.append("The file is damaged; what could be read of it is here.")
    contents.preferences |= {"rates": ("vehicle_angular_velocity[0]", "vehicle_attitude[0]")}


def _take(samples: NDArray[Any], contents: LogContents, name: str, used: dict[tuple[str, str], list[str]]) -> None:
    """Add samples of a topic to the contents; of outputs, only those with a number in the first block that has any."""
    fields = set(samples.dtype.names or ())
    if "timestamp" not in fields:
        return
    if "orientation" in fields and name.startswith("distance_sensor"):
        samples = samples[samples["orientation"] == _DOWNWARDS]
    times = samples["timestamp"] * 1e-6
    for quantity, columns in _TOPICS[name.split("[")[0]]:
        here = [column for column in columns if column in fields]
        if quantity in ("pulses", "effort"):
            here = used.get((name, quantity)) or [c for c in here if np.isfinite(samples[c].astype(float)).any()]
            used[name, quantity] = here
        elif len(here) < len(columns):
            continue
        if here and len(samples):
            values = np.column_stack([samples[column].astype(float) for column in here])
            contents.source(quantity, name, len(here)).put_many(times, values)


FORMAT = LogFormat((".ulg",), read)
