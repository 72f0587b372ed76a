"""The checks of a system, in their order, and their findings in words."""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from fuzzy_arbiter.definition import System, variable_names
from fuzzy_arbiter.engines.firing import Firing, logic_of
from fuzzy_arbiter.engines.supported import unsupported_reason
from fuzzy_arbiter.errors import UnsupportedError
from fuzzy_arbiter.propositions import Is
from fuzzy_arbiter.rule import Operators
from fuzzy_arbiter.shapes import Array
from fuzzy_arbiter.verification.cells import Stretch, stretches
from fuzzy_arbiter.verification.questions import (
    ANY,
    FULL,
    SAMPLES,
    Questions,
    conditions_on_inputs,
    greatest_term,
    reach,
)
from fuzzy_arbiter.verification.report import Check, Finding, Place, Row, Severity, Verification
from fuzzy_arbiter.verification.rules import labels, redundant, unused
from fuzzy_arbiter.verification.search import Answer, Goal

EFFORT = 4_000_000_000  # maximum number of statements, some seconds; forty prioritized criteria need 1/500 of it
MAX_ROWS = 256
MAX_TERMS = 200  # maximum number of terms of a variable, as the time grows with its square
NAMED_ROWS = 8
_ROWS, _ALL = "on every crisp row", "for all real inputs"
_WORST_FIRST = {"fault": 0, "warning": 1, "note": 2}


