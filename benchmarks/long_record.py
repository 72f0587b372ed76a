"""Peak memory of the verbs for a run of many rows, each in a process of its own."""

from __future__ import annotations

import itertools
import json
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from cosim.results.record import load_record
from cosim.results.recorder import Recorder
from cosim.results.run_result import SCENARIO as SCENARIO_FILE
from cosim.results.run_result import SUMMARY
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario

ROWS = (1_000_000, 10_000_000)
SCENARIO = "paper"

_REPEATED = 20_000  # maximum number of rows of the short run
_EXPORTS = ("csv", "mcap", "rrd", "tlog")
WORK = {
    "record": ("write",),
    "summary": ("summary",),
    "report": ("report",),
    "report as PNG": ("report", "--format", "png"),
    "replay": ("report", "--replay"),
    "watch": ("watch", "--once"),
    **{f"export {name}": ("export", "--to", name) for name in _EXPORTS},
}


@dataclass(frozen=True)
class Taken:
    """Time and memory of a verb, or the reason why it failed."""

    peak: float  # MB, peak memory of the whole process
    seconds: float  # s, duration of the work
    error: str  # reason of the failure; empty without one


def write_long_run(folder: Path, rows: int, scenario: str = SCENARIO) -> None:
    """Write the folder of a long run: the rows of a short run repeated, with increasing times."""
    step = load_scenario(scenario).time.step
    lasting = [f"time.duration={(rows - 1) * step!r}", "arbiter.engine=closed"]
    whole = load_scenario(scenario, lasting)
    short = load_scenario(scenario, [f"time.duration={min(rows - 1, _REPEATED) * step!r}", lasting[1]])
    folder.mkdir(parents=True)
    with tempfile.TemporaryDirectory(dir=folder) as scratch:
        run = run_scenario(short, Path(scratch) / "run", report=False)
        record = load_record(run.folder)
        repeated = record.stack(list(record.units))[:_REPEATED]
    at = list(record.units).index("time")
    recorder = Recorder(folder, record.columns)
    for k, row in enumerate(itertools.islice(itertools.cycle(repeated), rows)):
        row[at] = k * step
        recorder.observe(k, row)
    recorder.close()
    (folder / SCENARIO_FILE).write_text(whole.toml(), encoding="utf-8")
    summary = {"status": "completed", "wall_time": None, "law": whole.law.name, "scenario": whole.name}
    (folder / SUMMARY).write_text(json.dumps(summary), encoding="utf-8")


def print_table(rows: Sequence[int], work: Sequence[str], scenario: str, folder: Path | None) -> None:
    """Measure verbs on runs of given lengths, and print a line for each verb."""
    columns = []
    for n in rows:
        with tempfile.TemporaryDirectory(dir=folder) as scratch:
            run = Path(scratch) / "run"
            written = _taken("write", run, n, scenario)
            columns.append([written if name == "record" else _of(name, run, Path(scratch)) for name in work])
    print("peak of the memory of the whole process, and what the work took")
    print(f"{'rows':24}" + "".join(f"{n:>20,}" for n in rows) + ("     ratio" if len(rows) > 1 else ""))
    for name, *taken in zip(work, *columns, strict=True):
        shown = "".join(f"{t.error or f'{t.peak:.0f} MB {t.seconds:6.1f} s':>20}" for t in taken)
        whole = len(taken) > 1 and not any(t.error for t in taken)
        print(f"{name:24}{shown}" + (f"{taken[-1].peak / taken[0].peak:9.2f}x" if whole else ""))


def _of(name: str, run: Path, scratch: Path) -> Taken:
    verb, *flags = WORK[name]
    made = scratch / "made"
    taken = _taken(verb, run, *flags, *(("--out", str(made)) if verb == "export" else ()))
    for file in scratch.glob("made*"):
        file.unlink()
    return taken


def _taken(*arguments: object) -> Taken:
    """Run a verb in another process."""
    print(*arguments, file=sys.stderr, flush=True)
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.long_record", *map(str, arguments)], stdout=subprocess.PIPE, check=True
    )
    return Taken(**json.loads(done.stdout.splitlines()[-1]))


def _peak() -> float:
    """Return the peak memory of this process [MB]."""
    try:
        lines = Path("/proc/self/status").read_text(encoding="utf-8").splitlines()
        return next(int(line.split()[1]) for line in lines if line.startswith("VmHWM:")) * 1024 / 1e6
    except (OSError, StopIteration):
        import resource  # not on Windows; on Linux its peak includes that of the parent process

        most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        return most / 1e6 if sys.platform == "darwin" else most * 1024 / 1e6


def _child(verb: str, run: str, *flags: str) -> None:
    """Run a verb in this process, and print its time and memory."""
    from cosim.command_line.cli import main
    from cosim.results.run_result import load_run

    began, error = time.perf_counter(), ""
    if verb == "write":
        write_long_run(Path(run), int(flags[0]), flags[1])
    elif verb == "summary":
        load_run(Path(run))
    else:
        error = f"exit status {code}" if (code := main([verb, run, *flags])) else ""
    print()
    print(json.dumps({"peak": _peak(), "seconds": time.perf_counter() - began, "error": error}))


if __name__ == "__main__":
    _child(*sys.argv[1:])
