"""Every reader of the product is registered, and uses its registered functions."""

from __future__ import annotations

import ast
import sys
import threading
from collections.abc import Iterator

import pytest

from plant_fmu import PlantError, unpacking
from plant_fmu.model_variables import model_variables
from tests.architecture.modules import FILES, tree_of
from tests.security.fuzzing import files, folders, talkers
from tests.security.fuzzing.registry import READERS

assert files and folders and talkers  # which register

PARSE = {"json.loads", "tomllib.loads", "csv.reader", "zipfile.ZipFile", "np.frombuffer"}
METHODS = {
    "ParquetFile", "read_table", "read_metadata", "read_schema", "fromstring", "iterparse", "unpack", "unpack_from",
}  # fmt: skip
ITS_OWN = {  # what parses nothing that comes from outside: why
    "controller.force_limits:_cached": "an array in memory",
    "controller.regions.distance_grid:_cached": "a file of its own cache",
    "controller.compiling.text_cache:_read_cached": "a file of its own cache, in a folder that it alone can write to",
    "cosim.mavlink.wire.framing:encode_v1": "a frame that pymavlink has just encoded",
    "cosim.companion.failsafes:Failsafes.receive": "the four bytes of a number of a message",
    "cosim.campaigns.store.folder:CampaignFolder.__init__": "a copy of its own plan",
    "cosim.campaigns.sweeps.sweep_rows:SweepWork.__init__": "a copy of its own plan",
    "cosim.campaigns.scenes.law_gains:fmu_table": "calls cosim.scenario.toml_file:read_table",
    "cosim.mavlink.services.parameter_protocol:ParameterProtocol._send_hash": "its own hash",
    "cosim.mavlink.services.parameter_protocol:_as_float32": "its own number",
    "cosim.mavlink.wire.thrust_body:get_thrust_body": "twelve bytes of a message with a valid checksum, padded",
    "cosim.scenario.membership_terms:_read": "text made of a scenario's table, which is fuzzed",
    "cosim.scenario.toml_file:plain_key": "a key of the command line, which is fuzzed as a change of a scenario",
    "cosim.scenario.toml_file:shipped_titles": "what came with the package",
    "cosim.scenario.toml_file:read_table": "calls the reader of plant_fmu.toml_tables",
    "cosim.scenario.scenario:load_scenario": "calls cosim.scenario.toml_file:read_table",
    "plant_fmu.archive:make_archive": "writes",
    "plant_fmu.build:_has_valid_checksums": "a file of the cache, built anew if it is damaged",
    "plant_fmu.compiling.prebuilt:prebuilt_libraries": "what came with the package; test_prebuilt damages it",
    "plant_fmu.compiling.signature:_sign": "what the linker wrote",
    "plant_fmu.compiling.signature:re_sign": "what the linker wrote",
    "plant_fmu.compiling.universal:universal_library": "what the linker wrote",
    "plant_fmu.checking.__main__:main": "what its parent process wrote",
    "plant_fmu.checking.process:run_importer": "what its child process wrote",
    "plant_fmu.shared_library:_File.read": "libraries, which test_fmu_files cuts and edits",
    "plant_fmu.running.messages:_format.next_float": "an argument of a message of a library that runs here",
    "plant_fmu.running.channels:_as_bools": "an array in memory",
}


def parsing() -> Iterator[str]:
    """Every function of the product that calls a parser, as ``module:function``."""

    def walked(node: ast.AST, inside: str) -> Iterator[str]:
        for child in ast.iter_child_nodes(node):
            name = inside
            if isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.ClassDef):
                name = f"{inside}.{child.name}" if inside else child.name
            if isinstance(child, ast.Call):
                called = ast.unparse(child.func)
                if called in PARSE or called.rpartition(".")[2] in METHODS:
                    yield inside
            yield from walked(child, name)

    for module, path in FILES.items():
        yield from (f"{module}:{name}" for name in walked(tree_of(path), ""))


@pytest.mark.medium
def test_every_parser_is_fuzzed_or_reads_own_files():
    opened = {name for reader in READERS.values() for name in reader.opens}
    found = set(parsing())
    assert sorted(found - opened - ITS_OWN.keys()) == []
    assert sorted(ITS_OWN.keys() - found) == [], "no longer parse"


@pytest.mark.medium(fast=11)
@pytest.mark.parametrize("name", READERS)
def test_unmodified_files_are_accepted_by_the_named_parsers(name, seeds):
    case, met = READERS[name].case(seeds), set()
    for kept in (unpacking._cached_tree, model_variables):  # which may have read the same before
        kept.cache_clear()

    def seen(frame, event, argument):
        if event == "call":
            met.add(f"{frame.f_globals.get('__name__')}:{frame.f_code.co_qualname}")

    before = sys.getprofile()
    threading.setprofile(seen)
    sys.setprofile(seen)
    try:
        for content in case.contents:
            if name == "model description, run":  # which have no binary
                with pytest.raises(PlantError, match="has no binary"):
                    case.read(content)
            else:
                case.read(content)
    finally:
        sys.setprofile(before)
        threading.setprofile(before)
    assert sorted(set(READERS[name].opens) - met) == []
