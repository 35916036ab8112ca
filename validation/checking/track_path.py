"""What a camera's or a radar's track says against what a thrown disc does, and against the stated release."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from discsim.arrays import BoolArray, FloatArray, scatter_of
from discsim.disc import Release
from discsim.recording import SENSORS, Recording, Samples
from discsim.validation.checking.finding import Finding
from discsim.validation.checking.gps_path import elsewhere
from discsim.validation.checking.path_points import out_of_reach, rows_in_words, standing
from discsim.validation.checking.statements import FASTEST

__all__ = ["holds_height", "track_findings"]

#: a speed is that over so long (s), or over one step where rows are farther apart: a click that is off by the disc's
#: radius then changes it by 1 m/s
_SPAN = 0.1
#: a speed that is passed in a tenth of the flight's time only is no wrong click's
_FAST = 0.9
#: nobody throws slower (m/s), what falls from a hand is faster after half a second (s), and half of it is seen from any
#: side; of a throw straight up little more than what wind does to it is seen in plan
_SLOWEST, _SLOWEST_PLAN, _LEAST = 1.5, 0.3, 0.5
#: the longest flight of a disc from throw to catch was of 16.72 s (D. Cain, 1984)
_LONGEST = 17.0
#: heights above ground that discs are released at, m: a roller's, and a hand's overhead
_HAND = (0.1, 3.5)
#: units that positions may be in, over m, and what import maps call them
_UNITS = {"mm": (1000.0, "mm"), "cm": (100.0, "cm"), "inches": (39.37, "in"), "feet": (3.281, "ft")}
#: the first part of a flight, s, which tells how it was thrown: drag takes a tenth of the speed in it
_FIRST = 0.4
#: it begins so soon after time zero, s, where it tells so
_SOON = 0.3
#: speeds over the stated one beyond these are of another unit: yards over metres are 1.09, knots over m/s 1.94
_RATIO = (0.6, 1.6)
#: directions differ from this angle on, rad (25 deg): a disc turns by a few degrees in the first part of its flight
_TURNED = 0.44
#: of a disc across the flow C A rho / 2 m is 0.25 1/m (C of 1.2, 0.275 m, 0.175 kg), and 0.05 s are what a line through
#: the first rows stands for; a breeze that nobody states, m/s; the error of a stated velocity without a sigma, m/s; and
#: what a point's noise makes of a velocity, 1/s: twice a line's through five rows of 0.2 s
_ACROSS, _UNTIL, _BREEZE, _VELOCITY, _NOISY = 0.25, 0.05, 5.0, 3.0, 15.0
#: slower in plan than this (m/s), or steeper than 45 deg, a throw has no direction
_TELLS = 3.0
#: columns are taken for others where that leaves less than this, rad (12 deg)
_SAME = 0.21
#: clicks on a disc are within its diameter of its centre; points are elsewhere from three of them on, m
_ELSEWHERE = 1.0
#: where the ground is not quite even, and heights count from a point beside it, m
_GROUND = 0.5


class _Track(NamedTuple):
    """Whole rows of a track: t (n,) s, position (n, 3) m, NaN in axes that are not ``seen``; noise of a coordinate."""

    t: FloatArray
    position: FloatArray
    seen: BoolArray
    noise: float
    rate_hz: float

    @property
    def plan(self) -> bool:
        """Whether north and east are both seen."""
        return bool(self.seen[0] and self.seen[1])


def track_findings(recording: Recording) -> Iterator[Finding]:
    """Yield what cannot be, or is unlikely, about the track of a flight."""
    samples = recording.get("track")
    if samples is None or recording.plant != "flight":
        return
    track = _whole(samples, recording.sheets["track"].noise_rms, recording.sheets["track"].rate_hz)
    if track is None:
        return
    yield from _still(track)
    track = _moving(track)
    if track is None:
        return
    release = recording.release if recording.release is not None else Release()
    wind = float(np.linalg.norm(recording.environment.wind))
    if (found := _speed(track, wind, release)) is not None:
        yield found
        return
    yield from _leaps(track)
    yield from elsewhere("track", track.position[0])
    turned = list(_of_columns(track, wind, release))
    yield from turned
    if not turned:
        yield from _begins_elsewhere(track, release)


def _whole(samples: Samples, noise: float | None, rate_hz: float) -> _Track | None:
    """Return the rows that are whole in the axes that are seen in most rows; None where too few are."""
    there = np.isfinite(samples.value)
    seen = np.mean(there, axis=0) > 0.5
    rows = np.all(there[:, seen], axis=1)
    if not np.any(seen) or np.count_nonzero(rows) < 6:
        return None
    position = np.where(seen, samples.value[rows], np.nan)
    return _Track(samples.t[rows], position, seen, max(noise or 0.0, scatter_of(position[:, seen])), rate_hz)


def _moving(track: _Track) -> _Track | None:
    """Return a track with one row of each stretch that stands; None if nothing moves."""
    keep = np.ones(track.t.size, dtype=np.bool_)
    for first, after in _standing(track):
        keep[first + 1 : after] = False
        if first == 0:
            keep[0] = False
            keep[after - 1] = True
    if np.count_nonzero(keep) < 6 or not np.any(np.ptp(track.position[keep][:, track.seen], axis=0)):
        return None
    return track._replace(t=track.t[keep], position=track.position[keep])


def _standing(track: _Track) -> list[tuple[int, int]]:
    return standing(track.t, track.position[:, track.seen])


def _still(track: _Track) -> Iterator[Finding]:
    """Yield the stretches in which the track writes the same point again and again."""
    for first, after in _standing(track):
        at = "before the throw" if first == 0 else ""
        at = "the disc lies, or the tracker has lost it" if after == track.t.size else at
        yield Finding(
            "track.still",
            "warning",
            "track",
            f"it shows one point in {after - first} rows, from {track.t[first]:.3f} to {track.t[after - 1]:.3f} s",
            "a point that moves while the disc flies",
            f"{at or 'the tracker has lost the disc'}: leave these rows out"
            + ("; time counts from the release" if first == 0 else ""),
        )


def _speeds(track: _Track) -> FloatArray:
    """Return the speeds (m,) m/s over stretches of a tenth of a second, of the axes that are seen."""
    step = max(1, round(_SPAN / float(np.median(np.diff(track.t)))))
    step = min(step, track.t.size - 1)
    went = (track.position[step:] - track.position[:-step])[:, track.seen]
    return np.asarray(np.linalg.norm(went, axis=1) / (track.t[step:] - track.t[:-step]))


def _speed(track: _Track, wind: float, release: Release) -> Finding | None:
    """Return that the path is too fast, too slow or too long for a throw, or not as fast as stated; None if neither."""
    fast, lasts = float(np.quantile(_speeds(track), _FAST)), float(track.t[-1] - track.t[0])
    stated = _stated_speed(track, wind, release)
    ratio = None if stated is None else stated[0] / stated[1]
    if fast > FASTEST + wind + 2.0 * track.noise / _SPAN:
        return Finding(
            "track.speed",
            "error",
            "track",
            f"{_leading(track)} at {fast:.4g} m/s",
            f"up to {FASTEST:g} m/s",
            _too_fast(track, fast, ratio),
        )
    slow = fast < (_SLOWEST if track.seen[2] else _SLOWEST_PLAN) and lasts > _LEAST
    if slow or lasts > _LONGEST:
        return Finding(
            "track.speed" if slow else "track.duration",
            "error",
            "track",
            f"it goes at {fast:.3g} m/s" if slow else f"it flies for {lasts:.4g} s",
            f"a throw's 3 to {FASTEST:g} m/s" if slow else f"at most {_LONGEST:g} s, the longest flights",
            _too_slow(track, ratio, release),
        )
    if stated is None or ratio is None or _RATIO[0] < ratio < _RATIO[1]:
        return None
    return Finding(
        "track.speed",
        "warning",
        "track",
        f"it begins at {stated[0]:.3g} m/s",
        f"{stated[1]:.3g} m/s, as velocity_ned_m_s below [release] states for what it sees",
        _too_fast(track, fast, ratio) if ratio > 1 else _too_slow(track, ratio, release),
    )


def _leading(track: _Track) -> str:
    """Return which columns go the fastest: those that are at least half as fast as the fastest."""
    ranges = np.where(track.seen, np.nan_to_num(np.ptp(track.position, axis=0)), 0.0)
    names = [name for name, size in zip(SENSORS["track"].columns, ranges, strict=True) if size > 0.5 * np.max(ranges)]
    return f"{' and '.join(names)} {'go' if len(names) > 1 else 'goes'}"


def _height(track: _Track) -> float | None:
    """Return the height above ground that the track begins at, m as written; None where it is not seen."""
    return -float(np.median(track.position[:3, 2])) if track.seen[2] else None


def _too_fast(track: _Track, fast: float, ratio: float | None) -> str:
    """Return what mends a track that goes too fast: a unit of its positions, or of its times."""
    high = _height(track)
    raised = high is not None and abs(high) > 1e-3
    units = [
        f"{name} (multiply them by {1 / factor:.4g}, or write unit = {called!r} below [sensors.track] of the map)"
        for name, (factor, called) in _UNITS.items()
        if (3.0 <= fast / factor <= FASTEST)
        and not (raised and high is not None and not _HAND[0] <= abs(high) / factor <= _HAND[1])
        and not (ratio is not None and not 0.75 < ratio / factor < 1.33)
    ]
    clock = raised and high is not None and _HAND[0] <= abs(high) <= _HAND[1]
    if units:
        late = "; or its times are too short: is the camera's rate right?" if clock else ""
        return f"are the positions in {' or in '.join(units)}?{late}"
    scale = f", by the stated speed {1 / ratio:.3g} m each" if ratio is not None else ""
    if clock:
        return f"are its times too short{f', by {ratio:.3g}' if ratio else ''}? Is the camera's rate right?"
    return (
        f"are the positions in pixels{scale}? Write what one of them is in m as scale = ... below [sensors.track] of "
        "the map, or multiply them by it"
    )


def _too_slow(track: _Track, ratio: float | None, release: Release) -> str:
    """Return what mends a track that goes too slowly, or for too long: its times, or a unit of its positions."""
    steps = np.diff(track.t)
    if np.all(track.t == np.round(track.t)) and np.median(steps) == 1.0:
        rate = ""
        if release.velocity is not None:
            first = float(np.median(np.linalg.norm(np.diff(track.position[:6, track.seen], axis=0), axis=1)))
            told = float(np.linalg.norm(release.velocity[track.seen]))
            rate = f", about {told / first:.2g} by the stated speed" if first > 0 else ""
        return (
            f"are its times numbers of frames? Divide them by the camera's frames per second{rate}, or write counter = "
            '"COLUMN" and step_s = the time of one below [time] of the import map'
        )
    stretched = track.rate_hz * float(np.median(steps))
    if stretched > 1.5:
        return (
            f"rate_hz states {track.rate_hz:g} Hz: are its times those of slow motion? Divide them by {stretched:.4g}"
        )
    by = f", by {1 / ratio:.3g} if the stated speed is right" if ratio is not None else ""
    return (
        f"are its times those of slow motion{by}? Divide them by the camera's rate over that of playing; or are the "
        "positions in a larger unit than m?"
    )


def _first(track: _Track, stated: FloatArray) -> FloatArray | None:
    """Return place and velocity (2, 3), m and m/s, at time zero, of a line and of parabolas, or None.

    The one whose velocity is the nearest to ``stated``: what the air does to a lob in a wind within half a second, a
    parabola shows and a line does not, while single points that are off bend a parabola more. Only what none of them
    allows is held against a throw.
    """
    if not -_SOON <= track.t[0] <= _SOON:
        return None
    found = []
    for degree, span in ((1, 0.5 * _FIRST), (1, _FIRST), (2, _FIRST), (2, 2.0 * _FIRST)):
        rows = np.flatnonzero(track.t - track.t[0] <= span)
        if rows.size > degree + 2:
            found.append(_start(track.t[rows], np.nan_to_num(track.position[rows]), degree))
    if not found:
        return None
    first = min(found, key=lambda start: float(np.linalg.norm((start[1] - stated)[track.seen])))
    return np.where(track.seen, first, np.nan)


def _start(t: FloatArray, position: FloatArray, degree: int) -> FloatArray:
    """Return value and slope (2, 3) at t = 0 of polynomials in t, without points that are off by thrice the usual."""
    matrix = np.vander(t, degree + 1, increasing=True)
    rows = np.ones(t.size, dtype=np.bool_)
    for _ in range(2):
        answer = np.linalg.lstsq(matrix[rows], position[rows], rcond=None)[0]
        off = np.linalg.norm(position - matrix @ answer, axis=1)
        near = off <= 3.0 * np.median(off) + 1e-9
        rows = near if np.count_nonzero(near) > degree + 1 else rows
    return np.asarray(answer[:2])


def _stated_speed(track: _Track, wind: float, release: Release) -> tuple[float, float] | None:
    """Return the first speed seen and the stated one in the axes that are seen, m/s; None where they may be alike."""
    stated = release.velocity
    if stated is None or (first := _first(track, stated)) is None or _may_be(track, first[1], wind, release):
        return None
    plain = float(np.linalg.norm(stated[track.seen]))
    return (float(np.linalg.norm(first[1, track.seen])), plain) if plain > _TELLS else None


def _may_be(track: _Track, first: FloatArray, wind: float, release: Release) -> bool:
    """Tell whether a first velocity (3,) m/s may be the stated one, in the axes that are seen.

    Beside the errors of both the air changes it until it is seen, by C A rho V^2 / 2 m of a disc across the flow.
    """
    stated = np.zeros(3) if release.velocity is None else release.velocity
    air = _ACROSS * _UNTIL * (float(np.linalg.norm(stated)) + wind + _BREEZE) ** 2
    limit = _VELOCITY + air + _NOISY * track.noise + 4.0 * _sigma(release, "velocity_ned_m_s")
    return float(np.linalg.norm((first - stated)[track.seen])) < limit


def _sigma(release: Release, key: str) -> float:
    return float(np.max(release.sigma.get(key, 0.0)))


def _leaps(track: _Track) -> Iterator[Finding]:
    """Yield points that no throw could reach from those before and after."""
    out = out_of_reach(track.t, track.position[:, track.seen], _ELSEWHERE + 6.0 * track.noise)
    if np.any(out):
        yield Finding(
            "track.leap",
            "warning",
            "track",
            f"points leap ({np.count_nonzero(out)} of {out.size}): at {rows_in_words(track.t, out)}",
            f"a path that is nowhere faster than {FASTEST:g} m/s",
            "the tracker took something else for the disc: make these cells empty",
        )


def _of_columns(track: _Track, wind: float, release: Release) -> Iterator[Finding]:
    """Yield a height that is in another column or has the other sign, and a plan that is turned from the stated."""
    found = _of_height(track)
    if found is not None:
        yield found
        return
    yield from _bearing(track, wind, release)


def _of_height(track: _Track) -> Finding | None:
    """Return that the height is in another column or has the other sign; None where it is right, or is not seen."""
    return _height_column(track) or _height_sign(track) if track.seen[2] else None


def _is_height(h: FloatArray, noise: float) -> bool:
    """Tell whether a column (n,) m is a height above ground: from a hand's, never below, and down again in the end."""
    slack = 4.0 * noise
    start, end = float(np.median(h[:3])), float(np.median(h[-3:]))
    return (
        _HAND[0] - slack < start < _HAND[1] + slack
        and float(np.min(h)) > -_GROUND - slack
        and end < start
        and end < 1.0 + slack
    )


