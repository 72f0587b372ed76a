"""Run the fast tests with other kernels, processors and Pythons than this machine's own."""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from tests.portability.variants import FOLDER, ROOT, Variant, chosen, look, run, table


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m tests.portability", description=__doc__)
    parser.add_argument("--only", default="", metavar="NAMES", help="of the variants only these, as haswell,py313")
    parser.add_argument("--turn", metavar="COMMIT", help="one of them, which follows from a commit's hash")
    parser.add_argument("--limit", type=float, default=1800.0, metavar="S", help="for the tests of a variant (1800)")
    parser.add_argument("--extras", default="dev", metavar="NAMES", help="of the project, for other Pythons (dev)")
    parser.add_argument("--list", action="store_true", help="only name the variants")
    parser.add_argument("tests", nargs="*", help="arguments of pytest, after -- (all fast tests)")
    arguments = parser.parse_args()
    try:
        variants = chosen(arguments.only, _hash_of(arguments.turn) if arguments.turn else "")
    except ValueError as error:
        parser.error(str(error))
    if arguments.list:
        sys.stdout.write("\n".join(variant.name for variant in variants) + "\n")
        return 0

    machine, results = look(Path(sys.executable), Variant("itself").environment(None)), []
    for variant in variants:
        sys.stdout.write(f"{variant.name} ...\n")
        sys.stdout.flush()
        results.append(run(variant, machine, arguments.tests, arguments.limit, arguments.extras))
        sys.stdout.write(table(results[-1:]).splitlines()[1] + "\n")
        if not results[-1].good and (output := FOLDER / variant.name / "output.txt").exists():
            sys.stdout.write("\n".join(output.read_text(errors="replace").splitlines()[-100:]) + "\n")
        if arguments.turn and results[-1].run:
            break
    sys.stdout.write("\n" + table(results) + "\n")
    return int(not all(result.good for result in results))


def _hash_of(commit: str) -> str:
    """Return the whole hash of what git knows by a name."""
    command = ["git", "rev-parse", "--verify", "--quiet", "--end-of-options", f"{commit}^{{commit}}"]
    asked = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    if asked.returncode:
        raise ValueError(f"--turn {commit}: git knows no such commit")
    return asked.stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
