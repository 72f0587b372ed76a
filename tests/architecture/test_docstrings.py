"""Docstrings match the code: parameters, errors, return values, and units."""

import ast
import re
from collections.abc import Callable, Iterator
from functools import cache

import griffe
import pytest

from tests.architecture import public
from tests.architecture.modules import FILES, tree_of

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
# the rest is said there
ELSEWHERE = re.compile(r"(?:Do what|Return what|[Aa]rguments as|[Aa]s|[Aa]s for|see|of) `([\w.]+)`")
NOT_IMPERATIVE = {"What", "Whether", "How", "Where", "When", "Who", "Which", "The", "A", "An", "Its", "Each", "All"}

Part = griffe.DocstringSectionKind
Complaints = Iterator[tuple[str, object]]  # path of what is wrong, and what is


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


def text_of(what: griffe.Object) -> str:
    return what.docstring.value if what.docstring else ""


@cache
def _paths() -> dict[str, str]:
    return {what.path: what.docstring.value for what in everything() if what.docstring}


def whole_text(what: griffe.Object) -> str:
    """Return a docstring, with those of the functions that it refers to."""
    others = [path for name in ELSEWHERE.findall(text_of(what)) for path in _paths() if f".{path}".endswith(f".{name}")]
    return "\n".join([text_of(what), *(_paths()[path] for path in others)])


def section(what: griffe.Object, kind: griffe.DocstringSectionKind) -> list[tuple[str, str]]:
    """Return the names and descriptions of one section of a docstring."""
    parts = what.docstring.parse("numpy") if what.docstring else []
    return [
        (name.strip().lstrip("*"), f"{entry.annotation} {entry.description}")
        for part in parts if part.kind is kind
        for entry in part.value
        for name in (entry.name.split(",") if kind in (Part.parameters, Part.attributes) else [""])
    ]  # fmt: skip


def parameters(function: griffe.Function) -> list[griffe.Parameter]:
    return [p for p in function.parameters if p.name not in ("self", "cls")]


def comments(what: griffe.Object, above: bool = False) -> str:
    """The comments beside a definition and within it, and those on the lines above it."""
    lines, first = what.lines_collection[what.filepath], what.lineno - 1
    while above and lines[first - 1].strip().startswith("#"):
        first -= 1
    return " ".join(line.partition("#")[2] for line in lines[first : what.endlineno])


def physical(name: str, kind: object) -> bool:
    return bool(KINDS.search(name) and NUMBERS.search(str(kind)))


