"""One motion in logs with a flaw each: read as without it, with a remark and its count, or refused by the reason."""

import numpy as np
import pandas as pd
import pytest
from scipy.ndimage import gaussian_filter1d

import cosim
from cosim.command_line.cli import main
from cosim.errors import ImportLogError
from cosim.logs.cleaning.alignment import clock_offset
from cosim.logs.cleaning.sample_times import drop_held, put_in_order
from cosim.logs.spool import LogContents
from cosim.results.log_facts import load_log_facts
from tests.cosim.logs.conftest import has_remark

HEAD = ["t", "yaw", "pitch", "roll", "u", "v", "w", "z", "X", "Y", "Z", "K", "M", "N"]
MAP = """time = { column = "t" }
[attitude]
columns = ["yaw", "pitch", "roll"]
euler = "ZYX"
[dvl]
columns = ["u", "v", "w"]
[depth]
columns = ["z"]
[wrench]
columns = ["X", "Y", "Z", "K", "M", "N"]
"""


def motion(t):
    """Rows of the table at times."""
    u, v, w = 0.25 * np.sin(0.4 * t), 0.12 * np.sin(0.31 * t + 1), 0.08 * np.sin(0.23 * t)
    z = 1.5 + 0.08 / 0.23 * (1 - np.cos(0.23 * t))
    wrench = [
        20 * np.cos(0.4 * t),
        12 * np.cos(0.31 * t + 1),
        8 * np.cos(0.23 * t),
        0 * t,
        0 * t,
        1.5 * np.cos(0.5 * t),
    ]
    return pd.DataFrame(np.column_stack([t, 0.3 * np.sin(0.5 * t), 0 * t, 0 * t, u, v, w, z, *wrench]), columns=HEAD)


PLAIN = motion(np.arange(480) / 8.0)


