"""The normal numbers that NumPy's generator draws, as C: its state, and what a page does not compute from that."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from controller.translator.static_data import array_data

_LAYERS = 256  # of NumPy's ziggurat (Marsaglia and Tsang, The Ziggurat Method for Generating Random Variables, 2000)


def normal_numbers(seed: tuple[int, ...], n: int) -> Iterator[str]:
    """Yield the data from which C makes the first n numbers of ``numpy.random.default_rng(seed)``."""
    # Nearly every word of the generator becomes a number: a multiple of the width of a layer. Tables list words that
    # do not, since they are rejected or decide on another one, and the numbers of the tail, which are logarithms.
    generator = np.random.PCG64(seed)
    state = generator.state["state"]
    drawn = np.random.default_rng(seed).standard_normal(n)
    words = generator.random_raw(n + n // 16 + 64)
    sizes = (words >> np.uint64(9) & np.uint64(2**52 - 1)).astype(float)
    multiples = np.where(words & np.uint64(256), -sizes, sizes) * _widths()[words & np.uint64(255)]
    skipped, tail = ~np.isin(multiples, drawn), ~np.isin(drawn, multiples)
    for name, number in (("STATE", state["state"]), ("INCREMENT", state["inc"])):
        yield f"#define RANDOM_{name} WIDE({number >> 64}, {number % 2**64})"
    yield array_data(_widths(), "WIDTHS", "static const")
    used = np.flatnonzero(~skipped).max(initial=0)
    yield array_data(np.append(np.flatnonzero(skipped[:used]), -1), "SKIPPED", "static const")
    yield array_data(np.append(np.flatnonzero(tail), -1), "TAIL_INDICES", "static const")
    yield array_data(np.append(drawn[tail], 0.0), "TAIL", "static const")


def _widths() -> NDArray[np.float64]:
    """Return the width of each layer over 2^52: the number that NumPy draws one step from the middle."""
    generator, widths = np.random.SFC64(0), []
    for layer in range(_LAYERS):
        word = np.array([1 << 9 | layer, 0, 0, 0], np.uint64)  # the generator gives the first one as it is
        generator.state = generator.state | {"state": {"state": word}}
        widths.append(np.random.Generator(generator).standard_normal())
    return np.array(widths)
