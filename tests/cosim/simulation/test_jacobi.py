"""The order of a step: Jacobi is that of masters that exchange all values at once."""

from pathlib import Path

import numpy as np
import pytest

from cosim.scenario.scenario import load_scenario
from tests.cosim.simulation.keep import kept_rows
from tests.cosim.ssp.jacobi import jacobi as by_parts

ALL_SHAPES = Path(__file__).parents[1] / "ssp" / "all-shapes.toml"

SHORT = [
    'arbiter.engine="closed"', "time.duration=6.0", "time.step=0.01", "time.control=0.02", "time.arbiter=0.03",
    "limit.force=120.0",
]  # fmt: skip


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("scenario", [("paper", SHORT), (ALL_SHAPES, [])], ids=["paper", "all shapes"])
def test_jacobi_exchanges_values_at_the_end_of_each_step(scenario):
    name, settings = scenario
    loaded = load_scenario(name, [*settings, "master.order=jacobi"])
    kept = kept_rows(loaded)
    at = kept.signals.index("position.x")
    np.testing.assert_array_equal(kept.rows[:, at : at + 13], by_parts(loaded))
    at = kept.signals.index("weight.obstacle")
    assert kept.rows[:, at : at + 3].max() > 0.5


def test_jacobi_and_gauss_seidel_converge_with_the_step():
    def apart(step):
        given = [*SHORT[:2], *(f"time.{key}={step}" for key in ("step", "control", "arbiter")), SHORT[-1]]
        ends = []
        for order in ("gauss-seidel", "jacobi"):
            kept = kept_rows(load_scenario("paper", [*given, f'master.order="{order}"']))
            at = kept.signals.index("position.x")
            ends.append(kept.rows[-1, at : at + 3])
        return np.linalg.norm(ends[0] - ends[1])

    coarse, fine = apart(0.02), apart(0.005)
    assert fine > 1e-6
    assert coarse / fine == pytest.approx(4.0, rel=0.4)  # of first order in the step
