"""Written files have the same meaning in other tools."""

import json
from dataclasses import replace

import numpy as np
import pytest

from fuzzy_arbiter import Output, Shape, System, Term, Variable, falling, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.engines.exact import ExactEngine
from fuzzy_arbiter.formats import FORMATS, fold_normalization, load, reads, writes
from tests.fuzzy_arbiter.formats.other_tools import DATA, TOOLS
from tests.fuzzy_arbiter.formats.systems import TIPPING

GOLDEN = json.loads((DATA / "tipping_centroids.json").read_text())
# of the universe's width: midpoints, trapezoids, and rectangles from the left, of 1000 points
WITHIN = {"pyfuzzylite": 1e-5, "octave": 1e-5, "jfuzzylogic": 1.01e-3}
NEEDED = {
    "pyfuzzylite": "pyfuzzylite is not installed, nor does FUZZY_LIBRARIES_PYTHON name a Python that has it",
    "octave": "Octave with its fuzzy-logic-toolkit is not installed",
    "jfuzzylogic": "Java is not installed, or JFUZZYLOGIC_CLASSPATH does not name jFuzzyLogic's classes",
}


def centroids(system, samples):
    return np.array([ExactEngine(replace(system, normalization="none")).centroids(sample) for sample in samples])


@pytest.mark.parametrize("format", FORMATS)
def test_committed_files_round_trip(format):
    path = DATA / f"tipping.{format}"
    assert load(path) == TIPPING
    text = path.read_text()
    assert text == writes(TIPPING, format)
    for foreign in (
        text.replace("\n", "\r"),
        text.replace("\n", "\r\n"),
        text.replace("\n", "  \n"),
        text.rstrip("\n"),
        "\ufeff" + text,
    ):
        assert reads(foreign, format) == TIPPING


@pytest.mark.parametrize(
    ("format", "edits"),
    [
        ("fll", [("  ", "\t"), ("Engine: tipping", "#by fuzzylite\n\nEngine: tipping\n  description: a: how much?"),
                 ("RuleBlock: rules", "RuleBlock:"), ("Ramp 5 10", "Ramp  5.000\t10.000   # shoulder")]),
        ("fcl", [("  ", "\t"), ("FUNCTION_BLOCK tipping", "/* a *tip* // in /\n*/\nfunction_block tipping // one"),
                 ("METHOD : COG;", "METHOD:COG ; // 'Center'"), ("(0 .. 25)", "(0.0..2.5E1)"),
                 ("IS medium;", "is medium with 1.0; (* the *) (* usual *)"), ("(0, 1) (5, 0)", "(0,1), (5,0)"),
                 ("quality IS poor OR", "(quality is poor) or")]),
        ("toml", [('"if quality is poor or service is poor', '"""IF quality IS poor or\n  service is poor'),
                  ('tip is low"', 'tip is low"""'), ("rules = [", "rules = [ # three\n"), ("25.0]", "2_5,\n]"),
                  ("[inputs.terms]\n", ""), ("\npoor", "\nterms.poor"), ("\naverage", "\nterms.average"),
                  ("\ngood", "\nterms.good")]),
        ("json", [("\n", ""), ("  ", ""), (": ", ":")]),
    ],
)  # fmt: skip
def test_layouts_by_hand_and_of_other_tools_read_alike(format, edits):
    text = (DATA / f"tipping.{format}").read_text()
    for old, new in edits:
        assert old in text
        text = text.replace(old, new)
    assert reads(text, format) == TIPPING


@pytest.mark.parametrize("tool", TOOLS)
def test_recorded_centroids_of_other_tools(tool):
    ours = centroids(TIPPING, GOLDEN["samples"])[:, 0]
    assert np.abs(ours - GOLDEN[tool]).max() <= 25 * WITHIN[tool]


grades = (Term("poor", triangle(0, 0, 5)), Term("good", triangle(1e-5, 5, 10)), Term("great", triangle(5, 10, 10)))
wild = Shape(((0, 0.2), (2, 0.2), (2, 0.8), (5, 0.1), (9, 1)))
kick = Output("kick", (-1, 1), (Term("no", falling(-0.5, 0.25)), Term("yes", rising(-0.25, 0.9))))
tip = (Term("low", triangle(0, 5, 10)), Term("high", trapezoid(20, 22, 25, 30)))
ALL_CAN_SAY = System(
    (
        Variable("service", (0, 10), grades),
        Variable("food", (0, 10.5), (Term("bad", trapezoid(0, 0, 1, 3)), Term("fine", rising(2, 9)))),
    ),
    (Output("tip", (0, 30), (*tip, Term("mid", triangle(10, 15, 20)))), kick),
    (
        "if service is poor or food is bad then tip is low and kick is yes",
        "if service is not great then tip is mid with 0.7",
        "if service is great or food is fine then tip is high and kick is no with 0.25",
        "if food is not bad then tip is mid and kick is no with 1e-05",
    ),
    normalization="none",
    points=1000,
)
WILD = replace(
    ALL_CAN_SAY,
    inputs=(ALL_CAN_SAY.inputs[0], Variable("food", (0, 10), (*ALL_CAN_SAY.inputs[1].terms, Term("odd", wild)))),
    outputs=(Output("tip", (0, 30), (*tip, Term("mid", Shape(((10, 0), (15, 0.7), (20, 0))))), default=7.5), kick),
    rules=(
        "if (service is poor or food is bad) and service is not good then tip is low and kick is yes",
        "if service is good and (food is odd or service is not not great) then tip is mid with 0.7",
        "if service is great or food is fine and food is odd then tip is high and kick is no with 0.25",
        "if food is fine or food is bad or service is poor then kick is yes with 0.5",
        "if food is not fine then kick is no",
    ),
)  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(
    "system",
    [
        ALL_CAN_SAY,
        replace(ALL_CAN_SAY, implication="prod"),
        WILD,
        replace(WILD, conjunction="prod", disjunction="probor"),
        prioritized(outside="clip", points=1000),
        fold_normalization(prioritized(points=1000)),
    ],
    ids=["plain", "scaled", "wild", "product", "prioritized", "natively"],
)
@pytest.mark.parametrize("tool", TOOLS)
def test_other_tools_give_the_same_centroids(tool, system, tmp_path, request):
    found, evaluate = TOOLS[tool]
    if not found():
        pytest.skip(NEEDED[tool])
    if tool == "octave" and ("wild" in request.node.name or "product" in request.node.name):
        pytest.skip("FIS cannot express this system")
    random = np.random.default_rng(5)
    low, high = np.array([v.universe for v in system.inputs]).T
    samples = random.uniform(low, high, (10, len(low))).tolist()
    theirs = np.array(evaluate(system, samples, tmp_path))
    width = np.array([v.universe[1] - v.universe[0] for v in system.outputs])
    assert (np.abs(centroids(system, samples) - theirs) / width).max() <= WITHIN[tool]
