"""`cosim check`: shipped scenarios, the paper's figures, and the effect of its advice."""

import json
import math
import re

import pytest

from controller import LAWS
from cosim.command_line.cli import main
from cosim.errors import ScenarioError
from cosim.precheck.angles import angle_findings
from cosim.precheck.feasibility import region_findings
from cosim.precheck.output import check_text
from cosim.precheck.precheck import check_scenario
from cosim.precheck.stability import gain_findings, start_weights, vehicle_findings
from cosim.precheck.thrust import initial_force_finding, thrust_findings
from cosim.results.water_surface import heights_above_surface
from cosim.scenario.keys import unit_of_gain
from cosim.scenario.scenario import load_scenario
from cosim.scenario.toml_file import list_scenarios

CLOSED = "arbiter.engine=closed"
MENDED = ("law.gains.sigma_p=0.0004", "law.gains.k_p1=0.05")


def named(findings):
    return {finding.name: finding for finding in findings}


def of_law(*overrides):
    scenario = load_scenario("paper", [CLOSED, *overrides])
    weights = start_weights(scenario)
    findings = [
        *vehicle_findings(scenario),
        *gain_findings(scenario, weights),
        initial_force_finding(scenario, weights),
    ]
    return named(findings)


def of_regions(*overrides):
    return named(region_findings(load_scenario("paper", [CLOSED, *overrides])))


def of_thrust(*overrides):
    return named(thrust_findings(load_scenario("paper", [CLOSED, *overrides])))


@pytest.fixture(scope="module")
def paper():
    return named(check_scenario(load_scenario("paper", [CLOSED])).findings)


EACH_SCENARIO = [name if name == "paper" else pytest.param(name, marks=pytest.mark.slow) for name in list_scenarios()]


@pytest.mark.medium
@pytest.mark.parametrize("name", EACH_SCENARIO)
def test_every_shipped_scenario_is_checkable(name):
    result = check_scenario(load_scenario(name, [CLOSED]))
    paper = {"vehicle", "law"} if result.law == "ismail_dunnigan" else set()
    assert {finding.topic for finding in result.findings} == {"regions", "thrust"} | paper
    for finding in result.findings:
        assert finding.text
        assert bool(finding.advice) == (finding.status == "fails"), finding
    assert check_text(result).splitlines()[0].startswith(result.title)


@pytest.mark.medium
def test_properties_1_to_3_and_12_are_evaluated_for_the_papers_vehicle(paper):
    assert [paper[name].status for name in ("Property 1", "Property 2", "Property 3", "(12)")] == [
        "holds", "holds", "note", "holds",
    ]  # fmt: skip
    assert paper["Property 3"].numbers["least_at_rest"] == 0.0


def test_check_uses_the_plant_parameters(paper):
    heavy = of_law("plant.parameters.mass=300", "plant.parameters.linear_damping[1]=1")
    assert heavy["(38) 1, 2"].numbers["position_need"] > 1.5 * paper["(38) 1, 2"].numbers["position_need"]
    drag = [f"plant.parameters.linear_damping[{i}]=2" for i in (1, 2, 3)]
    assert of_law(*drag)["Property 3"].status == "holds"


def test_gain_conditions_38_and_45_are_evaluated_for_the_paper(paper):
    first = paper["(38) 1, 2"]
    assert first.status == "fails"
    assert first.numbers["position_have"] == pytest.approx(0.04, abs=0.001)
    assert first.numbers["position_need"] == pytest.approx(1.2, abs=0.01)
    assert first.numbers["radius"] == pytest.approx(1.64, abs=0.005)
    assert first.numbers["attitude_need_scalar"] == pytest.approx(152.0, abs=0.1)
    assert paper["(38) 3"].status == "holds"
    second = paper["(45) 1"]
    assert second.status == "fails"
    assert second.numbers["need"] == pytest.approx(7190, rel=1e-3)
    assert (second.numbers["have"], second.numbers["have_translation"]) == (40.0, 90.0)
    assert second.numbers["radius"] == pytest.approx(0.73, abs=0.005)
    assert second.numbers["radius_translation"] == pytest.approx(1.04, abs=0.005)
    assert paper["(45) 2, 3"].status == "holds"


