"""Every reader accepts a mutated file or rejects it in one short printable line that names the file."""

from __future__ import annotations

import os
import resource
import traceback
from collections import Counter
from pathlib import Path
from random import Random

import pytest

from tests.security.fuzzing import files, folders, talkers
from tests.security.fuzzing.mutations import BYTES, mutated
from tests.security.fuzzing.registry import KINDS, READERS, ROOT, Case

FEW = 40  # changes of each reader's examples among the medium tests,
MANY = int(os.environ.get("FUZZ_CHANGES", "120"))  # and among the slow ones; FUZZ_CHANGES=2000 takes an hour
LONGEST = 300  # characters of a message, beside the path that it names
MEMORY = 400  # MB that all changes of a reader may take

assert files and folders and talkers  # which register


def fault_of(case: Case, content: bytes, is_refusal_a_fault: bool = False) -> str:
    """Return the error in reading a content, "" if none."""
    try:
        case.read(content)
    except KINDS as error:
        said = str(error)
        if is_refusal_a_fault:
            return said
        if not said.isprintable():
            return "the message is not printable"
        if len(said.replace(case.named, "")) >= LONGEST:
            return f"the message is long: {said}"
        return "" if case.named in said else f"the message does not name {case.named}: {said}"
    except Exception as error:  # noqa: BLE001 - whatever it is, it is a defect
        own = [at for at in traceback.extract_tb(error.__traceback__) if at.filename.startswith(str(ROOT))]
        at = next((at for at in reversed(own) if ".venv" not in at.filename), own[-1])
        return f"{type(error).__name__} from {Path(at.filename).name}, line {at.lineno}: {str(error)[:100]}"
    return ""


def tried(case: Case, kind: str, numbers: range) -> Counter[str]:
    """Return the faults that some changes bring to light, each with the number of the first change."""
    found: Counter[str] = Counter()
    for number in numbers:
        content = case.contents[number % len(case.contents)]
        if fault := fault_of(case, mutated(content, kind, number)):
            found[fault] += 1
            print(f"change {number}: {fault}")  # noqa: T201 - which pytest shows
    return found


@pytest.mark.medium
@pytest.mark.filterwarnings("ignore:.*are taken as Windows-1252")
@pytest.mark.parametrize("name", READERS)
def test_readers_survive_a_few_mutations(name, seeds):
    assert not tried(READERS[name].case(seeds), READERS[name].kind, range(FEW))


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore:.*are taken as Windows-1252")
@pytest.mark.parametrize("name", READERS)
def test_readers_survive_many_mutations(name, seeds):
    case = READERS[name].case(seeds)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert not tried(case, READERS[name].kind, range(FEW, MANY))
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < MEMORY * 1024


@pytest.mark.medium
@pytest.mark.parametrize("name", ["telemetry log", "dataflash log", "log of PX4"])
def test_most_logs_with_flipped_bits_are_read(name, seeds):
    case = READERS[name].case(seeds)
    (content,) = case.contents
    assert [fault_of(case, BYTES[0](content, Random(k)), is_refusal_a_fault=True) for k in range(8)].count("") >= 4
