"""Slices of arrays in C against NumPy: random bounds, negative and beyond the ends, and the check of lengths."""

import os
import random
import subprocess
import sys
from pathlib import Path
from typing import Annotated, NamedTuple

import numpy as np
import pytest

from controller.compiling.function import INTERPRETED, BoundCall, c_text
from controller.stack_array import Array, Matrix3, Shape, Vector3, interpret
from tests.controller.translator.building import Called, compiled
from tests.controller.translator.flights import same_bits

HERE = Path(__file__)
AXES = {"w": "9", "A": "33", "x": "n", "G": "nm"}  # lengths that are known at translation, or only at run time


@pytest.fixture(autouse=True)
def runs_compiled(monkeypatch):
    """Bind calls to C even where all else is interpreted, as for mutants."""
    monkeypatch.delenv(INTERPRETED, raising=False)


class Sliced(NamedTuple):
    w: Annotated[Array, Shape(9)]
    A: Matrix3
    x: Array
    G: Array
    n: np.ndarray
    out: Array


def sliced(seed):
    """Return arrays of random numbers; n are the bounds."""
    rng = np.random.default_rng(seed)
    shapes = 9, (3, 3), 5, (4, 2)
    return Sliced(*(rng.normal(size=shape) for shape in shapes), rng.integers(-11, 12, 8), np.zeros(60))


def random_function(seed, statements=60):
    """Return the text of a function whose statements read and write slices."""
    pick = random.Random(seed)

    def bound(is_known):
        form = pick.randrange(4 if is_known else 3)
        computed = [f"int(r.n[{pick.randrange(8)}])", f"int(r.n[{pick.randrange(8)}]) + {pick.randrange(4)}"]
        return ["", *computed, str(pick.randrange(-12, 13))][form]

    def one_slice(axis):
        start = f"int(r.n[{pick.randrange(8)}])"
        fixed = ["1:", ":2", ":-1", "-2:", "1:2", "-2:-1"]  # within arrays of any length here
        computed = f"{bound(axis.isdigit())}:{bound(axis.isdigit())}"
        return pick.choice([computed] * 4 + [f"{start}:{start} + {pick.randrange(4)}", pick.choice(fixed)])

    def view():
        name = pick.choice(list(AXES))
        return f"r.{name}[{', '.join(map(one_slice, AXES[name]))}]"

    lines = ["def chosen(r):"]
    for k in range(statements):
        one = view()
        lines.append(f"    r.out[{k}] = np.sum({one}) + 10.0 * {one}.size")
        lines.append(f"    {pick.choice([view(), one])} {pick.choice(['*=', '+=', '='])} r.out[{k}] - {k}.0")
        if pick.random() < 0.5:
            lines += [f"    y{k} = {one}", f"    y{k} {pick.choice(['*=', '-='])} 0.5 + r.out[{k}]"]
    return "\n".join(lines)


def chosen_function(seed, folder):
    """Return the random function, in a file that the translator can read."""
    path, names = folder / f"chosen_{seed}.py", {"np": np, "__name__": __name__}
    path.write_text(random_function(seed))
    exec(compile(path.read_text(), str(path), "exec"), names)
    return names["chosen"]


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("seed", range(6))
def test_random_slices_are_those_of_numpy(seed, tmp_path):
    function, other = chosen_function(seed, tmp_path), sliced(0)
    call = Called(compiled(c_text(function, (other,)), tmp_path), (other,))
    for run in range(60):
        own = sliced(run)
        for target, value in zip(other, own, strict=True):
            target[...] = value
        interpret(function, (own,))
        call()
        assert same_bits(own, other), (run, random_function(seed))


@pytest.mark.slow
def test_slices_stay_within_their_arrays(tmp_path):
    """The library with its checks, in a Python of its own: who loads it late needs the runtime first."""
    runtime = subprocess.run(["cc", "-print-file-name=libasan.so"], capture_output=True, text=True, check=False)
    if runtime.returncode or not Path(runtime.stdout.strip()).is_absolute():
        pytest.skip("the compiler has no sanitizers")
    flags = ("-fsanitize=address,undefined", "-fno-sanitize-recover=all", "-g", "-O1")
    built = compiled(c_text(chosen_function(7, tmp_path), (sliced(0),)), tmp_path, *flags, compiler=["cc"])
    code = f"""
from tests.controller.translator.building import Called
from tests.controller.translator.test_slices import sliced
for run in range(400):
    Called({str(built)!r}, (sliced(run),))()
"""
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=HERE.parents[3], capture_output=True, text=True, timeout=600, check=False,
        env={
            "LD_PRELOAD": runtime.stdout.strip(), "ASAN_OPTIONS": "detect_leaks=0",
            "PATH": os.defpath, "HOME": str(tmp_path),
        },
    )  # fmt: skip
    assert done.returncode == 0, done.stderr[-3000:]


