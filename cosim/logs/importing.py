"""Import of a vehicle's log as a run folder, which report, replay and export accept like any other."""

from __future__ import annotations

import contextlib
import dataclasses
import functools
import itertools
import math
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from cosim.errors import ImportLogError, RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text
from cosim.logs.assignment import assign_quantities, format_of
from cosim.logs.cleaning.alignment import clock_offset
from cosim.logs.cleaning.clocks import VehicleClock
from cosim.logs.cleaning.topics import Topic
from cosim.logs.column_map import ColumnMap
from cosim.logs.forces import CURVES, CommandForces, command_forces
from cosim.logs.quantities import COMMANDS
from cosim.logs.records import OnProgress
from cosim.logs.rows import RowMaker
from cosim.logs.selection import default_rate, has_plausible_rate, select_topics, time_span
from cosim.logs.spool import LogContents
from cosim.results.log_facts import ATTITUDE, ATTITUDE_TIME, COMMAND_TIME, IMPORT, LogFacts, TopicFacts
from cosim.results.record import MAX_ROWS
from cosim.results.recorder import Recorder
from cosim.results.run_result import Run
from cosim.results.wording import IMPORTED
from cosim.run.run_folder import claim, conclude
from cosim.scenario.scenario import Scenario, load_scenario, validate_scenario
from cosim.simulation.columns import columns_without_plant
from cosim.simulation.signals import Array, Column
from plant_fmu import Vehicle, load_vehicle
from plant_fmu.archive import temporary_folder
from plant_fmu.errors import printable
from plant_fmu.installing import install_hint

# keys of a scenario that apply to a log
_SCENARIO_KEYS = ("goal", "regions", "criteria", "arbiter", "intersection", "title")
_MIN_ROWS, _ROWS_PER_SAMPLE = 500_000, 200  # rows that a log may have: some, and for each of its samples
_MAX_GAPS = 12  # gaps of a topic in a report


def import_log(
    log: str | Path | Sequence[str | Path],
    vehicle: str | Path,
    out: str | Path | None = None,
    *,
    scenario: str | Path | None = None,
    columns: str | Path | None = None,
    rate: float | None = None,
    curve: str | None = None,
    voltage: float | None = None,
    report: bool = True,
    overwrite: bool = False,
    on_progress: OnProgress | None = None,
    moved: OnProgress | None = None,
) -> Run:
    r"""Read a log of a vehicle and write it as a run folder.

    Parameters
    ----------
    log : str, Path or sequence of these
        Path of a log: ``.bin``, ``.tlog``, ``.ulg``, ``.csv``, ``.parquet``, or a bag: ``.mcap``, ``.db3``, ``.bag``,
        or its folder. Several logs of one run are joined on the clock of the first.
    vehicle : str or Path
        Name of a shipped vehicle or path of a TOML file, with the thrusters that the commands drive.
    out : str or Path, optional
        The run folder; it must not exist, or be empty. Default: a new one below ``runs``.
    scenario : str or Path, optional
        Scenario whose goal and regions are evaluated along the log. Default: none.
    columns : str or Path, optional
        The column map that tables and bags of ROS need.
    rate : float, optional
        Rows per second [Hz]. Default: the lowest of 5, 10, 20, 25, 50, 100 and 200 that no state or command exceeds.
    curve : str, optional
        Curve from pulse to force: ``linear``, ``quadratic`` or ``t200``. Default: that of the vehicle's table
        ``autopilot``.
    voltage : float, optional
        Supply voltage of the thrusters [V], instead of the log's.
    report : bool
        True to write report and replay.
    overwrite : bool
        True to replace a run in `out`.
    on_progress : callable, optional
        Receives the fraction of the log read so far, 0 to 1.
    moved : callable, optional
        Former name of `on_progress`.

    Returns
    -------
    Run
        The run, with status ``"imported"``.

    Raises
    ------
    ImportLogError
        If the log cannot be read, is of another vehicle, or lacks required data. No folder is left.
    RunError
        If the folder cannot be written.
    ScenarioError, VehicleError
        If scenario or vehicle is invalid.

    Examples
    --------
    >>> import math, pathlib, cosim
    >>> rows = [f"{0.1 * k},{0.02 * k},{math.sin(0.1 * k)},0,0" for k in range(50)]
    >>> _ = pathlib.Path("dive.csv").write_text("\n".join(["t,depth,yaw,pitch,roll", *rows]))
    >>> _ = pathlib.Path("dive.toml").write_text(
    ...     'time = { column = "t" }\n[depth]\ncolumns = ["depth"]\n'
    ...     '[attitude]\ncolumns = ["yaw", "pitch", "roll"]\neuler = "ZYX"\n'
    ... )
    >>> run = cosim.import_log("dive.csv", "bluerov2_heavy", "dive", columns="dive.toml", report=False)
    >>> run.summary["status"], len(run.record)
    ('imported', 50)
    """
    paths = [Path(x) for x in ([log] if isinstance(log, str | Path) else log)]
    report_progress = _progress_callback(on_progress, moved)
    path = paths[0] if paths else Path()
    try:
        if not paths:
            raise ImportLogError("no log is given, expected at least one")
        loaded = load_vehicle(Path(vehicle) if str(vehicle).endswith(".toml") else str(vehicle))
        if curve is not None and curve not in CURVES:
            raise ImportLogError(f"curve is {curve!r}, expected one of {', '.join(CURVES)}")
        logs = assign_quantities(paths, None if columns is None else Path(columns))
        # a log may hold any numbers, also such that overflow
        with temporary_folder("cosim-import-") as scratch, np.errstate(all="ignore"):
            parts = []
            for k, (path, own_map) in enumerate(logs):
                (scratch / str(k)).mkdir()
                parts.append(LogContents(scratch / str(k)))
                _read(path, own_map, parts[k], functools.partial(_report_part, report_progress, k, len(logs)))
                if k:
                    offset, method = clock_offset(parts[0], parts[k])
                    parts[0].remarks.append(f"Clocks of {logs[0][0].name} and {path.name} are joined {method}.")
                    parts[0].join(parts[k], offset)
            path = logs[0][0]
            _require_vehicle(parts[0], loaded)
            folder = None if out is None else Path(out)
            options = _Options(str(vehicle), scenario, folder, rate, curve, voltage, report, overwrite)
            return _write([path for path, _ in logs], parts[0], scratch, loaded, options)
    except ImportLogError as error:
        named = ImportLogError(f"{path}: {error}")
        named.draft = error.draft
        raise named from error
    except OSError as error:
        raise ImportLogError(f"{path}: {error.strerror or error}") from error


