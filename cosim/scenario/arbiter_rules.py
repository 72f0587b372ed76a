"""The arbiter's rules of a scenario: by the order of the criteria, or from a file whose inputs are named signals."""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import msgspec

from controller.regions.region_set import of_attitude
from cosim.errors import ScenarioError
from cosim.scenario.criteria import PAPER, CriterionSetup
from cosim.scenario.region_tables import SecondaryRegion
from cosim.scenario.tables import ArbiterSetup, RuleVariant
from fuzzy_arbiter import Arbiter, ArbiterError, Rule, Shape, System, Term, Variable
from fuzzy_arbiter.criteria import prioritized
from fuzzy_arbiter.files import read_text
from fuzzy_arbiter.formats import FORMATS, reads
from plant_fmu.toml_tables import hint

MAX_TEXT = 200_000  # maximum number of characters of a file of rules
MAX_INPUTS = 32  # maximum number of inputs of a file of rules

_ON = Shape(((0.5 - 1e-9, 0.0), (0.5 + 1e-9, 1.0)))  # crisp, but continuous
_OFF = Shape(((0.5 - 1e-9, 1.0), (0.5 + 1e-9, 0.0)))

Kind = Literal["given", "time", "depth", "speed", "membership", "clearance", "closing_speed", "approach_time"]
VEHICLE_SIGNALS: dict[str, str] = {"time": "s", "depth": "m", "speed": "m/s"}  # signals of the vehicle, and their units
REGION_SIGNALS: dict[str, tuple[str, str]] = {  # signals of a region or the goal; second: unit for regions of attitude
    "clearance": ("m", "rad"),
    "closing_speed": ("m/s", "rad/s"),
    "approach_time": ("s", "s"),
}


@dataclass(frozen=True)
class InputSignal:
    """Source of an input of the rules."""

    name: str  # name of the input
    kind: Kind
    of: int = 0  # index of the criterion; or of the region, 0 for the goal
    unit: str = ""
    course: tuple[tuple[float, float], ...] = ()  # s, value: points of a given signal, linear between, constant beyond
    what: str = ""  # description


@dataclass(frozen=True)
class ArbiterRules:
    """Rules by which the criteria get their weights."""

    system: System  # one output for each criterion, in their order
    inputs: tuple[InputSignal, ...]  # one for each input

    @property
    def signals(self) -> tuple[InputSignal, ...]:
        """The inputs; none if they are the memberships of the criteria, in their order."""
        memberships = [("membership", i) for i in range(len(self.system.outputs))]
        return () if [(signal.kind, signal.of) for signal in self.inputs] == memberships else self.inputs


def read_rules(setup: ArbiterSetup) -> ArbiterSetup:
    """Return the setup with the text of its rule file, read if missing, and the file's name without folder."""
    if not setup.file:
        if setup.text:
            raise ScenarioError(
                "arbiter.text is given, expected none without arbiter.file, whose suffix names its format"
            )
        return setup
    path = Path(setup.file)
    if path.suffix.lower().removeprefix(".") not in FORMATS:
        raise ScenarioError(f"arbiter.file is {setup.file!r}, expected a suffix of .{', .'.join(FORMATS)}")
    text = setup.text or _text(path)
    if len(text) > MAX_TEXT:
        raise ScenarioError(f"arbiter.file: {path.name}: file too large, expected at most {MAX_TEXT} characters")
    return msgspec.structs.replace(setup, file=path.name, text=text)


def _text(path: Path) -> str:
    try:
        text = read_text(path, 4 * MAX_TEXT, path.suffix.lower() in (".json", ".toml"))
    except ArbiterError as error:
        raise ScenarioError(f"arbiter.file: {error}") from error
    return text.removeprefix("\ufeff").replace("\r\n", "\n")


def check_rules(
    setup: ArbiterSetup, criteria: tuple[CriterionSetup, ...], regions: Sequence[SecondaryRegion]
) -> ArbiterRules:
    """Return the checked rules of an arbiter, whose file has been read."""
    if not setup.file:
        if setup.inputs:
            first = next(iter(setup.inputs))
            raise ScenarioError(f"arbiter.inputs.{first} is given, expected none without arbiter.file")
        system = rules_by_order(setup.rules, criteria, setup.points)
        indices = {criterion.name: i for i, criterion in enumerate(criteria)}
        if setup.rules == "none":
            inputs = (InputSignal(v.name, "given", course=((0.0, 1.0),), what="given") for v in system.inputs)
        else:
            inputs = (InputSignal(v.name, "membership", indices[v.name]) for v in system.inputs)
        return ArbiterRules(system, tuple(inputs))
    if setup.rules != "ordered":
        raise ScenarioError(f"arbiter.rules is {setup.rules!r}, expected none beside arbiter.file, which has its own")
    system = _system(setup.file, setup.text, tuple(criterion.name for criterion in criteria), setup.points)
    try:
        engine = Arbiter(system, engine=setup.engine).engine
    except ArbiterError as error:
        raise ScenarioError(
            f"arbiter.engine is {setup.engine!r}, expected another one for {setup.file}: {error}"
        ) from error
    assert engine == setup.engine
    known = [variable.name for variable in system.inputs]
    for name in setup.inputs:
        if name not in known:
            raise ScenarioError(f"arbiter.inputs.{name}: {setup.file} has no such input; {hint(name, known)}")
    return ArbiterRules(system, tuple(_signals(setup, known, criteria, regions)))


