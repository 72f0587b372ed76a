"""ULog files of PX4."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.logs.column_map import ColumnMap
from cosim.logs.formats.ulog_messages import ULogMessages
from cosim.logs.records import OnProgress
from cosim.logs.spool import LogContents
from cosim.logs.vehicle_messages import DOWNWARD, vehicle_kind


def _elements(name: str, count: int) -> tuple[str, ...]:
    return tuple(f"{name}[{i}]" for i in range(count))


# topic: quantities and their fields, in SI units, NED and FRD
_TOPICS: dict[str, tuple[tuple[str, tuple[str, ...]], ...]] = {
    "vehicle_attitude": (("attitude", _elements("q", 4)), ("rates", ("rollspeed", "pitchspeed", "yawspeed"))),
    "vehicle_angular_velocity": (("rates", _elements("xyz", 3)),),
    "vehicle_local_position": (("position", ("x", "y", "z")), ("velocity_world", ("vx", "vy", "vz"))),
    "sensor_combined": (("gyro", _elements("gyro_rad", 3)), ("acceleration", _elements("accelerometer_m_s2", 3))),
    "actuator_outputs": (("pulses", _elements("output", 16)),),
    "actuator_motors": (("effort", _elements("control", 12)),),
    "battery_status": (("voltage", ("voltage_v",)),),
    "distance_sensor": (("altitude", ("current_distance",)),),
}


def read(path: Path, columns: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a log of PX4, as specified by `LogFormat`; raise ImportLogError for another file."""
    log = ULogMessages(path, frozenset(_TOPICS), on_progress)
    outputs: dict[tuple[str, str], list[str]] = {}
    names = set()
    for name, samples in log.blocks():
        names.add(name.split("[")[0])
        _put_samples(samples, contents, name, outputs)
    contents.autopilot = "px4"
    for key, value in log.parameters.items():
        contents.put_parameter(key, value)
    contents.kind = vehicle_kind(int(contents.parameters.get("MAV_TYPE", 0)))
    contents.unread.update(dict.fromkeys(log.formats - names - set(_TOPICS), 1))
    if log.dropouts:
        contents.remarks.append(
            f"The logger lost data {len(log.dropouts)} times, {sum(log.dropouts):.3g} s in total, by its own count."
        )
    contents.remarks += log.remarks(path.name)
    contents.preferences |= {"rates": ("vehicle_angular_velocity[0]", "vehicle_attitude[0]")}


def _put_samples(
    samples: NDArray[Any], contents: LogContents, name: str, outputs: dict[tuple[str, str], list[str]]
) -> None:
    """Add samples of a topic; of outputs, only those with a number in the first block that has any."""
    fields = set(samples.dtype.names or ())
    if "timestamp" not in fields:
        return
    if "orientation" in fields and name.startswith("distance_sensor"):
        samples = samples[samples["orientation"] == DOWNWARD]
    times = samples["timestamp"] * 1e-6
    for quantity, columns in _TOPICS[name.split("[")[0]]:
        present = [column for column in columns if column in fields]
        if quantity in ("pulses", "effort"):
            present = outputs.get((name, quantity)) or [
                c for c in present if np.isfinite(samples[c].astype(float)).any()
            ]
            outputs[name, quantity] = present
        elif len(present) < len(columns):
            continue
        if present and len(samples):
            values = np.column_stack([samples[column].astype(float) for column in present])
            contents.source(quantity, name, len(present)).put_many(times, values)
