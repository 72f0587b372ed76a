"""Curved membership functions as programs of a stack machine: for the master and the fused loop."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from controller.stack_array import zeros
from cosim.scenario.membership_terms import FUNCTIONS, pieces_of
from fuzzy_arbiter.shapes import Membership
from fuzzy_arbiter.terms.parser import Node

Array = NDArray[np.float64]

_WORDS = ("number", "x", *FUNCTIONS)
_NUMBER, _X, _ADD, _SUBTRACT, _MULTIPLY, _DIVIDE, _POWER, _POW, _NEGATE, _ABS, _SQRT, _EXP, _LOG = range(13)
_COS, _SIN, _TAN, _MIN, _MAX, _LT, _LE, _GT, _GE, _EQ, _NEQ = range(13, len(_WORDS))
_LARGEST = 709.78  # largest argument at which exp is finite


class PackedCurves(NamedTuple):
    """The curves of r terms, in pieces; a ramp has no pieces."""

    offsets: NDArray[np.int64]  # (r + 1,) index of each term's first piece, and the number of pieces
    ends: Array  # (pieces,) m, rad or s: end of each piece, that of a term's last one at infinity
    starts: NDArray[np.int64]  # (pieces + 1,) index of each piece's first word, and the number of words
    words: NDArray[np.int64]  # (words,) indices into `_WORDS`
    numbers: Array  # (words,) value of each word that is a number


def pack_curves(terms: Sequence[Membership | None]) -> PackedCurves:
    """Turn curves and formulas into programs."""
    pieces = [pieces_of(term) if term else [] for term in terms]
    programs = [_program(tree) for of in pieces for _, tree in of]
    return PackedCurves(
        offsets=np.cumsum([0, *map(len, pieces)], dtype=np.int64),
        ends=np.array([end for of in pieces for end, _ in of], float),
        starts=np.cumsum([0, *map(len, programs)], dtype=np.int64),
        words=np.array([word for program in programs for word, _ in program], np.int64),
        numbers=np.array([number for program in programs for _, number in program], float),
    )


def _program(tree: Node) -> list[tuple[int, float]]:
    """Return the program of an expression tree in postfix order."""
    if isinstance(tree, float):
        return [(_NUMBER, tree)]
    if isinstance(tree, str):
        return [(_X, 0.0)]
    return [*(word for part in tree[1:] for word in _program(part)), (_WORDS.index(tree[0]), 0.0)]


def curve_degree(packed: PackedCurves, k: int, x: float) -> float:
    """Return the degree of a term at `x` in [0, 1], as `fuzzy_arbiter` does: at a jump the greater one."""
    # Units of arguments: x [m, rad or s]
    piece, last = packed.offsets[k], packed.offsets[k + 1] - 1
    while piece < last and x > packed.ends[piece]:
        piece += 1
    degree: float = _value(packed, piece, x)
    if piece < last and x == packed.ends[piece]:
        degree = max(degree, _value(packed, piece + 1, x))
    if x != x:
        degree = x
    elif degree < 0.0:
        degree = 0.0
    elif degree > 1.0:
        degree = 1.0
    return degree


def _value(packed: PackedCurves, piece: int, x: float) -> float:
    stack, n = zeros(32), 0  # `MAX_STACK` of cosim.scenario.membership_terms
    for at in range(packed.starts[piece], packed.starts[piece + 1]):
        word = packed.words[at]
        if word in (_NUMBER, _X):
            stack[n] = packed.numbers[at] if word == _NUMBER else x
            n += 1
        elif _NEGATE <= word <= _TAN:
            stack[n - 1] = _apply_unary(word, stack[n - 1])
        else:
            n -= 1
            stack[n - 1] = _apply_binary(word, stack[n - 1], stack[n])
    value: float = stack[0]
    return value


def _apply_unary(word: int, a: float) -> float:
    """Apply a function of one number with the results of IEEE 754 where Python raises."""
    value: float = math.nan
    if word == _NEGATE:
        value = -a
    elif word == _ABS:
        value = abs(a)
    elif word == _SQRT:
        value = math.sqrt(a) if a >= 0.0 else math.nan
    elif word == _EXP:
        value = math.exp(a) if not a >= _LARGEST else math.inf
    elif word == _LOG:
        value = math.log(a) if a > 0.0 else -math.inf if a == 0.0 else math.nan
    elif abs(a) < math.inf:
        value = math.cos(a) if word == _COS else math.sin(a) if word == _SIN else math.tan(a)
    return value


def _apply_binary(word: int, a: float, b: float) -> float:
    """Apply a function of two numbers with the results of IEEE 754 where Python raises."""
    value: float = 0.0
    if word == _ADD:
        value = a + b
    elif word == _SUBTRACT:
        value = a - b
    elif word == _MULTIPLY:
        value = a * b
    elif word == _DIVIDE:
        value = _quotient(a, b)
    elif word in (_POWER, _POW):
        value = _power(a, b)
    elif word == _MIN:
        value = min(a, b)
    elif word == _MAX:
        value = max(a, b)
    elif (
        (word == _LT and a < b)
        or (word == _LE and a <= b)
        or (word == _GT and a > b)
        or (word == _GE and a >= b)
        or (word == _EQ and a == b)
        or (word == _NEQ and a != b)
    ):
        value = 1.0
    return value


def _quotient(a: float, b: float) -> float:
    value: float = math.nan
    if b != 0.0:
        value = a / b
    elif a != 0.0 and a == a:
        value = math.copysign(math.inf, a) * math.copysign(1.0, b)
    return value


def _power(a: float, b: float) -> float:
    size, value = abs(a), math.nan
    whole = abs(b) >= 9e15 or int(b) == b if abs(b) < math.inf else True
    if a == 0.0 and b < 0.0:
        value = math.inf
    elif 0.0 < size < math.inf and b * math.log(size) > _LARGEST and (a > 0.0 or whole):
        odd = a < 0.0 and abs(b) < 9e15 and int(b) % 2 != 0
        value = -math.inf if odd else math.inf
    elif a >= 0.0 or whole or a != a:
        value = a**b
    return value
