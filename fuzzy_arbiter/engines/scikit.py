"""The reference engine: the same definition on scikit-fuzzy's control API."""

from __future__ import annotations

import functools
import threading
import weakref
from collections.abc import Callable, Iterable, Sequence
from typing import Any, ClassVar

import numpy as np
from skfuzzy import control, defuzz
from skfuzzy.control.term import Term, WeightedTerm
from skfuzzy.defuzzify import EmptyMembershipError
from skfuzzy.fuzzymath.fuzzy_ops import _interp_universe_fast, interp_membership

from fuzzy_arbiter.definition import System, Variable, variable_names
from fuzzy_arbiter.engines.engine import Engine, default_of
from fuzzy_arbiter.engines.firing import Array
from fuzzy_arbiter.engines.grid import require_plain, sampled
from fuzzy_arbiter.errors import EngineError
from fuzzy_arbiter.propositions import And, Is, Not, Or, Proposition

Values = tuple[float | None, ...]  # value of each output; None where no rule fires

_REMEMBERED = 4096  # results kept for inputs that come again, as crisp ones do
_CONJUNCTIONS = {"min": np.fmin, "prod": np.multiply}
_DISJUNCTIONS: dict[str, Callable[..., Any]] = {"max": np.fmax, "probor": lambda a, b: a + b - a * b}


class ScikitEngine(Engine):
    """Run the rules in scikit-fuzzy, with one system a thread."""

    # Inputs are sampled at the knots of their terms, which is exact, outputs at `System.points` places. For the error
    # against the exact centroid see `GridEngine`, which gives the same values.

    name: ClassVar[str] = "skfuzzy"

    def __init__(self, system: System) -> None:
        require_plain(system, self.name, curved_inputs=False)
        for variable in system.inputs:
            for term in variable.terms:
                if term.straight.jumps:
                    raise EngineError(
                        f"engine {self.name!r}: input {variable.name!r}: term {term.name!r} jumps, where scikit-fuzzy "
                        "interpolates; expected a continuous shape, or engine 'exact' or 'grid'"
                    )
        self._samples = [sampled(output, system.points) for output in system.outputs]
        self._local = threading.local()
        super().__init__(system)

    def centroid(self, k: int, cuts: Sequence[float]) -> float:
        """Return the centroid of an output as scikit-fuzzy defuzzifies it."""
        grid, samples = self._samples[k]
        return _centroid(grid, list(zip(cuts, samples, strict=True)))

    def centroid_of_many(self, k: int, cuts: Array) -> Array:
        """Return the centroids of an output for many samples as scikit-fuzzy defuzzifies them."""
        return np.array([self.centroid(k, column) for column in cuts.T.tolist()])

    def centroids(self, inputs: Sequence[float]) -> list[float]:
        """Return the raw value of each output for one sample, all of it by scikit-fuzzy."""
        return self._centroids(inputs)

    def centroids_of_many(self, inputs: Array) -> Array:
        """Return the raw value of each output for many samples, one by one."""
        rows = [self._centroids(row) for row in inputs.tolist()]
        return np.array(rows).reshape(len(rows), len(self.system.outputs))

    def _centroids(self, inputs: Sequence[float]) -> list[float]:
        # each thread has a simulation, since scikit-fuzzy keeps inputs and results in the system itself
        if not hasattr(self._local, "runner"):
            self._local.runner = _Runner(self.system, self._samples)
        return [
            default_of(output) if value is None else value
            for output, value in zip(self.system.outputs, self._local.runner(inputs), strict=True)
        ]


class _Runner:
    """A simulation of scikit-fuzzy that caches the result of the last inputs; for one thread."""

    def __init__(self, system: System, samples: Sequence[tuple[Array, Array]]) -> None:
        self._inputs = variable_names(system.inputs)
        self._outputs = variable_names(system.outputs)
        self._known: dict[tuple[float, ...], Values] = {}
        built = _build(system, samples)
        # cache=False: each run begins without what former runs left, and leaves nothing
        self._simulation = _Simulation(built, clip_to_bounds=False, cache=False)
        weakref.finalize(self, _forget, _stateful(built)).atexit = False

    def __call__(self, inputs: Sequence[float]) -> Values:
        key = tuple(map(float, inputs))
        if key not in self._known:
            if len(self._known) >= _REMEMBERED:
                self._known.clear()
            self._known[key] = self._run(key)
        return self._known[key]

    def _run(self, inputs: tuple[float, ...]) -> Values:
        # all inputs, every time: scikit-fuzzy forgets them after each run
        for name, x in zip(self._inputs, inputs, strict=True):
            self._simulation.input[name] = x
        self._simulation.compute()
        return tuple(self._simulation.output.get(name) for name in self._outputs)


