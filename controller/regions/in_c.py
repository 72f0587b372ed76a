"""The C code of the shapes, and the C sources of programs that evaluate regions."""

from __future__ import annotations

from collections.abc import Iterable
from importlib import resources

from controller.errors import RegionError
from controller.regions.kinds import FIRST_OF_ATTITUDE
from controller.regions.region_set import SHAPES, Region, name_of

_ARGUMENTS = "const Real p[3], const Real e[4], const Real q[], int size"


def c_sources() -> dict[str, bytes]:
    """Return the C files of the law and the regions, with the shapes that have C code.

    Returns
    -------
    dict of str to bytes
        Contents by name, all in one folder. The kinds of the shapes are those of Python, by name.
    """
    files = {file.name: file.read_bytes() for file in resources.files("controller").joinpath("csrc").iterdir()}
    functions = _functions()
    return {name: code for name, code in files.items() if name.endswith((".c", ".h"))} | {
        "shapes.h": _kinds(functions).encode(),
        "shape_functions.h": _dispatch(functions).encode(),
    }


def require_in_c(regions: Iterable[Region], where: str) -> None:
    """Require that the shapes of all regions have C code.

    Parameters
    ----------
    regions : iterable of Region
        Regions that C code evaluates.
    where : str
        Name of the program that evaluates them in C, such as ``"lanes"``.

    Raises
    ------
    RegionError
        The message names the first region without, and its shape.
    """
    functions = _functions()
    for region in regions:
        name = name_of(region.shape)
        if name not in functions:
            raise RegionError(
                f"region {region.name!r}: shape {name!r} has no C code, expected one of {', '.join(functions)} "
                f"in {where}"
            )


def _functions() -> dict[str, str]:
    """Return the C code of each shape that has some, by name: its file is beside the shape's own."""
    folder = resources.files("controller").joinpath("regions", "shapes")
    code = {name: folder.joinpath(f"{name}.c") for name in SHAPES}
    return {name: file.read_text(encoding="utf-8") for name, file in code.items() if file.is_file()}


def _kinds(functions: Iterable[str]) -> str:
    return "\n".join(
        [
            "/* Kinds of the shapes that have C code, as Python has them: generated. */",
            "#ifndef SHAPES_H",
            "#define SHAPES_H",
            "",
            "enum {",
            *(f"    SHAPE_{name.upper()} = {SHAPES[name].kind}," for name in functions),
            f"    SHAPES_OF_ATTITUDE = {FIRST_OF_ATTITUDE} /* from here on they depend on attitude */",
            "};",
            "",
            "#endif",
            "",
        ]
    )


def _dispatch(functions: dict[str, str]) -> str:
    cases = (f"    case SHAPE_{name.upper()}:\n        return {name}(p, e, q, size);\n" for name in functions)
    return (
        "/* The functions of the shapes: generated from the C file of each. */\n\n"
        + "\n".join(functions.values())
        + f"\nstatic Evaluation evaluate_shape(int kind, {_ARGUMENTS})\n{{\n"
        + "    const Real lost = splat(NAN);\n"
        + "    const Evaluation none = {lost, {lost, lost, lost}, lost}; /* of a kind that has no C code */\n\n"
        + "    switch (kind) {\n"
        + "".join(cases)
        + "    default:\n        return none;\n    }\n}\n"
    )
