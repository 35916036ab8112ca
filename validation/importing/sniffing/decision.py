"""One decision of a proposed map: what was decided, how sure that is, and why in one clause."""

from __future__ import annotations

from typing import Literal, NamedTuple, TypeAlias

__all__ = ["Decision", "Sureness"]

Sureness: TypeAlias = Literal["certain", "likely", "guess"]


class Decision(NamedTuple):
    """What is decided (``time``, ``magnetometer unit``, ...), the choice, how sure it is, and why."""

    what: str
    choice: str
    sure: Sureness
    why: str

    @property
    def text(self) -> str:
        """One line."""
        return f"{self.what}: {self.choice} ({self.sure}: {self.why})"
