"""Every verb with ``--out`` ends on a full disk with one line that names the place, and can be repeated."""

import argparse
import contextlib
import io
import shlex
import shutil
from pathlib import Path

import pytest

from cosim.campaigns.scenes.generator import generate_scenes
from cosim.command_line.cli import _parser, main
from cosim.run.run import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.cosim.command_line.test_interrupted import LOG, MAP
from tests.faults import FAIL_ON, arm, call_with_faults, count, needs_faults

BRIEF = "--set time.duration=0.1 --set arbiter.engine=closed"
WORDS = {  # smallest commands; {out} is what they write
    "run": f"run paper {BRIEF} --no-report --out {{out}}",
    "replay": "replay run --out {out}.html",
    "import": "import dive.csv --vehicle bluerov2_heavy --map dive.toml --no-report --out {out}",
    "export": "export run --to csv --out {out}.csv",
    "package": "package paper --set arbiter.engine=closed --out {out}.ssp",
    "scenes": "scenes --count 3 --seed 0 --out {out}.jsonl",
    "campaign": "campaign s.jsonl --law pd --replays 0 --out {out}",
    "compare": "compare s.jsonl --laws pd,ismail_dunnigan --replays 0 --out {out}",
    "ablate": "ablate s.jsonl --variants net-weight --replays 0 --out {out}",
    "sweep": f"sweep paper --vary initial.position.1=-2:2 --samples 2 {BRIEF} --replays 1 --out {{out}}",
    "rerun": "rerun sweep 0 --out {out}",
    "falsify": f"falsify paper --vary initial.position.1=-2:2 --budget 2 {BRIEF} --replays 1 --out {{out}}",
}
ELSEWHERE = {"excite", "identify", "sitl", "companion"}  # two take minutes, two need a vehicle on a link


def call(words):
    with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(io.StringIO()):
        status = main(words)
    return status, said.getvalue()


def fill_disk_at_each_call(folder, command):
    Path("dive.csv").write_text(LOG)
    Path("dive.toml").write_text(MAP)
    Path("s.jsonl").write_text("\n".join(generate_scenes(2)))
    run_scenario(load_scenario("paper", ["time.duration=0.1"]), "run", report=False)
    if command.startswith("rerun"):
        assert call(shlex.split(WORDS["sweep"].format(out="sweep")))[0] == 0
    place = Path(folder, "place").resolve()
    words = [*shlex.split(command.format(out=place / "made")), "-q"]

    def fresh():
        arm("", 0)
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir()

    fresh()
    arm(place, 0)
    status, said = call(words)
    assert (status, said) == (0, ""), said
    total = count()
    for n in sorted({1, 2, 3, *range(4, total, max(1, total // 3))}):
        fresh()
        arm(place, n, FAIL_ON)
        status, said = call(words)
        arm("", 0)
        if n == total and status == 0:  # a rename, for which the disk has room
            continue
        assert status == 2, (n, said)
        (line,) = said.splitlines()
        assert line.startswith("cosim: ") and str(place / "made") in line and "No space left" in line, (n, line)
        assert not [file for file in place.rglob(".*") if file.name != ".lock"], n
        if "kept, and `cosim report" not in line:
            assert call(words) == (0, ""), n


@needs_faults
@pytest.mark.timeout(1200)
@pytest.mark.slow
@pytest.mark.parametrize("command", WORDS.values(), ids=WORDS)
def test_full_disk_is_one_line_that_names_the_place(tmp_path, command):
    call_with_faults(fill_disk_at_each_call, tmp_path, command)


def test_every_verb_that_writes_is_covered():
    (verbs,) = (action for action in _parser()._actions if isinstance(action, argparse._SubParsersAction))
    writing = {name for name, verb in verbs.choices.items() if "--out" in verb._option_string_actions}
    assert writing == WORDS.keys() | ELSEWHERE


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="there is no device that is full")
@pytest.mark.parametrize(
    "words", ["show paper", "list", "scenes --count 3 --seed 0", "completion bash", "help falsify"]
)
def test_full_standard_output_is_named(capsys, words):
    with open("/dev/full", "w") as full, contextlib.redirect_stdout(full):
        assert main(shlex.split(words)) == 2
        with contextlib.suppress(OSError):
            full.close()
    assert capsys.readouterr().err == "cosim: standard output: No space left on device\n"
