"""A vehicle's delay of commands, its DVL's position and delay, in runs by the deployable law."""

from pathlib import Path

import numpy as np
import pytest

import plant_fmu
from cosim.scenario.scenario import load_scenario
from tests.cosim.simulation.keep import kept_rows

pytestmark = pytest.mark.medium

SHIPPED = Path(plant_fmu.__file__).parent / "vehicles" / "bluerov2_heavy.toml"
OWN = "[sensors]\ndvl_position = [0.5, -0.3, 0.4]\ndelay = { dvl = 0.15 }\n"


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    file = tmp_path_factory.mktemp("vehicle") / "late.toml"
    file.write_text(SHIPPED.read_text().replace("[thrusters]\n", "[thrusters]\ndelay = 0.05\n") + OWN)
    given = ["sensing.through=sensors", "sensing.position_noise=0", "sensing.velocity_noise=0", "time.duration=12"]
    vehicle = [f'vehicle="{file}"', "actuation.through=thrusters", "time.step=0.01", "time.control=0.01"]
    lags = [f"plant.parameters.thrust_time_constant[{i}]=0" for i in range(1, 9)]
    return kept_rows(load_scenario("docking", [*given, *vehicle, *lags]))


def stack(kept, names):
    return np.column_stack([kept[name] for name in names])


def test_forces_begin_a_delay_after_their_commands(kept):
    asked, given = (stack(kept, [f"{x}[{i}]" for i in range(1, 9)]) for x in ("thrust", "thruster_force"))
    np.testing.assert_allclose(given[6:-1], asked[1:-6], atol=1e-9)
    assert np.ptp(asked, axis=0).max() > 5.0 and not given[:5].any()


def test_navigation_filter_knows_where_and_when_the_dvl_measures(kept):
    true, turns = stack(kept, [f"velocity.{a}" for a in "uvw"]), stack(kept, [f"velocity.{a}" for a in "pqr"])
    about = np.cross(turns, [0.5, -0.3, 0.4])
    late = kept["time"] - kept["measured.time.dvl"]
    assert np.abs(about).max() > 0.1 and late[500:].min() == pytest.approx(0.15, abs=0.011)
    error = stack(kept, [f"sensed.{a}" for a in "uvw"])[500:] - true[500:]
    assert np.sqrt(np.mean(np.square(error))) < 0.01
