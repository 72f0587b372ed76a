"""Each construct of the subset, as C against Python, and rejected constructs with their line."""

import math
from typing import NamedTuple

import numpy as np
import pytest

from controller.compiling.function import c_text
from controller.errors import TranslationError
from controller.stack_array import zeros
from controller.translator.types import type_of
from tests.controller.translator.building import Called, compiled

FACTORS = (2.0, -3.0, 0.5)
KINDS = (3, 5)


class Pair(NamedTuple):
    first: np.ndarray
    second: np.ndarray


class Nested(NamedTuple):
    pair: Pair
    scale: float
    count: int


def two(x):
    return x + 1.0, 2.0 * x


def count_calls(log):
    log[0] += 1.0
    return log[0]


def arithmetic(x, n, out):
    out[0], out[1] = x[0] + x[1] * x[2], (x[0] + x[1]) * x[2]
    out[2], out[3] = x[0] - (x[1] - x[2]), x[0] / n[0]
    out[4], out[5] = n[0] % 3, n[1] // 3
    out[6], out[7] = n[1] % 3, -(x[0] ** 2)
    out[8], out[9] = (0.5 * n[1]) ** 5, n[0] / n[1]  # of x ** 5 Python may round otherwise
    out[10] = float(int(x[0] * 7.0))


def choices(x, n, out):
    out[0] = x[0] if x[0] > x[1] else n[0]
    out[1] = min(x[0], x[1], 0.25)
    out[2] = max(x[0], n[0])
    out[3] = 1.0 if 0.0 < x[0] < 1.0 else 2.0
    out[4] = 1.0 if n[0] in KINDS else 0.0
    out[5] = 1.0 if n[0] not in KINDS and not x[0] > 0.0 else 0.0
    a, b = (x[0], x[1]) if x[0] < x[1] else (x[1], x[0])
    out[6], out[7] = a, b
    if x[0] > 0.5:
        out[8] = 1.0
    elif x[0] > 0.0:
        out[8] = 2.0
    else:
        out[8] = 3.0
    out[9] = abs(x[0]) + abs(n[1])
    out[10] = FACTORS[abs(n[0]) % 3]


def loops(x, n, out):
    for i in range(3):
        out[i] += x[i]
    for i in range(2, 0, -1):
        out[3] = 10.0 * out[3] + i
    for _ in range(4):
        out[4] += 1.0
    k = 0
    while True:
        k += 1
        if k == 2:
            continue
        if k > 5:
            break
        out[5] += k
    for i, value in enumerate((x[0], x[1])):
        out[6] += i * value
    for value in (x[1], x[2]):
        out[7] += value
    last = 3
    for i in range(last):
        last += 1
        i += 10
        out[8] += i
    while out[9] < 3.0 and count_calls(out[9:]) < 10.0:
        out[10] += 1.0


def views(x, n, out):
    grid = zeros(2, 3)
    grid[1, 2] = x[0]
    grid[0, :] = x[1]
    row, column = grid[1], grid[:, 2]
    row[0] = 5.0
    column[0] += 7.0
    out[0:3], tail = 0.5, out[3:]
    for i in range(3):
        out[i] += grid[0, i] * 10.0 + grid[1, i]
    tail[0], tail[-1] = tail.size, grid.shape[1]
    out[5] = row[2] + column[1] + grid[:, 0].size
    part = x[n[0] : 50 + n[0]]
    out[6] = part.size
    tail[4:] = 2.0
    cube = zeros(2, 2, 2)
    cube[1, 0, 1] = 3.0
    side = cube[1]
    out[7] = side[0, 1]
    out[8] = cube[1, 0].size
    cube[:, :, :] = 4.0
    out[9] = cube[0, 1, 1]


def tuples(x, n, out):
    a, b = two(x[0])
    out[0], out[1] = b, a
    a, b = b, a
    out[2] = a - b
    rows = ((x[0], x[1]), (x[1], x[2]))
    (out[3], out[4]), (out[5], _) = rows
    out[6] = rows[1][1]
    out[7] = two(x[1])[1]
    three = (x[0], x[1], x[2])
    for i in range(3):
        out[8] += three[i] * (i + 1)
    out[9] = three[1:][0]
    a, _, c = x[:3].copy()
    for value in x[:3].copy():
        out[10] += value * (c - a) / x[:2].copy().size


def order(x, n, out):
    out[9] = 0.0
    out[7] = (x[0] > 0.0) * (count_calls(out[9:]) > 1.0) - out[9]
    out[9] = 0.0
    out[0] = count_calls(out[9:]) - 10.0 * count_calls(out[9:])
    out[1] = out[9] + count_calls(out[9:])
    out[2] = count_calls(out[9:]) if out[9] < 2.0 or count_calls(out[9:]) > 100.0 else -1.0
    out[3] = 1.0 if x[0] < -1e9 and count_calls(out[9:]) > 0.0 else 0.0
    count_calls(out[9:])
    out[9] = 0.0
    out[3 + int(count_calls(out[9:]))] = 10.0 * out[9] + x[1]  # the value first
    out[5 + int(count_calls(out[9:]) - 2.0)] += 10.0 * count_calls(out[9:])  # the place first
    total = x[0]
    total += count_calls(out[9:])
    out[10] = total
    out[6] = out[9] + (x[0] if count_calls(out[9:]) > 3.0 else count_calls(out[9:]))


class Flags(NamedTuple):
    first: bool
    second: bool
    numbers: np.ndarray


