"""Ablation of the deployable law: the same scenes flown with the whole law, and without one of its parts each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from cosim.campaigns.analysis.campaign_summary import rates_of
from cosim.campaigns.analysis.statistics import Facts, count_pairs, mean_ratio, median_difference, rate
from cosim.campaigns.comparison import Comparison, completed_scenes, fly_each, refuse_other_files
from cosim.campaigns.runner import Campaign
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.kinds import scene_kinds
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.scenes.scene_work import SceneTask
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.scenario.tables import RuleVariant
from cosim.simulation.signals import Array
from plant_fmu.toml_tables import hint

LAW, WHOLE = "deployable", "whole"
NUMBERS = "ablation.json"
PAGE = "ablation.html"
_ZERO = 1e-9  # bound that holds an estimate at about 0; a gain of 0 is refused


class Variant(NamedTuple):
    """The law without a part."""

    description: str
    gains: Mapping[str, float] = {}
    arbiter: RuleVariant = "ordered"


VARIANTS: dict[str, Variant] = {
    "arbiter-reversed": Variant("criteria weighed in reversed order", arbiter="reversed"),
    "arbiter-none": Variant("all weights 1", arbiter="none"),
    "arbiter-crisp": Variant("memberships of 0 or 1", arbiter="crisp"),
    "net-weight": Variant("W - B taken for 0", {"restoring_bound": _ZERO}),
    "current": Variant("current taken for 0", {"current_bound": _ZERO}),
    "moments": Variant("moments of the weight, and about z, taken for 0", {"moment_bound": _ZERO}),
    "effectiveness": Variant("the same effectiveness of all thrusters", {"effectiveness_estimation": 0.0}),
    "drag": Variant("drag taken for the vehicle's", {"drag_estimation": 0.0}),
    "lag": Variant("no lag of the thrusters, and no prediction", {"lag_bound": 0.0}),
    "fault-detection": Variant("no thruster is isolated", {"failure_threshold": 0.0}),
    "path-planning": Variant("straight at the goal", {"path_planning": 0.0}),
    "barriers": Variant("no barriers", {"barriers": 0.0}),
}


def ablate(
    scenes: Path,
    out: Path,
    variants: Sequence[str] = tuple(VARIANTS),
    conditions: Conditions | None = None,
    settings: Sequence[str] = (),
    workers: int = 1,
    progress: bool = False,
) -> Comparison:
    """Fly the same scenes with the deployable law, and without one of its parts each."""
    for name in variants:
        if name not in VARIANTS:
            raise RunError(f"variant {name!r} is unknown; {hint(name, VARIANTS)}")
    if not variants or len(set(variants)) < len(variants):
        raise RunError(f"variants are {', '.join(variants) or 'none'}, expected one or more, each once")
    refuse_other_files(out, {NUMBERS, PAGE, WHOLE, *VARIANTS}, "an ablation")
    all_variants = {WHOLE: Variant("all of it")} | {name: VARIANTS[name] for name in variants}
    gains, conditions = gains_from(LAW, settings), conditions or Conditions()

    def numbers(campaigns: Mapping[str, Campaign]) -> dict[str, Any]:
        reference = campaigns[WHOLE]
        return {
            "law": LAW,
            "variants": {
                name: {"description": variant.description, **_compare(reference.results, campaigns[name].results)}
                for name, variant in all_variants.items()
            },
            "versions": reference.summary["versions"],
            "code_sha256": reference.summary["code_sha256"],
        }

    tasks = {
        name: SceneTask(
            LAW, gains._replace(**variant.gains), msgspec.structs.replace(conditions, arbiter=variant.arbiter)
        )
        for name, variant in all_variants.items()
    }
    return fly_each(scenes, out, tasks, NUMBERS, numbers, workers, progress)


def _compare(whole: Results, results: Results) -> dict[str, Any]:
    """Compare a variant with the whole law, over all scenes and by their kinds."""
    kinds = {name: _numbers(whole, results, rows) for name, rows in scene_kinds(results).groups()}
    return _numbers(whole, results, np.ones(len(results), dtype=bool)) | {"kinds": kinds}


def _numbers(whole: Results, results: Results, rows: Facts) -> dict[str, Any]:
    """Compare on some scenes; ratios and differences are of the whole law to this variant."""
    by_whole, by_variant = completed_scenes(whole)[rows], completed_scenes(results)[rows]

    def columns(name: str) -> tuple[Array, Array]:
        return whole.number(name)[rows], results.number(name)[rows]

    times = columns("reach_time")
    return {
        "scenes": int(rows.sum()),
        **{name: rate(happened[rows]) for name, happened in rates_of(results).items()},
        "paired": count_pairs(by_whole, by_variant),
        "weighted_violation": mean_ratio(*columns("weighted_violation")),
        "reach_time": median_difference((times[0] - times[1])[by_whole & by_variant]),
        "thrust_variation": mean_ratio(*columns("thrust_variation")),
    }
