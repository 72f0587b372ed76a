"""MAVProxy, headless, with commands on standard input."""

import contextlib
import os
import re
import subprocess
import threading
import time

import pytest

from tests.cosim.mavlink.clients.conftest import commands_of, cosim_run
from tests.cosim.mavlink.stubs import free_port

pytestmark = [pytest.mark.slow, pytest.mark.timeout(900)]  # the first of them builds and installs

MODULES = "param,wp,fence,mode,arm,cmdlong,link,misc,rc,signing,output,log,ftp"
PATIENCE = 60.0  # s, for what is to be seen


class MavProxy:
    """The process, and all that it has printed."""

    def __init__(self, python, folder, port):
        self.folder, self.text = folder, ""
        self.process = subprocess.Popen(
            [python, "-u", python.parent / "mavproxy.py", f"--master=udpin:127.0.0.1:{port}",
             f"--state-basedir={folder}", f"--default-modules={MODULES}"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, cwd=folder,
            env={**os.environ, "HOME": str(folder), "MPLBACKEND": "Agg"},
        )  # fmt: skip
        self.reader = threading.Thread(target=self.read)
        self.reader.start()

    def read(self):
        for line in self.process.stdout:
            self.text += line

    def see(self, pattern, since=0):
        """Return the match of what is to be printed."""
        end = time.monotonic() + PATIENCE
        while time.monotonic() < end:
            found = re.search(pattern, self.text[since:])
            if found:
                return found
            time.sleep(0.05)
        raise AssertionError(f"{pattern!r} was not seen in:\n{self.text[-3000:]}")

    def parameters(self, count):
        """Return the text of the file that it writes after it has listed that many parameters."""
        file, end = self.folder / "mav.parm", time.monotonic() + PATIENCE
        while (text := file.read_text() if file.exists() else "").count("\n") < count and time.monotonic() < end:
            time.sleep(0.05)
        assert text.count("\n") == count
        return text

    def do(self, line, *patterns):
        """Type a line and return the matches of what is to be printed after it."""
        since = len(self.text)
        self.process.stdin.write(f"{line}\n")
        self.process.stdin.flush()
        return [self.see(pattern, since) for pattern in patterns]

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.process.stdin.close()
        try:
            self.process.wait(60)
        except subprocess.TimeoutExpired:
            self.process.kill()
        self.reader.join()
        self.process.stdout.close()


def test_mavproxy_connects_arms_changes_modes_and_lists_parameters(ardupilots_tools, tmp_path):
    python, port, folder = ardupilots_tools, free_port(), tmp_path / "run"
    with cosim_run(folder, "ardusub", f"udpout:127.0.0.1:{port}"), MavProxy(python, tmp_path, port) as mavproxy:
        mavproxy.see(r"Detected vehicle 1:1")
        received = int(mavproxy.see(r"Received (\d+) parameters").group(1))
        assert received > 10
        for attempt in range(3):  # it gives up asking for what a busy machine has lost
            with contextlib.suppress(AssertionError) if attempt < 2 else contextlib.nullcontext():
                mavproxy.do("param fetch", rf"Received {received} parameters")
                break
        parameters = mavproxy.parameters(received)

        mavproxy.do("disarm", "DISARMED")
        mavproxy.do("arm throttle", "COMPONENT_ARM_DISARM: ACCEPTED", r"(?<!DIS)ARMED")
        for mode in ("POSHOLD", "MANUAL", "STABILIZE", "ALT_HOLD", "SURFACE", "GUIDED"):
            mavproxy.do(f"mode {mode}", f"Mode {mode}")
        name, before = re.search(r"^(\S+)\s+([\d.]+)", parameters, re.MULTILINE).groups()
        mavproxy.do(f"param show {name}", rf"{name}\s+{float(before):.6f}")
        mavproxy.do("wp list", r"Requesting 0 waypoints|Have 0 waypoints|Saved \d+ waypoints|\d+ waypoints")
        mavproxy.do("ftp list @PARAM", r"param\.pck\s+\d+")  # it drops replies of a session that is not its own
        mavproxy.do("log list", "No logs")
        mavproxy.do("status", r"MAV Errors: 0", r"SYS_STATUS", r"HOME_POSITION")
        text = mavproxy.text.lower()
    assert "fence breach" not in text
    assert "traceback" not in text and "error in" not in text
    assert commands_of(folder)[:2] == ["arm", "arm"] and commands_of(folder).count("set_mode") == 6