@pytest.fixture
def read(imported, tmp_path):
    """Import a table with a map."""

    def read(data, columns=MAP, name="log.csv"):
        (tmp_path / "map.toml").write_text(columns)
        content = data.to_csv(index=False, float_format="%.5f") if isinstance(data, pd.DataFrame) else data
        (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
        return imported(tmp_path / name, columns=tmp_path / "map.toml")

    return read


def assert_same_motion(run, bound=0.02, known=0.84):
    """Depth, velocity and force of a run are those of the motion."""
    record = run.record
    truth = motion(record["time"])
    for name, column in (
        ("measured.depth", "z"),
        ("measured.velocity.u", "u"),
        ("wrench.X", "X"),
        ("attitude.yaw", "yaw"),
    ):
        there = np.isfinite(record[name])
        scale = np.abs(truth[column]).max()
        assert there.mean() > known, name
        assert np.quantile(np.abs(record[name] - truth[column])[there], 0.98) < bound * scale + 0.15 * scale, name


def shuffled(frame):
    return frame.iloc[np.random.default_rng(0).permutation(len(frame))]


def swapped(frame):
    """Each tenth row comes after the next one."""
    order = np.arange(len(frame))
    order[10:-1:10], order[11::10] = order[11::10].copy()[: len(order[10:-1:10])], order[10:-1:10].copy()
    return frame.iloc[order]


def in_bursts(frame):
    """The link lets a fifth of the samples through late, many at once."""
    late = frame.copy()
    t = late["t"].to_numpy().copy()
    for k in range(20, len(t) - 12, 50):
        t[k : k + 10] = t[k + 10] + 0.001 * np.arange(10)
    return late.assign(t=t)


@pytest.mark.parametrize(
    ("flaw", "remark"),
    [
        (lambda f: f, ""),
        (lambda f: f.loc[np.repeat(f.index, 2)], "480 duplicates dropped; 480 samples are left"),
        (lambda f: f.loc[np.repeat(f.index, 2)].assign(t=np.repeat(f["t"], 2) + np.tile([0, 0.004], 480)), "480 dupl"),
        (in_bursts, "samples of bursts put on even times; 480 samples are left"),
        (shuffled, "samples sorted by time; 480 samples are left"),
        (swapped, "samples sorted by time; 480 samples are left"),
        (lambda f: f.assign(u=f["u"].where(f.index % 97 != 5, 9.9)), "dvl (u, v, w): 5 outliers left out"),
        (lambda f: f.assign(w=f["w"].where(f.index != 300, 99999.0)), "dvl (u, v, w): 1 outliers left out"),
        (lambda f: f.assign(z=f["z"].where((f.index < 200) | (f.index > 209), 1e9)), "depth (z): 10 outliers"),
    ],
    ids=["plain", "twice", "twice-apart", "bursts", "shuffled", "swapped", "spikes", "spike", "marker"],
)  # fmt: skip
def test_flaws_of_samples_are_mended_and_counted(read, flaw, remark):
    run = read(flaw(PLAIN))
    assert_same_motion(run)
    assert has_remark(run, remark) if remark else not load_log_facts(run.folder).remarks


@pytest.mark.parametrize(
    ("text", "remark"),
    [
        (PLAIN.to_csv(index=False, sep=";", decimal=","), ""),
        (PLAIN.to_csv(index=False, sep="\t").encode("utf-16"), ""),
        (PLAIN.to_csv(index=False).encode("utf-16-le"), ""),
        (PLAIN.to_csv(index=False).encode("utf-8-sig").replace(b"\n", b"\r\n"), ""),
        ("# " + PLAIN.to_csv(index=False), ""),
        ("# pool of 2024\n# by the logger\n" + PLAIN.to_csv(index=False), ""),
        ("% a comment\n% " + PLAIN.to_csv(index=False).replace(",", ", "), ""),
        (PLAIN.to_csv(index=False, sep=";", float_format="%.6e").replace(".", ","), ""),
        ("# by the logger\n" * 5000 + "\n\n# of the pool\n\n" + PLAIN.to_csv(index=False), ""),
        ("# by the logger\n\n# " + PLAIN.to_csv(index=False).replace("\n", "\n\n", 1), ""),
        (PLAIN.join(pd.DataFrame(0, PLAIN.index, [f"{'spare' * 6}{k}" for k in range(3000)])).to_csv(index=False), ""),
        (
            PLAIN.to_csv(index=False).replace("\n", "\ns,rad,rad,rad,m/s,m/s,m/s,m,N,N,N,N m,N m,N m\n", 1),
            "1 lines with",
        ),
        (PLAIN[:200].to_csv(index=False) + PLAIN[200:].to_csv(index=False), "1 lines with texts"),
        (PLAIN.to_csv(index=False)[:-40], "1 lines were left out, such as"),
        (
            PLAIN.to_csv(index=False)[:9000] + "\0\1garbage,\n" + PLAIN[120:].to_csv(index=False, header=False),
            "left out",
        ),
    ],
    ids=[
        "decimal-comma",
        "utf-16",
        "utf-16-without-mark",
        "utf-8-mark",
        "hash",
        "comments",
        "spaces",
        "exponents",
        "long-comments",
        "blank-lines",
        "long-header",
        "unit-row",
        "header-twice",
        "cut",
        "damaged",
    ],
)
def test_flaws_of_texts_are_read_past_and_remarked(read, text, remark):
    run = read(text)
    assert_same_motion(run)
    assert has_remark(run, remark) if remark else not load_log_facts(run.folder).remarks


def test_held_values_are_samples_of_their_own_at_any_rate(read):
    """A sensor of 9 Hz, held for five or six rows, is sampled where its value changes."""
    t = np.arange(3000) / 50.0
    held = motion(np.floor(t * 9.0) / 9.0)
    run = read(motion(t).assign(u=held["u"], v=held["v"], w=held["w"]))
    dvl = next(topic for topic in load_log_facts(run.folder).topics if topic.quantity == "dvl")
    assert dvl.samples == pytest.approx(540, abs=2) and dvl.rate == pytest.approx(9.0, abs=0.8)


def test_a_yaw_that_is_counted_on_is_an_attitude(read):
    """Filters that do not wrap: three turns."""
    run = read(PLAIN.assign(yaw=0.4 * PLAIN["t"]))
    known = np.isfinite(run.record["attitude.yaw"])
    off = run.record["attitude.yaw"] - 0.4 * run.record["time"]
    assert np.abs(np.angle(np.exp(1j * off[known]))).max() < 1e-3


def test_a_third_of_repeats_is_held_and_less_is_not():
    rng = np.random.default_rng(1)
    fresh = rng.integers(1, 2**60, 900).astype(np.uint64)
    assert len(drop_held(np.repeat(fresh, np.tile([2, 1], 450)))[0]) == 900
    assert len(drop_held(np.repeat(fresh, np.tile([2] + [1] * 8, 100)))[0]) == 1000


@pytest.mark.parametrize("seed", range(6))
def test_bursts_lie_on_the_line_of_their_sampling(seed):
    """Random stalls of a link: the times of sampling are found again to a fraction of the period."""
    rng = np.random.default_rng(seed)
    period = rng.uniform(0.01, 0.2)
    true = period * np.arange(2000)
    came = true + 0.05 * period * rng.random(2000)
    for k in np.flatnonzero(rng.random(1900) < 0.02):
        size = int(rng.integers(3, 15))
        came[k : k + size] = np.maximum(came[k : k + size], came[k + size] + 1e-5 * np.arange(size))
    order, times, moved = put_in_order(came)
    assert moved > 50 and (order == np.arange(2000)).all()
    assert np.quantile(np.abs(times - true), 0.98) < 0.3 * period


@pytest.mark.parametrize(
    ("more", "left"),
    [
        ("invalid = [-1.5]", 450), ("min = -1.0", 450), ("max = 1.0\nmin = -1.4", 450), ('valid = "lock"', 450),
        ("", 480),
    ],
)  # fmt: skip
def test_the_map_says_which_samples_are_invalid(read, more, left):
    bad = (PLAIN.index >= 200) & (PLAIN.index < 230)
    data = PLAIN.assign(lock=(~bad).astype(int))
    data.loc[bad, ["u", "v", "w"]] = -1.5
    run = read(data, MAP.replace('["u", "v", "w"]', f'["u", "v", "w"]\n{more}'))
    dvl = next(topic for topic in load_log_facts(run.folder).topics if topic.quantity == "dvl")
    assert (dvl.samples, dvl.broken) == (left, 480 - left)
    assert has_remark(run, "repeats one value 30 times" if not more else "30 invalid samples left out")


def test_lost_lock_is_suspected_and_left_out_where_the_map_says_so(read):
    data = PLAIN.copy()
    data.loc[200:259, ["u", "v", "w"]] = 0.0
    assert has_remark(read(data), "repeats one value 60 times, for 7.38 s from 25 s on")
    run = read(data, MAP.replace('"w"]', '"w"]\ninvalid = [0.0]'))
    assert has_remark(run, "60 invalid samples left out")


@pytest.mark.parametrize(
    ("content", "name", "what"),
    [
        (
            PLAIN.assign(t=1000 * PLAIN["t"]).to_csv(index=False),
            "log.csv",
            "0.008 samples of .* per second.*unit of its t",
        ),
        (
            PLAIN.assign(t=PLAIN["t"] / 1e6).to_csv(index=False),
            "log.csv",
            "e.06 samples of .* per second, expected 0.1 to",
        ),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "log.csv", "pointer of Git LFS"),
        ("version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n", "log.tlog", "pointer of Git LFS"),
        ("<!DOCTYPE html>\n<html>", "log.BIN", "is a web page"),
        ("\x1f\x8b\x08".encode("latin-1"), "log.ulg", "compressed by gzip"),
        (PLAIN.assign(u="west").to_csv(index=False), "log.csv", "column 'u' has 'west', expected numbers"),
        (PLAIN.to_csv(index=False, decimal=",").replace('"', ""), "log.csv", "no line with a cell for each column"),
    ],
    ids=["ms", "us-as-s", "lfs", "lfs-tlog", "page", "gzip", "texts", "ambiguous"],
)
def test_what_is_no_log_is_refused_for_the_true_reason(refused, tmp_path, content, name, what):
    (tmp_path / "map.toml").write_text(MAP)
    (tmp_path / name).write_bytes(content if isinstance(content, bytes) else content.encode())
    refused(what, tmp_path / name, columns=tmp_path / "map.toml" if name.endswith("csv") else None)


