"""V and its rate in the record, the summary and the report of a run."""

import numpy as np
import pytest

from cosim.errors import ScenarioError
from cosim.results.lyapunov_summary import summarize_lyapunov
from cosim.results.record import Rows, load_record
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from cosim.simulation.lyapunov_signals import FORMS
from cosim.simulation.signals import Column
from tests.cosim.simulation.keep import kept_rows

QUICK = ("arbiter.engine=closed", "record.lyapunov=true")
ALONE = ("regions=[]", "intersection=[]")


def run(*overrides, name="paper"):
    return kept_rows(load_scenario(name, [*QUICK, *overrides]))


def defect(kept, form, step):
    """Return the greatest difference of V's finite differences and the recorded rate, over the greatest rate."""
    rate = kept["lyapunov.rate"]
    between = 0.5 * (rate[1:] + rate[:-1])
    return np.abs(np.diff(kept[f"lyapunov.{form}"]) / step - between).max() / np.abs(rate).max()


@pytest.mark.slow
def test_v_of_the_paper_falls_below_zero_without_a_limit():
    """Measured independently of this project: from 86.4e3 to -129.5e3 at 0.124 s, without the secondary terms."""
    kept = run("time.duration=0.2")
    primary = kept["lyapunov.primary"]
    assert primary[0] == pytest.approx(86.4e3, rel=1e-3)
    assert primary[124] == pytest.approx(-129.5e3, rel=1e-3)
    # the first rise ends the fall, long before the goal
    assert np.flatnonzero(np.diff(primary) > 0.0)[0] == primary.argmin() == 125


def test_first_value_is_that_of_the_start():
    """13 f^2 of (32), and Gamma on the restoring parameters: the vehicle is at rest in the desired attitude."""
    kept = run("time.duration=0.01", *ALONE)
    phi = load_scenario("paper").true_restoring_parameters
    f = 8.0**2 + 4.0**2 - 0.5**2
    for form in FORMS:
        expected = 0.5 * (18.8 + 0.08 * 90.0) * f**2 + phi @ phi
        assert kept[f"lyapunov.{form}"][0] == pytest.approx(expected, rel=1e-12)
    # at rest W is what the pull to the goal does: sigma_p k_p1 |e_p|^2
    assert kept["lyapunov.rate"][0] == pytest.approx(-0.08 * 18.8 * (f * 2.0) ** 2 * 80.0, rel=1e-12)


@pytest.mark.slow
def test_rate_is_that_of_v_up_to_the_sampling():
    """Held control is the only difference: it shrinks with the step."""
    coarse = defect(run("time.duration=1.0", *ALONE), "normalized", 1e-3)
    fine = defect(
        run("time.duration=1.0", *(f"time.{key}=0.0001" for key in ("step", "control", "arbiter")), *ALONE),
        "normalized",
        1e-4,
    )
    assert fine == pytest.approx(0.1 * coarse, rel=0.1)
    assert coarse < 2e-3


@pytest.mark.medium
def test_rate_differs_from_v_outside_the_theory():
    """A limit on the force; weights that change (d alpha/dt neglected); gradients that are not 1 (as printed)."""
    strong = ("regions.SR1.gain=1e5", "regions.SR2.gain=1e5", "time.duration=0.3")
    assert defect(run("time.duration=1.0", *ALONE, "limit.force=108"), "normalized", 1e-3) > 0.3
    changing = run(*strong)
    assert defect(changing, "normalized", 1e-3) > 0.05
    constant = run(*strong, "regions=[]", "intersection=[]")
    assert defect(constant, "normalized", 1e-3) < 2e-3
    assert defect(changing, "printed", 1e-3) > 0.05


@pytest.mark.medium
def test_recording_lyapunov_changes_no_other_column(shipped_run):
    short = ("arbiter.engine=closed", "time.duration=1")
    without, with_v = (load_record(shipped_run("paper", *short, *more).folder) for more in ((), QUICK[1:]))
    assert set(with_v.units) - set(without.units) == {f"lyapunov.{name}" for name in (*FORMS, "rate")}
    for name in without.units:
        assert np.array_equal(without[name], with_v[name]), name


def test_summary_counts_increases_of_v():
    signals = {"time": np.arange(6) * 0.5, "lyapunov.rate": np.zeros(6)}
    signals |= {
        "lyapunov.printed": np.array([5.0, 4.0, 4.0, 4.5, 4.6, 1.0]),
        "lyapunov.normalized": np.array([5.0, 4.0, 3.0, -1.0, -1.0 + 1e-12, -2.0]),  # rises by rounding alone
        "lyapunov.primary": np.array([5.0, 4.0, 3.0, 2.0, 1.0, 0.0]),
    }
    summary = summarize_lyapunov(Rows([Column(name, "", "") for name in signals], signals))
    assert summary["printed"]["increases"] == 2
    assert summary["printed"]["first_rise"] == 1.0
    assert summary["printed"]["first_negative"] is None
    assert summary["normalized"]["increases"] == 0 and summary["normalized"]["first_rise"] is None
    assert summary["normalized"]["first_negative"] == 1.5
    assert summary["normalized"]["threshold"] == 5e-12
    assert summary["primary"] == {
        "start": 5.0, "end": 0.0, "least": 0.0, "threshold": 5e-12,
        "increases": 0, "first_rise": None, "first_negative": None,
    }  # fmt: skip


@pytest.mark.slow
def test_report_plots_the_lyapunov_function(tmp_path):
    scenario = load_scenario("paper", [*QUICK, "time.duration=0.4"])
    done = run_scenario(scenario, tmp_path / "run")
    assert done.summary["lyapunov"]["primary"]["first_negative"] == pytest.approx(0.03, abs=0.002)
    assert done.summary["lyapunov"]["primary"]["first_rise"] == 0.125
    assert (done.folder / "figures" / "lyapunov.svg").is_file()
    assert "dV/dt" in (done.folder / "report.html").read_text()


VIEW = "{type='visibility',feature=[9,0,5],camera_axis=[1,0,0],half_angle=0.5}"
LOOKING = f"{{name='view',criterion='shape',keep='in',gain=1,shape={VIEW}}}"


@pytest.mark.parametrize(
    ("overrides", "words"),
    [
        (("law.name=deployable", "law.gains={}", "actuation.through=thrusters"), "paper's law's"),
        ((f"regions=[{LOOKING}]", "intersection=[]"), r"knows no attitude in regions \(\['view'\]\)"),
        (("record.lyapunov=3",), r"record\.lyapunov"),
    ],
)
def test_undefined_lyapunov_function_is_rejected(overrides, words):
    with pytest.raises(ScenarioError, match=words):
        load_scenario("paper", [*QUICK, *overrides])
