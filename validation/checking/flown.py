"""`fly` and `predict` as Python offers them: the engines' own, which warn of what cannot be about a flight.

The engines themselves say nothing: a search, a sweep and their workers fly what no hand throws.
"""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import wraps
from importlib import import_module
from typing import TYPE_CHECKING, Any

from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.validation.checking.statements import unlikely_flight

if TYPE_CHECKING:
    from discsim.engine import fly
    from discsim.trajectory import predict

__all__ = ["fly", "predict"]

#: name -> the engine's module, loaded when it is asked for: the standalone model needs no MuJoCo
_ENGINES = {"fly": "discsim.engine", "predict": "discsim.trajectory"}


def __getattr__(name: str) -> Any:
    """Return an engine's function that warns."""
    if name not in _ENGINES:
        raise AttributeError(f"module '{__name__}' has no attribute '{name}'")
    # kept under its name, by which pickle finds it for another process
    return globals().setdefault(name, _warning(getattr(import_module(_ENGINES[name]), name)))


def _warning(engine: Callable[..., Any]) -> Callable[..., Any]:
    @wraps(engine)
    def told(*given: Any, **named: Any) -> Any:
        flown = engine(*given, **named)  # what it refuses needs no warning
        stated = [*given, *named.values()]
        disc = next((one for one in stated if isinstance(one, Disc)), None)
        there = next((one for one in stated if isinstance(one, Environment)), Environment())
        for note in unlikely_flight(disc, there, *(one for one in stated if isinstance(one, Release))):
            warnings.warn(note, stacklevel=2)
        return flown

    told.__module__ = __name__
    return told