def test_without_a_map_a_draft_is_printed_that_reads_the_log(tmp_path, capsys):
    PLAIN.to_csv(tmp_path / "log.csv", index=False)
    arguments = ["import", str(tmp_path / "log.csv"), "--vehicle", "bluerov2_heavy", "--no-report"]
    assert main(arguments) == 2
    printed = capsys.readouterr()
    assert "needs a column map, expected --map FILE" in printed.err and "u 100 %" in printed.out
    (tmp_path / "map.toml").write_text(printed.out)
    assert main([*arguments, "--map", str(tmp_path / "map.toml"), "--out", str(tmp_path / "run")]) == 0
    assert {t.quantity for t in load_log_facts(tmp_path / "run").topics} == {"attitude", "dvl", "depth", "wrench"}


@pytest.mark.parametrize(("offset", "found"), [(0.0, "by their times"), (1.7e9, "by the correlation of their ")])
def test_several_logs_of_a_run_are_joined(imported, tmp_path, offset, found):
    """Clocks that agree, and clocks that have nothing in common but the depth."""
    rng = np.random.default_rng(5)
    t = np.arange(0.0, 60.0, 0.05)
    steps = np.repeat(rng.uniform(-0.2, 0.2, 40), 30)
    depth = 3.0 + np.cumsum(steps) * 0.05
    pd.DataFrame({"t": t, "z": depth, "yaw": 0.3 * np.sin(t), "pitch": 0 * t, "roll": 0 * t}).to_csv(
        tmp_path / "nav.csv"
    )
    late = t[100:-100]
    pd.DataFrame({"time": offset + late, "d": depth[100:-100], "X": 20 * np.sin(late)}).to_csv(tmp_path / "tau.csv")
    (tmp_path / "map.toml").write_text("""time = { column = "t" }
[attitude]
columns = ["yaw", "pitch", "roll"]
euler = "ZYX"
[depth]
columns = ["z"]
[altitude]
columns = ["d"]
time = { column = "time" }
file = "tau*"
[position]
columns = ["X", "X", "d"]
file = "*tau.csv"
time = { column = "time" }
[wrench]
columns = ["X", "X", "X", "X", "X", "X"]
file = "tau.csv"
time = { column = "time" }
""")
    run = imported([tmp_path / "nav.csv", tmp_path / "tau.csv"], columns=tmp_path / "map.toml")
    assert has_remark(run, f"Clocks of nav.csv and tau.csv are joined {found}")
    record = run.record
    known = np.isfinite(record["wrench.X"])
    assert np.abs(record["wrench.X"] - 20 * np.sin(record["time"]))[known].max() < (1.1 if not offset else 3.0)
    alone = imported(tmp_path / "nav.csv", columns=tmp_path / "map.toml")  # the other one is found beside it
    assert load_log_facts(alone.folder).log == "nav.csv, tau.csv"


