"""NPZ: each signal as an array of its name, with units and scenario."""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.typing import NDArray

from cosim.export.excerpt import Excerpt
from cosim.export.format import Format


def write(excerpt: Excerpt, path: Path) -> list[Path]:
    """Write the file.

    Parameters
    ----------
    excerpt : Excerpt
        The run with the selected signals.
    path : Path
        The file.

    Returns
    -------
    list of Path
        The file.
    """
    # as numpy.savez_compressed, but with one block of a signal in memory at a time
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, allowZip64=True) as archive:
        for name, array in _texts(excerpt):
            with _member(archive, name) as file:
                np.lib.format.write_array(file, array, allow_pickle=False)
        head = {"descr": "<f8", "fortran_order": False, "shape": (excerpt.count,)}
        for column in excerpt.columns:
            with _member(archive, column.name) as file:
                np.lib.format.write_array_header_1_0(file, head)
                for block in excerpt.blocks([column.name]):
                    file.write(block[column.name].astype("<f8").tobytes())
    return [path]


def _member(archive: zipfile.ZipFile, name: str) -> IO[bytes]:
    return archive.open(f"{name}.npy", "w", force_zip64=True)


def _texts(excerpt: Excerpt) -> Iterator[tuple[str, NDArray[Any]]]:
    yield "names", np.array([column.name for column in excerpt.columns])
    yield "units", np.array([column.unit for column in excerpt.columns])
    yield "descriptions", np.array([column.description for column in excerpt.columns])
    yield "scenario", np.array(excerpt.scenario_text)
    yield "summary", np.array(excerpt.summary_text)


FORMAT = Format(write)
