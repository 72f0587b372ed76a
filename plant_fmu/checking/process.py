"""Run a driver in its own process, so that an FMU that crashes or hangs its importer is a result like any other."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

from plant_fmu.archive import temporary_folder
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.checking.task import Result, Task

TIMEOUT = 120.0  # s, time limit of a task in an importer

_TAIL = 4096  # number of bytes at the end of the output that are searched for the error


@dataclass(frozen=True)
class Importer:
    """An importer, or a use of one."""

    name: str
    driver: str  # "module:function", which takes an FmuFile, a Task and a folder for the FMU
    interface: str  # "CS", "ME", or "" for a validator without simulation
    inapplicable: Callable[[FmuFile], str] = lambda fmu: ""  # reason why it does not apply to an FMU, "" if it does
    package: str = "fmpy"

    def objection(self, fmu: FmuFile) -> str:
        """Return the reason why this importer does not apply to an FMU, or ``""``."""
        if self.interface and self.interface not in fmu.interfaces:
            return f"the FMU offers no {'co-simulation' if self.interface == 'CS' else 'model exchange'}"
        if self.interface and self.interface not in fmu.libraries:
            return "the FMU has no binary for this machine"
        return self.inapplicable(fmu)


def run_importer(importer: Importer, fmu: FmuFile, task: Task, timeout: float = TIMEOUT) -> Result:
    """Run a task with an FMU in an importer; failures of its process are results too, and nothing is raised."""
    # Units of arguments: timeout [s]
    # The FMU's binary is run, with the rights of this user: a process of its own guards against crashes, not against
    # malice.
    version = metadata.version(importer.package)

    def result(status: str, note: str, **values: object) -> Result:
        line = " ".join(note.split())
        return Result(importer.name, version, importer.interface, status, line, **values)  # type: ignore[arg-type]

    if objection := importer.objection(fmu):
        return result("does not apply", objection)
    with temporary_folder("plant_fmu-") as folder:
        request = {"driver": importer.driver, "fmu": str(fmu.path), "task": asdict(task)}
        (folder / "request.json").write_text(json.dumps(request), encoding="utf-8")
        code, message = _run_child(folder, timeout)
        if code is None:
            return result("failed", f"not done after {timeout:g} s{message}")
        if code < 0:
            return result("failed", f"crashed (signal {-code}, {signal.strsignal(-code)}){message}")
        if code != 0:
            return result("failed", f"crashed (exit code {code}){message}")
        try:
            reply = json.loads((folder / "reply.json").read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return result("failed", f"ended without an answer{message}")
    if reply["status"] == "failed":
        reply["note"] += message
    return result(**reply)


def _run_child(folder: Path, timeout: float) -> tuple[int | None, str]:
    """Run the driver; return its exit code, None after a timeout, and the last error that it printed."""
    home = str(Path(__file__).parents[2])  # folder that holds this package, which need not be installed
    paths = [home, *filter(None, [os.environ.get("PYTHONPATH")])]
    with open(folder / "output.txt", "wb") as sink:
        try:
            code: int | None = subprocess.run(
                [sys.executable, "-u", "-P", "-m", "plant_fmu.checking"],
                cwd=folder,
                env={**os.environ, "PYTHONPATH": os.pathsep.join(paths)},
                stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT,
                timeout=timeout, check=False,
            ).returncode  # fmt: skip
        except subprocess.TimeoutExpired:
            code = None
    with open(folder / "output.txt", "rb") as source:
        source.seek(max(0, (folder / "output.txt").stat().st_size - _TAIL))
        lines = source.read().decode("utf-8", "replace").splitlines()
    errors = [line.strip() for line in lines if "error" in line.lower()]
    return code, f"; its output: {errors[-1]}" if errors else ""
