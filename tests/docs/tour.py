"""Every command of README and tutorial, as printed: ``python -m tests.docs.tour``, or ``make tour``.

No flag is added and nothing is set up beforehand. Commands run one after another in a shell, in a fresh clone of the
last commit, with empty caches. What runs until somebody stops it gets Ctrl-C and must end as documented.
"""

from __future__ import annotations

import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from tests.docs.commands import commands
from tests.docs.directives import of_command
from tests.docs.pages import ROOT, Block, blocks, page_name

PAGES = (ROOT / "README.md", ROOT / "docs" / "tutorial.md")
FRESH = (("make run", ""), ("python3 -m venv .venv", ""))  # these set up an environment, each in a clone of its own
# seconds until Ctrl-C, after which they end with INTERRUPTED; and what they have printed by then
ENDLESS = (
    ("cosim run harbour", "90 runs/harbour"), ("cosim mavlink listen", "30 no vehicle found"),
    ("cosim sitl", "60 waiting for ArduPilot"),
)  # fmt: skip
INTERRUPTED = 130  # docs/reference/command-line.md
# what the page says ends with another status than 0
STATUS = (("cosim check paper", "1"), ("cosim check mine.toml --set goal.center=[3.0,0.2,3.0]", "1"))
LIMIT = 3600.0  # s, for any command
PATIENCE = 120.0  # s after Ctrl-C: a run still writes its report
_KEPT = ("HOME", "LANG", "LC_ALL", "LOGNAME", "TERM", "TMPDIR", "USER")
_NETWORK = ("PIP_", "SSL_", "REQUESTS_", "HTTP_", "HTTPS_", "NO_PROXY", "http_", "https_", "no_proxy")


def environment(cache: Path) -> dict[str, str]:
    """Return the variables that a reader begins with: no Python environment is active, caches are empty."""
    kept = {name: value for name, value in os.environ.items() if name in _KEPT or name.startswith(_NETWORK)}
    own = Path(sys.prefix).resolve()
    path = [folder for folder in os.environ["PATH"].split(os.pathsep) if not Path(folder).resolve().is_relative_to(own)]
    pip = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return {"PIP_CACHE_DIR": f"{pip}/pip", **kept, "PATH": os.pathsep.join(path), "XDG_CACHE_HOME": str(cache)}


class Shell:
    """A shell in a clone; its folder and variables last from one command to the next."""

    def __init__(self, scratch: Path, source: str) -> None:
        clone = scratch / "clone"
        subprocess.run(["git", "clone", "--quiet", source, clone], check=True)
        self._scratch, self._state = scratch, scratch / "state"
        variables = " ".join(f"{name}={shlex.quote(value)}" for name, value in environment(scratch / "cache").items())
        self._state.write_text(f"cd {shlex.quote(str(clone))}\nexport {variables}\n", encoding="utf-8")

    def run(self, text: str, seconds: float | None = None) -> tuple[int, str]:
        """Run a command, with Ctrl-C after some seconds where given; return its status and output."""
        script, output, state = self._scratch / "command", self._scratch / "output", shlex.quote(str(self._state))
        save = f"{{ echo cd \"'$PWD'\"; export -p; }} > {state}"
        # Ctrl-C reaches the command, and the shell notes how that ends
        script.write_text(f"trap : INT\n. {state}\n{text}\nended=$?\n{save}\nexit $ended\n", encoding="utf-8")
        with output.open("wb") as sink:
            process = subprocess.Popen(
                ["sh", script], stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT,
                env={}, start_new_session=True,
            )  # fmt: skip
        try:
            with contextlib.suppress(subprocess.TimeoutExpired):
                process.wait(seconds or LIMIT)
            if seconds and process.poll() is None:
                os.killpg(process.pid, signal.SIGINT)
                with contextlib.suppress(subprocess.TimeoutExpired):
                    process.wait(PATIENCE)
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
        return process.wait(), output.read_text(encoding="utf-8", errors="replace")


def steps(block: Block) -> Iterator[tuple[int, str, list[str]]]:
    """Yield the line, the shell's text and the words of each thing that a block asks a reader to do."""
    if block.language == "sh":
        yield from ((command.line, command.text, command.words) for command in commands(block))
    elif block.language == "python":
        yield block.line, f"python - <<'END'\n{block.text}END", []
    elif name := block.directives.file:  # which the text beside it names
        yield block.line, f"cat > {shlex.quote(name)} <<'END'\n{block.text}END", []


def run_page(page: Path, source: str = str(ROOT)) -> int:
    """Run the commands of a page, print how each ended, and return how many failed."""
    failed = 0
    shell = None
    with tempfile.TemporaryDirectory(prefix="tour-", ignore_cleanup_errors=True) as folder:
        for block in blocks(page):
            for line, text, words in steps(block):
                if shell is None or of_command(FRESH, words):
                    for former in Path(folder).iterdir():
                        shutil.rmtree(former, ignore_errors=True)
                    shell = Shell(Path(tempfile.mkdtemp(dir=folder)), source)
                limit, _, sign = next(iter(of_command(ENDLESS, words)), "").partition(" ")
                seconds = float(limit) if limit else None
                expected = INTERRUPTED if seconds else next(map(int, of_command(STATUS, words)), 0)
                begun = time.monotonic()
                status, output = shell.run(text, seconds)
                ok = status == expected and sign in output
                verdict = "ok" if ok else f"FAILED: expected {expected}" + f" and {sign!r}" * (status == expected)
                failed += not ok
                where = f"{page_name(page)}:{line}"
                sys.stdout.write(f"{time.monotonic() - begun:8.1f} s {status:4d}  {where}  {text}  [{verdict}]\n")
                if not ok:
                    sys.stdout.writelines(f"    | {shown}\n" for shown in output.splitlines()[-25:])
                sys.stdout.flush()
    return failed


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # else what is started from here may ignore it
    sys.exit(int(sum(run_page(Path(page).resolve()) for page in sys.argv[1:] or PAGES) > 0))
