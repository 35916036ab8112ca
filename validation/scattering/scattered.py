"""`scatter` and what it gives: where throws land, in ellipses and percentiles, and which uncertainty does it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from scipy.stats import binom, chi2

from discsim.arrays import FloatArray
from discsim.disc import Disc, Release
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.files import write_text
from discsim.launch import launch_of
from discsim.shipped import load_disc, load_throw
from discsim.validation.reporting.run import json_text, package_version
from discsim.validation.reporting.truth import write_csv
from discsim.validation.running.progress import Progress, silent
from discsim.validation.running.tasks import claim, run_tasks
from discsim.validation.scattering.inputs import Fitted, Inputs, inputs_of
from discsim.validation.scattering.landings import Flown, Throws, chunk_tasks, fly_chunk
from discsim.validation.scattering.sensitivities import Shares, sensitivities

if TYPE_CHECKING:
    import xarray as xr

__all__ = ["Ellipse", "Percentiles", "Scattered", "scatter"]

#: shares of the landings that ellipses hold, and percentiles that are told
SHARES = (0.50, 0.90, 0.95)
PERCENTILES = (5.0, 25.0, 50.0, 75.0, 95.0)
#: with fewer landings the outermost ellipse is set by one or two of them
FEWEST = 100


class Ellipse(NamedTuple):
    """An ellipse about the mean landing that holds a share of all landings.

    It has the shape of the landings' covariance and is as large as it must be to hold them: ``semi_axes`` in m, the
    longer first, whose direction is ``direction_deg`` from north. ``normal`` is its size over that of a normal
    distribution: 1 where landings are normal.
    """

    share: float
    north: float
    east: float
    semi_axes: tuple[float, float]
    direction_deg: float
    normal: float

    def outline(self, points: int = 181) -> FloatArray:
        """Return points (n, 2) of the ellipse, north and east."""
        angle = np.linspace(0.0, 2 * np.pi, points)
        c, s = np.cos(np.radians(self.direction_deg)), np.sin(np.radians(self.direction_deg))
        long, short = self.semi_axes[0] * np.cos(angle), self.semi_axes[1] * np.sin(angle)
        return np.column_stack([self.north + c * long - s * short, self.east + s * long + c * short])


class Percentiles(NamedTuple):
    """A result of the flights: mean, standard deviation, percentiles, and the 95 % interval of each percentile."""

    name: str
    unit: str
    nominal: float
    mean: float
    sd: float
    values: tuple[float, ...]
    intervals: tuple[tuple[float, float], ...]


@dataclass(frozen=True, repr=False)
class Scattered:
    """Landings of many throws.

    Attributes
    ----------
    inputs : Inputs
        What was uncertain.
    flown : Flown
        Inputs (n, k) and ends (n, 4) of every flight.
    nominal : (4,) array
        End of the flight without any scatter: north, east, time aloft, speed.
    heading : float
        Direction in which the nominal throw is released, rad.
    ellipses, percentiles, shares
        What is made of it.
    seed : int
    """

    inputs: Inputs
    flown: Flown
    nominal: FloatArray
    heading: float
    ellipses: tuple[Ellipse, ...]
    percentiles: tuple[Percentiles, ...]
    shares: tuple[Shares, ...]
    seed: int

    def __repr__(self) -> str:
        return f"<Scattered: {self.headline}>"

    @property
    def landed(self) -> int:
        """How many flights landed."""
        return int(np.count_nonzero(np.isfinite(self.flown.ends[:, 0])))

    @property
    def headline(self) -> str:
        """Where they land, in one line."""
        distance = self.percentiles[0]
        half = next(ellipse for ellipse in self.ellipses if ellipse.share == 0.90)
        return (
            f"{self.landed} landings: {distance.mean:.1f} m from the release (sd {distance.sd:.1f} m); nine of ten in "
            f"an ellipse of {2 * half.semi_axes[0]:.1f} by {2 * half.semi_axes[1]:.1f} m"
        )

    @property
    def notes(self) -> list[str]:
        """What the reader must know, a line each."""
        found = []
        lost, refused = len(self.flown.ends) - self.landed, self.flown.refused
        if lost:
            found.append(f"{lost} of {len(self.flown.ends)} flights did not land within 30 s or left their C_Nr table")
        if refused:
            found.append(f"{refused} draws were no throw (as a mass below zero) and were drawn again")
        if any(shares.order == 1 for shares in self.shares):
            found.append("few flights: shares by a linear fit alone; what inputs do together counts as unexplained")
        return found

    def summary(self) -> str:
        """Return the headline, what scatters the landings most, and the notes: a line each."""
        lines = [self.headline]
        for shares in self.shares:
            most = [f"{', '.join(s.inputs)} {100 * s.total:.0f} %" for s in shares.shares[:3]]
            lines.append(f"{shares.result} is scattered by {'; '.join(most)}")
        return "\n".join([*lines, *(f"note: {note}" for note in self.notes)])

    def to_json(self) -> dict[str, Any]:
        """Return the content of scatter.json."""
        return {
            "format": "discsim-scatter/1",
            "flights": len(self.flown.ends),
            "landed": self.landed,
            "seed": self.seed,
            "inputs": [item._asdict() | {"place": None} for item in self.inputs.items],
            "covariance": self.inputs.covariance,
            "nominal": dict(zip(("north_m", "east_m", "time_s", "speed_m_s"), self.nominal.tolist(), strict=True)),
            "ellipses": [ellipse._asdict() for ellipse in self.ellipses],
            "percentiles": [
                item._asdict() | {"values": dict(zip(map(str, PERCENTILES), item.values, strict=True))}
                for item in self.percentiles
            ],
            "sensitivities": {
                shares.result: {
                    "method": f"Sobol indices by polynomial chaos of order {shares.order}",
                    "variance": shares.variance,
                    "unexplained": shares.unexplained,
                    "shares": [share._asdict() for share in shares.shares],
                }
                for shares in self.shares
            },
            "notes": self.notes,
        }

    def to_xarray(self) -> xr.Dataset:
        """Return every flight as labelled arrays over ``flight``: inputs and ends."""
        import xarray as xr

        ends = dict(zip(_ENDS, self.flown.ends.T, strict=True))
        columns = dict(zip(self.inputs.names, self.flown.inputs.T, strict=True))
        return xr.Dataset({name: ("flight", column) for name, column in {**ends, **columns}.items()})

    def report(self, folder: Path | str) -> Path:
        """Write scatter.json, landings.csv, scatter.png and report.html; return the path of the page."""
        from discsim.validation.scattering.page import write_scatter_page

        out = Path(folder)
        write_text(out / "scatter.json", json_text(self.to_json()))
        table = np.column_stack([self.flown.ends, self.flown.inputs])
        names = [_column(item.name, item.unit) for item in self.inputs.items]
        write_csv(out / "landings.csv", ",".join([*_ENDS, *names]), table)
        return write_scatter_page(self, out)


_ENDS = ("north_m", "east_m", "time_s", "speed_m_s")


def _column(name: str, unit: str) -> str:
    """Return the name of a column, its unit behind it as in the project's files."""
    return "_".join([name, *filter(None, [unit.replace("^", "").replace("/", "_").replace(" ", "_")])])