def flagged(flags):
    flags.numbers[0] = 3.0 if flags.first and not flags.second else -1.0
    flags.numbers[1] = flags.first + 2.0 * flags.second


def records(x, n, out):
    nested = Nested(Pair(x, out), 2.0, 3)
    pair = nested.pair
    out[0] = nested.scale * pair.first[1] + nested.count
    pair.second[1] = nested.pair.first.size


def special(x, n, out):
    out[0], out[1] = math.inf, -np.inf
    out[2] = 1.0 if math.isnan(x[0]) or np.isfinite(x[1]) else 0.0
    out[3] = np.sqrt(abs(x[0])) + math.copysign(1.0, x[1])
    out[4] = x[0] / 0.0 if x[0] != 0.0 else 1.0


def shifts(random, out):
    x = random[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    random[0] = x
    out[0] = float((x * np.uint64(0x2545F4914F6CDD1D)) >> np.uint64(11))


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize(
    "function", [arithmetic, choices, loops, views, tuples, order, records, special], ids=lambda f: f.__name__
)
def test_c_results_equal_python_results_bit_for_bit(function, tmp_path):
    rng = np.random.default_rng(4)
    given = (np.zeros(3), np.zeros(2, dtype=np.int64), np.zeros(11))
    library = compiled(c_text(function, given), tmp_path)
    call = Called(library, given)
    for _ in range(60):
        x, n = rng.normal(size=3), rng.integers(-6, 7, 2)
        x[rng.integers(3)] = rng.choice([0.0, -0.0, 1.0, x[0]])
        n[n == 0] = 5
        if function is views:
            n[0] = rng.integers(0, 4)
        expected = (x.copy(), n.copy(), np.zeros(11))
        given[0][:], given[1][:], given[2][:] = x, n, 0.0
        with np.errstate(all="ignore"):
            function(*expected)
        call()
        np.testing.assert_array_equal(given[2], expected[2])
        assert given[2].tobytes() == expected[2].tobytes()


@pytest.mark.parametrize(("first", "second"), [(True, False), (True, True), (False, True)])
def test_booleans_occupy_one_word_each(first, second, tmp_path):
    given, expected = ((Flags(first, second, np.zeros(2)),) for _ in range(2))
    Called(compiled(c_text(flagged, given), tmp_path), given)()
    flagged(*expected)
    assert given[0].numbers.tolist() == expected[0].numbers.tolist()


def test_random_numbers_wrap_around(tmp_path):
    given, expected = ((np.array([12345], dtype=np.uint64), np.zeros(1)) for _ in range(2))
    call = Called(compiled(c_text(shifts, given), tmp_path), given)
    with np.errstate(over="ignore"):
        for _ in range(50):
            shifts(*expected)
            call()
            assert (given[0][0], given[1][0]) == (expected[0][0], expected[1][0])


def test_code_compiles_without_warnings_in_other_compilers(tmp_path):
    pytest.importorskip("ziglang", reason="the build extra is not installed")
    import sys

    given = (np.zeros(3), np.zeros(2, dtype=np.int64), np.zeros(11))
    compiled(c_text(loops, given), tmp_path, compiler=[sys.executable, "-m", "ziglang", "cc"])


@pytest.mark.parametrize(
    ("body", "line", "word"),
    [
        ("given(x)", 1, "calls itself"),
        ("x[0] = (lambda y: y)(x[0])", 2, "Lambda"),
        ("x[0] = sum([2.0 * y for y in x])", 2, "ListComp"),
        ("return x[1:]", 2, "returned"),
        ("x[0] = max(x[0], x[1], key=abs)", 2, "argument by its name"),
        ("a = x[0]\n    a = x\n    a[0] = 1.0", 3, "in the same place"),
        ("x[0] = math.gamma(x[0])", 2, "gamma"),
        ("x[::2] = 0.0", 2, "slice with a step"),
        ("x[0] = (x[1] > 0.0) + (x[2] > 0.0)", 2, "Add of bool and bool"),
        ("a = x[: int(count_calls(x))]\n    y = x[int(count_calls(x)) : int(count_calls(x)) + 1] * 2.0", 3, "run time"),
        ("t = (x[:2], x[2:])\n    t[0][:] = (x if x[0] > 0.0 else (1.0, 2.0))", 3, "in the same place"),
        ("y = Nested(Pair(x, x), 1.0, 2) if x[0] > 0.0 else Pair(x, x)", 2, "Nested and Pair in the same place"),
        ("t = (Pair(x, x), x)", 2, "a record in a tuple"),
        ("for c in (Pair(x, x[:2]), Pair(x, x[:1])):\n        x[0] = c.second[0]", 3, "lengths 2 and 1"),
        ("if x[0] > 0.0:\n        raise ValueError(1)", 3, "Raise"),
    ],
)
def test_unsupported_constructs_are_rejected_with_file_and_line(tmp_path, body, line, word):
    path, names = tmp_path / "refused.py", {**globals()}
    path.write_text(f"def given(x):\n    {body}\n")
    exec(compile(path.read_text(), str(path), "exec"), names)
    with pytest.raises(TranslationError, match=word) as caught:
        c_text(names["given"], (np.zeros(4),))
    assert word == "calls itself" or f"{path}:{line}:" in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("value", [np.zeros(3, dtype=np.float32), np.zeros((4, 4))[:, 0], "a", [1.0], None])
def test_arguments_without_c_type_are_rejected(value):
    with pytest.raises(TypeError, match="argument is"):
        type_of(value)
