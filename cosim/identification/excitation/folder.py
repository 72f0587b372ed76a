"""The folder of a design: scenario, commands, stick values and the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from cosim.errors import IdentificationError
from cosim.identification.excitation.design import BEGIN, RETURN, Design
from cosim.identification.excitation.rehearsal import NOISE
from cosim.identification.excitation.scenario_text import ROW, scenario_text
from cosim.identification.excitation.segments import PERIOD, SECONDS
from cosim.identification.fit import STAGES
from cosim.io.atomic_file import write_atomic
from cosim.report.web_page import inline_figure, render_page
from cosim.scenario.scenario import VEHICLE_COPY
from plant_fmu.archive import temporary_folder

SCENARIO, COMMANDS, STICKS, PAGE = "excite.toml", "commands.jsonl", "sticks.csv", "excite.html"
_AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
_GOLDEN = 0.618033988749895  # golden ratio less 1: its multiples modulo 1 cover 0 to 1 evenly
_NORMAL = 1.96  # standard deviations: half of a 95 % interval
_LEAST_KNOWN = 0.1  # ratio of expected to prior deviation, above which a number is called hardly identifiable


def verdict(done: Design) -> str:
    """Return a sentence about the number of segments and the free numbers that they determine."""
    part = _of_prior(done)
    weak = [done.parameters[i].name for i in done.vehicle_part() if part[i] > _LEAST_KNOWN]
    text = f"{len(done.segments)} segments of {SECONDS:g} s were chosen among {done.tried}, {done.duration:g} s in all"
    if weak:
        return f"{text}; they hardly determine {', '.join(weak)}."
    return f"{text}; they determine all {len(done.vehicle_part())} free numbers of the vehicle."


def warnings(done: Design) -> Iterator[str]:
    """Yield the warnings that a user must read before playing the sticks."""
    worst = max(done.excursions)
    leaves = sum(x > 1.0 for x in done.excursions)
    said = f"{leaves} leave the box" if leaves else "none leaves the box"
    yield (
        f"Of {len(done.excursions)} other vehicles, with half to one and a half times the damping and added mass and "
        f"in a current of {done.current:g} m/s, {said}: the farthest goes {100 * worst:.0f} % of the way to a side."
    )


def write_folder(done: Design, out: Path) -> Path:
    """Write the folder of a design."""
    own = done.start.endswith(".toml")
    vehicle = VEHICLE_COPY if own else done.start
    files = {
        SCENARIO: scenario_text(vehicle, done.depth, done.duration, done.vehicle.name).encode(),
        COMMANDS: b"".join(msgspec.json.encode({"step": k, "command": c}) + b"\n" for k, c in done.commands),
        STICKS: "".join(f"{line}\n" for line in _stick_lines(done)).encode(),
        PAGE: _page(done, out).encode(),
    }
    try:
        if own:
            files[VEHICLE_COPY] = Path(done.start).read_bytes()
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


def _stick_lines(done: Design) -> Iterator[str]:
    yield "time_s,mode," + ",".join(_AXES)
    time, rest = BEGIN, ",".join("0" for _ in _AXES)
    yield f"0,return,{rest}"
    for k, segment in enumerate(done.segments):
        if k:
            yield f"{time:.3f},return,{rest}"
            time += RETURN
        for i, sticks in enumerate(segment.sticks):
            at = time + PERIOD * ((i * _GOLDEN) % 1.0 - 0.5)
            yield f"{at:.3f},{segment.mode}," + ",".join(f"{x:.4g}" for x in sticks)
            time += PERIOD
    yield f"{time:.3f},return,{rest}"


def _of_prior(done: Design) -> NDArray[np.float64]:
    return np.array([d / p.deviation for d, p in zip(done.deviations, done.parameters, strict=True)])


def _page(done: Design, out: Path) -> str:
    import matplotlib as mpl

    from cosim.identification.excitation.figures import figure_of
    from cosim.report.figures.style import STYLE

    with temporary_folder("excite-") as scratch, mpl.rc_context(STYLE):
        figure = figure_of(done)
        figures = {figure.name: inline_figure(figure, scratch)}
    segments = [
        {
            "begin": BEGIN + k * (SECONDS + RETURN), "title": segment.title, "mode": segment.mode,
            "sticks": ", ".join(f"{x:.2f}" for x in np.abs(segment.sticks).max(axis=0)),
        }
        for k, segment in enumerate(done.segments)
    ]  # fmt: skip
    return render_page(
        "cosim.identification.excitation/excite.html.j2", vehicle=done.vehicle.title, start=done.start, out=out,
        verdict=verdict(done), warnings=warnings(done), figures=figures, segments=segments, numbers=_numbers(done),
        depth=done.depth, period=PERIOD, window=STAGES[0], noise=NOISE, row_period=ROW,
    )  # fmt: skip


def _numbers(done: Design) -> Iterator[dict[str, Any]]:
    for i in done.vehicle_part():
        p, half = done.parameters[i], _NORMAL * float(done.deviations[i])
        part = f"{100 * half / abs(p.start):.2g} %" if p.start else "–"
        before = {"name": p.name, "start": p.start, "before": _NORMAL * p.deviation, "unit": p.unit}
        yield before | {"half": half, "part": part}
