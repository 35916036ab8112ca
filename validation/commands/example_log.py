"""``discsim example-log``: a CSV log to try the other commands on."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from discsim.validation.reporting.options import EffectOption

__all__ = ["command"]


def command(
    file: Annotated[Path, typer.Argument(help="The CSV file to write; it must not be there.", show_default=False)],
    throws: Annotated[int, typer.Option(min=1, max=20, help="Throws in the log, to headings all round.")] = 1,
    spin: Annotated[float, typer.Option(min=850.0, max=7000.0, help="Spin rate at release, deg/s.")] = 4200.0,
    effect: EffectOption = None,
    seed: Annotated[int, typer.Option(help="Seed of everything random.")] = 7,
) -> None:
    """Write a CSV log of simulated throws, as a logger would.

    It holds rest, the hand that throws, and columns of its own.

    Example: discsim example-log my-log.csv --throws 3 --spin 1700 --effect mag.hard_iron:bx_uT=9,by_uT=-6
    """
    from discsim.errors import InputError
    from discsim.validation.reporting.options import all_effects
    from discsim.validation.scenarios.example_log import write_example_log

    if file.exists():
        raise InputError(f"{file}: is there already; expected a new file (nothing is overwritten)")
    effects, _ = all_effects(None, effect, "flight", ["accelerometer", "gyroscope", "magnetometer"], None)
    rates = write_example_log(file, throws, spin, effects, seed)
    for number, rate in enumerate(rates, start=1):
        typer.echo(f"throw {number}: {rate:.0f} deg/s in the middle of its flight")
