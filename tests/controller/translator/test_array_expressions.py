"""Expressions of arrays as C against Python, bit by bit: random ones, those that overlap their target, refused ones."""

import random
from types import SimpleNamespace
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from controller.compiling.function import BoundCall, c_text
from controller.errors import TranslationError
from controller.stack_array import (
    Array,
    Columns3,
    Matrix3,
    Matrix6,
    Rows3,
    Shape,
    Vector3,
    Vector6,
    array,
    interpret,
    ordered,
    zeros,
)
from tests.controller.translator.building import Called, compiled
from tests.controller.translator.flights import same_bits


class Given(NamedTuple):
    a: Vector3
    b: Vector3
    v: Vector6
    w: Annotated[Array, Shape(12)]
    A: Matrix3
    B: Matrix3
    H: Matrix6
    K: Columns3
    N: Rows3
    p: Array
    q: Array


SHAPES = {
    "a": 3,
    "b": 3,
    "v": 6,
    "w": 12,
    "A": (3, 3),
    "B": (3, 3),
    "H": (6, 6),
    "K": (3, 5),
    "N": (5, 3),
    "p": 5,
    "q": 5,
}


def given(seed):
    """Return arrays of random numbers, some of them zeros of either sign."""
    rng = np.random.default_rng(seed)
    values = {name: rng.normal(size=shape) for name, shape in SHAPES.items()}
    for value in values.values():
        value[rng.uniform(size=value.shape) < 0.15] = rng.choice([0.0, -0.0, 1.0, -2.0])
    return Given(**values)


def differences(function, tmp_path, runs=20):
    """Return the runs after which C and Python differ."""
    other = given(0)
    call, differing = Called(compiled(c_text(function, (other,)), tmp_path), (other,)), []
    for seed in range(runs):
        own = given(seed)
        for target, value in zip(other, own, strict=True):
            target[...] = value
        interpret(function, (own,))
        call()
        if not same_bits(own, other):
            differing.append(seed)
    return differing


LEAVES = {
    "": "r.a[0] r.v[-1] r.p[i] r.A[1,2] 2.0 -0.5 s "
    "r.w[2_if_s<1.0_else_5] np.sum(r.v[i:i+3]) np.sum(r.q[3:i+9]) r.p[1:-1].size",
    "3": "r.a r.b r.v[:3] r.v[3:] r.w[4:7] r.A[1] r.B[:,2] r.H[2,3:] r.w[i:i+3] "
    "r.w[i+5:i+8] r.p[:3] r.q[-3:] r.N[i] r.H[1_if_r.a[0]>0.0_else_4,:3] x",
    "6": "r.v r.w[:6] r.w[i:i+6] r.w[6:15] r.H[0] r.H[:,4]",
    "33": "r.A r.B r.A.T r.H[:3,3:] r.H[2:5,:3].T",
    "66": "r.H r.H.T",
    "n": "r.p r.q r.K[1] r.N[:,0]",
    "K": "r.K",
    "N": "r.N",
}
PRODUCTS = {
    "": [("3", "3"), ("6", "6"), ("n", "n")],
    "3": [("33", "3"), ("3", "33"), ("K", "n"), ("n", "N")],
    "6": [("66", "6"), ("6", "66")],
    "33": [("33", "33"), ("K", "N")],
    "66": [("66", "66")],
}
TARGETS = {
    "3": "r.a[:] r.v[:3] r.v[2:5] r.A[:,1] r.B[2] r.w[i:i+3] r.w[i+5:i+8] r.p[2:] r.H[0_if_s<1.0_else_5,2:5] x",
    "6": "r.v[:] r.w[3:9] r.H[:,2]",
    "33": "r.A[:,:] r.H[:3,2:5] r.B[:]",
    "66": "r.H[:,:]",
    "n": "r.p[:] r.K[2] r.p[:i+5]",
    "": "r.a[2] r.v[1:4] s r.q[:] r.v[i:i+3] r.q[3:i+8] r.w[1_if_s>1.0_else_11]",
}


