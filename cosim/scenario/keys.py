"""Meanings and units of a scenario's keys: for the reference, and for comments in a scenario's file."""

from __future__ import annotations

import functools
import inspect
import re
from typing import NamedTuple

from controller import LAWS
from controller.regions.shapes import ENTRIES
from plant_fmu.variables import variables
from plant_fmu.vehicle import Vehicle


class Key(NamedTuple):
    """Unit and meaning of a key, in Markdown."""

    unit: str
    meaning: str  # meaning in a few words
    more: str = ""  # addition for the reference
    default: str = ""  # default in words, unless the tables have it as a value


# keys by their path; regions[] means each region
KEYS = {
    "vehicle": Key("", "a shipped vehicle, or a TOML file beside the file that names it", " (with `--set`: here)"),
    "title": Key("", "one line for the report, at most 200 characters", default="the name"),
    "changed": Key(
        "",
        "keys that were changed since the title was written",
        ", see [below](#titles); runs write it into their folder",
        default="none",
    ),
    "log": Key(
        "", "name of the log that a run was imported from",
        "; `cosim import` writes it into the run folder, and no scenario with it can be run", default="none",
    ),
    "compare": Key("", '`"paper"` puts the paper\'s claims beside the run'),
    "intersection": Key("", "names of the regions, to be kept out of, whose overlap is reported", default="all"),
    "report_failures": Key("", "law and allocation are informed when a thruster fails"),
    "time.duration": Key("s", "duration of the run"),
    "time.step": Key("s", "co-simulation step; the other periods are whole multiples"),
    "time.control": Key("s", "period of the law", default="the step"),
    "time.arbiter": Key("s", "period of the arbiter", default="the step"),
    "plant.fmi": Key("", "FMI version of the plant, 2 or 3"),
    "plant.current": Key("m/s", "velocity of the water, north east down"),
    "plant.substep": Key("s", "greatest integration step"),
    "plant.parameters": Key(
        "", "parameters of the FMU over those of the vehicle, such as `mass` or `r_G.z`", "; not for the law"
    ),
    "initial.position": Key("m", "position at time 0, north east down"),
    "initial.quaternion": Key("", "attitude at time 0, body to world, scalar first"),
    "initial.velocity": Key("m/s, rad/s", "velocity at time 0, body frame"),
    "goal": Key("", "a shape in space: the primary region", ", see below"),
    "goal.velocity": Key("m/s", "velocity of the goal, north east down", "; as `regions[].velocity`", default="0 0 0"),
    "goal.streamed": Key("", "moved from outside during the run", "; as `regions[].streamed`", default="false"),
    "goal.then": Key("m", "next centres of the goal in turn, north east down", ", below", default="none"),
    "goal.stay": Key("s", "time within the goal before the goal moves to its next place", default="5"),
    "law.name": Key(
        "", "one of `controller.LAWS`",
        "; naming another one than the base drops the base's gains. In the folder of a run that "
        "[a law of one's own](howto/own-law.md) flew: where that is from, such as `mine.py:steer`",
    ),
    "law.desired_quaternion": Key("", "attitude to be kept, body to world, scalar first"),
    "law.gains": Key(
        "", "gains of that law", "; the paper's law, section VII: `k_p1 k_p2 k_q k_v1 k_v2 sigma_p sigma_a gamma`",
        default="the law's own",
    ),
    "arbiter.engine": Key("", "`closed`, `exact`, `grid` or `skfuzzy`", "; see [arbiter.md](arbiter.md#engines)"),
    "arbiter.ramp": Key("m", "width over which a membership falls outside its region; rad for regions of attitude"),
    "arbiter.points": Key("", "samples of the output universe, for `grid` and `skfuzzy`"),
    "arbiter.rules": Key(
        "", "`ordered`: by the criteria's order; `reversed`, `crisp`, `none`: to compare with",
        ", see [criteria.md](criteria.md#to-compare-with); not beside a file",
    ),
    "arbiter.file": Key(
        "", "rules of one's own, beside the file that names it",
        ": any format of [fuzzy_arbiter](arbiter.md#formats), see [criteria.md](criteria.md#your-own-rules)",
    ),
    "arbiter.text": Key("", "content of that file", "; runs write it into their folder"),
    "arbiter.inputs": Key("", "signal for each input of these rules", default="none"),
    "criteria": Key(
        "", "reasons for which regions ask for attention", ", see [criteria.md](criteria.md)",
        default="the paper's three",
    ),
    "criteria[].name": Key("", "unique name: a letter, then at most 23 letters, digits and _"),
    "criteria[].order": Key("", "priority: the least comes first", default="its place in the list"),
    "criteria[].colour": Key("", "colour in figures and pages, `#RRGGBB`", default="one that no other has"),
    "criteria[].membership": Key(
        "", "memberships by `ramp`, `clearance`, `angle`, `approach_time`; the greatest counts",
        default="`arbiter.ramp`",
    ),
    "limit.force": Key(
        "N", "limit on the norm of the direct body force", "; direction kept, moment left alone; not with thrusters"
    ),
    "limit.time_constant": Key("s", "lag behind that limit"),
    "actuation.through": Key(
        "", "`wrench` on the body, or `thrusters`",
        ": through the allocation, or set by a law that drives thrusters",
    ),
    "actuation.limits": Key("", "`direction` scales all thrusters together, `per-thruster` cuts each"),
    "sensing.through": Key(
        "", "`state`, with noise on position and velocity, or `sensors`",
        ": what the navigation filter makes of them, see [navigation.md](navigation.md)",
    ),
    "sensing.position_noise": Key("m", "standard deviation of each measured coordinate"),
    "sensing.velocity_noise": Key("m/s", "standard deviation of each measured linear velocity, body frame"),
    "sensing.seed": Key("", "seed of the noise"),
    "sensing.dead_from": Key("s", "time at which measured position and linear velocity are lost"),
    "sensing.dead_for": Key("s", "duration of that loss"),
    "sensing.frozen": Key("", "the last values are held during that loss, instead of NaN"),
    "master.order": Key(
        "", "`gauss-seidel`, or `jacobi`: each part uses the outputs of the step before",
        ", see [The order of a step](#the-order-of-a-step)",
    ),
    "record.lyapunov": Key(
        "", "record V of (31) and its rate, with the paper's law",
        ", in three forms; see [theory.md](theory.md#where-the-theory-holds)",
    ),
    "commands.enabled": Key(
        "", "the running vehicle takes [commands](mavlink.md) from outside", "; `cosim run --commands` sets it"
    ),
    "commands.await_arm": Key("", "nothing moves before it is armed", "; `--await-arm` sets it"),
    "commands.obstacles": Key("", "greatest number of obstacles that commands add during the run, up to 100"),
    "commands.obstacle_radius": Key("m", "radius of an obstacle whose size is not given"),
    "commands.obstacle_gain": Key("N", "gain of each obstacle, per unit of g"),
    "commands.hold_radius": Key("m", "radius of the target sphere in modes hold and surface"),
    "commands.surface_depth": Key("m", "depth of that sphere's centre in mode surface"),
    "commands.pilot_gain": Key("", "part of the greatest wrench along an axis that a full stick commands"),
    "failures": Key("", "thrusters that fail; only where `thrusters` carry the wrench", default="none"),
    "failures[].thruster": Key("", "number of the thruster, from 1"),
    "failures[].time": Key("s", "time of the failure"),
    "failures[].effectiveness": Key("", "part of its force that remains, 0 to 1"),
    "failures[].stuck": Key("", "it keeps the force that was commanded last"),
    "outages": Key("", "times in which a sensor gives no samples; where sensing is through `sensors`", default="none"),
    "outages[].sensor": Key("", "`depth_sensor`, `dvl`, `imu`, `compass` or `usbl`"),
    "outages[].time": Key("s", "beginning of the outage"),
    "outages[].duration": Key("s", "duration of the outage"),
    "regions": Key("", "secondary regions", default="none"),
    "regions[].name": Key("", "unique name: letters, digits, blanks, - and _"),
    "regions[].criterion": Key("", "name of the criterion", " whose weight multiplies the gain"),
    "regions[].keep": Key("", "`in` or `out`"),
    "regions[].gain": Key("", "alpha of section VII"),
    "regions[].shape": Key("", "a shape", ", below"),
    "regions[].velocity": Key("m/s", "velocity, north east down; the law receives it"),
    "regions[].streamed": Key("", "moved from outside during the run", ", below"),
    "regions[].deviation": Key(
        "m", "standard deviation of its place, or three: north, east, down", ": margins of the deployable law grow"
    ),
    "regions[].priority": Key(
        "", "factor of its violation in the score", " `weighted_violation`; neither arbiter nor law receives it"
    ),
    "regions[].hard": Key(
        "", "must not be violated", "; the paper's law and laws of plain potentials do not use it"
    ),
}  # fmt: skip