def _height_column(track: _Track) -> Finding | None:
    """Return that the height is in another column: that begins at a hand's height and comes down, and this is at zero.

    The origin is the place of release on the ground: the column that is the height is the one that does not begin at 0.
    """
    down = track.position[:, 2]
    slack = 4.0 * track.noise
    if abs(float(np.median(down[:1]))) > _HAND[0] + slack:
        return None
    for axis, name in ((0, "north_m"), (1, "east_m")):
        if not track.seen[axis]:
            continue
        for sign, word in ((-1.0, "minus "), (1.0, "")):
            h = sign * track.position[:, axis]
            if float(h[0]) > 3 * _HAND[0] + slack and _is_height(h, track.noise):
                return Finding(
                    "track.axes",
                    "warning",
                    "track",
                    f"{name} begins at {track.position[0, axis]:.3g} m and ends at {track.position[-1, axis]:.3g} m as "
                    f"{word}a height does, and down_m begins at {down[0]:.2g} m",
                    "the height, positive downwards, in down_m",
                    f"are {name} and down_m exchanged? Give the columns in the order north, east, down",
                )
    return None


def _height_sign(track: _Track) -> Finding | None:
    """Return that the height is written positive upwards, or counts from another level; None where it is above ground.

    A path that lies below the ground, and turned over begins at a hand's height and comes down to the ground, is the
    one, and so is one that begins at 0 and bends upwards; another may be that of a throw down a hill.
    """
    down, slack = track.position[:, 2], 4.0 * track.noise
    below = float(np.median(down))
    if below < _GROUND + slack or track.t.size < 6:
        return None
    bend = 2.0 * float(np.polyfit(track.t - track.t[0], down, 2)[0])
    begins = float(np.median(down[:3]))
    up = _is_height(down, track.noise) or (abs(begins) < _GROUND + slack and bend < -1.0)
    if not up and begins < _GROUND + slack:
        return None  # a throw down a hill
    return Finding(
        "track.height",
        "error" if up else "warning",
        "track",
        f"down_m begins at {begins:.3g} m, in the middle it is {below:.3g} m: below the ground",
        "minus the height above ground",
        "down_m holds the height, positive upwards: turn its sign"
        if up
        else "down_m counts from another level, or upwards: subtract that of the ground, or turn its sign",
    )