class Writer:
    """Writes random expressions of a shape: 3, 33, 6, 66, n (of run-time length), or of a number."""

    def __init__(self, seed):
        self.random = random.Random(seed)

    def write(self, shape, depth):
        pick = self.random.choice
        if depth == 0 or shape in ("K", "N"):
            return pick(LEAVES[shape].split()).replace("_", " ")
        one, other = self.write(shape, depth - 1), self.write(pick([shape, shape, ""]), depth - 1)
        forms = [f"({one} {pick('+-*/')} {other})"] * 4 + [f"-{one}", f"abs({one})"]
        if shape:
            third = self.write(shape, depth - 1)
            forms += [
                f"np.minimum({one}, {other})", f"np.maximum({other}, {one})", f"np.clip({one}, -0.5, 0.75)",
                f"np.where({one} < {other}, {third}, {other})", f"({one}) ** 2",
            ]  # fmt: skip
        if shape == "33":
            forms.append(f"({one} {pick('+-*')} {self.write('3', depth - 1)})")
        if shape in PRODUCTS and not (shape == "n" and depth > 1):
            left, right = pick(PRODUCTS[shape])
            deeper = 0 if "n" in (left, right) and shape else depth - 1
            forms += [f"({self.write(left, deeper)} @ {self.write(right, deeper)})"] * 3
        if shape == "3":
            forms += [
                f"turned({one}, {self.write('3', depth - 1)})",
                f"array({', '.join(self.write('', 0) for _ in '123')})",
            ]
        if shape == "6":
            forms.append(f"np.concatenate(({self.write('3', depth - 1)}, {self.write('3', depth - 1)}))")
        if not shape:
            kind, inner = pick(["sum", "min", "max"]), self.write(pick(["3", "6", "n", "33"]), depth - 1)
            forms += [f"np.{kind}({inner})", f"(1.0 if np.any({inner} > 0.5) else 2.0)"]
        return pick(forms)

    def statement(self):
        pick, depth = self.random.choice, self.random.randrange(1, 3)
        shape = pick(list(TARGETS))
        expression = self.write(shape, 1 if shape == "n" else depth)
        if shape == "n":  # of run-time length it must read other arrays, or its target at the same places
            expression = f"({pick(['r.q', 'r.N[:, 1]'])} * s + abs({pick(['r.q', '2.0'])}))"
        target = pick(TARGETS[shape].split()).replace("_", " ")
        return f"{target} {'=' if target == 's' else pick(['=', '+=', '-=', '*='])} {expression}"


