"""Every evaluation in C rejects shapes without C code by name."""

from dataclasses import dataclass

import pytest

from controller.errors import RegionError
from controller.regions import Region, Sphere
from controller.regions.in_c import c_sources, require_in_c
from controller.regions.region_set import SHAPES


@dataclass(frozen=True)
class Blob(Sphere):
    """A ball by another name, which no C code knows."""


BLOB = Region("ring", Blob((0.0, 0.0, 0.0), 1.0), "out")


def test_the_shapes_of_the_package_have_c_code():
    code = c_sources()["shapes.h"].decode()
    for name, shape in SHAPES.items():
        assert f"    SHAPE_{name.upper()} = {shape.kind}," in code


def test_shape_without_c_code_is_rejected_by_name(monkeypatch):
    monkeypatch.setitem(SHAPES, "blob", Blob)
    require_in_c([Region("ball", Sphere((0.0, 0.0, 0.0), 1.0), "out")], "lanes")
    with pytest.raises(RegionError, match=r"region 'ring': shape 'blob' has no C code, expected one of .* in lanes"):
        require_in_c([BLOB], "lanes")
    assert b"BLOB" not in c_sources()["shapes.h"]


def test_unknown_shape_is_rejected():
    with pytest.raises(RegionError, match="shape is of type Blob, expected one of box, "):
        require_in_c([BLOB], "lanes")
