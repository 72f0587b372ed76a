"""Rules for every source file beyond those of the linter."""

import ast

import pytest

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
}
XML = {"plant_fmu/unpacking.py"}
ZIPS = {
    "plant_fmu/unpacking.py",
    "plant_fmu/build.py",  # asks whether a file of the cache is one
    "plant_fmu/archive.py",  # writes
    "plant_fmu/compiling/prebuilt.py",  # reads what came with the package
}


def faults_of(path):
    """Return what a file does that none may, as it stands there."""
    name, nodes = path.relative_to(ROOT).as_posix(), list(ast.walk(tree_of(path)))
    imported = {a.name.split(".")[0] for n in nodes if isinstance(n, ast.Import) for a in n.names}
    imported |= {(n.module or "").split(".")[0] for n in nodes if isinstance(n, ast.ImportFrom)}
    yield from imported & MODULES
    for node in nodes:
        if not isinstance(node, ast.Call):
            continue
        call, named = ast.unparse(node.func), {k.arg: k.value for k in node.keywords}
        pickled = named.get("allow_pickle")
        if (
            (call in CALLS and (call, name) not in MAY)
            or call in ("os.system", "os.popen", "np.load", "numpy.load", "tempfile.mktemp")
            or "shell" in named
            or (pickled and ast.unparse(pickled) != "False")
            or (call.startswith("subprocess.") and name not in PROCESSES)
            or (call.split(".")[0] == "zipfile" and name not in ZIPS)
            or (
                (
                    call.rsplit(".", 1)[-1] in ("XMLParser", "fromstring", "iterparse")
                    or call in ("ET.parse", "etree.parse")
                )
                and name not in XML
            )
            # FMPy gets what was looked through
            or (
                (call == "fmpy.extract" or call.endswith("extractall"))
                and not (name == "plant_fmu/unpacking.py" or name == "plant_fmu/checking/drivers.py")
            )
        ):
            yield call


def test_no_module_executes_data():
    found = {str(path.relative_to(ROOT)): sorted(faults_of(path)) for path in FILES.values()}
    assert {name: faults for name, faults in found.items() if faults} == {}


@pytest.mark.medium
def test_no_default_address_is_a_wildcard():
    for path in FILES.values():
        for node in ast.walk(tree_of(path)):
            assert not (isinstance(node, ast.Constant) and node.value in ("0.0.0.0", "::")), path
