"""Mutants: each arithmetic sign of a source in Python or C, changed one at a time by its tokens."""

from __future__ import annotations

import ast
import io
import keyword
import re
import tokenize
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

OTHER = {"+": "-", "-": "+", "+=": "-=", "-=": "+="}  # a minus of one operand is dropped by a plus in its place

# of C: what a sign must not be looked for in, and what stands before a sign
_C_TOKEN = re.compile(
    r"(?P<skip>\s+|/\*.*?\*/|//[^\n]*|\"(?:\\.|[^\"\\])*\"|'(?:\\.|[^'\\])*'|\#\s*(?:include|if|ifdef|ifndef|endif)[^\n]*)"
    r"|(?P<operand>\.?\d(?:[eEpP][+-]|[\w.])*|[A-Za-z_]\w*|[\])])"
    r"|(?P<sign>\+=|-=|(?:\+\+|--|->)|[+-])"
    r"|(?P<rest>.)",
    re.DOTALL,
)
_C_WORDS = {"return", "case", "else", "do", "sizeof"}  # after them a sign is of one operand
_C_TYPES = {"double", "float", "int", "unsigned", "long"}  # in brackets a cast


@dataclass(frozen=True)
class Sign:
    """A sign as found: which, where, with one operand or two."""

    text: str
    line: int  # from 1
    offset: int  # characters from the beginning of the source
    unary: bool


@dataclass(frozen=True)
class Mutant:
    """A source in which one sign is another."""

    path: str  # from the root of the project, with slashes
    function: str  # with its class; "" outside of any
    text: str  # the line, without blanks around it
    ordinal: int  # from 1, among the signs of such lines of the function
    line: int  # from 1; of this state of the source alone, never to be kept
    offset: int  # characters from the beginning of the source
    before: str
    unary: bool

    @property
    def after(self) -> str:
        """What stands in the sign's place."""
        return OTHER[self.before]

    @property
    def key(self) -> str:
        """The mutant's name, which outlives changes elsewhere in the file."""
        return f"{self.path} | {self.function} | {self.text} | {self.ordinal}"

    def applied(self, source: str) -> str:
        """Return the source with the other sign."""
        end = self.offset + len(self.before)
        if source[self.offset : end] != self.before:
            raise ValueError(f"{self.path}: {self.before!r} expected at {self.offset}")
        return source[: self.offset] + self.after + source[end:]


def mutants_of(path: str, source: str) -> list[Mutant]:
    """Return all mutants of a source, in the order in which their signs stand in it.

    Parameters
    ----------
    path : str
        Ends in ``.py``, ``.c`` or ``.h``.
    source : str
        Its text.

    Returns
    -------
    list of Mutant
        One for each sign.
    """
    python = Path(path).suffix == ".py"
    signs = _python_signs(source) if python else _c_signs(source)
    functions = _python_functions(source) if python else _c_functions(source)
    lines, seen, found = source.splitlines(), Counter[tuple[str, str]](), []
    for sign in signs:
        function, text = functions.get(sign.line, ""), lines[sign.line - 1].strip()
        seen[function, text] += 1
        found.append(Mutant(path, function, text, seen[function, text], sign.line, sign.offset, sign.text, sign.unary))
    return found


# ---- Python ----


def _python_signs(source: str) -> Iterator[Sign]:
    starts = [0]
    for line in source.splitlines(keepends=True):
        starts.append(starts[-1] + len(line))
    operand, depth = False, 0  # whether the last token ends one; how deep in f-strings, which are left alone
    for token in tokenize.generate_tokens(io.StringIO(source).readline):
        name = tokenize.tok_name[token.type]
        depth += {"FSTRING_START": 1, "FSTRING_END": -1}.get(name, 0)
        if name in ("COMMENT", "NL"):
            continue
        if token.type == tokenize.OP and token.string in OTHER and not depth:
            yield Sign(token.string, token.start[0], starts[token.start[0] - 1] + token.start[1], not operand)
        if token.type == tokenize.NAME:
            operand = not keyword.iskeyword(token.string) or token.string in ("None", "True", "False")
        else:
            operand = name in ("NUMBER", "STRING", "FSTRING_END") or token.string in (")", "]", "}")


def _python_functions(source: str) -> dict[int, str]:
    """Return the name of the innermost function or class around each line that is in one."""
    names: dict[int, str] = {}

    def walk(node: ast.AST, around: str) -> None:
        for child in ast.iter_child_nodes(node):
            name = around
            if isinstance(child, ast.FunctionDef | ast.ClassDef) and child.end_lineno:
                name = f"{around}.{child.name}".lstrip(".")
                names.update(dict.fromkeys(range(child.lineno, child.end_lineno + 1), name))
            walk(child, name)

    walk(ast.parse(source), "")
    return names


# ---- C ----


def _c_tokens(source: str) -> Iterator[tuple[str, str, int]]:
    for match in _C_TOKEN.finditer(source):
        if match.lastgroup and match.lastgroup != "skip":
            yield match.lastgroup, match.group(), match.start()


def _c_signs(source: str) -> Iterator[Sign]:
    last: list[str] = ["", "", ""]
    operand = False
    for kind, text, start in _c_tokens(source):
        if text in OTHER:
            cast = last[-1] == ")" and last[-3] == "(" and last[-2] in _C_TYPES
            yield Sign(text, source.count("\n", 0, start) + 1, start, not operand or cast)
        if text not in ("++", "--"):  # after which what was an operand is still one
            operand = kind == "operand" and text not in _C_WORDS
        last = [*last[1:], text]


def _c_functions(source: str) -> dict[int, str]:
    """Return the name of the function around each line that is in one."""
    names: dict[int, str] = {}
    braces = brackets = first = 0
    word = function = ""
    for kind, text, start in _c_tokens(source):
        line = source.count("\n", 0, start) + 1
        if text == "(":
            if not braces and not brackets:
                function, first = word, line
            brackets += 1
        elif text == ")":
            brackets -= 1
        elif text == "{":
            braces += 1
        elif text == "}":
            braces -= 1
            if not braces and function:
                names.update(dict.fromkeys(range(first, line + 1), function))
                function = ""
        elif text in (";", "=") and not braces and not brackets:
            function = ""
        elif kind == "operand" and not brackets:
            word = text
    return names
