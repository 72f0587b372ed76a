"""A free body in MuJoCo's ellipsoid model of a fluid, with the vehicle's mass and inertia: Runge-Kutta, same step."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import mujoco

_MODEL = """
<mujoco>
  <option integrator="RK4" timestep="{step!r}" density="1025" viscosity="0.0011" gravity="0 0 0"/>
  <worldbody>
    <body>
      <freejoint/>
      <inertial pos="0 0 0" mass="{mass!r}" diaginertia="{inertia}"/>
      <geom type="ellipsoid" size="0.31 0.31 0.31" fluidshape="ellipsoid" contype="0" conaffinity="0"/>
    </body>
  </worldbody>
</mujoco>
"""


def _body(setup: dict[str, Any]) -> tuple[Any, Any]:
    v = setup["vehicle"]
    inertia = " ".join(repr(v["inertia"][i][i]) for i in range(3))
    model = mujoco.MjModel.from_xml_string(_MODEL.format(step=setup["step"], mass=v["mass"], inertia=inertia))
    data = mujoco.MjData(model)
    data.xfrc_applied[1] = setup["wrench"]
    return model, data


def steps(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps, one call each, and sets forces and reads the state."""
    model, data = _body(setup)
    wrench = setup["wrench"]

    def work(count: int) -> None:
        for _ in range(count):
            data.xfrc_applied[1] = wrench
            mujoco.mj_step(model, data)
            data.qpos, data.qvel  # noqa: B018 -- views of the state

    return work


def loop(setup: dict[str, Any]) -> Callable[[int], object]:
    """Return a function that runs a given number of steps in one call."""
    model, data = _body(setup)
    return lambda count: mujoco.mj_step(model, data, nstep=count)
