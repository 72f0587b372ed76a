"""The colors of regions, in every figure, page and export."""

from __future__ import annotations

import colorsys
from collections.abc import Sequence

from cosim.scenario.scenario import Scenario

GOAL_COLOR = "#009E73"  # Okabe and Ito's
_WIDEST = 50.0 / 360.0  # turns, maximum difference of hue between a criterion's color and its regions'
# for the regions of a criterion in turn: fraction of the greatest hue difference, added lightness, saturation factor
_SHADES = (
    (0.0, 0.0, 1.0),
    (0.8, -0.08, 0.85),
    (0.35, 0.24, 0.9),
    (0.2, -0.2, 0.8),
    (0.8, 0.14, 0.75),
    (0.0, 0.2, 0.35),
)


def colors_of_regions(scenario: Scenario) -> list[str]:
    """Return the colors of the goal and of the secondary regions, as ``#RRGGBB``."""
    # The first region of a criterion has the criterion's color. The others have shades of it, nearer to it in hue than
    # to any other criterion and to the goal; after six regions they repeat.
    own = {criterion.name: criterion.color for criterion in scenario.criteria}
    counts = dict.fromkeys(own, 0)
    colors = [GOAL_COLOR]
    for secondary in scenario.regions:
        name = secondary.criterion
        others = [GOAL_COLOR, *(color for other, color in own.items() if other != name)]
        colors.append(_shade(own[name], others, counts[name]))
        counts[name] += 1
    return colors


def _shade(color: str, others: Sequence[str], index: int) -> str:
    index %= len(_SHADES)
    if index == 0:
        return color
    (part, lighter, full), (hue, lightness, saturation) = _SHADES[index], _hls(color)
    # at most half the hue difference to the next color, on the side where that is farther
    apart = [(_hls(other)[0] - hue) % 1.0 for other in others]
    up, down = min(apart), min(1.0 - turn for turn in apart)
    wide = min(_WIDEST, 0.5 * up) if up > down else -min(_WIDEST, 0.5 * down)
    lightness = min(0.8, max(0.18, lightness + lighter))
    shade = colorsys.hls_to_rgb((hue + part * wide) % 1.0, lightness, full * saturation)
    return "#" + "".join(f"{round(255 * channel):02X}" for channel in shade)


def _hls(color: str) -> tuple[float, float, float]:
    return colorsys.rgb_to_hls(*(int(color[i : i + 2], 16) / 255.0 for i in (1, 3, 5)))
