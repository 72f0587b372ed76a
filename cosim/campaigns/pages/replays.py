"""Replays of the worst rows: flown again step by step, each on its own page below the campaign's folder."""

from __future__ import annotations

import contextlib
import shutil
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from cosim.campaigns.pages.sections import SECTIONS
from cosim.campaigns.rerun import Repeat, repeat_of, require_complete
from cosim.campaigns.store.folder import SUMMARY, lock_folder
from cosim.errors import CosimError, RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text, read_json, understood
from cosim.replay.page import write_page
from cosim.replay.trace import trace_of
from cosim.report.web_page import render_page, write_figures
from cosim.results.run_result import REPLAY, load_run
from cosim.run.run_scenario import run_scenario
from cosim.scenario.law_factory import OwnLaw
from plant_fmu import PlantError
from plant_fmu.archive import temporary_folder

if TYPE_CHECKING:
    from cosim.report.figures.style import NamedFigure

WORST = "worst"  # folder of the replays
_REMARKS = "flown.json"  # file beside a replay with remarks on differing flights


@dataclass(frozen=True)
class Replay:
    """The replay of a row, or remarks why there is none."""

    page: str | None  # path of the replay's page, relative to the folder
    remarks: tuple[str, ...]  # remarks, such as differences between flight and row


class PageContents(NamedTuple):
    """What a page shows, computed from its numbers."""

    values: Mapping[str, Any]  # values of the template
    drawings: Iterable[NamedFigure]
    keys: Iterable[int]  # rows that have a replay
    folders: Sequence[Path]  # campaigns whose flights of a row are shown together
    title: Callable[[int], str]  # title of the replay of a row


def write_page_with_replays(
    path: Path, numbers: Path, compute: Callable[[dict[str, Any]], PageContents], laws: Sequence[OwnLaw] = ()
) -> Path:
    """Write a page and its figures, fly rows again, and write the page again with their replays."""
    has_campaign = numbers.name == SUMMARY
    if has_campaign:
        require_complete(path.parent)
    table = read_json(numbers)
    with lock_folder(path.parent) if has_campaign else contextlib.nullcontext():
        with understood(numbers):
            contents = compute(table)

        def write(shown: Mapping[int, Replay]) -> None:
            with understood(numbers):
                template, values = f"cosim.campaigns.pages/{path.name}.j2", {**contents.values, **SECTIONS}
                write_atomic(path, render_page(template, s=table, **values, figures=figures, shown=shown))

        try:
            with understood(numbers):
                figures = write_figures(path.parent, contents.drawings)
            write({})
            if shown := {
                key: replay_of(path.parent, key, contents.folders, contents.title(key), laws) for key in contents.keys
            }:
                write(shown)
        except OSError as error:
            raise RunError(f"{path.parent}: {error.strerror or error}") from error
    return path


def replay_of(out: Path, key: int, folders: Sequence[Path], title: str, laws: Sequence[OwnLaw] = ()) -> Replay:
    """Fly a row of one or several campaigns again, unless done before, and write a page with the flights."""
    target = out / WORST / str(key)
    if not (target / _REMARKS).exists():
        target.parent.mkdir(exist_ok=True)
        with temporary_folder(f".{key}-", target.parent) as scratch:
            traces, remarks = [], []
            for folder in folders:
                name = f"{folder.name}: " if len(folders) > 1 else ""
                trace, remark = _fly_again(repeat_of(folder, key, laws), scratch / "run")
                traces += [trace | ({"name": folder.name} if name else {})] if trace else []
                remarks += [name + remark] if remark else []
            if traces:
                write_page(scratch / REPLAY, traces, title)
            write_atomic(scratch / _REMARKS, json_text({"remarks": remarks}))
            scratch.chmod(0o755)
            shutil.rmtree(target, ignore_errors=True)
            scratch.replace(target)
    stored = read_json(target / _REMARKS).get("remarks")
    if not (isinstance(stored, list) and all(isinstance(remark, str) for remark in stored)):
        raise RunError(f"{target / _REMARKS}: cannot be read: remarks are missing")
    return Replay(f"{WORST}/{key}/{REPLAY}" if (target / REPLAY).exists() else None, tuple(stored))


def _fly_again(repeat: Repeat, folder: Path) -> tuple[dict[str, Any] | None, str]:
    """Fly a row step by step; return its trace, None if it cannot be shown, and a remark."""
    if repeat.scenario is None:
        return None, f"was not flown: {repeat.stored['refused']}"
    remark = ""
    try:
        try:
            run_scenario(repeat.scenario, folder, report=False, law=repeat.law)
        except PlantError as error:
            remark = f"the plant stops: {error}"
        run = load_run(folder)
        if run.summary["status"] == "interrupted":
            raise KeyboardInterrupt
        apart = repeat.differences(run)
        trace = trace_of(run).as_json()
    except CosimError as error:
        return None, f"cannot be shown: {remark or error}"
    finally:
        shutil.rmtree(folder, ignore_errors=True)
    differences = ", ".join(
        f"{name} {_format_value(now)} instead of {_format_value(before)}" for name, (before, now) in apart.items()
    )
    return trace, f"the flight step by step differs: {differences}" if differences else remark


def _format_value(value: Any) -> str:
    return f"{value:.4g}" if isinstance(value, float) else {None: "none", True: "yes", False: "no"}[value]
