"""Command-line conventions: help, versions, JSON, quiet, completion."""

import json
import shutil
import subprocess
import sys
from importlib import metadata

import pytest

import fuzzy_arbiter.__main__
import plant_fmu.__main__
from cosim.command_line.cli import _parser, main
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios, shipped_titles

QUICK = ["--no-report", "--set", "arbiter.engine=closed", "--set", "time.duration=0.02"]
HEAVY = {"numba", "scipy", "matplotlib", "pyarrow", "numpy", "fmpy", "msgspec", "pandas", "tqdm", "controller"}


@pytest.mark.parametrize(
    ("program", "run"),
    [("cosim", main), ("plant_fmu", plant_fmu.__main__.main), ("fuzzy_arbiter", fuzzy_arbiter.__main__.main)],
)
def test_every_command_prints_its_version(program, run, capsys, monkeypatch):
    with pytest.raises(SystemExit) as left:
        run(["--version"])
    assert left.value.code == 0
    assert capsys.readouterr().out == f"{program} {metadata.version('subreach')}\n"

    def unknown(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", unknown)
    with pytest.raises(SystemExit) as left:
        run(["--version"])
    assert left.value.code == 0 and "not installed" in capsys.readouterr().out


def printed(capsys, *words):
    with pytest.raises(SystemExit):
        main(words)
    return capsys.readouterr().out


def test_help_is_a_verb_too(capsys):
    assert main(["help"]) == 0
    assert capsys.readouterr().out == printed(capsys, "--help")
    assert main(["help", "run"]) == 0
    assert capsys.readouterr().out == printed(capsys, "run", "--help")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["mavlink-check", "udpin:127.0.0.1:14550"], "cosim: mavlink-check no longer exists; cosim listen shows"),
        (["help", "rum"], "cosim: help: argument VERB: invalid choice: 'rum'"),
        (["run"], "cosim: run: the following arguments are required: scenario; see cosim run --help"),
        (["--frob"], "cosim: the following arguments are required: VERB; see cosim --help"),
        (["export", "x", "--to", "csv", "--every", "9" * 5000], "expected a whole number from 1 to 1000000000"),
        (["help", "x" * 5000], "invalid choice"),
    ],
)
def test_unknown_arguments_give_one_line_error(words, said, capsys):
    with pytest.raises(SystemExit) as left:
        main(words)
    came = capsys.readouterr()
    assert left.value.code == 2 and came.out == ""
    assert said in came.err and came.err.count("\n") == 1 and len(came.err) < 700


