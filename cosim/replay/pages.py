"""The pages of runs in their folders, and of several runs in one file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from cosim.errors import RunError
from cosim.replay.page import is_page, write_page
from cosim.replay.sampling import MAX_BYTES, MAX_BYTES_INTERACTIVE
from cosim.replay.trace import trace_of
from cosim.results.run_result import REPLAY, Run, load_run


def write_replay(run: Run, out: Path | None = None, title: str | None = None, interactive: bool = False) -> Path:
    """Write the page of one run."""
    flight = None
    if interactive:
        from cosim.replay.interactive.data import flight_data  # imports all of packaged controllers

        flight = flight_data(run)
    trace = trace_of(run, MAX_BYTES_INTERACTIVE if interactive else MAX_BYTES)
    return write_page(out or run.folder / REPLAY, [trace.as_json()], title or run.scenario.title, flight)


def replay(
    folders: Sequence[Path], out: Path | None = None, title: str | None = None, interactive: bool = False
) -> Path:
    """Write the page of one or several runs that were completed, interrupted or killed."""
    names = _names(folders)
    if interactive and len(folders) > 1:
        raise RunError(f"{len(folders)} runs, expected one for an interactive replay")
    file = out or (folders[0] / REPLAY if len(folders) == 1 else Path(REPLAY))
    try:
        if file.exists() and not is_page(file):
            raise RunError(f"{file}: exists and is no replay; expected a new file")
        if len(folders) == 1:
            return write_replay(load_run(folders[0]), file, title, interactive)
        traces, titles = [], {}
        for folder, name in zip(folders, names, strict=True):
            run = load_run(folder)
            traces.append(trace_of(run).as_json() | {"name": name})
            titles[name] = run.scenario.title
        return write_page(file, traces, title or joint_title(titles))
    except OSError as error:
        raise RunError(f"{file}: {error.strerror or error}") from error


def joint_title(titles: Mapping[str, str]) -> str:
    """Join the titles of several runs: each title once, before the names of its runs."""
    return "; ".join(
        f"{title}: {', '.join(n for n in titles if titles[n] == title)}" for title in dict.fromkeys(titles.values())
    )


def _names(folders: Sequence[Path]) -> list[str]:
    """Return the shortest ends of the folders' paths that distinguish them."""
    paths = [folder.resolve() for folder in folders]
    for i, path in enumerate(paths):
        if path in paths[:i]:
            raise RunError(f"{folders[i]}: is given twice, expected each run once")
    depth = 1
    while len({path.parts[-depth:] for path in paths}) < len(paths):
        depth += 1
    return [Path(*path.parts[-depth:]).as_posix() for path in paths]
