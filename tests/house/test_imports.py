"""Who may import whom, what stays out until it is asked for, and how long a file is."""

import graphlib
import subprocess
import sys
from collections import defaultdict

import pytest

from tests.house.modules import FILES, PACKAGES, ROOT, imported, room

MAY_IMPORT = {
    "fuzzy_arbiter": {"fuzzy_arbiter"},
    "plant_fmu": {"plant_fmu"},
    "controller": {"controller"},
    "cosim": set(PACKAGES),
}

# the rooms of each package, and which rooms beside them each uses, inside functions too; nothing uses a room above it
ROOMS = {
    "controller": {"laws": {"regions"}, "regions": set(), "theory": set()},
    "fuzzy_arbiter": {
        "command_line": {"engines", "export", "formats", "pictures"},
        "engines": set(),
        "export": {"engines"},
        "formats": {"engines"},
        "pictures": {"engines"},
        "verification": {"engines"},
    },
    "plant_fmu": {"contents": set(), "importers": set(), "pictures": set(), "running": set()},
    "cosim": {
        "campaigns": {"flying", "replay"},
        "command_line": {"campaigns", "export", "flying", "live", "mavlink", "package", "replay", "sitl"},
        "export": {"mavlink", "replay"},
        "flying": set(),
        "helm": set(),
        "live": {"helm", "replay"},
        "mavlink": {"helm"},
        "package": set(),
        "replay": {"helm"},
        "sitl": {"mavlink"},
    },
}

# the rooms of cosim that stand on its own modules: which of those modules may know them
KNOWN_BY = {
    "campaigns": set(),
    "command_line": {"cli"},
    "export": set(),
    "flying": set(),
    "live": {"run"},
    "mavlink": {"run"},
    "package": set(),
    "sitl": set(),
}

# what is optional, heavy or foreign to the rest: the one place that takes it
ONE_PLACE = {
    "casadi": {"plant_fmu.importers.casadi_import"},
    "dask": {"cosim.campaigns.cluster"},
    "distributed": {"cosim.campaigns.cluster"},
    "ecospy": {"plant_fmu.importers.ecos"},
    "fmu_manipulation_toolbox": {"plant_fmu.importers.toolbox"},
    "foxglove_schemas_protobuf": {"cosim.export.as_mcap", "cosim.export.foxglove_scene"},
    "google": {"cosim.export.foxglove_scene", "cosim.export.protobuf_table"},
    "libcosimpy": {"plant_fmu.importers.libcosim"},
    "llvmlite": {"controller.on_stack", "controller.repeated", "cosim.native"},
    "mcap": {"cosim.export.as_mcap"},
    "mcap_protobuf": {"cosim.export.as_mcap"},
    "numba": {
        *("controller.by_address", "controller.compiled", "controller.on_stack", "controller.regions.kinds"),
        *("controller.repeated", "cosim.flight", "cosim.memberships", "cosim.native", "cosim.progress"),
        "fuzzy_arbiter.compiled",
    },
    "pymavlink": {"cosim.mavlink.dialect"},
    "rerun": {"cosim.export.as_rrd"},
    "rich": {"cosim.command_line.watch", "cosim.live.watching.bars", "cosim.live.watching.picture"},
    "shtab": {"cosim.command_line.completion"},
    "skfuzzy": {"fuzzy_arbiter.engines.scikit"},
    "tomli_w": {"cosim.scenario_text"},
    "websockets": {"cosim.live.server", "cosim.live.watching.sources"},
}

# of these, what the base install does not bring, and the modules that cannot be imported without it
OPTIONAL = {
    "casadi",
    "dask",
    "distributed",
    "ecospy",
    "fmu_manipulation_toolbox",
    "foxglove_schemas_protobuf",
}
OPTIONAL |= {"google", "libcosimpy", "mcap", "mcap_protobuf", "pandas", "rerun"}
WANT_AN_EXTRA = {
    "cosim.export.as_mcap",
    "cosim.export.as_rrd",
    "cosim.export.foxglove_scene",
    "cosim.export.protobuf_table",
    "plant_fmu.importers.casadi_import",
    "plant_fmu.importers.ecos",
    "plant_fmu.importers.libcosim",
    "plant_fmu.importers.toolbox",
}

