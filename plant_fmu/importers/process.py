"""Run a driver in its own process, so that an importer that crashes or hangs is a result like any other."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from dataclasses import asdict
from pathlib import Path

from plant_fmu.archive import temporary_folder
from plant_fmu.importers.fmu_file import FmuFile
from plant_fmu.importers.registry import Importer
from plant_fmu.importers.task import Result, Task
from plant_fmu.installing import install_hint

TIMEOUT = 120.0  # s, time limit of a task in an importer

_TAIL = 4096  # number of bytes at the end of the output that are searched for the error
_NOISE = "Start attribute is required"  # FMI Library, inside libcosim, reports this for any independent variable


def run_importer(importer: Importer, fmu: FmuFile, task: Task, timeout: float = TIMEOUT) -> Result:
    """Run a task with an FMU in an importer.

    The FMU's binary is run, with the rights of this user: a process of its own guards against crashes, not against
    malice.

    Parameters
    ----------
    importer : Importer
        Importer from `IMPORTERS`.
    fmu : FmuFile
        FMU, as from `read_fmu`.
    task : Task
        Simulation to run.
    timeout : float
        Time limit [s].

    Returns
    -------
    Result
        The result; failures of the other process are results too, and nothing is raised.
    """
    version = importer.version()

    def result(status: str, note: str, **more: object) -> Result:
        line = " ".join(note.split())
        return Result(importer.name, version, importer.interface, status, line, **more)  # type: ignore[arg-type]

    if missing := importer.missing():
        return result("not installed", install_hint(*missing))
    if objection := importer.objection(fmu):
        return result("does not apply", objection)
    with temporary_folder("plant_fmu-") as folder:
        request = {"module": importer.module, "fmu": str(fmu.path), "task": asdict(task)}
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        code, said = _run_child(folder, timeout)
        if code is None:
            return result("failed", f"not done after {timeout:g} s{said}")
        if code < 0:
            return result("failed", f"crashed (signal {-code}, {signal.strsignal(-code)}){said}")
        if code != 0:
            return result("failed", f"crashed (exit code {code}){said}")
        try:
            reply = json.loads((folder / "reply.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return result("failed", f"ended without an answer{said}")
    if "unusable" in reply:  # not a defect of the FMU
        return result("not installed", f"cannot be loaded: {reply['unusable']}")
    if "error" in reply:
        return result("failed", reply["error"] + said)
    return result("ok", **reply)


def _run_child(folder: Path, timeout: float) -> tuple[int | None, str]:
    """Run the driver; return its exit code, None after a timeout, and the last line of its error output."""
    home = str(Path(__file__).parents[2])  # folder that holds this package, which need not be installed
    paths = [home, *filter(None, [os.environ.get("PYTHONPATH")])]
    with open(folder / "said.txt", "wb") as sink:
        try:
            code: int | None = subprocess.run(
                [sys.executable, "-u", "-P", "-m", "plant_fmu.importers"],
                cwd=folder,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT,
                timeout=timeout, check=False,
            ).returncode  # fmt: skip
        except subprocess.TimeoutExpired:
            code = None
    with open(folder / "said.txt", "rb") as source:
        source.seek(max(0, (folder / "said.txt").stat().st_size - _TAIL))
        lines = source.read().decode("utf-8", "replace").splitlines()
    complaints = [line.strip() for line in lines if "error" in line.lower() and _NOISE not in line]
    return code, f"; it said: {complaints[-1]}" if complaints else ""
