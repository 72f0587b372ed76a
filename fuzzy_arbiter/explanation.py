"""Explain outputs: degrees of terms, strengths of rules, cuts of outputs, and the deciding rules."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from fuzzy_arbiter.definition import System
from fuzzy_arbiter.engines.engine import Engine
from fuzzy_arbiter.result import Result, result_class
from fuzzy_arbiter.table import aligned

TIE = 1e-12  # weights that are nearer to each other than this are equal, but for rounding
WIDTH = 100  # columns of a rule in the text


@dataclass(frozen=True, slots=True)
class InputDegrees:
    """An input's value, and the degree of each of its terms."""

    name: str
    value: float
    degrees: dict[str, float]


@dataclass(frozen=True, slots=True)
class FiredRule:
    """Result of one rule."""

    label: str  # label of the rule; ``R1`` for the first
    text: str  # text of the rule
    strength: float  # degree of its condition times its weight
    conclusions: dict[str, str]  # concluded term of each output that the rule concludes on

    @property
    def fired(self) -> bool:
        """True if the strength is above 0."""
        return self.strength > 0.0


@dataclass(frozen=True, slots=True)
class OutputDecision:
    """Derivation of one output's value."""

    name: str  # name in results: that of the criterion whose weight the output is, else the output's own
    variable: str  # name of the output in the rules
    cuts: dict[str, float]  # greatest strength of the rules that conclude each term
    centroid: float  # value in the universe, before it is normalized
    value: float  # what a call returns; NaN if no rule fired and there is no default
    decided_by: str | None  # label of the rule that gives the greatest cut, of several the first; None if no rule fired
    runner_up: str | None  # label of the strongest rule for another term; None if none fired
    margin: float  # strength of the deciding rule less that of the runner-up; 0 is a tie
    default_used: bool  # true if no rule fired, so that the centroid is the output's default, or NaN if it has none


@dataclass(frozen=True, slots=True)
class Explanation:
    """Derivation of the outputs of one sample."""

    inputs: tuple[InputDegrees, ...]  # inputs in the system's order
    rules: tuple[FiredRule, ...]  # all rules, also those that did not fire
    outputs: tuple[OutputDecision, ...]  # outputs in the system's order
    ranked: bool  # true if the outputs are weights of criteria, which the following compares
    # the output with the maximum weight, by its name in results; None if that is shared, or all weights are 0. An
    # output that is NaN takes no part
    winner: str | None
    runner_up: str | None  # the output with the next weight; None without a winner, or if there is no other output
    margin: float  # maximum weight less the next, or the weight of the only output
    tied: tuple[str, ...]  # the outputs that share the maximum weight, if it is not 0; none if there is a winner

    @property
    def result(self) -> Result[float]:
        """The values of the outputs, as a call returns them."""
        return tuple.__new__(result_class([o.name for o in self.outputs]), [o.value for o in self.outputs])

    def as_dict(self) -> dict[str, Any]:
        """Convert the explanation to values that JSON can represent."""
        data = asdict(self)
        for item in data["outputs"]:
            item |= {key: None for key in ("centroid", "value") if item[key] != item[key]}
        for rule, item in zip(self.rules, data["rules"], strict=True):
            item["fired"] = rule.fired
        if not data.pop("ranked"):
            data = {key: data[key] for key in ("inputs", "rules", "outputs")}
        return {key: list(item) if isinstance(item, tuple) else item for key, item in data.items()}

    def __str__(self) -> str:
        lines = ["inputs"]
        lines += aligned([(i.name, f"{i.value:.6g}", _pairs(i.degrees)) for i in self.inputs])
        fired = [rule for rule in self.rules if rule.fired]
        lines.append(f"rules that fired, {len(fired)} of {len(self.rules)}" if fired else "no rule fired")
        lines += aligned([(rule.label, f"{rule.strength:.6g}", _short(rule.text)) for rule in fired])
        lines.append("outputs")
        lines += aligned([(_title(o), f"{o.value:.6g}", _pairs(o.cuts), _decision(o)) for o in self.outputs])
        if not self.ranked or len(self.outputs) == 1:
            return "\n".join(lines)
        if self.winner is not None:
            second = f", {self.margin:.6g} above {self.runner_up}" if self.runner_up is not None else ""
            lines.append(f"winner: {self.winner}{second}")
        else:
            lines.append(
                f"no winner: {', '.join(self.tied)} are equal" if self.tied else "no winner: all weights are 0"
            )
        return "\n".join(lines)


