"""Small arrays on the stack: scratch space in functions that are translated to C, which allocate no memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def zeros(*shape: int) -> NDArray[np.float64]:
    """Return an array of zeros, which in C lasts until the calling function returns."""
    # It must not be returned, nor stored beyond the call.
    return np.zeros(shape)
