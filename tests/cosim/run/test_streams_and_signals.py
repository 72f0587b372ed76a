"""Streams that are closed, readers that go away, signals that end a command, and texts and files that are traps.

Each costs one clear line and the right exit status: no traceback, no hang, nothing half-written.
"""

import contextlib
import os
import pty
import select
import signal
import socket
import subprocess
import sys
import termios
import time
from pathlib import Path

import pytest

import fuzzy_arbiter.__main__
import plant_fmu.__main__
from cosim.command_line.cli import _parser, all_verbs, main
from cosim.command_line.process import kills_interrupt
from cosim.mavlink.wire.endpoint import Endpoint
from cosim.mavlink.wire.options import MavlinkOptions
from cosim.results.record import load_record
from cosim.run.run_folder import report_again
from tests.cosim.mavlink.running import running_vehicle
from tests.docs.peers import flying

pytestmark = pytest.mark.skipif(os.name != "posix", reason="signals, pipes and devices of POSIX")

QUICK = ["--set", "arbiter.engine=closed", "--set", "time.duration=0.02"]
MAINS = {"cosim": main, "plant_fmu": plant_fmu.__main__.main, "fuzzy_arbiter": fuzzy_arbiter.__main__.main}
ROOT = Path(__file__).parents[3]
# of each program, what prints something
PRINTS = {"cosim": ["show"], "plant_fmu": ["list"], "fuzzy_arbiter": ["show", "section-vi"]}


# ---- standard output closed --------------------------------------------------------------------------------------


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("program", "words"),
    [("cosim", "run paper"), ("cosim", "--help"), ("plant_fmu", "list"), ("fuzzy_arbiter", "show")],
)
def test_process_without_standard_output_exits_with_2_and_does_no_work(program, words, tmp_path):
    command = f"{sys.executable} -m {program} {words} >&-"
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        command, shell=True, stderr=subprocess.PIPE, cwd=tmp_path, env=environment, text=True, check=False
    )
    assert done.returncode == 2 and not list(tmp_path.iterdir())
    assert done.stderr == f"{program}: standard output is closed; expected it open, such as on /dev/null\n"


