"""The law of a scenario by its name, or of Python code: an object, or the name of one in a file."""

from __future__ import annotations

import contextlib
import copy
import hashlib
import importlib.util
import re
import secrets
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from multiprocessing.reduction import ForkingPickler
from pathlib import Path
from types import ModuleType
from typing import Any, get_args

import numpy as np

from controller import LAWS, CompiledLaw, FunctionLaw, Law, LawError
from controller.function_law import qualified_name
from controller.law import Output
from cosim.errors import RunError, ScenarioError
from cosim.scenario.scenario import Scenario, validate_scenario
from cosim.scenario.vehicle_model import vehicle_model
from plant_fmu.toml_tables import hint

_SOURCE = re.compile(r"(.+\.py):([^\W\d]\w*)", re.S)
FIND_GAINS = "find others by cosim sweep, see docs/baselines.md#gains-for-another-vehicle"
_DIGEST = "__digest__"  # attribute of the module of a file: its SHA-256


def law_of(scenario: Scenario) -> CompiledLaw:
    """Create a scenario's law, with its own memory."""
    require_builtin_law(scenario)
    return LAWS[scenario.law.name].for_vehicle(
        vehicle_model(scenario.vehicle),
        scenario.law.gains,
        np.array(scenario.law.desired_quaternion),
        scenario.time.control,
        len(scenario.regions),
    )


def foreign_gains(scenario: Scenario) -> str:
    """Say for which vehicle a law's gains were found, if all are its defaults and the scenario's is another."""
    kind = LAWS.get(scenario.law.name)
    if kind is None or kind.gains_for in ("", scenario.vehicle.name) or scenario.law.gains != kind.gains_type():
        return ""
    return f"gains of law {scenario.law.name} were found for {kind.gains_for}, not for {scenario.vehicle.name}"


def require_builtin_law(scenario: Scenario) -> None:
    """Raise `RunError` if a scenario's law is a custom one, whose code is not in its file."""
    known = ", ".join(sorted(LAWS))
    if scenario.law.fmu:
        raise RunError(f"law.file is {scenario.law.name!r}, expected here no FMU but law.name, one of {known}")
    if scenario.law.is_custom:
        raise RunError(
            f"law.name is {scenario.law.name!r}, a law in Python, whose code no scenario holds: expected "
            f"--law FILE.py:NAME, or law= in Python, or another law.name, one of {known}"
        )


def require_no_fmus(scenario: Scenario, what: str) -> None:
    """Raise `RunError` if law or plant of a scenario is of the user's, or FMUs are beside it; `what` needs its own."""
    require_builtin_law(scenario)
    if scenario.plant_fmu:
        raise RunError(f"plant.file is {scenario.plant_fmu.file.name!r}, expected none for {what}")
    if scenario.components:
        names = ", ".join(fmu.name for fmu in scenario.components)
        raise RunError(f"components are given ({names}), expected none for {what}")


@dataclass(frozen=True)
class OwnLaw:
    """A law of Python code, made anew for each flight, with code or object as it is now."""

    name: str  # where it is from, such as mine.py:steer
    source: str  # the same with the path of the file; "" for an object
    digest: str  # SHA-256 of the file, or of the pickled object
    definition: Any = field(compare=False)  # a law, a function, or a class of either

    def __str__(self) -> str:
        return self.name

    @property
    def label(self) -> str:
        """The name in names of files."""
        return re.sub(r"(\.py)?:", ".", self.name)

    def in_scenario(self, scenario: Scenario) -> Scenario:
        """Return a scenario with this law."""
        return _named(scenario, self.name)

    def make(self, scenario: Scenario) -> Law:
        """Make the law for a flight of a scenario."""
        made = self.definition
        try:
            if isinstance(made, type) and issubclass(made, CompiledLaw):
                level, period = np.array(scenario.law.desired_quaternion), scenario.time.control
                gains, n_regions = made.gains_type(), len(scenario.regions)
                made = made.for_vehicle(vehicle_model(scenario.vehicle), gains, level, period, n_regions)
            else:
                made = made() if isinstance(made, type) else copy.deepcopy(made)
        except Exception as error:  # code of the user's
            raise LawError(f"law {self.name} cannot be made for a flight: {_line(error)}") from error
        law: Law = made if _is_law(made) else FunctionLaw(made)
        _require_thrusters(law, self.name, scenario)
        return law

    def __reduce__(self) -> tuple[Any, ...]:
        if self.source:
            return read_law, (self.source,)
        module = getattr(self.definition, "__module__", "")
        if module == "__main__" and not hasattr(sys.modules[module], "__file__"):
            raise LawError(f"law {self.name} is of no file, which other processes need; expected a law of a module")
        return OwnLaw, (self.name, self.source, self.digest, self.definition)


