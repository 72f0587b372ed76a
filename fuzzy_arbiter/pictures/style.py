"""The style of the pictures: new axes, colors and lines that can be distinguished, texts that fit."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence
from importlib.util import find_spec
from typing import TYPE_CHECKING, Any

from fuzzy_arbiter.errors import PictureError

if TYPE_CHECKING:
    from matplotlib.axes import Axes

# Okabe and Ito's colors, which color-blind people can distinguish, from dark to light
COLORS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00")
DASHES = ("-", (0, (6, 2)), (0, (2, 1.5)), (0, (7, 2, 1.5, 2)), (0, (7, 2, 1.5, 2, 1.5, 2)), (0, (1, 2)))
HATCHES = ("////", "....", "\\\\\\\\", "xx", "----", "||||")
INK, FAINT = "#333333", "#999999"
_LETTERS = 14  # number of letters of a legend or title in an inch of the axes


def require_matplotlib() -> None:
    """Require that Matplotlib is installed."""
    if find_spec("matplotlib") is None:
        raise PictureError("pictures: Matplotlib is not installed, expected the extra fuzzy-arbiter[plot]")


def new_axes(width: float, height: float, **keywords: Any) -> Axes:
    """Return the axes of a new figure; width, height [in]."""
    require_matplotlib()
    from matplotlib.figure import Figure

    ax: Axes = Figure(figsize=(width, height), layout="constrained").add_subplot(**keywords)
    return ax


def color(i: int) -> str:
    """Return the color of the i-th line or area."""
    return COLORS[i % len(COLORS)]


def hatch(i: int) -> str:
    """Return the hatching of the i-th area."""
    return HATCHES[(i + i // len(COLORS)) % len(HATCHES)]


def line_style(i: int) -> dict[str, Any]:
    """Return the style of the i-th line, which differs in color and dashes, and is narrower than the line below."""
    dashes = DASHES[(i + i // len(COLORS)) % len(DASHES)]
    return {"color": color(i), "linestyle": dashes, "linewidth": max(1.8, 2.8 - 0.25 * i)}


def tidy(ax: Axes) -> None:
    """Remove the frame's upper and right sides, and draw a faint grid."""
    ax.spines[["top", "right"]].set_visible(False)
    ax.grid(color="#e4e4e4", linewidth=0.6)
    ax.set_axisbelow(True)


def legend_above(ax: Axes, names: Sequence[str], title: str = "") -> None:
    """Set the legend above the axes, where it covers nothing, in as many columns as fit."""
    width = title_width(ax)
    ax.legend(
        loc="lower left", bbox_to_anchor=(0.0, 1.0), frameon=False, borderaxespad=0.2, borderpad=0.1, handlelength=3.2,
        ncols=max(1, min(len(names), width // (max(map(len, names)) + 8))), fontsize=9,
        title=wrapped(title, width) or None, title_fontsize=10, alignment="left",
    )  # fmt: skip


def title_width(ax: Axes) -> int:
    """Return the number of letters that fit in a line above some axes."""
    return max(20, int(_LETTERS * ax.bbox.width / ax.figure.dpi))


def wrapped(text: str, width: int) -> str:
    """Break a text into lines of at most some letters, between words where that is possible."""
    lines = textwrap.wrap(text.replace(" = ", "\xa0=\xa0"), width, break_on_hyphens=False)
    return "\n".join(lines).replace("\xa0", " ")
