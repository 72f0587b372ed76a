"""How much of the code its own tests that take no seconds go through, against floors: ``make coverage``.

Only where the number means something. What is run as C is seen by nobody unless Python runs it itself; what other
processes and browsers do goes unseen as well. The floors stand a little below what was measured.
"""

import os
import subprocess
import sys
import tempfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.architecture.modules import ROOT


@dataclass(frozen=True)
class Part:
    """Some modules, the tests that are theirs, and the floor."""

    name: str
    floor: int  # per cent of lines and branches
    tests: tuple[str, ...]
    include: tuple[str, ...]
    compiled: bool = True  # whether functions are run as C
    omit: str = ""


_MAVLINK_TESTS = (
    "attitude_targets",
    "autopilot",
    "framing",
    "ftp",
    "messages",
    "mission",
    "modes",
    "parameters",
)
_MAVLINK_TESTS += ("event_texts", "received_obstacles", "signing", "streams", "targets")

PARTS = (
    Part("fuzzy_arbiter", 98, ("tests/fuzzy_arbiter",), ("fuzzy_arbiter/*",)),
    # drivers run in processes of their own
    Part("plant_fmu", 88, ("tests/plant_fmu",), ("plant_fmu/*",), omit="plant_fmu/checking/drivers.py"),
    Part(
        "controller, its mathematics",
        97,
        (
            "tests/controller/test_quadratic_program.py",
            "tests/controller/test_allocation.py",
            "tests/controller/test_paper_law.py",
            "tests/controller/test_quaternion.py",
            "tests/controller/theory/test_conditions.py",
            "tests/controller/theory/test_model.py",
        ),
        (
            "controller/allocation.py",
            "controller/quadratic_program.py",
            "controller/paper_law.py",
            "controller/quaternion.py",
            "controller/restoring.py",
            "controller/theory/conditions.py",
            "controller/theory/model.py",
        ),
        compiled=False,
    ),
    Part(
        "cosim.mavlink, its frames, messages and services",
        93,
        tuple(f"tests/cosim/mavlink/test_{name}.py" for name in _MAVLINK_TESTS),
        tuple(
            f"cosim/mavlink/{name}"
            for name in (
                "wire/encode.py",
                "wire/framing.py",
                "wire/signing.py",
                "vehicle/row_layout.py",
                "messages/*",
                "services/*",
            )
        ),
    ),
)


def measure(part: Part, folder: Path) -> tuple[bool, str]:
    """Run the tests of a part; return whether they pass and reach its floor, and a message."""
    data = folder / part.name.replace(" ", "-")
    environment = {**os.environ, "COVERAGE_FILE": str(data), "SUBREACH_INTERPRETED": "" if part.compiled else "1"}
    coverage = [sys.executable, "-m", "coverage"]
    # in Python a lost digit or a division by zero is NumPy's, which warns
    quiet = [] if part.compiled else ["-W", "ignore::RuntimeWarning"]
    run = [
        *coverage,
        "run",
        f"--include={','.join(part.include)}",
        f"--omit={part.omit}",
        "-m",
        "pytest",
        "-q",
        "--medium",
        *quiet,
        *part.tests,
    ]
    report = [*coverage, "report", f"--fail-under={part.floor}"]
    said = []
    for command in (run, report):
        done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
        said.append(done.stdout + done.stderr)
        if done.returncode:
            return False, f"{part.name}: floor {part.floor} %\n{''.join(said)}"
    return True, f"{part.name}: {_total(said[-1])}, floor {part.floor} %"


def _total(report: str) -> str:
    return next(line.split()[-1] for line in report.splitlines() if line.startswith("TOTAL"))


def main() -> int:
    """Measure all parts, or those whose names begin with a word that is given, two at a time."""
    words = tuple(sys.argv[1:]) or ("",)
    parts = [part for part in PARTS if part.name.startswith(words)]
    with tempfile.TemporaryDirectory() as folder, ThreadPoolExecutor(2) as threads:
        results = list(threads.map(lambda part: measure(part, Path(folder)), parts))
    sys.stdout.write("".join(f"{said}\n" for _, said in results))
    return 0 if all(good for good, _ in results) else 1


if __name__ == "__main__":
    sys.exit(main())
