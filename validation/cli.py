"""The command ``discsim``: parses, calls, and turns errors into one clear line and an exit status.

Each sub-command lives in ``discsim.validation.commands`` in a module of its own name and is imported only when it runs.
Exit status: 0 done, 1 done but outside tolerance, 2 bad input or usage, or a place that cannot be read or written,
3 a fault of the program itself, 130 interrupted.
"""

from __future__ import annotations

import os
import sys
import traceback

import typer

from discsim.errors import InputError
from discsim.validation.commands import register
from discsim.validation.reporting.spoken import speaking
from discsim.validation.start import loading

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
        from discsim.validation.reporting.run import package_version

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
        from discsim.validation.reporting.written import OVERWRITE

        OVERWRITE.set(True)
    sys.argv[1:] = [argument for argument in arguments if argument not in ("--debug", "--force")]
    os.environ.setdefault("MPLBACKEND", "Agg")
    # this process and its children are the command's own; from Python `discsim.threads` limits them while it is needed
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    with speaking():
        status = _status(debug)
    sys.exit(status)


def _status(debug: bool) -> int:
    """Run the command that ``sys.argv`` names and return its exit status, with one line on stderr where it failed."""
    try:
        # the options that stand before a command take no value, so the first other word is its name
        app.registered_commands.clear()
        words = _completed() or sys.argv[1:]
        with loading():
            register(app, next((argument for argument in words if not argument.startswith("-")), None))
        status = app(standalone_mode=False, prog_name="discsim")
        sys.stdout.flush()  # a full disk below it is an error like any other
    except (InputError, typer.TyperException, OSError, MemoryError) as error:
        if debug:
            traceback.print_exc()
        typer.echo(f"discsim: {_in_one_line(error)}", err=True)
        return 2
    except (KeyboardInterrupt, typer.Abort):
        status = 130
    except Exception as error:
        if not _of_an_interrupt(error):
            if debug:
                raise
            typer.echo(f"discsim: internal error, {type(error).__name__}: {error} (--debug shows where)", err=True)
            return 3
        status = 130
    if status == 130:  # typer turns an interrupt into this status and says nothing
        typer.echo("discsim: interrupted", err=True)
    return status if isinstance(status, int) else 0


def _of_an_interrupt(error: BaseException | None) -> bool:
    """Return whether an interrupt caused an error: a library that was just loading says that it could not."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None


def _usage(error: typer.TyperException) -> str:
    """Return how the command of an error is called: of an option's value with a space the shell makes two words."""
    context = getattr(error, "ctx", None)
    if context is None:
        return "no further word"
    pieces = [piece.strip("{}").upper() for piece in context.command.collect_usage_pieces(context)]
    words = " ".join([context.command_path, *pieces])
    return f"`{words}`, and quotes about a value with a space in it"


def _in_one_line(error: BaseException) -> str:
    if isinstance(error, typer.TyperException):
        said = str(error.format_message())
        return f"{said}; expected {_usage(error)}" if said.startswith("Got unexpected extra argument") else said
    if isinstance(error, OSError):
        what = error.strerror or str(error) or type(error).__name__
        where = f"{os.fsdecode(error.filename)}: " if isinstance(error.filename, str | bytes) else ""
        return f"{where}the system says '{what}'; expected a place that can be read or written, with room left"
    if isinstance(error, MemoryError):
        return f"not enough memory ({str(error) or 'none left'}); expected a shorter recording, or fewer at once"
    return str(error)


if __name__ == "__main__":
    main()