# what shows a run while it goes on: a run that nobody watches does without
OF_SHOWING = {"pymavlink", "rich", "websockets"}

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


def test_imports_run_one_way():
    packages = {module: {name.split(".")[0] for name in imported(module)} & set(PACKAGES) for module in FILES}
    assert {module: used for module, used in packages.items() if not used <= MAY_IMPORT[module.split(".")[0]]} == {}


def test_nothing_imports_itself_by_a_way_round():
    """Import cycles, those inside functions left out: Python meets only the others."""
    graph = {module: imported(module, at_once=True) & FILES.keys() for module in FILES}
    graphlib.TopologicalSorter(graph).prepare()  # raises CycleError, which names the ring


@pytest.mark.parametrize("package", ROOMS)
def test_rooms_use_what_they_say_and_no_more(package):
    used = {name: set() for name in ROOMS[package]}
    for module in FILES:
        here = room(module)
        if here.startswith(f"{package}."):
            there = {room(name) for name in imported(module) if name in FILES} - {here}
            used[here.removeprefix(f"{package}.")] |= {
                r.partition(".")[2] for r in there if r.startswith(f"{package}.")
            }
    assert used == ROOMS[package]
    graphlib.TopologicalSorter(used).prepare()


def test_the_modules_of_cosim_know_no_room_that_stands_on_them():
    known = {name: set() for name in KNOWN_BY}
    for module in FILES:
        if room(module) == "cosim":
            for name in {room(n).removeprefix("cosim.") for n in imported(module) if n in FILES} & KNOWN_BY.keys():
                known[name].add(module.removeprefix("cosim."))
    assert known == KNOWN_BY


def test_the_controller_knows_neither_fmi_nor_mavlink_and_the_arbiter_no_vehicle():
    for module in FILES:
        if module.split(".")[0] in ("controller", "fuzzy_arbiter"):
            assert not {name.split(".")[0] for name in imported(module)} & {"fmpy", "pymavlink"}


def test_what_is_optional_or_heavy_is_taken_in_one_place():
    users = defaultdict(set)
    for module in FILES:
        for name in imported(module):
            users[name.split(".")[0]].add(module)
    assert {name: users[name] for name in ONE_PLACE} == ONE_PLACE
    assert not OPTIONAL & users.keys() - ONE_PLACE.keys(), "an optional library with no place of its own"


@pytest.mark.slow
def test_the_base_install_imports_all_but_what_wants_an_extra():
    modules = [module for module in FILES if not module.endswith("__main__")]
    code = _IMPORT_ALL.format(optional=OPTIONAL, modules=modules)
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert set(done.stdout.split()) == WANT_AN_EXTRA, done.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("what", "without"),
    [
        ("cosim", {"numpy"}),
        ("cosim.cli", {"numpy", "numba", "scipy", "matplotlib", "pyarrow", "fmpy", "pandas", "msgspec", *OF_SHOWING}),
        ("fuzzy_arbiter", {"skfuzzy", "numba", "scipy", "matplotlib", "networkx"}),
        ("controller", {"matplotlib", "fmpy", "pyarrow", "msgspec"}),
        ("plant_fmu", {"numba", "scipy", "matplotlib", "pyarrow"}),
        ("cosim.scenario", {"matplotlib", "pandas", "skfuzzy", *OF_SHOWING}),
        ("cosim.run", OF_SHOWING),
    ],
)
def test_what_is_heavy_waits_until_it_is_asked_for(what, without):
    code = f"import sys, {what}; print(*({without!r} & set(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.split() == []


def test_files_fit_in_the_head():
    lines = {module: len(path.read_text().splitlines()) for module, path in FILES.items()}
    assert {module: count for module, count in lines.items() if count > 400} == {}
