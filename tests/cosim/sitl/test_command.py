"""``cosim sitl`` on the command line."""

import os
import re
import signal
import subprocess
import sys

import pytest

from cosim.command_line.cli import main
from cosim.results.record import load_record
from cosim.results.run_result import load_run
from cosim.run.run_folder import report_again
from tests.cosim.mavlink.stubs import free_port
from tests.cosim.sitl.stand_in import NEUTRAL, StandIn


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--vehicle", "odin"], "cosim: vehicle 'odin' has no table [autopilot], expected"),
        (["--speedup", "2"], "cosim: --speedup: expected --backend px4 with it"),
        (["--host", "0.0.0.0"], "is reachable from other machines; --allow-remote allows it"),
        (["--host", "no such host"], "cosim: --host 'no such host': is not known"),
        (["--host", "192.0.2.1", "--allow-remote"], "cosim: UDP 192.0.2.1:9002: "),
        (["--scenario", "sitll"], "did you mean 'sitl'?"),
        (["--set", "law.nmae=pd"], "law.nmae: unknown key; did you mean 'name'?"),
    ],
)  # fmt: skip
def test_user_errors_are_one_line(arguments, words, capsys):
    assert main(["sitl", *arguments]) == 2
    said = capsys.readouterr().err
    assert words in said and said.count("\n") == 1


@pytest.mark.parametrize(
    "arguments",
    ["--port 0", "--port 65536", "--timeout 0", "--timeout nan", "--record-rate -1", "--speedup 0"],
)
def test_invalid_numbers_are_rejected(arguments, capsys):
    with pytest.raises(SystemExit):
        main(["sitl", *arguments.split()])
    assert "expected a" in capsys.readouterr().err


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="sends signals")
@pytest.mark.parametrize("sent", [signal.SIGTERM, signal.SIGINT, getattr(signal, "SIGHUP", None)])
def test_signal_leaves_a_readable_run(tmp_path, sent):
    out = tmp_path / "run"
    command = [sys.executable, "-m", "cosim", "sitl", "--vehicle", "bluerov2_heavy", "--no-report"]
    command += ["--port", str(free_port()), "--out", str(out)]
    process = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    found = (re.search(r"UDP 127.0.0.1:(\d+)", line) for line in process.stderr)  # it may say first that it compiles
    port = int(next(filter(None, found)).group(1))
    with StandIn(("127.0.0.1", port)) as pilot:
        for _ in range(240):
            pilot.fly(NEUTRAL)
    process.send_signal(sent)
    printed, said = process.communicate(timeout=240)
    assert process.returncode == 130
    assert "240 steps after 0 frames at rest, 0 resent, 0 lost" in printed and "was interrupted at 0.190 s" in printed
    assert "Traceback" not in said
    assert len(load_record(out)["time"]) == 20  # 100 Hz of 0.2 s


@pytest.mark.slow
def test_regenerated_report_names_the_autopilot(serve):
    served = serve("time.duration=0.05")
    with StandIn(served.address) as pilot:
        for _ in range(60):
            pilot.fly(NEUTRAL)
    (run,) = served.outcome().runs
    report_again(run.folder)
    assert load_run(run.folder).summary["law"] == "ardupilot"
    assert "; ardupilot law." in (run.folder / "report.html").read_text()
