"""Column names and table rows that several campaign pages share."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import Any

from cosim.campaigns.analysis.statistics import QUANTILES

LABELS = {  # names of columns with units
    "reached": "reached the goal",
    "settled": "settled there",
    "violated": "violated a hard region",
    "reach_time": "reach time [s]",
    "settle_time": "settle time [s]",
    "min_clearance": "minimum clearance [m]",
    "weighted_violation": "weighted violation [m s]",
    "closest_to_goal": "minimum distance to the goal [m]",
    "effort": "effort [N s]",
    "thrust_variation": "thrust variation [N]",
    "max_force": "maximum force [N]",
    "max_speed": "maximum speed [m/s]",
    "final_x": "position x at the end [m]",
    "final_y": "position y at the end [m]",
    "final_z": "position z at the end [m]",
    "phi1": "estimate of φ1 at the end [N]",
    "phi2": "estimate of φ2 at the end [N m]",
    "phi3": "estimate of φ3 at the end [N m]",
    "phi4": "estimate of φ4 at the end [N m]",
    "stopped_at": "stopped by the plant at [s]",
}
_QUANTILE_NAMES = ["median" if q == 0.5 else f"{100 * q:g} %" for q in QUANTILES]


def quantile_rows(groups: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[str, str, Iterable[float | None]]]:
    """Yield label, group and quantiles of each column that has numbers; only the first group has the label."""
    for name in next(iter(groups.values()))["quantiles"]:
        quantiles = {group: numbers["quantiles"][name] for group, numbers in groups.items()}
        if any(values["0.5"] is not None for values in quantiles.values()):
            for i, (group, values) in enumerate(quantiles.items()):
                yield "" if i else LABELS[name], group, values.values()


SECTIONS: dict[str, Any] = {"quantile_names": _QUANTILE_NAMES, "quantile_rows": quantile_rows}  # of the shared template
