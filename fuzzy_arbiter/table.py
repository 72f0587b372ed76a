"""Tables in plain text and in HTML."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fuzzy_arbiter.definition import System


def aligned(table: Sequence[tuple[str, ...]]) -> list[str]:
    """Format a table with indented columns of equal width."""
    widths = [max(map(len, column)) for column in zip(*table, strict=True)]
    return ["  " + "  ".join(map(str.ljust, row, widths)).rstrip() for row in table]


def rule_rows(system: System) -> list[dict[str, str]]:
    """Return the words of each rule by column, as `System.rule_table` describes them."""
    # a condition on an output, or a variable with the name of a column, needs the rule's words
    names = {v.name for v in system.inputs}
    by_input = [rule.condition.by_variable() for rule in system.rules]
    is_split = all(words and names >= set(words) for words in by_input) and not names & {"rule", "with"}
    weighted = any(rule.weight != 1.0 for rule in system.rules)
    rows = []
    for i, (rule, words) in enumerate(zip(system.rules, by_input, strict=True), 1):
        row = {"rule": f"R{i}"}
        if words is None or not is_split:
            row["if"] = str(rule.condition)
        else:
            row |= {v.name: words.get(v.name, "") for v in system.inputs}
        row |= {v.name: "" for v in system.outputs} | {c.variable: c.term for c in rule.conclusions}
        rows.append(row | ({"with": f"{rule.weight:g}"} if weighted else {}))
    return rows


def html_of(system: System) -> str:
    """Format the variables and the rules of a system for notebooks."""
    variables = (*system.inputs, *system.outputs)
    spans = [(v.name, f"{v.universe[0]:g} to {v.universe[1]:g}", ", ".join(v.term_names)) for v in variables]
    rules = rule_rows(system)
    tables = (("variable", "universe", "terms"), *spans), (tuple(rules[0]), *(tuple(row.values()) for row in rules))
    return "".join(f"<table>{''.join(map(_html_row, rows, ['h', *'d' * len(rows)]))}</table>" for rows in tables)


def _html_row(cells: Sequence[str], kind: str) -> str:
    return f"<tr>{''.join(f'<t{kind}>{escape(cell)}</t{kind}>' for cell in cells)}</tr>"
