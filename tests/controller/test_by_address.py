"""Compiled functions called by their address."""

import pickle

import numpy as np
import pytest

from controller import ControllerError
from controller.regions import Box, DepthBand, Region, Sphere, pack

SPHERE = Region("s", Sphere((1.0, 2.0, 3.0), 0.5), "out")
BAND = Region("d", DepthBand(2.0, 1.0), "in")
BOX = Region("b", Box((5.0, 5.0, 5.0), (1.0, 2.0, 3.0)), "out")


def test_only_regions_that_need_them_bring_the_other_shapes():
    assert pack([SPHERE, BAND]).others == 0
    assert pack([SPHERE, BOX]).others != 0


def test_regions_that_were_pickled_find_the_functions_of_their_process():
    packed = pickle.loads(pickle.dumps(pack([SPHERE, BOX])._replace(others=1)))
    assert packed.others == pack([BOX]).others


def test_a_strided_array_is_refused():
    packed, room = pack([SPHERE, BOX]), np.zeros((2, 3))
    with pytest.raises(ControllerError, match=r"evaluate: array is a strided one, expected contiguous ones"):
        packed.evaluate(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(4)[::2], room, room.copy(), np.zeros(2))