def turned(a: Vector3, b: Vector3) -> Vector3:
    return array(a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("seed", range(8))
def test_random_expressions_have_the_bits_of_python(seed, tmp_path):
    writer = Writer(seed)
    lines = ["def chosen(r):", "    s = 0.5", "    x = r.a + r.b", "    for i in range(0, 5, 4):"]
    lines += [f"        {writer.statement()}" for _ in range(24)]
    names, path = {**globals()}, tmp_path / "chosen.py"
    path.write_text("\n".join(lines))
    exec(compile(path.read_text(), str(path), "exec"), names)
    assert not differences(names["chosen"], tmp_path), path.read_text()


def shifted(r):
    r.w[1:] = r.w[:-1] + 10.0
    r.H[1:] = r.H[:5]
    part = r.v[1:]
    part += r.v[:5]


def disjoint_parts(r):
    r.K[:2] += r.K[2] * 2.0
    r.N[:, :1] -= r.N[:, 1:2]
    r.K[1:] = r.K[0]
    r.K[:] = r.A @ r.N.T
    r.N[:] = r.K.T @ r.B


def with_other_fields(r):
    other = r._replace(v=r.w[:6], a=r.b)
    other.a[:] = other.A @ r.b
    multiply(other.H, other.v, r.w[3:9])


def read_elsewhere(r):
    r.v[:] = r.H @ r.v
    r.a[:] = r.a @ r.A - r.a
    r.A[:] = r.A.T
    r.H[:] = r.H @ r.H.T
    r.B[:] = r.B[2]


def scaled_by_an_element(r):
    r.w[:] = r.w / r.w[0]
    r.p[:] = r.p * r.p[1]


def swapped(r):
    a, b = r.a, r.b
    a, b = b, a
    a[0] = 7.0
    r.w[:6], r.w[6:] = r.w[6:], r.w[:6]
    r.p[:], r.q[:] = r.q, r.p
    r.A[0], r.A[1] = r.A[1] + 1.0, r.A[0] - 1.0


def multiply(A: Matrix6, x: Vector6, out: Vector6):
    out[:] = A @ x


def halve(x, out):
    out[:] = 0.5 * x


NAMESPACE = SimpleNamespace(copy=halve)


class Pair(NamedTuple):
    x: Vector6
    out: Vector6


def multiply_pair(A: Matrix6, pair: Pair):
    pair.out[:] = A @ pair.x


def same_argument_twice(r):
    multiply(r.H, r.v, r.v)
    multiply(r.H, r.w[:6], r.w[3:9])
    multiply_pair(r.H, Pair(r.v, r.v))
    again = r.v
    multiply(r.H, again, r.v)


def add_up(r, v: Vector6):
    v[:] = r.H @ r.v


def argument_within_another(r):
    add_up(r, r.v)


def made_anew_in_a_loop(r):
    x, y, u = r.v + 1.0, r.a * 2.0, r.v
    for _ in range(3):
        before = x.copy()
        x = r.H @ x
        u = np.concatenate((u[3:], u[:3] + x[:3]))
        y = array(y[2], y[0], y[1])
        z = r.a + y
        view = z[1:]
        r.b[:2] += view
        r.w[:6] += x - before + u


def change(a: Vector3) -> Vector3:
    a[0] += 1.0
    return a * 2.0


def changed_while_computed(r):
    r.b[:] = (r.a + 1.0) + change(r.a)
    r.B[0] = r.a + change(r.a)
    r.v[:3] = -r.a * change(r.a)[0]
    r.A[1], r.A[2] = r.a * 3.0, change(r.a)
    x = r.a * 2.0
    x += change(r.a)
    r.w[:3] = x


def to_several_targets(r):
    r.a[:] = r.b[:] = r.a - r.b
    x = r.w[:3] = r.b * 2.0
    x[0] = 5.0


def sums_of_zeros(r):
    r.w[:] = -0.0
    r.w[0] = r.w[1:4] @ r.w[4:7]
    r.w[1] = np.sum(r.w[2:])
    r.w[2] = np.sum(-r.q * 0.0)
    r.v[:] = r.H * -0.0 @ r.w[6:]


def copied(r):
    x, y = r.v.copy(), r.A[:, 1].copy()
    r.v[:], r.A[:, :] = 0.0, 1.0
    r.p[:] = r.q.copy()
    NAMESPACE.copy(r.p, r.q)
    r.w[:6], r.a[:] = x, y
    grid = zeros(2, 3)
    grid[0], grid[1] = r.a, r.b
    r.b[:] = grid.T @ grid[:, 0]
    for i in range(2):
        row = grid[i]
        row *= 2.0
        r.B[i] = row


def branches(r):
    x = r.a + r.b if r.a[0] > 0.0 else r.a
    x[1] = 3.0
    r.b[:] = x if r.b[0] > 0.0 and np.all(r.p > -1.0) else turned(r.a, x)
    r.q[:] = np.where(r.p > 0.0, np.sqrt(np.abs(r.p)), -r.p)
    r.q[0], r.q[1] = np.max(r.p > 0.0), np.min((r.a > -9.0) * (r.b > -9.0))
    r.v[:] = r.K[:, :3] @ r.b if False else np.concatenate((r.K @ r.p, r.q @ r.N))


def conditional_indices(r):
    k = 3 if r.a[0] > 0.0 else 4
    r.v[0 if r.b[0] > 0.0 else 3] = r.w[2 if r.b[1] > 0.0 else k] + r.H[1 if r.a[1] > 0.0 else 2, 3]
    r.H[0 if r.a[2] > 0.0 else k, :3] = r.a
    r.w[1 if r.a[2] > 0.0 else 2 : 4 if r.b[2] > 0.0 else 10] += r.A[1 if r.a[0] > 0.0 else 0, int(r.b[0] > 0.0)]
    r.K[:, 2 if r.q[0] > 0.0 else 0] = r.H[int(r.a[0] > 0.0)][1:4]


LOOP = "    for i in range(3):\n        "
FUNCTIONS = [
    shifted, disjoint_parts, with_other_fields, read_elsewhere, scaled_by_an_element, same_argument_twice,
    argument_within_another, swapped, changed_while_computed, made_anew_in_a_loop, to_several_targets, sums_of_zeros,
    copied, branches, conditional_indices,
]  # fmt: skip


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__name__)
def test_arrays_that_overlap_have_the_bits_of_python(function, tmp_path):
    assert not differences(function, tmp_path)


