"""FMUs of the user's in a system: where their inputs come from, and which inputs their outputs set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

from cosim.errors import RunError
from cosim.scenario.fmu_tables import UserFmu
from cosim.scenario.scenario import Scenario
from cosim.simulation.columns import columns_without_plant
from cosim.simulation.component_map import connect_components
from cosim.simulation.fmu_map import MOTION, connect, law_signals, law_targets, read_fmu_of
from cosim.ssp.structure import Connector, Wire
from plant_fmu.checking.fmu_file import FmuFile
from plant_fmu.contents.parameter_set import parameter_file
from plant_fmu.quantities import UNITS

PLANT, CONTROLLER, ARBITER = "plant", "controller", "arbiter"  # names of the other FMUs
STAND_IN = "pd"  # law of a controller whose forces nothing receives

_TYPES = {"Boolean": "Boolean", "String": "String"}  # of parameter sets, by FMI's; numbers are real or whole


class OwnFmu(NamedTuple):
    """An FMU of the user's, and its connections."""

    fmu: UserFmu
    file: FmuFile
    inputs: dict[str, str]  # signal of each connected input
    sent: dict[str, str]  # input of the plant that each connected output sets

    @property
    def connectors(self) -> tuple[Connector, ...]:
        """Its connected inputs, and its outputs."""
        return tuple(
            Connector(v.name, v.causality, v.unit if v.unit in UNITS else "", v.description)
            for v in self.file.model.values()
            if v.is_real and (v.causality == "output" or v.name in self.inputs)
        )

    def parameters(self) -> bytes:
        """Return the file of the parameters that the scenario sets."""
        rows = []
        for name, value in self.fmu.parameters.items():
            if name not in self.file.model:
                raise RunError(f"{self.fmu.key}.parameters: {self.file.path.name} has no variable {name!r}")
            v = self.file.model[name]
            kind = _TYPES.get(v.type, "Real" if v.is_real or v.type == "Float32" else "Integer")
            rows.append((name, v.description, kind, str(value).lower() if isinstance(value, bool) else str(value), ""))
        return parameter_file(self.fmu.name, f"Parameters of {self.fmu.label}", rows).encode()


def own_fmus(scenario: Scenario) -> list[OwnFmu]:
    """Return the law, if it is an FMU, and the FMUs beside the plant."""
    columns, own = columns_without_plant(scenario), list[OwnFmu]()
    if scenario.law.fmu:
        file, names = read_fmu_of(scenario.law.fmu), {}
        targets, kind = law_targets(scenario.law.fmu, file, scenario)
        if kind != scenario.actuation.through:
            raise RunError("law.outputs: a wrench through thrusters, expected thrust[1] and on in a system of FMUs")
        forces = [f"thrust[{i + 1}]" for i in range(scenario.vehicle.n_thrusters)]
        forces = forces if kind == "thrusters" else [f"wrench.{axis}" for axis in "XYZKMN"]
        names = {name: forces[i] for name, i in targets.items() if i < len(forces)}
        own.append(
            OwnFmu(scenario.law.fmu, file, connect(scenario.law.fmu, file, law_signals(scenario, columns)), names)
        )
    for one in connect_components(scenario, columns):
        if one.fmu.name in (CONTROLLER, ARBITER):
            raise RunError(f"{one.fmu.key} has the name of an FMU of the system, expected another name")
        own.append(OwnFmu(one.fmu, one.file, one.inputs, one.sent))
    return own


def own_wires(
    scenario: Scenario, own: list[OwnFmu], prefixes: Mapping[str, str], outputs: Mapping[str, set[str]]
) -> Iterator[Wire]:
    """Yield the connections of FMUs of the user's; prefixes of goal and regions, outputs of the other FMUs."""
    sources = {
        f"{one.fmu.name}.{v.name}": (one.fmu.name, v.name) for one in own for v in one.file.with_causality("output")
    }
    for part in (ARBITER, CONTROLLER, PLANT):
        sources |= {name: (part, name) for name in outputs[part]}
    criteria = scenario.criterion_names
    for region, place in zip(scenario.regions, scenario.criterion_places, strict=True):
        sources[f"weight.{region.region.name}"] = ARBITER, f"weight.{criteria[place]}"
    for name, prefix in prefixes.items():
        sources |= {f"{name}.{what}": (CONTROLLER, f"{prefix}.{what}") for what in ("value", "clearance")}
    for one in own:
        if one.fmu is scenario.law.fmu:
            sources |= {target: (one.fmu.name, output) for output, target in one.sent.items()}
    for one in own:
        for name, signal in one.inputs.items():
            key = f"{one.fmu.key}.inputs.{name}"
            if signal not in sources:
                raise RunError(f"{key}: {signal} is no output of an FMU in a system of FMUs, expected another signal")
            if signal in MOTION and one.fmu is scenario.law.fmu and not scenario.sensing.exact:
                raise RunError(
                    f"{key}: {signal} has errors of sensing, expected sensing without noise in a system of FMUs"
                )
            part, output = sources[signal]
            yield Wire(part, one.fmu.name, ((output, name),))
        yield Wire(one.fmu.name, PLANT, tuple(one.sent.items()))
