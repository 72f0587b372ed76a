"""A law by its name, the file of its FMU, or Python code, and its gains from texts such as ``k_p1=10``."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from controller import LAWS
from cosim.errors import RunError
from cosim.scenario.law_factory import OwnLaw, own_law
from cosim.scenario.toml_file import flatten, read_table
from plant_fmu.toml_tables import hint

AnyLaw = str | OwnLaw  # name, file of an FMU or of its scenario, or Python code


class FmuGains(dict[str, Any]):
    """Parameters of an FMU that is the law, or nothing for Python code, in place of gains."""

    _asdict = dict[str, Any].copy


def to_law(law: object) -> AnyLaw:
    """Return a law of a campaign from what a caller passes: a name, a file, ``file.py:name``, or a law."""
    own = own_law(law)
    return own or str(law)


def label_of(law: AnyLaw) -> str:
    """Return the name of a law in names of files."""
    return law.label if isinstance(law, OwnLaw) else Path(law).name


def fmu_table(law: AnyLaw) -> dict[str, Any] | None:
    """Return the table ``law`` for an FMU's file, or that of a scenario's file whose law is an FMU; None for others."""
    if isinstance(law, OwnLaw):
        return None
    if law.endswith(".fmu"):
        return {"file": law}
    if law.endswith(".toml"):
        table = read_table(law).table.get("law")
        if not (isinstance(table, dict) and table.get("file")):
            raise RunError(f"law {law!r} is a file without law.file, expected a scenario with an FMU as its law")
        return table
    return None


def law_table(law: AnyLaw, gains: Any) -> dict[str, Any]:
    """Return the table ``law`` of a scenario for a law and its gains."""
    table = fmu_table(law)
    if table is None:
        return {"name": str(law), "gains": gains._asdict()}
    return table | {"parameters": flatten(table.get("parameters", {})) | gains._asdict()}


def digest_of_law(law: AnyLaw) -> dict[str, str]:
    """Return the digest of the FMU or the code that is the law, as an entry of a plan; none for a name."""
    if isinstance(law, OwnLaw):
        return {"law_sha256": law.digest}
    table = fmu_table(law)
    if table is None:
        return {}
    try:
        return {"law_sha256": hashlib.sha256(Path(table["file"]).read_bytes()).hexdigest()}
    except OSError as error:
        raise RunError(f"{table['file']}: {error.strerror or error}") from error


def gains_of_plan(plan: dict[str, Any]) -> Any:
    """Return the gains of a campaign's plan."""
    gains = plan["gains"]
    return FmuGains(gains) if "law_sha256" in plan else law_class(plan["law"]).gains_type(**gains)


def law_class(name: str) -> Any:
    """Return the class of a law."""
    if name not in LAWS:
        raise RunError(f"law {name!r} is unknown; {hint(name, LAWS)}, or the .fmu file of one, or FILE.py:NAME")
    return LAWS[name]


def gains_from(law: AnyLaw, settings: Sequence[str] = ()) -> Any:
    """Return the gains of a law with settings applied."""
    if isinstance(law, OwnLaw):
        if settings:
            raise RunError(f"--set {settings[0]}: law {law} is Python code, which has no gains; expected none")
        return FmuGains()
    of_fmu = fmu_table(law) is not None
    gains: Any = FmuGains() if of_fmu else law_class(law).gains_type()
    for text in settings:
        key, equals, value = (part.strip() for part in text.partition("="))
        if not equals:
            raise RunError(f"--set {text!r}: expected key=value")
        if not of_fmu and key not in gains._fields:
            raise RunError(f"--set {key}: the law {law} has no such gain; {hint(key, gains._fields)}")
        try:
            gains = FmuGains(gains | {key: float(value)}) if of_fmu else gains._replace(**{key: float(value)})
        except ValueError as error:
            raise RunError(f"--set {key}: {value!r} is no number") from error
    return gains


def gains_by_law(laws: Sequence[str], settings: Sequence[str] = ()) -> dict[str, Any]:
    """Return the gains of several laws, given as texts, with settings applied."""
    by_law: dict[str, list[str]] = {law: [] for law in laws}
    for text in settings:
        law, dot, rest = text.strip().partition(".")
        if not dot or law not in by_law:
            raise RunError(f"--set {text!r}: expected LAW.KEY=VALUE with one of {', '.join(laws)}")
        by_law[law].append(rest)
    return {law: gains_from(to_law(law), of_law) for law, of_law in by_law.items()}
