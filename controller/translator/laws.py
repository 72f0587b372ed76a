"""A law as a C file: its step, and what it begins with."""

from __future__ import annotations

import numpy as np

from controller.law import CompiledLaw, VehicleState
from controller.regions.region_set import PackedRegions
from controller.translator.program import Program
from controller.translator.static_data import static_data
from controller.translator.types import type_of


def translate_law(
    law: CompiledLaw, goal: PackedRegions, regions: PackedRegions, n_thrusters: int, name: str = "law"
) -> str:
    """Translate a law into one file of C99 without heap.

    Parameters
    ----------
    law : CompiledLaw
        With its gains, and its memory as it is now.
    goal : PackedRegions
        The goal region alone.
    regions : PackedRegions
        The secondary regions, as many as the law was made for.
    n_thrusters : int
        Of the vehicle: entries of the health that is measured, and of forces where the law gives them.
    name : str, optional
        Of the function ``void name(const void *)`` and of ``name_data``, its arguments in static memory: before each
        call write what is measured into them, and read the forces from the last one after it.

    Returns
    -------
    str
        C. Its bits are those of Python under ``-ffp-contract=off``.

    Raises
    ------
    TranslationError
        If the law is written in Python that is not translated; with file and line.

    Examples
    --------
    >>> from controller import Gains, IsmailDunniganLaw, translate_law
    >>> from controller.regions import Region, Sphere, pack
    >>> goal = pack([Region("goal", Sphere((5.0, 0.0, 2.0), 0.5), "in")])
    >>> rocks = pack([Region("rock", Sphere((2.0, 0.0, 2.0), 0.5), "out")])
    >>> law = IsmailDunniganLaw(Gains(), desired_quaternion=[1.0, 0.0, 0.0, 0.0], period=0.02, n_regions=1)
    >>> code = translate_law(law, goal, rocks, n_thrusters=8)
    >>> code.count("static law_arguments law_data")
    1
    """
    state = VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), np.ones(n_thrusters))
    forces = np.zeros(n_thrusters if law.output == "thrusters" else 6)
    arguments = (state, goal, regions, np.ones(regions.kinds.size), law.gains, law.plain_memory, forces)
    program = Program()
    program.export(name, type(law).function, tuple(map(type_of, arguments)))
    return f"{program.text()}\n{static_data(program, name, arguments)}"
