"""The files of an identification: the vehicle, the vehicles drawn from its numbers, and the page."""

from __future__ import annotations

from pathlib import Path

from cosim.errors import IdentificationError
from cosim.identification.identify import Identification, vehicle_contents
from cosim.identification.page import page_contents
from cosim.identification.posterior import posterior_lines
from cosim.io.atomic_file import reason, write_together
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
