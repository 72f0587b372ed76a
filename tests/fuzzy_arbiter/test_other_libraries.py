"""Other libraries give the same weights within their own numerical error."""

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest

from fuzzy_arbiter import Arbiter
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.engines.scikit import ScikitEngine
from tests.fuzzy_arbiter import reference
from tests.fuzzy_arbiter.engines.test_scikit import TIP, TIPPING

DATA = Path(__file__).parents[1] / "data" / "fuzzy" / "libraries"
SYSTEMS = {"section_vi": prioritized(normalization="none"), "tipping": TIPPING}
# greatest error, as a part of the universe, for a step of 1 / resolution: a sum at the middles of cells is of second
# order, a sum that gives both ends the weight of the other places of first order
BOUNDS = {
    ("pyfuzzylite", "section_vi"): lambda step: step**2 / 6,
    ("pyfuzzylite", "tipping"): lambda step: step**2 / 2,
    ("simpful", "section_vi"): lambda step: step / 2,
    ("simpful", "tipping"): lambda step: step / 2,
}
TABLES = sorted(BOUNDS)


def table(library, system):
    return json.loads((DATA / f"{system}_{library}.json").read_text())


@pytest.mark.parametrize(("library", "system"), TABLES)
def test_other_libraries_match_within_their_error(library, system):
    kept = table(library, system)
    ours = Arbiter(SYSTEMS[system], engine="exact").batch(kept["inputs"])
    low, high = SYSTEMS[system].outputs[0].universe
    errors = {}
    for resolution, theirs in kept["outputs"].items():
        errors[resolution] = np.abs(ours - theirs).max() / (high - low)
        assert errors[resolution] <= BOUNDS[library, system](1 / int(resolution)) + 1e-12
    # with ten times the places they come nearer as their order says, and to our value only
    order = {"pyfuzzylite": 2, "simpful": 1}[library]
    assert errors["100"] / errors["1000"] == pytest.approx(10**order, rel=0.1)


@pytest.mark.parametrize("system", SYSTEMS)
def test_grid_engine_sums_as_simpful_does(system):
    kept = table("simpful", system)
    for resolution, theirs in kept["outputs"].items():
        ours = Arbiter(replace(SYSTEMS[system], points=int(resolution)), engine="grid").batch(kept["inputs"])
        assert ours == pytest.approx(np.array(theirs), abs=1e-12)


@pytest.mark.medium
@pytest.mark.parametrize(("library", "system"), TABLES)
def test_recorded_tables_match_the_libraries(library, system):
    peers = pytest.importorskip("benchmarks.fuzzy", reason="a source distribution holds no benchmarks")
    python = peers.interpreter(library)
    if python is None:
        pytest.skip(f"{library} is not installed, and {peers.OTHER_PYTHON} names no Python that has it")
    kept = table(library, system)
    answer = peers.ask(python, library=library, system=system, resolution=100, inputs=kept["inputs"])
    assert answer["text"].splitlines() == kept["text"]
    assert np.abs(np.subtract(answer["outputs"], kept["outputs"]["100"])).max() <= 1e-12


def test_the_tip_of_scikit_fuzzys_example():
    """Quality 6.5, service 9.8: the documentation says 19.8476 at 26 points, other tools up to 19.9525."""
    exact = Fraction(12118694, 610275)
    assert reference.centroid(TIP, [0, Fraction(1, 25), Fraction(24, 25)]) == exact
    rounding = 16 * np.finfo(float).eps  # moment over area, each the sum of a few parts above zero
    assert Arbiter(TIPPING, engine="exact")([6.5, 9.8])[0] == pytest.approx(float(exact), rel=rounding)
    theirs = {points: ScikitEngine(replace(TIPPING, points=points)).centroids([6.5, 9.8])[0] for points in (26, 251)}
    assert theirs == pytest.approx({26: 19.847607, 251: 19.857694}, abs=5e-7)


def test_every_library_is_compared():
    peers = pytest.importorskip("benchmarks.peers.fuzzy_libraries", reason="a source distribution holds no benchmarks")
    assert {library for library, _ in TABLES} == set(peers.LIBRARIES)
    assert {f"{system}_{library}.json" for library, system in TABLES} == {path.name for path in DATA.glob("*.json")}
