"""Residual localisation: which recordings, sensors, axes and times carry the mismatch, and what state it grows with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from discsim.arrays import FloatArray
from discsim.recording import SENSORS
from discsim.validation.diagnosis.candidates.candidate import CandidateEffect
from discsim.validation.diagnosis.candidates.continuous_fit import standard_errors
from discsim.validation.diagnosis.candidates.hypothesis import fitted_parameters
from discsim.validation.diagnosis.result import Located
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.diagnosis.selection.uninflated_noise import uninflated_noise
from discsim.validation.identification.linear import Linear
from discsim.validation.identification.normal_equations import nuisance_step, reduce

__all__ = ["located_effect", "located_unmodelled"]

#: share of the excess that is worth a line
_WORTH = 0.05


def excess_of(
    before: Sequence[FloatArray], after: Sequence[FloatArray], linears: Sequence[Linear], sd: Mapping[str, float]
) -> dict[tuple[int, str, str], FloatArray]:
    """Return, by (recording, sensor, axis), how much larger the squared residuals (n,) are before than after."""
    found = {}
    for index, (linear, a, b) in enumerate(zip(linears, before, after, strict=True)):
        for channel in linear.channels:
            x, y = a[channel.rows] / sd[channel.group], b[channel.rows] / sd[channel.group]
            found[index, channel.sensor, channel.axis] = x**2 - y**2
    return found


def without(found: Search, candidate: CandidateEffect) -> list[FloatArray]:
    """Return the residuals (n,) of each recording if an effect of the final hypothesis were left out.

    What the recordings' own unknowns and the other effects can take over, they do, to first order.
    """
    equations, fit = found.equations, found.final.fit
    kept = equations.columns_of(fitted_parameters(found.final.hypothesis.without(candidate), found.own))
    value = equations.solve(kept).value
    elsewhere = {(q.key, q.recordings): float(v) for (_, q), v in zip(kept, value, strict=True)}
    stood = fit.at - np.array([q.stated for q in fit.parameters])
    went = np.array([elsewhere.get((q.key, q.recordings), 0.0) for q in fit.parameters]) - stood
    residuals = []
    for i, (linear, trajectory) in enumerate(zip(fit.linears, fit.trajectories, strict=True)):
        step = np.where([q.acts_in(i) for q in fit.parameters], went, 0.0)
        reduced = reduce(linear, trajectory, fit.noise, fit.defects)
        residuals.append(linear.after(nuisance_step(reduced, step), step))
    return residuals


def located_effect(found: Search, candidate: CandidateEffect, names: Sequence[str]) -> list[Located]:
    """Return where an effect shows: for an event its instant, for a sensor's fault the sensor and axis."""
    row, own, linears = candidate.row, candidate.user, found.final.fit.linears
    if row.hides_readings and all(channel.sensor != row.acts_on for one in linears for channel in one.channels):
        return [_at_its_limit(found, candidate, names)]
    sd = {group: noise.sd for group, noise in found.final.fit.noise.items()}
    excess = excess_of(without(found, candidate), found.final.residuals, linears, sd)
    grows, text = (row.grows_with, row.trace) if own is None else (None, own.text)
    mine = {
        key: value for key, value in excess.items() if candidate.recordings is None or key[0] in candidate.recordings
    }
    total = sum(max(float(np.sum(value)), 0.0) for value in mine.values())
    traced = total > 0
    if not traced:
        mine, total = {key: np.ones(1) for key in mine}, float(len(mine))
    by_axis: dict[tuple[str, str], float] = {}
    for (_, sensor, axis), value in mine.items():
        by_axis[sensor, axis] = by_axis.get((sensor, axis), 0.0) + max(float(np.sum(value)), 0.0)
    order = sorted(by_axis, key=lambda key: (key[0] != row.acts_on, -by_axis[key]))
    places: list[Located] = []
    event = row.event
    for sensor, axis in order[:4]:
        share = by_axis[sensor, axis] / total
        if places and share < _WORTH:
            continue
        start, stop = 0.0, max(recording.end for recording in found.recordings)
        if traced:
            start, stop = _span({k: v for k, v in mine.items() if k[1:] == (sensor, axis)}, found.final.fit.linears)
        if event:
            instant = _instant(found, candidate)
            width = 2.0 * abs(_value(found, candidate, row.lasts)) if isinstance(row.lasts, str) else 3.0 * row.lasts
            # a gust is as long as it is found to be; of what is brief the instant may be known to less than its length
            width = max(width, 2.0 * _error(found, candidate, "t_s")) if row.brief else width
            start, stop = max(instant - width, 0.0), instant + width
        where = _where(candidate, names)
        said = f"{text} (at {_instant(found, candidate):.3f} s)" if event else text
        places.append(Located(where, sensor, axis, start, stop, min(max(share, 0.0), 1.0), said, grows))
    return places


def _where(candidate: CandidateEffect, names: Sequence[str]) -> str:
    return "all" if candidate.recordings is None else ", ".join(names[i] for i in sorted(candidate.recordings))