@functools.lru_cache(maxsize=16)
def rules_by_order(variant: RuleVariant, criteria: tuple[CriterionSetup, ...], points: int) -> System:
    """Make the fuzzy system that weighs criteria by their order."""
    fuzzy = [criterion.fuzzy for criterion in criteria]
    if variant == "reversed":
        system = prioritized(fuzzy[::-1], points=points)
        return replace(system, outputs=system.outputs[::-1], weights_of=system.weights_of[::-1])
    system = prioritized(fuzzy, points=points)
    if variant == "crisp":
        inputs = [Variable(c.name, (0.0, 1.0), (Term(c.off, _OFF), Term(c.on, _ON))) for c in fuzzy]
        return replace(system, inputs=tuple(inputs))
    if variant == "none":
        rules = [
            Rule.parse(f"if {criterion.name} is {term} then {output.name} is {level}")
            for criterion, output in zip(fuzzy, system.outputs, strict=True)
            for term, level in zip((criterion.off, criterion.on), output.term_names, strict=True)
        ]
        return replace(system, rules=tuple(rules))
    return system


@functools.lru_cache(maxsize=8)
def _system(file: str, text: str, criteria: tuple[str, ...], points: int) -> System:
    """Parse the system of a file; sort its outputs in the order of the criteria, and clip its inputs."""
    try:
        system = reads(text, Path(file).suffix.lower().removeprefix("."))
        if len(system.inputs) > MAX_INPUTS:
            raise ScenarioError(f"arbiter.file: {file} has {len(system.inputs)} inputs, expected at most {MAX_INPUTS}")
        outputs = dict(zip(system.result_names, system.outputs, strict=True))
        for name in outputs:
            if name not in criteria:
                raise ScenarioError(
                    f"arbiter.file: {file} has the output {name!r}, no criterion; {hint(name, criteria)}"
                )
        for name in criteria:
            if name not in outputs:
                raise ScenarioError(f"arbiter.file: {file} has no output {name!r}, expected one for each of criteria")
        named = criteria if system.weights_of else ()
        ordered = tuple(outputs[name] for name in criteria)
        system = replace(system, outputs=ordered, outside="clip", points=points, weights_of=named)
        _require_weights(file, system)
    except ArbiterError as error:
        raise ScenarioError(f"arbiter.file: {file}: {error}") from error
    return system


def _require_weights(file: str, system: System) -> None:
    """Raise a ScenarioError if an output may be outside [0, 1], or may have no value."""
    for output in system.outputs:
        low, high = output.universe
        if system.normalization == "none" and not 0.0 <= low < high <= 1.0:
            raise ScenarioError(
                f"arbiter.file: {file}: output {output.name!r} is of [{low:g}, {high:g}], expected weights in [0, 1], "
                'or normalization "range"'
            )
    without = [output.name for output in system.outputs if output.default is None]
    if without and not _always_fires(Arbiter(system)):
        raise ScenarioError(
            f"arbiter.file: {file}: output {without[0]!r} has no default, expected one: "
            "it is not proved that a rule fires for all inputs"
        )


def _always_fires(arbiter: Arbiter) -> bool:
    """Return True if it is proved that for all inputs each output has a rule that fires."""
    if arbiter.engine == "closed":
        return True
    try:
        return bool(arbiter.verify().graded_complete)
    except ArbiterError:  # terms that the proof does not cover
        return False


def _signals(
    setup: ArbiterSetup, names: Sequence[str], criteria: Sequence[CriterionSetup], regions: Sequence[SecondaryRegion]
) -> Iterator[InputSignal]:
    of_regions = {"goal": (0, "m")} | {
        region.region.name: (i, "rad" if of_attitude(region.region.shape) else "m")
        for i, region in enumerate(regions, 1)
    }
    of_criteria = {criterion.name: i for i, criterion in enumerate(criteria)}
    for name in names:
        default = name if name in VEHICLE_SIGNALS else f"membership.{name}" if name in of_criteria else None
        key, value = f"arbiter.inputs.{name}", setup.inputs.get(name, default)
        if value is None:
            raise ScenarioError(
                f"{key} is missing, expected a signal, a number, or points [time, value]: {setup.file} has this input"
            )
        if not isinstance(value, str):
            yield InputSignal(name, "given", course=_course(value, key), what="given")
            continue
        kind, _, subject = value.partition(".")
        if kind in VEHICLE_SIGNALS and not subject:
            yield InputSignal(name, kind, unit=VEHICLE_SIGNALS[kind], what=value)  # type: ignore[arg-type]
        elif kind == "membership":
            _require_known(subject, of_criteria, key, value, "criterion")
            yield InputSignal(name, "membership", of_criteria[subject], what=value)
        elif kind in REGION_SIGNALS:
            _require_known(subject, of_regions, key, value, "region")
            index, unit = of_regions[subject]
            yield InputSignal(name, kind, index, REGION_SIGNALS[kind][unit == "rad"], what=value)  # type: ignore[arg-type]
        else:
            forms = (*VEHICLE_SIGNALS, "membership.CRITERION", *(f"{form}.REGION" for form in REGION_SIGNALS))
            raise ScenarioError(f"{key} is {value!r}, expected one of {', '.join(forms)}, or a number")