def verify(system: System, effort: int = EFFORT, as_criteria: bool | None = None) -> Verification:
    """Check that a system's rules are complete and its terms have no gaps; of criteria also their consistency.

    Parameters
    ----------
    system : System
        System to verify.
    effort : int
        Maximum number of statements to evaluate; a check that needs more is undecided.
    as_criteria : bool, optional
        True to check also that rules do not contradict each other and that no two outputs are high together; by default
        for the weights of criteria, as rules of other systems may overlap.

    Returns
    -------
    Verification
        Verification as data; its `str` is a text for people.

    Raises
    ------
    UnsupportedError
        If a variable has more than 200 terms; of criteria also if terms are not piecewise linear, norms not *min* and
        *max* or their products, or values not centroids.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> system = Arbiter().system
    >>> from fuzzy_arbiter.verification import verify
    >>> verify(system).complete
    True
    """
    as_criteria = bool(system.weights_of) if as_criteria is None else as_criteria
    if as_criteria and (reason := unsupported_reason(system)):
        raise UnsupportedError(f"verify: {reason}")
    for variable in (*system.inputs, *system.outputs):
        if len(variable.terms) > MAX_TERMS:
            raise UnsupportedError(
                f"verify: {variable.name!r} has {len(variable.terms)} terms, expected at most {MAX_TERMS}"
            )
    checks = _Checks(system, effort)
    checks.rows()
    if as_criteria:
        checks.crisp_criteria()
    checks.support()
    if as_criteria:
        checks.halves()
    gaps = tuple(stretch for variable in system.inputs for stretch in stretches(variable))
    findings = [*checks.findings, *map(_stretch, gaps), *unused(system), *redundant(system)]
    row_count = math.prod(len(v.terms) or 1 for v in system.inputs)
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
        self._effort = effort
        self._terms = {v.name: tuple(Is(v.name, term) for term in v.term_names) for v in system.outputs}

    @functools.cached_property
    def _high(self) -> tuple[Is, ...]:
        return tuple(Is(v.name, greatest_term(v)) for v in self.system.outputs)

    @property
    def _highs(self) -> str:
        return " or ".join(dict.fromkeys(term.term for term in self._high))

    def rows(self) -> None:
        """Check that rules fire on crisp rows."""
        self._complete("complete", Questions.of_rows(self.system, self._effort), _ROWS)

    def crisp_criteria(self) -> None:
        """Check the conclusions on crisp rows."""
        ask = Questions.of_rows(self.system, self._effort)

        def find(severity: Severity, name: str, sets: Mapping[str, tuple[Is, ...]], above: float, text: str) -> Answer:
            answers = ask.ask([ask.two_of(terms, above) for terms in sets.values()])
            for (output, terms), answer in zip(sets.items(), answers, strict=True):
                for place in map(ask.places, answer.boxes):
                    causes = _causes(self.system, _row_strengths(self.system, place), terms, above)
                    self._add(severity, name, f"{text.format(output)} where {_format_place(place)}: {causes}", place)
            self._decided(name, answers, _ROWS)
            return answers[-1]

        find("fault", "consistent", self._terms, FULL, "output {!r}: rules contradict each other")
        answer = find("warning", "exclusive", {"": self._high}, 0.5, f"two outputs are {self._highs}")
        if len(self._high) == 1:
            return
        more = ": at most one is, not exactly one" if answer.is_complete and not answer.boxes else ""
        (answer,) = ask.ask([ask.none_of(self._high, 0.5)], NAMED_ROWS)
        for place in map(ask.places, answer.boxes):
            self._add("note", "exclusive", f"no output is {self._highs} where {_format_place(place)}{more}", place)
        if not answer.is_complete:
            self._add("note", "exclusive", "there may be more rows like that, which were not looked for")

    def support(self) -> None:
        """Check that rules fire at all for graded inputs."""
        ask = Questions.of_support(self.system, self._effort)
        self._complete("graded_complete", ask, _ALL)
        if not ask.proves:
            return
        conditions = labels(self.system)
        answers = ask.ask([Goal((group,), 1, ANY) for group in ask.each()])
        idle = {rule.condition for rule, answer in zip(self.system.rules, answers, strict=True)
                if answer.is_complete and not answer.boxes}  # fmt: skip
        for condition, label in conditions.items():
            if condition in idle:
                self._add("warning", "rules", f"{label}: never fires, as '{condition}' holds for no real inputs")

    def halves(self) -> None:
        """Check that conclusions for graded inputs are not both above 1/2."""
        ask = Questions.of_halves(self.system, self._effort)
        for name, sets, text in (
            ("graded_consistent", self._terms, "output {!r}: rules put it into two terms, both above 1/2,"),
            ("graded_exclusive", {"": self._high}, f"two outputs are {self._highs}, both above 1/2,"),
        ):
            answers = ask.ask([ask.two_of(terms, 0.5) for terms in sets.values()])
            verdicts, methods = set(), set()
            for (output, terms), answer in zip(sets.items(), answers, strict=True):
                verdict, method, place = self._both_above_half(ask, terms, answer)
                verdicts.add(verdict)
                methods.add(method)
                if place is not None:
                    inputs = [float(place.get(v.name, v.universe[0])) for v in self.system.inputs]
                    causes = _causes(self.system, Firing(self.system).strengths(inputs), terms, 0.5)
                    self._add("warning", name, f"{text.format(output)} where {_format_place(place)}: {causes}", place)
            holds = False if False in verdicts else None if None in verdicts else True
            self._conclude(name, holds, "by an example" if holds is False else "; ".join(sorted(methods)))

    def _both_above_half(
        self, ask: Questions, terms: Sequence[Is], answer: Answer
    ) -> tuple[bool | None, str, Place | None]:
        """Decide if no two of some terms are above 1/2 at once; return verdict, method, and counterexample."""
        reaches = reach(self.system, [rule.condition for term in terms for rule, _ in ask.rules_on(term)])
        if answer.is_complete and not answer.boxes and reaches != "samples":
            return True, _ALL + (", as for 'min', which 'prod' is never above" if reaches == "bound" else ""), None
        if answer.boxes and reaches == "exact":
            return False, "", ask.places(answer.boxes[0])
        place, how = self._sampled(ask, terms, lambda cuts: (cuts > 0.5 + 1e-9).sum(axis=0) >= 2)
        return (None if place is None else False), how, place

    def _sampled(
        self, ask: Questions, statements: Sequence[Is], is_bad: Callable[[Array], Any]
    ) -> tuple[Place | None, str]:
        """Return a sample at which strengths of statements, (statements, n), are bad; and the search in words."""
        samples, firing = ask.samples(), Firing(self.system)
        strengths = list(zip(self.system.rules, firing.strengths(samples), strict=True))
        none = np.zeros(len(samples))
        joined = [np.max([none, *(x for rule, x in strengths if s in rule.conclusions)], axis=0) for s in statements]
        rows = np.flatnonzero(is_bad(np.array(joined)))
        if len(rows):
            values = zip(self.system.inputs, samples[rows[0]], strict=True)
            return {v.name: float(x) for v, x in values}, "by an example"
        return None, f"{min(SAMPLES, ask.combinations())} samples of {_count(ask.combinations())} show none"

    def _complete(self, name: str, ask: Questions, where: str) -> None:
        """Check that a rule fires for each output; for norms that may be 0 of positive degrees, by samples."""
        open_ones: list[str] = []
        answers = ask.ask(list(map(ask.none_of, self._terms.values())))
        for output, terms, answer in zip(self.system.outputs, self._terms.values(), answers, strict=True):
            default = "no default" if output.default is None else f"its default {output.default:g} there"
            places = [ask.places(box) for box in answer.boxes]
            if name != "complete" and not ask.proves and not places:
                place, how = self._sampled(ask, terms, lambda cuts: ~cuts.any(axis=0))
                places, open_ones = ([place], open_ones) if place is not None else ([], [*open_ones, how])
            for place in places:
                text = f"output {output.name!r}: no rule fires where {_format_place(place)}; it has {default}"
                self._add("fault" if output.default is None else "warning", name, text, place)
        if open_ones or any(f.about == name for f in self.findings):
            holds = False if any(f.about == name for f in self.findings) else None
            self._conclude(name, holds, "by an example" if holds is False else open_ones[0])
        else:
            self._decided(name, answers, where)

    def _decided(self, name: str, answers: Sequence[Answer], where: str) -> None:
        open_ones = [answer.combinations for answer in answers if not answer.is_complete]
        if any(answer.boxes for answer in answers):
            self._conclude(name, False, "by an example")
        elif open_ones:
            limit = f"more than an effort of {self._effort:g} statements settles"
            self._conclude(name, None, f"{_count(max(open_ones))} combinations are {limit}")
        else:
            self._conclude(name, True, where)

    def _conclude(self, name: str, holds: bool | None, how: str) -> None:
        self.checks.append(Check(name, holds, how))
        if holds is None:
            self._add("warning", name, f"{name.replace('_', ' ')}: not decided, {how}")

    def _add(self, severity: Severity, about: str, text: str, place: Place | None = None) -> None:
        self.findings.append(Finding(severity, about, text, place))


