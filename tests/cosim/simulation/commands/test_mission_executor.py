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


WAIT = MissionItem(None, stay=3.0)


def jump(to, times=None):
    return MissionItem(None, jump=to, times=times)


@pytest.mark.parametrize(
    ("items", "visited", "changes"),
    [
        ([PLACE, AT_ONCE, PLACE], [0, 1, 2], {}),
        ([PLACE, AT_ONCE], [0, 1], {}),  # the last one stays
        ([AT_ONCE, AT_ONCE, PLACE, PLACE], [0, 1, 2], {"clearance": -0.1}),
        ([PLACE, PLACE], [0], {"clearance": math.nan}),
        ([WAIT, PLACE], [0], {"clearance": -1.0, "steps": 3}),
        ([WAIT, PLACE], [0, 1], {"clearance": -1.0, "steps": 4}),
        ([MissionItem(None, stay=None), PLACE], [0], {}),
        ([PLACE, jump(0, 2), PLACE], [0, 1, 0, 1, 0, 1, 2], {}),
        ([PLACE, jump(0, 0), PLACE], [0, 1, 2], {}),
        ([PLACE, jump(0)], [0, 1, 0, 1, 0, 1], {"steps": 5}),
        ([jump(0)], [0] * 4, {"steps": 3}),  # one a step, for ever
        ([PLACE, jump(3, 1), PLACE, PLACE], [0, 1, 3], {}),
    ],
)
def test_items_follow_each_other(items, visited, changes):
    assert followed(items, **changes) == visited


def test_stay_time_restarts_after_leaving_the_region():
    course = MissionExecutor()
    course.set_items((MissionItem((0.0, 0.0, 0.0), stay=2.0), PLACE))
    course.begin(0)
    clearances = [-1.0, 0.1, -0.1, 0.0, 0.1, 0.1]
    assert [course.following(float(t), c) for t, c in enumerate(clearances)] == [None] * 5 + [1]


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


@pytest.mark.parametrize(
    ("begin", "end", "path"),
    [
        (0, 1, [1]),
        (0, 3, [1, 2, 3]),
        (3, 4, [4]),
        (1, 0, [2, 0]),
        (-1, 0, [0]),
        (0, 4, None),
        (4, 0, None),
        (3, 1, None),
    ],
)
def test_path_between_items_includes_immediate_items(begin, end, path):
    assert passed_items([PLACE, AT_ONCE, jump(0, 2), PLACE, PLACE], begin, end) == path
    assert passed_items([], 0, 5) is None
    assert passed_items([jump(0)], -1, 1) == [0, 1] and passed_items([jump(0)], -1, 7) is None