@pytest.mark.parametrize(
    ("program", "words"),
    [("cosim", ["show", "x"]), ("plant_fmu", ["docs", "--vehicle", "x"]), ("fuzzy_arbiter", ["show", "x"])],
)
def test_without_standard_error_messages_do_not_enter_the_output(program, words, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stderr", None)
    assert MAINS[program](words) == 2
    assert capsys.readouterr().out == ""


def test_closed_standard_input_is_rejected(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(sys, "stdin", None)
    assert main(["campaign", "-", "--law", "ismail_dunnigan", "--out", str(tmp_path / "out")]) == 2
    assert capsys.readouterr() == ("", "cosim: standard input: is closed\n")
    assert list(tmp_path.iterdir()) == []


@pytest.mark.medium(fast=1)
@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="needs a device that is always full")
@pytest.mark.parametrize("program", MAINS)
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_full_standard_output_gives_one_line_error(program, unbuffered):
    with open("/dev/full", "wb") as full:
        command, buffered = (
            [sys.executable, "-m", program, *PRINTS[program]],
            os.environ | {"PYTHONUNBUFFERED": unbuffered},
        )
        done = subprocess.run(command, stdout=full, stderr=subprocess.PIPE, env=buffered, text=True, check=False)
    assert (done.returncode, done.stderr) == (2, f"{program}: standard output: No space left on device\n")


# ---- texts of --set that are deep, or long -----------------------------------------------------------------------

DEEP = ".".join("a" for _ in range(5000))
SETTINGS = {
    "a deep key": f"{DEEP}=1",
    "a deep key in a table": f"goal.{DEEP}=1",
    "a deep parameter": f"plant.parameters.{DEEP}=1",
    "open brackets": f"limit.force={'[' * 5000}",
    "brackets": f"limit.force={'[' * 5000}{']' * 5000}",
    "brackets that Python can parse": f"goal.center={'[' * 300}1{']' * 300}",
    "tables": f"goal={'{a=' * 5000}1{'}' * 5000}",
    "a deep key in a value": f"goal={{{DEEP}=1}}",
    "digits": f"limit.force={'9' * 5000}",
    "digits for a region": f"regions.{'9' * 5000}.gain=1",
    "no value": "x" * 5000,
    "two lines": "title=1\nvehicle=2",
}


@pytest.mark.medium(fast=11)
@pytest.mark.parametrize("setting", SETTINGS.values(), ids=SETTINGS)
@pytest.mark.parametrize(
    "words",
    [["show", "paper"], ["run", "paper", "--out", "out"], ["check", "paper"], ["export", "paper", "--to", "ssp"],
     ["sweep", "paper", "--vary", "arbiter.ramp=0.1:0.2", "--samples", "2", "--out", "out"],
     ["sitl", "--port", "9113", "--timeout", "1", "--out", "out"]],
    ids=lambda words: words[0],
)  # fmt: skip
def test_deep_or_long_setting_gives_one_line_error(words, setting, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--set", setting]) == 2
    said = capsys.readouterr()
    line = said.err.splitlines()[-1]  # sitl waits first
    assert said.out == "" and line.startswith("cosim: ") and "--set" in line and len(line) < 400
    assert "Traceback" not in said.err and list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    "words",
    [
        ["sweep", "paper", "--vary", f"{DEEP}=1:2", "--samples", "2"],
        ["sweep", "paper", "--vary", f"regions.{'9' * 5000}.gain=1:2", "--samples", "2"],
        ["sweep", "paper", "--vary", f"limit.force=1:2:{'9' * 5000}", "--design", "grid"],
        ["sweep", "paper", "--vary", f"limit.force=1:{'9' * 5000}", "--samples", "2"],
        ["campaign", "scenes.jsonl", "--law", "ismail_dunnigan", "--set", f"{DEEP}=1"],
        ["campaign", "scenes.jsonl", "--law", "ismail_dunnigan", "--set", f"k_p1={'[' * 5000}"],
        ["compare", "scenes.jsonl", "--laws", "ismail_dunnigan,pd", "--set", f"{DEEP}=1"],
        ["compare", "scenes.jsonl", "--laws", "ismail_dunnigan,pd", "--set", f"ismail_dunnigan.k_p1={'{a=' * 5000}"],
    ],
    ids=lambda words: " ".join(words)[:40],
)
def test_other_text_settings_give_one_line_errors(words, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert main([*words, "--out", "out"]) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith("cosim: ") and said.err.count("\n") == 1
    assert list(tmp_path.iterdir()) == []


# ---- a closed terminal ------------------------------------------------------------------------------------------


def receive(number):
    os.kill(os.getpid(), number)
    time.sleep(60.0)


@pytest.fixture
def without_nohup():
    """Let a closed terminal end this process, also where the tests were started under nohup."""
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)
    yield
    signal.signal(signal.SIGHUP, before)


@pytest.mark.usefixtures("without_nohup")
@pytest.mark.parametrize("sent", [signal.SIGHUP, signal.SIGTERM, signal.SIGINT])
def test_every_verb_handles_termination_signals_like_ctrl_c(sent, capsys, monkeypatch):
    before = [signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT)]
    monkeypatch.setattr("cosim.command_line.show.show", lambda options: receive(sent))
    assert main(["show", "paper"]) == 130
    assert capsys.readouterr() == ("", "cosim: interrupted\n")
    assert [signal.getsignal(number) for number in (signal.SIGHUP, signal.SIGTERM, signal.SIGINT)] == before


@pytest.mark.usefixtures("without_nohup")
def test_repeated_hangup_does_not_disturb_shutdown():
    with kills_interrupt():
        with pytest.raises(KeyboardInterrupt):
            receive(signal.SIGHUP)
        for number in (signal.SIGHUP, signal.SIGTERM):  # as a shell and a service manager send them once more
            os.kill(os.getpid(), number)
            time.sleep(0.01)