def _row_strengths(system: System, place: Mapping[str, float | str]) -> list[float]:
    """Return the firing strength of each rule in a crisp row."""
    row = {v.name: place.get(v.name, v.term_names[-1]) for v in system.inputs}
    logic = logic_of(system)
    return [
        rule.weight * logic.degree(rule.condition, lambda s: float(row[s.variable] == s.term)) for rule in system.rules
    ]


def _causes(system: System, strengths: Sequence[float], statements: Sequence[Is], above: float) -> str:
    """Name the rules that conclude statements above a strength."""
    parts = []
    for statement in dict.fromkeys(statements):
        rules = [
            f"R{i + 1}"
            for i, (rule, strength) in enumerate(zip(system.rules, strengths, strict=True))
            if statement in rule.conclusions and strength > above
        ]
        if rules:
            parts.append(f"{statement} by {' '.join(rules)}")
    return ", ".join(parts)


def _count(n: int) -> str:
    return str(n) if n < 10**6 else f"about 10^{len(str(n)) - 1}"


def _format_place(place: Place) -> str:
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
    rows = list(itertools.product(*(v.term_names[::-1] or ("any",) for v in system.inputs)))
    columns = dict(zip(names, np.array(rows, dtype=object).T, strict=True))
    logic = logic_of(Operators(), many=True)
    labeled = {Is(v.name, t): (columns[v.name] == t).astype(np.float64) for v in system.inputs for t in v.term_names}
    degrees = [logic.degree(condition, labeled.__getitem__) for condition in conditions_on_inputs(system)]
    fires = [np.broadcast_to(degree > 0.0, len(rows)) for degree in degrees]
    for i, terms in enumerate(rows):
        fired = [r for r in range(len(fires)) if fires[r][i]]
        concluded = {statement for r in fired for statement in system.rules[r].conclusions}
        outputs = tuple(tuple(t for t in v.term_names if Is(v.name, t) in concluded) for v in system.outputs)
        yield Row(terms, outputs, tuple(f"R{r + 1}" for r in fired))