def test_commanded_force_at_the_papers_start(paper):
    finding = paper["initial force"]
    assert finding.status == "fails"
    assert finding.numbers["asked"] == pytest.approx(26.82e3, rel=1e-3)
    # along (2, 0, 1) / sqrt(5): the horizontal thrusters, 76.4 N to the north, end first
    assert finding.numbers["given"] == pytest.approx(4 * 27.0 / math.sqrt(2.0) * math.sqrt(5.0) / 2.0, rel=1e-4)


@pytest.mark.parametrize(
    ("finding", "key"), [("(38) 1, 2", "sigma_p"), ("(45) 1", "sigma_p"), ("initial force", "k_p1")]
)
def test_following_the_advice_satisfies_the_conditions(paper, finding, key):
    value = float(re.search(rf"law\.gains\.{key} to (?:about )?([0-9.e-]+[0-9])", paper[finding].advice)[1])
    assert of_law(f"law.gains.{key}={0.98 * value}")[finding].status == "holds"
    assert of_law(f"law.gains.{key}={1.05 * value}")[finding].status == "fails"


def test_attitude_gain_advice_satisfies_the_condition():
    heavy = of_law("law.gains.sigma_a=50")
    assert heavy["(38) 1, 2"].numbers["greatest_gradient"] == 0.0
    value = float(re.search(r"sigma_a to ([0-9.]+[0-9])", heavy["(38) 1, 2"].advice)[1])
    assert of_law(f"law.gains.sigma_a={value}", MENDED[0])["(38) 1, 2"].status == "holds"


NEAR, BOX = ["initial.position=[7.4,0,5]"], ["goal={type='box',center=[8,0,5],size=[1,1,1]}"]  # |df/dp| is 1
PLANE = ["goal={type='half_space',point=[60,0,0],normal=[-1,0,0]}", "regions=[]", "intersection=[]"]
CONTRADICTORY = [
    "regions.SR1.keep=in", "regions.SR2.keep=in", "intersection=[]", "regions.SR2.shape.center=[2,0,4.2]",
    "regions.SR3.shape.depth=20",
]  # fmt: skip
OVERWEIGHT = ["plant.current=[0.5,0.0,0.0]", "plant.parameters.weight=1400"]


@pytest.mark.medium(fast=4)
@pytest.mark.parametrize(
    ("findings", "changes", "name", "status", "words"),
    [
        (of_regions, ["regions.SR1.velocity=[0.1,0,0]"], "goal and regions", "holds", "at time 0"),
        (of_regions, ["regions=[]", "intersection=[]"], "way", "holds", "finds a way"),
        (of_law, NEAR, "(38) 1, 2", "holds", ""),
        (of_thrust, OVERWEIGHT, "holding still", "fails", "Trim"),  # the current is not to blame
        (of_law, NEAR, "(45) 1", "holds", ""),
        (of_law, BOX, "(38) 1, 2", "holds", ""),
        (of_law, BOX, "(45) 1", "holds", ""),
        (of_regions, PLANE, "way", "holds", ""),
        (of_regions, CONTRADICTORY, "regions together", "fails", "violates one by 0.700 m"),
        (of_thrust, ["plant.parameters.weight=1320"], "one thruster lost", "note", "5, 6, 7, 8"),
    ],
)
def test_status_of_a_finding_follows_the_scenario(findings, changes, name, status, words):
    found = findings(*changes)
    assert found[name].status == status and words in found[name].text + found[name].advice
    assert "goal and regions" not in found or "regions=[]" not in changes


def test_start_inside_a_hard_region_fails_and_the_advice_leads_out():
    found = of_regions("regions.SR1.shape.center=[0,0,1.2]")["start, SR1"]
    assert found.status == "fails" and found.numbers["clearance"] == pytest.approx(-0.3)
    place = re.search(r"\((.*?)\) m", found.advice)[1]
    assert [float(x) for x in place.split(",")] == pytest.approx([0.0, 0.0, 0.7], abs=0.01)


