"""Mission execution: the next item, and the path between items."""

import math

import pytest

from cosim.errors import CommandError
from cosim.simulation.commands.commands import MissionItem
from cosim.simulation.commands.mission_executor import MissionExecutor, passed_items

PLACE = MissionItem((1.0, 2.0, 3.0), 0.5)
AT_ONCE = MissionItem(None)


def followed(items, clearance=1.0, steps=12, start=0):
    """Return the items under way, step by step, of one second each."""
    course = MissionExecutor()
    course.set_items(tuple(items))
    course.begin(start)
    seen = [course.at]
    for time in range(steps):
        following = course.following(float(time), clearance)
        if following is not None:
            course.enter(following)
            seen.append(course.at)
    return seen


def test_items_follow_each_other_and_the_last_one_stays():
    assert followed([PLACE, AT_ONCE, PLACE]) == [0, 1, 2]
    assert followed([PLACE, AT_ONCE]) == [0, 1]


def test_only_position_items_must_be_reached():
    assert followed([AT_ONCE, AT_ONCE, PLACE, PLACE], clearance=-0.1) == [0, 1, 2]
    assert followed([PLACE, PLACE], clearance=math.nan) == [0]


def test_stay_time_restarts_after_leaving_the_region():
    course = MissionExecutor()
    course.set_items((MissionItem((0.0, 0.0, 0.0), stay=2.0), PLACE))
    course.begin(0)
    clearances = [-1.0, 0.1, -0.1, 0.0, 0.1, 0.1]
    following = [course.following(float(time), clearance) for time, clearance in enumerate(clearances)]
    assert following == [None] * 5 + [1]
    assert followed([MissionItem(None, stay=3.0), PLACE], clearance=-1.0, steps=3) == [0]
    assert followed([MissionItem(None, stay=3.0), PLACE], clearance=-1.0, steps=4) == [0, 1]
    assert followed([MissionItem(None, stay=None), PLACE]) == [0]


def test_jumps_repeat_their_stated_count():
    assert followed([PLACE, MissionItem(None, jump=0, times=2), PLACE]) == [0, 1, 0, 1, 0, 1, 2]
    assert followed([PLACE, MissionItem(None, jump=0, times=0), PLACE]) == [0, 1, 2]
    assert followed([PLACE, MissionItem(None, jump=0)], steps=5) == [0, 1, 0, 1, 0, 1]
    assert followed([MissionItem(None, jump=0)], steps=3) == [0] * 4  # one a step, for ever
    assert followed([PLACE, MissionItem(None, jump=3, times=1), PLACE, PLACE]) == [0, 1, 3]


def test_restarting_the_mission_resets_jump_counts():
    course = MissionExecutor()
    course.set_items((PLACE, MissionItem(None, jump=0, times=1), PLACE))
    for _ in range(2):
        course.begin(1)
        assert course.following(0.0, 1.0) == 0
        course.enter(1)
        assert course.following(1.0, 1.0) == 2
    with pytest.raises(CommandError, match="item is 3, expected 0 to 2"):
        course.begin(3)


def test_current_region_is_that_of_the_last_position_item():
    course = MissionExecutor()
    course.set_items((AT_ONCE, PLACE, AT_ONCE, AT_ONCE))
    assert course.enter(3) is AT_ONCE and course.region() is PLACE
    course.enter(0)
    assert course.region() is None


def test_path_between_items_includes_immediate_items():
    items = [PLACE, AT_ONCE, MissionItem(None, jump=0, times=2), PLACE, PLACE]
    assert (
        passed_items(items, 0, 1) == [1] and passed_items(items, 0, 3) == [1, 2, 3] and passed_items(items, 3, 4) == [4]
    )
    assert passed_items(items, 1, 0) == [2, 0]
    assert passed_items(items, -1, 0) == [0]
    assert passed_items(items, 0, 4) is None and passed_items(items, 4, 0) is None and passed_items(items, 3, 1) is None
    assert passed_items([], 0, 5) is None
    assert (
        passed_items([MissionItem(None, jump=0)], -1, 1) == [0, 1]
        and passed_items([MissionItem(None, jump=0)], -1, 7) is None
    )
