"""The command ``discsim``: parses, calls, and turns errors into one clear line and an exit status.

Each sub-command lives in ``validation.commands`` in a module of its own name and is imported only when it runs.
Exit status: 0 done, 1 done but outside tolerance, 2 bad input or usage, 3 a fault of the program itself.
"""

from __future__ import annotations

import os
import sys
import traceback

import typer

from discsim.errors import InputError
from validation.commands import register

__all__ = ["app", "main"]

app = typer.Typer(
    name="discsim",
    help="Physics validation testbed for a flying disc. --debug shows the traceback of an error; --force overwrites "
    "files in --out that discsim did not write.",
    epilog="Begin with a log of your own: discsim import LOG --throw 1 --out throw, then discsim check throw, discsim "
    "estimate throw --out spin, discsim diagnose throw. Without one: discsim example-log my-log.csv makes it.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(show: bool) -> None:
    if show:
        from validation.reporting.run import package_version

        typer.echo(f"discsim {package_version()}")
        raise typer.Exit


@app.callback()
def _common(
    version: bool = typer.Option(False, "--version", callback=_version, is_eager=True, help="Show the version."),
) -> None:
    """Physics validation testbed for a flying disc."""


def _completed() -> list[str]:
    """Return the words behind the command that a shell asks to complete; none where it asks nothing."""
    if "_DISCSIM_COMPLETE" not in os.environ:
        return []
    return os.environ.get("_TYPER_COMPLETE_ARGS", os.environ.get("COMP_WORDS", "")).split()[1:]


def main() -> None:
    """Run the command line."""
    arguments = sys.argv[1:]
    debug = "--debug" in arguments
    if "--force" in arguments:
        from validation.reporting.written import OVERWRITE

        OVERWRITE.set(True)
    sys.argv[1:] = [argument for argument in arguments if argument not in ("--debug", "--force")]
    os.environ.setdefault("MPLBACKEND", "Agg")
    # this process and its children are the command's own; from Python `discsim.threads` limits them while it is needed
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    try:
        # the options that stand before a command take no value, so the first other word is its name
        app.registered_commands.clear()
        words = _completed() or sys.argv[1:]
        register(app, next((argument for argument in words if not argument.startswith("-")), None))
        status = app(standalone_mode=False, prog_name="discsim")
    except (InputError, typer.TyperException) as error:
        if debug:
            traceback.print_exc()
        message = error.format_message() if isinstance(error, typer.TyperException) else str(error)
        typer.echo(f"discsim: {message}", err=True)
        sys.exit(2)
    except (KeyboardInterrupt, typer.Abort):
        typer.echo("discsim: interrupted", err=True)
        sys.exit(130)
    except Exception as error:
        if debug:
            raise
        typer.echo(f"discsim: internal error, {type(error).__name__}: {error} (--debug shows where)", err=True)
        sys.exit(3)
    if status == 130:  # typer turns an interrupt into this status and says nothing
        typer.echo("discsim: interrupted", err=True)
    sys.exit(status if isinstance(status, int) else 0)


if __name__ == "__main__":
    main()