@pytest.mark.medium
def test_covered_goal_fails_and_names_the_covering_region():
    found = of_regions("regions.SR2.shape.center=[8,0,5.1]", "regions.SR2.shape.radius=0.8")
    assert found["goal and regions"].status == "fails"
    assert "SR2 alone" in found["goal and regions"].advice
    # the farthest point of the goal from SR2's center is 0.6 m away
    assert found["goal and regions"].numbers["depth"] == pytest.approx(-0.1, abs=0.01)
    relaxed = float(re.search(r"relax SR2 by ([0-9.]+) m", found["goal and regions"].advice)[1])
    assert relaxed == pytest.approx(0.2, abs=0.02)
    assert found["regions together"].status == "holds"
    assert found["way"].status == "fails"


def test_overlaps_of_keep_out_regions_are_measured(paper):
    # centers 0.4 m apart, radii 0.5 m
    assert paper["overlaps"].numbers["SR1, SR2"] == pytest.approx(0.3, abs=1e-3)
    assert "overlaps" not in of_regions("regions.SR2.shape.center=[2,0,9]", "regions.SR1.shape.center=[2,9,9]")


def test_excessive_current_fails_with_the_admissible_speed():
    found = of_thrust("plant.current=[2.0,0.0,0.0]")["holding still"]
    assert found.status == "fails"
    # 76.4 N against 48 N s2/m2
    speed = float(re.search(r"at most ([0-9.]+) m/s", found.advice)[1])
    assert speed == pytest.approx(math.sqrt(4 * 27.0 / math.sqrt(2.0) / 48.0), abs=0.06)


@pytest.mark.medium
def test_theory_conditions_apply_only_to_the_papers_law():
    changes = ("law.name=deployable", "law.gains={}", "actuation.through=thrusters")
    result = check_scenario(load_scenario("paper", [CLOSED, *changes]))
    assert result.holds
    assert {finding.topic for finding in result.findings} == {"regions", "thrust"}


@pytest.mark.medium
@pytest.mark.parametrize(
    ("vehicle", "gains", "fits"),
    [("bluerov2", "{}", False), ("bluerov2", "{k_p1=9.0}", True), ("odin", "{}", True)],
)
def test_baselines_without_gains_for_a_vehicle_fail(vehicle, gains, fits):
    changes = (f"vehicle={vehicle}", "law.name=pd", f"law.gains={gains}", "actuation.through=thrusters")
    findings = named(check_scenario(load_scenario("paper-deployable", [CLOSED, *changes])).findings)
    assert ("gains" not in findings) == fits
    assert fits or "found for odin, not for bluerov2" in findings["gains"].text


def test_attitude_regions_block_no_path_but_can_be_violated_at_the_start():
    view = (
        "{name='view',criterion='shape',keep='in',gain=1,"
        "shape={type='visibility',feature=[-9,0,1],camera_axis=[1,0,0],half_angle=0.5}}"
    )
    found = of_regions(f"regions=[{view}]", "intersection=[]")
    start = found["start, view"]
    assert start.status == "fails" and "rad" in start.text and "Turn initial.quaternion" in start.advice
    assert start.numbers["clearance"] == pytest.approx(0.5 - math.pi)
    assert "goal and regions" not in found and found["way"].status == "holds"


IN_THE_AIR = 'regions=[{name="b",criterion="depth",keep="in",gain=1,shape={type="depth_band",depth=-4,tolerance=1}}]'


@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [
        (["initial.position=[0,0,-1.5]"], "fails", "the start by 1.50 m. The plant has water everywhere"),
        (["goal.center.2=-5"], "fails", r"the goal by 4.\d0 m"),
        (["goal.then=[[8,0,5],[8,0,-3]]"], "fails", "the goal's place 3 by"),
        ([IN_THE_AIR, "intersection=[]"], "fails", r"\): b by 3.00 m. The plant has water everywhere"),
        (["initial.position=[0,0,-1.5]", "plant.parameters.free_surface=true"], "note", "the vehicle falls"),
        (["goal.center.2=-5", "plant.parameters.free_surface=true"], "fails", "the vehicle cannot stay"),
        (["initial.position=[0,0,0]"], "", ""),
        (["goal.center.2=0"], "", ""),
        ([IN_THE_AIR.replace('"in"', '"out"'), "intersection=[]"], "", ""),  # the air may be kept out of
    ],
)
def test_what_is_above_the_water_surface_is_said(changes, status, words):
    found = next(region_findings(load_scenario("paper", [CLOSED, "record.lyapunov=false", *changes])))
    assert (found.status if found.name == "water surface" else "") == status
    assert re.search(words, found.text)