def test_under_nohup_a_closed_terminal_stays_ignored():
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with kills_interrupt():
            os.kill(os.getpid(), signal.SIGHUP)
            time.sleep(0.01)
            assert signal.getsignal(signal.SIGHUP) == signal.SIG_IGN
            with pytest.raises(KeyboardInterrupt):
                receive(signal.SIGTERM)
    finally:
        signal.signal(signal.SIGHUP, before)


@pytest.mark.slow
def test_a_run_whose_terminal_is_closed_is_readable(tmp_path):
    """The process leads the session of a terminal whose other end is closed."""
    import fcntl

    out = tmp_path / "run"
    command = [sys.executable, "-m", "cosim", "run", "paper", "--out", str(out), "--set", "arbiter.engine=closed"]
    terminal, slave = pty.openpty()
    process = subprocess.Popen(
        [*command, "--set", "time.duration=3000"], stdin=slave, stdout=slave, stderr=slave, start_new_session=True,
        preexec_fn=lambda: fcntl.ioctl(0, termios.TIOCSCTTY, 0),  # noqa: PLW1509 - it is ours from then on
    )  # fmt: skip
    os.close(slave)
    with contextlib.suppress(OSError):
        while not any(file.stat().st_size for file in out.glob("record.arrows")) and process.poll() is None:
            if select.select([terminal], [], [], 0.05)[0]:
                os.read(terminal, 65536)
    os.close(terminal)
    assert process.wait(timeout=240) in (130, 2)  # the second where its last words found no terminal
    assert (out / "report.html").exists() and not (out / "record.arrows").exists()
    assert report_again(out, ())[0]["status"] == "interrupted"
    assert len(load_record(out)["time"]) > 1


# ---- a reader that goes away ------------------------------------------------------------------------------------


@pytest.fixture
def unread():
    """Return a function that makes standard output a pipe whose reader has gone, for a block."""

    @contextlib.contextmanager
    def replaced():
        reading, writing = os.pipe()
        os.close(reading)
        with open(writing, "w", encoding="utf-8") as stream, contextlib.redirect_stdout(stream):
            yield

    return replaced


@pytest.fixture(scope="session")
def flown(shipped_run):
    return str(shipped_run("paper", "arbiter.engine=closed", "time.duration=0.05").folder)


