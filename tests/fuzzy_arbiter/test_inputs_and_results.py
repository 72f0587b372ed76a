"""Inputs by position, by name and in tables; results by name; terms by name; files read with other settings."""

import copy
import math
import pickle
from dataclasses import replace
from decimal import Decimal
from fractions import Fraction

import numpy as np
import pytest

import fuzzy_arbiter
from fuzzy_arbiter import (
    Arbiter,
    ArbiterError,
    Constant,
    Formula,
    Linear,
    Operators,
    Output,
    Result,
    Rule,
    System,
    Variable,
    auto_terms,
    curve,
    falling,
    rising,
    triangle,
)
from fuzzy_arbiter.criteria import Criterion, prioritized
from fuzzy_arbiter.errors import DefinitionError, FormatError, InputError
from fuzzy_arbiter.formats import FORMATS, reads, writes

EXACT = float(Fraction(12118694, 610275))  # of the tip at service 9.8, food 6.5
SERVICE = Variable("service", (0, 10), auto_terms(3))
FOOD = Variable("food", (0, 10), auto_terms(3))
TIP = Output("tip", (0, 25), {"low": triangle(0, 0, 13), "medium": triangle(0, 13, 25), "high": triangle(13, 25, 25)})
RULES = (
    "if service is poor or food is poor then tip is low",
    "if service is average then tip is medium",
    "if service is good or food is good then tip is high",
)
TIPPING = System((SERVICE, FOOD), (TIP,), RULES)
ROWS = [[9.8, 6.5], [3.0, 8.0], [0.0, 0.0]]


def pandas():
    return pytest.importorskip("pandas")


@pytest.fixture
def tipping():
    return Arbiter(TIPPING)


def test_systems_return_quantities_and_prioritized_criteria_return_shares(tipping):
    assert tipping([9.8, 6.5])[0] == pytest.approx(EXACT, abs=1e-13)
    for text in (writes(TIPPING, "toml").replace('normalization = "none"\n', ""), '{"criteria": [{"name": "a"}]}'):
        system = reads(text, "json" if text.startswith("{") else "toml")
        assert system.normalization == ("range" if text.startswith("{") else "none")
    assert prioritized().normalization == Arbiter().system.normalization == "range"


@pytest.mark.parametrize(
    "sample",
    [(9.8, 6.5), {"food": 6.5, "service": 9.8}, np.array([9.8, 6.5])],
)
def test_samples_are_accepted_in_any_documented_form(tipping, sample):
    assert tipping(sample) == tipping(service=9.8, food=6.5) == tipping([9.8, 6.5])
    assert tipping.centroids(sample) == tipping.centroids(food=6.5, service=9.8)
    assert tipping.explain(sample) == tipping.explain(food=6.5, service=9.8)


def test_results_are_named_tuples(tipping):
    result = tipping(service=9.8, food=6.5)
    assert isinstance(result, Result) and isinstance(result, tuple)
    assert result["tip"] == result.tip == result[0] == result[-1]
    (tip,) = result
    assert tip == pytest.approx(EXACT, abs=1e-13)
    assert (result == (tip,), hash(result) == hash((tip,)), result[:1]) == (True, True, (tip,))
    assert result._asdict() == {"tip": tip} and result._fields == ("tip",)
    assert repr(result) == f"Result(tip={tip!r})"
    for other in (pickle.loads(pickle.dumps(result)), copy.deepcopy(result)):
        assert other == result and other["tip"] == tip and repr(other) == repr(result)
    with pytest.raises(DefinitionError, match="no output 'tp', expected one of tip"):
        result["tp"]
    with pytest.raises(AttributeError, match="no output 'tp', expected one of tip"):
        result.tp  # noqa: B018


def test_weights_go_by_the_names_of_the_criteria(tmp_path):
    arbiter = Arbiter([Criterion("obstacle"), Criterion("shape"), Criterion("depth"), Criterion("visibility")])
    sample = {"obstacle": 0.1, "shape": 0.0, "depth": 0.2, "visibility": 0.9}
    weights = arbiter(sample)
    assert weights._fields == ("obstacle", "shape", "depth", "visibility")
    assert weights["visibility"] == weights[3] == max(weights)
    explanation = arbiter.explain(sample)
    assert (explanation.winner, explanation.runner_up) == ("visibility", "depth")
    assert explanation.result["visibility"] == weights["visibility"]
    assert (explanation.outputs[3].name, explanation.outputs[3].variable) == ("visibility", "alpha_4")
    assert "visibility (alpha_4)" in str(explanation)
    for suffix in FORMATS:
        arbiter.save(tmp_path / f"a.{suffix}")
        assert Arbiter.load(tmp_path / f"a.{suffix}").explain(sample).winner == "visibility"


