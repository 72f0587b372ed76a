"""``cosim campaign`` and ``cosim compare``."""

from __future__ import annotations

import argparse
import contextlib
import functools
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cosim.command_line.flags import add_changes, add_verb, flag, int_range, refuse_flags
from cosim.command_line.process import say, say_if_interrupted
from cosim.errors import RunError

if TYPE_CHECKING:
    from cosim.campaigns.runner import Campaign
    from cosim.campaigns.sweeps.design import Vary
    from cosim.scenario.law_factory import OwnLaw
    from cosim.scenario.scenario import Scenario

_SENSING = ("state", "sensors")  # with the scenes' noise; or IMU, DVL, compass, pressure sensor and USBL
_WORKERS = int_range(1, 1024)


def add_verbs(verbs: Any) -> None:
    """Add the verbs to the subparsers of the command."""
    verb = add_verb(
        verbs, "campaign", campaign, "fly many scenes by one law", "campaigns",
        ("campaign scenes.jsonl --law deployable --out campaigns/mine --workers 2",
         "campaign scenes.jsonl --law ismail_dunnigan --set k_p1=10 --out campaigns/stiff"),
    )  # fmt: skip
    flag(verb, "--law NAME|FILE", "such as ismail_dunnigan; or an .fmu file, or FILE.py:NAME", required=True)
    add_changes(verb, "a gain of the law, such as k_p1=10")
    _add_scenes(verb)
    add_cluster(verb)

    verb = add_verb(
        verbs, "compare", compare, "fly the same scenes by several laws, or by one without a part each", "campaigns",
        ("compare scenes.jsonl --laws deployable,pd --out comparisons/mine",
         "compare scenes.jsonl --ablate --variants net-weight,arbiter-reversed --out ablations/mine"),
    )  # fmt: skip
    compared = verb.add_mutually_exclusive_group(required=True)
    flag(compared, "--laws A,B[,C]", "two or more, with commas between them; each as --law of campaign")
    flag(compared, "--ablate", "compare the deployable law with itself without one part each")
    flag(verb, "--variants A[,B]", "with --ablate: such as net-weight,arbiter-reversed (default: all)")
    add_changes(
        verb, "a gain of a law, such as ismail_dunnigan.k_p1=10; with --ablate of all variants, such as speed=0.8"
    )
    _add_scenes(verb)
    add_workers(verb)


def _add_scenes(verb: argparse.ArgumentParser) -> None:
    verb.add_argument("scenes", type=Path, metavar="SCENES.jsonl", help="a scene a line; - for standard input")
    add_campaign_folder(verb)
    flag(verb, "--report-failures", "report failing thrusters to the law")
    flag(verb, "--sensing", "input of the law: state, or navigation filter", default="state", choices=_SENSING)
    flag(
        verb, "--arbiter ordered|reversed|crisp|none|FILE", "weigh criteria by their order (default), in reversed "
        "order, by memberships of 0 or 1, all with 1, or by rules of a file with the criteria as inputs",
    )  # fmt: skip


def add_campaign_folder(verb: argparse.ArgumentParser) -> None:
    """Add the flags for the folder of a campaign, and for the replays of its worst flights."""
    flag(verb, "--out DIR", "a new folder, or an unfinished one to resume", Path, required=True)
    flag(verb, "--replays N", "number of worst flights of each law to repeat with a replay", int_range(0, 1000), 3)


def add_workers(verb: argparse.ArgumentParser) -> None:
    """Add the flag for the number of processes that fly."""
    flag(verb, "--workers N", "processes", _WORKERS, 1)


def add_cluster(verb: argparse.ArgumentParser) -> None:
    """Add the flags for the processes that fly: on this machine or in a Dask cluster."""
    flag(verb, "--workers N", "processes (default: 1; with --dask: one a core)", _WORKERS)
    where = verb.add_mutually_exclusive_group()
    flag(where, "--dask", "start a Dask cluster on this machine")
    flag(where, "--scheduler tcp://HOST:PORT", "use an existing Dask cluster")


@contextlib.contextmanager
def executor_of(options: argparse.Namespace) -> Iterator[Executor | None]:
    """Connect to the Dask cluster of the flags; yield its executor, or None without one."""
    if options.scheduler and options.workers:
        raise RunError("--workers: expected none with --scheduler: the cluster sets their number")
    if not (options.dask or options.scheduler):
        yield None
        return
    from cosim.campaigns.workers.cluster import cluster_executor

    with cluster_executor(options.scheduler, options.workers or os.cpu_count() or 1) as executor:
        yield executor


