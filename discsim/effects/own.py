"""Effects of the user's own: one Python file each, checked when it is read. They compete with the catalogue's and fly.

What such a file holds is told in docs/diagnosing.md. A file is code and runs as such: only files of one's own.
"""

from __future__ import annotations

import re
import traceback
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from pathlib import Path
from types import MappingProxyType, ModuleType
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.catalogue import CATALOGUE, Effect, Row
from discsim.errors import InputError
from discsim.files import read_text
from discsim.frames import turn
from discsim.motion import State
from discsim.recording import PLANTS

__all__ = ["SENSOR_WIDTHS", "UserEffect", "compiled_wrench", "load_user_effect", "load_user_effects"]

#: sensors that a user's effect may act on, and the width of their readings
SENSOR_WIDTHS = MappingProxyType({"magnetometer": 3, "accelerometer": 3, "gyroscope": 3, "gps": 6})
_ACTS_ON = (*SENSOR_WIDTHS, "motion")
#: where forces and moments of one's own move something: a table turns as commanded, and in a free spin, whose path
#: nobody knows, any moment is an unknown already
_MOVED = ("flight", "spin_down")
#: what a file must define beside its type
_NEEDED = ("ID", "ACTS_ON", "SCALE", "apply")
_ID = re.compile(r"[a-z][a-z0-9_]*\.[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class UserEffect:
    """An effect of the user's own.

    Attributes
    ----------
    row : Row
        What the catalogue says of an effect; ``acts_on`` is a sensor of `SENSOR_WIDTHS` or "motion".
    function : callable
        On a sensor ``apply(effect, readings (n, k), t (n,), motion) -> readings (n, k)``, before lag, noise and
        rounding; ``motion`` is a `State` at the true times of the samples. On motion ``apply(effect, t, h, u, v, w,
        P, Q, r) -> (Fx, Fy, Fz, Mx, My, Mz)``, added to the force (N) and moment (N m) of the air, arguments and
        frame as in `discsim.aerodynamics.air_wrench`; see `compiled_wrench`.
    text : str
        First line of the type's docstring.
    path : Path
        The file.
    """

    row: Row
    function: Callable[..., Any]
    text: str
    path: Path

    @property
    def id(self) -> str:
        """Its id."""
        return self.row.id

    def sized(self, sizes: Mapping[str, float]) -> Effect:
        """Return the effect with its parameters, those left out as they do nothing; raises `InputError`."""
        for name in sizes:
            if name not in self.row.parameters:
                raise InputError(f"{self.id}: unknown parameter '{name}'; expected {', '.join(self.row.parameters)}")
        return Effect(self.id, self.row.type(**{name: float(size) for name, size in sizes.items()}), self)

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
            raise _failed(self.path, error, f"apply() with {effect}") from None
        if changed.shape != readings.shape:
            raise InputError.at(
                self.path,
                None,
                f"apply() gave an array of shape {changed.shape}, expected that of the readings, (n, k)",
            )
        return changed


def load_user_effects(paths: Sequence[Path]) -> list[UserEffect]:
    """Return the effects of the files; raises `InputError` where two have one id."""
    effects: dict[str, UserEffect] = {}
    for path in paths:
        effect = load_user_effect(path)
        if effect.id in effects:
            raise InputError.at(path, None, f"ID '{effect.id}' is also that of {effects[effect.id].path}")
        effects[effect.id] = effect
    return list(effects.values())


def load_user_effect(path: Path) -> UserEffect:
    """Return the effect that a Python file defines; raises `InputError` naming file, line and what was expected."""
    module = _run(path)
    found = vars(module)
    if missing := [name for name in _NEEDED if name not in found]:
        raise InputError.at(path, None, f"defines no {', '.join(missing)}; expected {', '.join(_NEEDED)}")
    kind = _parameter_type(path, module)
    id, acts_on, function = found["ID"], found["ACTS_ON"], found["apply"]
    if not isinstance(id, str) or not _ID.fullmatch(id):
        raise InputError.at(path, None, f"ID is {id!r}, expected a text such as 'my.effect' in small letters")
    if id in CATALOGUE:
        raise InputError.at(path, None, f"ID '{id}' is an effect of the catalogue; expected another name")
    if acts_on not in _ACTS_ON:
        raise InputError.at(path, None, f"ACTS_ON is {acts_on!r}, expected one of {', '.join(_ACTS_ON)}")
    if not callable(function):
        raise InputError.at(path, None, "apply is no function")
    plants = found.get("PLANTS", ("flight",) if acts_on in ("motion", "gps") else PLANTS)
    possible = _MOVED if acts_on == "motion" else PLANTS
    if not isinstance(plants, tuple | list) or not plants or not set(plants) <= set(possible):
        raise InputError.at(path, None, f"PLANTS is {plants!r}, expected a tuple of some of {', '.join(possible)}")
    row = Row(id, kind, acts_on, tuple(plants), _scale(path, found["SCALE"], kind))
    text = (kind.__doc__ or "").strip().splitlines()
    effect = UserEffect(row, function, text[0] if text and not text[0].startswith(f"{kind.__name__}(") else id, path)
    _try(effect)
    return effect


def _run(path: Path) -> ModuleType:
    source = read_text(path)
    module = ModuleType(f"user_effect_{path.stem}")
    module.__file__ = str(path)
    try:
        exec(compile(source, str(path), "exec", dont_inherit=True), vars(module))
    except SyntaxError as error:
        raise InputError.at(path, error.lineno, f"no valid Python: {error.msg}") from None
    except Exception as error:
        raise _failed(path, error, "reading the file") from None
    return module


def _failed(path: Path, error: Exception, what: str) -> InputError:
    """Return the error of a user's code, at the last line of the file that took part in it."""
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == str(path)]
    return InputError.at(path, lines[-1] if lines else None, f"{what} failed: {type(error).__name__}: {error}")