def _require_known(name: str, known: dict[str, Any], key: str, value: str, what: str) -> None:
    if name not in known:
        raise ScenarioError(f"{key} is {value!r}, of no {what}; {hint(name, known)}")


def _course(value: Any, key: str) -> tuple[tuple[float, float], ...]:
    """Parse the course of a given signal: a constant, or points of time [s] and value."""
    points = value if isinstance(value, list | tuple) else [[0.0, value]]
    ok = bool(points) and all(isinstance(point, list | tuple) and len(point) == 2 for point in points)
    if not (ok and all(_is_finite(x) for point in points for x in point)):
        raise ScenarioError(f"{key} is {value!r}, expected a signal, a finite number, or a list of [time, value]")
    times = [float(time) for time, _ in points]
    if any(after <= before for before, after in zip(times, times[1:], strict=False)):
        raise ScenarioError(f"{key} has the times {times}, expected each above the one before")
    return tuple((float(time), float(x)) for time, x in points)


def _is_finite(x: Any) -> bool:
    return not isinstance(x, bool) and isinstance(x, int | float) and math.isfinite(x)


PAPER_RULES = check_rules(ArbiterSetup(), PAPER, ())


# ---- costs of paths through soft regions, from the arbiter's preference between pairs of criteria

# A planner chooses between regions that are far from each other and from the vehicle, for which the present weights do
# not hold. So the arbiter is evaluated beforehand for each pair of criteria with soft regions: both have membership 1,
# all others 0. The preference of a criterion is the mean over its pairs of its part of the two weights. A meter of path
# through a region, half a meter deep, costs `_EQUAL` m at preference 1/2, that of equal criteria. At
# preference 1 it costs `_PREFERRED` times as much, at preference 0 as much less.

_EQUAL = 2.0  # m, cost at preference 1/2
_PREFERRED = 5.0  # factor of the cost at preference 1


def with_crossing_costs(
    regions: tuple[SecondaryRegion, ...], criteria: Sequence[str], rules: ArbiterRules, depth: float
) -> tuple[SecondaryRegion, ...]:
    """Return the regions with the crossing costs of the soft ones; depth [m]."""
    soft = {r.criterion for r in regions if not r.region.hard and not of_attitude(r.region.shape)}
    if not soft:
        return regions
    of_regions = tuple(region.criterion for region in regions)
    costs = _costs(rules, tuple(criteria), tuple(name for name in criteria if name in soft), of_regions, depth)
    return tuple(replace(r, region=replace(r.region, crossing_cost=costs.get(r.criterion, _EQUAL))) for r in regions)


@functools.lru_cache(maxsize=64)
def _costs(
    rules: ArbiterRules, criteria: tuple[str, ...], soft: tuple[str, ...], of_regions: tuple[str, ...], depth: float
) -> dict[str, float]:
    """Return the cost of each criterion with soft regions [m]."""
    arbiter = Arbiter(rules.system)

    def value(signal: InputSignal, far: float, pressing: Sequence[str]) -> float:
        """Return the value of an input while two criteria have membership 1; `far` is its upper bound."""
        if signal.kind == "membership":
            return float(criteria[signal.of] in pressing)
        if signal.kind in ("clearance", "approach_time"):  # 0: on the surface
            return 0.0 if signal.of and of_regions[signal.of - 1] in pressing else far
        if signal.kind == "given":
            return signal.course[0][1]
        return depth if signal.kind == "depth" else 0.0

    def preference(*pair: str) -> float:
        inputs = zip(rules.inputs, rules.system.inputs, strict=False)
        weights = arbiter([value(signal, variable.universe[1], pair) for signal, variable in inputs])
        one, other = (weights[criteria.index(name)] for name in pair)
        return one / (one + other) if one + other > 0.0 else 0.5

    costs = {}
    for name in soft:
        preferences = [preference(name, other) for other in soft if other != name] or [0.5]
        costs[name] = _EQUAL * _PREFERRED ** (2.0 * math.fsum(preferences) / len(preferences) - 1.0)
    return costs