def scatter(
    disc: Disc | PathLike[str] | str = "driver",
    throw: Release | PathLike[str] | str = "driver",
    *,
    environment: Environment | None = None,
    flights: int = 10_000,
    seed: int = 0,
    sd: Mapping[str, float] | None = None,
    fitted: Fitted | None = None,
    effects: Sequence[Effect] = (),
    sigma: Mapping[tuple[str, str], float] | None = None,
    workers: int | None = None,
    scheduler: str | None = None,
    checkpoints: Path | None = None,
    progress: Progress = silent,
) -> Scattered:
    """Fly many throws whose release, disc, air and coefficients are drawn at random, and tell where they land.

    Parameters
    ----------
    disc, throw
        A disc and a throw, or what `load_disc` and `load_throw` take. What they state with a sigma is uncertain.
    environment : Environment, optional
        Where it is thrown; by default that of a disc by name, or standard air.
    sd : mapping, optional
        Standard deviations by name in people's units, in the place of any stated: ``{"speed": 0.5, "launch": 1.0,
        "hyzer": 2.0, "nose": 1.0, "spin": 50.0, "wind": 1.0, "CD0": 0.002}`` are m/s, deg, deg, deg, rpm, m/s, none.
    fitted : Fitted, optional
        Coefficients with their covariance, `discsim.validation.scattering.fitted.read_fitted`.
    effects, sigma
        Effects upon the flight; one sigma of their parameters by (id, parameter).
    workers, scheduler
        Local processes, or a running Dask scheduler's address. By default all cores of this process.
    checkpoints : Path, optional
        Folder of finished chunks, with workers or a scheduler: a run that was stopped goes on there.

    Raises `InputError` where nothing is uncertain, for an unknown name, and where fewer than `FEWEST` flights land.
    """
    if flights < FEWEST:
        raise InputError(f"--flights {flights}: expected at least {FEWEST}, for ellipses of 95 %")
    if isinstance(disc, Disc):
        body, place = disc, environment or Environment()
    else:
        body, place = load_disc(disc)
        place = environment or place
    release = throw if isinstance(throw, Release) else load_throw(throw)
    inputs = inputs_of(body, place, release, effects=effects, sigma=sigma, fitted=fitted, sd=sd)
    here = workers is None and scheduler is None
    throws = Throws(inputs, body, place, tuple(effects), seed, None if here else 1)
    tasks = chunk_tasks(flights)
    if here:
        chunks = [fly_chunk(task.argument, throws) for task in progress(tasks, len(tasks), "flights, ten thousand")]
    else:
        with ExitStack() as stack:
            folder = checkpoints or Path(stack.enter_context(TemporaryDirectory()))
            claim(folder, _identity(throws, flights))
            chunks = run_tasks(
                tasks,
                fly_chunk,
                folder,
                shared=throws,
                scheduler=scheduler,
                workers=workers,
                progress=lambda items, total: progress(items, total, "flights, ten thousand"),
            )
    flown = Flown.of(chunks)
    return _made(inputs, flown, _nominal(throws), float(launch_of(release).heading), seed)


