"""The documentation site: navigation, reference, links into the code, and a build without warnings."""

import ast
import importlib
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
PAGES = sorted(path.relative_to(DOCS).as_posix() for path in DOCS.rglob("*.md"))
PACKAGES = ("fuzzy_arbiter", "plant_fmu", "controller", "cosim")
# packages whose names are for their neighbors alone, or stand under another one
THEORY = (DOCS / "theory.md").read_text()


def navigation():
    text = (ROOT / "mkdocs.yml").read_text().partition("\nnav:\n")[2]
    return re.findall(r"^ *- (?:[^:\n]*: )?(\S+\.md)$", text, re.M)


def directives():
    return [
        name
        for page in (DOCS / "reference").glob("*.md")
        for name in re.findall(r"^::: (\S+)$", page.read_text(), re.M)
    ]


def found(name):
    """Return the object of a dotted name, as `pydoc` finds it; a module under the name of another object too."""
    module, *rest = name.split(".")
    thing = importlib.import_module(module)
    for part in rest:
        if not hasattr(thing, part) or isinstance(thing, type(re)):
            try:
                thing = importlib.import_module(f"{thing.__name__}.{part}")
                continue
            except ModuleNotFoundError:
                pass
        thing = getattr(thing, part)
    return thing


def test_navigation_lists_every_page_exactly_once():
    inside = [name for name in navigation() if not name.startswith("outside/")]
    assert sorted(inside) == PAGES


def test_external_files_in_the_navigation_exist():
    outside = [name.removeprefix("outside/") for name in navigation() if name.startswith("outside/")]
    assert outside
    for name in outside:
        assert (ROOT / name).is_file()


def test_reference_names_are_unique_and_exist():
    told = directives()
    assert len(told) == len(set(told)) > 80
    for name in told:
        found(name)


# what a shape or a law of one's own, in the package, stands on: modules that are not public
WITHIN = {
    "controller.stack_array",
    "controller.law",
    "controller.potential_field",
    "controller.quaternion",
    *(f"controller.regions.{name}" for name in ("entry", "kinds", "mesh", "numbers", "region_set", "shape")),
}


def test_reference_covers_names_imported_by_pages_and_examples():
    told = directives()
    things = [found(name) for name in told]
    code = [(path.name, path.read_text()) for path in (ROOT / "examples").glob("*.py")]
    for path in [ROOT / "README.md", *DOCS.rglob("*.md")]:
        code += [(path.name, text) for text in re.findall(r"```python\n(.*?)```", path.read_text(), re.S)]
    for where, text in code:
        for node in ast.walk(ast.parse(text)):
            if not isinstance(node, ast.ImportFrom) or node.module in WITHIN:
                continue
            if (node.module or "").split(".")[0] in PACKAGES:
                for alias in node.names:
                    name = f"{node.module}.{alias.name}"
                    whole = any(other.startswith(f"{name}.") for other in told)  # a module
                    assert whole or any(found(name) is thing for thing in things), f"{where}: {name}"


