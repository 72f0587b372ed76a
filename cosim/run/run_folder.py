"""Run folders: claim one for a run, write summary, report and replay, or remove it if nothing was recorded."""

from __future__ import annotations

import contextlib
import itertools
import shutil
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from pathlib import Path
from shlex import quote
from typing import Any

from cosim.errors import RunError
from cosim.io.atomic_file import reason, write_atomic
from cosim.io.strict_json import json_text
from cosim.replay.pages import write_replay
from cosim.report.figure_process import FigureProcess
from cosim.report.report_files import write_report
from cosim.report.system_report import write_system_report
from cosim.report.web_page import FIGURES
from cosim.results.file_copies import VEHICLE_COPY, files_of
from cosim.results.log_facts import IMPORT
from cosim.results.record import RECORD, STREAM, load_record, require_utf8
from cosim.results.recorder import Recorder
from cosim.results.run_result import COMMANDS_LOG, REPLAY, REPORT, SCENARIO, SUMMARY, SYSTEM, Run, load_run, open_run
from cosim.results.system_run import is_of_system, load_system_run
from cosim.results.wording import verdict
from cosim.scenario.scenario import Scenario
from plant_fmu.archive import is_temporary, temporary_folder

_OUTPUT_NAMES = frozenset(
    {SCENARIO, SYSTEM, VEHICLE_COPY, COMMANDS_LOG, IMPORT, RECORD, STREAM, SUMMARY, REPORT, REPLAY, FIGURES}
)  # names of the files and folders that a run makes


@dataclass(frozen=True)
class RunFolder:
    """A folder that belongs to one run."""

    path: Path
    created: bool  # True if the run made the folder, False if it existed and was empty

    def keep(self, recorder: Recorder | None) -> bool:
        """Close the record of a run; discard a run without any rows."""
        if recorder is None or not recorder.rows:
            self.discard()
            return False
        try:
            recorder.close()
        except OSError:
            if not (self._has_record() or self._has_commands()):
                self.discard()
            raise
        return True

    def discard(self) -> None:
        """Remove all files of the run. May be called twice."""
        for file in _files_of_run(self.path) if self.path.exists() else ():
            _remove(file)
        if self.created:
            with contextlib.suppress(OSError):  # the folder is not empty: its user has put files there
                self.path.rmdir()

    @contextlib.contextmanager
    def writing(self) -> Iterator[None]:
        """Convert an OSError within a block to a RunError that says what is kept, and which verb reads it."""
        try:
            yield
        except OSError as error:
            raise RunError(f"{self.path}: {reason(error)}; {self._describe_kept_data()}") from error

    def _describe_kept_data(self) -> str:
        """Describe what is left of a run that could not be written to its end."""
        if self._has_record():
            return f"the rows that were written are kept, and `cosim report {quote(str(self.path))}` reads them"
        if self._has_commands():
            command = f"cd {quote(str(self.path))} && cosim run {SCENARIO} --replay-commands {COMMANDS_LOG}"
            return f"no row is kept, but `{command}` repeats the run"
        return "nothing of the run is kept"

    def _has_record(self) -> bool:
        with contextlib.suppress(RunError):
            return len(load_record(self.path)) > 0
        return False

    def _has_commands(self) -> bool:
        log = self.path / COMMANDS_LOG
        return log.exists() and b"\n" in log.read_bytes()


def claim(out: Path | None, scenario: Scenario, overwrite: bool = False) -> RunFolder:
    """Create the folder of a run and write the scenario into it."""
    try:
        files = files_of(scenario)
    except OSError as error:
        raise RunError(f"{out or 'runs'}: {error.strerror or error}") from error
    return claim_folder(out, scenario.name, files, overwrite)