def own_law(law: object) -> OwnLaw | None:
    """Return a law of Python code, from an object or ``file.py:name``; None for the name of another law."""
    if isinstance(law, OwnLaw):
        return law
    if isinstance(law, str):
        return read_law(law) if _SOURCE.fullmatch(law) else None
    name = _name_of(law)
    try:
        digest = hashlib.sha256(ForkingPickler.dumps(law)).hexdigest()  # as worker processes receive it
    except Exception:  # noqa: BLE001 -- a campaign of it can be flown in this process, and not be continued
        digest = secrets.token_hex(32)
    return OwnLaw(name, "", digest, law)


def read_law(source: str) -> OwnLaw:
    """Read a law from its file, which runs that, by ``file.py:name``."""
    match = _SOURCE.fullmatch(source)
    if match is None:
        raise RunError(f"law is {source!r}, expected FILE.py:NAME")
    path = Path(match[1]).resolve()
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError as error:
        raise RunError(f"law {source}: {error.strerror or error}") from error
    module = _import_file(source, path, digest)
    definition = getattr(module, match[2], None)
    if not (_is_law(definition) or callable(definition)):
        own = (name for name, value in vars(module).items() if getattr(value, "__module__", "") == module.__name__)
        known = [name for name in own if not name.startswith("_")]
        raise RunError(f"law {source}: {match[2]} is no law or function there; {hint(match[2], known)}")
    return OwnLaw(f"{path.name}:{match[2]}", f"{path}:{match[2]}", digest, definition)


def _import_file(source: str, path: Path, digest: str) -> ModuleType:
    """Run a file as a module, once a process; it can import its neighbors."""
    name = path.name  # no module that an import can find
    known = sys.modules.get(name)
    if known is not None and (known.__file__, getattr(known, _DIGEST, "")) == (str(path), digest):
        return known
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None and spec.loader is not None  # for a name that ends in .py
    module = sys.modules[name] = importlib.util.module_from_spec(spec)
    setattr(module, _DIGEST, digest)
    try:
        with _import_from(str(path.parent)):
            spec.loader.exec_module(module)
    except BaseException as error:
        del sys.modules[name]
        if isinstance(error, Exception | SystemExit):
            raise RunError(f"law {source}: {_line(error)}") from error
        raise
    return module


@contextlib.contextmanager
def _import_from(folder: str) -> Iterator[None]:
    sys.path.insert(0, folder)
    try:
        yield
    finally:
        with contextlib.suppress(ValueError):
            sys.path.remove(folder)


def with_custom_law(law: Law, scenario: Scenario) -> Scenario:
    """Return a scenario with a law, which the caller flies."""
    name = _name_of(law, may_be_function=False)
    _require_thrusters(law, name, scenario)
    return _named(scenario, name)


def _name_of(law: object, *, may_be_function: bool = True) -> str:
    """Return the name of a law or a function."""
    if not (_is_law(law) or (may_be_function and callable(law))):
        raise LawError(f"law is {qualified_name(law)}, expected a FunctionLaw, or what else fulfils controller.Law")
    return law.name if isinstance(law, FunctionLaw) else qualified_name(law)


def _named(scenario: Scenario, name: str) -> Scenario:
    own = {"name": name, "desired_quaternion": list(scenario.law.desired_quaternion), "gains": {}}
    return validate_scenario(scenario.table | {"law": own}, scenario.name, scenario.vehicle)


def _require_thrusters(law: Law, name: str, scenario: Scenario) -> None:
    """Raise `ScenarioError` for a law of thruster forces in a scenario without thrusters."""
    through = scenario.actuation.through
    if law.output == "thrusters" and through != "thrusters":
        raise ScenarioError(f"actuation.through is {through!r}, expected 'thrusters': law {name} drives them")


def _is_law(law: object) -> bool:
    """Return True for an object that fulfills the protocol `Law`."""
    return (
        not isinstance(law, type)
        and getattr(law, "output", None) in get_args(Output)
        and callable(getattr(law, "step", None))
    )


def _line(error: BaseException) -> str:
    return " ".join(f"{type(error).__name__}: {error}".split())