def test_list_as_json_is_the_same_list(capsys):
    assert main(["list", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(maxsplit=1) for line in lines] == [[entry["name"], entry["title"]] for entry in listed]
    assert [entry["name"] for entry in listed] == list_scenarios()


@pytest.mark.medium
def test_listed_titles_match_the_scenarios():
    assert shipped_titles() == {name: load_scenario(name).title for name in list_scenarios()}


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("words", [["list"], ["list", "--json"], ["help", "run"]])
def test_light_verbs_load_no_heavy_library(words):
    code = f"import sys, cosim.command_line.cli; cosim.command_line.cli.main({words!r}); print('loaded', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = done.stdout.splitlines()[-1].split()
    assert loaded[0] == "loaded" and "cosim.command_line.cli" in loaded and not HEAVY & set(loaded)


def test_run_json_prints_only_summary_and_paths(tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["run", "paper", "--json", "--out", str(out), *QUICK]) == 0
    came = json.loads(capsys.readouterr().out)
    assert came["folder"] == str(out) and came["summary"] == json.loads((out / "summary.json").read_text())
    assert "never entered" in came["verdict"]
    assert sorted(came["files"].values()) == sorted(str(path) for path in out.iterdir())
    assert came["files"]["record"] == str(out / "record.parquet")
    assert main(["run", "papr", "--json"]) == 2
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize("words", [["-q", "run"], ["run", "-q"], ["run", "--quiet"]])
def test_quiet_prints_only_paths(tmp_path, capsys, words):
    out = tmp_path / "run"
    assert main([*words, "paper", "--out", str(out), *QUICK]) == 0
    assert capsys.readouterr().out == f"{out / 'summary.json'}\n"


def test_global_flags_work_before_and_after_the_verb():
    parse = _parser().parse_args
    for words in (["-v", "list"], ["list", "-v"]):
        assert (parse(words).verbose, parse(words).quiet) == (True, False)
    assert parse(["list"]).quiet is False and parse(["-q", "list", "-v"]).quiet is True


# ---- completion ----


@pytest.fixture
def script(capsys, tmp_path):
    def written(shell):
        assert main(["completion", shell]) == 0
        path = tmp_path / f"cosim.{shell}"
        path.write_text(capsys.readouterr().out)
        return path

    return written


def shell(name):
    return pytest.param(name, marks=pytest.mark.skipif(shutil.which(name) is None, reason=f"there is no {name}"))


_COMPLETE = {
    "bash": 'source {script}; COMP_WORDS=({words} "{last}"); COMP_CWORD={n}; _shtab_cosim; echo "${{COMPREPLY[@]}}"',
    "fish": 'source {script}; complete -C "{words} {last}" | string split -f1 \\t; true',
}


@pytest.mark.parametrize("name", [shell("bash"), shell("fish")])
@pytest.mark.parametrize(
    ("words", "last", "expected"),
    [
        ("cosim", "ca", {"campaign"}),
        ("cosim run", "paper-l", {"paper-limited"}),
        ("cosim run", "mi", {"mine.toml"}),
        ("cosim run", "sce", {"scenes"}),
        ("cosim run --set x", "dock", {"docking"}),
        ("cosim run --profile", "a", {"ardusub"}),
        ("cosim sweep paper", "--sche", {"--scheduler"}),
        ("cosim help", "sw", {"sweep"}),
    ],
)
def test_shells_complete_verbs_flags_scenarios_and_files(name, words, last, expected, script, tmp_path):
    (tmp_path / "mine.toml").touch()
    (tmp_path / "mine.txt").touch()
    (tmp_path / "scenes").mkdir()
    code = _COMPLETE[name].format(script=script(name), words=words, last=last, n=len(words.split()))
    done = subprocess.run([name, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert {word.rstrip("/") for word in done.stdout.split()} == expected


@pytest.mark.parametrize("name", [shell("bash"), shell("zsh"), shell("fish")])
def test_completion_scripts_are_valid_shell_code(name, script):
    done = subprocess.run([name, "-n", str(script(name))], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stderr) == (0, "")


def test_completion_scripts_cover_every_verb(script):
    verbs = list(_parser().parse_args(["help"]).verbs)
    for name in ("bash", "zsh", "fish"):
        text = script(name).read_text()
        assert [verb for verb in verbs if verb not in text] == [] and "paper-calibrated" in text


def value_flags():
    """Return each verb with each of its flags that take a value."""
    verbs = _parser().parse_args(["help"]).verbs
    flags = [(verb, one) for verb, parser in verbs.items() for one in parser._actions if one.option_strings]
    return [(verb, one.option_strings[-1]) for verb, one in flags if one.nargs != 0]


@pytest.mark.parametrize("value", ["-33.8,151.2", "-1,0,0", "-.5", "-1e-3", "-4:-2", "-inf"])
def test_every_value_flag_of_every_verb_takes_a_leading_minus(value):
    flags = value_flags()
    assert {("companion", "--scene-origin"), ("run", "--origin"), ("sweep", "--vary")} < set(flags)
    for verb, flag in flags:
        parser = _parser().parse_args(["help"]).verbs[verb]
        (chosen,) = (one for one in parser._actions if flag in one.option_strings)
        for one in parser._actions:
            one.required, one.type, one.choices = False, None, None
            one.nargs = one.nargs if one.option_strings else "*"
        for one in parser._mutually_exclusive_groups:
            one.required = False
        values = [value] * (chosen.nargs if isinstance(chosen.nargs, int) else 1)
        found = getattr(parser.parse_args([flag, *values]), chosen.dest)
        assert found in (value, values) or values in found, (verb, flag)


@pytest.mark.parametrize(
    ("words", "key", "value"),
    [
        (["companion", "udpin:127.0.0.1:14551", "--scenario", "paper", "--scene-origin", "-33.8,151.2"],
         "scene_origin", (-33.8, 151.2)),
        (["companion", "--scene-origin", "-33.8,-151.2", "udpin:127.0.0.1:14551", "--scenario", "paper"],
         "scene_origin", (-33.8, -151.2)),
        (["companion", "x", "--scenario", "paper", "--surveyed-origin", "-1.5,0,-2"], "surveyed_origin", (-1.5, 0, -2)),
        (["run", "paper", "--origin", "-33.9,18.4"], "origin", (-33.9, 18.4)),
    ],
)  # fmt: skip
def test_southern_and_negative_origins_need_no_equals_sign(words, key, value):
    assert getattr(_parser().parse_args(words), key) == value
