"""A run at one instant as lines for a terminal: active region, weights and distances as bars, state, and rules."""

from __future__ import annotations

import math

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cosim.live.watching.bars import Bars
from cosim.live.watching.run_views import Look
from cosim.simulation.commands.commands import MODES

_STYLES = {"#D55E00": "red", "#E69F00": "yellow", "#56B4E9": "blue"}  # terminal colours of the criteria's colours
_GOAL_STYLE = "green"
_LONGEST_NAME = 12  # greatest number of characters of a criterion's name
_FIRED = 0.005  # least strength of a rule that is shown
_WIDE = 120  # least width for three columns, characters


def picture(look: Look, width: int = 80, height: int | None = None, ascii_only: bool = False) -> RenderableType:
    """Draw a run at one instant."""
    bars = Bars(ascii_only)
    foot = _foot(look)
    head = _head(look, width, bars)
    if look.row is None:
        return Group(*head, Text("no rows yet"), *foot)
    wide = width >= _WIDE
    free = None if height is None else height - len(head) - sum(_lines(text, width) for text in foot) - 1
    column = (width - 2 * (2 if wide else 1)) // (3 if wide else 2)
    weights, state, estimates = _weights(look, column, bars), _state(look), _estimates(look)
    free_left = None if free is None else free - len(weights) - 1
    free_rules = None if free is None else free - 1 - (0 if wide else len(state) + len(estimates) + 1)
    distances, rules = _distances(look, column, bars, free_left), _rules(look, column, bars, free_rules)
    columns = [[*weights, Text(), *distances], [*state, Text(), *estimates], rules]
    if not wide:
        columns = [columns[0], [*state, *estimates, Text(), *rules]]
    table = Table.grid(expand=False, padding=(0, 2, 0, 0))
    for _ in columns:
        table.add_column(width=column, no_wrap=True, overflow="ellipsis")
    table.add_row(*(Group(*lines) for lines in columns))
    return Group(*head, table, *foot)


def plain(text: object) -> str:
    """Replace all control characters of a text by spaces."""
    return "".join(letter if letter.isprintable() else " " for letter in str(text))


def _lines(text: Text, width: int) -> int:
    return max(1, math.ceil(len(text.plain) / width))


def _title(text: str) -> Text:
    return Text(text, style="bold underline")


# ---- above and below -----------------------------------------------------------------------------------------------


def _head(look: Look, width: int, bars: Bars) -> list[Text]:
    header, time = look.header, look["time"]
    title = Text(plain(header["title"]), style="bold", no_wrap=True, overflow="ellipsis")
    note = Text(plain(f"{header['law']} law; {look.note}"), style="dim", no_wrap=True, overflow="ellipsis")
    if math.isnan(time):
        return [title, note]
    part = min(1.0, time / header["duration"]) if header["duration"] > 0.0 else 1.0
    clock = f"{time:8.2f} of {header['duration']:g} s "
    progress = Text(clock, no_wrap=True).append_text(bars.part(part, width - len(clock) - 6, "cyan"))
    return [title, note, progress.append(f" {100.0 * part:4.0f}%"), _now(look)]


def _now(look: Look) -> Text:
    """Return a line of words with the active region, the mode and the arming."""
    line = Text(no_wrap=True, overflow="ellipsis")
    index = look["active"]
    if not math.isfinite(index) or not 0 <= int(index) < len(look.header["regions"]):
        return line
    region = look.header["regions"][int(index)]
    criterion, keep = region["criterion"], "stay within" if region["keep"] == "in" else "keep out"
    if criterion is None:
        line.append("Heads for the goal", style=f"bold {_GOAL_STYLE}")
    else:
        line.append(f"Gives way to {plain(region['name'])}", style=f"bold {_style(look, criterion)}")
        line.append(f" ({plain(criterion)}, {keep})")
    mode, armed = look["commands.mode"], look["commands.armed"]
    if 0 <= mode < len(MODES):
        line.append(f"; mode {MODES[int(mode)]}, {'armed' if armed else 'DISARMED'}")
    return line


def _foot(look: Look) -> list[Text]:
    if look.ended is None:
        return []
    status, verdict = look.ended
    return [Text(), Text(plain(f"{status}: {verdict}"), style="bold")]


# ---- columns -------------------------------------------------------------------------------------------------------


def _style(look: Look, criterion: str | None) -> str:
    """Return the text style of a criterion, or of the goal for None."""
    colours = {one["name"]: one["colour"].upper() for one in look.header["criteria"]}
    colour = colours.get(criterion) if criterion is not None else None
    return _GOAL_STYLE if colour is None else _STYLES.get(colour, colour)