@pytest.mark.parametrize("names", ["a", ("a",), ("a", "a", "b"), ("a", "b", ""), (1, 2, 3)])
def test_names_of_weights_are_one_for_each_output(names):
    with pytest.raises(DefinitionError, match="weights_of"):
        replace(prioritized(), weights_of=names)


@pytest.mark.parametrize("format", ["fcl", "fis", "fll"])
def test_weight_names_may_hold_comment_syntax(format):
    system = replace(prioritized(), weights_of=("a, b", "c = d", "fuzzy_arbiter: points = 7"))
    assert reads(writes(system, format), format) == system
    with pytest.raises(ArbiterError, match="weights_of"):
        writes(replace(system, weights_of=("a *)", "b", "c")), format)
    for said in ("weights_of = obstacle", 'weights_of = ""', "weights_of = "):
        text = writes(prioritized(), format).replace('weights_of = "obstacle" "shape" "depth"', said)
        with pytest.raises(FormatError, match="line 1"):
            reads(text, format)


@pytest.mark.parametrize(
    "table",
    [
        {"food": [6.5, 8.0, 0.0], "service": np.array([9.8, 3.0, 0.0])},
        np.array([(6.5, 1, 9.8), (8, 2, 3), (0, 3, 0)], dtype=[("food", "f4"), ("n", "i4"), ("service", "f8")]),
    ],
)
def test_batch_columns_are_named_in_input_and_result(tipping, table):
    rows = tipping.batch(ROWS)
    assert type(rows) is np.ndarray and rows.shape == (3, 1)
    columns = tipping.batch(table)
    assert isinstance(columns, Result) and columns["tip"].tolist() == columns[0].tolist() == rows[:, 0].tolist()
    assert [tipping(row)["tip"] for row in ROWS] == pytest.approx(rows[:, 0].tolist(), abs=1e-13)


def test_data_frames_give_columns_by_name_and_their_rows_are_samples(tipping):
    service, food = zip(*ROWS, strict=True)
    frame = pandas().DataFrame({"who": ["a", "b", "c"], "food": food, "service": service}, index=[7, 5, 3])
    columns = tipping.batch(frame)
    assert isinstance(columns, Result) and columns["tip"].tolist() == tipping.batch(ROWS)[:, 0].tolist()
    assert frame.assign(**columns._asdict())["tip"].tolist() == columns["tip"].tolist()
    for i, row in enumerate(ROWS):
        assert tipping(frame.iloc[i]) == tipping(row) and tipping.explain(frame.iloc[i]) == tipping.explain(row)


def test_keyword_columns_broadcast_scalars(tipping):
    assert (
        tipping.batch(service=[9.8, 3.0], food=6.5)["tip"].tolist()
        == tipping.batch([[9.8, 6.5], [3.0, 6.5]])[:, 0].tolist()
    )
    weights = Arbiter().batch(obstacle=[0.0, 0.25], shape=1, depth=np.float32(0))
    assert [column.tolist() for column in weights] == [[0.0, 0.15625], [1.0, 0.84375], [0.0, 0.0]]


