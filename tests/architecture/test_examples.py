"""Every public function and class has a docstring example with correct output."""

import doctest
import importlib

import pytest

from tests.architecture import public

FLAGS = doctest.ELLIPSIS | doctest.NORMALIZE_WHITESPACE


def with_examples():
    """The full names of public functions and classes, errors left out."""
    for name in sorted(public.names()):
        module, _, last = name.rpartition(".")
        thing = getattr(importlib.import_module(module), last)
        if callable(thing) and not (isinstance(thing, type) and issubclass(thing, BaseException)):
            yield name, thing.__doc__


@pytest.mark.medium(fast=2)
@pytest.mark.parametrize(("name", "text"), [*with_examples(), ("cosim", importlib.import_module("cosim").__doc__)])
def test_docstring_example_output_is_reproduced(name, text, tmp_path, monkeypatch):
    if ".pictures." in name:
        pyplot = pytest.importorskip("matplotlib.pyplot")
        pyplot.switch_backend("agg")
    monkeypatch.chdir(tmp_path)
    example = doctest.DocTestParser().get_doctest(text, {"__name__": "example"}, name, None, None)
    assert example.examples, "it has none"
    said = []
    assert doctest.DocTestRunner(optionflags=FLAGS).run(example, out=said.append).failed == 0, "".join(said)
    if ".pictures." in name:
        pyplot.close("all")
