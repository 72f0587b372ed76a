"""Pictures show the arbiter's numbers and change no global state."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from fuzzy_arbiter import (
    Arbiter,
    Constant,
    Linear,
    Output,
    System,
    Term,
    Variable,
    curve,
    falling,
    pictures,
    rising,
    trapezoid,
    triangle,
)
from fuzzy_arbiter.criteria import SECTION_VI, Criterion
from fuzzy_arbiter.errors import DefinitionError, InputError
from fuzzy_arbiter.pictures.style import color, hatch, line_style, wrapped
from tests.fuzzy_arbiter.formats.systems import RICHER

MEASURED = (
    Criterion("distance to the nearest obstacle ahead", membership=falling(0.0, 5.0)),
    *(Criterion(f"criterion_{i}") for i in range(5)),
)
SAIL = System(
    inputs=(
        Variable("wind", (0, 20), {"calm": falling(2, 6), "fresh": trapezoid(4, 6, 9, 12)}),
        Variable("waves", (0, 4), {"low": falling(1, 2), "high": rising(1, 3)}),
    ),
    outputs=(
        Output("sail", (0, 100), {"half": triangle(30, 50, 70), "full": trapezoid(60, 80, 100, 100)}),
        Output("keel", (0, 50), {"up": triangle(0, 20, 40), "down": rising(10, 20)}),
    ),
    rules=(
        "if wind is calm then sail is full and keel is up",
        "if wind is fresh or waves is high then sail is half and keel is down with 0.7",
    ),
    normalization="range",
)


@pytest.fixture(scope="module")
def arbiter():
    return Arbiter(engine="exact")


@pytest.fixture(scope="module")
def sail():
    return Arbiter(SAIL, engine="exact")


def drawn(ax):
    ax.figure.draw_without_rendering()
    return ax


def everything(arbiter):
    """One of each picture, as functions of the axes."""
    system = arbiter.system
    first, second = (v.name for v in system.inputs[:2])
    middle, output = [sum(v.universe) / 2 for v in system.inputs], system.outputs[0].name
    yield lambda ax=None: pictures.terms(arbiter, first, ax=ax)
    yield lambda ax=None: pictures.profile(arbiter, first, ax=ax)
    yield lambda ax=None: pictures.rules(arbiter, middle, ax=ax)
    yield lambda ax=None: pictures.surface(arbiter, output, (first, second), ax=ax, points=11)
    yield lambda ax=None: pictures.decisions(arbiter, (first, second), ax=ax, points=11)


@pytest.mark.medium
@pytest.mark.parametrize("criteria", [SECTION_VI, pytest.param(MEASURED, marks=pytest.mark.slow)], ids=["three", "six"])
def test_every_picture_draws_on_new_axes_or_on_those_given_and_changes_no_global_state(criteria):
    arbiter = Arbiter(criteria, engine="exact")
    for draw in everything(arbiter):
        assert isinstance(drawn(draw()).figure, Figure)
        ax = Figure().add_subplot()
        assert draw(ax) is ax
    import matplotlib.pyplot as plt

    assert plt.get_fignums() == []


@pytest.mark.medium
def test_package_imports_without_matplotlib():
    code = (
        "import sys; sys.modules['matplotlib'] = None\n"
        "from fuzzy_arbiter import Arbiter, pictures\n"
        "try: pictures.terms(Arbiter(engine='exact'), 'obstacle')\n"
        "except ArbiterError as error: print(error)\n"
        "try: pictures.decisions(Arbiter(), ('obstacle', 'shape'))\n"
        "except ArbiterError as error: print(error)\n"
        "from fuzzy_arbiter.__main__ import main\n"
        "main(['plot', 'section-vi', 'terms', '--out', 'no.png'])"
    ).replace("import Arbiter", "import Arbiter, ArbiterError")
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    line = "pictures: Matplotlib is not installed, expected the extra fuzzy-arbiter[plot]"
    assert done.stdout.splitlines() == [line, line]
    assert done.stderr == f"fuzzy_arbiter: {line}\n"


LONE = replace(SAIL, outputs=SAIL.outputs[:1], rules=("if wind is calm then sail is full",))
AXES = ("obstacle", "shape")
INPUTS, OUTPUTS = (
    "'speed', expected one of obstacle, shape, depth",
    "no output 'beta', expected one of obstacle, shape, depth",
)


@pytest.mark.parametrize(
    ("draw", "error", "fault"),
    [
        (lambda a: pictures.terms(a, "speed"), DefinitionError, INPUTS),
        (lambda a: pictures.profile(a, "speed"), DefinitionError, INPUTS),
        (lambda a: pictures.profile(a, "obstacle", {"speed": 1.0}), DefinitionError, INPUTS),
        (lambda a: pictures.surface(a, "alpha_1", ("obstacle", "speed")), DefinitionError, INPUTS),
        (lambda a: pictures.decisions(a, ("speed", "depth")), DefinitionError, INPUTS),
        (lambda a: pictures.rules(a, [0, 0, 0], "beta"), DefinitionError, OUTPUTS),
        (lambda a: pictures.surface(a, "beta", AXES), DefinitionError, OUTPUTS),
        (lambda a: pictures.decisions(a, ("obstacle", "obstacle")), DefinitionError, "appears twice"),
        (lambda a: pictures.surface(a, "alpha_1", AXES, {"shape": 0.2}), DefinitionError, "the picture goes over it"),
        (lambda a: pictures.surface(a, "alpha_1", AXES[:1]), DefinitionError, "names of two inputs"),
        (lambda a: pictures.profile(a, "obstacle", {"depth": 2.0}), InputError, r"depth: input is 2\.0"),
        (lambda a: pictures.terms(a, "obstacle", at=2.0), InputError, r"obstacle: position is 2\.0"),
        (
            lambda a: pictures.decisions(Arbiter(LONE), ("wind", "waves")),
            DefinitionError,
            "two or more to decide",
        ),
    ],
)
def test_invalid_arguments_are_rejected(arbiter, draw, error, fault):
    with pytest.raises(error, match=fault):
        draw(arbiter)


def test_terms_are_drawn_corner_by_corner(sail):
    lines = {line.get_label(): line.get_xydata() for line in pictures.terms(sail, "wind").get_lines()}
    assert lines["calm"].tolist() == [[0, 1], [2, 1], [6, 0], [20, 0]]
    assert lines["fresh"].tolist() == [[0, 0], [4, 0], [6, 1], [9, 1], [12, 0], [20, 0]]


def test_many_terms_have_distinct_styles():
    lines = {(style["color"], str(style["linestyle"])) for style in map(line_style, range(36))}
    assert len(lines) == 36
    assert len({(color(i), hatch(i)) for i in range(36)}) == 36


def test_a_legend_is_no_wider_than_its_axes(arbiter):
    levels = Variable("level", (0, 7), tuple(Term(f"step number {i}", triangle(i - 1, i, i + 1)) for i in range(8)))
    many = replace(SAIL, inputs=(levels, *SAIL.inputs[1:]), rules=("if waves is low then sail is full",))
    ax = Figure(figsize=(10.0, 6.0)).add_subplot(2, 3, 1)
    legend = drawn(pictures.terms(Arbiter(many, engine="exact"), "level", ax=ax)).get_legend()
    assert legend.get_window_extent().width < 1.1 * ax.bbox.width
    texts = wrapped("the first = 1, the second = 2, the third = 3", 16).split("\n")
    assert not any(text.startswith("=") or text.endswith("=") for text in texts)


def test_a_profile_has_a_gap_where_an_output_is_undefined_and_jumps_to_a_default(sail):
    x, y = pictures.profile(sail, "wind", {"waves": 0.5}).get_lines()[0].get_data()
    assert np.isnan(y[x > 12.0]).all() and np.isfinite(y[x < 12.0]).all()
    outputs = tuple(replace(output, default=0.0) for output in SAIL.outputs)
    raw = Arbiter(replace(SAIL, outputs=outputs, normalization="none"))
    x, y = pictures.profile(raw, "wind", {"waves": 0.5}).get_lines()[0].get_data()
    (jump,) = np.flatnonzero(np.abs(np.diff(y)) > 10.0)[-1:]
    assert x[jump + 1] - x[jump] < 1e-6 and x[jump] == pytest.approx(12.0)


def texts(ax):
    return [text.get_text() for text in (*ax.texts, *ax.get_yticklabels(), ax.title, ax._right_title)]


def test_rules_picture_shows_strength_term_and_deciding_rule(arbiter):
    ax = pictures.rules(arbiter, [0.3, 0.8, 0.6], "alpha_2")
    said = texts(ax)
    assert "R3: if obstacle is exist" in said and "R4: if shape is simple" in said
    assert "0.300 low •" in said and "0.200 low" in said and "0.700 high •" in said
    # exactly 1/3 + h^2 - 2/3 h^3 at h = 0.7
    assert "centroid 0.5947" in said
    assert any(text.endswith("alpha_2 = 0.784") for text in said)


@pytest.mark.medium
def test_rules_picture_omits_idle_rules_of_large_systems():
    criteria = [Criterion(name) for name in "abcd"]
    complete = Arbiter(criteria, form="complete", engine="exact")
    assert [text for text in texts(pictures.rules(complete, [1, 0, 1, 1])) if text.startswith("R")] == [
        "R17: if a is on and b is off and c is on and d is\non"
    ]
    assert len([text for text in texts(pictures.rules(complete, [0.5] * 4)) if text.startswith("R")]) == 10
    assert any("(6 rules not drawn)" in text for text in texts(pictures.rules(complete, [0.5] * 4)))


def test_rules_picture_reports_that_no_rule_fires(sail):
    said = texts(pictures.rules(sail, [15.0, 0.5], "sail"))
    assert any(text.endswith("sail: no rule fires") for text in said)
    with_default = replace(SAIL, outputs=(replace(SAIL.outputs[0], default=72.0), SAIL.outputs[1]))
    other = Arbiter(with_default, engine="exact")
    said = texts(pictures.rules(other, [15.0, 0.5], "sail"))
    weight = other([15.0, 0.5])["sail"]
    assert "default 72" in said and any(text.endswith(f"sail = {weight:.4g}") for text in said)


def test_a_surface_holds_the_weights_also_as_a_relief(arbiter, sail):
    filled = pictures.surface(arbiter, "alpha_2", AXES, {"depth": 0.0}, points=11).collections[0]
    assert filled.zmax == pytest.approx(arbiter([0.0, 1.0, 0.0])[1]) and filled.zmin == pytest.approx(0.0)
    for shown, output, over in ((arbiter, "alpha_2", AXES), (sail, "sail", ("wind", "waves"))):
        ax = Figure().add_subplot(projection="3d")
        drawn(pictures.surface(shown, output, over, ax=ax, points=11))
        assert (ax.get_xlabel(), ax.get_ylabel(), ax.get_zlabel()) == (*over, output)
        assert ax.get_zlim()[0] <= 0.0 and ax.get_zlim()[1] >= 0.8


def test_flat_surface_is_labeled_with_text(arbiter, sail):
    ax = pictures.surface(arbiter, "alpha_3", ("shape", "depth"), {"obstacle": 1.0}, points=11)
    assert "alpha_3 = 0 everywhere" in texts(ax)
    narrow = replace(SAIL, rules=("if wind is calm and not wind is calm then sail is full and keel is up",))
    crisp = replace(narrow, inputs=(replace(SAIL.inputs[0], universe=(10, 20)), SAIL.inputs[1]))
    ax = pictures.surface(Arbiter(crisp, engine="exact"), "sail", ("wind", "waves"), points=11)
    assert "undefined everywhere" in texts(ax)


def keys(ax):
    return [text.get_text() for text in ax.get_legend().get_texts()]


def test_decision_legend_lists_present_regions(arbiter, sail):
    assert keys(pictures.decisions(arbiter, ("obstacle", "shape"), {"depth": 0.4})) == ["obstacle", "shape", "depth"]
    assert keys(pictures.decisions(arbiter, ("obstacle", "shape"), {"depth": 0.0})) == ["obstacle", "shape"]
    assert keys(pictures.decisions(arbiter, ("shape", "depth"), {"obstacle": 1.0})) == ["obstacle"]
    six = Arbiter(MEASURED, engine="exact")
    at = {f"criterion_{i}": 0.5 for i in range(1, 5)}
    assert keys(pictures.decisions(six, ("distance to the nearest obstacle ahead", "criterion_0"), at))[-1] == "shared"
    assert keys(pictures.decisions(sail, ("wind", "waves"))) == ["sail", "keel", "undefined"]


def test_a_decision_is_that_of_the_greatest_weight(arbiter):
    """The border between two regions is where their weights are equal."""
    ax = pictures.decisions(arbiter, AXES, {"depth": 0.4})
    borders = [c for c in ax.collections if len(c.get_facecolor()) == 0 or not c.get_facecolor().any()]
    points = np.vstack([path.vertices for border in borders for path in border.get_paths()])
    points = points[((points > 0.02) & (points < 0.98)).all(axis=1)]
    weights = np.sort(arbiter.batch(np.column_stack([points, np.full(len(points), 0.4)])))
    assert len(points) > 50 and (weights[:, 2] - weights[:, 1]).max() < 0.01


def test_curves_and_values_are_drawn():
    system = RICHER["fll"]
    arbiter = Arbiter(system)
    for name in ("quality", "mood"):
        ax = pictures.terms(arbiter, name)
        variable = next(v for v in (*system.inputs, *system.outputs) if v.name == name)
        for line, term in zip(ax.get_lines(), variable.terms, strict=True):
            x, y = line.get_data()
            assert y == pytest.approx(term.shape.of_many(np.asarray(x)), abs=1e-12)


def test_values_are_drawn_as_stems_or_by_their_range_and_rules_of_any_join():
    wind = Variable("wind", (0, 20), {"calm": falling(4, 8), "strong": rising(4, 8)})
    terms = {"full": Constant(12.0), "reefed": Linear((-0.25,), 8.0)}
    outputs = (
        Output("sail", (0, 10), terms, defuzzifier="average"),
        Output("heel", (0, 9), {"up": rising(0, 9)}, None, "sum"),
    )
    rules = ("if wind is calm then sail is full and heel is up", "if wind is strong then sail is reefed")
    arbiter = Arbiter(System((wind,), outputs, rules))
    stem, span, ramp = (
        line.get_xdata() for name in ("sail", "heel") for line in pictures.terms(arbiter, name).get_lines()
    )
    assert set(stem) == {12.0} and (min(span), max(span)) == (3.0, 8.0) and set(ramp) == {0.0, 9.0}
    ax = pictures.rules(arbiter, [6.0], "sail")
    stems = [line.get_xdata() for line in ax.get_lines() if len(set(line.get_xdata())) == 1]
    assert {12.0, 6.5, arbiter([6.0])[0]} <= {x for line in stems for x in line}
    assert "average 9.25" in texts(ax) and ax.get_xlim() == (0.0, 12.0)
    for name, implication in (("probor", "einstein_product"), ("sum", "prod"), ("bounded_sum", "min")):
        tip = Output("tip", (0, 25), {"low": curve("gaussian", 8, 4), "high": triangle(5, 20, 25)}, aggregation=name)
        ruled = ("if wind is calm then tip is low", "if wind is any then tip is high with 0.5")
        arbiter = Arbiter(System((wind,), (tip,), ruled, implication=implication))
        ax = pictures.rules(arbiter, [6.0])
        (joined,) = (line.get_xydata() for line in ax.get_lines() if line.get_linewidth() == 1.8)
        x, heights = joined[:, 0], joined[:, 1].max() - joined[:, 1]
        assert (x * heights).sum() / heights.sum() == pytest.approx(arbiter([6.0])[0], abs=0.1)


def test_former_spellings_warn_and_work():
    import fuzzy_arbiter

    with pytest.warns(DeprecationWarning, match="COLOURS is now COLORS"):
        assert fuzzy_arbiter.pictures.COLOURS is fuzzy_arbiter.pictures.COLORS
    for name in ("prioritised", "prioritized", "Criterion", "SECTION_VI", "HysteresisArbiter", "ramp"):
        new = name.replace("ised", "ized")
        with pytest.warns(DeprecationWarning, match=f"fuzzy_arbiter.{name} is now fuzzy_arbiter.criteria.{new}"):
            assert getattr(fuzzy_arbiter, name) is getattr(fuzzy_arbiter.criteria, new)
