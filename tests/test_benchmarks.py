"""The benchmarks run, and what they compare is one plant. No test asserts a time."""

import pytest

from benchmarks.__main__ import BENCHMARKS, main
from benchmarks.fmu import INPUTS, export_numpy_plant
from plant_fmu import cached_fmu, load_vehicle
from plant_fmu.importers import IMPORTERS, Task, read_fmu, run_importer
from tests.plant_fmu.conftest import STATES

_LONG = ("fmu", "law", "mavlink", "sitl")


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=pytest.mark.slow) if name in _LONG else name for name in BENCHMARKS]
)
def test_each_benchmark_prints_a_table(name, capsys):
    main([name, "--steps", "60", "--repeats", "2"])
    _, heading, *rows = capsys.readouterr().out.splitlines()
    assert heading.startswith("microseconds a step")
    assert len(rows) > 5
    for row in rows:
        numbers = row.split()[-4:]
        assert "not timed" in row or all(float(number) > 0.0 for number in numbers)


def test_the_numpy_plant_is_the_same_plant(tmp_path):
    path = export_numpy_plant(tmp_path)
    if path is None:
        pytest.skip("pythonfmu is not installed")
    fmpy = next(importer for importer in IMPORTERS if importer.name == "FMPy")
    task = Task(stop_time=0.5, start=INPUTS | {"wrench.K": 2.0, "wrench.N": -1.0, "wrench.Z": 4.0})
    theirs, ours = (run_importer(fmpy, read_fmu(p), task) for p in (path, cached_fmu(load_vehicle("odin"), 2)))
    assert (theirs.status, ours.status) == ("ok", "ok"), theirs.note + ours.note
    for name in STATES:
        assert ours.values[name] != 0.0
        assert theirs.values[name] == pytest.approx(ours.values[name], abs=1e-12)
