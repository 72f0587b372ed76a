"""JSON with NaN and infinity replaced by null, which every reader accepts."""

import json
import math

import pytest

from cosim.io.strict_json import json_text, nan_to_none


def refuse(constant):
    raise ValueError(constant)


@pytest.mark.parametrize("nothing", [math.nan, math.inf, -math.inf])
def test_nan_and_infinity_become_null_at_any_depth(nothing):
    value = {"a": nothing, "b": [1.5, (nothing, {"c": nothing})], "d": "NaN", "e": True}
    text = json_text(value)
    assert json.loads(text, parse_constant=refuse) == {
        "a": None,
        "b": [1.5, [None, {"c": None}]],
        "d": "NaN",
        "e": True,
    }
    assert text.endswith("}\n")


def test_floats_round_trip_exactly():
    numbers = [0.1 + 0.2, 5e-324, -0.0, 2**60]
    assert [*map(repr, json.loads(json_text(numbers)))] == [*map(repr, nan_to_none(numbers))] == [*map(repr, numbers)]
