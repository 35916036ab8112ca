"""Forces and moments of effects with a function of their own, called by address from compiled code.

A function passed as an argument would compile every integrator anew for it; an address is a number, and the compiled
engines stay what they are.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from discsim.arrays import FloatArray
from discsim.compiled import compiled

__all__ = ["own_wrench"]


@intrinsic
def _call(
    context: Any, address: Any, sizes: Any, t: Any, h: Any, u: Any, v: Any, w: Any, P: Any, Q: Any, r: Any, out: Any
) -> Any:
    """Call ``void (double *sizes, double t, h, u, v, w, P, Q, r, double *out)`` at an address."""
    number = types.float64
    signature = types.void(types.int64, types.intp, *(number,) * 8, types.intp)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        double = ir.DoubleType()
        kind = ir.FunctionType(ir.VoidType(), [double.as_pointer(), *(double,) * 8, double.as_pointer()])
        function = builder.inttoptr(arguments[0], kind.as_pointer())
        sizes = builder.inttoptr(arguments[1], double.as_pointer())
        out = builder.inttoptr(arguments[10], double.as_pointer())
        builder.call(function, [sizes, *arguments[2:10], out])
        return context.get_dummy_value()

    return signature, generate


_called: Any = _call  # the context is the compiler's business


@compiled
def own_wrench(
    calls: Any, sizes: FloatArray, t: float, h: float, u: float, v: float, w: float, P: float, Q: float, r: float
) -> tuple[float, float, float, float, float, float]:
    """Force (N) and moment (N m) of effects that are called, to be added to those of the air; as for ``air_wrench``.

    ``calls`` (m,) are their addresses, ``sizes`` (m, k) their parameters. NaN where one fails.
    """
    total, one = np.zeros(6), np.empty(6)
    for i in range(calls.size):
        one[:] = np.nan
        _called(calls[i], sizes[i].ctypes.data, t, h, u, v, w, P, Q, r, one.ctypes.data)
        total += one
    return total[0], total[1], total[2], total[3], total[4], total[5]
