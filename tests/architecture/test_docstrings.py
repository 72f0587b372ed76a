"""Docstrings match the code: parameters, errors, return values, and units."""

import ast
import re
from collections.abc import Iterator
from functools import cache

import griffe
import pytest

from tests.architecture import public
from tests.architecture.modules import FILES, tree_of

pytestmark = pytest.mark.slow  # to read all of the code takes seconds

# words of a name that make a number a physical quantity
KINDS = re.compile(
    r"(?:^|_)(?:acceleration|altitude|angle|bearing|buoyancy|clearance|current|damping|delay|density|depth|diameter|"
    r"distances?|duration|forces?|frequency|heading|horizon|inertia|lag|length|mass|moment|period|position|radius|range|"
    r"substep|tau|temperature|thrusts?|timeout|times?|torque|velocity|volume|wrench|yaw)(?:_|$)"
)
NUMBERS = re.compile(r"float|Array|Vector|ndarray")
_ONE = r"(?:1/s|[kmµn]?s|[km]?m|k?N|kg|m?rad|deg|degE7|Hz|Pa|m?G|bar|%)[234]?"
UNIT = re.compile(
    rf"\[(?:-|{_ONE}(?:[ /]{_ONE})*)[],;: ]"  # [m/s], [m, NED], [-]
    rf"|(?:^|(?<=[\s(,])){_ONE}(?:[ /]{_ONE})*(?=[\s,.;:)]|$)"  # m/s, rad
    r"|\bSI\b|\b(?:meter|second|newton|radian|degree)s?\b|dimensionless|units? of|as a part of"
)
# what a function may raise without a word: that it is abstract, a fault of our own, Ctrl-C, or argparse's own errors
UNSAID = {"NotImplementedError", "AssertionError", "KeyboardInterrupt", "ArgumentTypeError"}

ELSEWHERE = re.compile(
    r"(?:Do what|Return what|[Aa]rguments as|[Aa]s|[Aa]s for|see|of) `([\w.]+)`"
)  # the rest is said there

NOT_IMPERATIVE = {"What", "Whether", "How", "Where", "When", "Who", "Which", "The", "A", "An", "Its", "Each", "All"}

Part = griffe.DocstringSectionKind


def everything() -> Iterator[griffe.Object]:
    """Every class, function and attribute of the four packages whose name, and whose class's, does not begin with _."""
    for package in public.packages().values():
        for module in public.modules(package):
            yield from _below(module)


def _below(parent: griffe.Object) -> Iterator[griffe.Object]:
    for name, member in parent.members.items():
        if not (name.startswith("_") or member.is_alias or member.is_module):
            yield member
            yield from _below(member) if member.is_class else ()


def functions() -> Iterator[griffe.Function]:
    return (what for what in everything() if isinstance(what, griffe.Function))


def public_functions() -> Iterator[griffe.Function]:
    for name in sorted(public.names()):
        what = public.target(name)
        for one in [what] if what.is_function else public.members(what) if what.is_class else []:
            if isinstance(one, griffe.Function):
                yield one


def docstring_text(what: griffe.Object) -> str:
    """Return a docstring, with those of the functions that it refers to."""
    words = what.docstring.value if what.docstring else ""
    others = [path for name in ELSEWHERE.findall(words) for path in _paths() if f".{path}".endswith(f".{name}")]
    return "\n".join([words, *(_paths()[path] for path in others)])


@cache
def _paths() -> dict[str, str]:
    return {what.path: what.docstring.value for what in everything() if what.docstring}


def section(what: griffe.Object, kind: griffe.DocstringSectionKind) -> list[tuple[str, str]]:
    """Return the names and descriptions of one section of a docstring."""
    parts = what.docstring.parse("numpy") if what.docstring else []
    entries = [entry for part in parts if part.kind is kind for entry in part.value]
    return [
        (name.strip().lstrip("*"), f"{entry.annotation} {entry.description}")
        for entry in entries
        for name in (entry.name.split(",") if kind in (Part.parameters, Part.attributes) else [""])
    ]


def shown(wrong: dict[str, object]) -> str:
    return "\n".join(f"{path}: {what}" for path, what in wrong.items())


def parameters(function: griffe.Function) -> list[griffe.Parameter]:
    return [p for p in function.parameters if p.name not in ("self", "cls")]


def comment_on(attribute: griffe.Attribute) -> str:
    """The comment behind an attribute, and those on the lines before it."""
    lines = attribute.lines_collection[attribute.filepath]
    first = attribute.lineno - 1
    while lines[first - 1].strip().startswith("#"):
        first -= 1
    return " ".join(line.partition("#")[2] for line in lines[first : attribute.endlineno])


def comments_in(function: griffe.Function) -> str:
    """The comments of a function, those in its signature included."""
    lines = function.lines_collection[function.filepath][function.lineno - 1 : function.endlineno]
    return " ".join(line.partition("#")[2] for line in lines)


def physical(name: str, kind: object) -> bool:
    return bool(KINDS.search(name) and NUMBERS.search(str(kind)))


@cache
def _definitions(module: str) -> dict[int, ast.AST]:
    tree = tree_of(FILES[module])
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]
    return {min([node.lineno, *(d.lineno for d in node.decorator_list)]): node for node in nodes}


def body(function: griffe.Function) -> Iterator[ast.AST]:
    """The nodes of a function, those of functions inside it left out."""
    pending = [_definitions(function.module.path)[function.lineno]]
    while pending:
        for child in ast.iter_child_nodes(pending.pop()):
            if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
                yield child
                pending.append(child)


