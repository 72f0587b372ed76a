"""The page of an identification, and the files that are written with it as one."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import IdentificationError
from cosim.identification import findings
from cosim.identification.identify import Identification, vehicle_contents
from cosim.identification.log import UNITS
from cosim.identification.posterior import posterior_lines
from cosim.io.atomic_file import reason, write_together
from cosim.report.web_page import Html, Page, code, inline_figure, number
from plant_fmu.archive import temporary_folder
from plant_fmu.vehicle import load_vehicle


def write_results(done: Identification, out: Path) -> tuple[Path, Path]:
    """Write the vehicle's file, the drawn vehicles and the page; at no time does one stand beside an older other.

    Parameters
    ----------
    done : Identification
        Result of the identification.
    out : Path
        Path of the vehicle's file, which ends in ``.toml``.

    Returns
    -------
    Path, Path
        Paths of the drawn vehicles, with ``.posterior.jsonl``, and of the page, with ``.html``.

    Raises
    ------
    IdentificationError
        If a file cannot be written, the name is not valid for a vehicle, or hardly any draw has a positive definite
        mass matrix.
    """
    posterior, page = out.with_suffix(".posterior.jsonl"), out.with_suffix(".html")
    contents = {
        out: vehicle_contents(done, out),
        posterior: "".join(f"{line}\n" for line in posterior_lines(done.fit, done.vehicle)),
        page: page_contents(done, out),
    }
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_together(contents)
    except OSError as error:
        raise IdentificationError(f"{error.filename or out}: {reason(error)}") from error
    load_vehicle(out)
    return posterior, page


def page_contents(done: Identification, out: Path) -> str:
    """Return the page of an identification whose vehicle's file is `out`."""
    import matplotlib as mpl

    from cosim.identification.figures import figures_of
    from cosim.report.figures.style import STYLE

    with temporary_folder("identify-") as scratch, mpl.rc_context(STYLE):
        figures = {f.name: inline_figure(f, scratch) for f in figures_of(done.fit, done.predictions)}
    return _page(done, out, figures).html()


def _page(done: Identification, out: Path, figures: dict[str, Html]) -> Page:
    fit = done.fit
    page = Page(f"{done.vehicle.title}, identified")
    page.verdict(findings.verdict(fit))
    for text in findings.warnings(fit, done.logs):
        page.paragraph(text)
    page.paragraph(
        f'The vehicle\'s file is {out.name}; it begins a scenario as vehicle = "{out.name}". Vehicles drawn from these '
        f"numbers, for cosim sweep --vehicles, are in {out.stem}.posterior.jsonl.",
        faint=True,
    )
    page.heading("The numbers")
    page.table(("Number", "Start", "Found", "± 95 %", "Unit", "Rests on"), _rows(done, nuisance=False))
    page.paragraph(
        f"Intervals are those of a jackknife that leaves out {fit.intervals.clusters}, or nominal ones where those are "
        "wider. A number rests on its prior where the runs leave more than half of what was not known before.",
        faint=True,
    )
    page.add(figures["numbers"])
    nuisance = list(_rows(done, nuisance=True))
    if nuisance:
        page.heading("What was estimated beside")
        page.table(("Number", "Start", "Found", "± 95 %", "Unit", "Rests on"), nuisance)
    page.heading("How well it fits")
    page.add(figures["residuals"])
    _add_predictions(page, done, figures)
    page.heading("Which numbers go together")
    page.add(figures["correlation"])
    page.heading("What to drive next")
    for text in findings.advice(fit):
        page.paragraph(text)
    page.heading("The runs")
    page.table(("Run", "Topic", "Samples", "Hz", "Noise"), findings.topic_rows(done.logs))
    free = " ".join(dict.fromkeys(".".join(fit.parameters[i].name.split(".")[:2]) for i in fit.vehicle_part()))
    command = f"cosim identify {' '.join(log.name for log in done.logs)} --vehicle {done.start} --free {free}"
    page.add(Html(f"<p>{code(f'{command} --out {out.name}')}</p>"))
    return page


def _add_predictions(page: Page, done: Identification, figures: dict[str, Html]) -> None:
    if not done.predictions:
        return
    page.heading("How far it predicts")
    if done.held_out:
        page.paragraph(f"Of {', '.join(log.name for log in done.held_out)}, which the fit has not seen.")
    else:
        page.paragraph("Of the runs that were fitted themselves: none was held out (--held-out), so this flatters.")
    page.add(figures["predictions"])
    rows = []
    for p in done.predictions:
        cells = [", ".join(number(x, 3) for x in values) for values in (p.identified, p.start_vehicle, p.held)]
        rows.append((f"{p.topic.replace('_', ' ')} [{UNITS[p.topic]}], {p.horizon:g} s", f"{p.windows}", *cells))
    page.table(("Error, root mean square", "Windows", "Identified", "Start vehicle", "Hold the start velocity"), rows)


def _rows(done: Identification, nuisance: bool) -> list[tuple[str, ...]]:
    fit = done.fit
    rows: list[tuple[str, ...]] = []
    resting = set(fit.resting())
    for i, p in enumerate(fit.parameters):
        if p.is_nuisance != nuisance:
            continue
        half = fit.intervals.half[i]
        rests = "prior" if i in resting or (nuisance and fit.intervals.prior_part[i] > 0.5) else "runs"
        cells = (p.name, number(p.start), number(float(fit.values[i])), number(float(half), 2), p.unit, rests)
        rows.append(cells)
    return rows