def angle_keys():
    """Keys of angles and their rates: gains by the units in their comments, and one key of each other kind."""
    for law, of in LAWS.items():
        for gain in of.gains_type._fields:
            if unit_of_gain(law, gain) in ("rad", "rad/s"):
                yield "paper" if of.output != "thrusters" else "docking", f"law.gains.{gain}", [f"law.name={law}"]
    yield "pipe-inspection", "regions.view.shape.half_angle", []
    yield "docking", "regions.heading.shape.tolerance", []
    yield "docking", "plant.parameters.compass.noise", []
    yield "docking", "initial.velocity.5", ["initial.velocity=[0,0,0,0,0,0]"]
    yield "docking", "criteria.shape.membership.angle.falling.1", ["criteria.1.membership={angle={falling=[0,1]}}"]


@pytest.mark.parametrize(("name", "key", "first"), list(angle_keys()))
def test_angles_that_look_like_degrees_are_said(name, key, first):
    value = 3 if "shape.half_angle" in key or "tolerance" in key else 20
    said = [
        [finding.text for finding in angle_findings(load_scenario(name, [*first, *more]))]
        for more in ([], [f"{key}={value}"])
    ]
    assert said[0] == []
    (text,) = said[1]
    assert text.startswith(f"{key} is {value} rad") and f"write {math.radians(value):.4g}" in text


@pytest.mark.parametrize("value", [3, 30])
def test_refused_angles_are_said_in_radians(value):
    cone = f'{{type="cone",feature=[2,0,2],axis=[-1,0,0],half_angle={value},range=3}}'
    with pytest.raises(
        ScenarioError, match=f"half_angle is {value}.*{value} degrees are {math.radians(value):.4g} rad"
    ):
        load_scenario("paper", [f"regions.SR1.shape={cone}"])


@pytest.mark.parametrize("name", list_scenarios())
def test_shipped_scenarios_have_no_doubtful_angles_or_heights(name):
    scenario = load_scenario(name)
    assert not list(angle_findings(scenario)) and not list(heights_above_surface(scenario))


@pytest.mark.medium
@pytest.mark.parametrize(
    ("changes", "status", "words"),
    [((), 1, ("Verdict: 3 of 15 fail", "within 1.64 m", "26.82 kN")), (MENDED, 0, ("nothing is wrong with this",))],
)
def test_check_prints_its_verdict_and_exits_with_1_if_anything_fails(capsys, changes, status, words):
    assert main(["check", "paper", *(word for change in (CLOSED, *changes) for word in ("--set", change))]) == status
    said = capsys.readouterr().out
    assert all(one in said for one in words)


@pytest.mark.slow
def test_check_command_prints_json(capsys):
    assert main(["check", "paper", "--set", CLOSED, "--set", "law.gains.sigma_p=0", "--json"]) == 1
    result = json.loads(capsys.readouterr().out)
    assert result["holds"] is False and result["law"] == "ismail_dunnigan"
    by_name = {finding["name"]: finding for finding in result["findings"]}
    assert by_name["(38) 1, 2"]["numbers"]["greatest_gradient"] is None  # everywhere
    assert by_name["(38) 1, 2"].keys() == {"topic", "name", "status", "text", "advice", "numbers"}


def test_undriven_pitch_is_named_with_what_holds_it():
    through = "vehicle=bluerov2", "actuation.through=thrusters"
    finding = of_thrust(*through)["undriven axes"]
    assert finding.status == "holds" and "do not drive pitch: a righting moment of 11.2 N m" in finding.text
    assert of_thrust(*through, "plant.parameters.r_B.z=0.1")["undriven axes"].status == "fails"
