"""The page of an identification, and the files that are written with it as one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from cosim.errors import IdentificationError
from cosim.identification import findings
from cosim.identification.identify import Identification, vehicle_contents
from cosim.identification.log import UNITS
from cosim.identification.posterior import posterior_lines
from cosim.io.atomic_file import reason, write_together
from cosim.report.web_page import inline_figure, render_page
from plant_fmu.archive import temporary_folder
from plant_fmu.vehicle import load_vehicle


def write_results(done: Identification, out: Path) -> tuple[Path, Path]:
    """Write the vehicle's file, the drawn vehicles and the page; at no time does one stand beside an older other."""
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

    fit, logs = done.fit, done.logs
    with temporary_folder("identify-") as scratch, mpl.rc_context(STYLE):
        figures = {f.name: inline_figure(f, scratch) for f in figures_of(fit, done.predictions)}
    return render_page(
        "cosim.identification/identification.html.j2", vehicle=done.vehicle.title, out=out, figures=figures,
        verdict=findings.verdict(fit), warnings=findings.warnings(fit, logs), advice=findings.advice(fit),
        rows=list(_rows(done, False)), nuisance_rows=list(_rows(done, True)), clusters=fit.intervals.clusters,
        predictions=done.predictions, held_out=[log.name for log in done.held_out], units=UNITS,
        topics=findings.topic_rows(logs), logs=[log.name for log in logs], start=done.start,
        free=list(dict.fromkeys(".".join(fit.parameters[i].name.split(".")[:2]) for i in fit.vehicle_part())),
    )  # fmt: skip


def _rows(done: Identification, nuisance: bool) -> Iterator[dict[str, Any]]:
    fit = done.fit
    resting = set(fit.resting())
    for i, p in enumerate(fit.parameters):
        if p.is_nuisance == nuisance:
            on_prior = i in resting or (nuisance and fit.intervals.prior_part[i] > 0.5)
            numbers = {"start": p.start, "value": float(fit.values[i]), "half": float(fit.intervals.half[i])}
            yield {"name": p.name, "unit": p.unit, "basis": "prior" if on_prior else "runs", **numbers}
