"""A run folder into a file of another format, which appears whole or not at all."""

from __future__ import annotations

import importlib
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cosim.errors import ExportError, RunError
from cosim.export.excerpt import excerpt_of
from cosim.results.record import RECORD
from cosim.results.run_result import COMMANDS_LOG, SCENARIO, SUMMARY
from plant_fmu.installing import install_hint


@dataclass(frozen=True)
class Format:
    """A format of other tools; `cosim.export.as_NAME` writes it."""

    needs: tuple[str, ...] = ()  # what the base installation does not bring, as requirements of pip
    beside: str = ""  # ending of a second file, in the place of the suffix
    whole: bool = False  # it has signals and rates of its own, and takes no choice of them


FORMATS = {
    "csv": Format(beside=".units.csv"),
    "npz": Format(),
    "mat": Format(),
    "mcap": Format(("foxglove-schemas-protobuf>=0.3", "mcap>=1.2", "mcap-protobuf-support>=0.5", "protobuf>=4.25")),
    "rrd": Format(("rerun-sdk>=0.31",)),
    "tlog": Format(whole=True),
}

_OF_RUNS = frozenset({RECORD, SCENARIO, SUMMARY, COMMANDS_LOG})


def export_run(
    folder: Path,
    to: str,
    out: Path | None = None,
    *,
    signals: Sequence[str] = (),
    every: int = 1,
    rate: float | None = None,
    force: bool = False,
) -> list[Path]:
    """Write a run in another format.

    Parameters
    ----------
    folder : Path
        The run folder, of a run that was finished, interrupted or killed.
    to : str
        A key of `FORMATS`.
    out : Path, optional
        The file; by default the folder's name with the format as suffix, in the present folder.
    signals : sequence of str
        Names or patterns of signals; none for all.
    every : int
        One step of so many.
    rate : float, optional
        Steps a simulated second [Hz] in the place of `every`.
    force : bool
        Replace what is there.

    Returns
    -------
    list of Path
        The files: that of the format, then what stands beside it.

    Raises
    ------
    RunError
        If the folder holds no run that can be read.
    ExportError
        If the format is unknown, cannot hold what was asked for or needs what is not installed, a pattern fits no
        signal, or a file is in the way or of the run itself.
    """
    if to not in FORMATS:
        raise ExportError(f"--to {to}: expected one of {', '.join(FORMATS)}")
    form = FORMATS[to]
    if form.whole and (signals or every != 1 or rate is not None):
        raise ExportError(f"--to {to}: expected no --signals, --every or --rate with it: its messages have their own")
    path = out or Path(f"{folder.resolve().name}.{to}")
    files = [path, *([path.with_suffix(form.beside)] if form.beside else [])]
    for file in files:
        if file.exists() and not (force and file.is_file()):
            raise ExportError(f"{file}: exists; expected a new file, or --force to replace it")
        if file.name in _OF_RUNS and file.parent.resolve() == folder.resolve():
            raise ExportError(f"{file}: is of the run itself, expected another file")
    writer = _writer(to, form)
    excerpt = excerpt_of(folder, signals, every, rate)
    try:
        with tempfile.TemporaryDirectory(prefix=f".{path.name}-", dir=path.parent) as scratch:
            for made in writer.write(excerpt, Path(scratch) / path.name):
                made.replace(path.parent / made.name)
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error
    return files


def _writer(to: str, form: Format) -> Any:
    """Return the module that writes a format, or say what to install for it."""
    try:
        return importlib.import_module(f"cosim.export.as_{to}")
    except ModuleNotFoundError as error:
        if not form.needs or (error.name or "").startswith("cosim"):
            raise
        raise ExportError(f"--to {to} needs {error.name}; {install_hint(*form.needs)}") from error
