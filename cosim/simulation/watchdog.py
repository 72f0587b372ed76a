"""A process that ends this one where a step of an FMU hangs, which no Python thread can while C runs."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import weakref

import numpy as np

from cosim.simulation.signals import Array
from plant_fmu.archive import temporary_folder

# reads numbers as in `cosim.step.fmu_call`; ends with its standard input, which ends with the process that it watches
_CODE = """
import os, signal, struct, sys, threading, time
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
name, file, limit, process = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
before, since = None, time.monotonic()
while True:
    time.sleep(min(limit / 4.0, 1.0))
    with open(file, "rb") as source:
        steps, busy, now, _ = struct.unpack("4d", source.read(32))
    if not busy or steps != before:
        before, since = steps, time.monotonic()
    elif time.monotonic() - since >= limit:
        print(f"{name}: t = {now:g} s: doStep has not returned for {limit:g} s; the process is ended, and the record "
              "up to its last flush can be read", file=sys.stderr, flush=True)
        os.kill(process, getattr(signal, "SIGKILL", signal.SIGTERM))
        os._exit(0)
"""


class Watchdog:
    """Watches the progress of an FMU, `progress` of `cosim.step.fmu_call.FmuCalls`; timeout [s of the wall clock]."""

    def __init__(self, name: str, timeout: float) -> None:
        self._open = contextlib.ExitStack()
        file = self._open.enter_context(temporary_folder("cosim-")) / "progress"
        file.write_bytes(bytes(32))
        self.progress: Array = np.asarray(np.memmap(file, np.float64, "r+"))
        command = [sys.executable, "-I", "-S", "-c", _CODE, name, str(file), repr(timeout), str(os.getpid())]
        process = subprocess.Popen(command, stdin=subprocess.PIPE)  # noqa: S603 -- of this file
        self._open.callback(_end, process)
        self.close = weakref.finalize(self, self._open.close)


def _end(process: subprocess.Popen[bytes]) -> None:
    process.kill()
    process.communicate()
