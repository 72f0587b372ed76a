"""The words of the Fuzzy Control Language: what its texts are cut into, and which names they take."""

from __future__ import annotations

import re
from typing import NamedTuple

from fuzzy_arbiter.formats.notation import refuse

# of IEC 61131-7 and of jFuzzyLogic's grammar
_WORDS = (
    "abs accu act and asum bdif bsum coa cog cogf cogs cos cosine default defuzzify dmax dmin dsigm einstein "
    "end_defuzzify end_function_block end_fuzzify end_option end_options end_ruleblock end_var exp function "
    "function_block fuzzify gauss gauss2 gbell hamacher if is lm ln log max method min mm nc nipmax nipmin not "
    "nsum option options or probor prod range real rm rule ruleblock sigm sin singletons sum tan term then trape "
    "trian var var_input var_output with"
)
RESERVED = frozenset(_WORDS.split())

CONJUNCTIONS = {"MIN": "min", "PROD": "prod"}  # of AND, and of ACT
DISJUNCTIONS = {"MAX": "max", "ASUM": "probor"}
PAIRS = {"min": "max", "prod": "probor"}  # which the standard pairs, so that De Morgan's law holds

_TOKEN = re.compile(
    r"""(?P<space>\s+) | (?P<comment>\(\*.*?\*\) | /\*.*?\*/ | //[^\n]*) | (?P<open>\(\*|/\*)
    | (?P<name>[A-Za-z_][A-Za-z0-9_]*) | (?P<number>[+-]?[0-9]+(?:\.[0-9]+)?(?:[eE][+-]?[0-9]+)?)
    | (?P<sign>:=|\.\.|[:;,()]) | (?P<other>.)""",
    re.VERBOSE | re.DOTALL,
)


class Token(NamedTuple):
    """A word, number or sign, and the line where it stands; the last of a text is its ``end``."""

    kind: str
    text: str
    line: int


def cut(text: str) -> tuple[list[Token], list[tuple[int, str]]]:
    """Return the words of a text and, apart, its comments.

    Parameters
    ----------
    text : str
        All of a file.

    Returns
    -------
    list of Token
        Without spaces and comments; the last one is the end.
    list of (int, str)
        Line and text of each comment, without its signs.

    Raises
    ------
    FormatError
        If there is a sign that the language has not, or a comment without end.
    """
    tokens: list[Token] = []
    comments: list[tuple[int, str]] = []
    line = 1
    for match in _TOKEN.finditer(text):
        kind, found = str(match.lastgroup), match.group()
        if kind == "comment":
            comments.append((line, found[2:] if found.startswith("//") else found[2:-2]))
        elif kind == "open":
            refuse(line, f"the comment that begins here with {found!r} has no end")
        elif kind == "other":
            refuse(line, f"{found!r} is no sign of FCL")
        elif kind != "space":
            tokens.append(Token(kind, found, line))
        line += found.count("\n")
    tokens.append(Token("end", "the end of the file", line))
    return tokens, comments
