"""Pictures as small files."""

from __future__ import annotations

import io
from pathlib import Path

from matplotlib.figure import Figure
from PIL import Image

COLORS = 128  # of a picture; fewer than it has, which halves the file


def write(figure: Figure, path: Path) -> None:
    """Write a figure as PNG, with few colors."""
    out = io.BytesIO()
    figure.savefig(out, format="png", dpi=100)
    image = Image.open(out).convert("RGB").quantize(COLORS, dither=Image.Dither.NONE)
    image.save(path, optimize=True)
