"""The tour: it runs a page's commands as a reader would, and failures are reported."""

import itertools
import re
import shutil
import subprocess

import pytest

from tests.docs import tour

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git")


@pytest.fixture
def go(tmp_path, monkeypatch, capsys):
    """Return a function that goes through a page and returns what failed, and what the table says."""
    source = tmp_path / "source"
    source.mkdir()
    (source / "given.txt").write_text("of the clone\n")
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(source)]
    for words in (["init", "--quiet"], ["add", "."], ["commit", "--quiet", "--message", "a"]):
        subprocess.run([*git, *words], check=True)
    endless = tour.Endless("sleep 1000", 0.0, writes="wait*"), tour.Endless("true for-ever", 0.0, says="x")
    monkeypatch.setattr(
        tour, "ENDLESS", (*endless, *(tour.Endless(begins, 0.0, says="ready") for begins in ("trap", "sh -c")))
    )
    monkeypatch.setattr(tour, "STATUS", (("false", "1"),))

    number = itertools.count()

    def run(text):
        page = tmp_path / "page.md"
        page.write_text(text)
        whole = tour.Tour(tmp_path / f"tour-{next(number)}", str(source))
        whole.page(page)
        return whole.failed, capsys.readouterr().out

    return run


def sh(*lines):
    return "\n".join(["```sh", *lines, "```", ""])


def test_shell_state_persists_between_commands(go):
    failed, table = go(
        sh("export A='1 2'", "mkdir there", "cd there   # a comment", "echo $A > a.txt")
        + "\nwords\n\n"
        + sh('test "$(cat a.txt)" = "1 2"', "test -f ../given.txt", "false")
        + '\n<!-- file: b.toml -->\n```toml\na = "$A"\n```\n\n'
        + sh("grep -F '\"$A\"' b.toml")
    )
    assert (failed, table.count("[ok]")) == (0, 9), table
    assert re.search(r"^ +\d+\.\d s +1  page.md:13 +false  \[ok\]$", table, re.M)
    assert "page.md:4 " in table and "  cd there  [ok]" in table


def test_inherited_environment_variables_are_removed(go, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/nowhere")
    assert go(sh('test -z "$PYTHONPATH$NUMBA_CACHE_DIR$VIRTUAL_ENV"', 'test ! -e "$XDG_CACHE_HOME"'))[0] == 0


def test_environment_setup_starts_in_a_fresh_clone(go, monkeypatch):
    monkeypatch.setattr(tour, "FRESH", ("mkdir env",))
    assert go(sh("mkdir env", "mkdir of-the-first", "mkdir env", "test ! -e of-the-first", "test -f given.txt"))[0] == 0


def test_failed_command_is_reported_with_its_output(go):
    failed, table = go(sh("cat nowhere.txt", "true"))
    assert failed == 1
    assert re.search(r"\[FAILED: expected 0\]\n    \| .*nowhere.txt.*\n", table) and "[ok]" in table


def test_long_running_commands_are_interrupted_and_their_status_checked(go):
    failed, table = go(sh("touch waiting", "sleep 1000"))
    assert failed == 0 and re.search(r" 130 .*sleep 1000  \[stopped by Ctrl-C after \d s\]", table)
    failed, table = go(sh("trap 'exit 7' INT; echo ready; sleep 1000"))
    assert failed == 1 and "[FAILED: expected 130]" in table


def test_long_running_command_that_exits_fails(go):
    failed, table = go(sh("true for-ever"))
    assert failed == 1 and "[FAILED: ended by itself]" in table


@pytest.mark.medium
def test_hanging_command_is_killed(go, monkeypatch):
    monkeypatch.setattr(tour, "LIMIT", 0.2)
    failed, table = go(sh("sh -c 'sleep 1000'"))
    assert failed == 1 and "[FAILED: still there after 0.2 s]" in table
    monkeypatch.setattr(tour, "LIMIT", 60.0)
    monkeypatch.setattr(tour, "PATIENCE", 0.2)
    failed, table = go(sh("sh -c 'trap true INT; echo ready; while true; do sleep 1; done'"))
    assert failed == 1 and "[FAILED: did not end within 0.2 s of Ctrl-C]" in table
