"""Tokens of the Fuzzy Control Language, and the names in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple

from fuzzy_arbiter.formats.notation import refuse
from fuzzy_arbiter.terms.norms import S_NORMS, T_NORMS

# words of IEC 61131-7 and of jFuzzyLogic's grammar
_WORDS = (
    "abs accu act and asum bdif bsum coa cog cogf cogs cos cosine default defuzzify dmax dmin dsigm einstein "
    "end_defuzzify end_function_block end_fuzzify end_option end_options end_ruleblock end_var exp function "
    "function_block fuzzify gauss gauss2 gbell hamacher if is lm ln log max method min mm nc nipmax nipmin not "
    "nsum option options or probor prod range real rm rule ruleblock sigm sin singletons sum tan term then trape "
    "trian var var_input var_output with"
)
RESERVED = frozenset(_WORDS.split())
SECTIONS = ("VAR_INPUT", "VAR_OUTPUT", "FUZZIFY", "DEFUZZIFY", "RULEBLOCK", "END_FUNCTION_BLOCK")

# jFuzzyLogic's words; fuzzylite has others for some
CONJUNCTIONS = {
    **{norm.fcl: name for name, norm in T_NORMS.items()},
    "DPROD": "drastic_product",
    "HPROD": "hamacher_product",
    "NMIN": "nilpotent_minimum",
}  # words of AND and of ACT
DISJUNCTIONS = {
    **{norm.fcl: name for name, norm in S_NORMS.items()},
    "DSUM": "drastic_sum",
    "ESUM": "einstein_sum",
    "NMAX": "nilpotent_maximum",
    "PROBOR": "probor",
}
JOINS = {**DISJUNCTIONS, "SUM": "sum"}
# which the standard and jFuzzyLogic pair, where one alone is said
PAIRS = {
    "min": "max",
    "prod": "probor",
    "bounded_difference": "bounded_sum",
    "drastic_product": "drastic_sum",
    "nilpotent_minimum": "nilpotent_maximum",
    "hamacher_product": "einstein_sum",
    "einstein_product": "einstein_sum",
}
METHODS = {
    "COG": "centroid",
    "COA": "bisector",
    "MM": "mom",
    "LM": "som",
    "RM": "lom",
    "COGS": "average",
    "COGF": "average",
    "COGSS": "sum",
}

_TOKEN = re.compile(
    r"""(?P<space>\s+) | (?P<comment>\(\*.*?\*\) | /\*.*?\*/ | //[^\n]*) | (?P<open>\(\*|/\*)
    | (?P<name>[A-Za-z_][A-Za-z0-9_]*) | (?P<number>[+-]?(?:[0-9]+(?:\.(?!\.)[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]+)?)
    | (?P<sign>:=|\.\.|[:;,()|+*/^%-]) | (?P<other>.)""",
    re.VERBOSE | re.DOTALL,
)


class Token(NamedTuple):
    """A word, number or sign, with its line; the last of a text is its ``end``."""

    kind: str
    text: str
    line: int
    spaced: bool = False  # True if a space or a comment is before it


def cut(text: str) -> tuple[list[Token], list[tuple[int, str]]]:
    """Split a text into tokens and comments."""
    tokens: list[Token] = []
    comments: list[tuple[int, str]] = []
    line, spaced = 1, False
    for match in _TOKEN.finditer(text):
        kind, word = str(match.lastgroup), match.group()
        if kind == "comment":
            comments.append((line, word[2:] if word.startswith("//") else word[2:-2]))
        elif kind == "open":
            refuse(line, f"the comment that begins here with {word!r} has no end")
        elif kind == "other":
            refuse(line, f"{word!r} is no sign of FCL")
        elif kind != "space":
            tokens.append(Token(kind, word, line, spaced))
        spaced = kind in ("space", "comment")
        line += word.count("\n")
    tokens.append(Token("end", "the end of the file", line))
    return tokens, comments


def block_name(tokens: Sequence[Token]) -> str:
    """Return the name that begins a function block: all tokens of its line, up to a word of the language."""
    words: list[str] = []
    for token in tokens:
        if token.line != tokens[0].line or token.text.upper() in SECTIONS or token.kind == "end":
            break
        words += [" "] * (token.spaced and bool(words)) + [token.text]
    return "".join(words)


def chosen_block(tokens: list[Token], name: str | None) -> list[Token]:
    """Return the tokens of one function block."""
    starts = [i for i, token in enumerate(tokens) if token.text.upper() == "FUNCTION_BLOCK"]
    if name is None and len(starts) < 2:
        return tokens
    ends = [*starts[1:], len(tokens) - 1]
    names = [block_name(tokens[start + 1 :]) for start in starts]
    chosen = [i for i, own in enumerate(names) if own == name]
    if len(chosen) == 1:
        return [*tokens[starts[chosen[0]] : ends[chosen[0]]], tokens[-1]]
    listed = ", ".join(names) or "none: there is no FUNCTION_BLOCK"
    if name is not None:
        refuse(tokens[0].line, f"block is {name!r}, expected {'one of ' * bool(names)}{listed}, each once")
    return refuse(tokens[starts[1]].line, f"got another FUNCTION_BLOCK, expected block=, one of {listed}")
