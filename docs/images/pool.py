"""Draws measured and predicted velocities of a held-out pool run, from tables that the tests write."""

from __future__ import annotations

import tempfile
from pathlib import Path

import matplotlib as mpl

from cosim import import_log
from cosim.identification.identification import identify
from cosim.identification.identification_figures import velocity_course
from cosim.report.figures.style import STYLE
from tests.cosim.identification.pool_pairs import VEHICLE, write_pairs

RUNS = 8


def main() -> None:
    """Import eight runs, identify the vehicle from seven, and draw the eighth."""
    with tempfile.TemporaryDirectory() as scratch, mpl.rc_context(STYLE):
        folder = Path(scratch)
        write_pairs(folder, seed=3, runs=RUNS)
        (folder / "pool.toml").write_text(VEHICLE)
        runs = []
        for run in range(RUNS):
            logs = [folder / f"run-{run:02d}-{part}.csv" for part in ("wrench", "nav")]
            options = {"columns": folder / "map.toml", "report": False}
            runs.append(import_log(logs, folder / "pool.toml", folder / "runs" / str(run), **options).folder)
        done = identify(runs[:-1], str(folder / "pool.toml"), nuisance=("auto",), held_out=runs[-1:])
        velocity_course(done.held_out[0], done.fit, done.vehicle).savefig("pool-prediction.png", dpi=100)


if __name__ == "__main__":
    main()
