"""Evaluate files with pyfuzzylite, Octave's fuzzy-logic-toolkit and jFuzzyLogic, each in a process of its own.

``python -m tests.fuzzy_arbiter.formats.other_tools`` writes the table in ``tests/data/fuzzy`` anew, with the tools at
hand.
"""

import functools
import importlib.util
import json
import os
import shutil
import subprocess
import sys
from itertools import product
from pathlib import Path

from fuzzy_arbiter.formats import writes
from tests.fuzzy_arbiter.formats.systems import TIPPING

DATA = Path(__file__).parents[2] / "data" / "fuzzy"
SAMPLES = [list(map(float, pair)) for pair in product((0, 1.5, 3, 5, 6.5, 9.8), repeat=2)]
POINTS = 1001  # in Octave; fuzzylite and jFuzzyLogic take 1000

_FUZZYLITE = """
import json, sys
import fuzzylite
engine = fuzzylite.FllImporter().from_string(sys.argv[1])
rows = []
for sample in json.load(sys.stdin):
    for variable, x in zip(engine.input_variables, sample):
        variable.value = x
    engine.process()
    rows.append([float(variable.value) for variable in engine.output_variables])
json.dump(rows, sys.stdout)
"""
_OCTAVE = """
pkg load fuzzy-logic-toolkit
y = evalfis([{samples}], readfis('{path}'), {points});
for i = 1:rows(y) printf('%.17g ', y(i, :)); printf('\\n'); end
"""


def fuzzylite_python():
    """The Python that has pyfuzzylite, or None; it wants another NumPy than this project."""
    if importlib.util.find_spec("fuzzylite"):
        return sys.executable
    return os.environ.get("FUZZY_LIBRARIES_PYTHON")


@functools.cache
def has_octave():
    if not shutil.which("octave"):
        return False
    return not _run(["octave", "--no-gui", "--no-init-file", "--eval", "pkg load fuzzy-logic-toolkit"]).returncode


def jfuzzylogic_classes():
    """The class path of jFuzzyLogic, or None."""
    return os.environ.get("JFUZZYLOGIC_CLASSPATH") if shutil.which("java") else None


def _run(command, text=""):
    return subprocess.run(command, input=text, capture_output=True, text=True, timeout=240, check=False)


def _output(command, text=""):
    done = _run(command, text)
    assert not done.returncode, done.stderr
    return done.stdout


def with_fuzzylite(system, samples, folder):
    return json.loads(_output([fuzzylite_python(), "-c", _FUZZYLITE, writes(system, "fll")], json.dumps(samples)))


def with_octave(system, samples, folder):
    path = folder / "system.fis"
    path.write_text(writes(system, "fis"))
    rows = "; ".join(" ".join(map(repr, sample)) for sample in samples)
    code = _OCTAVE.format(samples=rows, path=path, points=POINTS)
    return [
        list(map(float, row.split()))
        for row in _output(["octave", "--no-gui", "--no-init-file", "--eval", code]).splitlines()
    ]


def with_jfuzzylogic(system, samples, folder):
    path, source = folder / "system.fcl", DATA / "tools" / "Evaluate.java"
    path.write_text(writes(system, "fcl"))
    names = [",".join(v.name for v in variables) for variables in (system.inputs, system.outputs)]
    text = "\n".join(" ".join(map(repr, sample)) for sample in samples)
    out = _output(["java", "-cp", jfuzzylogic_classes(), str(source), str(path), *names], text)
    return [list(map(float, line.split()[1:])) for line in out.splitlines() if line.startswith("row ")]


TOOLS = {
    "pyfuzzylite": (fuzzylite_python, with_fuzzylite),
    "octave": (has_octave, with_octave),
    "jfuzzylogic": (jfuzzylogic_classes, with_jfuzzylogic),
}


def main():
    import tempfile
    from dataclasses import replace

    table = {"samples": SAMPLES}
    for tool, (found, evaluate) in TOOLS.items():
        if found():
            with tempfile.TemporaryDirectory() as folder:
                rows = evaluate(replace(TIPPING, points=1000), SAMPLES, Path(folder))
            table[tool] = [row[0] for row in rows]
    (DATA / "tipping_centroids.json").write_text(json.dumps(table, indent=1) + "\n")


if __name__ == "__main__":
    main()
