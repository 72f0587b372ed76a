"""Region colors are distinguishable and derived from their criteria."""

from itertools import combinations

import numpy as np
import pytest

from cosim.results.region_colors import colors_of_regions
from cosim.scenario.scenario import load_scenario


def lab(color):
    """Return CIE L*a*b* of an sRGB color, white D65."""
    rgb = np.array([int(color[i : i + 2], 16) for i in (1, 3, 5)]) / 255.0
    linear = np.where(rgb <= 0.04045, rgb / 12.92, ((rgb + 0.055) / 1.055) ** 2.4)
    xyz = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]]) @ linear
    x, y, z = np.cbrt(xyz / [0.9505, 1.0, 1.089])
    return np.array([116 * y - 16, 500 * (x - y), 200 * (y - z)])


@pytest.mark.parametrize("name", ["docking", "harbour", "inspection-visibility", "pipe-inspection", "paper"])
def test_region_colors_are_distinguishable(name):
    scenario = load_scenario(name)
    colors = colors_of_regions(scenario)
    assert len(colors) == len(scenario.regions) + 1
    for a, b in combinations(colors, 2):
        assert np.linalg.norm(lab(a) - lab(b)) > 20.0, (a, b)


def test_region_colors_repeat_after_six():
    scenario = load_scenario("dense-field")
    own = {criterion.name: criterion.color for criterion in scenario.criteria}
    obstacles = [i for i, secondary in enumerate(scenario.regions, start=1) if secondary.criterion == "obstacle"]
    colors = [colors_of_regions(scenario)[i] for i in obstacles]
    assert colors[0] == colors[6] == own["obstacle"]
    assert len(set(colors)) == 6
