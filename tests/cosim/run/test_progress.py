"""While something is compiled, the command says so, and at no other time."""

import io
import sys
import time
from pathlib import Path

import numba
import pytest
from numba.core import event
from numba.extending import overload

from cosim.campaigns.workers.worker_pools import Processes
from cosim.command_line import cli
from cosim.run import progress
from cosim.run.progress import WORDS, CompileCounter, ProgressBar, compiling_told

PATIENCE = 120.0  # s


@pytest.fixture(autouse=True)
def often(monkeypatch, untold_compiling):
    monkeypatch.setattr(progress, "_PERIOD", 0.01)


@pytest.fixture
def seconds(monkeypatch):
    """Let a second pass between two looks."""

    class Clock:
        now = 0.0

        @classmethod
        def monotonic(cls):
            cls.now += 1.0
            return cls.now

    monkeypatch.setattr(progress, "time", Clock)


@pytest.fixture
def looks(monkeypatch):
    """Return a function that waits until there were some more looks at what is compiled."""
    count, look = [0], progress._Notice._look

    def counted(notice, since):
        look(notice, since)
        count[0] += 1

    def wait():
        before = count[0]
        wait_for(lambda: count[0] > before + 5)

    monkeypatch.setattr(progress._Notice, "_look", counted)
    return wait


class Terminal(io.StringIO):
    """A standard error that is one."""

    def isatty(self):
        return True


@pytest.fixture
def on_terminal(monkeypatch):
    """Return a function that puts a terminal in the place of standard error; pytest has its own until the test runs."""

    def put():
        stream = Terminal()
        monkeypatch.setattr(sys, "stderr", stream)
        return stream

    return put


def wait_for(condition):
    deadline = time.monotonic() + PATIENCE
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def compiled(data=None):
    """Return a block in which Numba says that it compiles."""
    return event.trigger_event("numba:compile", data=data)


def test_it_is_said_once_where_there_is_no_terminal_and_only_if_it_happens(looks):
    told = []
    with compiling_told(told.append):
        looks()
        assert told == []
        with compiled(), compiled():
            wait_for(lambda: told)
        looks()
        with compiled():
            looks()
    assert told == [WORDS]


def test_numba_itself_says_so_and_not_of_what_it_has_compiled(looks):
    told, during = [], []

    def stub():
        raise NotImplementedError

    @overload(stub)
    def _():
        if not during:
            wait_for(lambda: told)
        during.append(told[:])
        return lambda: 7.0

    function = numba.njit(lambda: stub())  # noqa: PLW0108 - compiled as it stands
    with compiling_told(told.append):
        assert function() == 7.0
    assert told == [WORDS] and during[0] == [WORDS]
    with compiling_told(told.append):
        assert function() == 7.0
        looks()
    assert told == [WORDS]


def test_what_fails_to_compile_is_over_too():
    counter = CompileCounter()
    with pytest.raises(numba.TypingError):
        numba.njit(lambda x: x.nothing)(1.0)
    assert counter.depth == 0
    counter.close()


def test_a_clock_moves_on_a_line_of_its_own_and_goes(on_terminal, seconds, looks):
    terminal = on_terminal()
    with compiling_told(pytest.fail):
        with compiled():
            wait_for(lambda: f"{WORDS} [00:12]" in terminal.getvalue())
        looks()
        before = terminal.getvalue()
        looks()
        assert terminal.getvalue() == before
    frames = before.split("\r")
    assert next(frame.strip() for frame in frames if frame.strip()).startswith(f"{WORDS} [00:0")
    assert frames[-1].strip() == "" and "\n" not in before


def test_a_clock_stands_in_the_place_of_the_bar(on_terminal, seconds):
    terminal = on_terminal()
    with compiling_told(pytest.fail):
        with ProgressBar(True, "{desc} {n:.0f}/{total:.0f}", desc="paper", total=10.0, mininterval=0.0) as bar:
            with compiled():
                wait_for(lambda: f"paper: {WORDS} [00:03]" in terminal.getvalue())
                bar.update_to(2.0)
            wait_for(lambda: terminal.getvalue().rstrip().endswith("paper 2/10"))
            bar.update_to(12.0)
    assert terminal.getvalue().rstrip().endswith("paper 10/10")
    assert terminal.getvalue().count("\n") == 1  # of the bar that stays


def test_a_bar_shows_what_other_processes_compile(on_terminal, seconds):
    terminal = on_terminal()
    elsewhere = [True]
    with compiling_told(pytest.fail):
        with ProgressBar(True, "{desc} {n}", compiling=lambda: elsewhere[0], desc="pd", total=3) as bar:
            wait_for(lambda: f"pd: {WORDS} [00:02]" in terminal.getvalue())
            elsewhere[0] = False
            wait_for(lambda: terminal.getvalue().rstrip().endswith("pd 0"))
            bar.update(3)
    assert terminal.getvalue().rstrip().endswith("pd 3")


def test_nothing_moves_where_there_is_no_terminal(capsys, looks):
    with compiling_told(lambda _: None), ProgressBar(True, "{n}", total=3) as bar, compiled():
        looks()
        bar.update(2)
    assert capsys.readouterr() == ("", "")


class Compiler:
    """A task whose flyer compiles until a file is there."""

    def __init__(self, file):
        self.file = file

    def flyer(self):
        with compiled():
            wait_for(self.file.exists)
        return self

    def fly(self, batch):
        return batch

    def close(self):
        pass


def test_a_worker_tells_that_it_compiles(tmp_path):
    crew = Processes(1, Compiler(tmp_path / "done"))
    try:
        wait_for(crew.compiling)
        Path(tmp_path / "done").touch()
        wait_for(lambda: not crew.compiling())
    finally:
        Path(tmp_path / "done").touch()
        crew.close()


@pytest.mark.parametrize(("flags", "said"), [([], f"cosim: {WORDS}\n"), (["-q"], "")])
def test_every_verb_says_it_unless_it_is_quiet(flags, said, capsys, monkeypatch):
    def verb(options):
        with compiled():
            if options.quiet:
                time.sleep(0.05)
            else:
                wait_for(lambda: progress._notice.get()._told)
        return 0

    monkeypatch.setitem(cli._VERBS, "show", verb)
    assert cli.main([*flags, "show", "paper"]) == 0
    assert capsys.readouterr() == ("", said)
