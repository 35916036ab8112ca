"""Effects that engines and sensors call by their row's function: the user's own, and rows with ``apply``.

The function is the row's ``apply``, in one of two forms:

- On a sensor ``apply(effect, readings (n, k), t (n,), motion) -> readings (n, k)``, before lag, noise and rounding;
  ``motion`` is a `State` at the true times of the samples.
- On motion ``apply(effect, t, h, u, v, w, P, Q, r) -> (Fx, Fy, Fz, Mx, My, Mz)``, added to the force (N) and moment
  (N m) of the air, arguments and frame as in `discsim.aerodynamics.air_wrench`. numba compiles it.
"""

from __future__ import annotations

import inspect
import re
import traceback
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.kind import Row
from discsim.errors import InputError
from discsim.motion import State

__all__ = ["MOVED", "SENSOR_WIDTHS", "Applied", "applied_row", "compiled_wrench", "failed"]

#: sensors that such an effect may act on, and the width of their readings
SENSOR_WIDTHS = MappingProxyType({"magnetometer": 3, "accelerometer": 3, "gyroscope": 3, "gps": 6})
#: where such forces and moments move something: a table turns as commanded, and in a free spin, whose path nobody
#: knows, any moment is an unknown already
MOVED = ("flight", "spin_down")


@dataclass(frozen=True)
class Applied:
    """A row whose ``apply`` is all that is known of how it acts, and the file that it is written in."""

    row: Row
    path: Path

    @property
    def id(self) -> str:
        """Its id."""
        return self.row.id

    @property
    def function(self) -> Callable[..., Any]:
        """The row's function."""
        assert self.row.apply is not None
        return self.row.apply

    @cached_property
    def address(self) -> int:
        """Where the compiled wrench of an effect on motion starts, for `discsim.own_wrench`."""
        return int(self._native.address)

    @cached_property
    def _native(self) -> Any:
        import numba

        compiler: Any = numba
        types, carray = compiler.types, compiler.carray
        wrench, count = compiled_wrench(self), len(self.row.parameters)
        number, numbers = types.float64, types.CPointer(types.float64)

        @compiler.cfunc(types.void(numbers, *(number,) * 8, numbers))
        def native(sizes, t, h, u, v, w, P, Q, r, out):  # type: ignore[no-untyped-def]
            six = carray(out, 6)
            six[0], six[1], six[2], six[3], six[4], six[5] = wrench(carray(sizes, count), t, h, u, v, w, P, Q, r)

        return native

    def on_readings(self, values: Sequence[float], readings: FloatArray, t: FloatArray, motion: State) -> FloatArray:
        """Return a sensor's readings (n, k) with the effect of size ``values`` on them.

        Raises `InputError` where the function fails or gives something else.
        """
        effect = self.row.type(*(float(value) for value in values))
        readings, t = readings.view(), t.view()
        readings.flags.writeable = t.flags.writeable = False
        try:
            changed = np.asarray(self.function(effect, readings, t, motion), dtype=np.float64)
        except Exception as error:
            raise failed(self.path, error, f"apply() with {effect}") from None
        if changed.shape != readings.shape:
            raise InputError.at(
                self.path,
                None,
                f"apply() gave an array of shape {changed.shape}, expected that of the readings, (n, k)",
            )
        return changed


def applied_row(row: Row) -> Applied:
    """Return a row with ``apply`` ready to be called; raises `ValueError` where nothing would call it."""
    assert row.apply is not None
    if row.acts_on not in ("motion", *SENSOR_WIDTHS):
        raise ValueError(f"{row.id}: apply() acts on motion, {', '.join(SENSOR_WIDTHS)}; not on {row.acts_on}")
    if row.acts_on == "motion" and not set(row.plants) <= set(MOVED):
        raise ValueError(f"{row.id}: apply() moves something on {', '.join(MOVED)} only; not on {row.plants}")
    return Applied(row, Path(inspect.getfile(inspect.unwrap(getattr(row.apply, "py_func", row.apply)))))


def failed(path: Path, error: Exception, what: str) -> InputError:
    """Return the error of an effect's code, at the last line of the file that took part in it."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return InputError.at(path, lines[-1] if lines else None, f"{what} failed: {type(error).__name__}: {error}")


def compiled_wrench(effect: Applied) -> Callable[..., tuple[float, float, float, float, float, float]]:
    """Return a motion effect as compiled code: (values (k,) array, t, h, u, v, w, P, Q, r) to six floats.

    Raises `InputError` where numba cannot compile the function, or it gives something else.
    """
    import numba
    from numba.core.errors import NumbaError
    from numba.np.unsafe.ndarray import to_fixed_tuple

    function = effect.function
    if not hasattr(function, "py_func"):
        function = numba.njit(error_model="numpy")(function)
    kind, count = effect.row.type, len(effect.row.parameters)

    fixed: Any = to_fixed_tuple  # its second argument is only seen by the compiler

    @numba.njit(error_model="numpy")
    def wrench(
        values: FloatArray, t: float, h: float, u: float, v: float, w: float, P: float, Q: float, r: float
    ) -> tuple[float, float, float, float, float, float]:
        Fx, Fy, Fz, Mx, My, Mz = function(kind(*fixed(values, count)), t, h, u, v, w, P, Q, r)
        return float(Fx), float(Fy), float(Fz), float(Mx), float(My), float(Mz)

    try:
        wrench.compile((numba.float64[::1], *(numba.float64,) * 8))
    except NumbaError as error:
        raise _not_compiled(effect.path, str(error)) from None
    return wrench


def _not_compiled(path: Path, message: str) -> InputError:
    """Return the error for numba's message: its first line that says something, at the line it tells of the file.

    Where colorama is installed numba colours what it says.
    """
    message = re.sub(r"\x1b\[[0-9;]*m", "", message)
    said = [line.strip() for line in message.splitlines() if line.strip()]
    reason = next((line for line in said if not line.startswith("Failed in nopython")), "numba refuses it")
    line = re.search(rf'File "[^"]*{re.escape(path.name)}", line (\d+)', message)
    return InputError.at(
        path,
        int(line[1]) if line else None,
        f"apply() cannot be compiled ({reason}); expected arithmetic and functions of math on numbers, and six of "
        "them returned",
    )