def _conditions(options: argparse.Namespace) -> Any:
    from cosim.campaigns.scenes.conditions import Conditions

    arbiter = options.arbiter or "ordered"
    return Conditions.by_arbiter(arbiter, report_failures=options.report_failures, sensing=options.sensing)


def fly(
    options: argparse.Namespace,
    work: Callable[[], Any],
    lines: Callable[[Any], Iterable[str]],
    write_page: Callable[[Path, int], Path],
) -> int:
    """Fly the missing rows of a campaign, and print its outcome and page; after Ctrl-C, print what is kept."""

    def run() -> None:
        done = work()
        if not getattr(done, "flown", True):
            say(options, f"{options.out}: was complete already")
        say(options, *lines(done))
        print(write_page(options.out, options.replays))

    return say_if_interrupted(run, f"what is flown is kept in {options.out}, and the same command goes on")


def load_with_law(scenario: str, law: str | None, changes: Sequence[str]) -> tuple[Scenario, OwnLaw | None]:
    """Load a scenario with the law of ``--law``; return that too if it is Python code."""
    from cosim.scenario.law_factory import own_law
    from cosim.scenario.scenario import load_scenario

    own = own_law(law) if law else None
    key = "file" if law and law.endswith(".fmu") else "name"
    return load_scenario(scenario, [*([f"law.{key}={law}"] if law and not own else []), *changes]), own


def refuse_both(vary: Sequence[Vary], changes: Sequence[str]) -> None:
    """Raise a RunError if a key is set and varies."""
    from cosim.scenario.toml_file import split_change

    both = {one.key for one in vary} & {split_change(text)[0] for text in changes}
    if both:
        raise RunError(f"{min(both)} is set and varies, expected either")


def campaign(options: argparse.Namespace) -> int:
    """Run ``cosim campaign``."""
    from cosim.campaigns.campaign import run_campaign
    from cosim.campaigns.pages.campaign_page import campaign_lines, write_campaign_page
    from cosim.campaigns.scenes.law_gains import gains_from, to_law

    law = to_law(options.law)
    gains, conditions = gains_from(law, options.set), _conditions(options)

    def work() -> Campaign:
        with executor_of(options) as executor:
            n, progress = options.workers or 1, not options.quiet
            return run_campaign(options.scenes, law, options.out, conditions, gains, n, executor, progress=progress)

    page = functools.partial(write_campaign_page, laws=own_laws(law))
    return fly(options, work, lambda done: campaign_lines(done.summary), page)


def own_laws(*laws: object) -> list[OwnLaw]:
    """Return those laws that are Python code."""
    from cosim.scenario.law_factory import OwnLaw

    return [law for law in laws if isinstance(law, OwnLaw)]


def compare(options: argparse.Namespace) -> int:
    """Run ``cosim compare``."""
    from cosim.campaigns.comparison import compare as compare_laws
    from cosim.campaigns.pages.comparison_page import write_comparison_page
    from cosim.campaigns.scenes.law_gains import gains_by_law, to_law

    if options.ablate:
        return _ablate(options)
    refuse_flags(options, ["variants"], "--ablate with it")
    laws = [law.strip() for law in options.laws.split(",") if law.strip()]
    gains, conditions = gains_by_law(laws, options.set), _conditions(options)
    made = [to_law(law) for law in laws]
    given = options.scenes, made, options.out, conditions, gains, options.workers

    def lines(done: Any) -> Iterator[str]:
        for law, s in done.numbers["laws"].items():
            yield f"{law}: {s['reached']} of {s['scenes']} scenes reached, {s['violations']} with a violation"

    page = functools.partial(write_comparison_page, laws=own_laws(*made))
    return fly(options, lambda: compare_laws(*given, progress=not options.quiet), lines, page)


def _ablate(options: argparse.Namespace) -> int:
    from cosim.campaigns.ablation import VARIANTS, ablate
    from cosim.campaigns.pages.ablation_page import write_ablation_page

    refuse_flags(options, ["arbiter"], "no --ablate with it")
    names = list(VARIANTS) if options.variants is None else [name.strip() for name in options.variants.split(",")]
    arguments = options.scenes, options.out, names, _conditions(options), options.set, options.workers

    def lines(done: Any) -> Iterator[str]:
        for name, result in done.numbers["variants"].items():
            violated = result["weighted_violation"]["other"]
            weighted = "" if violated is None else f", weighted violation {violated:.4g} m s on average"
            completed = f"{result['completed']['rows']} of {result['scenes']} scenes completed"
            yield f"{name} ({result['description']}): {completed}{weighted}"

    return fly(options, lambda: ablate(*arguments, not options.quiet), lines, write_ablation_page)
