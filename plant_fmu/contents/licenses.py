"""Licenses of an FMU: this project's, and that of the code that is compiled into it."""

from __future__ import annotations

from importlib import resources
from pathlib import Path

import fmpy

from plant_fmu.errors import BuildError

_NOTE = """
--------------------------------------------------------------------------------
The binaries are compiled with the header files of the FMI standard; for those see fmi-headers.txt beside this file.
"""


def licenses(fmi: int) -> dict[str, str]:
    """Return the files of ``documentation/licenses``, by name."""
    package = resources.files("plant_fmu")
    # a wheel has a copy in the package, a checkout has the one file beside it
    files = [package / "LICENSE", Path(str(package)).parent / "LICENSE"]
    text = next((file.read_text(encoding="utf-8") for file in files if file.is_file()), "")
    header = (Path(fmpy.__file__).parent / "c-code" / f"fmi{fmi}Functions.h").read_text(encoding="utf-8")
    start, end = header.find("Copyright"), header.find("*/")
    if not text or not 0 <= start < end:
        raise BuildError("the license of subreach or of FMPy's FMI headers is not installed; install both anew")
    return {"license.txt": text.rstrip() + "\n" + _NOTE, "fmi-headers.txt": header[start:end].rstrip() + "\n"}
