"""FMUs beside the plant for tests, and the paper's scenario with them."""

import functools

from cosim import load_scenario
from tests.foreign_fmu import MODES, build_foreign_fmu

TIMES = ["time.duration=3", "time.step=0.01", "time.control=0.01", "time.arbiter=0.01", "arbiter.engine=closed"]
POSITION, FORCE = ([f"{name}.{axis}" for axis in "xyz"] for name in ("position", "load.world.force"))
CURRENT = ["current_input.x", "current_input.y"]
UNITS = dict.fromkeys(POSITION, "m") | dict.fromkeys(FORCE, "N") | dict.fromkeys(CURRENT, "m/s")


def numbered(names, first):
    return {name: first + i for i, name in enumerate(names)}


def build_fmu(folder, fmi, name, **names):
    build_foreign_fmu(folder / f"{name}{fmi}.fmu", fmi, **names)


def short(names):
    """Return other names for variables, such as ``force_x``."""
    return [name.rpartition("world.")[2].replace(".", "_") for name in names]


def build_components(folder):
    """Build tethers, currents and gains: with names of their own, and with those of signals."""
    for fmi in (2, 3):
        build = functools.partial(build_fmu, folder, fmi)
        build("tether", inputs=numbered(POSITION, 10), outputs=numbered(FORCE, 20), units=tuple(UNITS.items()))
        build("line", inputs=numbered(short(POSITION), 10), outputs=numbered(short(FORCE), 20))
        build("current", inputs={"position.z": 10}, outputs=numbered(CURRENT, 20), units=tuple(UNITS.items()))
        build("gain", inputs={"u": 10}, outputs={"y": 20}, units=(("u", "m"), ("y", "m")))


def beside(fmus, fmi, *names, changes=(), **maps):
    """Return the paper's scenario with components, which have the names and modes of their files."""
    table = {
        "tether": {"mode": MODES.index("tether"), "gain": 200.0},
        "line": {"mode": MODES.index("tether"), "gain": 200.0},
        "current": {"mode": MODES.index("current"), "gain": 0.3},
    }
    entries = []
    for name in names:
        file, _, own = name.partition(":")
        entry = {"name": own or file, "file": str(fmus / f"{file}{fmi}.fmu"), "parameters": table.get(file, {})}
        entries.append(entry | maps.get(own or file, {}))
    scenario = load_scenario("paper", [*TIMES, "law.name=pd", *changes])
    return scenario.replace({"components": entries})
