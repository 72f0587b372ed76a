"""Comparison of a page's shown output with the actual output."""

import ast
import doctest
import re

import numpy as np

_TOKEN = re.compile(r"\.\.\.|[-+]?(?:\d+\.\d*|\.\d+|\d+)(?:[eE][-+]?\d+)?|\w+|\S")
_NUMBER = re.compile(r"[-+]?(?:\d+\.\d*|\.\d+|\d+)(?:[eE][-+]?\d+)?")
_LITERAL = (ast.Expression, ast.Constant, ast.Tuple, ast.List, ast.Dict, ast.Set, ast.UnaryOp, ast.USub, ast.Load)
ROUNDING = 1e-12  # relative: what another machine's arithmetic may make of the last digits


def shown_result(comment: str) -> str | None:
    """Return the result that a comment shows, whole or after its last colon; None if it shows none."""
    for text in (comment, comment.rpartition(": ")[2]):
        if _is_literal(text.strip()):
            return text.strip()
    return None


def looks_like_a_result(comment: str) -> bool:
    """Return whether a comment begins as a result does."""
    return re.match(r"[-+]?[\d.]|[(\[{'\"]|(?:True|False|None)\b", comment.strip()) is not None


def same_value(shown: str, value: object) -> bool:
    """Compare a shown result with a value: numbers to the digits that are shown, ``...`` for anything."""
    return _same(*(_TOKEN.findall(text.replace('"', "'")) for text in (shown, repr(_plain(value)))))


def same_printed(shown: str, printed: str) -> bool:
    """Compare a shown result with what a statement printed."""
    text = ast.literal_eval(shown) if shown[0] in "'\"" else shown
    return _same(_TOKEN.findall(text), _TOKEN.findall(printed))


def same_output(shown: str, printed: str) -> bool:
    """Compare a block of output as doctest does, blanks at the ends of lines left out, ``...`` for anything."""
    want, got = ("\n".join(line.rstrip() for line in text.strip("\n").splitlines()) + "\n" for text in (shown, printed))
    return doctest.OutputChecker().check_output(want, got, doctest.ELLIPSIS)


def _is_literal(text: str) -> bool:
    try:
        tree = ast.parse(text, mode="eval")
    except SyntaxError:
        return False
    body = tree.body
    if isinstance(body, ast.Call) and isinstance(body.func, ast.Name) and body.func.id == "array" and not body.keywords:
        return all(isinstance(node, _LITERAL) for argument in body.args for node in ast.walk(argument))
    return all(isinstance(node, _LITERAL) for node in ast.walk(tree))


def _plain(value: object) -> object:
    """Return a value whose numbers are Python's; pages show a named tuple by its values."""
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, tuple) and hasattr(value, "_fields"):
        return tuple(map(_plain, value))
    if type(value) in (tuple, list, set):
        return type(value)(map(_plain, value))
    if type(value) is dict:
        return {_plain(key): _plain(item) for key, item in value.items()}
    return value


def _same(shown: list[str], actual: list[str]) -> bool:
    for k, token in enumerate(shown):
        if token == "...":
            return any(_same(shown[k + 1 :], actual[j:]) for j in range(k, len(actual) + 1))
        if k >= len(actual) or not _same_token(token, actual[k]):
            return False
    return len(shown) == len(actual)


def _same_token(shown: str, actual: str) -> bool:
    if shown == actual:
        return True
    if not (_NUMBER.fullmatch(shown) and _NUMBER.fullmatch(actual)) or shown.lstrip("-+").isdigit():
        return False
    digits, _, exponent = shown.lower().partition("e")
    half = 0.5 * 10.0 ** (int(exponent or 0) - len(digits.partition(".")[2]))
    return abs(float(shown) - float(actual)) <= max(half * (1 + 1e-9), ROUNDING * abs(float(actual)))