def _report_part(report_progress: OnProgress, done: int, count: int, part: float) -> None:
    report_progress((done + part) / count)


def _read(path: Path, column_map: ColumnMap | None, contents: LogContents, on_progress: OnProgress) -> None:
    """Read a log into its contents; name the packages that it needs."""
    form = format_of(path)
    try:
        form.read(path, column_map, contents, on_progress)
    except ModuleNotFoundError as error:
        if not form.needs or (error.name or "").startswith("cosim"):
            raise
        raise ImportLogError(f"needs {error.name}; {install_hint(*form.needs)}") from error


def _progress_callback(on_progress: OnProgress | None, moved: OnProgress | None) -> OnProgress:
    if moved is not None:
        if on_progress is not None:
            raise ImportLogError("moved is the former name of on_progress, expected one of them")
        warnings.warn("moved is now on_progress", DeprecationWarning, stacklevel=3)
    return on_progress or moved or (lambda fraction: None)


def _require_vehicle(contents: LogContents, vehicle: Vehicle) -> None:
    """Refuse the log of another kind of vehicle."""
    if contents.kind:
        raise ImportLogError(f"is of a {printable(contents.kind)}, expected the log of an underwater vehicle")
    frame = contents.frame.lower()
    table = vehicle.autopilot
    if frame and table is not None and frame != table.frame.lower():
        raise ImportLogError(
            f"the autopilot's frame is {printable(contents.frame)}, expected {table.frame} as vehicle "
            f"{vehicle.name!r} has: another vehicle flew this log"
        )


@dataclass(frozen=True)
class _Options:
    """Arguments of `import_log`."""

    vehicle: str
    scenario: str | Path | None
    out: Path | None
    rate: float | None
    curve: str | None
    voltage: float | None
    report: bool
    overwrite: bool


def _write(paths: Sequence[Path], contents: LogContents, scratch: Path, vehicle: Vehicle, options: _Options) -> Run:
    """Write the contents of a log as a run folder."""
    path = paths[0]
    topics, clock = select_topics(contents, scratch)
    command = next((topics[name] for name in COMMANDS if name in topics), None)
    for name in COMMANDS:
        if name in topics and topics[name] is not command:
            contents.unread[f"{topics[name].name} ({name})"] += topics.pop(name).count
    start, end = time_span(topics)
    supply = f"the voltage of {topics['voltage'].name}" if "voltage" in topics else ""
    supply = f"{options.voltage:g} V" if options.voltage else supply
    commands = command_forces(command, vehicle, options.curve, supply, contents.parameters) if command else None
    hertz = options.rate or default_rate(topics)
    steps = max(1, math.floor((end - start) * hertz + 1e-6))
    samples = sum(topic.count for topic in topics.values())
    limit = min(MAX_ROWS - 1, max(_MIN_ROWS, _ROWS_PER_SAMPLE * samples))
    if steps > limit:
        raise ImportLogError(
            f"lasts {end - start:.4g} s with {samples} samples: {steps} rows at {hertz:g} Hz, expected at most {limit}"
        )
    through = commands.through if commands else "thrusters" if vehicle.n_thrusters else "wrench"
    draft = _scenario(path, vehicle, options, through, steps, 1.0 / hertz)
    volts = math.nan if options.voltage is None else options.voltage
    columns = columns_without_plant(draft)
    if commands:
        columns.append(Column(COMMAND_TIME, "s", "When the commands were sampled"))
    if "attitude" in topics:
        columns += [Column(name, "", "Last sample of the attitude, from body to world") for name in ATTITUDE]
        columns.append(Column(ATTITUDE_TIME, "s", "When the attitude was sampled"))
    maker = RowMaker(draft, columns, topics, commands, volts, start)
    with contextlib.closing(maker.blocks()) as blocks:
        first = next(blocks)
    scenario = _with_first_pose(draft, first, [column.name for column in columns], contents.autopilot or "log")
    facts = _facts(paths, contents, topics, commands, clock, hertz, start)
    folder = claim(options.out, scenario, options.overwrite)
    try:
        recorder = Recorder(folder.path, columns)
        with contextlib.closing(dataclasses.replace(maker, scenario=scenario).blocks()) as blocks:
            for k, row in enumerate(itertools.chain.from_iterable(blocks)):
                recorder.observe(k, row)
        recorder.close()
        write_atomic(folder.path / IMPORT, json_text(msgspec.to_builtins(facts)))
        return conclude(folder.path, scenario, IMPORTED, None, options.report)
    except OSError as error:
        folder.discard()
        raise RunError(f"{folder.path}: {error.strerror or error}") from error
    except BaseException:
        folder.discard()
        raise


