"""The page of an identification, and the files that are written with it as one."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from cosim.errors import IdentificationError
from cosim.identification import findings
from cosim.identification.fit import Fit
from cosim.identification.identify import Identification, vehicle_contents
from cosim.identification.intervals import MAX_PRIOR_PART
from cosim.identification.log import UNITS
from cosim.identification.parameters import Parameter
from cosim.identification.vehicle_file import posterior_lines
from cosim.io.atomic_file import reason, write_together
from cosim.report.web_page import render_page
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
    from cosim.identification.figures import figures_of, inline_figures

    fit, logs = done.fit, done.logs
    return render_page(
        "cosim.identification/identification.html.j2", vehicle=done.vehicle.title, out=out,
        figures=inline_figures(figures_of(fit, done.predictions)), verdict=findings.verdict(fit),
        warnings=findings.warnings(fit, logs), advice=findings.advice(fit), rows=list(_rows(done.fit, False)),
        nuisance_rows=list(_rows(done.fit, True)), clusters=fit.intervals.clusters, predictions=done.predictions,
        held_out=[log.name for log in done.held_out], units=UNITS, topics=findings.topic_rows(logs),
        logs=[log.name for log in logs], start=done.start, free=fit.free_keys(),
    )  # fmt: skip


def _rows(fit: Fit, nuisance: bool) -> Iterator[tuple[Parameter, float, float, str]]:
    """Yield parameter, value, half width of its 95 % interval, and what it rests on."""
    for i, p in enumerate(fit.parameters):
        if p.is_nuisance == nuisance:
            basis = "prior" if fit.intervals.prior_part[i] > MAX_PRIOR_PART else "runs"
            yield p, float(fit.values[i]), float(fit.intervals.half[i]), basis