@pytest.mark.parametrize(
    ("body", "line", "message"),
    [
        ("r.p[1:] = r.p[:-1]", 2, "known only at run time"),
        ("r.K[:2] = r.K[1:] * 2.0", 2, "known only at run time"),
        ("r.N[:] = r.N @ r.A", 2, "known only at run time"),
        ("r.p[:] = r.p + np.sum(r.p)\n    y = r.p + r.q", 3, "known only at run time"),
        ("r.p[:] = r.q\n    shift(r.p, r.p[1:])", 0, "known only at run time"),
        ("r.a[:] = r.K @ (r.p * (r.p @ r.N @ r.a))\n    r.a[:] = r.K @ (r.N @ r.a)", 3, "within a product"),
        ("r.a[:] = r.b + r.v", 2, r"shapes \(3\) and \(6\)"),
        ("r.a[0] = r.a @ r.v", 2, r"shapes \(3\) and \(6\)"),
        ("r.v[:3] = r.v", 2, r"shapes \(3\) and \(6\)"),
        ("r.a[:] = r.A", 2, "2 axes stored in 1"),
        ("r.a[3] = 1.0", 2, "index 3 of an axis of length 3"),
        ("r.a[r.b[0] > 0.0] = 1.0", 2, "an index of type bool"),
        ("r.a[:] = r.a ** 3", 2, "a power of an array"),
        ("r.a[0] = r.a @ 2.0", 2, "no vectors"),
        ("turned(r.a, r.v)", 2, r"b has shape \(6,\), expected \(3,\)"),
        ("Pair(r.v, r.a)", 2, r"out has shape \(3,\), expected \(6,\)"),
        ("both(r.v)", 0, "a tuple of 2 that is returned"),
        ("r.b[:2] = rest(r.a)", 0, "a view of an argument that is returned"),
        ("r.a[0] = np.max(r.a[3:])", 2, "max of an empty array"),
        ("r.a[0] = (r.a > 0.0) @ (r.b > 0.0)", 2, "matrices of numbers"),
        ("doubled(r.p)", 0, "run time"),
        ("r.a[0] = np.array([1.0, 2.0])[0]", 2, "List"),
        (f"x = r.a + 0.0\n{LOOP}r.b[:] = x\n        y = x\n        x = x * 2.0\n        r.a[:] = y", 5, "alias"),
        (f"x = r.a\n{LOOP}if i == 1:\n            y = x\n        x = r.b + i\n        r.a[:] = y", 5, "alias"),
    ],
)  # fmt: skip
def test_what_cannot_be_translated_is_refused_with_file_and_line(body, line, message, tmp_path):
    path, names = tmp_path / "refused.py", {**globals()}
    path.write_text(f"def refused(r):\n    {body}\n")
    exec(compile(path.read_text(), str(path), "exec"), names)
    with pytest.raises(TranslationError, match=message) as caught:
        c_text(names["refused"], (given(0),))
    assert not line or f"{path}:{line}:" in str(caught.value)


def shift(p, q):
    q[:] = p


def both(x):
    return x, x


def rest(a: Vector3):
    part = a[1:]
    part[0] = 1.0
    return part


def doubled(x):
    return x * 2.0


def extremes(x, out: Vector3):
    out[0], out[1], out[2] = np.min(x), np.max(x), np.sum(x)


def test_extremes_of_integers_need_one():
    BoundCall(extremes, (np.arange(2), np.zeros(3)))
    with pytest.raises(TypeError, match=r"x\.shape\[0\] is 0, expected x\.shape\[0\] >= 1"):
        BoundCall(extremes, (np.arange(0), np.zeros(3)))


def test_extremes_of_an_empty_array_read_nothing(tmp_path):
    given = np.full(3, 9.0)[3:], np.zeros(3)
    Called(compiled(c_text(extremes, given), tmp_path), given)()
    np.testing.assert_array_equal(given[1], [np.inf, -np.inf, 0.0])


@pytest.mark.parametrize(
    "function",
    [
        np.sum, np.min, np.mean, np.add.reduce, lambda x: np.sum(x, axis=0), lambda x: np.max(x, axis=(0, 1)),
        lambda x: np.sum(x, keepdims=True), lambda x: np.sum(x, initial=3.0), lambda x: np.sum(x, dtype=int),
        lambda x: np.min(x, where=x > 2.0, initial=9.0), lambda x: np.add.reduce(x, axis=None), lambda x: x @ x.T,
        lambda x: x @ np.ones((1, 3, 2)), lambda x: np.maximum(x, 1.0, out=np.zeros(x.shape), where=x > 0.0),
        lambda x: np.max(x[:0]), lambda x: x @ x, lambda x: x @ 2.0, lambda x: np.clip(x, None, 1.0),
    ],
)  # fmt: skip
@pytest.mark.parametrize("shape", [(2, 3), (1, 2, 3)])
def test_ordered_arrays_do_what_those_of_numpy_do(function, shape):
    x = np.arange(6.0).reshape(shape)
    try:
        expected = function(x)
    except ValueError as error:
        with pytest.raises(type(error)):
            function(ordered(x))
    else:
        result = function(ordered(x))
        assert (result.shape, result.dtype) == (expected.shape, expected.dtype)
        np.testing.assert_allclose(result, expected)


def of_vector(a: Vector3, out: Vector3):
    out[:] = a


def test_shapes_are_checked_when_a_call_is_bound():
    BoundCall(of_vector, (np.zeros(3), np.zeros(3)))
    with pytest.raises(TypeError, match=r"of_vector: a has shape \(4,\), expected \(3,\)"):
        BoundCall(of_vector, (np.zeros(4), np.zeros(3)))
    with pytest.raises(TypeError, match=r"Pair: out has shape \(3,\), expected \(6,\)"):
        BoundCall(multiply_pair, (np.zeros((6, 6)), Pair(np.zeros(6), np.zeros(3))))
