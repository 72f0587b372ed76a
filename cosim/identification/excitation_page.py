"""The folder of an excitation design: scenario, commands, stick values and the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import msgspec
import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.excitation import AXES, BEGIN, NOISE, PERIOD, RETURN, ROW, SECONDS, Design, excitation_table
from cosim.identification.fit import STAGES
from cosim.identification.intervals import NORMAL
from cosim.io.atomic_file import write_atomic
from cosim.report.web_page import render_page
from cosim.results.file_copies import VEHICLE_COPY
from cosim.scenario.toml_text import scenario_text

SCENARIO, COMMANDS, STICKS, PAGE = "excite.toml", "commands.jsonl", "sticks.csv", "excite.html"
_GOLDEN = 0.618033988749895  # golden ratio less 1: its multiples modulo 1 cover 0 to 1 evenly
_MAX_DEVIATION = 0.1  # ratio of expected to prior deviation, above which a parameter is called hardly identifiable
_COMMENTS = {
    "title": "Made by cosim identify --excite; the law brings the vehicle back between segments",
    "time.duration": "s", "time.step": "s",
    "initial.position": "m, center of the box", "commands.pilot_gain": "sticks are fractions of the greatest wrench",
}  # fmt: skip


def verdict(design: Design) -> str:
    """Return a sentence about the number of segments and the free parameters that they determine."""
    ratios = _prior_ratios(design)
    weak = [design.parameters[i].name for i in design.vehicle_indices() if ratios[i] > _MAX_DEVIATION]
    text = (
        f"{len(design.segments)} segments of {SECONDS:g} s were chosen among {design.candidates}, "
        f"{design.scenario.time.duration:g} s in all"
    )
    if weak:
        return f"{text}; they hardly determine {', '.join(weak)}."
    return f"{text}; they determine all {len(design.vehicle_indices())} free numbers of the vehicle."


def warnings(design: Design) -> Iterator[str]:
    """Yield the warnings that a user must read before playing the sticks."""
    outside = sum(x > 1.0 for x in design.excursions)
    yield (
        f"Of {len(design.excursions)} other vehicles, with half to one and a half times the damping and added mass and "
        f"in a current of {design.current:g} m/s, {f'{outside} leave' if outside else 'none leaves'} the box: the "
        f"farthest goes {100 * max(design.excursions):.0f} % of the way to a side."
    )


def write_folder(design: Design, out: Path) -> Path:
    """Write the folder of a design."""
    has_file = design.start.endswith(".toml")
    table = excitation_table(
        VEHICLE_COPY if has_file else design.start, design.scenario.vehicle.name, float(design.center[2]),
        design.scenario.time.duration,
    )  # fmt: skip
    files: dict[str, bytes | str] = {
        SCENARIO: scenario_text(table, _COMMENTS),
        COMMANDS: b"".join(msgspec.json.encode({"step": k, "command": c}) + b"\n" for k, c in design.commands),
        STICKS: "".join(f"{line}\n" for line in _stick_lines(design)),
        PAGE: _page(design, out),
    }
    try:
        if has_file:
            files[VEHICLE_COPY] = Path(design.start).read_bytes()
        out.mkdir(parents=True, exist_ok=True)
        try:
            for name, content in files.items():
                write_atomic(out / name, content)
        except BaseException:
            for name in files:  # the folder was empty, and the same command expects it so
                (out / name).unlink(missing_ok=True)
            raise
    except OSError as error:
        raise IdentificationError(f"{out}: {error.strerror or error}") from error
    return out / PAGE


def require_empty(out: Path) -> None:
    """Raise IdentificationError unless a folder is new or empty."""
    if out.exists() and (not out.is_dir() or any(out.iterdir())):
        raise IdentificationError(f"--out {out}: is not empty, expected a new folder")


def _stick_lines(design: Design) -> Iterator[str]:
    yield "time_s,mode," + ",".join(AXES)
    time, neutral = BEGIN, ",".join("0" for _ in AXES)
    yield f"0,return,{neutral}"
    for k, segment in enumerate(design.segments):
        if k:
            yield f"{time:.3f},return,{neutral}"
            time += RETURN
        for i, sticks in enumerate(segment.sticks):
            uneven = time + PERIOD * ((i * _GOLDEN) % 1.0 - 0.5)
            yield f"{uneven:.3f},{segment.mode}," + ",".join(f"{x:.4g}" for x in sticks)
            time += PERIOD
    yield f"{time:.3f},return,{neutral}"


def _prior_ratios(design: Design) -> NDArray[np.float64]:
    """Return the ratios of expected to prior deviation, shape (p,)."""
    return np.array([d / p.deviation for d, p in zip(design.deviations, design.parameters, strict=True)])


def _page(design: Design, out: Path) -> str:
    from cosim.identification.identification_figures import inline_figures, rehearsal_figures

    segments = [
        (f"{BEGIN + k * (SECONDS + RETURN):g}", segment.title, segment.mode,
         ", ".join(f"{x:.2f}" for x in np.abs(segment.sticks).max(axis=0)))
        for k, segment in enumerate(design.segments)
    ]  # fmt: skip
    parameters = [(design.parameters[i], NORMAL * float(design.deviations[i])) for i in design.vehicle_indices()]
    return render_page(
        "cosim.identification/excite.html.j2", vehicle=design.scenario.vehicle.title, start=design.start, out=out,
        verdict=verdict(design), warnings=warnings(design), figures=inline_figures(rehearsal_figures(design)),
        segments=segments, parameters=parameters, normal=NORMAL, depth=float(design.center[2]), period=PERIOD,
        window=STAGES[0], noise=NOISE, row_period=ROW,
    )  # fmt: skip