def _parameter_type(path: Path, module: ModuleType) -> type[Any]:
    kinds = [
        value
        for value in vars(module).values()
        if isinstance(value, type)
        and issubclass(value, tuple)
        and hasattr(value, "_fields")
        and value.__module__ == module.__name__
    ]
    if len(kinds) != 1:
        names = ", ".join(kind.__name__ for kind in kinds) or "none"
        raise InputError.at(
            path, None, f"defines {len(kinds)} NamedTuple types ({names}); expected one, its parameters"
        )
    (kind,) = kinds
    fields, defaults = kind._fields, kind._field_defaults  # type: ignore[attr-defined]
    if not fields:
        raise InputError.at(path, None, f"{kind.__name__} has no parameters; expected at least one")
    for name in fields:
        if name not in defaults or not _number(defaults[name]):
            raise InputError.at(
                path, None, f"{kind.__name__}.{name} has no finite default; expected the value at which it does nothing"
            )
    return kind


def _number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and isfinite(value)


def _scale(path: Path, scale: object, kind: Any) -> tuple[float, ...]:
    count = len(kind._fields)
    if (
        not isinstance(scale, tuple | list)
        or len(scale) != count
        or not all(_number(size) and size > 0 for size in scale)
    ):
        raise InputError.at(
            path,
            None,
            f"SCALE is {scale!r}, expected {count} number{'s' * (count > 1)} above zero: a small but visible size of "
            f"{', '.join(kind._fields)}",
        )
    return tuple(float(size) for size in scale)


def _probe() -> State:
    """Return a second of a flight that spins, climbs and wobbles: what an effect is tried on."""
    t = np.linspace(0.0, 1.0, 21)
    zero, one = np.zeros_like(t), np.ones_like(t)
    rate = np.stack([2.0 * np.cos(9.0 * t), 2.0 * np.sin(9.0 * t), 60.0 - 3.0 * t], axis=1)
    return State(
        t,
        np.stack([20.0 * t, 2.0 * t, -1.5 - 2.0 * t], axis=1),
        np.stack([20.0 * one, 2.0 * one, -2.0 * one], axis=1),
        np.stack([-3.0 * one, 0.5 * one, 4.0 * one], axis=1),
        turn(np.stack([0.1 * np.sin(t), 0.1 * np.cos(t), 3.0 * t], axis=1)),
        rate,
        np.stack([zero, zero, -3.0 * one], axis=1),
    )


def _try(effect: UserEffect) -> None:
    """Try an effect at its defaults, where it must do nothing, and at its scale, where it must give numbers."""
    row, path = effect.row, effect.path
    if row.acts_on == "motion":
        function = compiled_wrench(effect)

        def sizes(values: Sequence[float]) -> FloatArray:
            return np.array(function(np.array(values), 0.3, 2.0, 18.0, -3.0, 1.5, 1.0, -0.5, 60.0))

        baseline = np.zeros(6)
    else:
        motion = _probe()
        width = SENSOR_WIDTHS[row.acts_on]
        baseline = np.stack([(k + 1.0) * np.cos(7.0 * motion.t + k) for k in range(width)], axis=1)

        def sizes(values: Sequence[float]) -> FloatArray:
            return effect.on_readings(values, baseline, motion.t, motion)

    if not np.array_equal(sizes(tuple(row.baseline)), baseline):
        raise InputError.at(
            path, None, f"apply() with {row.baseline} changes something; expected nothing at the defaults"
        )
    scaled = tuple(none + size for none, size in zip(row.baseline, row.scale, strict=True))
    if not np.all(np.isfinite(sizes(scaled))):
        raise InputError.at(
            path, None, f"apply() with {row.type(*scaled)} gives NaN or infinity; expected finite numbers"
        )


def compiled_wrench(effect: UserEffect) -> Callable[..., tuple[float, float, float, float, float, float]]:
    """Return a motion effect as compiled code: (values (k,) array, t, h, u, v, w, P, Q, r) to six floats.

    Raises `InputError` where numba cannot compile the user's function, or it gives something else.
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
    """Return the error for numba's message: its first line that says something, at the line it tells of the file."""
    said = [line.strip() for line in message.splitlines() if line.strip()]
    reason = next((line for line in said if not line.startswith("Failed in nopython")), "numba refuses it")
    line = re.search(rf'File "[^"]*{re.escape(path.name)}", line (\d+)', message)
    return InputError.at(
        path,
        int(line[1]) if line else None,
        f"apply() cannot be compiled ({reason}); expected arithmetic and functions of math on numbers, and six of "
        "them returned",
    )
