"""Model files (`model.toml`): a disc or a rig with its surroundings and the effects upon it, for every command.

The tables ``[environment]``, ``[disc]`` and ``[rig]`` are those of a recording. Each ``[[effects]]`` names one effect
of the catalogue with its parameters and their standard deviations, or its ``[effects.setting]`` where that is a text,
and the recordings that it belongs to; one of the
user's own names the ``file`` that defines it. ``[law]`` is a term that the catalogue does not hold, as a formula with
coefficients; several are ``[[law]]``.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType

from discsim.disc import Disc, Rig
from discsim.effects.catalogue import Effect, Row, effect, row
from discsim.effects.own import UserEffect
from discsim.environment import Environment
from discsim.errors import InputError, require_path, require_type
from discsim.files import write_text
from discsim.law import Law
from discsim.limits import ANY_NUMBER
from discsim.toml_table import TomlTable, read_toml
from discsim.toml_text import disc_toml, environment_toml, rig_toml, toml_lines

__all__ = ["MODEL_FORMAT", "Model", "ModelEffect", "read_model", "write_model"]

MODEL_FORMAT = "discsim-model/1"


@dataclass(frozen=True)
class ModelEffect:
    """An effect of a model: its size, one standard deviation per parameter (absent: unknown), where it acts.

    ``recordings`` is None for an effect that all recordings share, else the names of those that have it.
    """

    effect: Effect
    sigma: Mapping[str, float] = field(default_factory=dict)
    recordings: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))


@dataclass(frozen=True)
class Model:
    """What a simulation needs beside the throw: surroundings, a disc or a rig, effects, and laws if there are any."""

    environment: Environment
    disc: Disc | None = None
    rig: Rig | None = None
    effects: tuple[ModelEffect, ...] = ()
    laws: tuple[Law, ...] = ()

    def effects_in(self, recording: str | None = None) -> list[Effect]:
        """Return the effects that all recordings share, and those of the named one."""
        return [
            item.effect
            for item in self.effects
            if item.recordings is None or (recording is not None and recording in item.recordings)
        ]


def read_model(path: Path | str, own: Sequence[UserEffect] = ()) -> Model:
    """Read a model file; raises `InputError` naming file, line and what was expected.

    ``own`` are the user's own effects that it may hold: a model never runs code that was not given with it.
    """
    require_path(path, "path", "the path of a model file")
    top = read_toml(Path(path))
    top.text("format", choices=(MODEL_FORMAT,))
    disc_table, rig_table = top.table("disc"), top.table("rig")
    environment_table = top.table("environment", required=True)
    assert environment_table is not None
    environment = Environment.from_toml(environment_table, air_required=disc_table is not None)
    disc = Disc.from_toml(disc_table, aero_required=False) if disc_table is not None else None
    rig = Rig.from_toml(rig_table) if rig_table is not None else None
    effects = tuple(_read_effect(table, own) for table in top.tables("effects"))
    laws = tuple(_read_law(table) for table in top.tables("law", single=True))
    top.finish()
    return Model(environment, disc, rig, effects, laws)


def _read_effect(table: TomlTable, own: Sequence[UserEffect]) -> ModelEffect:
    id = table.text("id")
    assert id is not None
    file = table.text("file", required=False)
    mine = next((effect for effect in own if effect.id == id), None)
    if file is not None and mine is None:
        raise table.error("id", f"effect '{id}' is the user's own; expected its file with it: --with {file}")
    names = table.raw("recordings")
    if (
        names is not None
        and names != "all"
        and not (isinstance(names, list) and all(isinstance(n, str) for n in names))
    ):
        raise table.error("recordings", f"'effects.recordings' is {names!r}, expected \"all\" or a list of names")
    try:
        kind = row(id) if mine is None else mine.row
    except InputError as error:
        raise table.error("id", str(error)) from None
    known = kind.parameters
    sizes, sigmas = table.table("parameters", required=bool(known)), table.table("sigma")
    size = {}
    if sizes is not None:
        size = {name: sizes.number(name, required=False, positive=name in kind.positive) for name in known}
    if sizes is not None:
        sizes.finish()
    setting = _read_setting(table, kind)
    sigma: dict[str, float | None] = {}
    if sigmas is not None:
        sigma = {name: sigmas.number(name, required=False, minimum=0.0, limit=ANY_NUMBER) for name in known}
        sigmas.finish()
    table.finish()
    given = {name: value for name, value in size.items() if value is not None}
    return ModelEffect(
        effect(id, **given, **setting) if mine is None else mine.sized(given),
        {name: value for name, value in sigma.items() if value is not None},
        None if names in (None, "all") else tuple(names),
    )


def _read_setting(table: TomlTable, kind: Row) -> dict[str, str]:
    """Return the settings of an effect; raises `InputError` at the line of one that cannot be."""
    texts = table.table("setting", required=bool(kind.settings))
    if texts is None:
        return {}
    given = {name: text for name in kind.settings if (text := texts.text(name)) is not None}
    texts.finish()
    try:
        effect(kind.id, **given)
    except InputError as error:
        raise texts.error(next(iter(given)), str(error)) from None
    return given


def _read_law(table: TomlTable) -> Law:
    text, target = table.text("text"), table.text("target")
    assert text is not None
    assert target is not None
    coefficients = _numbers(table.table("coefficients", required=True))
    sigma = _numbers(table.table("sigma"))
    table.finish()
    try:
        return Law(text, target, coefficients, sigma)
    except InputError as error:
        raise table.error("target" if "target is" in str(error) else "text", str(error)) from None


def _numbers(table: TomlTable | None) -> dict[str, float]:
    """Return all of a table's numbers, whatever they are called."""
    return {} if table is None else {name: table.number(name, limit=ANY_NUMBER) or 0.0 for name in table}


def write_model(model: Model, path: Path) -> None:
    """Write a model file, whole or not at all; what is read back is equal to the last bit."""
    require_type(model, Model, "model", "a Model, as read_model(FILE) returns it")
    lines = [f'format = "{MODEL_FORMAT}"', *environment_toml(model.environment)]
    if model.disc is not None:
        lines += disc_toml(model.disc)
    if model.rig is not None:
        lines += rig_toml(model.rig)
    for item in model.effects:
        lines += ["", "[[effects]]", f'id = "{item.effect.id}"']
        if item.effect.own is not None:
            lines += toml_lines({"file": item.effect.own.path.name})
        lines += toml_lines({"recordings": "all" if item.recordings is None else list(item.recordings)})
        if item.effect.sizes:
            lines += ["[effects.parameters]", *toml_lines(item.effect.sizes)]
        if item.effect.setting:
            lines += ["[effects.setting]", *toml_lines(item.effect.setting)]
        if item.sigma:
            lines += ["[effects.sigma]", *toml_lines(dict(item.sigma))]
    for law in model.laws:
        lines += [
            "",
            "[law]" if len(model.laws) == 1 else "[[law]]",
            *toml_lines({"text": law.text, "target": law.target}),
        ]
        lines += ["[law.coefficients]", *toml_lines(dict(law.coefficients))]
        if law.sigma:
            lines += ["[law.sigma]", *toml_lines(dict(law.sigma))]
    write_text(path, "\n".join([*lines, ""]))
