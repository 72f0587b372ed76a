"""Expressions: valid ones against Python's arithmetic, and rejected ones."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fuzzy_arbiter.errors import DefinitionError
from fuzzy_arbiter.export.code_functions import in_python
from fuzzy_arbiter.terms.expressions import EXPORTED, Expression
from fuzzy_arbiter.terms.functions import FUNCTIONS
from fuzzy_arbiter.terms.values import Constant, Formula, Linear
from tests.fuzzy_arbiter.formats.systems import REFUSED

leaves = st.sampled_from(["a", "b", "2", "0.5", "3e-2", "pi"])
texts = st.recursive(
    leaves,
    lambda inner: st.one_of(
        st.tuples(inner, st.sampled_from("+-*/"), inner).map(" ".join).map("({})".format),
        inner.map("-{}".format),
        inner.map("sin({})".format),
        inner.map("({}) ^ 2".format),
        st.tuples(inner, inner).map(lambda pair: f"max({pair[0]}, {pair[1]})"),
    ),
    max_leaves=12,
)


@given(texts, st.floats(-3, 3), st.floats(-3, 3))
def test_expression_value_equals_python(text, a, b):
    known = {"a": a, "b": b, "pi": math.pi, "sin": math.sin, "max": max}
    try:
        expected = eval(text.replace("^", "**"), {"__builtins__": {}}, known)
    except (ZeroDivisionError, OverflowError, ValueError):
        return
    made = Expression(text)
    assert made({"a": a, "b": b}) == pytest.approx(expected, rel=1e-12, abs=1e-300, nan_ok=True)
    many = np.broadcast_to(made.of_many({"a": np.array([a, a]), "b": np.array([b, b])}), 2)
    assert many[0] == pytest.approx(expected, rel=1e-9, abs=1e-12, nan_ok=True)
    assert Expression(made.text) == made
    assert made.bound({"a": a})({"b": b}) == pytest.approx(expected, rel=1e-12, abs=1e-300, nan_ok=True)


@given(st.data(), st.sampled_from(sorted(FUNCTIONS)))
def test_functions_reach_infinity_as_in_numpy(data, name):
    edge = st.sampled_from([709.782712893384, 710.4758600739439, 1023.9999999999999, 1024.0, -0.0, -3.0, 2.0, 1e308])
    numbers = [data.draw(edge | st.floats(allow_infinity=False)) for _ in range(FUNCTIONS[name].arguments)]
    if name == "pow" and numbers[0] not in (0.0, 1.0):  # next to the greatest number
        numbers[1] = data.draw(st.just(numbers[1]) | st.floats(-1e-12, 1e-12).map(
            lambda x: 709.782712893384 * (1 + x) / (math.log(abs(numbers[0])) or 1.0)
        ))  # fmt: skip
    with np.errstate(all="ignore"):
        expected = float(FUNCTIONS[name].array(*map(np.float64, numbers)))
    assert FUNCTIONS[name].number(*numbers) == pytest.approx(expected, rel=1e-12, abs=1e-300, nan_ok=True)
    exported: dict = {"math": math}
    exec(in_python(EXPORTED.get(name, name)), exported)
    assert exported[EXPORTED.get(name, name)](*numbers) == pytest.approx(expected, rel=1e-12, abs=1e-300, nan_ok=True)


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 ^ 3 ^ 2", 512.0), ("-2 ^ 2", -4.0), ("2 ^ -1", 0.5), ("7 % 4", 3.0), ("2 - 3 - 4", -5.0),
        ("8 / 4 / 2", 1.0),
        ("+3", 3.0), ("1 / 0", math.inf), ("-1 / 0", -math.inf), ("exp(1e9)", math.inf), ("log(0)", -math.inf),
        ("0 / 0", math.nan), ("sqrt(-1)", math.nan), ("log(-1)", math.nan), ("acos(2)", math.nan),
        ("(-8) ^ 0.5", math.nan), ("sin(1 / 0)", math.nan), ("fmod(1, 0)", math.nan),
        ("lt(1, 2) + ge(1, 2)", 1.0), ("fabs(-2)", 2.0), ("LN(exp(1))", 1.0), ("pi()", math.pi), (".5e1", 5.0),
    ],
)  # fmt: skip
def test_values_that_are_known(text, value):
    assert Expression(text)({}) == pytest.approx(value, nan_ok=True)
    assert float(Expression(text).of_many({})) == pytest.approx(value, nan_ok=True)


@pytest.mark.medium(fast=16)
@pytest.mark.parametrize("name", sorted(FUNCTIONS))
@given(data=st.data())
def test_numbers_and_arrays_have_the_same_functions(name, data):
    function = FUNCTIONS[name]
    values = [data.draw(st.floats(-20, 20)) for _ in range(function.arguments)]
    with np.errstate(all="ignore"):
        many = function.array(*(np.array([v]) for v in values))[0]
    one = function.number(*values)
    assert many == pytest.approx(one, rel=1e-12, abs=1e-12, nan_ok=True) or (math.isinf(one) and many > 1e300)


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        *REFUSED["expression"],
        ("+".join("1" * 300), "has 299 operators within each other, expected at most 200"),
        ("1+" * 1001, "got 2002 characters, expected at most 2000"),
        (5, "got 5, expected text"),
    ],
)
def test_invalid_expressions_are_rejected(text, fault):
    with pytest.raises(DefinitionError, match=fault):
        Expression(text)


@given(st.text(max_size=60))
def test_arbitrary_text_raises_only_typed_errors(text):
    fault = None
    try:
        Expression(text)
    except DefinitionError as error:
        fault = str(error)
    assert fault is None or fault.isprintable()


def test_linear_values_round_trip():
    made = Linear((2.0, 0.0, -0.5), 1.5)
    names = ("a", "b", "c")
    assert made.expression(names)({"a": 1.0, "b": 9.0, "c": 4.0}) == 1.5
    assert Linear.of(made.expression(names).tree, names) == made
    assert Linear.of(Expression("a * 2").tree, names) is None
    assert Linear.of(Expression("sin(a)").tree, names) is None


@pytest.mark.parametrize(
    ("make", "fault"),
    [
        (lambda: Constant(math.nan), "constant is nan, expected a finite number"),
        (lambda: Linear((1.0, math.inf)), "linear: got .*, expected finite numbers"),
        (lambda: Linear(3.0), "linear: got 3.0, expected a sequence of numbers"),
        (lambda: Linear((1.0,)).expression(("a", "b")), "linear of 1 coefficients, expected one for each input: a, b"),
        (lambda: Formula("a + c").expression(("a", "b")), "asks for c, expected inputs, or outputs before its own: a,"),
        (lambda: Formula("2 * x").within((0, 1)), "gives 1.002 at x = 0.501, expected at most 1"),
        (lambda: Formula("1 / x").within((0, 1)), "gives inf at x = 0, expected at most 1"),
    ],
)
def test_invalid_values_are_rejected(make, fault):
    with pytest.raises(DefinitionError, match=fault):
        make()
