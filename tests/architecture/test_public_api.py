"""The public API changes only with its recorded listing."""

import difflib
import importlib
import importlib.util
import re

import griffe
import pytest

from tests.architecture import public
from tests.architecture.modules import ROOT

REFERENCE = ROOT / "docs" / "reference"


def test_public_api_matches_recorded_listing():
    written = public.WRITTEN.read_text().splitlines()
    changed = list(difflib.unified_diff(written, public.text().splitlines(), "written", "now", lineterm="", n=0))
    assert not changed, "if it is meant so, `python -m tests.architecture.public` writes it anew:\n" + "\n".join(
        changed
    )


def test_public_names_are_importable():
    without = () if importlib.util.find_spec("rich") else ("cosim.live.watching",)
    homes = [name.rpartition(".")[::2] for name in public.names()]
    gone = [home for home in homes if home[0] not in without and not hasattr(importlib.import_module(home[0]), home[1])]
    assert gone == []


@pytest.mark.skipif(not REFERENCE.is_dir(), reason="the pages of the reference are not there")
def test_reference_pages_list_the_public_api():
    shown = {name for page in REFERENCE.glob("*.md") for name in re.findall(r"^::: ([\w.]+)", page.read_text(), re.M)}
    behind = {public.target(name).path for name in shown}
    assert behind == {public.target(name).path for name in public.names()}


def test_public_functions_accept_no_arbitrary_keywords():
    """So Python itself refuses an unknown one; an arbiter's inputs alone may be keywords, and it refuses others."""
    by_input = {f"fuzzy_arbiter.arbiter.Arbiter.{method}" for method in ("batch", "centroids", "explain")}
    for name in public.names():
        what = public.target(name)
        for function in [what, *public.members(what)] if what.is_class else [what] if what.is_function else []:
            if (function.is_function or function.is_class) and function.path not in by_input:
                assert all(p.kind is not griffe.ParameterKind.var_keyword for p in function.parameters), function.path


def test_public_functions_take_paths_as_text_and_scenarios_by_name():
    """Those of a value's fields are results, and have their own type."""
    found, narrow = set(), []
    for name in public.names():
        what = public.target(name)
        for function in [what] if what.is_function else public.members(what) if what.is_class else []:
            for parameter in function.parameters if function.is_function else ():
                kinds = set(re.split(r"[ |\[\],]+", str(parameter.annotation)))
                by_name = "Scenario" in kinds and what.is_function
                if "Path" in kinds or by_name:
                    found.add(f"{function.path}({parameter.name})")
                    if not {"str", "Path"} <= kinds:
                        narrow.append(f"{function.path}({parameter.name}: {parameter.annotation})")
    assert narrow == []
    assert {
        "cosim.run.run_scenario.run_scenario(scenario)",
        "cosim.results.run_result.load_run(path)",
    } <= found and len(found) > 20
