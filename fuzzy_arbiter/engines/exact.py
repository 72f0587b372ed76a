"""The engine for any system: exact wherever there is an exact value."""

from __future__ import annotations

import functools
from contextlib import suppress
from typing import ClassVar

from fuzzy_arbiter.definition import Output, System, variable_names
from fuzzy_arbiter.engines.clipped_centroid import Centroid
from fuzzy_arbiter.engines.clipped_curves import ClippedCurves
from fuzzy_arbiter.engines.engine import Defuzzifier, Engine
from fuzzy_arbiter.engines.firing import Slot, slots_of
from fuzzy_arbiter.engines.quadrature import Quadrature
from fuzzy_arbiter.engines.supported import curved_term
from fuzzy_arbiter.engines.weighted import Weighted
from fuzzy_arbiter.errors import EngineError

_MAXIMA = {("max", "min"), ("max", "prod")}
# aggregations and implications of outputs whose values follow from lines of terms alone
_BY_LINES = {
    "centroid": {("max", "min"), ("max", "prod"), ("sum", "min"), ("sum", "prod")},
    "bisector": {("max", "min"), ("sum", "min")},
    **dict.fromkeys(("mom", "som", "lom"), _MAXIMA),
}


class ExactEngine(Engine):
    """Evaluate any system."""

    # Straight terms exactly, over all their breakpoints; values as they are; else by quadrature.

    name: ClassVar[str] = "exact"

    def __init__(self, system: System) -> None:
        super().__init__(system, [self._defuzzifier(system, k) for k in range(len(system.outputs))])

    def _defuzzifier(self, system: System, k: int) -> Defuzzifier:
        output = system.outputs[k]
        if output.weighted:
            return Weighted(output, variable_names(system.inputs), variable_names(system.outputs[:k]))
        return self._area_defuzzifier(system, output)

    def _area_defuzzifier(self, system: System, output: Output) -> Defuzzifier:
        return _area_defuzzifier(output, slots_of(system, output))

    @property
    def methods(self) -> dict[str, str]:
        """Method of each output, with its error bound."""
        names = variable_names(self.system.outputs)
        return {name: str(one.method) for name, one in zip(names, self.defuzzifiers, strict=True)}


@functools.lru_cache(64)  # for systems that differ elsewhere, as those that `fit` tries
def _area_defuzzifier(output: Output, slots: tuple[Slot, ...]) -> Defuzzifier:
    implications = {slot.implication for slot in slots}
    if (
        (output.defuzzifier, output.aggregation) == ("centroid", "max")
        and implications in ({"min"}, {"prod"})
        and not curved_term(output)
    ):
        with suppress(EngineError):  # more lines than an outline should have
            return Centroid(output, implications == {"prod"})
    joins = {(output.aggregation, implication) for implication in implications}
    if len(joins) == 1 and joins <= _BY_LINES.get(output.defuzzifier, set()):
        with suppress(EngineError):  # terms that are not smooth
            return ClippedCurves(output, slots)
    return Quadrature(output, slots)
