"""The checks of a system, in their order, and their findings in words."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.engines.firing import Firing, logic_of
from fuzzy_arbiter.engines.supported import unsupported_reason
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.verification.cells import Stretch, stretches
from fuzzy_arbiter.verification.questions import (
    ANY,
    FIRES,
    SAMPLES,
    Effort,
    Questions,
    greatest_term,
    reach,
    rules_on,
    sampled,
)
from fuzzy_arbiter.verification.reasons import reasons, row_strengths
from fuzzy_arbiter.verification.report import Check, Finding, Row, Severity, Verification
from fuzzy_arbiter.verification.rules import labels, redundant, unused
from fuzzy_arbiter.verification.search import Answer, Goal

EFFORT = 4_000_000_000  # maximum number of statements, some seconds; forty prioritized criteria need 1/500 of it
MAX_ROWS = 256
MAX_TERMS = 200  # maximum number of terms of a variable, as the time grows with its square
NAMED_ROWS = 8
_ALL = "for all real inputs"
_WORST_FIRST = {"fault": 0, "warning": 1, "note": 2}


def verify(system: System, effort: int = EFFORT) -> Verification:
    """Check that a system's rules are complete, consistent and exclusive, and that its terms have no gaps.

    Parameters
    ----------
    system : System
        System to verify.
    effort : int
        Greatest number of statements to evaluate; a check that needs more is undecided.

    Returns
    -------
    Verification
        Verification as data; its `str` is a text for people.

    Raises
    ------
    UnsupportedError
        If the system has more than the checks support: piecewise-linear terms, *min* and *max* or their products, the
        centroid.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> from fuzzy_arbiter.verification import verify
    >>> verify(system).complete
    True
    """
    if reason := unsupported_reason(system):
        raise UnsupportedError(f"verify: {reason}")
    for variable in (*system.inputs, *system.outputs):
        if len(variable.terms) > MAX_TERMS:
            raise UnsupportedError(
                f"verify: {variable.name!r} has {len(variable.terms)} terms, expected at most {MAX_TERMS}"
            )
    checks = _Checks(system, effort)
    checks.rows()
    checks.support()
    checks.halves()
    gaps = tuple(stretch for variable in system.inputs for stretch in stretches(variable))
    findings = [*checks.findings, *map(_stretch, gaps), *unused(system), *redundant(system)]
    row_count = math.prod(len(v.terms) for v in system.inputs)
    return Verification(
        variable_names(system.inputs),
        variable_names(system.outputs),
        tuple(checks.checks),
        tuple(sorted(findings, key=lambda finding: _WORST_FIRST[finding.severity])),
        row_count,
        tuple(_rows(system)) if row_count <= MAX_ROWS else (),
        gaps,
    )


class _Checks:
    """Ask the questions, and format the answers."""

    def __init__(self, system: System, effort: int) -> None:
        self.system = system
        self.checks: list[Check] = []
        self.findings: list[Finding] = []
        self._effort = Effort(effort, 8)
        self._terms = {v.name: tuple(Is(v.name, term) for term in v.term_names) for v in system.outputs}
        self._high = tuple(Is(v.name, greatest_term(v)) for v in system.outputs)

    def rows(self) -> None:
        """Check the rules on crisp rows."""
        ask = Questions.of_rows(self.system, self._effort)
        self._complete("complete", ask, "on every crisp row")
        goals = [Goal(tuple(map(ask.fully, terms)), 2, ANY) for terms in self._terms.values()]
        answers = ask.ask(goals)
        for output, answer in zip(self._terms, answers, strict=True):
            for place in map(ask.places, answer.boxes):
                causes = reasons(self.system, row_strengths(self.system, place), self._terms[output], 1.0)
                text = f"output {output!r}: rules contradict each other where {_format_place(place)}: {causes}"
                self._add_finding("fault", "consistent", text, place)
        self._decided("consistent", answers, "on every crisp row")
        high = tuple(map(ask.above_half, self._high))
        (answer,) = ask.ask([Goal(high, 2, ANY)])
        for place in map(ask.places, answer.boxes):
            causes = reasons(self.system, row_strengths(self.system, place), self._high, 0.5)
            self._add_finding(
                "warning", "exclusive", f"two outputs are {self._highs()} where {_format_place(place)}: {causes}", place
            )
        self._decided("exclusive", [answer], "on every crisp row")
        exclusive = answer.all_found and not answer.boxes
        if len(high) == 1:
            return
        (answer,) = ask.ask([Goal(high, 0, 0)], NAMED_ROWS)
        for place in map(ask.places, answer.boxes):
            text = f"no output is {self._highs()} where {_format_place(place)}"
            self._add_finding(
                "note", "exclusive", text + (": at most one is, not exactly one" if exclusive else ""), place
            )
        if not answer.all_found:
            self._add_finding("note", "exclusive", "there may be more rows like that, which were not looked for")

    def support(self) -> None:
        """Check that rules fire at all for graded inputs."""
        ask = Questions.of_support(self.system, self._effort)
        self._complete("graded_complete", ask, _ALL)
        conditions = labels(self.system)
        answers = ask.ask([Goal((((condition, FIRES),),), 1, ANY) for condition in conditions])
        for (condition, label), answer in zip(conditions.items(), answers, strict=True):
            if answer.all_found and not answer.boxes:
                self._add_finding(
                    "warning", "rules", f"{label}: never fires, as '{condition}' holds for no real inputs"
                )

    def halves(self) -> None:
        """Check that conclusions for graded inputs are not both above 1/2."""
        ask = Questions.of_halves(self.system, self._effort)
        for name, sets, text in (
            ("graded_consistent", self._terms, "output {!r}: rules put it into two terms, both above 1/2,"),
            ("graded_exclusive", {"": self._high}, f"two outputs are {self._highs()}, both above 1/2,"),
        ):
            answers = ask.ask([Goal(tuple(map(ask.above_half, terms)), 2, ANY) for terms in sets.values()])
            verdicts, hows = set(), set()
            for (output, terms), answer in zip(sets.items(), answers, strict=True):
                verdict, method, place = self._both_above_half(ask, terms, answer)
                verdicts.add(verdict)
                hows.add(method)
                if place is not None:
                    inputs = [float(place.get(v.name, v.universe[0])) for v in self.system.inputs]
                    causes = reasons(self.system, Firing(self.system).strengths(inputs), terms, 0.5)
                    self._add_finding(
                        "warning", name, f"{text.format(output)} where {_format_place(place)}: {causes}", place
                    )
            holds = False if False in verdicts else None if None in verdicts else True
            method = "by an example" if holds is False else "; ".join(sorted(hows))
            self.checks.append(Check(name, holds, method))
            if holds is None:
                self._add_finding("warning", name, f"{name.replace('_', ' ')}: not decided, {method}")

    def _both_above_half(
        self, ask: Questions, terms: Sequence[Is], answer: Answer
    ) -> tuple[bool | None, str, dict[str, float | str] | None]:
        """Decide if no two of some terms are above 1/2 at once; return verdict, method, and counterexample."""
        reaches = reach(self.system, [rule.condition for term in terms for rule in rules_on(self.system, term)])
        if answer.all_found and not answer.boxes and reaches == "exact":
            return True, _ALL, None
        if answer.all_found and not answer.boxes and reaches == "bound":
            return True, f"{_ALL}, as for 'min', which 'prod' is never above", None
        if answer.boxes and reaches == "exact":
            return False, "", ask.places(answer.boxes[0])
        place = sampled(self.system, ask, terms)
        if place is not None:
            return False, "", place
        return None, f"{min(SAMPLES, ask.combinations())} samples of {_count(ask.combinations())} show none", None

    def _complete(self, name: str, ask: Questions, where: str) -> None:
        answers = ask.ask([Goal(tuple(map(ask.firing, terms)), 0, 0) for terms in self._terms.values()])
        for output, answer in zip(self.system.outputs, answers, strict=True):
            for place in map(ask.places, answer.boxes):
                said = f"output {output.name!r}: no rule fires where {_format_place(place)}"
                if output.default is None:
                    self._add_finding("fault", name, f"{said}; it has no default", place)
                else:
                    self._add_finding("warning", name, f"{said}; it has its default {output.default:g} there", place)
        self._decided(name, answers, where)

    def _decided(self, name: str, answers: Sequence[Answer], where: str) -> None:
        if any(answer.boxes for answer in answers):
            self.checks.append(Check(name, False, "by an example"))
            return
        open_ones = [answer for answer in answers if not answer.all_found]
        if not open_ones:
            self.checks.append(Check(name, True, where))
            return
        most = max(answer.combinations for answer in open_ones)
        how = f"{_count(most)} combinations are more than an effort of {self._effort.limit:g} statements settles"
        self.checks.append(Check(name, None, how))
        self._add_finding("warning", name, f"{name.replace('_', ' ')}: not decided, {how}")

    def _add_finding(
        self, severity: Severity, about: str, text: str, place: dict[str, float | str] | None = None
    ) -> None:
        self.findings.append(Finding(severity, about, text, place))

    def _highs(self) -> str:
        return " or ".join(dict.fromkeys(term.term for term in self._high))


def _count(n: int) -> str:
    return str(n) if n < 10**6 else f"about 10^{len(str(n)) - 1}"


def _format_place(place: dict[str, float | str]) -> str:
    if not place:
        return "the inputs are anything"
    parts = (f"{name} is {x}" if isinstance(x, str) else f"{name} = {x:.6g}" for name, x in place.items())
    return ", ".join(parts)


def _stretch(stretch: Stretch) -> Finding:
    where = f"input {stretch.variable!r}: " + ("at " if stretch.start == stretch.end else "in ") + stretch.place
    if stretch.kind == "gap":
        return Finding("warning", "terms", f"{where} no term has a degree above 0", {stretch.variable: stretch.start})
    side = "less" if stretch.kind == "below" else "more"
    sums = f"{stretch.least:g}" if stretch.least == stretch.greatest else f"{stretch.least:g} to {stretch.greatest:g}"
    return Finding("note", "terms", f"{where} the degrees sum to {side} than 1: {sums}")


def _rows(system: System) -> Iterator[Row]:
    names = variable_names(system.inputs)
    rows = list(itertools.product(*(v.term_names[::-1] for v in system.inputs)))
    columns = dict(zip(names, np.array(rows, dtype=object).T, strict=True))
    logic = logic_of(Operators(), many=True)
    labeled = {Is(v.name, t): (columns[v.name] == t).astype(np.float64) for v in system.inputs for t in v.term_names}
    fires = [logic.degree(rule.condition, labeled.__getitem__) > 0.0 for rule in system.rules]
    for i, terms in enumerate(rows):
        fired = [r for r in range(len(fires)) if fires[r][i]]
        concluded = {statement for r in fired for statement in system.rules[r].conclusions}
        outputs = tuple(tuple(t for t in v.term_names if Is(v.name, t) in concluded) for v in system.outputs)
        yield Row(terms, outputs, tuple(f"R{r + 1}" for r in fired))