_GAIN = re.compile(r"^ +(\w+): float = [^#\n]*# (.*)$", re.M)
_UNIT = re.compile(
    r"(?:1|N|kg|m|rad|s)\d?(?:[ /(]+(?:N|kg|m|rad|sqrt\(s\)|s)\d?\)?)*(?=[,: ]|$)"
)  # at the head of a comment
_LINK = re.compile(r"\[([^]]*)\]\([^)]*\)")


def unit_of_shape(kind: str, key: str) -> str:
    """Return the unit of a key of a shape."""
    return ENTRIES[kind].units.get(key, "") if kind in ENTRIES else ""


def comments(law: str, vehicle: Vehicle) -> dict[str, str]:
    """Return the comment for each key of a file: its unit and its meaning, as plain text."""
    said = {path: _comment(key.unit, _LINK.sub(r"\1", key.meaning).replace("`", "")) for path, key in KEYS.items()}
    said |= {f"law.gains.{gain}": text for gain, text in _gain_comments(law).items()}
    return said | {f"plant.parameters.{v.name}": _comment(v.quantity.unit, v.description) for v in variables(vehicle)}


@functools.cache
def unit_of_gain(law: str, gain: str) -> str:
    """Return the unit of a gain of a law."""
    unit = _UNIT.match(_gain_comments(law).get(gain, ""))
    return unit[0] if unit else ""


def _comment(unit: str, meaning: str) -> str:
    return ", ".join(filter(None, (unit, meaning)))


def _gain_comments(law: str) -> dict[str, str]:
    try:
        return dict(_GAIN.findall(inspect.getsource(LAWS[law].gains_type)))
    except (KeyError, OSError):  # a custom law, or no source
        return {}