@pytest.fixture
def place(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    main(["scenes", "--count", "1", "--out", "scenes.jsonl"])
    return tmp_path


CAMPAIGN = ["--replays", "0", "--out", "out"]
VERBS = {  # {run}: a run folder
    "run": ["paper", *QUICK, "--no-report", "--out", "out"],
    "watch": ["{run}", "--once"],
    "report": ["{run}", "--format", "html"],
    "report --replay": ["{run}", "--out", "replay.html"],
    "show": ["paper"],
    "check": ["paper"],
    "import": [
        str(Path(__file__).parents[2] / "data" / "logs" / "small.tlog"), "--vehicle", "bluerov2_heavy", "--no-report",
        "--rate", "1", "--out", "out",
    ],
    "identify --excite": ["--vehicle", "odin", "--time", "30", "--out", "out"],
    "export": ["{run}", "--to", "csv"],
    "export --to ssp": ["paper", "--set", "arbiter.engine=closed"],
    "scenes": ["--count", "3"],
    "campaign": ["scenes.jsonl", "--law", "ismail_dunnigan", *CAMPAIGN],
    "compare": ["scenes.jsonl", "--laws", "ismail_dunnigan,pd", *CAMPAIGN],
    "compare --ablate": ["scenes.jsonl", "--variants", "lag", *CAMPAIGN],
    "falsify": ["plain", "--law", "pd", "--budget", "2", *CAMPAIGN],
    "identify": ["dive", "--vehicle", "bluerov2_heavy", "--free", "hydrostatics.buoyancy", "--out", "mine.toml"],
    "sweep": ["paper", *QUICK, "--vary", "initial.position.1=-1:1", "--samples", "2", *CAMPAIGN],
    "rerun": ["out", "0", "--out", "again"],
    "mavlink listen": ["udpin:127.0.0.1:14571", "--seconds", "0.1"],
    "mavlink stream": ["{run}", "--mavlink", "run.tlog", "--rate", "max"],
    "sitl": ["--port", "9114", "--timeout", "60", "--set", "time.duration=0.02", "--no-report", "--out", "out"],
    "companion": [
        "udpin:127.0.0.1:14572", "--scenario", "pipe-inspection", "--profile", "generic", "--dry-run",
        "--timeout", "60", "--scene-origin", "55.9097,-3.3203", "--set", "time.duration=0.1", "--no-report",
        "--out", "out",
    ],
    "help": [],
    "help --completion": ["bash"],
}  # fmt: skip
WAITING = {"sitl", "companion"}  # verbs that say on standard error that they wait, and who came
SLOW = {"report", "check", "identify --excite", "export --to ssp", "campaign", "compare", "compare --ablate", "falsify",
        "identify", "sweep", "rerun"}  # fmt: skip
NEED = {"watch": "rich", "falsify": "cma", "companion": "pymavlink"}
NEED |= {"mavlink listen": "pymavlink", "mavlink stream": "pymavlink"}


def test_every_verb_has_a_case():
    others = {"mavlink", "mavlink hold", "mavlink resume"}  # hold and resume print what a companion answers
    assert {verb.partition(" --")[0] for verb in VERBS} == {name for name, _ in all_verbs(_parser())} - others


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    "verb", [pytest.param(verb, marks=pytest.mark.slow) if verb in SLOW | WAITING else verb for verb in VERBS]
)
def test_closed_output_pipe_exits_with_141_for_every_verb(verb, flown, place, unread, capsys):
    if verb in NEED:
        pytest.importorskip(NEED[verb])
    if verb == "rerun":
        assert main(["sweep", *VERBS["sweep"]]) == 0
    if verb == "identify":
        assert main(["run", "depth-transit", "--set", "time.duration=25", "--no-report", "--out", "dive"]) == 0
    capsys.readouterr()
    with contextlib.ExitStack() as stack:
        if verb == "sitl":
            stack.enter_context(flying(9114))
        if verb == "companion":
            seen = Endpoint("udpout", "vehicle", host="127.0.0.1", port=14572)
            stack.enter_context(running_vehicle([seen], MavlinkOptions(commands=True)))
        stack.enter_context(unread())
        assert main([*verb.split(), *(word.format(run=flown) for word in VERBS[verb])]) == 141
    assert verb in WAITING or capsys.readouterr().err == ""


OTHERS = [
    ("plant_fmu", ["--help"]),
    ("plant_fmu", ["list"]),
    ("plant_fmu", ["docs", "--vehicle", "odin"]),
    ("plant_fmu", ["ssv", "--vehicle", "odin"]),
    ("plant_fmu", ["plot", "odin", "thrusters", "--out", "a.svg"]),
    pytest.param("plant_fmu", ["reference", "--vehicle", "odin"], marks=pytest.mark.slow),
    pytest.param("plant_fmu", ["build", "--vehicle", "odin"], marks=pytest.mark.slow),
    pytest.param("plant_fmu", ["check", "odin.fmu"], marks=pytest.mark.slow),
    ("fuzzy_arbiter", ["--help"]),
    ("fuzzy_arbiter", ["show", "section-vi"]),
    ("fuzzy_arbiter", ["eval", "section-vi", "0", "0", "0"]),
    ("fuzzy_arbiter", ["explain", "section-vi", "0", "0", "0"]),
    ("fuzzy_arbiter", ["verify", "section-vi"]),
    ("fuzzy_arbiter", ["convert", "section-vi", "a.json"]),
    ("fuzzy_arbiter", ["plot", "section-vi", "terms", "--out", "a.svg"]),
    pytest.param("fuzzy_arbiter", ["bench", "section-vi"], marks=pytest.mark.slow),
    ("cosim", ["--help"]),
    ("cosim", ["--version"]),
    ("cosim", ["run", "--help"]),
]


