"""``cosim campaign``, ``cosim compare`` and ``cosim ablate``."""

from __future__ import annotations

import argparse
import contextlib
import os
from collections.abc import Callable, Iterator
from concurrent.futures import Executor
from pathlib import Path
from typing import Any

from cosim.command_line.numbers import whole
from cosim.command_line.process import say_if_interrupted
from cosim.command_line.results import say
from cosim.errors import RunError

WORKERS = whole(1, 1024)


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    campaign = verbs.add_parser("campaign", help="fly many scenes by one law")
    _add_scenes(campaign, cluster=True)
    campaign.add_argument("--law", required=True, help="such as ismail_dunnigan")
    campaign.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="settings",
        help="set a gain of the law, such as k_p1=10; may be repeated",
    )  # fmt: skip

    compare = verbs.add_parser("compare", help="fly the same scenes by several laws, and put them side by side")
    _add_scenes(compare)
    compare.add_argument("--laws", required=True, metavar="A,B[,C]", help="two or more, with commas between them")
    compare.add_argument(
        "--set", action="append", default=[], metavar="LAW.KEY=VALUE", dest="settings",
        help="set a gain of a law, such as ismail_dunnigan.k_p1=10; may be repeated",
    )  # fmt: skip

    ablate = verbs.add_parser("ablate", help="fly the same scenes by the deployable law, and without one part each")
    _add_scenes(ablate, arbiter=False)
    ablate.add_argument("--variants", metavar="A[,B]", help="such as net-weight,arbiter-reversed (default: all)")
    ablate.add_argument(
        "--set", action="append", default=[], metavar="KEY=VALUE", dest="settings",
        help="set a gain of all variants, such as speed=0.8; may be repeated",
    )  # fmt: skip


def _add_scenes(verb: argparse.ArgumentParser, arbiter: bool = True, cluster: bool = False) -> None:
    verb.add_argument("scenes", type=Path, metavar="SCENES.jsonl", help="a scene a line; - for standard input")
    verb.add_argument(
        "--out", type=Path, required=True, metavar="DIR",
        help="a new folder, or one that this command began: it goes on with what is left",
    )  # fmt: skip
    if cluster:
        add_cluster(verb)
    else:
        verb.add_argument("--workers", type=WORKERS, default=1, metavar="N", help="processes (default: 1)")
    add_replays(verb)
    verb.add_argument("--report-failures", action="store_true", help="report failing thrusters to the law")
    verb.add_argument(
        "--sensing", choices=("state", "sensors"), default="state",
        help="input of the law: the state with the scenes' noise, or a navigation filter's estimate from IMU, DVL, "
        "compass, pressure sensor and USBL (default: state)",
    )  # fmt: skip

    if arbiter:
        verb.add_argument(
            "--arbiter", default="ordered", metavar="ordered|reversed|crisp|none|FILE",
            help="weigh criteria by their order (default), in reversed order, by memberships of 0 or 1, all with 1, or "
            "by the rules of a file, whose inputs are named as the criteria",
        )  # fmt: skip


def add_cluster(verb: argparse.ArgumentParser) -> None:
    """Add the flags for the processes that fly: on this machine or in a Dask cluster."""
    verb.add_argument("--workers", type=WORKERS, metavar="N", help="processes (default: 1; with --dask: one a core)")
    where = verb.add_mutually_exclusive_group()
    where.add_argument("--dask", action="store_true", help="start a Dask cluster on this machine")
    where.add_argument("--scheduler", metavar="tcp://HOST:PORT", help="use an existing Dask cluster")


def require_one_count(options: argparse.Namespace) -> None:
    """Raise a RunError if the number of processes is given for an existing cluster."""
    if options.scheduler and options.workers:
        raise RunError("--workers: expected none with --scheduler: the cluster sets their number")


@contextlib.contextmanager
def executor_of(options: argparse.Namespace) -> Iterator[Executor | None]:
    """Connect to the Dask cluster of the flags; yield its executor, or None without one."""
    if not (options.dask or options.scheduler):
        yield None
        return
    from cosim.campaigns.workers.cluster import cluster_executor

    with cluster_executor(options.scheduler, options.workers or os.cpu_count() or 1) as executor:
        yield executor


def add_replays(verb: argparse.ArgumentParser) -> None:
    """Add the flag for the number of worst flights that get a replay."""
    verb.add_argument(
        "--replays", type=whole(0, 1000), default=3, metavar="N",
        help="number of worst flights that are repeated with a replay (default: 3; for each law that is compared)",
    )  # fmt: skip


def _conditions(options: argparse.Namespace) -> Any:
    from cosim.campaigns.scenes.conditions import Conditions

    arbiter = getattr(options, "arbiter", "ordered")
    return Conditions.by_arbiter(arbiter, report_failures=options.report_failures, sensing=options.sensing)


def campaign(options: argparse.Namespace) -> int:
    """Run ``cosim campaign``."""
    from cosim.campaigns import run_campaign
    from cosim.campaigns.pages.campaign_page import campaign_lines, write_campaign_page
    from cosim.campaigns.scenes.law_gains import gains_from

    require_one_count(options)
    gains = gains_from(options.law, options.settings)
    conditions = _conditions(options)

    def run() -> None:
        with executor_of(options) as executor:
            n, progress = options.workers or 1, not options.quiet
            done = run_campaign(
                options.scenes, options.law, options.out, conditions, gains, n, executor, progress=progress
            )
        if not done.flown:
            say(options, f"{options.out}: was complete already")
        say(options, *campaign_lines(done.summary))
        print(write_campaign_page(options.out, options.replays))

    return resumable(run, options.out)


def compare(options: argparse.Namespace) -> int:
    """Run ``cosim compare``."""
    from cosim.campaigns import compare as compare_laws
    from cosim.campaigns.pages.comparison_page import write_comparison_page
    from cosim.campaigns.scenes.law_gains import gains_by_law

    laws = [law.strip() for law in options.laws.split(",") if law.strip()]
    gains = gains_by_law(laws, options.settings)
    conditions = _conditions(options)

    def run() -> None:
        done = compare_laws(
            options.scenes, laws, options.out, conditions, gains, options.workers, progress=not options.quiet
        )
        for law, s in done.numbers["laws"].items():
            say(options, f"{law}: {s['reached']} of {s['scenes']} scenes reached, {s['violations']} with a violation")
        print(write_comparison_page(options.out, options.replays))

    return resumable(run, options.out)


def ablate(options: argparse.Namespace) -> int:
    """Run ``cosim ablate``."""
    from cosim.campaigns.ablation import VARIANTS
    from cosim.campaigns.ablation import ablate as fly_variants
    from cosim.campaigns.pages.ablation_page import write_ablation_page

    names = list(VARIANTS) if options.variants is None else [name.strip() for name in options.variants.split(",")]
    conditions = _conditions(options)

    def run() -> None:
        done = fly_variants(
            options.scenes, options.out, names, conditions, options.settings, options.workers, not options.quiet
        )
        for name, result in done.numbers["variants"].items():
            violated = result["weighted_violation"]["other"]
            weighted = "" if violated is None else f", weighted violation {violated:.4g} m s on average"
            completed = f"{result['completed']['rows']} of {result['scenes']} scenes completed"
            say(options, f"{name} ({result['description']}): {completed}{weighted}")
        print(write_ablation_page(options.out, options.replays))

    return resumable(run, options.out)


def resumable(run: Callable[[], None], out: Path) -> int:
    """Run a campaign; after Ctrl-C or a kill, print that finished rows are kept."""
    return say_if_interrupted(run, f"what is flown is kept in {out}, and the same command goes on")