def holds_height(recording: Recording) -> bool:
    """Tell whether the column ``down_m`` of a flight's track holds the height, positive upwards."""
    samples = recording.get("track")
    if samples is None or recording.plant != "flight":
        return False
    sheet = recording.sheets["track"]
    track = _whole(samples, sheet.noise_rms, sheet.rate_hz)
    track = None if track is None else _moving(track)
    found = None if track is None else _of_height(track)
    return found is not None and (found.id, found.severity) == ("track.height", "error")


def _bearing(track: _Track, wind: float, release: Release) -> Iterator[Finding]:
    """Yield that the plan's first direction is not that of the stated velocity, with the columns that would be."""
    stated = release.velocity
    if stated is None or not track.plan or np.hypot(*stated[:2]) < max(_TELLS, abs(stated[2])):
        return
    first = _first(track, stated)
    if first is None or np.hypot(*first[1, :2]) < _TELLS or _may_be(track, first[1], wind, release):
        return
    set_out = first[1, :2]
    if _angle(set_out, stated[:2]) < _TURNED:
        return
    north, east = set_out
    turns = {
        "north_m with the other sign": (-north, east),
        "east_m with the other sign": (north, -east),
        "north_m and east_m exchanged": (east, north),
        "north_m and east_m with the other signs": (-north, -east),
        "north_m and east_m exchanged, the new north_m with the other sign": (-east, north),
        "north_m and east_m exchanged, the new east_m with the other sign": (east, -north),
    }
    mends = [name for name, plan in turns.items() if _angle(np.array(plan), stated[:2]) < _SAME]
    yield Finding(
        "track.axes",
        "warning",
        "track",
        f"it sets out to {_degrees(set_out)} deg from north",
        f"{_degrees(stated[:2])} deg, as velocity_ned_m_s below [release] states",
        f"right would be {' or '.join(mends)}" if mends else "turn the track, or state the release's own direction",
    )


