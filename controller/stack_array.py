"""Small arrays on the stack: room for a few numbers in functions that are translated to C, which ask for no memory."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def zeros(*shape: int) -> NDArray[np.float64]:
    """Return an array of zeros, which in C lasts until the function that asked for it returns.

    It must not be returned, nor kept in what outlasts the call.

    Parameters
    ----------
    *shape : int
        Written as numbers, such as ``zeros(3, 3)``; some dozen elements at most.

    Returns
    -------
    ndarray
        Of float64, in C order.
    """
    return np.zeros(shape)