def test_parameters_sections_match_signatures():
    wrong = {}
    for function in functions():
        documented = sorted(name for name, _ in section(function, Part.parameters))
        there = sorted(p.name for p in parameters(function))
        if documented and documented != there:
            wrong[function.path] = sorted(set(documented) ^ set(there)) or documented
    assert not wrong, shown(wrong)


def test_public_docstrings_name_every_parameter():
    """In a section, or in the words where there is none."""
    wrong = {}
    for function in public_functions():
        listed = {entry for entry, _ in section(function, Part.parameters)}
        words = set(re.findall(r"\w+", docstring_text(function)))
        if missing := [p.name for p in parameters(function) if p.name not in (listed or words)]:
            wrong[function.path] = missing
    assert not wrong, shown(wrong)


def test_internal_docstrings_have_one_line():
    """But for parameters and fields, whose units stand beside them, and comments below for the reasons."""
    allowed = {what.path for what in map(public.target, public.names())} | {one.path for one in public_functions()}
    wrong = {
        what.path: what.docstring.value
        for what in everything()
        if what.docstring and "\n" in what.docstring.value and not _is_within(what.path, allowed)
    }
    assert not wrong, shown(wrong)


def _is_within(path: str, allowed: set[str]) -> bool:
    return path in allowed or path.rpartition(".")[0] in allowed


def test_return_values_are_documented():
    wrong = []
    for function in public_functions():
        kinds = {part.kind for part in function.docstring.parse("numpy")} if function.docstring else set()
        summary = docstring_text(function).partition("\n\n")[0]
        if any(isinstance(node, ast.Yield | ast.YieldFrom) for node in body(function)):
            context = any("contextmanager" in str(d.value) for d in function.decorators)
            right = context or Part.yields in kinds or summary.startswith("Yield")
        elif Part.parameters in kinds and str(function.returns) not in ("None", "NoReturn"):
            right = bool({Part.returns, Part.yields} & kinds) or "eturn" in summary
        else:
            right = bool(summary)
        wrong += [] if right else [function.path]
    assert not wrong, "\n".join(wrong)


def test_raised_exceptions_are_documented():
    wrong = {}
    for function in public_functions():
        own = list(body(function))
        caught = {
            id(n) for t in own if isinstance(t, ast.Try) and t.handlers for part in t.body for n in ast.walk(part)
        }
        raised = [n.exc for n in own if isinstance(n, ast.Raise) and n.exc and id(n) not in caught]
        names = {ast.unparse(e.func if isinstance(e, ast.Call) else e).split(".")[-1] for e in raised}
        types = {name for name in names if name.isidentifier() and name[0].isupper()} - UNSAID
        if silent := {name for name in types if name not in docstring_text(function)}:
            wrong[function.path] = silent
    assert not wrong, shown(wrong)


def test_physical_quantities_have_documented_units():
    """Parameters and return values: in their section, else in the docstring, the comments below it, or beside them."""
    wrong = {}
    for function in functions():
        words = f"{docstring_text(function)} {comments_in(function)}"
        entries = dict(section(function, Part.parameters))
        for p in parameters(function):
            if physical(p.name, p.annotation) and not UNIT.search(entries.get(p.name, words)):
                wrong[f"{function.path}({p.name})"] = entries.get(p.name, words)
        back = " ".join(text for _, text in section(function, Part.returns)) or words
        if physical(function.name, function.returns) and not UNIT.search(back):
            wrong[function.path] = back
    assert not wrong, shown(wrong)


def test_fields_and_properties_that_are_physical_quantities_have_units():
    """In a comment, in the class's section of attributes or parameters, or in the property's docstring."""
    wrong = {}
    for attribute in everything():
        field = isinstance(attribute, griffe.Attribute) and attribute.parent.is_class
        if field and physical(attribute.name, attribute.annotation):
            about = dict(section(attribute.parent, Part.attributes) + section(attribute.parent, Part.parameters))
            unit = re.search(
                r"""key\((?:'[^']*'|"[^"]*"), '([^']*)'""", str(attribute.annotation)
            )  # of a scenario's key
            texts = [docstring_text(attribute), comment_on(attribute), about.get(attribute.name, "")]
            words = " ".join([*texts, unit[1] if unit else ""])
            if not UNIT.search(words):
                wrong[attribute.path] = words
    assert not wrong, shown(wrong)


def test_unit_check_detects_missing_units():
    for words in ("", "A thruster fails.", "Where the vehicle is, shape (3,).", "a thing of its own", "(6, 6)"):
        assert not UNIT.search(words), words
    for words in ("[m]", "m, NED", "# s", "(3,) m/s", "float [N m]", "[-]", "shape (6,) [N, N m]", "in seconds"):
        assert UNIT.search(words), words


def test_summaries_are_imperative_and_no_parameter_is_described_as_any():
    """Functions begin with an imperative verb; properties may begin with a noun."""
    wrong = {}
    for function in functions():
        words = function.docstring.value if function.docstring else ""
        is_property = {"property", "cached_property"} & {str(d.value) for d in function.decorators} or (
            "property" in function.labels
        )
        if words and not is_property and words.split()[0] in NOT_IMPERATIVE:
            wrong[function.path] = words.splitlines()[0]
        if re.search(r"^\s*Any\.$", words, re.M):
            wrong[function.path] = "Any."
    assert not wrong, shown(wrong)
