"""The command line: verbs, old spellings, help, JSON and quiet output, and one clear line for every user error."""

import json
import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from importlib import metadata
from pathlib import Path

import pytest

import fuzzy_arbiter.__main__
import plant_fmu.__main__
from cosim.command_line.cli import _RENAMED, _parser, all_verbs, main
from cosim.command_line.companion import _read_keys
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios, shipped_titles
from cosim.simulation.commands.sources import CommandQueue
from tests.conftest import DATA
from tests.refusals import refusals

BRIEF = ["--set", "arbiter.engine=closed", "--set", "time.duration=0.02"]
QUICK = ["--no-report", *BRIEF]
HEAVY = {"numba", "scipy", "matplotlib", "pyarrow", "numpy", "fmpy", "msgspec", "pandas", "tqdm", "controller"}


def ends(words):
    """Return the exit status of a command."""
    try:
        return main(words)
    except SystemExit as left:
        return left.code


# ---- runs ------------------------------------------------------------------------------------------------------------


def test_run_prints_the_verdict_and_output_paths(tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["run", "paper", "--out", str(out), *QUICK]) == 0
    said = capsys.readouterr()
    assert said.out.splitlines()[-1] == str(out / "summary.json") and "never entered the goal region" in said.out
    assert said.err == ""  # no bar where there is no terminal


