"""Blocks of Python: run, and their comments that show results compared."""

import ast
import contextlib
import io
import subprocess
import sys
import tokenize
from typing import Any

from tests.docs.comparing import looks_like_a_result, same_printed, same_value, shown_result
from tests.docs.directives import PageError

TIMEOUT = 120  # s
_CHECK, _MARK = "__check_result__", "__mark_output__"


def run_python(where: str, text: str, names: dict[str, Any]) -> str:
    """Run a block in a namespace and return what it printed.

    A comment that is a literal, or ends in one after a colon, behind an expression or an assignment to one name, is
    compared with its value; behind a call of ``print`` with what that printed.
    """
    page, _, line = where.rpartition(":")
    output = io.StringIO()
    start = 0

    def mark() -> None:
        nonlocal start
        start = output.tell()

    def check(value: object, shown: str, row: int) -> None:
        printed = output.getvalue()[start:]
        if value is None and printed:
            if not same_printed(shown, printed):
                raise PageError(f"{page}:{row}: shows {shown}, printed {printed.strip()}")
        elif not same_value(shown, value):
            raise PageError(f"{page}:{row}: shows {shown}, is {value!r}")

    tree = _with_checks(where, text, int(line))
    names |= {"__name__": "__main__", _CHECK: check, _MARK: mark}
    with contextlib.redirect_stdout(output):
        exec(compile(tree, page, "exec"), names)
    return output.getvalue()


def run_alone(where: str, text: str) -> str:
    """Run a block in a process of its own, for libraries that do not bear each other, and return what it printed."""
    if any(shown_result(comment) is not None for comment in _comments(text).values()):
        raise PageError(f"{where}: nobody checks results in comments of a block that runs alone; print them")
    done = subprocess.run([sys.executable, "-c", text], capture_output=True, text=True, timeout=TIMEOUT, check=False)
    if done.returncode:
        raise PageError(f"{where}: {done.stderr}")
    return done.stdout


def _with_checks(where: str, text: str, line: int) -> ast.Module:
    """Return the block's tree, numbered as the page is, with a check behind every statement that shows a result."""
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise PageError(f"{where}: no Python: {error}") from error
    transformer = _Checks(where, _comments(text), line - 1)
    tree = ast.fix_missing_locations(transformer.visit(tree))
    for row, comment in transformer.comments.items():
        if shown_result(comment) is not None:
            raise PageError(f"{where}, line {row} of the block: nobody checks the result {comment!r}")
    ast.increment_lineno(tree, line - 1)
    return tree


def _comments(text: str) -> dict[int, str]:
    """Return the comments behind code, by their lines."""
    lines = text.splitlines()
    return {
        token.start[0]: token.string.lstrip("# ").rstrip()
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type == tokenize.COMMENT and lines[token.start[0] - 1][: token.start[1]].strip()
    }


class _Checks(ast.NodeTransformer):
    """Puts a check at every expression, and every assignment to one name, whose comment shows a result."""

    def __init__(self, where: str, comments: dict[int, str], offset: int) -> None:
        self.where, self.comments, self.offset = where, comments, offset

    def visit_Expr(self, node: ast.Expr) -> list[ast.stmt]:
        comment = self.comments.get(node.end_lineno or 0, "")
        shown = self._taken(node)
        if shown is None:
            if looks_like_a_result(comment):
                raise PageError(f"{self.where}: {comment!r} looks like a result and is no literal; begin with a word")
            return [node]
        return [_call(_MARK, node), self._checked(node.value, shown, node)]

    def visit_Assign(self, node: ast.Assign) -> list[ast.stmt]:
        if len(node.targets) != 1 or not isinstance(node.targets[0], ast.Name):
            return [node]
        shown = self._taken(node)
        if shown is None:
            return [node]
        value = ast.Name(node.targets[0].id, ast.Load())
        return [node, _call(_MARK, node), self._checked(value, shown, node)]

    def _taken(self, node: ast.stmt) -> str | None:
        shown = shown_result(self.comments.get(node.end_lineno or 0, ""))
        if shown is not None:
            del self.comments[node.end_lineno or 0]
        return shown

    def _checked(self, value: ast.expr, shown: str, node: ast.stmt) -> ast.stmt:
        row = ast.Constant((node.end_lineno or 0) + self.offset)
        return _call(_CHECK, node, value, ast.Constant(shown), row)


def _call(function: str, node: ast.stmt, *arguments: ast.expr) -> ast.stmt:
    call = ast.Expr(ast.Call(ast.Name(function, ast.Load()), list(arguments), []))
    return ast.copy_location(call, node)
