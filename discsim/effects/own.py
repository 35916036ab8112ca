"""Effects of the user's own: one Python file each, checked when it is read. They compete with the catalogue's and fly.

What such a file holds is told in docs/your-own-effect.md. A file is code and runs as such: only files of one's own.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from discsim.arrays import FloatArray
from discsim.effects.applied import MOVED, SENSOR_WIDTHS, Applied, compiled_wrench, failed
from discsim.effects.catalogue import CATALOGUE, Effect, Row
from discsim.errors import InputError
from discsim.files import read_text
from discsim.frames import turn
from discsim.motion import State
from discsim.recording import PLANTS

__all__ = ["UserEffect", "load_user_effect", "load_user_effects"]

_ACTS_ON = (*SENSOR_WIDTHS, "motion")
#: what a file must define beside its type
_NEEDED = ("ID", "ACTS_ON", "SCALE", "apply")
_ID = re.compile(r"[a-z][a-z0-9_]*\.[a-z][a-z0-9_]*")


@dataclass(frozen=True)
class UserEffect(Applied):
    """An effect of the user's own, in its Python file.

    ``text`` is the first line of its type's docstring.
    """

    text: str

    def sized(self, sizes: Mapping[str, float]) -> Effect:
        """Return the effect with its parameters, those left out as they do nothing; raises `InputError`."""
        for name in sizes:
            if name not in self.row.parameters:
                raise InputError(f"{self.id}: unknown parameter '{name}'; expected {', '.join(self.row.parameters)}")
        return Effect(self.id, self.row.type(**{name: float(size) for name, size in sizes.items()}), self)


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
    possible = MOVED if acts_on == "motion" else PLANTS
    if not isinstance(plants, tuple | list) or not plants or not set(plants) <= set(possible):
        raise InputError.at(path, None, f"PLANTS is {plants!r}, expected a tuple of some of {', '.join(possible)}")
    of_disc = id.partition(".")[0] in ("aero", "body")
    row = Row(id, kind, acts_on, tuple(plants), _scale(path, found["SCALE"], kind), in_all=of_disc, apply=function)
    text = (kind.__doc__ or "").strip().splitlines()
    effect = UserEffect(row, path, text[0] if text and not text[0].startswith(f"{kind.__name__}(") else id)
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
        raise failed(path, error, "reading the file") from None
    return module


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