@pytest.mark.parametrize("arbiter", [Arbiter(TIPPING), Arbiter([Criterion("service"), Criterion("food")])])
@pytest.mark.parametrize(
    ("ask", "fault"),
    [
        (lambda a: a([0.1]), "inputs: got 1, expected 2: service, food"),
        (lambda a: a([0.1, math.nan]), "food: input is nan"),
        (lambda a: a([0.1, 11]), r"food: input is 11, expected a number in \[0, 10?\]"),
        (lambda a: a([0.1, -math.inf]), "food: input is -inf"),
        (lambda a: a([None, 0.2]), "service: input is None"),
        (lambda a: a(["good", 0.2]), "service: input is 'good'"),
        (lambda a: a([[0.1], 0.2]), r"service: input is \[0.1\], .*; for columns there is batch"),
        (lambda a: a([Decimal("0.1"), 0.2]), "service: input is Decimal"),
        (lambda a: a(np.array([[0.1, 0.2]])), "inputs: got 1"),
        (lambda a: a("ab"), "service: input is 'a'"),
        (lambda a: a(), "inputs are None, expected 2 numbers"),
        (lambda a: a(0.5), "inputs are 0.5"),
        (lambda a: a({0.1, 0.2}), "inputs are"),
        (lambda a: a([1, 2], service=3), "got inputs by position and service by keyword"),
        (lambda a: a(service=0.3), "food: input is missing, expected service, food"),
        (lambda a: a(service=0.3, food=0.4, fod=0.4), "fod: unknown input, expected service, food"),
        (lambda a: a(np.ma.array([0.3, 0.4], mask=[0, 1])), "food: input is masked, expected a number"),
        (
            lambda a: a(pandas().DataFrame({"service": [3], "food": [4]})),
            "service: input is .*; for columns there is batch",
        ),
        (lambda a: a(pandas().Series([3.0, 4.0])), "service: input is missing"),
        (lambda a: a.batch([0.1, 0.2]), r"shape \(2,\), expected \(n, 2\)"),
        (lambda a: a.batch([[0.1, 0.2], [0.1, math.nan]]), "row 1: food is nan"),
        (lambda a: a.batch([[0.1, 0.2], [0.1, 99]]), r"row 1: food is 99.0, expected a number in \[0, 10?\]"),
        (lambda a: a.batch([[0.1, "0.2"]]), r"got values of the type str\d+; expected rows of numbers for service"),
        (lambda a: a.batch([[1j, 0.0]]), "got values of the type complex128"),
        (lambda a: a.batch(np.array([[0.1, "0.2"]], dtype=object)), "got a text among the values"),
        (lambda a: a.batch([[10**400, 0]]), "int too large to convert to float; expected rows of numbers"),
        (lambda a: a.batch([[0.1, 0.2], [0.1]]), "expected rows of numbers for service"),
        (lambda a: a.batch(service=[3]), "food: input is missing"),
        (lambda a: a.batch(service=[3], food=[4], fod=[4]), "fod: unknown input"),
        (lambda a: a.batch(service=[3], food=[4, 5]), r"columns have the shapes service \(1,\), food \(2,\), expected"),
        (lambda a: a.batch(service=3, food=4), r"columns have the shapes service \(\), food \(\), expected"),
        (lambda a: a.batch(service=["3"], food=["4"]), "values of the type str"),
        (lambda a: a.batch({"service": [0.3, None], "food": [0.4, 0.5]}), "row 1: service is nan"),
        (lambda a: a.batch(pandas().DataFrame({"service": [1.0]})), "food: column is missing in service; expected"),
        (
            lambda a: a.batch(pandas().DataFrame([[1, 2, 3]], columns=["food", "food", "service"])),
            "food: column stands twice",
        ),
        (
            lambda a: a.batch(pandas().DataFrame({"service": ["3"], "food": [4]})),
            "got a text among the values; expected row",
        ),
    ],
)
def test_invalid_inputs_are_rejected_by_name(arbiter, ask, fault):
    with pytest.raises(InputError, match=fault):
        ask(arbiter)


def test_masked_rows_stay_masked(tipping):
    mask = [[0, 0], [1, 0], [0, 0]]
    rows = tipping.batch(np.ma.array([[9.8, 6.5], [99.0, math.nan], [0.0, 0.0]], mask=mask))
    assert rows.mask[:, 0].tolist() == [False, True, False]
    assert rows.compressed().tolist() == tipping.batch([ROWS[0], ROWS[2]])[:, 0].tolist()
    columns = tipping.batch(service=np.ma.masked_greater([9.8, 99.0], 10), food=[6.5, 5.0])
    assert columns["tip"].mask.tolist() == [False, True] and columns["tip"][0] == rows[0, 0]
    assert not np.ma.getmaskarray(tipping.batch(np.ma.array(ROWS))).any()
    with pytest.raises(InputError, match="row 1: food is nan"):
        tipping.batch(np.ma.array([[1.0, 2.0], [1.0, math.nan]], mask=[[1, 0], [0, 0]]))


ALONE = {"low": falling(0, 100), "high": rising(0, 100)}
WINDY = System(
    (Variable("wind", (0, 20), {"calm": falling(2, 6), "strong": rising(10, 12)}),),
    (Output("sail", (0, 100), ALONE), Output("keel", (0, 100), ALONE, default=40.0), Output("lamp", (0, 100), ALONE)),
    (
        "if wind is calm then sail is high and keel is low",
        "if wind is strong then sail is low and keel is high",
        "if wind is calm or wind is not calm then lamp is high",
    ),
)


