"""The sub-commands, one module each; a module's ``command`` function is what typer calls."""

from __future__ import annotations

from importlib import import_module

import typer

__all__ = ["COMMANDS", "register"]

#: name on the command line -> module in this package
COMMANDS: dict[str, str] = {
    "import": "import_",
    "check": "check",
    "diagnose": "diagnose",
    "challenge": "challenge",
    "estimate": "estimate",
    "fit": "fit",
    "fly": "fly",
    "rate-table": "rate_table",
    "sweep": "sweep",
    "validate": "validate",
    "view": "view",
    "list": "list_",
    "show": "show",
    "study": "study",
}


def register(app: typer.Typer) -> None:
    """Add every sub-command to ``app``; heavy imports happen inside the commands, not here."""
    for name, module in COMMANDS.items():
        loaded = import_module(f"validation.commands.{module}")
        app.command(name, context_settings=getattr(loaded, "CONTEXT", None))(loaded.command)
