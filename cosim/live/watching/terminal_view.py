"""A run at one instant as a table for a terminal: outcome, active region, weights, vehicle, and distances."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator

from rich.table import Table
from rich.text import Text

from cosim.live.watching.run_views import Snapshot
from cosim.simulation.commands.commands import MODES

_NAME = 16  # maximum number of characters of a name
_FIRED = 0.005  # least strength of a rule that is shown


def snapshot_table(snapshot: Snapshot) -> Table:
    """Tabulate a run at one instant; what a small terminal cuts off are the farthest regions, and the rules."""
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(no_wrap=True, overflow="ellipsis", width=_NAME)
    table.add_column()
    for name, value, style in _rows(snapshot):
        table.add_row(Text(_plain(name)), Text(_plain(value)), style=style)
    return table


def _plain(text: object) -> str:
    """Replace all control characters of a text by spaces."""
    return "".join(letter if letter.isprintable() else " " for letter in str(text))


def _number(value: float, form: str = "z.2f") -> str:
    """Format a number, a hyphen for NaN and infinity."""
    return f"{value:{form}}" if math.isfinite(value) else "-"


def _numbers(values: Iterable[float], form: str = "z.2f") -> str:
    return "  ".join(_number(value, form) for value in values)


def _rows(snapshot: Snapshot) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and style of all rows of the table."""
    yield "Scenario", f"{snapshot.header['title']}; {snapshot.header['law']} law", "bold"
    yield "Source", snapshot.note if snapshot.row is not None else f"{snapshot.note}; no rows yet", ""
    if snapshot.ended is not None:
        yield "Outcome", ": ".join(snapshot.ended), "bold"
    if snapshot.row is not None:
        yield from _state(snapshot)
        yield from _regions(snapshot)
        yield from _rules(snapshot)


def _state(snapshot: Snapshot) -> Iterator[tuple[str, str, str]]:
    """Yield name, value and style of time, active region, weights, vehicle, forces and estimates."""
    header, mode = snapshot.header, snapshot["commands.mode"]
    yield "Time", f"{_number(snapshot['time'])} of {header['duration']:g} s", ""
    yield _active(snapshot)
    if 0 <= mode < len(MODES):
        yield "Mode", f"{MODES[int(mode)]}, {'armed' if snapshot['commands.armed'] else 'DISARMED'}", ""
    for criterion in header["criteria"]:
        weight, membership = (_number(snapshot[f"{kind}.{criterion['name']}"]) for kind in ("weight", "membership"))
        yield criterion["name"], f"weight {weight}, membership {membership}", criterion["color"]
    yield "North east depth", f"{_numbers(snapshot[f'position.{axis}'] for axis in 'xyz')} m", ""
    angles = (math.degrees(snapshot[f"attitude.{angle}"]) for angle in ("roll", "pitch", "yaw"))
    yield "Roll pitch yaw", f"{_numbers(angles, 'z.0f')} degrees", ""
    yield "Speed", f"{_number(math.hypot(*(snapshot[f'velocity.{axis}'] for axis in 'uvw')))} m/s", ""
    command, actual = (math.hypot(*(snapshot[f"{kind}.{axis}"] for axis in "XYZ")) for kind in ("command", "actuation"))
    saturated = snapshot["wrench_saturated"] > 0.0 or snapshot["allocation_saturated"] > 0.0
    force = f"{_number(command, '.1f')} N commanded, {_number(actual, '.1f')} N actual"
    yield "Force", force + (", SATURATED" if saturated else ""), ""
    estimates = (snapshot[f"estimate.phi{i}"] for i in range(1, 5))
    yield "Estimated phi", f"{_numbers(estimates, 'z.1f')}; true {_numbers(header['truth']['estimate'], 'z.1f')}", ""


def _rules(snapshot: Snapshot) -> Iterator[tuple[str, str, str]]:
    """Yield name, strength and style of the rules that fire, the strongest first."""
    rules = ((snapshot[f"rule.{rule['label']}"], rule["words"]) for rule in snapshot.header["rules"])
    for strength, words in sorted((rule for rule in rules if rule[0] > _FIRED), reverse=True):
        yield "Rule", f"{_number(strength)} {words}", ""


def _active(snapshot: Snapshot) -> tuple[str, str, str]:
    """Return name, value and style of the active region."""
    index, regions = snapshot["active"], snapshot.header["regions"]
    if not math.isfinite(index) or not 0 <= int(index) < len(regions):
        return "Active region", "-", ""
    region = regions[int(index)]
    if region["criterion"] is None:
        return "Active region", "the goal", "green"
    keep = "stay within" if region["keep"] == "in" else "keep out"
    return "Active region", f"{region['name']} ({region['criterion']}, {keep})", _color(snapshot, region["criterion"])


def _color(snapshot: Snapshot, criterion: str | None) -> str:
    colors: dict[str | None, str] = {one["name"]: one["color"] for one in snapshot.header["criteria"]}
    return colors.get(criterion, "green")


def _regions(snapshot: Snapshot) -> Iterator[tuple[str, str, str]]:
    """Yield name, clearance and style of the regions: the goal, the active one, and the others from the nearest."""
    regions = []
    for i, region in enumerate(snapshot.header["regions"]):
        is_absent = region["is_dynamic"] and not any(snapshot[f"{region['name']}.shift.{axis}"] for axis in "xyz")
        if not is_absent:
            clearance, is_active = snapshot[f"{region['name']}.clearance"], i == snapshot["active"]
            regions.append((i != 0, not is_active, clearance, region))
    for _, is_inactive, clearance, region in sorted(regions, key=lambda entry: entry[:3]):
        color = _color(snapshot, region["criterion"])
        value = _clearance(clearance, region["unit"], is_goal=region["criterion"] is None)
        is_violated = clearance < 0.0 and region["criterion"] is not None
        yield region["name"], value, color if is_inactive and not is_violated else f"bold {color}"


def _clearance(clearance: float, unit: str, is_goal: bool) -> str:
    if not math.isfinite(clearance):
        return "no number"
    value = f"{math.degrees(clearance):+z.2f} degrees" if unit == "rad" else f"{clearance:+z.2f} m"
    return value if clearance >= 0.0 else f"{value} to go" if is_goal else f"{value} VIOLATED"
