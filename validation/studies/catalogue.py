"""The studies that ``discsim study NAME`` runs: by name, where each is, and what it does."""

from __future__ import annotations

from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple

import typer

from discsim.errors import InputError

__all__ = ["STUDIES", "Study", "run_study"]


class Study(NamedTuple):
    """A study: its module, whose function ``command`` is what typer calls, and a line on it."""

    module: str
    line: str


STUDIES = {
    "paper": Study(
        "discsim.validation.studies.paper.command", "the paper's equations, numbers and figures beside ours"
    ),
    "feedback": Study(
        "discsim.validation.experiments.feedback.command", "flights predicted by C_Nr of each source of spin"
    ),
    "bias": Study("discsim.validation.studies.bias", "the bias of the paper's way to C_Nr, against the truth"),
    "conceal": Study("discsim.validation.studies.conceal", "conceal effects in recordings, without diagnosing them"),
    "blind-test": Study("discsim.validation.studies.blind_test", "write finished challenges into their page"),
    "real-recordings": Study(
        "discsim.validation.studies.real_recordings.command", "the methods on measured recordings"
    ),
    "real-diagnosis": Study(
        "discsim.validation.studies.real_diagnosis.command", "the diagnosis of measured recordings"
    ),
    "golf-throws": Study(
        "discsim.validation.studies.golf_throws.command", "three tracked golf throws beside their flights"
    ),
}


def run_study(name: str, arguments: Sequence[str]) -> None:
    """Run a study with its own options.

    Raises `InputError` for an unknown name, and for a study about particular data that this installation lacks.
    """
    if name not in STUDIES:
        raise InputError(f"no study '{name}'; expected one of {', '.join(STUDIES)}")
    module = STUDIES[name].module
    if find_spec(module.rpartition(".")[0]) is None:
        raise InputError(
            f"study '{name}' is about particular data sets and not part of an installed discsim; expected a checkout "
            "of the sources: in it, pip install -e ."
        )
    app = typer.Typer(add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None)
    app.command(context_settings={"help_option_names": ["-h", "--help"]})(import_module(module).command)
    app(list(arguments), prog_name=f"discsim study {name}", standalone_mode=False)
