"""Encode figures as files."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.figure import Figure

IMAGES = ("png", "svg", "pdf")


def image(figure: Figure, suffix: str) -> bytes:
    """Encode a figure as an image file; equal figures give equal bytes."""
    import matplotlib as mpl
    from matplotlib.text import Text

    undated: dict[str, Any] = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}
    out = io.BytesIO()
    for text in figure.findobj(Text):
        text.set_parse_math(False)  # a title with dollar signs is no formula
    with mpl.rc_context({"svg.hashsalt": "plant_fmu"}):
        figure.savefig(out, format=suffix, dpi=120, metadata=undated.get(suffix))
    return out.getvalue()
