"""Arithmetic whose bits are the same in Python and in C, whatever the C library."""

# Only +, -, *, / and square roots round alike everywhere. Powers, angles and their cosines are computed from these
# here, for laws and shapes: the functions of C libraries, and of Python, differ in their last bits.

from __future__ import annotations

import math

QUARTER_TURN = 1.5707963267948966  # pi / 2
# pi / 2 and ln 2 as sums: whole multiples of the first number of each are exact
_SHORT_QUARTER, _REST_OF_QUARTER = 1.57079632673412561417, 6.07710050650619224932e-11
_LN_2, _REST_OF_LN_2 = 0.693147180369123816490, 1.90821492927058770002e-10
# arctangents of 0, 1/4 .. 1
_ARCTANGENTS = (0.0, 0.24497866312686414, 0.4636476090008061, 0.6435011087932844, 0.7853981633974483)


def square(x: float) -> float:
    """Return x x."""
    return x * x


def hypotenuse(x: float, y: float) -> float:
    """Return sqrt(x^2 + y^2), of numbers below 1e154."""
    return math.sqrt(x * x + y * y)


def length3(x: float, y: float, z: float) -> float:
    """Return sqrt(x^2 + y^2 + z^2), of numbers below 1e154."""
    return math.sqrt(x * x + y * y + z * z)


def nearest_integer(x: float) -> int:
    """Return the integer nearest to a number below 2^53, of two the one farther from 0."""
    return int(x + 0.5) if x >= 0.0 else -int(0.5 - x)


def cosine(x: float) -> float:
    """Return cos x, within 2e-16, of an angle below 1e6 [rad]: Taylor's series of the rest after quarter turns."""
    turns = nearest_integer(x / QUARTER_TURN)
    r = (x - turns * _SHORT_QUARTER) - turns * _REST_OF_QUARTER
    s, cos_r, sin_r = r * r, 1.0, 1.0
    for k in range(9, 0, -1):
        cos_r = 1.0 - s / ((2.0 * k - 1.0) * (2.0 * k)) * cos_r
        sin_r = 1.0 - s / (2.0 * k * (2.0 * k + 1.0)) * sin_r
    quarter = turns % 4
    if quarter % 2 == 0:
        return cos_r if quarter == 0 else -cos_r
    return -r * sin_r if quarter == 1 else r * sin_r


def sine(x: float) -> float:
    """Return sin x of an angle below 1e6 [rad], within 4e-16."""
    return cosine(QUARTER_TURN - x)


def exponential(x: float) -> float:
    """Return e^x of a number between -700 and 700, within 4e-16 of itself: Taylor's series, doubled or halved."""
    doublings = nearest_integer(x / _LN_2)
    r = (x - doublings * _LN_2) - doublings * _REST_OF_LN_2
    result = 1.0
    for n in range(14, 0, -1):
        result = 1.0 + r / n * result
    factor = 2.0 if doublings > 0 else 0.5
    for _ in range(abs(doublings)):
        result *= factor
    return result


def arctangent(y: float, x: float) -> float:
    """Return the angle of the point (x, y) [rad], within 5e-16 of itself; 0 of (0, 0), and NaN of NaN."""
    # The tangent's distance from the nearest of 0, 1/4 .. 1 goes into Taylor's series.
    if math.isnan(x) or math.isnan(y):
        return math.nan
    greater, less = max(abs(x), abs(y)), min(abs(x), abs(y))
    tangent = less / greater if greater > 0.0 else 0.0
    if math.isnan(tangent):  # both coordinates are infinite
        tangent = 1.0
    near = int(4.0 * tangent + 0.5)
    rest = (tangent - 0.25 * near) / (1.0 + 0.25 * near * tangent)
    s, series = rest * rest, 1.0 / 17.0
    for n in range(15, 0, -2):
        series = 1.0 / n - s * series
    angle = _ARCTANGENTS[near] + rest * series
    if abs(y) > abs(x):
        angle = QUARTER_TURN - angle
    if x < 0.0:
        angle = 2.0 * QUARTER_TURN - angle
    return -angle if y < 0.0 else angle
