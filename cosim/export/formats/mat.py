"""MAT, version 5: the signals as a struct of columns, with names, units and scenario."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cosim.errors import ExportError
from cosim.export.excerpt import Excerpt
from cosim.export.format import Format
from cosim.export.names import valid_names

_GREATEST = 2**31 - 2**20  # bytes of a variable in a file of version 5, less a margin for names and headers


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

    Raises
    ------
    ExportError
        If the data exceed the size limit of the format.
    """
    from scipy.io import savemat

    columns = excerpt.columns
    size = 8 * excerpt.count * len(columns)
    if size > _GREATEST:
        raise ExportError(
            f"--to mat: the signals have {size / 1e9:.1f} GB, expected {_GREATEST / 1e9:.1f} at most; "
            "take fewer by --signals, --every or --rate"
        )
    fields = valid_names(column.name for column in columns)
    signals = {field: excerpt.signal(column.name)[:, None] for field, column in zip(fields, columns, strict=True)}
    savemat(
        path,
        {
            "signals": signals,
            "names": _cells(column.name for column in columns),
            "units": _cells(column.unit for column in columns),
            "descriptions": _cells(column.description for column in columns),
            "scenario": excerpt.scenario_text,
            "summary": excerpt.summary_text,
        },
        appendmat=False,
        long_field_names=True,
        do_compression=True,
    )
    return [path]


def _cells(texts: Iterable[str]) -> NDArray[Any]:
    """Return a row of MATLAB cells."""
    return np.array([[*texts]], dtype=object)


FORMAT = Format(write)
