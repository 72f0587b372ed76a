"""Regions that move by their velocity or by external updates."""

import numpy as np
import pytest

from cosim.errors import RunError
from cosim.scenario.scenario import load_scenario
from cosim.simulation.environment import RegionEnvironment
from cosim.simulation.master import Master
from tests.cosim.simulation.keep import Keep

PERIODS = ["time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "time.duration=1.0"]
SHORT = ["arbiter.engine=closed", "law.gains.k_p1=0.001", *PERIODS]


def run(*overrides, before=None, observer=None):
    with Master(load_scenario("paper", [*SHORT, *overrides])) as master:
        kept = Keep(master)
        if before:
            before(master)
        observers = [kept, observer(master)] if observer else [kept]
        master.run(observers)
    return kept


def position(kept):
    return np.column_stack([kept[f"position.{a}"] for a in "xyz"])


def shift(kept, name):
    return np.column_stack([kept[f"{name}.shift.{a}"] for a in "xyz"])


def test_given_velocities_move_regions_and_goal():
    kept = run("regions.SR1.velocity=[0.5,-0.2,0.1]", "goal.velocity=[0.0,0.3,0.0]")
    t = kept["time"][:, None]
    assert shift(kept, "SR1") == pytest.approx(t * [0.5, -0.2, 0.1], abs=1e-15)
    for name, center in (("SR1", (2.0, 0.0, 1.8)), ("goal", (8.0, 0.0, 5.0))):
        distance = np.linalg.norm(position(kept) - center - shift(kept, name), axis=1) - 0.5
        assert kept[f"{name}.clearance"] == pytest.approx(distance if name == "SR1" else -distance, abs=1e-12)


def test_a_region_at_rest_has_no_shift():
    kept = run("regions.SR1.velocity=[0.5,0,0]")
    assert [c.name for c in kept.signals.columns if ".shift." in c.name] == [f"SR1.shift.{a}" for a in "xyz"]


class Leader:
    """Move a region along a circle by the given time."""

    def __init__(self, master, name):
        self.master, self.name = master, name

    def observe(self, k, row):
        t = 0.01 * (k + 1)  # when the next step begins
        self.master.move_region(self.name, self.place(t), self.speed(t))

    @staticmethod
    def place(t):
        return np.array([np.sin(t), 1.0 - np.cos(t), 0.0])

    @staticmethod
    def speed(t):
        return np.array([np.cos(t), np.sin(t), 0.0])


@pytest.mark.parametrize("name", ["goal", "SR2"])
def test_streamed_region_is_at_its_streamed_position(name):
    key = "goal.streamed=true" if name == "goal" else "regions.SR2.streamed=true"
    kept = run(key, observer=lambda master: Leader(master, name))
    assert shift(kept, name) == pytest.approx(np.array([Leader.place(t) for t in kept["time"]]), abs=1e-12)


def test_streamed_region_extrapolates_its_velocity():
    """Before the run, with a velocity: from then on that is its motion, which the law receives."""
    masters = []

    def move(master):
        master.move_region("SR2", [1.0, 0.0, 0.0], [0.0, 0.5, 0.0])
        masters.append(master)

    kept = run("regions.SR2.streamed=true", before=move)
    expected = [1.0, 0.0, 0.0] + kept["time"][:, None] * [0.0, 0.5, 0.0]
    assert shift(kept, "SR2") == pytest.approx(expected, abs=1e-12)
    assert list(masters[0].environment.regions.velocities[1]) == [0.0, 0.5, 0.0]


@pytest.mark.parametrize(
    ("name", "to", "velocity", "words"),
    [
        ("SR1", [0, 0, 0], [0, 0, 0], r"'SR1' cannot be moved, expected a streamed one: goal, SR2"),
        ("SR7", [0, 0, 0], [0, 0, 0], r"'SR7' cannot be moved"),
        ("SR2", [0, 0], [0, 0, 0], "three finite numbers"),
        ("SR2", [0, 0, 0], [0, np.nan, 0], "three finite numbers"),
    ],
)
def test_invalid_region_moves_are_rejected_by_name(name, to, velocity, words):
    streamed = ["goal.streamed=true", "regions.SR2.streamed=true", "regions.SR1.velocity=[1,0,0]"]
    with Master(load_scenario("paper", [*SHORT, *streamed])) as master, pytest.raises(RunError, match=words):
        master.move_region(name, to, velocity)


def test_position_uncertainty_adds_in_quadrature():
    environment = RegionEnvironment(load_scenario("pipe-inspection"))
    environment._deviations[1] = 0.3
    environment.inflate_position_uncertainty(0.4)
    assert environment.regions.deviations[1] == pytest.approx([0.5] * 3)
    assert environment.regions.deviations[2] == pytest.approx([0.4] * 3)
    environment.inflate_position_uncertainty(0.0)
    assert environment.regions.deviations[:2] == pytest.approx(np.array([[0.0] * 3, [0.3] * 3]))


def test_a_target_is_where_it_moves_also_between_steps():
    scenario = load_scenario("paper", [*SHORT, "commands.enabled=true", "goal.streamed=true"])
    with Master(scenario) as master:
        environment = master.environment
        environment.set_target((1.0, 2.0, 3.0), 0.5, (1.0, 0.0, 0.0), 0.0)
        for k in range(6):
            master.step(k)
        assert environment.target == pytest.approx([1.05, 2.0, 3.0])
        master.move_region("goal", [5.0, 0.0, 0.0], [0.0, 0.0, 0.0])  # of the scenario, which waits
        assert environment.target == pytest.approx([1.05, 2.0, 3.0])
        environment.set_target((1.0, 2.0, 3.0), 0.5, (1.0, 0.0, 0.0), 0.05)
        assert environment.target == pytest.approx([1.0, 2.0, 3.0])
        environment.restore_target(0.06)
        assert environment.target == pytest.approx(np.add(scenario.goal.center, [5.0, 0.0, 0.0]))
