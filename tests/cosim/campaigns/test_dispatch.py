"""Dispatch of batches: crashed batches are retried and split until the faulty row is isolated."""

from concurrent.futures import Future

import numpy as np
import pytest

from cosim.campaigns.workers.dispatch import Batches, fly_all
from cosim.campaigns.workers.worker_pools import FATAL, WorkerCrash
from cosim.errors import RunError


class Work:
    """Rows that are their own tables."""

    task = None

    def batch(self, rows):
        return rows.tolist()

    def refused_table(self, row, reason):
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
        suspects = self.poison & {row for rows in self.deaths for row in rows}
        assert not (suspects & set(batch) and self.under_way), "a suspect flies alone"
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


def test_persistent_worker_crashes_abort_without_rejecting_rows():
    with pytest.raises(RunError, match="processes crashed in a row, whatever they flew"):
        flown(WorkerPool(range(200)))
    with pytest.raises(RunError, match="every process crashed, whatever it flew"):
        flown(WorkerPool(range(3)), 3)


# ---- batches ----


@pytest.mark.parametrize(("row_time", "size"), [(0.001, 1000), (3.0, 1)])
def test_batch_size_adapts_to_row_duration(row_time, size):
    batches, sizes = batches_of(100_000), []
    for _ in range(12):
        sizes.append(len(batches.take(4).rows))
        batches.adapt_size(sizes[-1], row_time * sizes[-1])
    assert sizes[0] == 1 and sizes[-1] == size  # a second
    assert all(after <= 4 * before for before, after in zip(sizes, sizes[1:], strict=False))
    batches.adapt_size(1, 500.0 * row_time)  # of a new worker, which had to load what it flies with
    assert len(batches.take(4).rows) == size


def test_final_batches_are_balanced_with_a_minimum_size():
    batches = batches_of(1000)
    batches.adapt_size(1000, 1.0)  # 1 ms each
    batches.adapt_size(1000, 1.0)
    sizes = []
    while (batch := batches.take(4)) is not None:
        sizes.append(len(batch.rows))
    assert sum(sizes) == 1000 and sizes[0] == 125 and min(sizes[:-1]) >= 50  # 50 ms
    assert sizes == sorted(sizes, reverse=True)
