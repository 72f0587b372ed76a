"""The virtual environments of the peers, made once."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import venv
from dataclasses import dataclass
from pathlib import Path

import platformdirs

from benchmarks.timing import NotMeasuredError

FOLDER = "benchmark-peers"
_INSTALLED = "installed.json"
_TIMEOUT = 900.0  # s, longest installation of a peer


@dataclass(frozen=True)
class Peer:
    """The requirements of a peer."""

    name: str  # name of the distribution on PyPI
    more: tuple[str, ...] = ()  # further requirements, which the distribution does not declare
    environment: str = "shared"  # name of its virtual environment


_TBB = ("tbb>=2021.13",) if sys.platform == "linux" else ()
PEERS = {
    peer.name: peer
    for peer in (
        Peer("numpy"),
        Peer("numba"),
        Peer("fmpy"),
        Peer("ecospy", _TBB),
        Peer("libcosimpy"),
        Peer("mujoco"),
        Peer("scikit-fuzzy", ("networkx", "packaging", "scipy")),
        Peer("simpful"),
        Peer("pyfuzzylite", ("numpy<2",), "old-numpy"),
        Peer("python-vehicle-simulator"),
        Peer("casadi", ("numpy",)),
    )
}


def folder() -> Path:
    """Return the folder of the virtual environments."""
    return Path(platformdirs.user_cache_dir("subreach")) / FOLDER


def install(again: bool = False) -> dict[str, str]:
    """Install all peers that were not tried before; return the version of each, or the reason why it has none."""
    state = {name: version for name, version in _state().items() if name in PEERS}
    for peer in PEERS.values():
        if peer.name in state and not (again and state[peer.name].startswith("not installed")):
            continue
        print(f"installing {peer.name} for the benchmarks", file=sys.stderr, flush=True)
        state[peer.name] = _installed(peer)
        folder().mkdir(parents=True, exist_ok=True)
        (folder() / _INSTALLED).write_text(json.dumps(state, indent=1), encoding="utf-8")
    return state


def installed_python(name: str) -> str | None:
    """Return the Python of an environment in which a peer is installed; None if there is none."""
    version = _state().get(name, "not installed")
    return None if version.startswith("not installed") else str(_python_in(folder() / PEERS[name].environment))


def _state() -> dict[str, str]:
    try:
        state: dict[str, str] = json.loads((folder() / _INSTALLED).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return state


def _installed(peer: Peer) -> str:
    python = _python_in(folder() / peer.environment)
    try:
        if not python.exists():
            venv.create(python.parents[1], with_pip=True)
        pip = [str(python), "-m", "pip", "--disable-pip-version-check", "--quiet", "--no-input"]
        done = subprocess.run(
            [*pip, "install", peer.name, *peer.more], capture_output=True, text=True, timeout=_TIMEOUT, check=False
        )
    except (OSError, subprocess.SubprocessError) as error:
        return f"not installed: {error}"
    if done.returncode:
        last = [line for line in done.stderr.splitlines() if line.startswith("ERROR")] or ["pip failed"]
        return f"not installed: {last[-1].removeprefix('ERROR: ')}"
    return _version(str(python), peer.name)


def _python_in(environment: Path) -> Path:
    return environment / ("Scripts/python.exe" if os.name == "nt" else "bin/python")


def _version(python: str, name: str) -> str:
    code = f"from importlib import metadata; print(metadata.version({name!r}))"
    done = subprocess.run([python, "-c", code], capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else f"not installed: {name} is not in {python}"


class Environment:
    """Finds the Python interpreters of peers: a given one, or the benchmarks' own environments, made if missing."""

    def __init__(self, python: str | None = None) -> None:
        self._python = python
        self._state = {} if python else install()

    def python(self, name: str) -> str:
        """Return the Python with a peer; raise NotMeasuredError with the reason if there is none."""
        version = self.version(name)
        if version.startswith("not installed"):
            raise NotMeasuredError(version)
        return self._python or str(_python_in(folder() / PEERS[name].environment))

    def version(self, name: str) -> str:
        """Return the version of a peer, or the reason after "not installed: "."""
        if name not in self._state:
            self._state[name] = _version(self._python or sys.executable, name)
        return self._state[name]

    def summary(self) -> str:
        """Format the versions of the installed peers."""
        versions = {name: self.version(name) for name in PEERS}
        return ", ".join(f"{name} {version}" for name, version in versions.items() if not version.startswith("not"))