@pytest.mark.parametrize("engine", ["exact", "skfuzzy"])
def test_undefined_output_does_not_affect_others(engine):
    arbiter = Arbiter(WINDY, engine=engine)
    assert arbiter(wind=8.0) == pytest.approx((math.nan, 40.0, 200 / 3), nan_ok=True)
    rows = arbiter.batch(wind=[0.0, 8.0, 15.0])
    assert np.isnan(rows["sail"]).tolist() == [False, True, False] and rows["keel"][1] == 40.0
    assert not np.isnan(rows["lamp"]).any()
    why = str(arbiter.explain(wind=8.0))
    assert "no rule fired, and no default" in why and "no rule fired: its default 40" in why


@pytest.mark.parametrize(("normalization", "shares"), [("range", [0.2, 1]), ("sum", [1 / 6, 5 / 6]), ("max", [0.2, 1])])
def test_undefined_output_has_no_share(normalization, shares):
    shared = Arbiter(replace(WINDY, normalization=normalization))
    for weights in (shared(wind=8.0), shared.batch([[8.0]])[0]):
        assert math.isnan(weights[0]) and list(weights[1:]) == pytest.approx(shares)


def test_terms_by_name_and_callable():
    temperature = Variable("temperature", (0, 40), {"cold": falling(10, 20), "warm": triangle(15, 22, 30)})
    assert temperature["cold"](17) == pytest.approx(0.3)
    text = "if temperature is cold and temperature is not warm then tip is low"
    assert (temperature["cold"] & ~temperature["warm"]) == Rule.parse(text).condition
    assert TIPPING["service"]["good"](7.5) == 0.5 and TIPPING["tip"]["low"](6.5) == 0.5
    with pytest.raises(DefinitionError, match="no variable 'servce', expected one of service, food, tip"):
        TIPPING["servce"]
    statement = next(TIPPING.rules[0].condition.terms())  # of a text, which knows no shape
    with pytest.raises(DefinitionError, match="made of names alone"):
        statement(1.0)


@pytest.mark.parametrize("count", [3, 5, 7])
def test_automatic_terms_are_those_of_scikit_fuzzy(count):
    control = pytest.importorskip("skfuzzy.control")
    places = np.linspace(-3.0, 10.0, 14)
    theirs = control.Antecedent(places, "x")
    theirs.automf(count)
    ours = Variable("x", (-3, 10), auto_terms(count))
    assert ours.term_names == tuple(theirs.terms)
    for name, term in theirs.terms.items():
        peaks = term.mf == 1.0
        assert [ours[name](x) for x in places[peaks]] == pytest.approx([1.0] * peaks.sum())
    for x in np.linspace(-3, 10, 27):
        assert sum(ours[name](x) for name in ours.term_names) == pytest.approx(1.0, abs=1e-15)


def test_automatic_terms_accept_custom_names_and_reject_invalid_ones():
    assert Variable("x", (0, 1), auto_terms(["low", "high"])) == Variable(
        "x", (0, 1), {"low": falling(0, 1), "high": rising(0, 1)}
    )
    assert Output("y", (0, 1), auto_terms(("a", "b", "c", "d"))).term_names == ("a", "b", "c", "d")
    for bad in (4, True, 3.0, "abc", ["a"], [1, 2], None):
        with pytest.raises(DefinitionError, match="auto_terms"):
            auto_terms(bad)


def test_default_and_outside_can_be_overridden_when_loading(tmp_path):
    lamp = Output("lamp", (0, 10), {"on": rising(0, 10)})
    x = Variable("x", (0, 1), {"low": falling(0, 0.5)})
    Arbiter(System((x,), (lamp,), ("if x is low then lamp is on",))).save(tmp_path / "a.fis")
    path = tmp_path / "a.fis"
    assert math.isnan(Arbiter.load(path)(x=1.0)["lamp"])
    assert Arbiter.load(path, default=2)(x=1.0)["lamp"] == Arbiter.load(path, default={"lamp": 2})(x=1.0)["lamp"] == 2.0
    assert Arbiter.load(path, outside="clip", default=2.0)(x=99.0)["lamp"] == 2.0
    with pytest.raises(InputError):
        Arbiter.load(path)(x=99.0)
    for asked, fault in (
        ({"default": math.inf}, "a.fis: output 'lamp': default is inf, expected a finite number"),
        ({"default": {"lmp": 1.0}}, "a.fis: default: no output 'lmp', expected one of lamp"),
        ({"outside": "wrap"}, "a.fis: outside is 'wrap', expected one of refuse, clip"),
    ):
        with pytest.raises(DefinitionError, match=fault):
            Arbiter.load(path, **asked)


