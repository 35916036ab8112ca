"""Ordinary errors of parts and of what people state: ``models/priors.toml``, a sigma and its source for each use."""

from __future__ import annotations

from functools import cache
from typing import NamedTuple

from discsim.effects.catalogue import row
from discsim.files import model_file
from discsim.toml_table import TomlTable, read_toml

__all__ = ["OrdinaryError", "ordinary_errors", "ordinary_sigma"]


class OrdinaryError(NamedTuple):
    """One standard deviation of a parameter of an effect, in the parameter's unit, and where the number is from."""

    effect: str
    name: str
    sigma: float
    source: str


@cache
def _table() -> dict[str, tuple[OrdinaryError, ...]]:
    """Return the ordinary errors by use, in the order of the file; raises `InputError`."""
    top = read_toml(model_file("priors.toml"))
    found: dict[str, tuple[OrdinaryError, ...]] = {}
    for table in top.tables("prior"):
        use = table.text("use") or ""
        found[use] = (*found.get(use, ()), *_errors(table))
        table.finish()
    top.finish()
    return found


def _errors(table: TomlTable) -> list[OrdinaryError]:
    kind = row(table.text("effect") or "")
    names = table.raw("parameters") if "parameters" in table else list(kind.parameters)
    if unknown := [name for name in names if name not in kind.parameters]:
        raise table.error("parameters", f"{kind.id} has no {', '.join(unknown)}; expected some of {kind.parameters}")
    sigma, source = table.need("sigma", positive=True), table.text("source") or ""
    return [OrdinaryError(kind.id, name, sigma, source) for name in names]


def ordinary_errors(use: str) -> tuple[OrdinaryError, ...]:
    """Return the ordinary errors that a step allows for, in the order of the table; raises `KeyError` for no use."""
    return _table()[use]


def ordinary_sigma(use: str) -> float:
    """Return the one sigma that a step takes for all parameters of an effect."""
    (sigma,) = {error.sigma for error in ordinary_errors(use)}
    return sigma