def claim_folder(out: Path | None, name: str, files: Mapping[str, bytes], overwrite: bool = False) -> RunFolder:
    """Create the folder of a run with a name, and write some files into it."""
    where = out or Path("runs")
    require_utf8(where.absolute())
    try:
        if out is None:
            path, created = _new_folder(where, f"{name}-{datetime.now().astimezone():%Y%m%d-%H%M%S}"), True
        else:
            path, created = out, not out.exists()
            if not created:
                if overwrite and any(path.iterdir()):
                    _remove_run(path)
                if any(path.iterdir()):
                    raise RunError(f"{path}: exists and is not empty; expected a new folder")
        folder = RunFolder(path, created)
        try:
            path.mkdir(parents=True, exist_ok=True)
            for file_name, content in files.items():
                with (path / file_name).open("xb") as file:
                    file.write(content)
        except FileExistsError as error:  # another run has claimed the folder meanwhile
            raise RunError(f"{path}: is taken by another run") from error
        except BaseException:
            folder.discard()
            raise
    except OSError as error:
        raise RunError(f"{where}: {error.strerror or error}") from error
    return folder


def _files_of_run(path: Path) -> list[Path]:
    """Return the files and folders of a run in its folder: with the FMUs that its scenario names."""
    scenario = path / SCENARIO
    text = scenario.read_text(encoding="utf-8") if scenario.is_file() else ""
    return [
        file
        for file in path.iterdir()
        if file.name in _OUTPUT_NAMES or (file.suffix == ".fmu" and f'file = "{file.name}"' in text)
    ]


def _remove(file: Path) -> None:
    if file.is_dir() and not file.is_symlink():
        shutil.rmtree(file, ignore_errors=True)
    else:
        file.unlink(missing_ok=True)


def _remove_run(path: Path) -> None:
    """Remove the files of a run from its folder; raise a RunError if the folder holds any other file."""
    files = _files_of_run(path)
    odd = sorted(
        file.name
        for file in path.iterdir()
        if not (file in files or file.match("report*.*") or is_temporary(file.name))
    )
    if odd or not ((path / SCENARIO).is_file() or is_of_system(path)):
        what = f"{odd[0]!r}, which no run makes" if odd else "no run"
        raise RunError(f"{path}: holds {what}; expected a run to be replaced, or a new folder")
    with temporary_folder(f".{path.name}-", path.parent) as aside:
        for file in path.iterdir():
            file.replace(aside / file.name)


def _new_folder(parent: Path, name: str) -> Path:
    for suffix in itertools.chain([""], (f"-{i}" for i in itertools.count(2))):
        try:
            path = parent / f"{name}{suffix}"
            path.mkdir(parents=True)
        except FileExistsError:
            if not parent.is_dir():
                raise
        else:
            return path
    raise AssertionError("unreachable")


def conclude(
    path: Path,
    scenario: Scenario,
    status: str,
    wall_time: float | None,
    report: bool,
    figure_process: FigureProcess | None = None,
) -> Run:
    """Write summary, report and replay of a run from its record; wall_time [s]."""
    run = open_run(path, scenario, status, wall_time)
    _write(run, ("html",) if report else (), figure_process)
    return run


def report_again(path: Path, formats: Collection[str] = ("html",)) -> tuple[str, list[Path]]:
    """Write summary and report of a run that was completed, interrupted or killed; return its outcome and the files."""
    try:
        if is_of_system(path):
            system_run = load_system_run(path)
            pages = write_system_report(system_run, formats)
            return system_run.outcome, [*pages[:1], write_summary(path, system_run.summary), *pages[1:]]
        run = load_run(path)
        return verdict(run.summary), _write(run, formats)
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error


def write_summary(path: Path, summary: Mapping[str, Any]) -> Path:
    """Write the summary of a run into its folder; return the file."""
    return write_atomic(path / SUMMARY, json_text(summary))


def _write(run: Run, formats: Collection[str], figure_process: FigureProcess | None = None) -> list[Path]:
    summary = write_summary(run.folder, run.summary)
    pages = write_report(run, formats, figure_process) if formats else []
    replay = [write_replay(run)] if "html" in formats else []
    return [*pages[:1], *replay, summary, *pages[1:]]