class Pair(NamedTuple):
    x: Array
    y: Array


def add(pair, total):
    total[:] = pair.x + pair.y


def add_rest(pair, total):
    rest = pair.x[2:]
    total[:] = rest + pair.y


def add_ends(pair, total):
    x = pair.x
    total[:2] = x[:2] + x[-2:] * pair.y[0]


def add_parts(pair, total):
    add(Pair(pair.x[1:], pair.y), total[:-1])


def add_three(pair, total):
    a: Vector3 = pair.x[:3]
    total[:3] = a + pair.y


def add_if_there(pair, total):
    if pair.y.size > 0:
        total[:] = pair.x[:2] * pair.y


def add_chosen(pair, total):
    other = Pair(pair.y, pair.x)
    chosen = pair if total[0] > 0.0 else other
    add(chosen, total)
    add(pair if total[1] > 5.0 else other, total)


def add_each(pair, total):
    for one in (pair, Pair(pair.y, pair.x)):
        add(one, total)


def add_items(index, total):
    total[:] = index[0] + index[1]


def add_tuple(pair, total):
    add_items((pair.x[1:], pair.y), total)


@pytest.mark.parametrize(
    ("function", "lengths", "message"),
    [
        (add, (3, 3, 3), None),
        (add, (3, 2, 3), r"add: pair.x.shape\[0\] is 3 and pair.y.shape\[0\] is 2, expected .* \(in test_slices.add\)"),
        (add, (3, 1, 3), "pair.y"),
        (add, (2, 2, 3), "total"),
        (add_rest, (5, 3, 3), None),
        (add_rest, (5, 5, 3), r"pair.y.shape\[0\] is 5, expected .*\] - 2 == pair.y"),
        (add_rest, (1, 0, 0), r"pair.x.shape\[0\] is 1, expected pair.x.shape\[0\] >= 2"),
        (add_ends, (2, 1, 2), None),
        (add_ends, (1, 1, 2), "pair.x"),
        (add_parts, (4, 3, 4), None),
        (add_parts, (3, 3, 4), r"in test_slices.add\)"),
        (add_three, (3, 3, 3), None),
        (add_three, (4, 4, 3), "pair.y"),
        (add_if_there, (2, 2, 2), None),
        (add_if_there, (2, 0, 2), r"pair.y.shape\[0\] is 0, expected .* == 2"),
        (add_if_there, (2, 3, 2), "pair.y"),
        (add_chosen, (3, 3, 3), None),
        (add_chosen, (3, 2, 3), r"pair.x.shape\[0\] is 3 and pair.y.shape\[0\] is 2"),
        (add_each, (3, 3, 3), None),
        (add_each, (3, 3, 2), "total"),
        (add_each, (2, 3, 2), "pair.y"),
        (add_tuple, (4, 3, 3), None),
        (add_tuple, (3, 3, 3), r"pair.x.shape\[0\] - 1 .*in test_slices.add_items"),
    ],
)
def test_lengths_are_checked_when_a_call_is_bound(function, lengths, message):
    x, y, total = map(np.ones, lengths)
    if message is None:
        expected = total.copy()
        function(Pair(x, y), expected)
        BoundCall(function, (Pair(x, y), total)).call()
        np.testing.assert_array_equal(total, expected)
    else:
        with pytest.raises(TypeError, match=message):
            BoundCall(function, (Pair(x, y), total))


def test_lengths_of_items_are_checked_by_name():
    """Of a parameter whose name is reserved in C."""
    with pytest.raises(TypeError, match=r"index\[0\].shape\[0\] is 3 and index\[1\].shape\[0\] is 2, expected"):
        BoundCall(add_items, ((np.ones(3), np.ones(2)), np.ones(3)))