def explain(engine: Engine, inputs: Sequence[float]) -> Explanation:
    """Explain the outputs for one sample."""
    system, firing = engine.system, engine.firing
    row = np.array([inputs], dtype=np.float64)  # a batch, in which an output without a rule that fires is no error
    values, centroids = engine.weights_of_many(row)[0].tolist(), engine.centroids_of_many(row)[0].tolist()
    strengths = firing.strengths(inputs)
    rules = tuple(
        FiredRule(f"R{i + 1}", str(rule), strength, {c.variable: c.term for c in rule.conclusions})
        for i, (rule, strength) in enumerate(zip(system.rules, strengths, strict=True))
    )
    outputs = tuple(
        _decided(system, rules, k, centroid, value)
        for k, (centroid, value) in enumerate(zip(centroids, values, strict=True))
    )
    degrees = tuple(
        InputDegrees(v.name, float(x), {t.name: t.membership(x) for t in v.terms})
        for v, x in zip(system.inputs, inputs, strict=True)
    )
    ranking = _ranking(system.weights_of, values) if system.weights_of else (None, None, 0.0, ())
    return Explanation(degrees, rules, outputs, bool(system.weights_of), *ranking)


def _decided(system: System, rules: Sequence[FiredRule], k: int, centroid: float, value: float) -> OutputDecision:
    output = system.outputs[k]
    cuts = dict.fromkeys(output.term_names, 0.0)
    concluding = [(rule.conclusions[output.name], rule) for rule in rules if output.name in rule.conclusions]
    for term, rule in concluding:
        cuts[term] = max(cuts[term], rule.strength)
    fired = sorted((pair for pair in concluding if pair[1].fired), key=lambda pair: -pair[1].strength)  # stable
    top, first = fired[0] if fired else ("", None)
    second = next((rule for term, rule in fired if term != top), None)
    return OutputDecision(
        system.result_names[k],
        output.name,
        cuts,
        centroid,
        value,
        first.label if first else None,
        second.label if second else None,
        (first.strength if first else 0.0) - (second.strength if second else 0.0),
        first is None,
    )


def _ranking(names: Sequence[str], weights: Sequence[float]) -> tuple[str | None, str | None, float, tuple[str, ...]]:
    """Return the winner, the runner-up, the margin, and the outputs that tie."""
    known = sorted(((w, name) for name, w in zip(names, weights, strict=True) if w == w), key=lambda pair: -pair[0])
    if all(abs(weight) <= TIE for weight, _ in known):
        return None, None, 0.0, ()
    top = tuple(name for weight, name in known if known[0][0] - weight <= TIE)
    if len(top) > 1:
        return None, None, 0.0, top
    second, runner_up = known[1] if len(known) > 1 else (0.0, None)
    return top[0], runner_up, known[0][0] - second, ()


def _decision(output: OutputDecision) -> str:
    if output.decided_by is None:
        has_default = output.centroid == output.centroid
        return f"no rule fired: its default {output.centroid:.6g}" if has_default else "no rule fired, and no default"
    if output.runner_up is None:
        return f"by {output.decided_by} alone"
    if output.margin == 0.0:
        return f"by {output.decided_by} and {output.runner_up} alike"
    return f"by {output.decided_by}, {output.margin:.6g} above {output.runner_up}"


def _title(output: OutputDecision) -> str:
    return output.name if output.name == output.variable else f"{output.name} ({output.variable})"


def _pairs(degrees: dict[str, float]) -> str:
    return ", ".join(f"{term} {degree:.6g}" for term, degree in degrees.items())


def _short(text: str) -> str:
    return text if len(text) <= WIDTH else f"{text[: WIDTH // 2 - 1]} … {text[-(WIDTH // 2 - 2) :]}"
