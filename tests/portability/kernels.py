"""Print the numerical kernels of this process as JSON: ``python -m tests.portability.kernels``.

It asks the libraries, and does not believe what the environment was to make of them.
"""

from __future__ import annotations

import json
import re
import sys
from pathlib import Path
from typing import Any

_LINUX = {"fma": "fma3", "pni": "sse3"}  # names that NumPy has for what Linux calls so


def features_of(cpuinfo: str) -> set[str]:
    """Return what the processor can, of the text of ``/proc/cpuinfo``."""
    found = re.search(r"^(?:flags|Features)\s*:(.*)$", cpuinfo, re.MULTILINE)
    return {_LINUX.get(name, name) for name in found[1].split()} if found else set()


def _features() -> list[str]:
    from numpy._core import _multiarray_umath  # it has no public place

    found = {name.lower() for name, there in getattr(_multiarray_umath, "__cpu_features__", {}).items() if there}
    if Path("/proc/cpuinfo").exists():
        found |= features_of(Path("/proc/cpuinfo").read_text())
    return sorted(found)


def _dispatched() -> list[str]:
    import numpy as np

    configured: Any = np.show_config(mode="dicts")
    return sorted(configured.get("SIMD Extensions", {}).get("found", []))


def _kernels() -> dict[str, str]:
    """Return the kernels of each package's OpenBLAS, both loaded."""
    import numpy as np
    import scipy.linalg
    from threadpoolctl import threadpool_info

    np.linalg.inv(np.eye(3)), scipy.linalg.cholesky(np.eye(3))
    found = {}
    for library in threadpool_info():
        if library["internal_api"] == "openblas":
            folder = Path(library["filepath"]).parts
            package = next((name for name in ("numpy", "scipy") if any(part.startswith(name) for part in folder)), "")
            found[package or library["filepath"]] = library["architecture"]
    return found


if __name__ == "__main__":
    about = {"kernels": _kernels(), "features": _features(), "dispatched": _dispatched()}
    sys.stdout.write(json.dumps(about) + "\n")
