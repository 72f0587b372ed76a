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

# Reads numbers as in `cosim.step.fmu_call`; ends with its standard input, which ends with the process that it watches.
# It adds up the time in which that could run: not while either is stopped, as by Ctrl-Z or a debugger. Ctrl-C reaches
# both, and Python acts on it only after a step.
_CODE = """
import os, signal, struct, subprocess, sys, threading, time
threading.Thread(target=lambda: (sys.stdin.read(), os._exit(0)), daemon=True).start()
name, file, limit, process = sys.argv[1], sys.argv[2], float(sys.argv[3]), int(sys.argv[4])
ends = []
signal.signal(signal.SIGINT, lambda *_: ends.append("the run was interrupted, and "))

def is_stopped():
    if sys.platform == "linux":
        with open(f"/proc/{process}/stat", "rb") as source:
            return source.read().rpartition(b")")[2].split()[0] in (b"T", b"t")
    if sys.platform == "win32":
        return False
    return subprocess.run(["ps", "-o", "state=", "-p", str(process)], capture_output=True).stdout[:1] == b"T"

before, waited = None, 0.0
while True:
    pause = min(limit / 4.0, 0.25)
    time.sleep(pause)
    with open(file, "rb") as source:
        steps, busy, now, _ = struct.unpack("4d", source.read(32))
    if not busy or steps != before:
        before, waited = steps, 0.0
    elif not is_stopped():
        waited += pause
    if waited >= (min(limit, 1.0) if ends else limit):
        print(f"{name}: t = {now:g} s: {''.join(ends[:1])}doStep has not returned for {waited:g} s; the process is "
              "ended, and the record up to its last flush can be read", file=sys.stderr, flush=True)
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
