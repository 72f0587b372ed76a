"""The arbiter: memberships in, weights out, by the engine of one's choice."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from numbers import Integral, Real
from typing import Literal, get_args

from fuzzy_arbiter import closed_form
from fuzzy_arbiter.definition import SECTION_VI, Criterion, Rule, check_criteria, hierarchical_rules
from fuzzy_arbiter.errors import DefinitionError, MembershipError

EngineName = Literal["closed", "skfuzzy"]
ENGINES: tuple[str, ...] = get_args(EngineName)


class Arbiter:
    """Decides which of several prioritised criteria matters now, in the manner of a human pilot.

    Parameters
    ----------
    criteria : sequence of Criterion
        In order of priority, the highest first; default: obstacle, shape, depth of the paper's section VI.
    engine : {"closed", "skfuzzy"}
        ``closed`` evaluates the exact closed form; ``skfuzzy`` samples the output universe with scikit-fuzzy.
    points : int
        Points of the output universe, for the ``skfuzzy`` engine.

    Raises
    ------
    DefinitionError
        If the definition makes no arbiter.

    Examples
    --------
    >>> Arbiter()([1.0, 1.0, 0.0])
    (1.0, 0.0, 0.0)
    """

    def __init__(
        self, criteria: Sequence[Criterion] = SECTION_VI, engine: EngineName = "closed", points: int = 101
    ) -> None:
        self.criteria: tuple[Criterion, ...] = check_criteria(criteria)
        self.rules: tuple[Rule, ...] = hierarchical_rules(len(self.criteria))
        self.engine = engine
        self._weights: Callable[[Sequence[float]], tuple[float, ...]]
        if engine == "closed":
            self._weights = closed_form.weights
        elif engine == "skfuzzy":
            if not isinstance(points, Integral) or points < 3:
                raise DefinitionError(f"points is {points!r}, expected a whole number, 3 or more")
            from fuzzy_arbiter.scikit import ScikitEngine  # a second of imports, for those who ask for it

            self._weights = ScikitEngine(self.criteria, self.rules, points).weights
        else:
            raise DefinitionError(f"engine is {engine!r}, expected one of {', '.join(ENGINES)}")

    def __call__(self, memberships: Sequence[float] | Mapping[str, float]) -> tuple[float, ...]:
        """Return the weight of each criterion.

        Parameters
        ----------
        memberships : sequence of float, or mapping from criterion's name to float
            Degree in [0, 1] to which each criterion asks for attention (its on-term).

        Returns
        -------
        tuple of float
            Weights in [0, 1], in order of priority.

        Raises
        ------
        MembershipError
            If one is missing, unknown, NaN, or outside [0, 1].
        """
        values = self._in_order(memberships) if isinstance(memberships, Mapping) else memberships
        if len(values) != len(self.criteria):
            raise MembershipError(f"{len(values)} memberships came, expected {len(self.criteria)}")
        for criterion, m in zip(self.criteria, values, strict=True):
            if not isinstance(m, Real) or not 0.0 <= m <= 1.0:  # NaN fails too
                raise MembershipError(f"{criterion.name}: membership is {m!r}, expected a number in [0, 1]")
        return self._weights([float(m) for m in values])

    def _in_order(self, memberships: Mapping[str, float]) -> list[float]:
        names = [c.name for c in self.criteria]
        for name in names:
            if name not in memberships:
                raise MembershipError(f"{name}: membership is missing")
        for name in memberships:
            if name not in names:
                raise MembershipError(f"{name}: unknown criterion; expected {', '.join(names)}")
        return [memberships[name] for name in names]

    def __repr__(self) -> str:
        return f"Arbiter(criteria={self.criteria!r}, engine={self.engine!r})"

    def __str__(self) -> str:
        return "\n".join(f"R{i + 1}: {rule.text(self.criteria)}" for i, rule in enumerate(self.rules))
