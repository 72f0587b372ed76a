"""Consistency of the two distributions that this repository builds."""

import itertools
import re
import subprocess
import sys
import tomllib
from importlib import metadata

from tests.architecture.modules import ROOT


def project(file):
    return tomllib.loads((ROOT / file).read_text(encoding="utf-8"))["project"]


def test_both_distributions_share_one_version_and_pin_it():
    whole, arbiter = project("pyproject.toml"), project("fuzzy_arbiter/pyproject.toml")
    assert whole["version"] == arbiter["version"]
    needed = [text for text in whole["dependencies"] if text.startswith("fuzzy-arbiter")]
    assert needed == [f"fuzzy-arbiter[skfuzzy]=={arbiter['version']}"]
    assert re.findall("^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.M) == [whole["version"]]


def test_arbiter_depends_on_numpy_alone_with_one_bound():
    whole, arbiter = project("pyproject.toml"), project("fuzzy_arbiter/pyproject.toml")
    assert arbiter["dependencies"] == [text for text in whole["dependencies"] if text.startswith("numpy>=")]
    for texts in arbiter["optional-dependencies"].values():
        for text in texts:
            name = text.partition(">=")[0] + ">="
            others = [*whole["dependencies"], *itertools.chain(*whole["optional-dependencies"].values())]
            assert text in others or not any(other.startswith(name) for other in others), text


def test_both_distributions_have_the_same_licence():
    assert (ROOT / "fuzzy_arbiter" / "LICENSE").read_bytes() == (ROOT / "LICENSE").read_bytes()


def test_what_a_build_compiles_imports_only_what_the_build_installs():
    texts = [
        *project("pyproject.toml")["dependencies"],
        *itertools.chain(*project("pyproject.toml")["optional-dependencies"].values()),
    ]
    distributions = {re.split(r"[^\w-]", text)[0].lower() for text in texts}
    modules = {
        m for m, owners in metadata.packages_distributions().items() if {o.lower() for o in owners} & distributions
    }
    program = re.search(r'_COMPILE = """(.*?)"""', (ROOT / "hatch_build.py").read_text(), re.S)[1].partition(
        "platforms"
    )[0]
    installed = re.search(r"_BUILD_REQUIREMENTS = \((.*?)\)", (ROOT / "hatch_build.py").read_text(), re.S)[1]
    ours = {"plant_fmu", "controller", "cosim", "fuzzy_arbiter"}
    missing = modules - ours - {name.replace("-", "_") for name in re.findall(r'"(.*?)"', installed)}
    blocked = f"import sys\nsys.modules |= dict.fromkeys({sorted(missing)!r})\n"
    assert "pyarrow" in missing and "numpy" not in missing
    subprocess.run([sys.executable, "-c", blocked + program], cwd=ROOT, check=True)
