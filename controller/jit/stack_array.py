"""Small arrays on the stack: room for a few numbers in compiled code, for which no memory is asked."""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing import templates
from numba.extending import lower_builtin
from numba.np import arrayobj
from numpy.typing import NDArray

# what Numba says no types of
_types: Any = types
_templates: Any = templates
_cgutils: Any = cgutils
_arrayobj: Any = arrayobj
_lower: Any = lower_builtin


def zeros(*shape: int) -> NDArray[np.float64]:
    """Return an array of zeros, which in compiled code lasts until the function that asked for it returns.

    A `jit_noalloc` function may make it. It must not be returned, nor kept in what outlasts the call.

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


@_templates.infer_global(zeros)
class _Zeros(_templates.AbstractTemplate):  # type: ignore[misc]
    """What `zeros` returns, where its shape is known."""

    def generic(self, args: Any, kws: Any) -> Any:
        if not args or kws or not all(isinstance(n, types.IntegerLiteral) for n in args):
            return None
        return _templates.signature(_types.Array(types.float64, len(args), "C"), *args)


def _lowered(context: Any, builder: Any, sig: Any, _args: Any) -> Any:
    """Make the array where the function begins, and its zeros each time it is asked for."""
    shape = tuple(n.literal_value for n in sig.args)
    room = ir.ArrayType(ir.DoubleType(), int(np.prod(shape)))
    place = _cgutils.alloca_once(builder, room)
    builder.store(ir.Constant(room, None), place)
    array = _arrayobj.make_array(sig.return_type)(context, builder)
    sizes = [context.get_constant(types.intp, n) for n in shape]
    strides = [context.get_constant(types.intp, n) for n in np.empty(shape).strides]
    data = builder.bitcast(place, array.data.type)
    item = context.get_constant(types.intp, 8)
    _arrayobj.populate_array(array, data=data, shape=sizes, strides=strides, itemsize=item, meminfo=None)
    return array._getvalue()


_lower(zeros, _types.VarArg(types.Any))(_lowered)