def _weights(look: Look, width: int, bars: Bars) -> list[Text]:
    lines = [_title("Weights of the arbiter")]
    names = [plain(criterion["name"]) for criterion in look.header["criteria"]]
    wide = min(max(8, *map(len, names)), _LONGEST_NAME) + 1
    for name in names:
        weight, asks = look[f"weight.{name}"], look[f"membership.{name}"]
        line = Text(f"{name[: wide - 1]:<{wide}}")
        line.append_text(bars.part(weight, width - 17 - wide, _style(look, name)))
        lines.append(line.append(f" {_number(weight, '4.2f')} asks {_number(asks, '4.2f')}"))
    return lines


def _distances(look: Look, width: int, bars: Bars, lines_free: int | None) -> list[Text]:
    """Return a bar for each region with 0 in the middle: to the right respected, to the left violated."""
    scale = 10.0 * max(look.header["ramp"], 0.01)
    active = look["active"]
    found = []
    for i, region in enumerate(look.header["regions"]):
        clearance = look[f"{region['name']}.clearance"]
        if not (region["comes"] and not any(look[f"{region['name']}.shift.{axis}"] for axis in "xyz")):
            found.append((i != 0, i != active, clearance, i, region))
    found.sort(key=lambda entry: entry[:3])
    lines = [_title(f"Distances, bars to {scale:g} m")]
    shown = found if lines_free is None or len(found) < lines_free else found[: max(1, lines_free - 2)]
    for _, _, clearance, i, region in shown:
        style = _style(look, region["criterion"])
        name = plain(region["name"])[:9]
        mark = ">" if i == active else " "
        line = Text(f"{mark}{name:<9} ", style="bold" if i == active else "")
        line.append_text(bars.signed(clearance / scale, width - 26, style))
        lines.append(line.append_text(_clearance(clearance, region)))
    if len(found) > len(shown):
        lines.append(Text(f"{len(found) - len(shown)} farther regions", style="dim"))
    return lines


def _clearance(clearance: float, region: dict[str, object]) -> Text:
    degrees = region["unit"] == "rad"
    value = math.degrees(clearance) if degrees else clearance
    number = f" {_number(value, '+z7.2f')}{'°' if degrees else 'm'}"
    if not math.isfinite(clearance):
        return Text(" no number")
    if clearance >= 0.0:
        return Text(number)
    if region["criterion"] is None:
        return Text(f"{number} to go")
    return Text().append(number + " !", style="bold reverse")


def _number(value: float, form: str = "z.2f") -> str:
    """Format a number, a hyphen for NaN and infinity."""
    return f"{value:{form}}" if math.isfinite(value) else "-"


def _state(look: Look) -> list[Text]:
    speed = math.hypot(*(look[f"velocity.{axis}"] for axis in "uvw"))
    asked, acts = (math.hypot(*(look[f"{kind}.{axis}"] for axis in "XYZ")) for kind in ("command", "actuation"))
    north, east, depth = (look[f"position.{axis}"] for axis in "xyz")
    roll, pitch, yaw = (math.degrees(look[f"attitude.{angle}"]) for angle in ("roll", "pitch", "yaw"))
    saturated = look["wrench_saturated"] > 0.0 or look["allocation_saturated"] > 0.0
    violated = [
        plain(region["name"])
        for region in look.header["regions"]
        if region["criterion"] is not None and look[f"{region['name']}.clearance"] < 0.0
    ]
    lines = [
        _title("Vehicle"),
        Text(f"north {_number(north)} east {_number(east)} m"),
        Text(f"depth {_number(depth)} m, speed {_number(speed)} m/s"),
        Text(f"roll {_number(roll, 'z.0f')}° pitch {_number(pitch, 'z.0f')}° yaw {_number(yaw, 'z.0f')}°"),
        Text(f"force {_number(asked, '.1f')} N asked, {_number(acts, '.1f')} acts" + (", CUT" if saturated else "")),
    ]
    if violated:
        lines.append(Text(f"VIOLATED: {', '.join(violated)}", style="bold reverse"))
    return lines


def _estimates(look: Look) -> list[Text]:
    true_values = look.header["truth"]["estimate"]
    parts = [
        f"φ{i + 1} {_number(look[f'estimate.phi{i + 1}'], 'z.1f')} ({_number(true, 'z.1f')})"
        for i, true in enumerate(true_values)
    ]
    return [_title("Estimates (true)"), Text("  ".join(parts[:2])), Text("  ".join(parts[2:]))]


def _rules(look: Look, width: int, bars: Bars, lines_free: int | None) -> list[Text]:
    rules = [(look[f"rule.{rule['label']}"], plain(rule["words"])) for rule in look.header["rules"]]
    fired = sorted((rule for rule in rules if rule[0] > _FIRED), reverse=True)
    shown = fired if lines_free is None or len(fired) <= lines_free else fired[: max(0, lines_free - 1)]
    lines = [_title("Rules that fire")]
    for strength, words in shown:
        line = bars.part(strength, 5, "magenta").append(f" {_number(strength, '4.2f')} ")
        lines.append(line.append(words))
    if len(fired) > len(shown):
        lines.append(Text(f"{len(fired) - len(shown)} more", style="dim"))
    return lines
