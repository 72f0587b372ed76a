"""NPZ: each signal as an array of its name, with units and scenario."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.export.excerpt import Excerpt


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file.

    Parameters
    ----------
    excerpt : Excerpt
        What is written.
    path : Path
        The file.

    Returns
    -------
    list of Path
        It alone.
    """
    # what numpy.savez_compressed does, but with one signal in memory at a time
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, allowZip64=True) as archive:
        for name, array in _arrays(excerpt):
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)
    return [path]


def _arrays(excerpt: Excerpt) -> Iterator[tuple[str, NDArray[Any]]]:
    yield "names", np.array([column.name for column in excerpt.columns])
    yield "units", np.array([column.unit for column in excerpt.columns])
    yield "descriptions", np.array([column.description for column in excerpt.columns])
    yield "scenario", np.array(excerpt.scenario_text)
    yield "summary", np.array(excerpt.summary_text)
    for column in excerpt.columns:
        yield column.name, excerpt.signal(column.name)