def _scenario(path: Path, vehicle: Vehicle, options: _Options, through: str, steps: int, step: float) -> Scenario:
    """Return the scenario of a log's run: the vehicle, with goal and regions of the given scenario."""
    table: dict[str, Any] = {"title": f"Imported from {printable(path.name)}"[:200]}
    if options.scenario is not None:
        given = load_scenario(options.scenario, ["commands.enabled=false"]).table
        table |= {key: given[key] for key in _SCENARIO_KEYS if key in given}
        table["title"] = f"{table['title']}, imported from {printable(path.name)}"[:200]
    table |= {
        "vehicle": options.vehicle,
        "log": printable(path.name),
        "time": {"duration": steps * step, "step": step},
        "initial": {"position": [0.0, 0.0, 0.0]},
        "actuation": {"through": through},
    }
    return validate_scenario(table, printable(path.stem), vehicle)


def _with_first_pose(scenario: Scenario, rows: Array, names: list[str], law: str) -> Scenario:
    """Return a scenario with the first position and attitude of the rows, if they have any, and a law's name."""
    initial = scenario.initial
    for key, columns in (
        ("position", [f"position.{a}" for a in "xyz"]),
        ("quaternion", [f"quaternion.e{i}" for i in range(4)]),
    ):
        values = rows[:, [names.index(column) for column in columns]]
        known = np.flatnonzero(np.isfinite(values).all(axis=1))
        if known.size:
            initial = msgspec.structs.replace(initial, **{key: tuple(values[known[0]].tolist())})
    table = scenario.table | {"initial": msgspec.to_builtins(initial)}
    validated = validate_scenario(table, scenario.name, scenario.vehicle)
    return dataclasses.replace(validated, law=dataclasses.replace(validated.law, name=law))


def _facts(
    paths: Sequence[Path], contents: LogContents, topics: Mapping[str, Topic], commands: CommandForces | None,
    clock: VehicleClock, hertz: float, start: float,
) -> LogFacts:  # fmt: skip
    """Return the facts about the log that the run records."""
    remarks = [*contents.remarks, *([f"Clocks: {clock.summary()}."] if clock.summary() else [])]
    entries = [_topic_facts(topic, start) for topic in topics.values()]
    for topic, entry in zip(topics.values(), entries, strict=True):
        name = f"{entry.quantity} ({entry.source})"
        if entry.repairs:
            remarks.append(f"{name}: {entry.repairs}; {entry.samples} samples are left.")
        if topic.frozen:
            remarks.append(f"{name} {topic.frozen}")
        if not has_plausible_rate(topic):
            remarks.append(f"{name} has {topic.rate:.3g} samples per second: check the unit of its time.")
    size = sum(
        file.stat().st_size
        for path in paths
        for file in (path.iterdir() if path.is_dir() else [path])
        if file.is_file()
    )
    return LogFacts(
        printable(", ".join(path.name for path in paths)), size, start, hertz, commands.summary if commands else "",
        tuple(entries),
        {printable(name): count for name, count in contents.unread.most_common()},
        tuple(printable(remark) for remark in remarks),
    )  # fmt: skip


def _topic_facts(topic: Topic, start: float) -> TopicFacts:
    gaps = tuple((begin - start, end - start) for begin, end in topic.gaps[:_MAX_GAPS])
    return TopicFacts(
        topic.quantity, printable(topic.name), topic.count, topic.rate, topic.longest, topic.gap_count, gaps,
        topic.held, topic.burst, topic.late, topic.broken, topic.duplicates, topic.sorted, topic.outliers,
    )  # fmt: skip
