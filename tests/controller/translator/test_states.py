"""States: their fields as attributes in Python and in C, with the same bits, and what is refused."""

import copy
import pickle
import random
from typing import Annotated, Any, NamedTuple, TypeVar

import numpy as np
import pytest
from typing_extensions import TypeAliasType

from controller.compiling.function import CompiledFunction, c_text
from controller.errors import TranslationError
from controller.stack_array import Array, Shape, Vector3, interpret
from controller.state import State
from tests.controller.translator.building import Called, compiled
from tests.controller.translator.flights import same_bits

Grid = Annotated[Array, Shape(2, 3)]
Item = TypeVar("Item", bound=np.generic)
Alias = TypeAliasType("Alias", np.ndarray[Any, np.dtype[Item]], type_params=(Item,))  # as NDArray of newer NumPy
Counts = Annotated[Alias[np.int64], Shape("k")]


class Inner(State):
    x: float = 0.25
    v: Vector3


class Outer(Inner):
    y: float
    n: int = 3
    on: bool
    word: np.uint64 = 7
    w: Vector3 = 1.0
    grid: Grid
    counts: Counts = 2
    inner: Inner


class Named(NamedTuple):
    inner: Inner
    x: float


def change(inner, y):
    inner.x += y
    inner.v = inner.v * inner.x
    return inner.x


def tame(s):
    """Keep the numbers small."""
    s.x, s.y, s.inner.x = np.clip(s.x, -3.0, 3.0), np.clip(s.y, -3.0, 3.0), np.clip(s.inner.x, -3.0, 3.0)
    s.v, s.w, s.inner.v = np.clip(s.v, -9.0, 9.0), np.clip(s.w, -s.n * s.n, 4.0), np.clip(s.inner.v, -9.0, 9.0)
    s.grid = np.clip(s.grid, -9.0, 9.0)


def outcome(inner):
    return inner.x


SCALARS = (
    "s.x",
    "s.y",
    "s.inner.x",
    "a",
    "s.v[1]",
    "s.grid[1, 2]",
    "t.x",
    "s.n",
    "s.on",
    "1.5",
    "named.x",
    "named.inner.x",
)
VECTORS = ("s.v", "s.w", "s.inner.v", "t.v", "alias", "s.grid[0]", "s.grid[1]")


def statements(seed, n):
    """Yield random statements about a state."""
    draw = random.Random(seed)

    def scalar():
        return draw.choice((f"{draw.choice(SCALARS)}", f"({draw.choice(SCALARS)} - {draw.choice(SCALARS)})",
                            "change(s.inner, 0.5)", "outcome(t)",
                            f"({draw.choice(SCALARS)} - change(s.inner, 0.5))",
                            f"np.sum({draw.choice(VECTORS)})"))  # fmt: skip

    def target():
        return draw.choice(("s.x", "s.y", "s.inner.x", "t.x", "s.v[0]", "a", "named.inner.x"))

    def vector():
        one, other = draw.choice(VECTORS), draw.choice(VECTORS)
        return draw.choice((f"{one} + {other}", f"0.5 * {one}", f"{one}[0] * {other}", f"{one} - {scalar()}", one))

    kinds = (
        lambda: f"{target()} = {scalar()}",
        lambda: f"{target()} {draw.choice('+-*')}= {scalar()} * 0.5",
        lambda: f"{target()}, {target()} = {scalar()}, {scalar()}",
        lambda: f"{target()} = {target()} = {scalar()}",
        lambda: f"{draw.choice(VECTORS[:4])} = {vector()}",
        lambda: f"{draw.choice(VECTORS[:5])} {draw.choice('+-')}= {vector()}",
        lambda: "s.v, s.w = s.w, s.v",
        lambda: f"s.on = {scalar()} > {scalar()}",
        lambda: f"s.n = int(min(max({scalar()}, -9.0), 9.0))",
        lambda: "s.n += s.counts[1]",
        lambda: "s.counts[s.n % 3] = s.n",
        lambda: f"s.word = s.word ^ np.uint64({draw.randrange(99)})",
        lambda: f"s.grid = {draw.choice(VECTORS)}",
        lambda: "s.v[1:] = s.v[:2] + s.x",
        lambda: f"a = {scalar()} if s.on and s.x < {scalar()} else {scalar()}",
    )
    for i in range(n):
        yield draw.choice(kinds)() if i % 3 else "tame(s)"


def program(lines, path):
    """Return a function of these lines."""
    text = (
        "\n    ".join(["def given(s, named, out):", "a, t, alias = 1.0, s.inner, s.w", *lines, "tame(s)", "out[0] = a"])
        + "\n"
    )
    path.write_text(text)
    names = {"np": np, "Inner": Inner, "change": change, "tame": tame, "outcome": outcome, "__name__": __name__}
    exec(compile(text, str(path), "exec"), names)
    return names["given"]


