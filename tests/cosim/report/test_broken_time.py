"""Time axes of a report: what comes after rest is drawn short, and nothing of what moves is."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from cosim.report.figures.broken_time import break_time, rests_from


class Rows(dict):
    def stack(self, names):
        return np.stack([self[name] for name in names], axis=-1)


def rows_of(x):
    still = np.zeros_like(x)
    names = dict.fromkeys(["position.y", "position.z", *(f"quaternion.e{i}" for i in range(4))], still)
    return Rows({"time": 0.1 * np.arange(x.size), "position.x": x, **names})


def test_rest_begins_where_the_last_move_ends():
    x = np.minimum(0.1 * np.arange(1000), 20.0)  # moves for 20 s of 100 s
    assert rests_from(rows_of(x)) == pytest.approx(1.05 * 0.98 * 20.0, rel=0.01)


@pytest.mark.parametrize("x", [np.linspace(0.0, 9.0, 500), np.zeros(500), np.full(500, np.nan), np.zeros(1)])
def test_a_run_that_moves_to_its_end_or_not_at_all_has_no_rest(x):
    assert rests_from(rows_of(x)) is None


def test_a_broken_axis_gives_what_moves_most_of_its_room_and_ends_at_the_end():
    (ax,) = [Figure().subplots()]
    ax.plot([0.0, 20.0, 100.0], [0.0, 1.0, 1.0])
    break_time([ax], 20.0, 100.0)
    start, rest, end = ax.transAxes.inverted().transform(ax.transData.transform([(0.0, 0), (20.0, 0), (100.0, 0)]))[
        :, 0
    ]
    assert (start, end) == pytest.approx((0.0, 1.0))
    assert rest == pytest.approx(0.85)
    assert ax.xaxis.get_majorticklocs()[-1] == 100.0
