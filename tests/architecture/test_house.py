"""Rules for every source file beyond those of the linter."""

import ast
import re
from collections import Counter

import pytest

from tests.architecture.counts import GENERATED, words_by_hand
from tests.architecture.modules import FILES, ROOT, tree_of

MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "yaml", "telnetlib", "ftplib", "xmlrpc"}
CALLS = {"eval", "exec", "compile", "__import__", "input"}
MAY = {
    ("eval", "fuzzy_arbiter/terms/functions.py"),  # formulas of its own tables
    ("exec", "fuzzy_arbiter/export/python.py"),  # text of our own making
    ("compile", "fuzzy_arbiter/export/python.py"),
    ("exec", "controller/translator/generated.py"),  # likewise
    ("compile", "controller/translator/generated.py"),
}
PROCESSES = {
    "controller/compiling/compiler.py",
    "plant_fmu/compiling/compiler.py",
    "plant_fmu/checking/process.py",
    "cosim/identification/shooting.py",
    "cosim/simulation/watchdog.py",
}
ZIPS = {
    "plant_fmu/unpacking.py",
    "plant_fmu/build.py",  # asks whether a file of the cache is one
    "plant_fmu/archive.py",  # writes
    "plant_fmu/compiling/prebuilt.py",  # reads what came with the package
}


# calls that only some files make
ONLY_IN = (
    (re.compile(r"os\.(system|popen)|(np|numpy)\.load|tempfile\.mktemp"), set()),
    (re.compile(r"subprocess\..*"), PROCESSES),
    (re.compile(r"zipfile\..*"), ZIPS),
    # the second file checks by schemas what the first let through
    (
        re.compile(r"(.*\.)?(XMLParser|fromstring|iterparse)|(ET|etree)\.parse"),
        {"plant_fmu/unpacking.py", "cosim/ssp/schema.py"},
    ),
    # FMPy gets what was looked through
    (re.compile(r"fmpy\.extract|.*extractall"), {"plant_fmu/unpacking.py", "plant_fmu/checking/drivers.py"}),
    *((re.compile(call), {file for name, file in MAY if name == call}) for call in CALLS),
)


def faults_of(path):
    """Return what a file does that none may, as it stands there."""
    name, nodes = path.relative_to(ROOT).as_posix(), list(ast.walk(tree_of(path)))
    imported = {a.name.split(".")[0] for n in nodes if isinstance(n, ast.Import) for a in n.names}
    imported |= {(n.module or "").split(".")[0] for n in nodes if isinstance(n, ast.ImportFrom)}
    yield from imported & MODULES
    for node in (node for node in nodes if isinstance(node, ast.Call)):
        call, named = ast.unparse(node.func), {k.arg: ast.unparse(k.value) for k in node.keywords}
        if "shell" in named or named.get("allow_pickle", "False") != "False":
            yield call
        yield from (call for pattern, files in ONLY_IN if pattern.fullmatch(call) and name not in files)


def test_no_module_executes_data():
    found = {str(path.relative_to(ROOT)): sorted(faults_of(path)) for path in FILES.values()}
    assert {name: faults for name, faults in found.items() if faults} == {}


@pytest.mark.medium
def test_no_default_address_is_a_wildcard():
    for path in FILES.values():
        for node in ast.walk(tree_of(path)):
            assert not (isinstance(node, ast.Constant) and node.value in ("0.0.0.0", "::")), path


def test_generated_pages_do_not_count_as_handwritten():
    assert [words_by_hand(ROOT / page) > 0 for page in (*GENERATED, "README.md")] == [False, False, True]


def test_a_module_name_occurs_once_in_a_package():
    names = [(module.partition(".")[0], path.name) for module, path in FILES.items() if path.name[0] != "_"]
    assert [name for name, count in Counter(names).items() if count > 1] == []