def test_logs_with_nothing_in_common_are_refused(tmp_path):
    t = np.arange(0.0, 30.0, 0.1)
    pd.DataFrame({"t": t, "z": 3 + np.sin(t)}).to_csv(tmp_path / "nav.csv")
    pd.DataFrame({"t": 1.7e9 + t, "X": np.cos(3 * t)}).to_csv(tmp_path / "tau.csv")
    (tmp_path / "map.toml").write_text(
        'time = { column = "t" }\n[depth]\ncolumns = ["z"]\n[wrench]\ncolumns = ["X", "X", "X", "X", "X", "X"]\n'
    )
    logs = [tmp_path / "nav.csv", tmp_path / "tau.csv"]
    with pytest.raises(
        ImportLogError, match=r"begin \+1700000000\.00 s from .* no signal of both correlates above 0\.5"
    ):
        cosim.import_log(logs, "bluerov2_heavy", tmp_path / "run", columns=tmp_path / "map.toml")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(("start", "offset"), [(0.0, 1.7e9), (1.7e9, 3600.0)])
@pytest.mark.parametrize("seed", range(10))
def test_logs_of_two_dives_are_not_joined(tmp_path, start, offset, seed):
    """Clocks without a common time, and two clocks of a calendar an hour apart; signals alike in kind alone."""
    rng, t = np.random.default_rng(seed), np.arange(0.0, 60.0, 0.1)
    logs = [LogContents(tmp_path), LogContents(tmp_path / "other")]
    (tmp_path / "other").mkdir()
    for log, begin in zip(logs, (start, start + offset), strict=True):
        depth = np.cumsum(gaussian_filter1d(rng.standard_normal(t.size), 40.0))
        log.source("depth", "z").put_many(begin + t, depth[:, None])
    with pytest.raises(ImportLogError, match=rf"begin \+{offset:.2f} s from"):
        clock_offset(*logs)
