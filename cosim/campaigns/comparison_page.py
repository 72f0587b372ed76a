"""A comparison as a page of Markdown."""

from __future__ import annotations

from typing import Any

_ROWS = (  # where in a law's summary, and how it is called
    (("reached",), "reached"),
    (("violations",), "violations"),
    (("stopped",), "stopped by the FMU"),
    (("medians", "reach_time"), "median reach time, s"),
    (("medians", "effort"), "median effort, N s"),
    (("medians", "thrust_variation"), "median variation of the thrust, N"),
    (("medians", "min_clearance"), "median of the least clearance, m"),
    (("least_clearance",), "least clearance of all, m"),
    (("medians", "worst_step_time"), "median of the longest call of the law, s"),
    (("worst_step_time",), "longest call of all, s"),
)


def page(numbers: dict[str, Any]) -> str:
    """Return the page.

    Parameters
    ----------
    numbers : dict
        What `compare` writes as JSON.

    Returns
    -------
    str
        Markdown, with the figures linked.
    """
    laws = numbers["laws"]
    lines = [
        f"# {', '.join(laws)} on {numbers['scenes']} scenes",
        "",
        *_table(["", *laws], [[name, *(_text(_at(laws[law], path)) for law in laws)] for path, name in _ROWS]),
        "",
        "Medians are over the scenes that each law reached.",
        "",
        "## On the scenes that a law completes",
        "",
        "Scenes that the law in the first column reaches without a violation, and medians of both laws over them. What",
        "the other law never reaches counts as taking for ever.",
        "",
        *_table(
            [
                "completed by",
                "scenes",
                "beside",
                "completed by both",
                "reach time, s",
                "beside",
                "effort, N s",
                "beside",
            ],
            [_pair(pair) for pair in numbers["pairs"]],
        ),
        "",
        "## Distributions",
        "",
        "![Share of all scenes reached by a time](figures/reach-time.svg)",
        "",
        "![Effort over the scenes that each law reached](figures/effort.svg)",
        "",
        "![Least clearance; left of 0 a region is violated](figures/min-clearance.svg)",
    ]
    return "\n".join(lines) + "\n"


def _pair(pair: dict[str, Any]) -> list[str]:
    one, other = pair["completed_by"], pair["beside"]
    medians = [_text(pair[what][law]) for what in ("reach_time", "effort") for law in (one, other)]
    return [one, str(pair["scenes"]), other, str(pair["completed_by_both"]), *medians]


def _table(head: list[str], rows: list[list[str]]) -> list[str]:
    return [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]


def _at(summary: Any, path: tuple[str, ...]) -> Any:
    for key in path:
        summary = summary[key]
    return summary


def _text(value: float | None) -> str:
    if value is None:
        return "–"
    return str(value) if isinstance(value, int) else f"{value:.4g}"