@pytest.mark.parametrize(
    "system",
    [
        TIPPING,
        prioritized(),
        prioritized([Criterion("a wall", on="near by", off="far off")], outside="clip", points=7),
        System(
            (SERVICE,), (replace(TIP, default=3.0),), ("if not (service is poor) then tip is low with 0.25",), "x y"
        ),
        System(
            (Variable("x", (0, 1), {"a": curve("gaussian", 0.3, 0.1)}),),
            (
                Output("y", (0, 10), {"c": Constant(2.0), "f": Formula("2*x")}, defuzzifier="average"),
                Output("z", (0, 10), {"l": Linear((1.0,), 0.5)}, defuzzifier="sum", aggregation="sum"),
            ),
            (Rule.parse("if x is very a then y is c and z is l", Operators("prod", "probor")), "if x is a then y is f"),
        ),
    ],
)
def test_repr_of_a_system_round_trips_through_public_names(system):
    public = {name: getattr(fuzzy_arbiter, name) for name in fuzzy_arbiter.__all__}
    again = eval(repr(system), {"__builtins__": {}} | public)
    assert again == system and hash(again) == hash(system)
    assert eval(repr(Arbiter(system)), {"__builtins__": {}} | public) == Arbiter(system)


def test_rounding_at_the_end_of_a_universe_is_no_fault(tipping):
    for high, low in ((10.0000000001, -1e-10), (np.nextafter(10, 11), np.nextafter(0, -1))):
        assert tipping([high, low]) == tipping([10, 0]) and tipping.batch([[high, low]])[0] == tipping([10, 0])
    for x in (10.0001, -0.0001):
        with pytest.raises(InputError):
            tipping([x, 1])
        with pytest.raises(InputError):
            tipping.batch([[x, 1]])


def test_terms_take_arrays_and_results_are_numbers_where_there_is_one(tipping):
    x = np.linspace(0, 10, 7).reshape(7, 1)
    for shape in (
        triangle(0, 4, 9),
        curve("gaussian", 4, 2),
        Formula("x / 10"),
        Variable("v", (0, 10), auto_terms(3))["good"],
    ):
        assert shape(x).shape == x.shape and shape(x).ravel().tolist() == pytest.approx([shape(y) for y in x.ravel()])
        assert shape([1, 2]).tolist() == pytest.approx([shape(1), shape(2)])
    assert float(tipping([9.8, 6.5])) == tipping([9.8, 6.5])[0]
    with pytest.raises(DefinitionError, match="float: got the outputs obstacle, shape, depth, expected one"):
        float(Arbiter()([0, 0, 0]))
    with pytest.raises(InputError, match="got 2 values by position, expected one sample"):
        tipping(1, 2)


def test_rows_with_nan_give_nan_where_that_is_asked_for(tipping):
    received = [[9.8, 6.5], [np.nan, 1.0], [3.0, None]]
    rows = tipping.batch(received, nan_policy="propagate")
    assert rows[:, 0].tolist() == pytest.approx([tipping([9.8, 6.5])[0], np.nan, np.nan], nan_ok=True)
    columns = tipping.batch(service=[np.nan, 9.8], food=6.5, nan_policy="propagate")["tip"]
    assert np.isnan(columns[0]) and columns[1] == rows[0, 0]
    for policy, fault in (
        ("raise", r"row 1: service is nan, expected .* or nan_policy='propagate'"),
        ("omit", "nan_policy is 'omit'"),
    ):
        with pytest.raises(InputError, match=fault):
            tipping.batch([[1.0, 1.0], [np.nan, 1.0]], nan_policy=policy)
    with pytest.raises(InputError, match="row 1: service is inf"):
        tipping.batch([[1.0, np.nan], [np.inf, 1.0]], nan_policy="propagate")
    # rows without inputs do not count as those before
    wind = Variable("wind", (0, 10), {"calm": falling(2, 4)})
    sail = Output("sail", (0, 10), {"full": Linear((1.0,), 0.0)}, defuzzifier="average", lock_previous=True)
    keeps = Arbiter(System([wind], [sail], ["if wind is calm then sail is full"]))
    assert keeps.batch([[1.0], [np.nan], [9.0]], nan_policy="propagate")[:, 0].tolist() == pytest.approx(
        [1.0, np.nan, 1.0], nan_ok=True
    )
    masked = keeps.batch(np.ma.masked_invalid([[1.0], [np.nan], [9.0]]))
    assert masked[:, 0].tolist() == [1.0, None, 1.0]
