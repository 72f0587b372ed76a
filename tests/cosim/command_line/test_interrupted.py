"""Verbs that are interrupted at any moment can be repeated as their line says."""

import contextlib
import io
import shlex
import shutil
from pathlib import Path

import pytest

from cosim.command_line.cli import main
from cosim.run.run import run_scenario
from cosim.scenario.scenario import load_scenario
from tests.faults import INTERRUPT, arm, call_with_faults, count, needs_faults

LOG = "t,depth,yaw,pitch,roll\n" + "".join(f"{0.1 * k},{0.02 * k},0,0,0\n" for k in range(30))
MAP = """
time = { column = "t" }
depth = { columns = ["depth"] }
attitude = { columns = ["yaw", "pitch", "roll"], euler = "ZYX" }
"""
WORDS = {
    "import": "import dive.csv --vehicle bluerov2_heavy --map dive.toml --no-report --out",
    "import with report": "import dive.csv --vehicle bluerov2_heavy --map dive.toml --out",
    "csv": "export run --to csv --out",
    "mcap": "export run --to mcap --out",
}
LINE = "cosim: interrupted; nothing is written, and the same command begins again\n"


def call(words):
    with contextlib.redirect_stderr(io.StringIO()) as said, contextlib.redirect_stdout(io.StringIO()):
        status = main(words)
    return status, said.getvalue()


def interrupt_each_call(folder, command):
    Path("dive.csv").write_text(LOG)
    Path("dive.toml").write_text(MAP)
    run_scenario(load_scenario("paper", ["time.duration=0.1"]), "run", report=False)
    out = Path(folder, "out").resolve()
    name = "made.csv" if "csv --out" in command else "made"
    words = [*shlex.split(command), str(out / name), "-q"]

    def fresh():
        arm("", 0)
        shutil.rmtree(out, ignore_errors=True)
        out.mkdir()

    fresh()
    arm(out, 0)
    assert call(words) == (0, "")
    total, interrupted = count(), 0
    for n in sorted({*range(1, 5), *range(5, total, max(1, total // 4)), *range(total - 3, total + 1)} - {0, -1}):
        fresh()
        arm(out, n, INTERRUPT)
        status, said = call(words)
        arm("", 0)
        if status == 0:  # after the last call
            continue
        interrupted += 1
        assert (status, said) == (130, LINE), (n, said)
        assert not list(out.iterdir()), n
        assert call(words) == (0, ""), n
    assert interrupted > 4


@needs_faults
@pytest.mark.timeout(1200)
@pytest.mark.slow
@pytest.mark.parametrize("command", WORDS.values(), ids=WORDS)
def test_interrupted_verb_is_repeated_by_the_same_command(tmp_path, command):
    call_with_faults(interrupt_each_call, tmp_path, command)