def test_command_line_page_matches_the_parsers():
    path = DOCS / "reference" / "command_line.py"
    spec = importlib.util.spec_from_file_location("command_line", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert module.PAGE.read_text() == module.page(), f"run python {path.relative_to(ROOT)}"


@pytest.mark.parametrize("command", ["cosim", "plant_fmu", "fuzzy_arbiter"])
def test_the_command_line_page_has_every_verb_and_flag_of_the_help(command, capsys, monkeypatch):
    """The page is held against what --help prints, not against the parsers from which it is written."""
    monkeypatch.setenv("COLUMNS", "500")
    text = (DOCS / "reference" / "command-line.md").read_text()
    title = "cosim" if command == "cosim" else f"python -m {command}"
    main = importlib.import_module("cosim.command_line.cli" if command == "cosim" else f"{command}.__main__").main

    def help_of(*words):
        with pytest.raises(SystemExit):
            main([*words, "--help"])
        return capsys.readouterr().out

    verbs = re.findall(rf"^### {title} (.*)$", text, re.M)
    everywhere = text.partition(f"\n## {title}\n")[2].partition("\n##")[0]  # flags of the command stand there alone
    assert re.findall(r"^    ([a-z-]+)(?=  |$)", help_of(), re.M) == list(dict.fromkeys(v.split()[0] for v in verbs))
    for verb in verbs:
        section = everywhere + text.partition(f"\n### {title} {verb}\n")[2].partition("\n##")[0]
        for flag in re.findall(r"^  (?:-\w, )?(--[a-z][a-z-]+)\b", help_of(*verb.split()), re.M):
            assert flag == "--help" or re.search(rf"^\| .*`{flag}[ `]", section, re.M), f"{verb} {flag}"


def test_theory_has_every_equation_once():
    blocks = re.findall(r"```text\n(.*?)```", THEORY, re.S)
    numbers = [int(n) for block in blocks for n in re.findall(r"^\((\d+)\) ", block, re.M)]
    assert numbers == list(range(1, 53))


def test_every_numbered_equation_block_names_its_code():
    for block, after in re.findall(r"```text\n(.*?)```\n\n(.*?)(?=\n\n)", THEORY, re.S):
        if re.search(r"^\(\d+\) ", block, re.M):
            assert after.startswith("Code: `"), block


def places():
    return sorted(set(re.findall(r"`((?:fuzzy_arbiter|plant_fmu|controller|cosim)[./][^`]+)`", THEORY)))


@pytest.mark.parametrize("place", places())
def test_code_references_in_theory_exist(place):
    if "/" not in place:
        assert found(place) is not None
        return
    path, _, function = place.partition(": ")
    assert (ROOT / path).is_file()
    assert re.search(rf"\b{function}\(", (ROOT / path).read_text()) if function else True


def test_papers_equations_23_and_3_give_the_error_of_24():
    from controller.quaternion import error, rotation_matrix

    def printed(e):
        return (e[0] ** 2 - e[1:] @ e[1:]) * np.eye(3) + 2 * np.outer(e[1:], e[1:]) - 2 * e[0] * cross(e[1:])

    def cross(a):
        return np.array([[0.0, -a[2], a[1]], [a[2], 0.0, -a[0]], [-a[1], a[0], 0.0]])

    for e, desired in np.random.default_rng(1).standard_normal((20, 2, 4)):
        e, desired = e / np.linalg.norm(e), desired / np.linalg.norm(desired)
        np.testing.assert_allclose(printed(e) @ printed(desired).T, printed(error(desired, e)), atol=1e-14)
        R, R_d = rotation_matrix(e), rotation_matrix(desired)
        assert np.abs(R @ R_d.T - rotation_matrix(error(desired, e))).max() > 0.01


def test_balance_of_attraction_and_repulsion_is_an_equilibrium_with_w_0():
    """On the line to the goal, inside a sphere to be kept out of: y = 0, and e_p is not."""
    from scipy.optimize import brentq

    from controller import Gains
    from controller.paper_law import primary_error, secondary_error
    from controller.theory import mapped_error

    gains, radius, alpha = Gains(), 0.5, 2000.0

    def errors(x):
        """Goal at 0, obstacle about 2 m; alpha r^2 = 500 N against a pull of 100 to 600 N."""
        d = x - 2.0
        e_p = primary_error(x * x - 0.25, np.array([2.0 * x, 0.0, 0.0]))
        e_s = secondary_error(
            np.array([radius**2 - d * d]), np.array([[-2.0 * d, 0.0, 0.0]]), np.array([alpha / gains.k_q])
        )
        return e_p, e_s

    def y(x):
        e_p, e_s = errors(x)
        return mapped_error(e_p, e_s, np.zeros(3), np.eye(3), gains)

    balance = brentq(lambda x: y(x)[0], 2.0 + 1e-9, 2.5)
    assert np.abs(y(balance)).max() < 1e-9
    assert np.linalg.norm(errors(balance)[0]) > 1.0 < np.linalg.norm(errors(balance)[1])
    for k_q in (1.0, 1e6):  # it cancels
        e_p, e_s = errors(balance)
        other = Gains(k_q=k_q)
        assert np.abs(mapped_error(e_p, e_s * gains.k_q / k_q, np.zeros(3), np.eye(3), other)).max() < 1e-9


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    if importlib.util.find_spec("mkdocs") is None or importlib.util.find_spec("mkdocstrings") is None:
        pytest.skip("mkdocs, mkdocs-material and mkdocstrings are not installed: pip install ./fuzzy_arbiter '.[docs]'")
    folder = tmp_path_factory.mktemp("site")
    build = [sys.executable, "-m", "mkdocs", "build", "--strict", "--site-dir", folder]
    done = subprocess.run(
        build, cwd=ROOT, env={**os.environ, "NO_MKDOCS_2_WARNING": "1"}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert "WARNING" not in done.stderr + done.stdout
    return folder


@pytest.mark.slow
def test_the_site_builds_without_a_warning_and_has_every_page(site):
    for name in navigation():
        assert (site / name).with_suffix(".html").is_file()


@pytest.mark.slow
def test_site_loads_no_external_resource(site):
    for page in site.rglob("*.html"):
        for tag in re.findall(r"<(?:script|link|img|iframe|source|video)\b[^>]*>", page.read_text()):
            address = re.search(r"\b(?:src|href)=\"?([^\"\s>]*)", tag)
            assert not address or not re.match(r"(\w+:)?//", address[1]), tag
    for style in site.rglob("*.css"):
        assert not re.search(r"url\([\"']?(\w+:)?//", style.read_text()), style


@pytest.mark.slow
def test_every_name_of_the_reference_has_an_entry_on_the_site(site):
    entries = {
        x for page in (site / "reference").glob("*.html") for x in re.findall(r'id="([\w.]+)"', page.read_text())
    }
    for name in directives():
        assert any(entry == name or entry.endswith(f".{name.rpartition('.')[2]}") for entry in entries), name
