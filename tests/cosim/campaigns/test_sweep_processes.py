"""Sweeps in worker processes and on Dask: worker crashes neither lose nor duplicate rows."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time

import pyarrow.parquet as pq
import pytest

from cosim.batch.outcome import FIELDS
from cosim.campaigns.parameter_sweep import run_sweep
from cosim.campaigns.store.folder import PARTS, RESULTS
from cosim.campaigns.store.results import Results
from cosim.campaigns.workers.dispatch import KILLED
from cosim.command_line.cli import main
from cosim.errors import RunError
from tests.cosim.campaigns.command import ROOT, command, command_cache, needs_posix
from tests.cosim.campaigns.fake import KEYS, VARY, Poisoned, Slow, design, expected, fakes, paper
from tests.cosim.campaigns.scene_data import batches_of, many, rows, write

__all__ = ["command", "command_cache", "fakes"]

N = 500  # of 10 ms each: parts enough to come in between, whatever the machine does
SLOW = ["sweep", "paper", "--vary", *VARY, "--samples", N, "--seed", 3]


def rows_of(folder):
    return pq.read_table(folder / RESULTS).to_pylist()


@needs_posix
@pytest.mark.slow
def test_workers_that_are_killed_are_replaced(command):
    bereft = command(*SLOW, "--workers", 2)
    for count in (30, 200):
        bereft.wait_for_rows(count)
        os.kill(bereft.workers()[0], signal.SIGKILL)
    _, complaints = bereft.process.communicate(timeout=240)
    assert bereft.process.returncode == 0 and bereft.gone()
    assert complaints.count("flown again") >= 1
    assert rows_of(bereft.out) == expected(N)


@needs_posix
@pytest.mark.slow
def test_ctrl_c_on_dask_keeps_completed_rows(command):
    interrupted = command(*SLOW, "--workers", 2, "--dask")
    interrupted.wait_for_rows(3)
    os.killpg(interrupted.process.pid, signal.SIGINT)  # as a terminal does
    said, complaints = interrupted.process.communicate(timeout=240)
    assert interrupted.process.returncode == 130
    kept = f"what is flown is kept in {interrupted.out}, and the same command goes on"
    assert complaints == f"cosim: interrupted; {kept}\n" and said == ""
    assert interrupted.gone() and len(interrupted.keys()) >= 3


def check_poisoned(folder, n):
    found, poisoned = rows_of(folder), []
    for row, other in zip(found, expected(n), strict=True):
        if 1.0 < row[KEYS[0]] < 1.04:
            poisoned.append(row["row"])
            assert row["refused"] == KILLED and all(row[name] is None for name in FIELDS)
        else:
            assert row == other
    assert poisoned


# ---- Dask ----


@pytest.fixture(scope="module")
def cluster():
    pytest.importorskip("distributed")
    from cosim.campaigns.workers.cluster import cluster_executor

    with cluster_executor(None, 2) as executor:
        yield executor


@pytest.mark.slow
@pytest.mark.parametrize("where", ["processes", "dask"])
def test_rows_that_crash_workers_are_rejected_and_others_complete(tmp_path, fakes, request, caplog, monkeypatch, where):
    batches_of(monkeypatch, 4)  # each halving costs processes
    fakes(Poisoned)
    by = {"workers": 2} if where == "processes" else {"executor": request.getfixturevalue("cluster")}
    done = run_sweep(paper(), design(60), tmp_path / "out", **by)
    check_poisoned(tmp_path / "out", 60)
    assert done.summary["refused"] > 0 and f"refused: {KILLED}" in caplog.text


@pytest.mark.slow
def test_dask_gives_the_same_rows(tmp_path, fakes, cluster, capfd):
    run_sweep(paper(), design(), tmp_path / "one", executor=cluster)
    assert rows_of(tmp_path / "one") == expected()
    words = ["sweep", "paper", "--vary", *VARY, "--samples", "50", "--seed", "3"]
    address = cluster._client.scheduler.address
    capfd.readouterr()
    assert main([*words, "--scheduler", address, "--replays", "0", "--out", str(tmp_path / "two")]) == 0
    assert rows_of(tmp_path / "two") == expected()
    said = capfd.readouterr()
    assert "50 of 50 rows flown" in said.out and said.err == ""


@pytest.mark.slow
def test_campaign_on_dask_gives_the_same_rows(tmp_path, cluster, capfd):
    scenes = write(tmp_path / "s.jsonl", many(4))
    words = ["campaign", str(scenes), "--law", "ismail_dunnigan", "--replays", "0", "--quiet"]
    address = cluster._client.scheduler.address
    assert main([*words, "--out", str(tmp_path / "one")]) == 0
    assert main([*words, "--scheduler", address, "--out", str(tmp_path / "two")]) == 0
    assert rows(Results(tmp_path / "one" / RESULTS)) == rows(Results(tmp_path / "two" / RESULTS))
    assert main([*words, "--scheduler", address, "--workers", "2", "--out", str(tmp_path / "three")]) == 2
    assert capfd.readouterr().err == "cosim: --workers: expected none with --scheduler: the cluster sets their number\n"


@needs_posix
@pytest.mark.slow
@pytest.mark.parametrize("verb", [True, False], ids=["verb", "own executor"])
def test_sweep_ends_after_the_last_dask_worker_is_killed(tmp_path, fakes, monkeypatch, verb):
    distributed = pytest.importorskip("distributed")
    free_port = {"dashboard": False, "dashboard_address": "127.0.0.1:0"}  # not the usual one, which others may have
    monkeypatch.setattr("cosim.campaigns.workers.cluster._WORKER_TIMEOUT", 5.0)
    monkeypatch.setattr("cosim.campaigns.workers.dispatch._CHECK_PERIOD", 0.2)
    out, said = tmp_path / "out", []
    fakes(Slow)
    cluster = distributed.LocalCluster(n_workers=0, scheduler_kwargs=free_port)
    with cluster, contextlib.ExitStack() as stack:
        address = cluster.scheduler_address

        def start_worker(n):
            worker = subprocess.Popen(
                [sys.executable, "-m", "distributed.cli.dask_worker", address, "--no-nanny", "--nthreads", "1",
                 "--no-dashboard", "--local-directory", tmp_path],
                env=os.environ | {"PYTHONPATH": str(ROOT)}, stderr=subprocess.DEVNULL,
            )  # fmt: skip
            stack.callback(worker.wait)
            stack.callback(worker.kill)
            cluster.wait_for_workers(n, timeout=120)
            return worker

        def run_verb():
            said.append(main(["sweep", "paper", "--vary", *VARY, "--samples", f"{N}", "--seed", "3",
                              "--scheduler", address, "--replays", "0", "--out", str(out)]))  # fmt: skip

        def run_python():
            with distributed.Client(address) as client, client.get_executor() as executor:
                try:
                    run_sweep(paper(), design(N), out, executor=executor)
                except RunError as error:
                    said.append(str(error))

        workers = [start_worker(n) for n in (1, 2)]
        sweep = threading.Thread(target=run_verb if verb else run_python, daemon=True)
        sweep.start()
        deadline = time.monotonic() + 120.0
        while not (out / PARTS / "000000.arrows").exists() and time.monotonic() < deadline:
            time.sleep(0.01)
        for worker in workers:
            worker.kill()
        sweep.join(timeout=120.0)
        assert not sweep.is_alive() and not (out / RESULTS).exists()
        assert said == [2 if verb else "the cluster has had no workers for 5 s; what is flown is kept"]
        start_worker(1)
        run_verb()
        assert said[-1] == 0 and rows_of(out) == expected(N)


@pytest.mark.slow
def test_unreachable_scheduler_gives_one_line_error(tmp_path, capsys, monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("cosim.campaigns.workers.cluster._SCHEDULER_TIMEOUT", 0.5)
    words = ["sweep", "docking", "--vary", "law.gains.k_p1=1:2", "--samples", "3", "--out", str(tmp_path / "out")]
    assert main([*words, "--scheduler", "tcp://127.0.0.1:9"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("cosim: the cluster tcp://127.0.0.1:9 cannot be used: ")
    assert main([*words, "--scheduler", "nonsense://x"]) == 2
    assert "cannot be used" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
