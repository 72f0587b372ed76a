"""The worst rows of a campaign."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import numpy as np

from cosim.campaigns.store.results import Results

LISTED = 10  # maximum number of rows that summaries and pages list


def violated_column(results: Results) -> str:
    """Return the name of the column of violations, which scenes and sweeps call differently."""
    return "violation" if "violation" in results.schema.names else "violated"


def worst_table(results: Results, folder: Path, count: int = LISTED) -> list[dict[str, Any]]:
    """Return the worst rows but refused ones, each with its key, the reason, and the command that repeats it."""
    names = results.schema.names
    keys, reached = results[names[0]], results.fact("reached")
    stopped = results.number("stopped_at")
    violated = results.fact(violated_column(results)) | np.isfinite(stopped)
    clearance, time = results.number("min_clearance"), results.number("reach_time")
    depth = np.where(np.isfinite(clearance), np.maximum(-clearance, 0.0), 0.0)
    shortfall = results.number("closest_to_goal", 0.0) if "closest_to_goal" in names else np.zeros(len(keys))
    group = np.where(violated, 0, np.where(reached, 2, 1))
    badness = np.select([group == 0, group == 1], [depth, shortfall], np.nan_to_num(time))
    flown = np.flatnonzero(results.is_null("refused"))
    order = flown[np.lexsort((keys[flown], -badness[flown], group[flown]))][: max(count, 0)]
    worst = []
    for i in order:
        if np.isfinite(stopped[i]):
            why = f"stopped at {stopped[i]:.2f} s"
        elif violated[i]:
            why = f"violated, {depth[i]:.3f} m deep" if depth[i] > 0.0 else "violated"
        elif not reached[i]:
            why = f"not reached, {shortfall[i]:.2f} m short" if shortfall[i] > 0.0 else "not reached"
        else:
            why = f"reached at {time[i]:.2f} s"
        worst.append({"row": int(keys[i]), "why": why, "command": rerun_command(folder, int(keys[i]))})
    return worst


def rerun_command(folder: Path, key: int) -> str:
    """Return the command that repeats a row."""
    return f"cosim rerun {shlex.quote(str(folder))} {key}"
