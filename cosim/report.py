"""The report of a run: one HTML file that opens without a network, and its figures as files for papers."""

from __future__ import annotations

import html
import shutil
import tempfile
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, Any

from cosim.claims import paper_claims
from cosim.record import Record
from cosim.report_words import asked, verdict
from cosim.scenario import Scenario

if TYPE_CHECKING:  # Matplotlib takes as long to import as all else together
    from cosim.drawing import Drawing

REPORT = "report.html"
FIGURES = "figures"

# of the entries of the summary
_UNITS = {
    **dict.fromkeys(("simulated_time", "reach_time", "settle_time", "intersection_windows", "saturated_time"), " [s]"),
    **dict.fromkeys(("final_position", "closest_to_goal"), " [m]"),
    "min_clearance": " [m, or as clearance unit says]",
    **dict.fromkeys(("max_force", "max_force_asked"), " [N]"),
    **{f"estimate_{which}": " [N; N m]" for which in ("final", "true", "lowest", "highest")},
    "max_speed": " [m/s]",
    "effort": " [N s]",
    "lyapunov": " [N m; s]",
    "wall_time": " [s]",
}

_PAGE = Template("""<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>$title</title>
<style>
body { font: 16px/1.5 Georgia, serif; color: #1a1a1a; background: #fff; }
body { max-width: 46rem; margin: 2rem auto; padding: 0 1rem; }
h1 { font-size: 1.5rem; line-height: 1.2; } h2 { font-size: 1.15rem; margin-top: 2.2rem; }
.asked { color: #444; } .verdict { border-left: 4px solid #0072B2; padding: .2rem 0 .2rem 1rem; font-size: 1.08rem; }
figure { margin: 1.4rem 0; } figure svg { width: 100%; height: auto; } figcaption { font-size: .9rem; color: #444; }
.wide { overflow-x: auto; } table { border-collapse: collapse; width: 100%; font-size: .88rem; }
th, td { text-align: left; vertical-align: top; padding: .35rem .6rem; border-bottom: 1px solid #ccc; }
thead th { border-bottom: 2px solid #1a1a1a; } tbody th { font-weight: normal; color: #444; }
pre { font-size: .8rem; background: #f5f5f5; padding: .8rem; overflow-x: auto; }
footer { margin-top: 3rem; font-size: .85rem; color: #555; }
</style>
</head>
<body>
<h1>$title</h1>
<p class="asked">$asked</p>
<p class="verdict">$verdict</p>
$claims
<h2>Figures</h2>
$figures
<h2>Numbers</h2>
<div class="wide"><table><tbody>$numbers</tbody></table></div>
<h2>Scenario</h2>
<pre>$scenario</pre>
<footer>Vehicle: $vehicle. $source Positions north, east, down in metres; the body frame points forward, right, down.
Every number is in <code>summary.json</code>, every signal in <code>record.parquet</code>.</footer>
</body>
</html>
""")


def write_report(folder: Path, scenario: Scenario, record: Record, summary: dict[str, Any]) -> Path:
    """Write ``report.html`` and the figures as SVG and PNG.

    Parameters
    ----------
    folder : Path
        The run folder.
    scenario : Scenario
        What was run.
    record : Record
        What it left.
    summary : dict
        What it came to.

    Returns
    -------
    Path
        The HTML file.
    """
    from cosim.drawing import Story
    from cosim.figures import drawings

    figures = Path(tempfile.mkdtemp(prefix=f".{FIGURES}-", dir=folder))
    try:
        shown = [_figure(figures, drawing) for drawing in drawings(Story(scenario, record, summary))]
        figures.chmod(0o755)
        shutil.rmtree(folder / FIGURES, ignore_errors=True)
        figures.replace(folder / FIGURES)
    finally:
        shutil.rmtree(figures, ignore_errors=True)
    page = _PAGE.substitute(
        title=html.escape(scenario.title),
        asked=html.escape(asked(scenario)),
        verdict=html.escape(verdict(summary)),
        claims=_claims(scenario, summary),
        figures="\n".join(shown),
        numbers=_numbers(summary),
        scenario=html.escape(scenario.toml()),
        vehicle=html.escape(scenario.vehicle.title),
        source=html.escape(scenario.vehicle.source),
    )
    scratch = folder / f".{REPORT}"
    scratch.write_text(page, encoding="utf-8")
    return scratch.replace(folder / REPORT)


def _claims(scenario: Scenario, summary: dict[str, Any]) -> str:
    if scenario.compare != "paper":
        return ""
    rows = "".join(
        "<tr>" + "".join(f"<td>{html.escape(text)}</td>" for text in (c.stated, c.measured, c.why)) + "</tr>"
        for c in paper_claims(scenario, summary)
    )
    head = "<thead><tr><th>The paper states</th><th>This run gave</th><th>Why</th></tr></thead>"
    return f'<h2>Beside the paper</h2><div class="wide"><table>{head}<tbody>{rows}</tbody></table></div>'


def _numbers(summary: dict[str, Any]) -> str:
    rows = [(key.replace("_", " ") + _UNITS.get(key, ""), _text(value)) for key, value in summary.items()]
    return "".join(f"<tr><th>{html.escape(name)}</th><td>{html.escape(value)}</td></tr>" for name, value in rows)


def _text(value: Any) -> str:
    match value:
        case None:
            return "–"
        case bool():
            return "yes" if value else "no"
        case float():
            return f"{value:.6g}"
        case dict():
            return ", ".join(f"{key} {_text(item)}" for key, item in value.items())
        case list() | tuple():
            return "; ".join(" to ".join(map(_text, x)) if isinstance(x, tuple) else _text(x) for x in value) or "none"
    return str(value)


def _figure(folder: Path, drawing: Drawing) -> str:
    """Write a figure as SVG and PNG, and return it as a piece of HTML."""
    svg = drawing.write(folder)
    inline = svg[svg.index("<svg") :]
    return f"<figure>{inline}<figcaption>{html.escape(drawing.caption)}</figcaption></figure>"