def _at_its_limit(found: Search, candidate: CandidateEffect, names: Sequence[str]) -> Located:
    """Return where a sensor has no reading left that takes part in a fit: at its largest axis, all the time."""
    row, scope = candidate.row, candidate.recordings
    acting = [one for i, one in enumerate(found.recordings) if scope is None or i in scope]
    values = np.concatenate([one.samples[row.acts_on].value for one in acting if row.acts_on in one.samples])
    axis = SENSORS[row.acts_on].columns[int(np.argmax(np.nanmax(np.abs(values), axis=0)))]
    end = max(one.end for one in acting)
    return Located(_where(candidate, names), row.acts_on, axis, 0.0, end, 1.0, row.trace, row.grows_with)


def _place(found: Search, candidate: CandidateEffect, name: str) -> int | None:
    """Return the place of an effect's parameter among those of the fit; None of one that is not fitted."""
    for j, q in enumerate(found.final.fit.parameters):
        if q.key == (candidate.id, name) and q.recordings == candidate.recordings:
            return j
    return None


def _value(found: Search, candidate: CandidateEffect, name: str) -> float:
    place = _place(found, candidate, name)
    return float(candidate.shape_grid.get(name, 0.0) if place is None else found.final.fit.at[place])


def _error(found: Search, candidate: CandidateEffect, name: str) -> float:
    """Return the standard error of a parameter of an effect, zero where none is known."""
    place = _place(found, candidate, name)
    error = np.nan if place is None else float(standard_errors(found.final)[place])
    return error if np.isfinite(error) else 0.0


def _instant(found: Search, candidate: CandidateEffect) -> float:
    return _value(found, candidate, "t_s")


def located_unmodelled(found: Search, names: Sequence[str]) -> list[Located]:
    """Return where the baseline fails when nothing explains it: sensors and axes, and what the excess grows with."""
    noise = {group: level.sd for group, level in uninflated_noise(found).items()}
    linears = found.base.fit.linears
    zero = [np.zeros_like(residual) for residual in found.base.residuals]
    excess = {key: value - 1.0 for key, value in excess_of(found.base.residuals, zero, linears, noise).items()}
    total = sum(max(float(np.sum(value)), 0.0) for value in excess.values())
    if total <= 0:
        return []
    by_axis: dict[tuple[str, str], dict[int, float]] = {}
    for (index, sensor, axis), value in excess.items():
        by_axis.setdefault((sensor, axis), {})[index] = max(float(np.sum(value)), 0.0)
    places: list[Located] = []
    for (sensor, axis), shares in sorted(by_axis.items(), key=lambda item: -sum(item[1].values()))[:4]:
        amount = sum(shares.values())
        if places and amount < _WORTH * total:
            continue
        worst = max(shares, key=lambda index: shares[index])
        alone = len(shares) > 1 and shares[worst] > 0.8 * amount
        where = names[worst] if alone else "all"
        chosen = {
            key: value for key, value in excess.items() if key[1:] == (sensor, axis) and (not alone or key[0] == worst)
        }
        start, stop = _span(chosen, linears)
        grows = _grows_with(found, chosen, linears)
        text = f"the baseline leaves more than noise on {sensor} {axis}" + (f", growing with {grows}" if grows else "")
        places.append(Located(where, sensor, axis, start, stop, min(amount / total, 1.0), text, grows))
    return places


def _span(excess: Mapping[tuple[int, str, str], FloatArray], linears: Sequence[Linear]) -> tuple[float, float]:
    """Return when the excess is gathered: from 2 % of it to 98 %."""
    times = []
    for index, sensor, axis in excess:
        channel = next(c for c in linears[index].channels if (c.sensor, c.axis) == (sensor, axis))
        times.append(linears[index].t[channel.rows])
    t, v = np.concatenate(times), np.maximum(np.concatenate([*excess.values()]), 0.0)
    order = np.argsort(t)
    gathered = np.cumsum(v[order])
    if gathered[-1] <= 0:
        return float(t.min()), float(t.max())
    start, stop = np.searchsorted(gathered, [0.02 * gathered[-1], 0.98 * gathered[-1]])
    return float(t[order][start]), float(t[order][min(stop, t.size - 1)])


def _grows_with(
    found: Search, excess: Mapping[tuple[int, str, str], FloatArray], linears: Sequence[Linear]
) -> str | None:
    """Return the state with which the excess, segment by segment, goes up most plainly."""
    rows: dict[str, list[float]] = {}
    amounts: list[float] = []
    for (index, sensor, axis), value in excess.items():
        linear, trajectory = linears[index], found.relaxed_fit.trajectories[index]
        channel = next(c for c in linear.channels if (c.sensor, c.axis) == (sensor, axis))
        segment = trajectory.segment_of(linear.t[channel.rows])
        some = [i for i in range(len(trajectory.states)) if np.any(segment == i)]
        amounts += [float(np.mean(value[segment == i])) for i in some]
        for name, values in trajectory.plant.grows_with(trajectory.nodes[some], trajectory.states[some]).items():
            rows.setdefault(name, []).extend(values.tolist())
    if len(amounts) < 8:
        return None
    rank = np.argsort(np.argsort(amounts)).astype(float)
    best, strength = None, 0.4
    for name, column in rows.items():
        if np.ptp(column) == 0:
            continue
        r = float(np.corrcoef(np.argsort(np.argsort(column)), rank)[0, 1])
        if r > strength:
            best, strength = name, r
    return best
