"""The history of rows that late viewers receive."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from cosim.live.history import _MAX_NEW, History


def all_since(history, number, most):
    rows = []
    while True:
        some, at = history.since(number, most)
        if not len(some):
            return np.array(rows).reshape(-1)
        assert at > number and len(some) <= most
        rows += some[:, 0].tolist()
        number = at


def filled(count, most):
    history, block = History(1, most), np.arange(1.0, count + 1.0)[:, None]
    for row in block:
        history.add(row)
    block[:] = np.nan  # the history holds none of it
    return history


@given(st.integers(0, 3000), st.integers(2, 40), st.integers(1, 300), st.floats(0, 1))
def test_old_rows_are_thinned_evenly_and_new_rows_are_kept(count, most, at_once, part):
    history = filled(count, most)
    rows = all_since(history, 0, at_once)
    new = max(0, count - _MAX_NEW)
    old = rows[rows <= new]
    assert rows[rows > new].tolist() == list(range(new + 1, count + 1))
    assert len(old) <= most and (not new or old[0] == 1)
    assert len(set(np.diff(old))) <= 1 and (new <= most or len(old) >= most // 2)
    # who knows a part gets what is behind it
    known = int(part * count)
    assert all_since(history, known, at_once).tolist() == rows[rows > known].tolist()
