"""The sub-commands, one module each; a module's ``command`` function is what typer calls."""

from __future__ import annotations

from importlib import import_module

import typer

__all__ = ["COMMANDS", "register"]

#: name on the command line -> module in this package, and the first line of its help
COMMANDS: dict[str, tuple[str, str]] = {
    "import": ("import_", "Turn a logger's file or a camera's track into a recording."),
    "check": ("check", "Say what a recording holds, and what is wrong with it."),
    "diagnose": (
        "diagnose",
        "Tell what the simulation left out of recordings, if anything.",
    ),
    "challenge": ("challenge", "Put discsim diagnose to a blind test and score it."),
    "estimate": ("estimate", "Estimate the spin rate of a recording over time."),
    "score": ("score", "Score rates that a firmware computed against the truth."),
    "fit": ("fit", "Fit C_Nr to the throws of a data set."),
    "fly": ("fly", "Fly a disc and write what its instruments record."),
    "scatter": ("scatter", "Tell where throws land when release or air are uncertain."),
    "plan": (
        "plan",
        "Tell what recordings could show, before going out.",
    ),
    "rate-table": ("rate_table", "Turn a rate table and score every method against the truth."),
    "sweep": (
        "sweep",
        "Score estimators over many mounts, parts, fields or throws.",
    ),
    "validate": (
        "validate",
        "Run the main job: score everything against truth, report it.",
    ),
    "view": (
        "view",
        "Show a flight or a rate table, live or as a video.",
    ),
    "list": ("list_", "List what is shipped: discs, parts, throws, effects and more."),
    "show": (
        "show",
        "Show what is shipped: a disc, part, throw, map or effect.",
    ),
    "example-log": ("example_log", "Write a CSV log of simulated throws, as a logger would."),
    "study": (
        "study",
        "Run a study of the documentation; without a name list them.",
    ),
}


def register(app: typer.Typer, asked: str | None) -> None:
    """Add every sub-command to ``app``, of which only the one asked for is loaded: ``--help`` is there at once."""
    for name, (module, line) in COMMANDS.items():
        if name == asked:
            loaded = import_module(f"discsim.validation.commands.{module}")
            app.command(name, context_settings=getattr(loaded, "CONTEXT", None))(loaded.command)
        else:
            app.command(name, help=line)(_not_loaded)


def _not_loaded() -> None:
    raise AssertionError("a command was called that is not the first argument")
