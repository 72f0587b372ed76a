"""The tour runs a page's commands as a reader would, and reports what fails."""

import shutil
import subprocess

import pytest

from tests.docs import tour

pytestmark = pytest.mark.skipif(shutil.which("git") is None, reason="there is no git")
PAGE = """
```sh
export A='1 2'
mkdir there
cd there   # a comment
echo $A > a.txt
```
words
```sh
test "$(cat a.txt)" = "1 2"
test -f ../given.txt
test -z "$PYTHONPATH$VIRTUAL_ENV"
false
```
<!-- file: b.toml -->
```toml
a = "$A"
```
```sh
grep -F '"$A"' b.toml
sleep 1000
test -f given.txt
cat nowhere.txt
sh -c "trap 'exit 7' INT; sleep 1000"
true for-ever
```
"""


def test_commands_run_in_order_and_failures_are_counted(tmp_path, monkeypatch, capsys):
    (tmp_path / "given.txt").write_text("of the clone\n")
    git = ["git", "-c", "user.name=a", "-c", "user.email=a@b", "-C", str(tmp_path)]
    for words in (["init", "--quiet"], ["add", "."], ["commit", "--quiet", "--message", "a"]):
        subprocess.run([*git, *words], check=True)
    monkeypatch.setenv("PYTHONPATH", "/nowhere")
    monkeypatch.setattr(tour, "ENDLESS", (("sleep", "0.2"), ("sh -c", "0.2"), ("true for-ever", "5")))
    monkeypatch.setattr(tour, "STATUS", (("false", "1"),))
    monkeypatch.setattr(tour, "FRESH", (("test -f given.txt", ""),))
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    assert tour.run_page(page, str(tmp_path)) == 3
    table = capsys.readouterr().out
    assert table.count("[ok]") == 12 and "sleep 1000  [ok]" in table
    assert "cat nowhere.txt  [FAILED: expected 0]\n    | cat:" in table and "[FAILED: expected 130]" in table
