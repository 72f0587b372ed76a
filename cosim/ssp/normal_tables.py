"""Noise in C: the layers of a ziggurat under the normal density, and the initial state of NumPy's generator.

The method is that of Marsaglia and Tsang, The Ziggurat Method for Generating Random Variables (2000), with 256 layers
as in NumPy.
"""

from __future__ import annotations

import math

import numpy as np

_OUTERMOST = 3.6541528853610088  # abscissa at which the tail begins
_LAYERS = 256
_STEPS = 2.0**52  # of a layer's width


def ziggurat() -> str:
    """Return the C header with the layers: ``WIDTHS``, ``INNER`` and ``HEIGHTS``."""
    density, x = math.exp(-0.5 * _OUTERMOST**2), _OUTERMOST
    area = _OUTERMOST * density + math.sqrt(math.pi / 2.0) * math.erfc(_OUTERMOST / math.sqrt(2.0))
    edges = [x]
    for _ in range(_LAYERS - 2):  # inwards, each layer with the same area
        x = math.sqrt(-2.0 * math.log(area / x + math.exp(-0.5 * x * x)))
        edges.append(x)
    edges.append(0.0)  # of the top
    edges.reverse()
    base = area / density  # width of a rectangle as large as the lowest layer with its tail
    widths = [base, *edges[1:]]
    inner = [_OUTERMOST / base, *(a / b for a, b in zip(edges, edges[1:], strict=False))]
    heights = [math.exp(-0.5 * edge * edge) for edge in edges]
    return "\n".join([
        "/* Layers of a ziggurat under exp(-x^2 / 2): generated. */",
        "#include <stdint.h>",
        f"#define OUTERMOST {_OUTERMOST!r}",
        f"static const double WIDTHS[] = {{{', '.join(repr(w / _STEPS) for w in widths)}}};",
        f"static const uint64_t INNER[] = {{{', '.join(f'UINT64_C({int(i * _STEPS)})' for i in inner)}}};",
        f"static const double HEIGHTS[] = {{{', '.join(map(repr, heights))}}};",
        "",
    ])  # fmt: skip


def generator_state(*seed: int) -> tuple[int, int, int, int]:
    """Return the state of ``numpy.random.default_rng(seed)``: state and increment, the upper half of each first."""
    state = np.random.default_rng(seed).bit_generator.state["state"]
    low = 2**64 - 1
    return state["state"] >> 64, state["state"] & low, state["inc"] >> 64, state["inc"] & low
