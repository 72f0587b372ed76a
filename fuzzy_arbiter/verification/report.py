"""The result of a verification, as data and as text."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any, Literal

from fuzzy_arbiter.table import aligned
from fuzzy_arbiter.verification.cells import Stretch

Place = dict[str, float | str]
Severity = Literal["fault", "warning", "note"]
SHOWN_ROWS = 32  # maximum number of crisp rows in the text


@dataclass(frozen=True, slots=True)
class Finding:
    """A finding about a system."""

    severity: Severity  # ``fault``: a check fails; ``warning``: perhaps a mistake; ``note``: information
    about: str  # name of the check, or ``terms`` or ``rules``
    text: str  # description, with rule, term and place
    # inputs at which it occurs: numbers, or for crisp rows terms. An input that is not in it can have any value
    place: Place | None = None


@dataclass(frozen=True, slots=True)
class Check:
    """The answer to one question."""

    name: str  # ``complete``, ``consistent`` or ``exclusive``, and each of them with ``graded_`` in front
    holds: bool | None  # true if the check holds; None if that was not decided
    how: str  # method of the check, and the range of its answer


@dataclass(frozen=True, slots=True)
class Row:
    """The conclusions of the rules where every input is in one term."""

    terms: tuple[str, ...]  # term of each input
    concluded: tuple[tuple[str, ...], ...]  # terms that each output is in, at any strength
    rules: tuple[str, ...]  # labels of the rules that fire


@dataclass(frozen=True, slots=True)
class Verification:
    """The properties of a system that follow from its definition alone.

    Crisp rows are all combinations of terms, each taken as a label. Graded inputs are all real numbers in the
    universes; what is said of them holds in real arithmetic. A property that is not decided, or not asked, is None.

    Attributes
    ----------
    inputs, outputs : tuple of str
        Names of the inputs and outputs.
    checks : tuple of Check
        Answers of the checks.
    findings : tuple of Finding
        Findings, the worst first.
    row_count : int
        Number of crisp rows.
    rows : tuple of Row
        All crisp rows, the last term first; none if there are too many.
    stretches : tuple of Stretch
        Stretches on which the degrees of an input do not sum to 1.

    Examples
    --------
    >>> from fuzzy_arbiter import Arbiter
    >>> verification = Arbiter().verify()
    >>> verification.ok, verification.row_count
    (True, 8)
    """

    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    checks: tuple[Check, ...]
    findings: tuple[Finding, ...]
    row_count: int
    rows: tuple[Row, ...]
    stretches: tuple[Stretch, ...]

    @property
    def complete(self) -> bool | None:
        """True if in each crisp row every output has a rule that fires."""
        return self._holds("complete")

    @property
    def consistent(self) -> bool | None:
        """True if in no crisp row rules of weight 1 put one output into two terms."""
        return self._holds("consistent")

    @property
    def exclusive(self) -> bool | None:
        """True if in no crisp row two outputs are above 1/2 in their greatest terms."""
        return self._holds("exclusive")

    @property
    def graded_complete(self) -> bool | None:
        """True if for all real inputs every output has a rule that fires."""
        return self._holds("graded_complete")

    @property
    def graded_consistent(self) -> bool | None:
        """True if for no real inputs one output is above 1/2 in two terms."""
        return self._holds("graded_consistent")

    @property
    def graded_exclusive(self) -> bool | None:
        """True if for no real inputs two outputs are above 1/2 in their greatest terms."""
        return self._holds("graded_exclusive")

    @property
    def ok(self) -> bool:
        """True if there is no fault, and `complete`, `graded_complete` and, of criteria, `consistent` are decided."""
        decides = ("complete", "consistent", "graded_complete")
        decided = all(check.holds is not None for check in self.checks if check.name in decides)
        return decided and all(finding.severity != "fault" for finding in self.findings)

    def _holds(self, name: str) -> bool | None:
        return next((check.holds for check in self.checks if check.name == name), None)

    def as_dict(self) -> dict[str, Any]:
        """Convert the verification to texts, numbers, Booleans, lists and dicts, which JSON can represent."""
        return {
            "ok": self.ok,
            "checks": {check.name: {"holds": check.holds, "how": check.how} for check in self.checks},
            "findings": [asdict(finding) for finding in self.findings],
            "row_count": self.row_count,
            "rows": [
                {
                    "inputs": dict(zip(self.inputs, row.terms, strict=True)),
                    "outputs": {k: list(terms) for k, terms in zip(self.outputs, row.concluded, strict=True)},
                    "rules": list(row.rules),
                }
                for row in self.rows
            ],
            "stretches": [asdict(stretch) for stretch in self.stretches],
        }

    def __str__(self) -> str:
        lines = [f"{self.row_count} crisp rows"]
        if 0 < len(self.rows) <= SHOWN_ROWS:
            table = [(*self.inputs, *self.outputs, "rules that fire")]
            table += [
                (*row.terms, *("/".join(terms) or "-" for terms in row.concluded), " ".join(row.rules))
                for row in self.rows
            ]
            lines += aligned(table)
        answers = {True: "yes", False: "no", None: "not decided"}
        lines.append("checks")
        lines += aligned([(check.name.replace("_", " "), answers[check.holds], check.how) for check in self.checks])
        for severity, title in (("fault", "faults"), ("warning", "warnings"), ("note", "notes")):
            texts = [finding.text for finding in self.findings if finding.severity == severity]
            lines += [title, *(f"  {text}" for text in texts)] if texts else []
        lines.append("ok" if self.ok else "not ok")
        return "\n".join(lines)