def arguments():
    inner = Inner(v=np.array([0.5, -1.0, 2.0]))
    return Outer(k=3, n=5, v=np.arange(3.0), inner=inner), Named(inner, 0.75), np.zeros(1)


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("seed", range(4))
def test_random_statements_have_the_same_bits_in_c(seed, tmp_path):
    function = program(statements(seed, 70), tmp_path / "given.py")
    given, expected = arguments(), arguments()
    call = Called(compiled(c_text(function, given), tmp_path), given)
    for _ in range(9):
        call()
        interpret(function, expected)
        assert same_bits(given, expected)


def defaults(s, out):
    out[0], out[1], out[2], out[3] = s.x, s.n, s.on, s.w[2]
    s.on, s.n = True, s.n + 1
    s.counts[0] += s.n


def test_compiled_functions_see_what_python_sets_and_python_what_they_set():
    state, out, run = Outer(k=2), np.zeros(4), CompiledFunction(defaults)
    run(state, out)
    assert out.tolist() == [0.25, 3.0, 0.0, 1.0]
    assert state.on is np.True_ and state.n == 4 and state.counts.tolist() == [6, 2]
    state.x, state.w = -1.0, [5.0, 6.0, 7.0]
    run(state, out)
    assert out.tolist() == [-1.0, 4.0, 1.0, 7.0]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda s: pickle.loads(pickle.dumps(s))], ids=["copy", "pickle"])
def test_a_copy_has_numbers_of_its_own(copied):
    state = Outer(k=2, x=2.0)
    other = copied(state)
    assert type(other) is Outer and same_bits(state, other)
    other.x, other.inner.v = 5.0, 1.0
    assert state.x == 2.0 and state.inner.v.tolist() == [0.0, 0.0, 0.0]
    other = copied(Inner.over(np.arange(4.0)))
    other.x = 7.0
    assert other.block.tolist() == [7.0, 1.0, 2.0, 3.0]


def test_a_field_may_be_stated_anew_and_a_record_has_its_default():
    class Wider(Inner):
        v: Grid
        x: float = 2.0
        inner: Inner = Inner(x=9.0)

    one, other = Wider(), Wider(inner=Inner())
    assert Wider._fields == ("x", "v", "inner") and one.v.shape == (2, 3) and one.x == 2.0
    one.inner.x += 1.0
    assert (one.inner.x, Wider().inner.x, other.inner.x) == (10.0, 9.0, 0.25)


def test_a_length_reaches_only_records_that_have_it():
    class Holder(State):
        count: Inner
        outer: Outer
        rows: Annotated[Array, Shape("n", 2)]

    made = Holder(k=np.int64(4), n=5)
    assert made.outer.counts.shape == (4,) and made.outer.n == 3 and made.rows.shape == (5, 2)


def test_a_state_over_an_array_has_its_numbers():
    block = np.arange(4.0)
    state = Inner.over(block)
    state.v[1] = state.x = 9.0
    assert block.tolist() == [9.0, 1.0, 9.0, 3.0]
    with pytest.raises(ValueError):
        Inner.over(np.zeros(5))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (Outer, "Outer: counts not given"),
        (lambda: Outer(k=2, z=1.0), r"Outer: z \(got 1.0\) is no field, and no length"),
        (lambda: Outer(k=2, m=3), r"Outer: m \(got 3\) is no field, and no length"),
        (lambda: Outer(k=2.0), r"Outer: k \(got 2.0\) is no field, and no length"),
        (lambda: Inner(x=np.array(1)), r"Inner: x \(got int64 of shape \(\)\), expected float64"),
        (lambda: Inner(v=np.zeros(4)), r"Inner: v \(got float64 of shape \(4,\)\), expected float64 of shape \(3,\)"),
        (lambda: Outer(k=2, inner=3), r"Outer: inner \(got 3\), expected Inner"),
        (lambda: Outer.over(np.zeros(9)), "Outer: n, on, word, counts, inner in an array of float64"),
        (lambda: setattr(Outer(k=2), "z", 1.0), "Outer has no field z"),
        (lambda: setattr(Outer(k=2), "inner", Inner()), "item assignment"),
        (lambda: setattr(Outer(k=2), "v", np.zeros(2)), "broadcast"),
    ],
)
def test_wrong_fields_are_refused_by_name(make, message):
    with pytest.raises((TypeError, ValueError, AttributeError), match=message):
        make()


@pytest.mark.parametrize(
    ("line", "message"),
    [
        ("s.inner = t", "a value for inner, which is Inner"),
        ("s.z = 1.0", "z, which Outer does not have"),
        ("s.z += 1.0", "z, which Outer does not have"),
        ("named.x = 1.0", "a value for attribute x of what is no State"),
        ("s.v.x = 1.0", "a value for attribute x of what is no State"),
        ("t = s._replace(x=1.0)", "_replace of what is no named tuple"),
        ("t = Inner(s.x, s.v)", "a new State, Inner"),
        ("s.v = np.concatenate((s.v, s.v))", "shapes"),
    ],
)
def test_what_is_not_translated_is_refused_with_file_and_line(line, message, tmp_path):
    path = tmp_path / "refused.py"
    with pytest.raises(TranslationError, match=f"{path}:3: .*{message}"):
        c_text(program([line], path), arguments())
