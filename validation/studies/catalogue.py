"""The studies that ``discsim study NAME`` runs: by name, where each is, and what it does."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from importlib import import_module
from importlib.util import find_spec
from typing import NamedTuple

from discsim.errors import InputError

__all__ = ["STUDIES", "Study", "run_study"]


class Study(NamedTuple):
    """A study: its module, which has an ``app`` or a ``main`` of its own, and a line on it."""

    module: str
    line: str


STUDIES = {
    "paper": Study("validation.studies.paper.__main__", "the paper's equations, numbers and figures beside ours"),
    "feedback": Study("validation.experiments.feedback.__main__", "flights predicted by C_Nr of each source of spin"),
    "bias": Study("validation.yaw_damping.__main__", "the bias of the paper's way to C_Nr, against the truth"),
    "conceal": Study("validation.challenge.cases.conceal", "conceal effects in recordings, without diagnosing them"),
    "blind-test": Study("validation.challenge.report.document", "write finished challenges into their page"),
    "real-recordings": Study("validation.studies.real_recordings.__main__", "the methods on measured recordings"),
    "real-diagnosis": Study("validation.studies.real_diagnosis.__main__", "the diagnosis of measured recordings"),
    "golf-throws": Study("validation.studies.golf_throws.__main__", "three tracked golf throws beside their flights"),
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
    found = import_module(module)
    if hasattr(found, "app"):
        found.app(list(arguments), prog_name=f"discsim study {name}", standalone_mode=False)
        return
    sys.argv = [f"discsim study {name}", *arguments]
    found.main()