@pytest.mark.slow
def test_run_without_out_makes_a_folder_of_its_own_whose_report_is_written_again(tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main(["run", "paper", *BRIEF]) == 0
    (folder,) = (tmp_path / "runs").iterdir()
    pages = [f"runs/{folder.name}/{name}.html" for name in ("report", "replay")]
    assert folder.name.startswith("paper-") and capsys.readouterr().out.splitlines()[-2:] == pages
    (folder / "report.html").unlink()
    assert main(["report", str(folder)]) == 0 and (folder / "report.html").exists()
    assert main(["report", str(tmp_path)]) == 2 and "holds no run" in capsys.readouterr().err


def test_run_json_prints_only_summary_and_paths(tmp_path, capsys):
    out = tmp_path / "run"
    assert main(["run", "paper", "--json", "--out", str(out), *QUICK]) == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["folder"] == str(out) and printed["summary"] == json.loads((out / "summary.json").read_text())
    assert "never entered" in printed["verdict"] and printed["files"]["record"] == str(out / "record.parquet")
    assert sorted(printed["files"].values()) == sorted(str(path) for path in out.iterdir())
    assert main(["run", "papr", "--json"]) == 2 and capsys.readouterr().out == ""


@pytest.mark.parametrize("words", [["-q", "run"], ["run", "--quiet"]])
def test_quiet_prints_only_paths(tmp_path, capsys, words):
    assert main([*words, "paper", "--out", str(tmp_path / "run"), *QUICK]) == 0
    assert capsys.readouterr().out == f"{tmp_path / 'run' / 'summary.json'}\n"


# ---- verbs and their help --------------------------------------------------------------------------------------------


def test_there_are_at_most_eighteen_verbs_each_with_sentence_examples_and_page():
    verbs = dict(all_verbs(_parser()))
    assert sum(" " not in name for name in verbs) <= 18
    for name, verb in verbs.items():
        assert verb.description.endswith(".") and f"examples:\n  cosim {name}" in verb.epilog, name


def test_help_and_version_go_to_standard_output(capsys):
    def printed(*words):
        assert ends(words) == 0
        return capsys.readouterr().out

    assert printed("help") == printed("--help") and "cosim run docking" in printed("help")
    assert printed("help", "run") == printed("run", "--help") and printed("mavlink", "listen", "-h")
    assert ends([]) == 2 and capsys.readouterr() == ("", printed("help"))


@pytest.mark.parametrize(
    ("program", "run"),
    [("cosim", main), ("plant_fmu", plant_fmu.__main__.main), ("fuzzy_arbiter", fuzzy_arbiter.__main__.main)],
)
def test_every_command_prints_its_version(program, run, capsys, monkeypatch):
    with pytest.raises(SystemExit, match="0"):
        run(["--version"])
    assert capsys.readouterr().out == f"{program} {metadata.version('subreach')}\n"

    def unknown(name):
        raise metadata.PackageNotFoundError(name)

    monkeypatch.setattr(metadata, "version", unknown)
    with pytest.raises(SystemExit, match="0"):
        run(["--version"])
    assert "not installed" in capsys.readouterr().out


def test_show_lists_the_shipped_scenarios_or_prints_one(capsys):
    assert main(["show", "--json"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert main(["show"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split(maxsplit=1) for line in lines] == [[entry["name"], entry["title"]] for entry in listed]
    assert [entry["name"] for entry in listed] == list_scenarios()
    assert main(["show", "paper", "--set", "limit.force=5"]) == 0 and "force = 5.0" in capsys.readouterr().out


@pytest.mark.medium
def test_listed_titles_match_the_scenarios():
    assert shipped_titles() == {name: load_scenario(name).title for name in list_scenarios()}


def test_global_flags_work_before_and_after_the_verb():
    parse = _parser().parse_args
    for words in (["-v", "show"], ["show", "-v"], ["mavlink", "listen", "x", "-v"]):
        assert (parse(words).verbose, parse(words).quiet) == (True, False)
    assert parse(["-q", "show", "-v"]).quiet is True


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize("words", ["show", "list --json", "help run", "scenes --count 1"])
def test_light_verbs_load_no_heavy_library(words):
    code = f"import sys, cosim.command_line.cli as c; c.main({words.split()}); print('loaded', *sys.modules)"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    loaded = {*done.stdout.splitlines()[-1].split()}
    assert {"loaded", "cosim.command_line.cli"} < loaded
    assert not loaded & HEAVY - ({"numpy", "msgspec", "controller"} if "scenes" in words else set())


# ---- old spellings ---------------------------------------------------------------------------------------------------

OLD = {  # what the verbs took under their old names
    "list": "--json",
    "replay": "--out --title --interactive",
    "package": "--to --out --fmi --platforms --set",
    "ablate": "--out --workers --replays --report-failures --sensing --variants --set",
    "excite": "--vehicle --box --depth --time --free --nuisance --current --seed --out",
    "listen": "--allow-remote --signing-key --once --seconds --count",
    "stream": "--mavlink --profile --allow-remote --signing-key --allow-system --system-id --origin --rate",
    "completion": "",
}


@pytest.mark.parametrize("old", OLD)
def test_renamed_verb_keeps_its_flags(old):
    verb = dict(all_verbs(_parser()))[_RENAMED[old].partition(" --")[0]]
    assert {*OLD[old].split(), "--quiet", "--verbose"} <= verb._option_string_actions.keys()


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("list --json", "show --json"),
        ("-q list", "-q show"),
        ("completion fish", "help --completion fish"),
        ("completion tcsh", "help --completion tcsh"),
        ("help stream", "help mavlink"),
        ("help package", "help export"),
        ("replay nowhere --out x.html", "report --replay nowhere --out x.html"),
        ("replay --title", "report --replay --title"),
        ("package papr --fmi 3 --set x=1", "export --to ssp --force papr --fmi 3 --set x=1"),
        ("ablate no.jsonl --variants lag --set speed=1 --out x",
         "compare --ablate no.jsonl --variants lag --set speed=1 --out x"),
        ("excite --vehicle odin --box 5 4 0", "identify --excite --vehicle odin --box 5 4 0"),
        ("listen udpin:127.0.0.1:14599 --seconds 0.05", "mavlink listen udpin:127.0.0.1:14599 --seconds 0.05"),
        ("stream nowhere --mavlink a.tlog -q", "mavlink stream nowhere --mavlink a.tlog -q"),
    ],
)  # fmt: skip
def test_renamed_verb_does_the_same_and_names_the_new_spelling(old, new, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    expected = ends(new.split()), *capsys.readouterr()
    name = next(word for word in old.split() if word in _RENAMED)
    line = f"cosim: {name} is now: cosim {_RENAMED[name]}\n"
    assert (ends(old.split()), *capsys.readouterr()) == (*expected[:2], line + expected[2])


# ---- errors of the user ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "reasons"),
    [
        *refusals("commands", lambda words: [pytest.mark.medium] if words.startswith("falsify docking") else []),
        (f"help {'x' * 5000}", ["invalid choice"]),
        (f"export x --to csv --every {'9' * 5000}", ["expected a whole number from 1 to 1000000000"]),
    ],
)
def test_user_errors_are_one_line_and_leave_nothing(words, reasons, tmp_path, capsys, monkeypatch):
    if words.startswith("falsify"):
        pytest.importorskip("cma")
    monkeypatch.chdir(tmp_path)
    Path("full.ssp").touch()
    shutil.copy(DATA / "scenes" / "hard.jsonl", "s.jsonl")
    assert ends(words.split()) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("cosim: ") and said.err.count("\n") == 1 and len(said.err) < 900
    assert all(reason in said.err for reason in reasons)
    assert {path.name for path in tmp_path.rglob("*")} - {"runs"} == {"full.ssp", "s.jsonl"}


def test_missing_compiler_gives_one_line_error(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda *_, **__: str(tmp_path / "cache"))
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    assert main(["run", "paper", "--out", str(tmp_path / "run"), *QUICK]) == 2
    assert "no C compiler" in capsys.readouterr().err and {path.name for path in tmp_path.iterdir()} <= {"cache"}


@pytest.mark.parametrize("value", ["-33.8,151.2", "-1,0,0", "-.5", "-1e-3", "-4:-2", "-inf"])
def test_every_value_flag_of_every_verb_takes_a_leading_minus(value):
    taken = 0
    for verb, parser in [*all_verbs(_parser())]:
        parser._mutually_exclusive_groups.clear()
        for one in parser._actions:
            one.required, one.type, one.choices = False, None, None
            one.nargs = one.nargs if one.option_strings else "*"
        for flag in (one for one in parser._actions if one.option_strings and one.nargs != 0):
            values = [value] * (flag.nargs if isinstance(flag.nargs, int) else 1)
            found = getattr(parser.parse_args([flag.option_strings[-1], *values]), flag.dest)
            assert found in (value, values, [*value]) or values in found, (verb, flag)
            taken += 1
    assert taken > 100


@pytest.mark.parametrize(
    ("words", "key", "value"),
    [
        ("companion x --scenario paper --scene-origin -33.8,151.2", "scene_origin", (-33.8, 151.2)),
        ("companion --scene-origin -33.8,-151.2 x --scenario paper", "scene_origin", (-33.8, -151.2)),
        ("companion x --scenario paper --surveyed-origin -1.5,0,-2", "surveyed_origin", (-1.5, 0, -2)),
        ("run paper --origin -33.9,18.4", "origin", (-33.9, 18.4)),
    ],
)
def test_southern_and_negative_origins_need_no_equals_sign(words, key, value):
    assert getattr(_parser().parse_args(words.split()), key) == value


@pytest.mark.parametrize(
    ("text", "error"),
    [("55.9097000,-3.3203000", ""), ("-33.85680001, 151.2153000", ""), ("55.9097,-3.3203000", "11 m"),
     ("56,-3", "110000 m"), ("55.909700,-3.3203000", "0.11 m")],
)  # fmt: skip
def test_a_scene_origin_of_too_few_digits_is_warned_of(capsys, text, error):
    _parser().parse_args(["companion", "x", "--scenario", "paper", f"--scene-origin={text}"])
    heard = capsys.readouterr().err
    warning = f"cosim: WARNING: --scene-origin {text}: its last digit is {error}; give 7 decimals\n"
    assert heard == (warning if error else "")


def test_enter_holds_a_companion_and_r_resumes_it():
    reading, writing = os.pipe()
    os.write(writing, b"\n R \nr\n\n")
    os.close(writing)
    commands = CommandQueue(("hold", "reach"))
    _read_keys(reading, commands)
    assert [command.mode for command in commands.take(0)] == ["hold", "reach", "reach", "hold"]


@pytest.mark.skipif(os.name != "posix", reason="opens a terminal")
def test_enter_holds_a_companion_after_the_terminal_s_end_of_file():
    keyboard, terminal = os.openpty()
    commands = CommandQueue(("hold", "reach"))
    reader = threading.Thread(target=_read_keys, args=(terminal, commands), daemon=True)
    reader.start()
    os.write(keyboard, b"\x04\n")
    taken = []
    while not taken and reader.is_alive():
        taken = commands.take(0)
        time.sleep(0.01)
    assert [command.mode for command in taken] == ["hold"]
    os.close(keyboard)
    reader.join(60.0)
    os.close(terminal)
    assert not reader.is_alive()


# ---- processes -------------------------------------------------------------------------------------------------------


def cosim(*words):
    """Start the command as a process of its own."""
    return subprocess.Popen(
        [sys.executable, "-m", "cosim", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )


@pytest.mark.slow
def test_verbose_logs_only_own_packages(tmp_path):
    _, said = cosim("-v", "run", "paper", "--out", str(tmp_path / "run"), *BRIEF).communicate(timeout=240)
    assert all(line.startswith(("cosim", "controller", "plant_fmu")) for line in said.splitlines())


@pytest.mark.slow
def test_run_works_without_a_writable_cache(tmp_path):
    """Only the run folder is writable: compiled code is not cached, and the FMU is built per process."""
    words = ["run", "paper", "--out", str(tmp_path / "run"), *QUICK]
    code = f"""
import sys
import platformdirs
platformdirs.user_cache_dir = lambda *_, **__: "/proc/nowhere"
from cosim.command_line.cli import main
sys.exit(main({words!r}))
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "building for this process alone" in done.stderr


@pytest.mark.medium
@pytest.mark.skipif(not Path("/proc/self/maps").exists(), reason="looks into /proc")
@pytest.mark.parametrize("delay", [0.3, *(pytest.param(delay, marks=pytest.mark.slow) for delay in (0.0, 0.8))])
def test_ctrl_c_during_imports_exits_cleanly(tmp_path, delay):
    # quiet, else it might say that it compiles
    process = cosim("run", "paper", "--quiet", "--set", "time.duration=3000", "--out", str(tmp_path / "run"))
    while "numpy" not in Path(f"/proc/{process.pid}/maps").read_text():  # before that the interpreter itself starts
        time.sleep(0.005)
    time.sleep(delay)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=240)
    # where it comes within an exec() of some import, CPython ends by the signal, which is 130 to a shell, too
    assert process.returncode in (130, -signal.SIGINT)
    assert said in ("cosim: interrupted\n", "")  # the second once it steps


@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.slow
@pytest.mark.parametrize("sent", [signal.SIGINT, signal.SIGTERM, getattr(signal, "SIGHUP", None)])
def test_ctrl_c_leaves_a_readable_run(tmp_path, sent):
    """The process as a user has it: from the start of stepping to a report, no traceback."""
    out = tmp_path / "run"
    process = cosim("run", "paper", *BRIEF[:2], "--set", "time.duration=3000", "--out", str(out))
    while not (any(file.stat().st_size for file in out.glob("record.arrows")) or process.poll() is not None):
        time.sleep(0.02)
    process.send_signal(sent)
    printed, said = process.communicate(timeout=240)
    assert process.returncode == 130 and "interrupted" in printed and "Traceback" not in said
    assert (out / "record.parquet").exists() and (out / "report.html").exists()
