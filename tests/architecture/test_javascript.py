"""The page's script, as pages have it: all files in one scope."""

import subprocess
import sysconfig
from pathlib import Path

from tests.architecture.modules import ROOT

ASSETS = ROOT / "cosim" / "replay" / "assets"


def test_names_are_defined(tmp_path):
    script = tmp_path / "page.js"
    script.write_text("\n".join(path.read_text() for path in sorted(ASSETS.glob("*.js"))))
    rules = [
        f"--deny={rule}" for rule in ("no-undef", "no-const-assign", "no-redeclare", "no-dupe-keys", "no-unreachable")
    ]
    (tmp_path / "globals.json").write_text('{"env": {"browser": true, "worker": true, "es2024": true}}')
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
