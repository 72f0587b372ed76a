"""Ablation of the deployable law: the same scenes flown with the whole law, and without one of its parts each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

import msgspec
import numpy as np

from cosim.campaigns.analysis.statistics import Facts, mean_ratio, median_difference, paired, rate
from cosim.campaigns.campaign import Campaign, run_campaign
from cosim.campaigns.comparison import completed, refuse_other_files
from cosim.campaigns.scenes.conditions import Conditions
from cosim.campaigns.scenes.kinds import scene_kinds
from cosim.campaigns.scenes.law_gains import gains_from
from cosim.campaigns.scenes.scene_store import SceneStore
from cosim.campaigns.store.results import Results
from cosim.errors import RunError
from cosim.io.atomic_file import write_atomic
from cosim.io.strict_json import json_text
from cosim.scenario.tables import RuleVariant
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
    "moments": Variant("moments of the weight taken for 0", {"moment_bound": _ZERO}),
    "effectiveness": Variant("the same effectiveness of all thrusters", {"effectiveness_estimation": 0.0}),
    "lag": Variant("no lag of the thrusters, and no prediction", {"lag_bound": 0.0}),
    "fault-detection": Variant("no thruster is isolated", {"failure_threshold": 0.0}),
    "path-planning": Variant("straight at the goal", {"path_planning": 0.0}),
    "barriers": Variant("no barriers", {"barriers": 0.0}),
}


@dataclass(frozen=True)
class Ablation:
    """Folder and results of an ablation."""

    folder: Path
    campaigns: dict[str, Campaign]  # campaign of each variant, the whole law first
    numbers: dict[str, Any]  # content of ``ablation.json``


def ablate(
    scenes: Path,
    out: Path,
    variants: Sequence[str] = tuple(VARIANTS),
    conditions: Conditions | None = None,
    settings: Sequence[str] = (),
    workers: int = 1,
    progress: bool = False,
) -> Ablation:
    """Fly the same scenes with the deployable law, and without one of its parts each."""
    for name in variants:
        if name not in VARIANTS:
            raise RunError(f"variant {name!r} is unknown; {hint(name, VARIANTS)}")
    if not variants or len(set(variants)) < len(variants):
        raise RunError(f"variants are {', '.join(variants) or 'none'}, expected one or more, each once")
    refuse_other_files(out, {NUMBERS, PAGE, WHOLE, *VARIANTS}, "an ablation")
    flown = {WHOLE: Variant("all of it")} | {name: VARIANTS[name] for name in variants}
    gains, conditions, campaigns = gains_from(LAW, settings), conditions or Conditions(), {}
    with SceneStore(scenes) as store:
        for name, variant in flown.items():
            campaigns[name] = run_campaign(
                store, LAW, out / name, msgspec.structs.replace(conditions, arbiter=variant.arbiter),
                gains._replace(**variant.gains), workers, progress=progress,
            )  # fmt: skip
        whole = campaigns[WHOLE].results
        numbers = {
            "law": LAW,
            "scenes": len(store),
            "scenes_sha256": store.digest,
            "variants": {
                name: {"description": variant.description, **_beside(whole, campaigns[name].results)}
                for name, variant in flown.items()
            },
            "versions": campaigns[WHOLE].summary["versions"],
            "code_sha256": campaigns[WHOLE].summary["code_sha256"],
        }
    try:
        write_atomic(out / NUMBERS, json_text(numbers))
    except OSError as error:
        raise RunError(f"{out}: {error.strerror or error}") from error
    return Ablation(out, campaigns, numbers)


def _beside(whole: Results, results: Results) -> dict[str, Any]:
    """Compare a variant with the whole law, over all scenes and by their kinds."""
    every = np.ones(len(results), dtype=bool)
    return _numbers(whole, results, every) | {
        "kinds": {name: _numbers(whole, results, of) for name, of in scene_kinds(results).groups()}
    }


def _numbers(whole: Results, results: Results, of: Facts) -> dict[str, Any]:
    """Compare on scenes `of`; ratios and differences are of the whole law to this variant."""
    theirs, mine = completed(results)[of], completed(whole)[of]
    violation = {name: rows.number("weighted_violation", absent=np.nan)[of] for name, rows in
                 ((WHOLE, whole), ("variant", results))}  # fmt: skip
    both = theirs & mine
    return {
        "scenes": int(of.sum()),
        "completed": rate(theirs),
        "reached": rate(results["reached"][of]),
        "violation": rate(results["violation"][of]),
        "paired": paired(mine, theirs),
        "weighted_violation": mean_ratio(violation[WHOLE], violation["variant"]),
        "reach_time": median_difference((whole.number("reach_time")[of] - results.number("reach_time")[of])[both]),
        "thrust_variation": mean_ratio(whole.number("thrust_variation")[of], results.number("thrust_variation")[of]),
    }
