"""Rules for every source file beyond those of the linter."""

import ast

import pytest

from tests.architecture.modules import FILES, ROOT, tree_of

MODULES = {"pickle", "marshal", "shelve", "dill", "cloudpickle", "joblib", "yaml", "telnetlib", "ftplib", "xmlrpc"}
CALLS = {"eval", "exec", "compile", "__import__", "input"}
MAY = {
    ("exec", "fuzzy_arbiter/export/compiled.py"),  # text of our own making
    ("compile", "fuzzy_arbiter/export/compiled.py"),
    ("exec", "controller/translator/generated.py"),  # likewise
    ("compile", "controller/translator/generated.py"),
}
PROCESSES = {
    "controller/compiling/compiler.py",
    "plant_fmu/compiling/compiler.py",
    "plant_fmu/importers/process.py",
    "cosim/batch/lanes_library.py",
}
XML = {"plant_fmu/unpacking.py"}
ZIPS = {
    "plant_fmu/unpacking.py",
    "plant_fmu/build.py",  # asks whether a file of the cache is one
    "plant_fmu/archive.py",  # writes
    "plant_fmu/compiling/prebuilt.py",  # reads what came with the package
    "cosim/export/formats/npz.py",  # writes
}


def calls_in(path):
    """Return the dotted names of what a file calls, with the names of the arguments."""
    for node in ast.walk(tree_of(path)):
        if isinstance(node, ast.Call):
            yield ast.unparse(node.func), {k.arg: ast.unparse(k.value) for k in node.keywords}


@pytest.mark.parametrize("path", FILES.values(), ids=lambda p: str(p.relative_to(ROOT)))
def test_no_module_executes_data(path):
    name = path.relative_to(ROOT).as_posix()
    tree = tree_of(path)
    imported = {a.name.split(".")[0] for n in ast.walk(tree) if isinstance(n, ast.Import) for a in n.names}
    imported |= {(n.module or "").split(".")[0] for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)}
    assert not imported & MODULES
    for call, named in calls_in(path):
        assert call not in CALLS or (call, name) in MAY, call
        assert call not in ("os.system", "os.popen", "np.load", "numpy.load", "tempfile.mktemp"), call
        assert "shell" not in named and named.get("allow_pickle", "False") == "False"
        if call.startswith("subprocess."):
            assert name in PROCESSES
        if call.split(".")[0] == "zipfile":
            assert name in ZIPS, call
        if call.rsplit(".", 1)[-1] in ("XMLParser", "fromstring", "iterparse") or call in ("ET.parse", "etree.parse"):
            assert name in XML, call
        if call == "fmpy.extract" or call.endswith("extractall"):  # other importers get what was looked through
            assert name == "plant_fmu/unpacking.py" or name.startswith("plant_fmu/importers/"), call


@pytest.mark.medium
def test_no_default_address_is_a_wildcard():
    for path in FILES.values():
        for node in ast.walk(tree_of(path)):
            assert not (isinstance(node, ast.Constant) and node.value in ("0.0.0.0", "::")), path
