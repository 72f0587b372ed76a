"""A second browser: Firefox without a window, driven over its own Marionette protocol."""

from __future__ import annotations

import base64
import json
import shutil
import socket
import subprocess
import time
from pathlib import Path

FIREFOX = shutil.which("firefox-esr") or shutil.which("firefox")
_PATIENCE = 120.0  # s


class Firefox:
    """One Firefox, one page at a time."""

    def __init__(self, profile):
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            port = free.getsockname()[1]
        Path(profile, "user.js").write_text(f'user_pref("marionette.port", {port});\n')
        command = [FIREFOX, "--headless", "--marionette", "--no-remote", "--profile", str(profile)]
        self._process = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self._socket, self._count = self._connected(port), 0
        self._receive()
        self._do("WebDriver:NewSession", capabilities={"timeouts": {"script": int(1e3 * _PATIENCE)}})

    def open(self, file, size=(1280, 900)):
        """Open a page from disk, in a window whose page has a size [CSS pixels]."""
        self._do("WebDriver:SetWindowRect", width=size[0], height=size[1])
        self._do("WebDriver:Navigate", url=Path(file).absolute().as_uri())
        self.wait_until("window.subreach?.ready === true")

    def js(self, script, *arguments):
        return self._do("WebDriver:ExecuteScript", script=script, args=list(arguments))["value"]

    def wait_until(self, condition):
        end = time.monotonic() + _PATIENCE
        while not self.js(f"return Boolean({condition})"):
            assert time.monotonic() < end, condition
            time.sleep(0.05)

    def shoot(self, file):
        Path(file).write_bytes(base64.b64decode(self._do("WebDriver:TakeScreenshot", full=False)["value"]))

    def close(self):
        self._socket.close()
        self._process.terminate()
        self._process.wait(_PATIENCE)

    def _connected(self, port):
        end = time.monotonic() + _PATIENCE
        while True:
            try:
                return socket.create_connection(("127.0.0.1", port), _PATIENCE)
            except OSError:
                assert time.monotonic() < end and self._process.poll() is None, "Firefox does not answer"
                time.sleep(0.1)

    def _do(self, command, **parameters):
        self._count += 1
        text = json.dumps([0, self._count, command, parameters]).encode()
        self._socket.sendall(b"%d:%s" % (len(text), text))
        _, _, error, result = self._receive()
        assert error is None, error
        return result

    def _receive(self):
        digits = b""
        while not digits.endswith(b":"):
            digits += self._socket.recv(1)
        left, parts = int(digits[:-1]), []
        while left:
            part = self._socket.recv(left)
            assert part, "Firefox has ended"
            parts.append(part)
            left -= len(part)
        return json.loads(b"".join(parts))