@cache
def _definitions(module: str) -> dict[int, ast.AST]:
    nodes = [n for n in ast.walk(tree_of(FILES[module])) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    return {min([node.lineno, *(d.lineno for d in node.decorator_list)]): node for node in nodes}


def body(function: griffe.Function) -> Iterator[ast.AST]:
    """The nodes of a function, those of functions inside it left out."""
    pending = [_definitions(function.module.path)[function.lineno]]
    while pending:
        for child in ast.iter_child_nodes(pending.pop()):
            if not isinstance(child, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda | ast.ClassDef):
                yield child
                pending.append(child)


# ---- the rules -----------------------------------------------------------------------------------------------------


def parameters_sections_match_signatures() -> Complaints:
    for function in functions():
        documented = sorted(name for name, _ in section(function, Part.parameters))
        if documented and documented != sorted(p.name for p in parameters(function)):
            yield function.path, documented


def public_docstrings_name_every_parameter() -> Complaints:
    """In a section, or in the words where there is none."""
    for function in public_functions():
        listed = {entry for entry, _ in section(function, Part.parameters)}
        words = listed or set(re.findall(r"\w+", whole_text(function)))
        yield from ((function.path, p.name) for p in parameters(function) if p.name not in words)


def internal_docstrings_have_one_line() -> Complaints:
    """But for parameters and fields, whose units stand beside them, and comments below for the reasons."""
    allowed = {what.path for what in map(public.target, public.names())} | {one.path for one in public_functions()}
    for what in everything():
        if "\n" in text_of(what) and not {what.path, what.path.rpartition(".")[0]} & allowed:
            yield what.path, text_of(what)


def return_values_are_documented() -> Complaints:
    for function in public_functions():
        kinds = {part.kind for part in function.docstring.parse("numpy")} if function.docstring else set()
        summary = whole_text(function).partition("\n\n")[0]
        if any(isinstance(node, ast.Yield | ast.YieldFrom) for node in body(function)):
            context = any("contextmanager" in str(d.value) for d in function.decorators)
            right = context or Part.yields in kinds or summary.startswith("Yield")
        elif Part.parameters in kinds and str(function.returns) not in ("None", "NoReturn"):
            right = bool({Part.returns, Part.yields} & kinds) or "eturn" in summary
        else:
            right = bool(summary)
        if not right:
            yield function.path, summary


def raised_exceptions_are_documented() -> Complaints:
    for function in public_functions():
        own = list(body(function))
        tries = [node for node in own if isinstance(node, ast.Try) and node.handlers]
        caught = {id(inner) for node in tries for part in node.body for inner in ast.walk(part)}
        raised = [n.exc for n in own if isinstance(n, ast.Raise) and n.exc and id(n) not in caught]
        names = {ast.unparse(e.func if isinstance(e, ast.Call) else e).split(".")[-1] for e in raised}
        types = {name for name in names if name.isidentifier() and name[0].isupper()} - UNSAID
        yield from ((function.path, name) for name in types if name not in whole_text(function))


def physical_quantities_have_documented_units() -> Complaints:
    """Parameters and return values: in their section, else in the docstring, the comments below it, or beside them."""
    for function in functions():
        words = f"{whole_text(function)} {comments(function)}"
        entries = dict(section(function, Part.parameters))
        for p in parameters(function):
            if physical(p.name, p.annotation) and not UNIT.search(entries.get(p.name, words)):
                yield f"{function.path}({p.name})", entries.get(p.name, words)
        back = " ".join(text for _, text in section(function, Part.returns)) or words
        if physical(function.name, function.returns) and not UNIT.search(back):
            yield function.path, back


def fields_and_properties_that_are_physical_quantities_have_units() -> Complaints:
    """In a comment, in the class's section of attributes or parameters, or in the property's docstring."""
    for attribute in everything():
        field = isinstance(attribute, griffe.Attribute) and attribute.parent.is_class
        if field and physical(attribute.name, attribute.annotation):
            about = dict(section(attribute.parent, Part.attributes) + section(attribute.parent, Part.parameters))
            key = re.search(r"""key\((?:'[^']*'|"[^"]*"), '([^']*)'""", str(attribute.annotation))  # of a scenario
            texts = [whole_text(attribute), comments(attribute, above=True), about.get(attribute.name, "")]
            words = " ".join([*texts, key[1] if key else ""])
            if not UNIT.search(words):
                yield attribute.path, words


def summaries_are_imperative_and_no_parameter_is_described_as_any() -> Complaints:
    """Functions begin with an imperative verb; properties may begin with a noun."""
    for function in functions():
        words = text_of(function)
        is_property = "property" in function.labels or {"property", "cached_property"} & {
            str(d.value) for d in function.decorators
        }
        if words and not is_property and words.split()[0] in NOT_IMPERATIVE:
            yield function.path, words.splitlines()[0]
        if re.search(r"^\s*Any\.$", words, re.M):
            yield function.path, "Any."


RULES: tuple[Callable[[], Complaints], ...] = (
    parameters_sections_match_signatures, public_docstrings_name_every_parameter, internal_docstrings_have_one_line,
    return_values_are_documented, raised_exceptions_are_documented, physical_quantities_have_documented_units,
    fields_and_properties_that_are_physical_quantities_have_units,
    summaries_are_imperative_and_no_parameter_is_described_as_any,
)  # fmt: skip


@pytest.mark.slow  # to read all of the code takes seconds
@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.__name__)
def test_docstrings(rule):
    wrong = [f"{path}: {what}" for path, what in rule()]
    assert not wrong, "\n".join(wrong)


def test_unit_check_detects_missing_units():
    for words in ("", "A thruster fails.", "Where the vehicle is, shape (3,).", "a thing of its own", "(6, 6)"):
        assert not UNIT.search(words), words
    for words in ("[m]", "m, NED", "# s", "(3,) m/s", "float [N m]", "[-]", "shape (6,) [N, N m]", "in seconds"):
        assert UNIT.search(words), words
