"""Every command of README and tutorial, as printed: ``python -m tests.docs.tour``, or ``make tour``.

The pages themselves are read: no flag is added, no file is given, and nothing is set up beforehand. Commands run one
after another in a shell, in a fresh clone of the last commit, with no environment but the one they make and with empty
caches. Blocks of Python run as a script of their own; a block that is to be put into a file is. What goes on until
somebody stops it gets Ctrl-C and must end as documented. The table says what happened to each; the exit status is 1 if
anything failed.

Settings and cache of pip are the user's: an index of one's own is found, and nothing is downloaded twice.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from tests.docs.commands import commands
from tests.docs.directives import of_command
from tests.docs.pages import ROOT, Block, blocks, page_name

PAGES = (ROOT / "README.md", ROOT / "docs" / "tutorial.md")

# a block that begins so sets up an environment, and does so in a clone of its own
FRESH = ("make run", "python3 -m venv .venv")


@dataclass(frozen=True)
class Endless:
    """A command that runs until Ctrl-C, sent some seconds after its sign of readiness."""

    begins: str
    seconds: float
    says: str = ""
    writes: str = ""  # a pattern of files


ENDLESS = (
    Endless("cosim run harbour", 10.0, writes="runs/harbour-*/record.arrows"),  # ten minutes, at real time
    Endless("cosim mavlink listen", 5.0, says="no vehicle found"),
    Endless("cosim sitl", 5.0, says="waiting for ArduPilot"),
)
INTERRUPTED = 130  # docs/reference/command-line.md

# what the page says ends with another status than 0
STATUS = (
    ("cosim check paper", "1"),  # "Verdict: 3 of 15 fail"
    ("cosim check mine.toml --set goal.center=[3.0,0.2,3.0]", "1"),  # "It ends with 1 then, and says so"
)

LIMIT = 3600.0  # s, for anything: what takes longer hangs
PATIENCE = 120.0  # s after Ctrl-C: a run still writes its report
_LOOK = 0.1  # s
_TAIL = 25  # lines of what failed
_KEPT = ("HOME", "LANG", "LC_ALL", "LOGNAME", "SYSTEMROOT", "TERM", "TMPDIR", "USER")
_OF_NETWORK = ("PIP_", "SSL_", "REQUESTS_", "HTTP_", "HTTPS_", "NO_PROXY", "http_", "https_", "no_proxy")


@dataclass(frozen=True)
class Outcome:
    """The result of a command: `why` is empty on success."""

    seconds: float
    status: int
    why: str
    note: str = ""
    output: str = ""


class Reader:
    """A shell in a folder; where its commands go and the variables they set live on from one to the next.

    Parameters
    ----------
    folder : Path
        Where it begins.
    scratch : Path
        An empty folder of its own: for caches, and for what it must remember.
    """

    def __init__(self, folder: Path, scratch: Path) -> None:
        self._folder, self._state, self._scratch = folder, scratch / "state", scratch
        self._output = scratch / "output"
        variables = " ".join(f"{name}={shlex.quote(value)}" for name, value in environment(scratch).items())
        self._state.write_text(f"cd {shlex.quote(str(folder))}\nexport {variables}\n", encoding="utf-8")

    def run(self, text: str, expected: int = 0, endless: Endless | None = None) -> Outcome:
        """Run a command as it stands, and judge how it ended."""
        script = self._scratch / "command"
        # Ctrl-C reaches the command, and the shell notes how that ends
        state = shlex.quote(str(self._state))
        remembered = f"{{ echo cd \"'$PWD'\"; export -p; }} > {state}"
        script.write_text(f"trap : INT\n. {state}\n{text}\nended=$?\n{remembered}\nexit $ended\n", encoding="utf-8")
        begun = time.monotonic()
        with open(self._output, "wb") as sink:
            process = subprocess.Popen(
                ["sh", script], stdin=subprocess.DEVNULL, stdout=sink, stderr=subprocess.STDOUT,
                env={}, start_new_session=True,
            )  # fmt: skip
        note = why = ""
        try:
            if endless is not None and self._under_way(process, endless):
                note = f"stopped by Ctrl-C after {time.monotonic() - begun:.0f} s"
                os.killpg(process.pid, signal.SIGINT)
                process.wait(PATIENCE)
            status = process.wait(max(0.0, begun + LIMIT - time.monotonic()))
        except subprocess.TimeoutExpired:
            why = f"did not end within {PATIENCE:g} s of Ctrl-C" if note else f"still there after {LIMIT:g} s"
        finally:
            with contextlib.suppress(ProcessLookupError):  # nor is anything left behind
                os.killpg(process.pid, signal.SIGKILL)
            status = process.wait()
        output = self._output.read_text(encoding="utf-8", errors="replace")
        if endless is not None and not note:
            why = why or "ended by itself"
        wanted = INTERRUPTED if note else expected
        if not why and status != wanted:
            why = f"expected {wanted}"
        return Outcome(time.monotonic() - begun, status, why, note, output)

    def _under_way(self, process: subprocess.Popen[bytes], endless: Endless) -> bool:
        """Wait for the sign of readiness and some seconds more; return whether it still runs."""
        until = time.monotonic() + LIMIT
        seen = False
        while process.poll() is None and time.monotonic() < until:
            if not seen and self._sign(endless):
                seen, until = True, time.monotonic() + endless.seconds
            time.sleep(_LOOK)
        return seen and process.poll() is None

    def _sign(self, endless: Endless) -> bool:
        if endless.writes:
            return any(self._folder.glob(endless.writes))
        return endless.says in self._output.read_text(encoding="utf-8", errors="replace")


def environment(scratch: Path) -> dict[str, str]:
    """Return the variables that a reader begins with: no environment of Python is active, all caches are empty."""
    found = {name: value for name, value in os.environ.items() if name in _KEPT or name.startswith(_OF_NETWORK)}
    home = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
    ours = Path(sys.prefix).resolve()
    path = [place for place in os.environ["PATH"].split(os.pathsep) if not Path(place).resolve().is_relative_to(ours)]
    return {
        "PIP_CACHE_DIR": str(home / "pip"),
        **found,
        "PATH": os.pathsep.join(path),
        "XDG_CACHE_HOME": str(scratch / "cache"),
    }


@dataclass(frozen=True)
class Step:
    """One thing that a reader does: the words say what is looked up for it, `shown` stands in the table."""

    line: int
    text: str
    words: list[str]
    shown: str


def steps(block: Block) -> Iterator[Step]:
    """Return what a block asks a reader to do."""
    if block.language == "sh":
        for command in commands(block):
            shown = command.text.partition(" #")[0].strip()
            yield Step(command.line, command.text, command.words, shown)
    elif block.language == "python":
        yield Step(block.line, f"python - <<'END'\n{block.text}END", [], "the block of Python")
    elif name := block.directives.file:  # which the text beside it names
        yield Step(block.line, f"cat > {shlex.quote(name)} <<'END'\n{block.text}END", [], f"the block, put into {name}")


class Tour:
    """The tour through some pages; `failed` counts what was not as the pages say.

    Parameters
    ----------
    folder : Path
        Empty, for clones and caches.
    source : str
        What git clones.
    """

    def __init__(self, folder: Path, source: str = str(ROOT)) -> None:
        self._folder, self._source, self._clones = folder, source, 0
        self.failed = self.done = 0

    def page(self, page: Path) -> None:
        """Run the commands of a page in a fresh clone."""
        reader = self._fresh()
        used = False
        for block in blocks(page):
            for step in steps(block):
                if used and of_command(((begin, begin) for begin in FRESH), step.words):
                    reader = self._fresh()
                used = True
                status = int((of_command(STATUS, step.words) or ["0"])[-1])
                endless = next((one for one in ENDLESS if of_command([(one.begins, "")], step.words)), None)
                self._note(f"{page_name(page)}:{step.line}", step.shown, reader.run(step.text, status, endless))

    def _fresh(self) -> Reader:
        """Return a reader before a clone of its own; that of the one before is removed."""
        shutil.rmtree(self._folder / str(self._clones), ignore_errors=True)
        self._clones += 1
        scratch = self._folder / str(self._clones)
        clone = scratch / "clone"
        subprocess.run(["git", "clone", "--quiet", self._source, clone], check=True)
        return Reader(clone, scratch)

    def _note(self, where: str, what: str, outcome: Outcome) -> None:
        self.done += 1
        self.failed += bool(outcome.why)
        verdict = f"FAILED: {outcome.why}" if outcome.why else outcome.note or "ok"
        _say(f"{outcome.seconds:8.1f} s  {outcome.status:4d}  {where:20}  {what}  [{verdict}]")
        if outcome.why:
            for line in outcome.output.splitlines()[-_TAIL:]:
                _say(f"    | {line}")


def _say(line: str) -> None:
    sys.stdout.write(f"{line}\n")
    sys.stdout.flush()


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the tour."""
    parser = argparse.ArgumentParser(prog="python -m tests.docs.tour", description=(__doc__ or "").partition("\n\n")[0])
    parser.add_argument("pages", nargs="*", type=Path, default=PAGES, help="default: README.md, docs/tutorial.md")
    options = parser.parse_args(arguments)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # else what is started from here may not heed it
    with tempfile.TemporaryDirectory(prefix="tour-", ignore_cleanup_errors=True) as folder:
        tour = Tour(Path(folder))
        begun = time.monotonic()
        for page in options.pages:
            tour.page(page.resolve())
    _say(f"{time.monotonic() - begun:8.1f} s  {tour.done} commands, {tour.failed} failed")
    return int(tour.failed > 0)


if __name__ == "__main__":
    sys.exit(main())
