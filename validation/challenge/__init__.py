"""The blind test: effects are concealed in MuJoCo, diagnosed by another process, then opened and scored.

The package itself is called as `discsim.validation.challenge.challenged.blind_test` is:
``discsim.validation.challenge(20)``.
"""

from __future__ import annotations

import sys
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from discsim.validation.challenge.challenged import Challenged


class _Called(ModuleType):
    """A module that can be called: the package bears the name that a user expects of the function."""

    def __call__(self, *given: Any, **named: Any) -> Challenged:
        from discsim.validation.challenge.challenged import blind_test

        return blind_test(*given, **named)


sys.modules[__name__].__class__ = _Called
