"""Evaluate a packed shape by the number of its kind."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from controller.regions.shapes import ENTRIES
from controller.regions.shapes.depth_band import DepthBand
from controller.regions.shapes.sphere import Sphere
from controller.translator.generated import functions_of

SPHERE, DEPTH_BAND = Sphere.kind, DepthBand.kind
FLAT = tuple(entry.shape.kind for entry in ENTRIES.values() if entry.flat_faces)  # kinds with flat faces
CONVEX = tuple(entry.shape.kind for entry in ENTRIES.values() if entry.convex)
KINKED_INSIDE = tuple(entry.shape.kind for entry in ENTRIES.values() if entry.kinks != "nowhere")
KINKED_OUTSIDE = tuple(entry.shape.kind for entry in ENTRIES.values() if entry.kinks == "everywhere")
FIRST_OF_ATTITUDE = sum(not entry.of_attitude for entry in ENTRIES.values())  # kinds from it on depend on attitude


def _by_kind(name: str, arguments: str, of_attitude: bool) -> Callable[..., Any]:
    """Return a function that evaluates the shape of a kind, its first argument, at the `arguments`."""
    # C has no table of functions that take tuples, so the function is generated: a choice by the number of the kind.
    entries = {kind: entry for kind, entry in ENTRIES.items() if entry.of_attitude == of_attitude}
    names: dict[str, Any] = {f"_{kind}": entry.evaluate for kind, entry in entries.items()}
    choices = [f"    if kind == {entry.shape.kind}: return _{kind}({arguments})\n" for kind, entry in entries.items()]
    last = f"    return _{list(entries)[-1]}({arguments})\n"  # no other kinds are possible: `pack` accepts shapes only
    source = f"def {name}(kind, {arguments}):\n{''.join(choices[:-1])}{last}"
    made: Callable[..., Any] = functions_of(source, names | {"__name__": __name__})[name]
    return made


# evaluate a packed shape of position alone, at the position `p` [m, NED]
evaluate_shape = _by_kind("evaluate_shape", "p, q", of_attitude=False)

# evaluate a packed shape of attitude, at the position `p` [m, NED] and the attitude `e`
evaluate_shape_of_attitude = _by_kind("evaluate_shape_of_attitude", "p, e, q", of_attitude=True)
