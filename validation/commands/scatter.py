"""``discsim scatter``: where throws land when release, coefficients and wind are uncertain."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from discsim.validation.reporting.options import EffectOption, ModelOption, OutOption, SeedOption

__all__ = ["command"]


def command(
    disc: Annotated[str | None, typer.Option(help="A shipped disc's name, or a TOML file. Default: driver.")] = None,
    model: ModelOption = None,
    throw: Annotated[str, typer.Option(help="A shipped throw's name, or a TOML file.")] = "driver",
    fit: Annotated[
        Path | None, typer.Option(help="Folder or cnr.json of discsim fit: its coefficients with their covariance.")
    ] = None,
    sd: Annotated[
        str | None,
        typer.Option(
            metavar="NAME=SD,...",
            help="Standard deviations in the place of stated ones: speed, height (m, m/s), launch, heading, hyzer, "
            "nose (deg), spin (rpm), wobble (deg/s), wind (m/s), air_density, mass, Ixx, Izz, CL0 and so on (SI).",
        ),
    ] = None,
    effect: EffectOption = None,
    flights: Annotated[int, typer.Option(min=1, help="Number of flights.")] = 10_000,
    scheduler: Annotated[str | None, typer.Option(help="Address of a running Dask scheduler.")] = None,
    workers: Annotated[int | None, typer.Option(min=1, help="Local processes. Default: the cores of this one.")] = None,
    out: OutOption = Path("scatter"),
    seed: SeedOption = 0,
) -> None:
    """Tell where throws land when release or air are uncertain.

    Writes scatter.json (ellipses, percentiles, sensitivities), landings.csv (every flight), scatter.png,
    sensitivities.png and report.html into --out. What throw, disc and model state with a sigma is uncertain.

    Example: discsim scatter --disc driver --sd speed=0.5,launch=1,hyzer=2,nose=1,spin=50,wind=1 --out scatter
    """
    from discsim.shipped import load_throw
    from discsim.validation.checking.statements import unlikely_flight
    from discsim.validation.reporting.options import disc_to_fly, flight_effects, parse_sizes
    from discsim.validation.reporting.run import start_run
    from discsim.validation.scattering.fitted import read_fitted
    from discsim.validation.scattering.scattered import scatter

    body, place, stated = disc_to_fly(disc, model)
    effects, sigma, notes = flight_effects(stated, effect)
    files = [Path(name) for name in (disc or "", throw) if name.endswith(".toml")]
    inputs = [*filter(None, (model, fit)), *files]
    given = parse_sizes(sd, "--sd") if sd else {}
    fitted = None if fit is None else read_fitted(fit)
    release = load_throw(throw)
    with start_run(out, seed, inputs) as run:
        found = scatter(
            body,
            release,
            environment=place,
            flights=flights,
            seed=seed,
            sd=given,
            fitted=fitted,
            effects=effects,
            sigma=sigma,
            workers=workers,
            scheduler=scheduler,
            checkpoints=out / "checkpoints" if workers or scheduler else None,
            progress=run.progress,
        )
        found.report(out)
    for note in (*notes, *unlikely_flight(body, place, release)):
        typer.echo(note)
    typer.echo(found.summary())
    typer.echo(f"read {out / 'report.html'}")
