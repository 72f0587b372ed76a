"""The page's scripts: its files are one scope, and the worker that flies is another."""

import subprocess
import sysconfig
from pathlib import Path

import pytest

from tests.architecture.modules import ROOT

ASSETS = ROOT / "cosim" / "replay" / "assets"


@pytest.mark.parametrize("scope", ["browser", "worker"])
def test_names_are_defined(tmp_path, scope):
    script = tmp_path / "page.js"
    files = [path for path in sorted(ASSETS.glob("*.js")) if (path.name == "flight_worker.js") == (scope == "worker")]
    script.write_text("\n".join(path.read_text() for path in files))
    rules = [
        f"--deny={rule}" for rule in ("no-undef", "no-const-assign", "no-redeclare", "no-dupe-keys", "no-unreachable")
    ]
    (tmp_path / "globals.json").write_text(f'{{"env": {{"{scope}": true, "es2024": true}}}}')
    command = [
        Path(sysconfig.get_path("scripts")) / "oxlint",
        "-c",
        tmp_path / "globals.json",
        "--allow=all",
        *rules,
        script,
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.returncode == 0, done.stdout