class _ControlSystem(control.ControlSystem):  # type: ignore[misc]
    """A control system whose rules are in one fixed order, since none needs another's result."""

    # scikit-fuzzy works the order out at each run, and again at each rule that is added, from a graph that also links
    # terms and rules.

    def __init__(self, variables: Iterable[Any], rules: Iterable[control.Rule]) -> None:
        super().__init__()
        self.graph.add_nodes_from(variables)
        self._in_order = tuple(rules)

    @property
    def rules(self) -> tuple[control.Rule, ...]:
        return self._in_order


class _Simulation(control.ControlSystemSimulation):  # type: ignore[misc]
    """A simulation that gives no value where no rule fires, and uses nothing that NumPy is about to withdraw."""

    # scikit-fuzzy's own way to join terms passes NumPy's `maximum` its result by position, which warns since NumPy 2.4.

    def defuzz_consequents(self) -> dict[str, float]:
        results = {}
        for consequent in self.ctrl.consequents:
            cuts = [(term.membership_value[self], term.mf) for term in consequent.terms.values()]
            cuts = [(cut, degrees) for cut, degrees in cuts if cut is not None]
            try:
                results[consequent.label] = _centroid(consequent.universe, cuts)
            except EmptyMembershipError:
                continue
        return results


def _centroid(grid: Array, terms: Sequence[tuple[float, Array]]) -> float:
    """Return the centroid of terms (cut, samples) by the steps, and with the functions, of scikit-fuzzy."""
    places = np.union1d(grid, [x for cut, degrees in terms for x in _interp_universe_fast(grid, degrees, cut)])
    outline = np.zeros_like(places)
    for cut, degrees in terms:
        np.maximum(outline, np.minimum(cut, interp_membership(grid, degrees, places)), out=outline)
    return float(defuzz(places, outline, "centroid"))


def _build(system: System, samples: Sequence[tuple[Array, Array]]) -> _ControlSystem:
    inputs = {variable.name: _antecedent(variable) for variable in system.inputs}
    outputs = {}
    for output, (grid, degrees) in zip(system.outputs, samples, strict=True):
        consequent = outputs[output.name] = control.Consequent(grid, output.name)
        for term, sample in zip(output.terms, degrees, strict=True):
            consequent[term.name] = sample
    methods = {"and_func": _CONJUNCTIONS[system.conjunction], "or_func": _DISJUNCTIONS[system.disjunction]}
    rules = [
        control.Rule(
            _condition(rule.condition, inputs),
            [outputs[conclusion.variable][conclusion.term] % rule.weight for conclusion in rule.conclusions],
            label=f"R{i + 1}",
            **methods,
        )
        for i, rule in enumerate(system.rules)
    ]
    return _ControlSystem([*inputs.values(), *outputs.values()], rules)


def _antecedent(variable: Variable) -> Any:
    """Return an input, sampled at its ends and at the knots of its terms, between which all are straight lines."""
    antecedent = control.Antecedent(np.array(variable.knots), variable.name)
    for term in variable.terms:
        antecedent[term.name] = np.array([term.straight(x) for x in variable.knots])
    return antecedent


def _condition(proposition: Proposition, inputs: dict[str, Any]) -> Any:
    if isinstance(proposition, Is):
        return inputs[proposition.variable][proposition.term]
    if isinstance(proposition, Not):
        return ~_condition(proposition.part, inputs)
    assert isinstance(proposition, And | Or)
    parts = [_condition(part, inputs) for part in proposition.parts]
    return functools.reduce(lambda a, b: a & b if isinstance(proposition, And) else a | b, parts)


def _stateful(system: _ControlSystem) -> list[tuple[dict[Any, Any], Any]]:
    """Return the places of scikit-fuzzy's state of a system: dictionaries of its classes, and the key in each."""
    variables = list(system.graph.nodes())
    terms = [term for variable in variables for term in variable.terms.values()]
    return [
        *((control.Antecedent.input.data, variable) for variable in variables),
        *((control.Consequent.output.data, variable) for variable in variables),
        *((Term.membership_value.data, term) for term in terms),
        *((Term.cuts.data, term) for term in terms),
        *((control.Rule.aggregate_firing.data, rule) for rule in system.rules),
        *((WeightedTerm.activation.data, conclusion) for rule in system.rules for conclusion in rule.consequent),
    ]


def _forget(state: Sequence[tuple[dict[Any, Any], Any]]) -> None:
    """Drop the state of a system, which scikit-fuzzy would keep for ever."""
    for kept, key in state:
        kept.pop(key, None)
