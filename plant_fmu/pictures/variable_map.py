"""A map of the variables of a vehicle's FMU: inputs, states, outputs and parameters."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from plant_fmu.variables import Variable, variables
from plant_fmu.vehicle import Vehicle

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# prefixes of parameters' names, by their family
FAMILIES = {
    "body": ("mass", "inertia", "r_G", "r_B", "weight", "buoyancy", "trim", "hull_radius"),
    "water on the body": ("added_mass", "linear_damping", "quadratic_damping"),
    "thrusters": ("thruster_matrix", "thrust_"),
    "wrench input": ("wrench_",),
    "surroundings": ("current", "bottom_", "free_surface", "gravity"),
    "sensors": ("depth_sensor.", "dvl.", "imu.", "compass.", "usbl.", "outlier_scale"),
    "calculation": ("substep", "seed"),
}
_COLORS = {"input": "#e69f00", "state": "#0072b2", "output": "#009e73", "parameter": "#cc79a7"}
_LINE, _HEAD, _GAP, _WIDTH = 0.185, 0.36, 0.32, 3.75  # inches: line, head of a box, gap between boxes, box
_MARGIN, _LETTER = 0.15, 8.0  # inches; points


@dataclass(frozen=True)
class Row:
    """Variables of one kind in one line of the map."""

    text: str  # names in one text, for example position.{x, y, z}
    count: int
    units: str  # units and remarks


@dataclass(frozen=True)
class _Box:
    role: str  # role of the variables, which determines the color
    title: str
    rows: list[Row]

    @property
    def height(self) -> float:
        return _HEAD + _LINE * len(self.rows) + 0.06


def variable_map(vehicle: Vehicle) -> Figure:
    """Return a map of the variables of a vehicle's FMU."""
    from matplotlib.figure import Figure

    table = variables(vehicle)
    roles = {role: [v for v in table if v.role == role] for role in ("input", "state", "output", "parameter")}
    flow = [
        _Box("input", f"{len(roles['input'])} inputs", group_rows(roles["input"])),
        _Box("state", f"{len(roles['state'])} states, and the derivative of each", group_rows(roles["state"])),
        _Box(
            "output", f"{len(roles['output'])} outputs, and the states that are not local", group_rows(roles["output"])
        ),
    ]
    families = [
        _Box("parameter", f"{family}: {sum(row.count for row in rows)}", rows)
        for family, rows in ((family, group_rows(family_members(roles["parameter"], family))) for family in FAMILIES)
    ]
    columns = _columns(families, len(flow))
    flow_height = max(box.height for box in flow)
    below = max(sum(box.height + _GAP / 2.0 for box in column) for column in columns)
    width = len(flow) * _WIDTH + (len(flow) - 1) * _GAP + 2.0 * _MARGIN
    height = 2.0 * _MARGIN + 0.4 + flow_height + _GAP + 0.3 + below
    figure = Figure(figsize=(width, height))
    ax = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, width), ylim=(0.0, height))
    ax.set_axis_off()
    y = height - _MARGIN - 0.2
    ax.text(_MARGIN, y, f"{vehicle.title}: the variables of its FMU", fontsize=12, va="center")
    y -= 0.25
    for i, box in enumerate(flow):
        x = _MARGIN + i * (_WIDTH + _GAP)
        _draw(ax, box, x, y)
        if i:
            _arrow(ax, (x - _GAP, y - flow[i].height / 2.0), (x, y - flow[i].height / 2.0))
    y -= flow_height + _GAP
    ax.text(
        _MARGIN, y, f"{len(roles['parameter'])} parameters, all tunable: they may change while it runs",
        fontsize=10, va="center", color=_COLORS["parameter"], fontweight="bold",
    )  # fmt: skip
    y -= 0.2
    for i, column in enumerate(columns):
        top = y
        for box in column:
            _draw(ax, box, _MARGIN + i * (_WIDTH + _GAP), top)
            top -= box.height + _GAP / 2.0
    return figure


def group_rows(table: Iterable[Variable]) -> list[Row]:
    """Group variables into lines; names that differ in an index or a last part share one."""
    stems: dict[str, list[Variable]] = {}
    for v in table:
        stem = re.sub(r"\[.*", "[", v.name) if "[" in v.name else v.name.partition(".")[0] + "." * ("." in v.name)
        stems.setdefault(stem, []).append(v)
    return [_row(stem, members) for stem, members in stems.items()]


def family_members(parameters: Iterable[Variable], family: str) -> list[Variable]:
    """Return the parameters of a family of `FAMILIES`."""
    return [v for v in parameters if v.name.startswith(FAMILIES[family])]


def _row(stem: str, members: Sequence[Variable]) -> Row:
    text = members[0].name
    if stem.endswith("["):
        text = f"{members[0].name}" if len(members) == 1 else f"{stem}{_indices(members)}]"
    elif stem.endswith("."):
        text = f"{stem}*"
        lasts = [v.name.removeprefix(stem) for v in members]
        if len(lasts) <= 6 and sum(map(len, lasts)) <= 18:
            text = f"{stem}{{{', '.join(lasts)}}}"
    units = ", ".join(dict.fromkeys(v.quantity.unit or "–" for v in members))
    kinds = {v.type for v in members} - {"real"} | ({"local"} if members[0].local else set())
    if members[0].type != "real":
        units = ""
    return Row(text, len(members), ", ".join([*([units] if units else []), *sorted(kinds)]))


def _indices(members: Sequence[Variable]) -> str:
    """Return the first and the last of each index, such as 1…6, 1…8."""
    indices = [[int(i) for i in re.findall(r"\d+", v.name.partition("[")[2])] for v in members]
    return ", ".join(f"{min(axis)}…{max(axis)}" for axis in zip(*indices, strict=True))


def _columns(boxes: Sequence[_Box], n: int) -> list[list[_Box]]:
    """Return boxes in columns of nearly equal height, the highest boxes first."""
    columns: list[list[_Box]] = [[] for _ in range(n)]
    for box in sorted(boxes, key=lambda box: -box.height):
        min(columns, key=lambda column: sum(b.height for b in column)).append(box)
    return columns


def _draw(ax: Axes, box: _Box, x: float, y: float) -> None:
    """Draw a box from its upper left corner."""
    from matplotlib.patches import Rectangle

    color = _COLORS[box.role]
    ax.add_patch(Rectangle((x, y - box.height), _WIDTH, box.height, facecolor="white", edgecolor=color, linewidth=1.2))
    ax.add_patch(Rectangle((x, y - _HEAD + 0.06), _WIDTH, _HEAD - 0.06, facecolor=color, edgecolor=color, alpha=0.25))
    ax.text(x + 0.08, y - (_HEAD - 0.06) / 2.0, box.title, fontsize=_LETTER + 1.0, fontweight="bold", va="center")
    for i, row in enumerate(box.rows):
        middle = y - _HEAD - (i + 0.5) * _LINE
        ax.text(x + 0.08, middle, row.text, fontsize=_LETTER, va="center")
        ax.text(
            x + _WIDTH - 0.08, middle, f"{row.count} × {row.units}", fontsize=_LETTER, va="center", ha="right",
            color="#555555",
        )  # fmt: skip


def _arrow(ax: Axes, start: tuple[float, float], end: tuple[float, float]) -> None:
    ax.annotate("", xy=end, xytext=start, arrowprops={"arrowstyle": "-|>", "color": "#333333", "linewidth": 1.4})