def _nominal(throws: Throws) -> FloatArray:
    """Return the end (4,) of the flight with every input at its mean."""
    still = throws.inputs
    calm = Inputs(still.items, np.zeros_like(still.covariance), still.release, still.flat)
    return np.asarray(fly_chunk((0, 1), throws._replace(inputs=calm))["ends"][0])


def _identity(throws: Throws, flights: int) -> dict[str, Any]:
    """Return what makes two runs the same, for the folder of their chunks."""
    items = [[item.name, item.mean, item.sd] for item in throws.inputs.items]
    return {
        "command": "scatter",
        "flights": flights,
        "seed": throws.seed,
        "inputs": items,
        "covariance": throws.inputs.covariance.tolist(),
        "physics": throws.inputs.flat.tolist(),
        "versions": {"discsim": package_version(), "numpy": np.__version__},
    }


def _made(inputs: Inputs, flown: Flown, nominal: FloatArray, heading: float, seed: int) -> Scattered:
    """Make ellipses, percentiles and shares of flights."""
    landed = np.isfinite(flown.ends[:, 0])
    ends, rows = flown.ends[landed], flown.inputs[landed]
    if len(ends) < FEWEST:
        raise InputError(
            f"{len(ends)} of {len(flown.ends)} flights landed; expected at least {FEWEST} "
            "(is the throw one, and the C_Nr table wide enough?)"
        )
    start = inputs.release.start()[0]
    results = _results(ends, start, heading)
    middle = _results(nominal[None], start, heading)
    return Scattered(
        inputs,
        flown,
        nominal,
        heading,
        tuple(ellipses_of(ends[:, :2])),
        tuple(percentiles_of(name, unit, float(middle[name, unit][0]), v) for (name, unit), v in results.items()),
        tuple(sensitivities(inputs, rows, results[key], key[0]) for key in results if key[0] in _EXPLAINED),
        seed,
    )


#: results of which it is told what scatters them
_EXPLAINED = ("along the throw", "to its right", "time aloft")


def _results(ends: FloatArray, start: FloatArray, heading: float) -> dict[tuple[str, str], FloatArray]:
    """Return what people ask of ends (n, 4), by name and unit."""
    north, east = ends[:, 0] - start[0], ends[:, 1] - start[1]
    c, s = np.cos(heading), np.sin(heading)
    return {
        ("distance", "m"): np.hypot(north, east),
        ("along the throw", "m"): c * north + s * east,
        ("to its right", "m"): c * east - s * north,
        ("time aloft", "s"): ends[:, 2],
        ("speed at touch-down", "m/s"): ends[:, 3],
    }


def ellipses_of(points: FloatArray) -> list[Ellipse]:
    """Return the ellipses of landings (n, 2), north and east."""
    mean, covariance = points.mean(axis=0), np.cov(points.T)
    w, V = np.linalg.eigh(covariance)
    away = (points - mean) @ V / np.sqrt(np.maximum(w, 1e-300))
    reach = np.sqrt(np.einsum("ni,ni->n", away, away))
    direction = float(np.degrees(np.arctan2(V[1, 1], V[0, 1]))) % 180.0
    found = []
    for share in SHARES:
        size = float(np.quantile(reach, share))
        axes = (size * float(np.sqrt(w[1])), size * float(np.sqrt(max(w[0], 0.0))))
        normal = size / float(np.sqrt(chi2.ppf(share, 2)))
        found.append(Ellipse(share, float(mean[0]), float(mean[1]), axes, direction, normal))
    return found


def percentiles_of(name: str, unit: str, nominal: float, values: FloatArray) -> Percentiles:
    """Return percentiles of values (n,), and of each the order statistics that hold it in 95 of 100 samples."""
    ranked, n = np.sort(values), values.size
    places = [
        (int(binom.ppf(0.025, n, q / 100)), min(int(binom.ppf(0.975, n, q / 100)) + 1, n - 1)) for q in PERCENTILES
    ]
    return Percentiles(
        name,
        unit,
        nominal,
        float(values.mean()),
        float(values.std(ddof=1)),
        tuple(float(value) for value in np.percentile(values, PERCENTILES)),
        tuple((float(ranked[max(low - 1, 0)]), float(ranked[high])) for low, high in places),
    )
