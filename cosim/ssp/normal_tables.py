"""Noise in C: the layers of a ziggurat under the normal density, and the initial state of NumPy's generator."""

# The method is that of Marsaglia and Tsang, The Ziggurat Method for Generating Random Variables (2000), with 256 layers
# as in NumPy.

from __future__ import annotations

import math

import numpy as np

OUTERMOST = 3.6541528853610088  # abscissa at which the tail begins
_LAYERS = 256  # number of layers
_STEPS = 2.0**52  # number of steps into which the generator divides a layer's width
_FACTOR = 2549297995355413924 << 64 | 4865540595714422341  # multiplier of PCG's linear congruential generator
_SIZE = 2**128  # modulus of its state


def ziggurat() -> str:
    """Return the C header with the layers: ``WIDTHS``, ``INNER`` and ``HEIGHTS``."""
    # NumPy rounds its widths in another way, so that their last bits differ from a computation here: the widths are
    # read from its generator. The other two only decide whether a number is accepted.
    density, x = math.exp(-0.5 * OUTERMOST**2), OUTERMOST
    area = OUTERMOST * density + math.sqrt(math.pi / 2.0) * math.erfc(OUTERMOST / math.sqrt(2.0))
    edges = [x]
    for _ in range(_LAYERS - 2):  # inwards, each layer with the same area
        x = math.sqrt(-2.0 * math.log(area / x + math.exp(-0.5 * x * x)))
        edges.append(x)
    edges.append(0.0)  # edge of the top layer
    edges.reverse()
    base = area / density  # width of a rectangle as large as the lowest layer with its tail
    inner = [OUTERMOST / base, *(a / b for a, b in zip(edges, edges[1:], strict=False))]
    heights = [math.exp(-0.5 * edge * edge) for edge in edges]
    return "\n".join([
        "/* Layers of a ziggurat under exp(-x^2 / 2): generated. */",
        "#include <stdint.h>",
        f"#define OUTERMOST {OUTERMOST!r}",
        f"static const double WIDTHS[] = {{{', '.join(map(repr, _widths()))}}};",
        f"static const uint64_t INNER[] = {{{', '.join(f'UINT64_C({int(i * _STEPS)})' for i in inner)}}};",
        f"static const double HEIGHTS[] = {{{', '.join(map(repr, heights))}}};",
        "",
    ])  # fmt: skip


def _widths() -> list[float]:
    """Return the width of each of NumPy's layers over 2^52: the number that it draws one step from the middle."""
    generator, widths = np.random.PCG64(0), []
    state = generator.state
    back, increment = pow(_FACTOR, -1, _SIZE), state["state"]["inc"]
    for layer in range(_LAYERS):
        word = 1 << 9 | layer  # one step, above 0; with an upper half of 0 the generator gives the lower one as it is
        generator.state = state | {"state": {"state": (word - increment) * back % _SIZE, "inc": increment}}
        widths.append(float(np.random.Generator(generator).standard_normal()))
    return widths


def generator_state(*seed: int) -> tuple[int, int, int, int]:
    """Return the state of ``numpy.random.default_rng(seed)``: state and increment, the upper half of each first."""
    state = np.random.default_rng(seed).bit_generator.state["state"]
    low = 2**64 - 1
    return state["state"] >> 64, state["state"] & low, state["inc"] >> 64, state["inc"] & low
