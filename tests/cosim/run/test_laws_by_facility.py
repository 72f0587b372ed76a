"""Every kind of custom law with every facility: shown, recorded and exported alike, or refused by one line."""

from types import SimpleNamespace

import numpy as np
import pytest

from controller import LAWS, FunctionLaw
from controller.law import Diagnostic
from cosim.command_line.cli import main
from cosim.errors import CosimError, RunError
from cosim.live.address import parse_live
from cosim.live.live_view import LiveView
from cosim.mavlink.run_links import Mavlink
from cosim.mavlink.wire.endpoint import parse_endpoint
from cosim.mavlink.wire.options import PROFILES, MavlinkOptions
from cosim.results.record import load_record
from cosim.run.run_folder import report_again
from cosim.run.run_scenario import run_scenario
from cosim.scenario.scenario import load_scenario
from cosim.simulation.master import Master
from plant_fmu import Plant, load_vehicle
from plant_fmu.build import cached_fmu
from plant_fmu.vehicle_component import make_vehicle_component

SHORT = ("arbiter.engine=closed", "time.duration=0.1", "time.step=0.01", "time.control=0.02", "time.arbiter=0.01")
SCENARIO = load_scenario("paper", SHORT)


def ahead(state, goal, regions, weights):
    return [20.0, 0.0, 0.0, 0.0, 0.0, 0.0]


class Steady(FunctionLaw):
    """A subclass, which the name of its function identifies."""


class Ahead:
    """An object with a state."""

    def __call__(self, state, goal, regions, weights):
        return ahead(state, goal, regions, weights)


class Protocol:
    """What else fulfils `controller.Law`, with a diagnostic of its own."""

    output, diagnostics = "wrench", (Diagnostic("push", "N", "Force ahead"),)
    estimate, report = np.zeros(4), np.ones(1)

    def step(self, state, goal, regions, weights, forces):
        forces[:] = ahead(state, goal, regions, weights)


class OwnPd(LAWS["pd"]):
    """A class of the user's own made from a built-in law."""


def built_in(law):
    return law.for_vehicle(None, law.gains_type(), np.array([1.0, 0.0, 0.0, 0.0]), 0.02, len(SCENARIO.regions))


KINDS = {
    "function": lambda: FunctionLaw(ahead),
    "lambda": lambda: FunctionLaw(lambda *_: np.zeros(6)),
    "object": lambda: FunctionLaw(Ahead()),
    "subclass": lambda: Steady(ahead),
    "protocol": Protocol,
    "built-in": lambda: built_in(LAWS["pd"]),
    "own-compiled": lambda: built_in(OwnPd),
}
EXPORTS = ("csv", "tlog")


def link(folder, profile, commands=False):
    endpoints = (parse_endpoint("udpout:127.0.0.1:9"), parse_endpoint(str(folder / "link.tlog")))
    return Mavlink(endpoints, MavlinkOptions(profile=profile, commands=commands))


@pytest.mark.medium
@pytest.mark.parametrize("kind", KINDS)
def test_custom_law_flies_on_links_and_in_the_live_view_with_the_same_bits(kind, tmp_path):
    run_scenario(SCENARIO, tmp_path / "plain", report=False, law=KINDS[kind]())
    for profile in PROFILES:
        (tmp_path / profile).mkdir()
        with LiveView(parse_live("127.0.0.1:0")) as live:
            run_scenario(
                SCENARIO, tmp_path / profile / "run", link(tmp_path / profile, profile, True), report=False,
                live=live, law=KINDS[kind](),
            )  # fmt: skip
        assert (tmp_path / profile / "link.tlog").stat().st_size > 500
        one, other = load_record(tmp_path / "plain"), load_record(tmp_path / profile / "run")
        assert all(np.array_equal(one[name], other[name], equal_nan=True) for name in one.units)


@pytest.mark.medium
@pytest.mark.parametrize("kind", KINDS)
def test_run_of_a_custom_law_is_exported_and_streamed(kind, tmp_path, capsys):
    run = run_scenario(SCENARIO, tmp_path / "run", report=False, law=KINDS[kind]())
    for form in EXPORTS:
        assert main(["export", str(run.folder), "--to", form, "--out", str(tmp_path / f"run.{form}")]) == 0
    for profile in PROFILES:
        words = f"mavlink stream {run.folder} --mavlink udpout:127.0.0.1:9 --rate max --profile {profile}"
        assert main(words.split()) == 0
    assert main(["check", str(run.folder / "scenario.toml")]) in (0, 1)
    capsys.readouterr()


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS)
def test_run_of_a_custom_law_is_reported_and_replayed(kind, tmp_path):
    run = run_scenario(SCENARIO, tmp_path / "run", report=False, law=KINDS[kind]())
    _, files = report_again(run.folder)
    assert {file.name for file in files} >= {"report.html", "replay.html"}


