"""Tuning to data."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from fuzzy_arbiter import (
    Arbiter,
    ArbiterError,
    Constant,
    Linear,
    Output,
    System,
    Variable,
    auto_terms,
    curve,
    falling,
    fit,
    rising,
    trapezoid,
    triangle,
)

TIPS = (("low", triangle(0, 0, 13)), ("high", triangle(13, 25, 25)))
X = np.random.default_rng(0).uniform(0, 10, (60, 2))


def tipping(poor=(0, 5), low=13.0, mean=12.0, weight=1.0):
    """Return a system of triangles, Gaussians and a trapezoid."""
    service = Variable("service", (0, 10), {"poor": falling(*poor), "good": curve("s_shape", 3, 8)})
    food = Variable("food", (0, 10), {"bad": trapezoid(0, 0, 2, 6), "fine": curve("gaussian", 10, 3)})
    terms = {"low": triangle(0, 0, low), "middle": curve("gaussian", mean, 3), "high": triangle(13, 25, 25)}
    rules = (
        "if service is poor or food is bad then tip is low",
        f"if service is good then tip is middle with {weight}",
        "if service is good and food is fine then tip is high",
    )
    return System((service, food), (Output("tip", (0, 25), terms, default=0.0),), rules)


@pytest.mark.parametrize(
    ("free", "known"),
    [
        ("service.poor.*", {"service.poor.x1": 1.0, "service.poor.x2": 6.0}),
        (["tip.low.x2", "tip.middle.mean"], {"tip.low.x2": 11.0, "tip.middle.mean": 14.0}),
        ("R2.weight", {"R2.weight": 0.6}),
    ],
)
def test_parameters_behind_data_are_found(free, known):
    names = {"service.poor.x1": (1, 6), "tip.low.x2": 11.0, "R2.weight": 0.6}
    keys = {"service.poor.x1": "poor", "tip.low.x2": "low", "R2.weight": "weight"}
    changes = {keys[name]: names[name] for name in known if name in names} | ({"mean": 14.0} if len(free) == 2 else {})
    result = fit(tipping(), X, Arbiter(tipping(**changes)).batch(X)[:, 0], free=free)
    assert {name: after for name, (_, after) in result.parameters.items()} == pytest.approx(known, abs=1e-4)
    assert result.cost_after < 1e-9 < result.cost_before and result.converged
    before = Arbiter(tipping()).batch(X) - Arbiter(tipping(**changes)).batch(X)
    assert result.cost_before == pytest.approx(0.5 * (before**2).sum())
    assert f"cost {result.cost_before:.6g}" in str(result) and next(iter(known)) in str(result)


def test_values_are_found_as_linear_least_squares_finds_them():
    """Where the strengths are fixed, coefficients are a linear problem, which NumPy solves."""
    wind = Variable("wind", (0, 20), {"calm": falling(4, 8), "strong": rising(4, 8)})
    terms = {"full": Constant(9.0), "reefed": Linear((-0.25,), 8.0)}
    system = System([wind], [Output("sail", (0, 10), terms, defuzzifier="average")],
                    ["if wind is calm then sail is full", "if wind is strong then sail is reefed"])  # fmt: skip
    x = np.linspace(0, 20, 41)
    y, weight = np.sin(x / 4.0), 1.0 + x
    calm = np.clip((8.0 - x) / 4.0, 0.0, 1.0)
    matrix = np.column_stack([calm, (1.0 - calm) * x, 1.0 - calm]) * np.sqrt(weight)[:, None]
    expected = np.linalg.lstsq(matrix, y * np.sqrt(weight), rcond=None)[0]
    result = fit(system, {"wind": x}, y, free="sail.*", sample_weight=weight)
    assert [after for _, after in result.parameters.values()] == pytest.approx(expected.tolist(), rel=1e-6)
    assert list(result.parameters) == ["sail.full.value", "sail.reefed.wind", "sail.reefed.constant"]


@pytest.mark.medium
@pytest.mark.parametrize("seed", [2, 0, 1, 3])
def test_order_and_ranges_are_kept_whatever_the_data(seed):
    rng = np.random.default_rng(seed)
    system = tipping()
    low = Output("tip", (0, 25), {**dict(TIPS), "middle": triangle(4, 12, 20)}, default=0.0)
    extremes = {"pi": curve("pi_shape", 2, 4, 6, 8), "arc": curve("arc", 9, 3), "bell": curve("bell", 5, 2, 3)}
    food = Variable("food", (0, 10), {"bad": trapezoid(0, 2, 2, 6), "fine": rising(4, 4.5), **extremes})
    system = replace(system, inputs=(system.inputs[0], food), outputs=(low,))
    fixed = rng.choice(["food.bad.x2", "service.*", "tip.low.x1", "nothing"])
    result = fit(system, X[:12], rng.uniform(0, 25, 12), fixed=() if fixed == "nothing" else fixed)
    assert result.cost_after <= result.cost_before
    off = Arbiter(result.system).batch(X[:12])[:, 0]
    assert np.isfinite(off).all()
    after = {name: value for name, (_, value) in result.parameters.items()}
    for name, number in after.items():
        if name.endswith("weight"):
            assert 0.0 < number <= 1.0
        if name.endswith(("deviation", "width")):
            assert number > 0.0
    for first, second in (("poor.x1", "poor.x2"), ("good.start", "good.end")):
        known = {
            **{
                f"service.{k}": v
                for k, v in (("poor.x1", 0.0), ("poor.x2", 5.0), ("good.start", 3.0), ("good.end", 8.0))
            },
            **after,
        }
        assert known[f"service.{first}"] < known[f"service.{second}"]
    assert after["food.pi.foot1"] < after["food.pi.top1"] and after["food.pi.top2"] < after["food.pi.foot2"]
    assert after["food.arc.start"] > after["food.arc.end"]
    bad = [
        2.0 if name == "food.bad.x2" and name not in after else after[name]
        for name in ("food.bad.x1", "food.bad.x2", "food.bad.x3")
    ]
    assert bad == sorted(set(bad))


@pytest.mark.parametrize(
    ("arguments", "fault"),
    [
        ((X, X[:, 0]), None),
        ((X, X), r"y has the shape \(60, 2\), expected \(60, 1\)"),
        ((X, X[:, :1]), None),
        ((X, X[1:, 0]), r"y has the shape \(59,\)"),
        ((X, np.full(60, np.nan)), "y: got nan, expected finite numbers"),
        ((X, ["a"] * 60), "y: could not convert"),
        ((X * 2, X[:, 0]), "row 0: service is"),
        ((X, X[:, 0], {"free": "tips.*"}), "free: no parameter 'tips.*', expected some of service.poor.x1, "),
        ((X, X[:, 0], {"free": 3}), "free: got 3, expected patterns of names"),
        ((X, X[:, 0], {"fixed": ["*"]}), "free: got no parameter that is not fixed"),
        ((X, X[:, 0], {"sample_weight": -np.ones(60)}), "sample_weight: got -1.0, expected numbers that are not neg"),
    ],
)
def test_invalid_data_is_refused_in_one_line(arguments, fault):
    x, y, options = (*arguments, {"free": "R1.weight"})[:3]
    if fault is None:
        fit(tipping(), x, y, **options)
        return
    with pytest.raises(ArbiterError, match=fault):
        fit(tipping(), x, y, **options)


@pytest.mark.medium
def test_undefined_outputs_and_missing_scipy_are_named():
    system = tipping()
    undefined = replace(system, outputs=(replace(system.outputs[0], default=None),), rules=system.rules[1:2])
    with pytest.raises(ArbiterError, match="row 0: no rule fires for the output 'tip', expected a default"):
        fit(undefined, [[0.0, 0.0]], [1.0])
    code = (
        "import sys; sys.modules['scipy'] = None\n"
        "from fuzzy_arbiter import ArbiterError, fit\nfrom fuzzy_arbiter.criteria import prioritized\n"
        "try: fit(prioritized(), [[0, 0, 0]], [[0, 0, 0]])\nexcept ArbiterError as error: print(error)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout == "fit: SciPy is not installed, expected the extra fuzzy-arbiter[tune]\n"


def test_a_tuned_system_is_defined_wherever_it_was():
    x = Variable("x", (0, 1), {"hi": triangle(0.2, 0.6, 1.0), "b": trapezoid(0.52, 0.53, 1, 1)})
    y = Output("y", (0, 10), {"a": Constant(0.0), "b": Constant(10.0)}, defuzzifier="average")
    s = System((x,), (y,), ("if x is hi then y is a", "if x is b then y is b"))
    samples, wanted = [[0.55]] * 400 + [[0.5]], [10.0] * 400 + [0.0]
    result = fit(s, samples, wanted, free="x.hi.x1")
    off = Arbiter(result.system).batch(samples)[:, 0] - wanted
    assert result.cost_after == pytest.approx(0.5 * (off**2).sum()) and result.cost_after < result.cost_before


def test_an_input_with_the_name_of_a_number_is_refused():
    x = Variable("constant", (0, 1), auto_terms(["low", "high"]))
    y = Output("y", (0, 9), {"a": Linear((2.0,), 1.0)}, defuzzifier="average")
    with pytest.raises(ArbiterError, match="an input is named 'constant', expected another name"):
        fit(System((x,), (y,), ("if constant is low then y is a",)), [[0], [1]], [1, 3])
