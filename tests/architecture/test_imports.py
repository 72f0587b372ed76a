"""Import layering, lazy imports, and file sizes."""

import graphlib
import subprocess
import sys
from collections import Counter, defaultdict

import pytest

from tests.architecture.modules import FILES, PACKAGES, ROOT, imported
from tests.architecture.rooms import ROOMS, arrows, imports_of, room_of, stated_imports_of

# the rooms of cosim from the ground up: each imports rooms above it in this list, and none below
FLOORS = (
    "io", "scenario", "step", "simulation", "results", "batch", "ssp", "replay", "mavlink", "report", "export", "live",
    "precheck", "run", "logs", "companion", "identification", "sitl", "campaigns", "learning", "command_line",
)  # fmt: skip
MOST_MODULES = 20  # in one room
MOST_AT_THE_ROOT = 8  # modules of cosim

# what is optional, heavy or foreign to the rest: the one place that takes it
ONE_PLACE = {
    "dask": {"cosim.campaigns.workers.cluster"},
    "distributed": {"cosim.campaigns.workers.cluster"},
    "foxglove_schemas_protobuf": {"cosim.export.mcap_writer", "cosim.export.foxglove_scene"},
    "google": {"cosim.export.foxglove_scene", "cosim.export.protobuf_table"},
    "mcap": {"cosim.export.mcap_writer"},
    "mcap_protobuf": {"cosim.export.mcap_writer"},
    "gymnasium": {"cosim.learning", "cosim.learning.region_env"},
    "numba": {"fuzzy_arbiter.export.python"},
    "pandas": {"cosim.results.run_result"},
    "pymavlink": {"cosim.mavlink.wire.dialect", "cosim.logs.formats.dataflash"},
    "rerun": {"cosim.export.rrd_writer"},
    "rosbags": {
        "cosim.export.rosbag2_writer",
        "cosim.logs.formats.bag",
        "cosim.logs.message_definitions",
    },
    "rich": {"cosim.command_line.watch", "cosim.live.watching.terminal_view"},
    "shtab": {"cosim.command_line.help"},
    "skfuzzy": {"fuzzy_arbiter.engines.scikit"},
    "threadpoolctl": {"cosim.identification.fit"},
    "tomli_w": {"cosim.scenario.toml_text"},
    "websockets": {"cosim.live.view_server", "cosim.live.watching.run_views"},
}

# of these, what the base install does not bring, and the modules that cannot be imported without it
OPTIONAL = {
    "dask", "distributed", "foxglove_schemas_protobuf", "google", "gymnasium", "mcap", "mcap_protobuf", "pandas",
    "rerun", "rosbags",
}  # fmt: skip
WANT_AN_EXTRA = {
    f"cosim.export.{name}"
    for name in ("mcap_writer", "rrd_writer", "rosbag2_writer", "foxglove_scene", "protobuf_table")
} | {"cosim.learning", "cosim.learning.region_env", "cosim.learning.control_period"}

# what shows a run while it goes on: a run that nobody watches does without
OF_SHOWING = {"pymavlink", "rich", "websockets"}

_RUN = "cosim.run_scenario(cosim.load_scenario({!r}, ['time.duration=0.1']), 'run')"  # with its report

_IMPORT_ALL = """
import importlib, sys

class Missing:
    def find_spec(self, name, path=None, target=None):
        if name.split(".")[0] in {optional!r}:
            raise ModuleNotFoundError(name)

sys.meta_path.insert(0, Missing())
for module in {modules!r}:
    try:
        importlib.import_module(module)
    except ImportError:
        print(module)
"""


def test_packages_import_only_allowed_packages():
    """Cosim imports all, the others none but themselves; controller and arbiter neither FMPy nor pymavlink."""
    for module in FILES:
        package, used = module.split(".")[0], {name.split(".")[0] for name in imported(module)}
        assert package == "cosim" or not used & set(PACKAGES) - {package}, module
        assert package in ("cosim", "plant_fmu") or not used & {"fmpy", "pymavlink"}, module


def test_imports_have_no_cycles():
    """Import cycles, without imports inside functions, which Python resolves late."""
    graph = {module: imported(module, at_once=True) & FILES.keys() for module in FILES}
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError, which names the ring


@pytest.mark.parametrize("room", ROOMS)
def test_package_imports_match_its_docstring(room):
    assert imports_of(room) == stated_imports_of(room)


def test_cosim_subpackages_are_layered():
    used = arrows("cosim")
    assert used.keys() == set(FLOORS)
    backwards = {(one, other) for one, others in used.items() for other in others}
    assert {(a, b) for a, b in backwards if FLOORS.index(a) <= FLOORS.index(b)} == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_subpackages_do_not_import_each_other_mutually(package):
    graphlib.TopologicalSorter(arrows(package)).prepare()  # raises CycleError, which names the ring


def test_subpackages_hold_a_bounded_number_of_modules():
    held = Counter(room_of(module) for module in FILES)
    assert {room: count for room, count in held.items() if count > MOST_MODULES} == {}
    assert held["cosim"] <= MOST_AT_THE_ROOT


def test_optional_libraries_are_imported_in_one_module_each():
    users = defaultdict(set)
    for module in FILES:
        for name in imported(module):
            users[name.split(".")[0]].add(module)
    assert {name: users[name] for name in ONE_PLACE} == ONE_PLACE
    assert not OPTIONAL & users.keys() - ONE_PLACE.keys(), "an optional library with no place of its own"


@pytest.mark.slow
def test_base_install_imports_all_modules_without_extras():
    modules = [module for module in FILES if not module.endswith("__main__")]
    code = _IMPORT_ALL.format(optional=OPTIONAL, modules=modules)
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == WANT_AN_EXTRA, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "without"),
    [
        ("cosim", {"numpy"}),
        (
            "cosim.command_line.cli",
            {"numpy", "numba", "scipy", "matplotlib", "pyarrow", "fmpy", "pandas", "msgspec", *OF_SHOWING},
        ),
        ("fuzzy_arbiter", {"skfuzzy", "numba", "scipy", "matplotlib", "networkx"}),
        ("controller", {"matplotlib", "fmpy", "pyarrow", "msgspec"}),
        ("plant_fmu", {"numba", "scipy", "matplotlib", "pyarrow"}),
        ("plant_fmu.__main__", {"matplotlib"}),
        ("cosim.scenario.scenario", {"matplotlib", "pandas", "skfuzzy", *OF_SHOWING}),
        ("cosim.run.run_scenario", {"scipy", "matplotlib", "skfuzzy", "cosim.ssp", "cosim.batch", *OF_SHOWING}),
        ("cosim; " + _RUN.format("docking"), {"scipy", "pandas", "skfuzzy", "cosim.ssp", "cosim.batch", *OF_SHOWING}),
        ("cosim; " + _RUN.format("paper"), {"pandas", "networkx", "cosim.ssp", "cosim.batch", *OF_SHOWING}),
    ],
)
def test_heavy_libraries_are_imported_lazily(what, without, tmp_path):
    code = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import {what}; print(*({without!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_file_sizes_are_bounded():
    lines = {module: len(path.read_text().splitlines()) for module, path in FILES.items()}
    assert {module: count for module, count in lines.items() if count > 400} == {}