REFUSED = ({"commands.enabled": True}, {"record.lyapunov": True})
REFUSED_OF_A_RUN = {  # by the command line, of the folder of such a run
    "run": ["run", "{run}/scenario.toml"],
    "package": ["export", "--to", "ssp", "{run}/scenario.toml", "--out", "{out}"],
    "interactive replay": ["report", "--replay", "{run}", "--interactive", "--out", "{out}"],
    "companion": ["companion", "udpout:127.0.0.1:9", "--scenario", "{run}/scenario.toml", "--timeout", "0.1"],
    "sweep": ["sweep", "{run}/scenario.toml", "--vary", "initial.position.1=0:1", "--samples", "2", "--out", "{out}"],
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("change", REFUSED, ids=str)
@pytest.mark.parametrize("fly", [lambda scenario, law, out: run_scenario(scenario, out, law=law),
                                 lambda scenario, law, out: Master(scenario, law)], ids=["run", "master"])  # fmt: skip
def test_facility_that_needs_a_built_in_law_refuses_a_custom_one(kind, change, fly, tmp_path):
    with pytest.raises(CosimError, match=r"^(commands\.enabled|record\.lyapunov) is true, expected false[^\n]*$"):
        fly(SCENARIO.replace(change), KINDS[kind](), tmp_path / "run")
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("facility", REFUSED_OF_A_RUN)
def test_verb_that_needs_a_built_in_law_refuses_a_run_of_a_custom_one(facility, tmp_path, capsys):
    run = run_scenario(SCENARIO, tmp_path / "run", report=False, law=FunctionLaw(ahead))
    words = [word.format(run=run.folder, out=tmp_path / "out") for word in REFUSED_OF_A_RUN[facility]]
    assert main(words) == 2
    error = capsys.readouterr().err
    assert error.startswith("cosim: law.name is ") and "a law in Python" in error and error.count("\n") == 1
    assert not (tmp_path / "out").exists()


# ---- plants ----


def coupled(fmi):
    return Plant(cached_fmu(make_vehicle_component(load_vehicle("odin"), {}, coupled=True), fmi))


@pytest.mark.medium
@pytest.mark.parametrize("fmi", [2, 3])
@pytest.mark.parametrize("order", ["gauss-seidel", "jacobi"])
@pytest.mark.parametrize("through", ["wrench", "thrusters"])
def test_coupled_plant_without_its_inputs_is_the_plant_bit_for_bit(fmi, order, through):
    scenario = SCENARIO.replace({"master.order": order, "actuation.through": through})
    with Master(scenario) as plain, Master(scenario, plant=coupled(fmi)) as master:
        plain.run()
        master.run()
        names = [column.name for column in plain.signals.columns]
        here = [master.signals.index(name) for name in names]
        assert np.array_equal(master.row[here], plain.row, equal_nan=True)


@pytest.mark.medium
def test_further_inputs_of_a_coupled_plant_are_the_callers_and_recorded():
    with Master(SCENARIO, FunctionLaw(lambda *_: np.zeros(6)), coupled(3)) as master:
        master.plant["load.body.force.x"] = 100.0
        rows = []
        master.run([SimpleNamespace(observe=lambda k, row: rows.append(row.copy()))])
        force, speed = (master.signals.index(name) for name in ("load.body.force.x", "velocity.u"))
    assert all(row[force] == 100.0 for row in rows)
    assert rows[-1][speed] > 0.01


class Foreign:
    """A plant of the user's, as a copy of a vehicle's channels with some changed."""

    def __init__(self, change):
        with Plant("odin") as plant:
            for kind in ("inputs", "outputs", "flags"):
                names = change.get(kind, list)(list(getattr(plant, kind).names))
                values = change.get("values", np.zeros)(len(names))
                setattr(self, kind, SimpleNamespace(names=names, values=values))

    def close(self):
        pass


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"inputs": lambda names: names[1:]}, r"plant.inputs: 'thrust\[1\]' is not the channel 1"),
        ({"inputs": lambda names: [*names[:8], "extra", *names[8:]]}, "plant.inputs: 'wrench.X' is not the channel 9"),
        ({"inputs": lambda names: []}, r"plant.inputs: 'thrust\[1\]' is not the channel 1"),
        ({"outputs": lambda names: ["extra", *names]}, "plant.outputs: 'position.x' is not the channel 1"),
        ({"outputs": lambda names: names[:-1]}, "plant.outputs: 'actuation.N' is not a channel in that order"),
        (
            {"outputs": lambda names: names[:20] + names[:19:-1]},
            "plant.outputs: 'measured.velocity.u' is not a channel",
        ),
        ({"flags": lambda names: names[::-1]}, "plant.flags: .* is not a channel in that order"),
    ],
)
def test_plant_of_other_channels_is_refused_by_the_first_that_is_missing(change, words):
    with pytest.raises(RunError, match=f"^{words}[^\n]*, expected those of vehicle 'odin'$"):
        Master(SCENARIO, plant=Foreign(change))


@pytest.mark.parametrize("values", [lambda n: np.zeros(2 * n)[::2], lambda n: np.zeros(n, np.float32)])
def test_plant_of_other_arrays_is_refused(values):
    with pytest.raises(RunError, match=r"^plant.outputs.values is .*, expected a contiguous array of float64$"):
        Master(SCENARIO, plant=Foreign({"values": values}))


@pytest.mark.parametrize("plant", [3, "odin", object()])
def test_object_that_is_no_plant_is_refused(plant):
    with pytest.raises(RunError, match=r"^plant is .* without outputs, expected a plant such as plant_fmu\.Plant$"):
        Master(SCENARIO, plant=plant)
