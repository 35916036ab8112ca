"""The sub-commands, one module each; a module's ``command`` function is what typer calls."""

from __future__ import annotations

from importlib import import_module

import typer

__all__ = ["COMMANDS", "register"]

#: name on the command line -> module in this package, and the first line of its help
COMMANDS: dict[str, tuple[str, str]] = {
    "import": ("import_", "Turn a raw logger file into a recording folder."),
    "check": ("check", "Say what a recording holds, what is wrong with it, and what it can tell. Nothing is fitted."),
    "diagnose": (
        "diagnose",
        "Tell whether the baseline explains recordings down to their noise, and if not, what was left out.",
    ),
    "challenge": ("challenge", "Put discsim diagnose to a blind test and score it."),
    "estimate": ("estimate", "Estimate the spin rate of a recording and its standard deviation over time."),
    "score": ("score", "Score rates that something computed, a firmware say, against the truth."),
    "fit": ("fit", "Fit C_Nr to the throws of a data set."),
    "fly": ("fly", "Fly a disc and write what its instruments record."),
    "scatter": ("scatter", "Tell where throws land when release, coefficients and wind are uncertain."),
    "plan": (
        "plan",
        "Tell what recordings could show, before going out: effects, coefficients, and what would tell more.",
    ),
    "rate-table": ("rate_table", "Turn a rate table through a profile and score every method against the truth."),
    "sweep": (
        "sweep",
        "Score estimators over every combination of a plan's axes and mounts, on one truth run for all mounts.",
    ),
    "validate": (
        "validate",
        "Run the rate table and a set of throws, score every estimator against truth, and write a report.",
    ),
    "view": (
        "view",
        "Show a flight or a rate table in MuJoCo's interactive viewer, or draw it off screen with --video.",
    ),
    "list": ("list_", "List what is shipped: discs, parts, throws, sites, maps, sweeps or effects, a line each."),
    "show": (
        "show",
        "Show a disc, part, throw, site, map or sweep as its file has it, or an effect with its parameters.",
    ),
    "example-log": ("example_log", "Write a CSV log of simulated throws, as a stranger's logger would."),
    "study": (
        "study",
        "Run a study of the documentation. NAME --help shows its options; without NAME all studies are listed.",
    ),
}


def register(app: typer.Typer, asked: str | None) -> None:
    """Add every sub-command to ``app``, of which only the one asked for is loaded: ``--help`` is there at once."""
    for name, (module, line) in COMMANDS.items():
        if name == asked:
            loaded = import_module(f"validation.commands.{module}")
            app.command(name, context_settings=getattr(loaded, "CONTEXT", None))(loaded.command)
        else:
            app.command(name, help=line)(_not_loaded)


def _not_loaded() -> None:
    raise AssertionError("a command was called that is not the first argument")