def _angle(a: FloatArray, b: FloatArray) -> float:
    """Return the angle between two directions in plan, rad."""
    return abs(float(np.arctan2(a[0] * b[1] - a[1] * b[0], a @ b)))


def _degrees(plan: FloatArray) -> str:
    return f"{np.degrees(np.arctan2(plan[1], plan[0])):.0f}"


def _begins_elsewhere(track: _Track, release: Release) -> Iterator[Finding]:
    """Yield that the first point is not where the stated release and the way since then put it."""
    if release.position is None:
        return
    first = _first(track, np.zeros(3) if release.velocity is None else release.velocity)
    if first is None:
        return
    apart = np.where(track.seen, first[0] - release.position, 0.0)
    limit = _ELSEWHERE + 4.0 * _sigma(release, "position_ned_m") + 2.0 * track.noise
    if float(np.linalg.norm(apart)) <= limit:
        return
    names = [f"{name} by {size:+.3g} m" for name, size in zip(SENSORS["track"].columns, apart, strict=True) if size]
    yield Finding(
        "track.start",
        "warning",
        "track",
        f"at time zero it is {float(np.linalg.norm(apart)):.3g} m from the stated release: {', '.join(names)}",
        f"within {limit:.2g} m of position_ned_m below [release]",
        "does its time count from the release, and do its positions from the same place? Shift them, or leave "
        "position_ned_m out",
    )
