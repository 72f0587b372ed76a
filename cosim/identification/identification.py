"""Identification from run folders to a vehicle's file, drawn vehicles and the page."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.errors import IdentificationError
from cosim.identification import findings
from cosim.identification.fit import Fit, fit
from cosim.identification.intervals import MAX_PRIOR_FRACTION
from cosim.identification.log import UNITS, Log, load_log
from cosim.identification.parameters import (
    DEFAULT_FREE,
    DEFAULT_NUISANCES,
    RANDOM_FORCE,
    TRANSLATION_FREE,
    Parameter,
    free_parameters,
    nuisances,
    with_mean_nuisances,
)
from cosim.identification.prediction import AUTO, Prediction, Structure, choose_structure, validate
from cosim.identification.vehicle_file import name_of_file, posterior_lines, vehicle_text
from cosim.io.atomic_file import reason, write_together
from cosim.report.web_page import render_page
from plant_fmu.vehicle import Vehicle, load_vehicle


@dataclass(frozen=True)
class Identification:
    """An identification with its runs, fit and validation."""

    start: str  # name of the shipped vehicle, or path of the file, with the start values of the search
    vehicle: Vehicle  # vehicle of `start`, loaded
    logs: tuple[Log, ...]  # fitted runs
    held_out: tuple[Log, ...]  # runs for validation, not fitted
    fit: Fit
    predictions: tuple[Prediction, ...]  # prediction errors of the runs held out, or without them of the fitted ones
    command: str  # that reproduces this identification, without ``--out``
    structure: Structure | None = None  # chosen structure, with the nuisances `AUTO`


def identify(
    runs: Sequence[Path],
    start: str,
    free: Sequence[str] | None = None,
    nuisance: Sequence[str] = DEFAULT_NUISANCES,
    held_out: Sequence[Path] = (),
    progress: Callable[[float], None] = lambda part: None,
    turns_measured: bool = False,
) -> Identification:
    """Identify parameters of a vehicle from recorded runs."""
    # `free`: default by the structure. `turns_measured`: attitude and angular velocity are inputs.
    if not runs:
        raise IdentificationError("no run is given, expected at least one")
    vehicle = load_vehicle(start)
    logs, held_out_logs = (tuple(load_log(run, vehicle) for run in folders) for folders in (runs, held_out))
    structure, delays = None, None
    if [*nuisance] == [AUTO]:
        turns_measured = True
        structure = choose_structure(logs, vehicle, free)
        vehicle, parameters, delays = structure.vehicle, list(structure.parameters), structure.delays
    else:
        parameters = free_parameters(vehicle, free or (TRANSLATION_FREE if turns_measured else DEFAULT_FREE))
        if free is not None and not free:
            raise IdentificationError("--free: nothing is free, expected at least one key")
        parameters += nuisances(nuisance, logs)
        if len({p.is_nuisance for p in parameters if p.kind == "delay"}) > 1:
            raise IdentificationError("--nuisance delay: contains thrusters.delay, which is free, expected one of them")
    try:
        fitted = fit(logs, vehicle, parameters, progress, RANDOM_FORCE in nuisance, turns_measured, delays)
    except IdentificationError as error:
        delay_notes = [text for log in logs if (text := findings.slow_commands(log))]
        raise IdentificationError(". ".join([str(error), *([" ".join(delay_notes)] if delay_notes else [])])) from error
    findings.require_distinguishable(fitted)
    if held_out_logs:
        predictions = validate(held_out_logs, vehicle, *with_mean_nuisances(parameters, fitted.values), fitted.step)
    else:
        predictions = validate(logs, vehicle, parameters, fitted.values, fitted.step)
    flags = {
        "": runs, "--vehicle": [start], "--held-out": held_out, "--free": free or (),
        "--nuisance": nuisance or [""], "--measured-attitude": [""] if turns_measured and structure is None else (),
    }  # fmt: skip
    words = (word for name, values in flags.items() if values for word in (name, *map(str, values)) if word)
    command = f"cosim identify {shlex.join(words)}"
    return Identification(start, vehicle, logs, held_out_logs, fitted, tuple(predictions), command, structure)


def summary_lines(result: Identification) -> list[str]:
    """Return the chosen structure and the quality of the predictions, in sentences."""
    lines = [result.structure.summary()] if result.structure else []
    shown = [p for p in result.predictions if p.topic == "velocity"]
    of = "held-out" if result.held_out else "fitted"
    for measured, how in ((True, "with measured attitude"), (False, "free-running")):
        r2 = [f"{p.horizon:g} s: {', '.join(f'{x:.2f}' for x in p.r2)}" for p in shown if p.turns_measured == measured]
        if r2:
            lines.append(f"R² of surge, sway and heave velocity on {of} runs, {how}: {'; '.join(r2)}.")
    return lines


def vehicle_contents(result: Identification, out: Path) -> str:
    """Return the content of the identified vehicle's file `out`; raise IdentificationError if its name is invalid."""
    names = ", ".join(log.name for log in result.logs)
    provenance = [
        f"Identified by cosim identify from {names}, starting from {result.vehicle.name}. Behind a number stands "
        "half of its 95 % interval.",
        findings.verdict(result.fit),
        *summary_lines(result),
        *findings.shared_nuisances(result.fit),
        *findings.warnings(result.fit, result.logs),
    ]
    return vehicle_text(result.start, result.vehicle, result.fit, name_of_file(out), provenance)


def write_results(result: Identification, out: Path) -> tuple[Path, Path]:
    """Write the vehicle's file, the drawn vehicles and the page; at no time does one stand beside an older other."""
    posterior, page = out.with_suffix(".posterior.jsonl"), out.with_suffix(".html")
    contents = {
        out: vehicle_contents(result, out),
        posterior: "".join(f"{line}\n" for line in posterior_lines(result.fit, result.vehicle)),
        page: page_contents(result, out),
    }
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
        write_together(contents)
    except OSError as error:
        raise IdentificationError(f"{error.filename or out}: {reason(error)}") from error
    load_vehicle(out)
    return posterior, page


def page_contents(result: Identification, out: Path) -> str:
    """Return the page of an identification whose vehicle's file is `out`."""
    from cosim.identification.identification_figures import figures_of, inline_figures

    fit, logs = result.fit, result.logs
    shown = next(iter(result.held_out), None)
    return render_page(
        "cosim.identification/identification.html.j2", vehicle=result.vehicle.title, out=out,
        figures=inline_figures(figures_of(fit, result.vehicle, result.predictions, shown)),
        verdict=findings.verdict(fit), warnings=[*summary_lines(result), *findings.warnings(fit, logs)],
        advice=findings.advice(fit),
        rows=list(_rows(result.fit, False)),
        nuisance_rows=list(_rows(result.fit, True)), clusters=fit.intervals.clusters, predictions=result.predictions,
        held_out=[log.name for log in result.held_out], units=UNITS, topics=findings.topic_rows(logs),
        command=f"{result.command} --out {shlex.quote(out.name)}",
    )  # fmt: skip


def _rows(fit: Fit, nuisance: bool) -> Iterator[tuple[Parameter, float, float, str]]:
    """Yield parameter, value, half width of its 95 % interval, and what it rests on."""
    for i, p in enumerate(fit.parameters):
        if p.is_nuisance == nuisance:
            basis = "prior" if fit.intervals.prior_fraction[i] > MAX_PRIOR_FRACTION else "runs"
            yield p, float(fit.values[i]), float(fit.intervals.half[i]), basis
