"""System calls that fail, kill or interrupt, one after the other, in a process of its own."""

import ctypes
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FAIL_ONCE, FAIL_ON, KILL, INTERRUPT = range(4)
needs_faults = pytest.mark.skipif(
    sys.platform != "linux" or shutil.which("cc") is None, reason="replaces functions of the C library of Linux"
)


def call_with_faults(function, *arguments, timeout=1200):
    """Call a function of a test module in a process whose system calls `arm` can disturb."""
    module, folder = function.__module__, Path(arguments[0])
    library = folder / "faults.so"
    if not library.exists():
        subprocess.run(["cc", "-shared", "-fPIC", "-o", library, ROOT / "tests" / "faults.c", "-ldl"], check=True)
    code = f"import {module} as m; m.{function.__name__}({', '.join(repr(str(a)) for a in arguments)})"
    done = subprocess.run(
        [sys.executable, "-c", code], env=os.environ | {"LD_PRELOAD": str(library), "PYTHONPATH": str(ROOT)},
        capture_output=True, text=True, timeout=timeout, cwd=folder,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr


def arm(folder, n, kind=FAIL_ONCE):
    """Disturb the n-th call from now on that changes a file below a folder; 0 for none."""
    ctypes.CDLL(None).faults_arm(str(folder).encode(), ctypes.c_long(n), kind)


def count():
    """Return the number of these calls since `arm`."""
    return ctypes.CDLL(None).faults_count()