@pytest.mark.medium(fast=3)
@pytest.mark.parametrize(("program", "words"), OTHERS, ids=lambda value: value if isinstance(value, str) else value[0])
def test_closed_output_pipe_exits_with_141_for_other_commands(program, words, tmp_path, unread, capsys, monkeypatch):
    monkeypatch.chdir(tmp_path)
    if words == ["check", "odin.fmu"]:
        assert MAINS[program](["build", "--vehicle", "odin"]) == 0
    capsys.readouterr()
    with unread():
        assert MAINS[program](words) == 141
    assert capsys.readouterr().err == ""


@pytest.mark.medium(fast=1)
@pytest.mark.parametrize(
    ("program", "words"),
    [*PRINTS.items(), ("cosim", ["scenes", "--count", "3000"]), ("cosim", ["--help"]), ("plant_fmu", ["--help"])],
    ids=lambda value: value if isinstance(value, str) else " ".join(value),
)
@pytest.mark.parametrize("unbuffered", ["", "1"])
def test_process_with_closed_output_pipe_exits_silently_with_141(program, words, unbuffered):
    reading, writing = os.pipe()
    os.close(reading)
    command = [sys.executable, "-m", program, *words]
    environment = os.environ | {"PYTHONUNBUFFERED": unbuffered}
    done = subprocess.run(command, stdout=writing, stderr=subprocess.PIPE, env=environment, check=False)
    os.close(writing)
    assert (done.returncode, done.stderr) == (141, b"")


def test_other_broken_pipes_are_reported(capsys, monkeypatch):
    def broken(options):
        raise BrokenPipeError(32, "Broken pipe")

    monkeypatch.setattr("cosim.command_line.show.show", broken)
    assert main(["show", "paper"]) == 2
    assert capsys.readouterr() == ("", "cosim: Broken pipe\n")


# ---- pipes, devices and folders as files ------------------------------------------------------------------------


def make_trap(kind, path):
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "folder":
        path.mkdir()
    elif kind == "socket":
        with socket.socket(socket.AF_UNIX) as server:
            server.bind(str(path))
    else:
        path.symlink_to(kind)


@pytest.mark.medium(fast=17)
@pytest.mark.parametrize("kind", ["pipe", "folder", "socket", "/dev/null", "/dev/zero"])
@pytest.mark.parametrize("role", ["scenario", "base", "vehicle", "vehicle of a plant", "definition"])
def test_non_regular_file_gives_one_line_error_without_hanging(role, kind, tmp_path, capsys, monkeypatch):
    monkeypatch.chdir(os.path.realpath(tmp_path))  # short enough for the name of a socket
    make_trap(kind, tmp_path / "trap.toml")
    before = set(tmp_path.iterdir())
    if role == "base":
        (tmp_path / "mine.toml").write_text('base = "trap.toml"\n')
        before.add(tmp_path / "mine.toml")
    program, words = {
        "scenario": ("cosim", ["run", "trap.toml", "--out", "out"]),
        "base": ("cosim", ["show", "mine.toml"]),
        "vehicle": ("cosim", ["run", "paper", "--set", "vehicle=trap.toml", "--out", "out"]),
        "vehicle of a plant": ("plant_fmu", ["build", "--vehicle", "trap.toml", "--out", "out.fmu"]),
        "definition": ("fuzzy_arbiter", ["show", "trap.toml"]),
    }[role]
    assert MAINS[program](words) == 2
    said = capsys.readouterr()
    assert said.out == "" and said.err.startswith(f"{program}: ") and said.err.count("\n") == 1
    assert "trap.toml" in said.err or role == "base"
    assert set(tmp_path.iterdir()) == before
