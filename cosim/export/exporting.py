"""Export of a run folder to a file of another format, written atomically."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from pathlib import Path

from cosim.errors import ExportError, RunError
from cosim.export.excerpt import excerpt_of
from cosim.export.formats import FORMATS, Format
from cosim.results.record import RECORD, STREAM
from cosim.results.run_result import COMMANDS_LOG, SCENARIO, SUMMARY
from plant_fmu.archive import temporary_folder
from plant_fmu.installing import install_hint

# formats of earlier versions, and what replaces them
_REMOVED = {
    "mat": "MATLAB reads RUN/record.parquet by parquetread",
    "npz": "pandas.read_parquet and pyarrow read RUN/record.parquet",
}
_RUN_FILES = frozenset({RECORD, STREAM, SCENARIO, SUMMARY, COMMANDS_LOG})


def export_run(
    folder: str | Path,
    to: str,
    out: str | Path | None = None,
    *,
    signals: Sequence[str] = (),
    every: int = 1,
    rate: float | None = None,
    force: bool = False,
) -> list[Path]:
    """Write a run in another format.

    Parameters
    ----------
    folder : str or Path
        Folder of a run that was completed, interrupted or killed.
    to : str
        Name of the format: csv, mcap, rrd, rosbag2 or tlog.
    out : str or Path, optional
        File to write, with rosbag2 a folder; default: the run's name with the format as suffix, in the current folder.
    signals : sequence of str
        Names or patterns of signals; none for all.
    every : int
        Export every n-th step.
    rate : float, optional
        Steps per simulated second [Hz] instead of `every`.
    force : bool
        Replace existing files.

    Returns
    -------
    list of Path
        The file of the format, then its second file if it has one.

    Raises
    ------
    RunError
        If the folder holds no run that can be read.
    ExportError
        If the format is unknown, too small for the data or needs a package that is not installed, a pattern matches no
        signal, or a file exists or belongs to the run itself.

    Examples
    --------
    >>> import cosim
    >>> run = cosim.run_scenario(cosim.load_scenario("paper", ["time.duration=0.2"]), "run", report=False)
    >>> [path.name for path in cosim.export_run(run.folder, "csv", signals=["time", "position.*"])]
    ['run.csv', 'run.units.csv']
    """
    if to not in FORMATS:
        instead = f"; {_REMOVED[to]}" if to in _REMOVED else ""
        raise ExportError(f"--to {to}: expected one of {', '.join(FORMATS)}{instead}")
    form = FORMATS[to]
    chosen = {"signals": bool(signals), "every": every != 1, "rate": rate is not None}
    if any(chosen[name] for name in form.fixed):
        flags = ", ".join(f"--{name}" for name in form.fixed)
        raise ExportError(f"--to {to}: expected without {flags}, since its messages have their own")
    folder = Path(folder)
    path = Path(out or f"{folder.resolve().name}.{to}")
    files = [path, *([path.with_suffix(form.beside)] if form.beside else [])]
    for file in files:
        if file.exists() and not (force and _is_replaceable(file, form)):
            raise ExportError(f"{file}: exists; expected a new file, or --force to replace it")
        if file.name in _RUN_FILES and file.parent.resolve() == folder.resolve():
            raise ExportError(f"{file}: belongs to the run itself, expected another file")
    excerpt = excerpt_of(folder, signals, every, rate)
    new = [file for file in files if not file.exists()]
    try:
        try:
            with temporary_folder(f".{path.name}-", path.parent) as scratch:
                for file in import_module(form.writer).write(excerpt, scratch / path.name):
                    if form.folder and path.exists():
                        path.rename(scratch / "replaced")
                    file.replace(path.parent / file.name)
        except BaseException:
            for file in new:  # so that the same command does not meet the first of two
                if file.is_file():
                    file.unlink()
            raise
    except ModuleNotFoundError as error:
        if not form.needs or (error.name or "").startswith("cosim"):
            raise
        raise ExportError(f"--to {to} needs {error.name}; {install_hint(*form.needs)}") from error
    except OSError as error:
        raise RunError(f"{path}: {error.strerror or error}") from error
    return files


def _is_replaceable(path: Path, form: Format) -> bool:
    """Check that an existing file, or folder with the format's files alone, may be replaced."""
    if not form.folder:
        return path.is_file()
    return path.is_dir() and all(file.is_file() and file.suffix in form.folder for file in path.iterdir())
