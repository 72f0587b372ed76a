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

    def check(start: int, value: object, shown: str, row: int) -> object:
        printed = output.getvalue()[start:]
        if value is None and printed:
            if not same_printed(shown, printed):
                raise PageError(f"{page}:{row}: shows {shown}, printed {printed.strip()}")
        elif not same_value(shown, value):
            raise PageError(f"{page}:{row}: shows {shown}, is {value!r}")
        return value

    tree = _with_checks(where, text, int(line))
    names |= {"__name__": "__main__", _CHECK: check, _MARK: output.tell}
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
    """Return the block's tree, numbered as the page is, with a check of every value whose comment shows a result."""
    try:
        tree = ast.parse(text)
    except SyntaxError as error:
        raise PageError(f"{where}: no Python: {error}") from error
    comments = _comments(text)
    for node in ast.walk(tree):
        is_assignment = (
            isinstance(node, ast.Assign) and len(node.targets) == 1 and isinstance(node.targets[0], ast.Name)
        )
        if not (is_assignment or isinstance(node, ast.Expr)):
            continue
        row = node.end_lineno or 0
        comment = comments.get(row, "")
        if (shown := shown_result(comment)) is not None:
            del comments[row]
            mark, row_of_page = ast.Call(ast.Name(_MARK, ast.Load()), [], []), ast.Constant(row + line - 1)
            arguments = [mark, node.value, ast.Constant(shown), row_of_page]  # what was printed before, first
            node.value = ast.copy_location(ast.Call(ast.Name(_CHECK, ast.Load()), arguments, []), node.value)
        elif not is_assignment and looks_like_a_result(comment):
            raise PageError(f"{where}: {comment!r} looks like a result and is no literal; begin with a word")
    for row, comment in comments.items():
        if shown_result(comment) is not None:
            raise PageError(f"{where}, line {row} of the block: nobody checks the result {comment!r}")
    return ast.increment_lineno(ast.fix_missing_locations(tree), line - 1)


def _comments(text: str) -> dict[int, str]:
    """Return the comments behind code, by their lines."""
    lines = text.splitlines()
    return {
        token.start[0]: token.string.lstrip("# ").rstrip()
        for token in tokenize.generate_tokens(io.StringIO(text).readline)
        if token.type == tokenize.COMMENT and lines[token.start[0] - 1][: token.start[1]].strip()
    }
