"""Tokens of the Fuzzy Control Language, and the names in it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import NamedTuple, NoReturn

from fuzzy_arbiter.formats.blocks import Block
from fuzzy_arbiter.formats.notation import refuse

# words of IEC 61131-7 and of jFuzzyLogic's grammar
_WORDS = (
    "abs accu act and asum bdif bsum coa cog cogf cogs cos cosine default defuzzify dmax dmin dsigm einstein "
    "end_defuzzify end_function_block end_fuzzify end_option end_options end_ruleblock end_var exp function "
    "function_block fuzzify gauss gauss2 gbell hamacher if is lm ln log max method min mm nc nipmax nipmin not "
    "nsum option options or probor prod range real rm rule ruleblock sigm sin singletons sum tan term then trape "
    "trian var var_input var_output with"
)
RESERVED = frozenset(_WORDS.split())
# sections of a function block, with the keys of their statements and the word that ends them
SECTIONS: dict[str, tuple[tuple[str, ...], str]] = {
    "VAR_INPUT": ((), "END_VAR"),
    "VAR_OUTPUT": ((), "END_VAR"),
    "FUZZIFY": (("TERM", "RANGE", "ENABLED"), "END_FUZZIFY"),
    "DEFUZZIFY": (("TERM", "METHOD", "DEFAULT", "RANGE", "ACCU", "LOCK", "ENABLED"), "END_DEFUZZIFY"),
    "RULEBLOCK": (("AND", "OR", "ACT", "ACCU", "RULE", "ENABLED"), "END_RULEBLOCK"),
}
_END = "END_FUNCTION_BLOCK"
_LIMITS = {*SECTIONS, _END, *(end for _, end in SECTIONS.values())}  # words that stand in no statement
_MANY = ("TERM", "RULE")
# some texts of the standard leave out the sign of a range; : and := count as one sign
_STATEMENT = re.compile(
    r"(?P<key>\w+)(?: (?P<label>[\w+.-]\S*))?? (?::=? |(?<=RANGE )(?=\())(?P<value>.*)", re.IGNORECASE
)

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
            refuse(line, f"{word!r} is no sign of FCL, whose names are of A to Z, a to z, 0 to 9 and _")
        elif kind != "space":
            tokens.append(Token(kind, word, line, spaced))
        spaced = kind in ("space", "comment")
        line += word.count("\n")
    tokens.append(Token("end", "the end of the file", line))
    return tokens, comments


def _head(tokens: Sequence[Token], start: int) -> tuple[str, int]:
    """Return the name of the function block at an index, all tokens of its line, and the index after it."""
    i = start + 1
    while tokens[i].line == tokens[start].line and tokens[i].text.upper() not in _LIMITS and tokens[i].kind != "end":
        i += 1
    return "".join(" " * token.spaced + token.text for token in tokens[start + 1 : i]).strip(), i


def sections_of(tokens: list[Token]) -> tuple[list[Block], bool]:
    """Split a function block into its head and its sections; tell if a rule ends with its line, as in fuzzylite."""
    if tokens[0].text.upper() != "FUNCTION_BLOCK":
        _unexpected(tokens, 0, "FUNCTION_BLOCK")
    name, i = _head(tokens, 0)
    sections, by_line = [Block("FUNCTION_BLOCK", name, tokens[0].line)], False
    while (kind := tokens[i].text.upper()) != _END:
        if kind not in SECTIONS:
            _unexpected(tokens, i, " or ".join((*SECTIONS, _END)))
        keys, end = SECTIONS[kind]
        section = Block(kind, "", tokens[i].line)
        sections.append(section)
        i += 1
        if keys and tokens[i].kind == "name" and tokens[i].text.upper() not in (*keys, end):
            section.name, section.line = tokens[i].text, tokens[i].line
            i += 1
        while tokens[i].text.upper() != end:
            start, i = i, _statement_end(tokens, i, keys, end)
            _add(section, tokens[start:i])
            by_line |= tokens[i].text != ";"
            i += tokens[i].text == ";"
        i += 1
    if tokens[i + 1].kind != "end":
        _unexpected(tokens, i + 1, "the end of the file")
    return sections, by_line


def _statement_end(tokens: Sequence[Token], start: int, keys: Sequence[str], end: str) -> int:
    """Return the index after the statement at an index, of its semicolon unless a rule ends with its line."""
    is_rule, i = tokens[start].text.upper() == "RULE", start
    while tokens[i].text != ";" and not (is_rule and i > start and _ends_rule(tokens, i)):
        word = tokens[i].text.upper()
        if tokens[i].kind == "end" or word in _LIMITS:
            _unexpected(tokens, i, ";" if i > start and word == end else end)
        if i > start + 1 and not is_rule and word in keys and tokens[i + 1].text in (":", ":="):
            _unexpected(tokens, i, ";")
        i += 1
    return i


def _ends_rule(tokens: Sequence[Token], i: int) -> bool:
    """Return True if a rule ends before an index, at the end of its line."""
    word = tokens[i].text.upper()
    begins_another = word == "RULE" and tokens[i + 1].kind in ("name", "number", "sign")
    return tokens[i].line != tokens[i - 1].line and (word == "END_RULEBLOCK" or begins_another)


def _unexpected(tokens: Sequence[Token], i: int, expected: str) -> NoReturn:
    text = tokens[i].text if tokens[i].kind == "end" else repr(tokens[i].text)
    before = f" after {tokens[i - 1].text!r}" if i else ""
    refuse(tokens[i].line, f"got {text}{before}, expected {expected}")


def _add(section: Block, statement: Sequence[Token]) -> None:
    """Add a statement to its section: a declaration, a term, a rule, or the value of a key."""
    text = " ".join(token.text for token in statement)
    line = statement[0].line if statement else section.line
    keys, _ = SECTIONS[section.kind]
    match = _STATEMENT.fullmatch(text)
    if not keys:
        section.many.append((line, text))
        return
    key, label = (match["key"].upper(), match["label"] or "") if match else ("", "")
    if not match or (label and key not in _MANY):
        refuse(line, f"{text!r}, expected a key, a colon and its value; known keys are {', '.join(keys)}")
    value = match["value"] if key in ("RULE", "DEFAULT", "TERM") else match["value"].upper()
    section.add(line, key, f"{label} {value}" if key == "TERM" else value, keys, _MANY)


def chosen_block(tokens: list[Token], name: str | None) -> list[Token]:
    """Return the tokens of one function block."""
    starts = [i for i, token in enumerate(tokens) if token.text.upper() == "FUNCTION_BLOCK"]
    if name is None and len(starts) < 2:
        return tokens
    ends = [*starts[1:], len(tokens) - 1]
    names = [_head(tokens, start)[0] for start in starts]
    chosen = [i for i, own in enumerate(names) if own == name]
    if len(chosen) == 1:
        return [*tokens[starts[chosen[0]] : ends[chosen[0]]], tokens[-1]]
    listed = ", ".join(names) or "none: there is no FUNCTION_BLOCK"
    if name is not None:
        refuse(tokens[0].line, f"block is {name!r}, expected {'one of ' * bool(names)}{listed}, each once")
    return refuse(tokens[starts[1]].line, f"got another FUNCTION_BLOCK, expected block=, one of {listed}")
