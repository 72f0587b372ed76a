"""The example of a building's ventilation: what it finds, against values worked out by other means."""

import runpy
from pathlib import Path

import numpy as np
import pytest

EXAMPLE = Path(__file__).parents[2] / "examples" / "ventilation.py"


@pytest.fixture(scope="module")
def ran(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ventilation")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return runpy.run_path(str(EXAMPLE)) | {"folder": folder}


def smoothstep(h):
    return 3.0 * h**2 - 2.0 * h**3


def test_the_afternoon_belongs_to_the_room(ran):
    # smoke below 0.5 %/m asks for nothing; air asks to 0.25, the room to 0.75, of which the air leaves all
    assert ran["weights"] == pytest.approx((0.0, smoothstep(0.25), smoothstep(0.75)), abs=1e-15)


def test_the_explanation_tells_of_the_rule_that_gives_the_room_the_floor(ran):
    assert "temperature is hot" in str(ran["explanation"])


def test_the_rules_are_proved(ran):
    assert ran["verification"].ok


def test_the_day_is_that_of_the_priorities(ran):
    """By the definition of the weights, on numpy alone."""
    low, high = np.array([[0.5, 800.0, 24.0], [3.0, 1400.0, 28.0]])
    m = np.clip((ran["day"] - low) / (high - low), 0.0, 1.0)
    free = np.cumprod(np.ones_like(m), axis=1)
    free[:, 1:] = np.minimum.accumulate(1.0 - m, axis=1)[:, :-1]
    np.testing.assert_allclose(ran["day_weights"], smoothstep(np.minimum(free, m)), rtol=0.0, atol=1e-15)


def test_the_toast_takes_the_fan_and_gives_it_back(ran):
    leader, minutes = ran["leader"], ran["minutes"]
    smoke = minutes[leader == 0]
    assert smoke.min() == 850 and 855 < smoke.max() < 870
    assert (leader[: 8 * 60] == -1).all()
    assert (leader[9 * 60 : 12 * 60] == 1).all()


def test_the_picture_and_the_definition_are_there(ran):
    assert (ran["folder"] / "ventilation.png").read_bytes().startswith(b"\x89PNG")
    assert "present" in (ran["folder"] / "ventilation.toml").read_text()


def test_the_fan_s_speed_is_the_centroid_of_its_rules(ran):
    """By midpoints of two million strips."""
    n = 2_000_000
    y = (np.arange(n) + 0.5) * (100.0 / n)
    stale, hot = (1250.0 - 800.0) / 600.0, 0.5  # no smoke; 15 degrees outdoors are neither warm nor cold
    half = np.clip(np.minimum(y - 30.0, 70.0 - y) / 20.0, 0.0, stale)
    slow = np.clip(np.minimum(y, 40.0 - y) / 20.0, 0.0, min(1.0 - stale, 1.0 - hot))
    full = np.clip((y - 60.0) / 30.0, 0.0, 0.6 * hot)
    joined = np.maximum(half, np.maximum(slow, full))
    assert ran["fan_speed"] == pytest.approx((joined * y).sum() / joined.sum(), abs=1e-6)


def test_where_no_rule_fires_the_fan_runs_slowly(ran):
    hot_and_warm = {"smoke": 0.0, "co2": 500.0, "temperature": 30.0, "outdoors": 35.0}
    assert ran["speed"](hot_and_warm) == (20.0,)
