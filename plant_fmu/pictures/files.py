"""Figures as files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMAGES = ("png", "svg", "pdf")


def image(figure: Figure, suffix: str) -> bytes:
    """Return a figure as a file, the same for the same figure at any time.

    Parameters
    ----------
    figure : Figure
        The picture.
    suffix : {"png", "svg", "pdf"}
        Kind of the file.

    Returns
    -------
    bytes
        What stands in it.
    """
    import matplotlib as mpl
    from matplotlib.text import Text

    undated: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    out = io.BytesIO()
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # a title with dollar signs is no formula
    with mpl.rc_context({"svg.hashsalt": "plant_fmu"}):
        figure.savefig(out, format=suffix, dpi=120, metadata=undated.get(suffix))
    return out.getvalue()
