"""Export a law as a C file: its step function, and its data at the start."""

from __future__ import annotations

import numpy as np

from controller.errors import LawError
from controller.law import CompiledLaw, VehicleState
from controller.regions.region_set import PackedRegions
from controller.translator.program import Program
from controller.translator.static_data import static_data
from controller.translator.types import type_of


def translate_law(law: CompiledLaw, goal: PackedRegions, regions: PackedRegions, name: str = "law") -> str:
    """Translate a law into one file of C99 without heap.

    Parameters
    ----------
    law : CompiledLaw
        Law with its gains, and its memory as it is now.
    goal : PackedRegions
        The goal region alone.
    regions : PackedRegions
        The secondary regions, as many as the law was made for.
    name : str, optional
        Name of the function ``void name(const void *)``; ``name_data`` are its arguments in static memory: before each
        call write the measurements into them, and read the forces from the last one after it.

    Returns
    -------
    str
        C text, whose results are Python's to the last bit under ``-ffp-contract=off``.

    Raises
    ------
    LawError
        If it is a custom law in plain Python, or made for another number of regions.
    TranslationError
        If the law uses Python that is not translated; the message names file and line.

    Examples
    --------
    >>> from controller import Gains, IsmailDunniganLaw, translate_law
    >>> from controller.regions import Region, Sphere, pack
    >>> goal = pack([Region("goal", Sphere((5.0, 0.0, 2.0), 0.5), "in")])
    >>> rocks = pack([Region("rock", Sphere((2.0, 0.0, 2.0), 0.5), "out")])
    >>> law = IsmailDunniganLaw(Gains(), desired_quaternion=[1.0, 0.0, 0.0, 0.0], period=0.02, n_regions=1)
    >>> code = translate_law(law, goal, rocks)
    >>> code.count("static law_arguments law_data")
    1
    """
    if not isinstance(law, CompiledLaw):
        raise LawError(f"law is of type {type(law).__name__}, expected one of controller.LAWS, compiled")
    n = regions.kinds.size
    if n != law.n_regions or goal.kinds.size != 1:
        raise LawError(f"{goal.kinds.size} goals and {n} regions, expected 1 and the {law.n_regions} of the law")
    health = np.ones(law.n_forces if law.output == "thrusters" else 0)
    state = VehicleState(np.zeros(3), np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(6), health)
    arguments = (state, goal, regions, np.ones(n), law.gains, law.memory, np.zeros(law.n_forces))
    program = Program()
    program.export(name, type(law).function, tuple(map(type_of, arguments)))
    return f"{program.text()}\n{static_data(program, name, arguments)}"
