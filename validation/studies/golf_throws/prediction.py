"""A tracked throw, the flight predicted from its measured release, and the band that the stated sigmas leave."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.disc import Disc, Release
from discsim.effects.catalogue import Effect
from discsim.environment import Environment
from discsim.parameters import flight_parameters, parameter_index
from discsim.trajectory import predict_many, release_state
from discsim.validation.importing import find_map, import_recording, read_map
from discsim.validation.importing.throw import MeasuredThrow

__all__ = ["INPUTS", "THROWS", "Prediction", "drawn", "predict_throw"]

#: stems of the raw files, in the order of the paper's table
THROWS = ("throw1", "throw6", "throw15")
#: what a throw's inputs are, in the order in which they are drawn
INPUTS = ("speed", "pitch", "yaw", "roll", "nose", "spin", "wobble", "height", "wind")

#: no disc is released lower than its own radius, m: a fit far from what is stated may ask for it
LOWEST = 0.1


@dataclass(frozen=True)
class Prediction:
    """One throw.

    Attributes
    ----------
    name : str
        Stem of its raw file.
    t, track : (m,), (m, 2) arrays
        Times and the tracked path, north (down range) and east, m.
    nominal : (m, 2) array
        The flight from the stated values, NaN after its touch-down.
    nominal_end : (3,) array
        North, east and time of its touch-down.
    ends : (n, 3) array
        The same of flights whose inputs were drawn from their sigmas.
    paths : (n, m, 2) array
        Those flights, NaN after touch-down.
    shifts : mapping
        North and east (2,) by which one sigma more of one input alone moves the touch-down, m.
    """

    name: str
    t: FloatArray
    track: FloatArray
    nominal: FloatArray
    nominal_end: FloatArray
    ends: FloatArray
    paths: FloatArray
    shifts: Mapping[str, FloatArray]

    @property
    def miss(self) -> FloatArray:
        """Predicted touch-down less the last place that the camera saw, (2,) m north and east."""
        return np.asarray(self.nominal_end[:2] - self.track[-1])

    @property
    def band(self) -> FloatArray:
        """Standard deviations (2,) m of the predicted touch-down, north and east."""
        return np.asarray(np.nanstd(self.ends[:, :2], axis=0))

    @property
    def excess(self) -> float:
        """The miss in standard deviations of the drawn touch-downs (Mahalanobis)."""
        away = self.track[-1] - np.nanmean(self.ends[:, :2], axis=0)
        covariance = np.cov(self.ends[np.isfinite(self.ends).all(axis=1), :2].T)
        return float(np.sqrt(away @ np.linalg.solve(covariance, away)))

    @property
    def beyond(self) -> float:
        """Share of the drawn flights that come down no farther from the mean than the track does."""
        ends = self.ends[np.isfinite(self.ends).all(axis=1), :2]
        away = ends - ends.mean(axis=0)
        z = np.sqrt(np.einsum("ni,ij,nj->n", away, np.linalg.inv(np.cov(ends.T)), away))
        return float(np.mean(z <= self.excess))


def predict_throw(name: str, folder: Path, draws: int, rng: np.random.Generator) -> Prediction:
    """Import one throw and fly it: as stated, and ``draws`` times with every stated input drawn from its sigma.

    The drawn inputs are those that were measured (speed, angles as the source defines them, spin, height) and the
    wind, so that what velocity and attitude share stays shared. Coefficients have no stated sigma and stay. Raises
    `InputError` as importing does.
    """
    shipped = read_map(find_map("shotshaper"))
    recording = import_recording(folder / f"{name}.tsv", shipped).recording
    measured, disc, environment = shipped.throws[name], recording.disc, recording.environment
    assert disc is not None
    track = recording.need("track")
    place = track.value[0, :2]
    wind_sigma = np.broadcast_to(np.asarray(environment.sigma.get("wind_ned_m_s", 0.0), dtype=float), 3)

    z = rng.standard_normal((draws, 12))
    z[0] = 0.0
    states, flats = drawn(measured, disc, environment, place, wind_sigma, z)
    t = np.maximum(track.t, 0.0)
    flown = predict_many(disc, environment, states, parameters=flats, times=t)
    ends = np.column_stack((flown.state[:, :2], flown.end))
    ends[~flown.touched_down] = np.nan

    one = np.zeros((len(INPUTS), 12))
    for row, columns in enumerate(([0], [1], [2], [3], [4], [5], [6], [8], [9])):
        one[row, columns] = 1.0
    states, flats = drawn(measured, disc, environment, place, wind_sigma, one)
    moved = predict_many(disc, environment, states, parameters=flats).state[:, :2] - ends[0, :2]
    paths = flown.track[:, :, :2]
    return Prediction(
        name,
        readonly(t),
        readonly(track.value[:, :2]),
        readonly(paths[0]),
        readonly(ends[0]),
        readonly(ends[1:]),
        readonly(paths[1:]),
        dict(zip(INPUTS, moved, strict=True)),
    )


def drawn(
    measured: MeasuredThrow,
    disc: Disc,
    environment: Environment,
    place: FloatArray,
    wind_sigma: FloatArray,
    z: FloatArray,
    effects: Sequence[Effect] = (),
) -> tuple[FloatArray, FloatArray]:
    """Return release states (n, 14) and flat parameters (n, k) for inputs z (n, 12) sigmas from what is stated.

    Columns of z: the five conditions, spin, two of wobble, height, three of wind.
    """
    flats = np.repeat(flight_parameters(disc, environment, effects)[None], len(z), axis=0)
    for axis, name in enumerate(("wind_north", "wind_east", "wind_down")):
        flats[:, parameter_index("environment", name)] += wind_sigma[axis] * z[:, 9 + axis]
    states = []
    for row in z:
        thrown = replace(
            measured,
            conditions=measured.conditions + measured.sigma * row[:5],
            spin=measured.spin + measured.spin_sigma * row[5],
            height=max(measured.height + measured.height_sigma * row[8], LOWEST),
        )
        release: Release = thrown.release(float(place[0]), float(place[1]), 0.0)
        assert release.body_rate is not None
        wobble = measured.wobble_sigma * np.array([row[6], row[7], 0.0])
        states.append(release_state(replace(release, body_rate=release.body_rate + wobble)))
    return np.array(states), flats
