"""Logs that are cut, or of which bits are turned: a run with what is left, or one line and no folder."""

import shutil

import numpy as np
import pytest

import cosim
from cosim.errors import CosimError
from cosim.results.log_facts import load_log_facts
from plant_fmu import PlantFmuError
from tests.cosim.logs import test_bags, test_px4_logs, test_tables
from tests.cosim.logs.conftest import LOGS
from tests.cosim.logs.dive import Dive

SUFFIXES = (".BIN", ".tlog", ".ulg", ".mcap", ".db3", ".bag", ".csv", ".parquet")
HEADERS = {".BIN": 120_000, ".tlog": 60_000}  # bytes of the real logs that are taken


@pytest.fixture(scope="module")
def logs(tmp_path_factory, six_thrusters):
    """A short log of each format, with vehicle and column map, and a folder for what is made of it."""
    folder = tmp_path_factory.mktemp("whole")
    dive = Dive(np.arange(0.0, 6.0, 0.05))
    for name in ("small.BIN", "small.tlog"):
        suffix = "." + name.partition(".")[2]
        (folder / f"dive{suffix}").write_bytes((LOGS / name).read_bytes()[: HEADERS[suffix]])
    pytest.importorskip("mcap_ros2")
    test_px4_logs.write_ulog(folder / "dive.ulg", dive)
    test_bags.write_bag(folder / "dive.mcap", dive)
    test_bags.write_database(folder / "bag", dive).rename(folder / "dive.db3")
    test_bags.write_ros1(folder / "dive.bag", dive)
    test_tables.frame_of(dive).to_csv(folder / "dive.csv", index=False)
    test_tables.frame_of(dive).to_parquet(folder / "dive.parquet")
    (folder / "bag.toml").write_text(test_bags.MAP)
    (folder / "table.toml").write_text(test_tables.MAP)
    maps = dict.fromkeys((".mcap", ".db3", ".bag"), folder / "bag.toml")
    maps |= {".csv": folder / "table.toml", ".parquet": folder / "table.toml"}
    return {s: (folder / f"dive{s}", six_thrusters if s == ".BIN" else "bluerov2_heavy", maps.get(s)) for s in SUFFIXES}


def cut(data, rng):
    """Cut at a random place."""
    return data[: rng.integers(1, len(data))]


def turn_bits(data, rng):
    """Turn one to twenty bits."""
    turned = bytearray(data)
    for at in rng.integers(0, len(data), rng.integers(1, 21)):
        turned[at] ^= 1 << rng.integers(0, 8)
    return bytes(turned)


def take_out(data, rng):
    """Take out a piece of up to a tenth, as where a card loses blocks."""
    begin = rng.integers(0, len(data))
    return data[:begin] + data[begin + rng.integers(1, max(2, len(data) // 10)) :]


def overwrite(data, rng):
    """Write zeros, ones or noise over up to 2 kB."""
    begin, size = rng.integers(0, len(data)), rng.integers(1, 2048)
    junk = (bytes(size), b"\xff" * size, rng.bytes(size))[rng.integers(0, 3)]
    return data[:begin] + junk + data[begin + size :]


def repeat(data, rng):
    """Repeat a piece, as where a writer begins anew: its clock goes back."""
    begin = rng.integers(0, len(data))
    return data[:begin] + data[rng.integers(0, begin + 1) : begin] + data[begin:]


DAMAGES = (cut, turn_bits, take_out, overwrite, repeat)


def import_damaged(log, damage, seed, folder):
    """Import a damaged copy; return the run, or the words of its refusal."""
    path, vehicle, columns = log
    rng = np.random.default_rng([seed, DAMAGES.index(damage)])
    damaged, out = folder / f"damaged{path.suffix}", folder / "run"
    damaged.write_bytes(damage(path.read_bytes(), rng))
    shutil.rmtree(out, ignore_errors=True)
    run, refusal = None, ""
    try:
        run = cosim.import_log(damaged, vehicle, out, columns=columns, report=False)
    except (CosimError, PlantFmuError) as error:
        refusal = str(error)
    if run is None:
        assert not out.exists(), f"half a folder is left: {refusal}"
        assert len(refusal.splitlines()) == 1
        return refusal
    load_log_facts(run.folder)
    time = run.record["time"]
    assert np.all(np.diff(time) > 0.0) and np.isfinite(time).all()
    return run


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("damage", DAMAGES)
def test_a_damaged_log_is_a_run_or_one_line(logs, suffix, damage, tmp_path):
    for seed in range(4):
        import_damaged(logs[suffix], damage, seed, tmp_path)


@pytest.mark.medium
@pytest.mark.parametrize("suffix", [".BIN", ".tlog", ".ulg"])
def test_most_of_a_log_is_read_where_a_few_bits_are_turned(logs, suffix, tmp_path):
    read = [import_damaged(logs[suffix], turn_bits, seed, tmp_path) for seed in range(100, 108)]
    assert sum(not isinstance(found, str) for found in read) >= 4
