"""Dispatch of batches: crashed batches are retried and split until the faulty row is isolated."""

from concurrent.futures import Future

import numpy as np
import pytest

from cosim.campaigns.workers.dispatch import Batch, Batches, fly_all
from cosim.campaigns.workers.worker_pools import FATAL, WorkerCrash
from cosim.errors import RunError


class Work:
    """Rows that are their own tables."""

    task = None

    def batch(self, rows):
        return rows.tolist()

    def refused(self, row, reason):
        assert "crashed" in reason
        return [-row]


class WorkerPool:
    """A pool that runs batches in order of submission; some rows crash it, and all that is under way with them."""

    def __init__(self, poison=(), width=4):
        self.poison, self.width = set(poison), width
        self.deaths, self.sent = [], []
        self.most = 0
        self.under_way = []

    def submit(self, task, batch):
        flight = Future()
        flight.rows, flight.crashed = batch, False
        flight.set_result(None)
        self.under_way.append(flight)
        self.sent.append(batch)
        self.most = max(self.most, len(self.under_way))
        return flight

    def result(self, flight):
        self.under_way.remove(flight)
        if self.poison & set(flight.rows):
            self.deaths.append(flight.rows)
            for other in (flight, *self.under_way):
                other.crashed = True
        return WorkerCrash() if flight.crashed else (flight.rows, 0.01 * len(flight.rows))


def batches_of(n):
    batches = Batches()
    batches.add(np.arange(n))
    return batches


def flown(pool, n=200):
    return sorted(row for table in fly_all(Work(), batches_of(n), pool) for row in table)


def test_every_row_is_completed_once():
    pool = WorkerPool()
    assert flown(pool) == list(range(200))
    assert pool.sent[0] == [0] and pool.most == 4
    assert sum(len(batch) for batch in pool.sent) == 200


@pytest.mark.parametrize("poison", [{77}, {60, 61, 150}, {1}, {199}, {0}])
def test_only_rows_that_crash_workers_are_rejected(poison):
    pool = WorkerPool(poison)
    assert flown(pool) == sorted([-p for p in poison] + [row for row in range(200) if row not in poison])
    for row in poison - {0}:  # which is refused as -0
        assert any(batch == [row] for batch in pool.deaths)
    assert len(pool.deaths) <= len(poison) * (FATAL + 8) * 2


def test_suspect_row_runs_alone():
    pool = WorkerPool({77})
    alone = []
    submit = pool.submit

    def watched(task, batch):
        if 77 in batch and pool.deaths:
            alone.append(not pool.under_way)
        return submit(task, batch)

    pool.submit = watched
    flown(pool)
    assert alone and all(alone)


def test_worker_crash_loses_no_row():
    class Unlucky(WorkerPool):
        def result(self, flight):
            if len(self.sent) in (5, 6) and not self.deaths:
                self.under_way.remove(flight)
                self.deaths.append(flight.rows)
                return WorkerCrash()
            return super().result(flight)

    assert flown(Unlucky()) == list(range(200))


def test_persistent_worker_crashes_abort_without_rejecting_rows():
    with pytest.raises(RunError, match="processes crashed in a row, with any rows"):
        flown(WorkerPool(range(200)))
    with pytest.raises(RunError, match="every process crashed, with any rows"):
        flown(WorkerPool(range(3)), 3)


# ---- batches ----


def test_batch_size_adapts_to_row_duration():
    batches = batches_of(100_000)
    sizes = []
    for _ in range(12):
        batch = batches.take(4)
        sizes.append(len(batch.rows))
        batches.measured(len(batch.rows), 0.001 * len(batch.rows))
    assert sizes[0] == 1 and sizes[-1] == 1000  # a second
    assert all(after <= 4 * before for before, after in zip(sizes, sizes[1:], strict=False))


def test_startup_time_of_a_new_worker_does_not_shrink_batches():
    batches = batches_of(100_000)
    for _ in range(12):
        rows = len(batches.take(4).rows)
        batches.measured(rows, 0.001 * rows)
    size = len(batches.take(4).rows)
    batches.measured(1, 0.5)  # that worker had to load what it flies with
    assert len(batches.take(4).rows) == size


def test_slow_rows_are_dispatched_singly():
    batches = batches_of(50)
    for _ in range(50):
        batch = batches.take(4)
        assert len(batch.rows) == 1
        batches.measured(1, 3.0)
    assert batches.take(4) is None


def test_final_batches_are_balanced_with_a_minimum_size():
    batches = batches_of(1000)
    batches.measured(1000, 1.0)  # 1 ms each
    batches.measured(1000, 1.0)
    sizes = []
    while (batch := batches.take(4)) is not None:
        sizes.append(len(batch.rows))
    assert sum(sizes) == 1000 and sizes[0] == 125 and min(sizes[:-1]) >= 50  # 50 ms
    assert sizes == sorted(sizes, reverse=True)


def test_split_batch_keeps_all_rows():
    one, other = Batch(np.arange(7), 1, True).halves(2)
    assert one.rows.tolist() + other.rows.tolist() == list(range(7))
    assert one.crash_count == other.crash_count == 2 and one.alone and other.alone
