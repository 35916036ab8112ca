"""Whether a rate reference, and a command, can be the truth of the sensors beside it: unit, sign, clock, time, factor.

Every other relation of a rig starts from it, so a mistake there reads as a mistake of each sensor: a reversed encoder
as three sensors with mixed-up axes. It is asked first, by the rates that the sensors show themselves.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray
from discsim.limits import time_fault
from discsim.recording import Recording, Samples
from discsim.validation.diagnosis.setup.late_sensor import best_lag
from discsim.validation.diagnosis.setup.shown_rates import FEWEST_SLOTS, ShownRate, shown_rates
from discsim.validation.diagnosis.setup.units import NEAR
from discsim.validation.identification.plants import plant_of

__all__ = ["ReferenceDoubt", "believed", "field_is_folded", "reference_doubts"]

#: files of rates
_REFERENCE, _COMMAND = "rate_reference.csv", "command.csv"
#: what sensors show of a rate that is told in another unit than rad/s
_UNITS: Mapping[float, str] = MappingProxyType(
    {np.pi / 180.0: "deg/s", np.pi / 30.0: "rpm", 2.0 * np.pi: "turns per second"}
)
#: a rate is such a multiple within this share of it: scales and crooked mounts are off by some per cent, an
#: accelerometer's place by some mm, and the nearest units (rpm and deg/s) by a factor of six
_NEAR = 0.15
#: what is told that lasts so many times as long as the sensors, or as short, has another unit of time
_LONGER = 100.0
#: units in which a command's times may be written; it ends with the sensors within `NEAR`
_CLOCKS: Mapping[str, float] = MappingProxyType({"milliseconds": 1e-3, "microseconds": 1e-6})
#: lags that are tried, s; a lag is told where those of two sensors or more are this alike, s: one sensor alone may
#: itself be late
_LAGS, _ALIKE = 10.0, 0.03
#: gravity that tells which way up a board is, m/s^2
_UPRIGHT = 5.0
#: a table stands that turns slower than this, rad/s: above any gyroscope's bias, as where a log is imported
#: (`MOVES` of discsim.validation.rows.cleaning)
_TURNS = 0.5
#: sensors that show a rate in each reading, by themselves
_BY_THEMSELVES = ("gyroscope", "rate_reference")
#: a rate is of another run where it leaves this share of itself (rms) beside what sensors show: what trails its command
#: by `SHORTEST` on ramps of a second leaves a tenth, a load that holds a table back may leave more
_ANOTHER = 0.25
#: causes of a factor that lie with a sensor and not with what is told
_OWN_CAUSES: Mapping[str, str] = MappingProxyType(
    {
        "magnetometer": "the spacing of the magnetometer's rows, or rows that it lost",
        "gyroscope": "the gyroscope's range setting or unit",
        "accelerometer": "position_m or the unit of the accelerometer",
        "rate_reference": "the rate reference",
    }
)
#: a field is folded where it shows the rate told less one or two turns per reading, within this share of a turn: its
#: noise leaves a hundredth, and a rate of another unit comes so near by chance once in 25 times
_FOLDED, _MOST_TURNS = 0.01, 2


@dataclass(frozen=True)
class ReferenceDoubt:
    """What cannot be true of a file of rates: its ``kind``, and parts of a sentence.

    Kinds are units, clock, sign, factor, late, another (of another run) and still (zero throughout). Unless ``sure``
    it contradicts what else there is, and either may be wrong.
    """

    kind: str
    file: str
    what: str
    expected: str
    remedy: str
    sure: bool = True

    @property
    def about_reference(self) -> bool:
        """Whether it is about the rate reference, and not the command."""
        return self.file == _REFERENCE

    @property
    def sentence(self) -> str:
        """The doubt in one line."""
        return f"{self.file} {self.what}; expected {self.expected}; {self.remedy}"


def reference_doubts(recording: Recording) -> Iterator[ReferenceDoubt]:
    """Yield what is wrong with a recording's rate reference, and with its command: at most one thing of each.

    A unit is told by any sensor of which no other disagrees, a sign by all of a rig that lies upright, a lag by two, a
    factor by two for sure. A reference that nothing contradicts tells of the command. Nothing is told where times are
    none.
    """
    if any(len(one) and time_fault(one.t) is not None for one in recording.samples.values()):
        return
    told = {_REFERENCE: recording.get("rate_reference"), _COMMAND: recording.command}
    known = {file: one for file, samples in told.items() if (one := _known(samples)) is not None}
    if not known:
        return
    shown = shown_rates(recording)
    if any(_folded(recording, shown, one) for one in known.values()):
        shown = {name: one for name, one in shown.items() if name != "magnetometer"}
    still = {file: one for file, one in known.items() if not np.any(one.value)}
    reference, command = (None if file in still else known.get(file) for file in (_REFERENCE, _COMMAND))
    if reference is not None:
        doubt = _ends_elsewhere(recording, reference) or _of_rates(_REFERENCE, recording, shown, reference)
        if doubt is None:
            shown = {**shown, "rate_reference": ShownRate(reference.t, reference.value, signed=True)}
        else:
            yield doubt
    yield from filter(None, (_stands(file, shown, one) for file, one in still.items()))
    if command is None:
        return
    doubt = _command_clock(recording, shown, command) or _of_rates(_COMMAND, recording, shown, command)
    if doubt is not None:
        yield doubt


def field_is_folded(recording: Recording) -> bool:
    """Tell whether a reference turns faster than half the magnetometer's sampling rate, and the field so folded."""
    field, reference = recording.get("magnetometer"), _known(recording.get("rate_reference"))
    if field is None or reference is None or len(field) < 2:
        return False
    if not np.max(np.abs(reference.value)) > np.pi / field.interval:
        return False
    return _folded(recording, shown_rates(recording), reference)


def _folded(recording: Recording, shown: Mapping[str, ShownRate], told: Samples) -> bool:
    """Tell whether the field shows the rate told less whole turns per reading, wherever that is beyond half of one."""
    if (one := shown.get("magnetometer")) is None:
        return False
    read, said = one.beside(told)
    turn = 2.0 * np.pi / recording.need("magnetometer").interval
    beyond = np.abs(said) > 0.5 * turn
    if np.count_nonzero(beyond) < FEWEST_SLOTS:
        return False
    read, said = read[beyond], said[beyond]
    for sign in (1.0, -1.0):  # the axes may be mirrored as well
        turns = np.rint((said - sign * read) / turn)
        off = np.abs(said - sign * read - turns * turn)
        if np.all(np.abs(turns) <= _MOST_TURNS) and np.median(off) < _FOLDED * turn:
            return True
    return False


def believed(recording: Recording, doubts: Iterable[ReferenceDoubt]) -> Recording:
    """Return a recording without the rate reference, and the command, that cannot be true by doubts of it."""
    doubted = {doubt.file for doubt in doubts if doubt.sure}
    kept = {name: own for name, own in recording.samples.items() if f"{name}.csv" not in doubted}
    return replace(recording, samples=kept, command=None if _COMMAND in doubted else recording.command)


def _of_rates(file: str, recording: Recording, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return the first thing that is wrong with rates, by what sensors show."""
    return (
        _unit(file, shown, told)
        or _sign(file, recording, shown, told)
        or _late(file, recording, shown, told)
        or _factor(file, recording, shown, told)
        or _another(file, recording, shown, told)
    )


def _ends_elsewhere(recording: Recording, reference: Samples) -> ReferenceDoubt | None:
    """Return that a reference's clock has another unit than the sensors', where it lasts so much longer or shorter."""
    ends = [float(one.t[-1]) for name, one in recording.samples.items() if name != "rate_reference" and len(one)]
    if not ends or 1.0 / _LONGER < (lasts := float(reference.t[-1])) / max(others := max(ends), 1e-9) < _LONGER:
        return None
    what = f"ends at {lasts:.6g} s, the sensors at {others:.6g} s"
    remedy = "are the times of one of them milliseconds?"
    return ReferenceDoubt("clock", _REFERENCE, what, "one clock, in seconds", remedy)


def _command_clock(recording: Recording, shown: Mapping[str, ShownRate], command: Samples) -> ReferenceDoubt | None:
    """Return that a command's times are in another unit, where sensors turn by it in that unit and not as written.

    Where its rates are too even to tell, its end does.
    """
    for name, factor in _CLOCKS.items():
        meant = Samples(factor * command.t, command.value)
        if time_fault(meant.t) is not None:
            continue
        written = {sensor: off for sensor, one in shown.items() if (off := _apart(one, command)) is not None}
        right = [sensor for sensor, one in shown.items() if (off := _apart(one, meant)) is not None and off < _ANOTHER]
        if right and all(written.get(sensor, 1.0) >= _ANOTHER for sensor in right):
            what = f"is in {name}, by {_all(right)}"
            return ReferenceDoubt("clock", _COMMAND, what, "seconds", f"multiply its times by {factor:g}")
    return _command_ends(recording, shown, command)


def _command_ends(recording: Recording, shown: Mapping[str, ShownRate], command: Samples) -> ReferenceDoubt | None:
    """Return that a command lasts as the sensors do in another unit of time, or longer than any run.

    Unless no run is that long, it may be one of which a short part was recorded: then sensors turn by it as written
    more nearly than in the other unit, and it is not doubted.
    """
    lasts = float(command.t[-1])
    others = max((float(one.t[-1]) for one in recording.samples.values() if len(one)), default=0.0)
    fault = time_fault(command.t)
    if fault is None and lasts < _LONGER * others:
        return None
    alike = [name for name, factor in _CLOCKS.items() if 1.0 / NEAR < factor * lasts / max(others, 1e-9) < NEAR]
    if fault is None and not (alike and _nearer(shown, command, _CLOCKS[alike[0]])):
        return None
    what = f"ends at {lasts:.6g} s, the sensors at {others:.6g} s"
    remedy = "multiply its times by what makes them seconds"
    if alike:
        remedy = f"is it in {alike[0]}? then multiply its times by {_CLOCKS[alike[0]]:g}"
    return ReferenceDoubt("clock", _COMMAND, what, "one clock, in seconds", remedy, sure=fault is not None)


def _nearer(shown: Mapping[str, ShownRate], command: Samples, factor: float) -> bool:
    """Tell whether all sensors turn more nearly by a command whose times are multiplied by a factor than as written."""
    meant = Samples(factor * command.t, command.value)
    off = [(_apart(one, meant), _apart(one, command)) for one in shown.values()]
    known = [(one, other) for one, other in off if one is not None and other is not None]
    return bool(known) and all(one < other for one, other in known)


def _stands(file: str, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return that nothing turns by rates that are zero throughout, while sensors turn.

    Two sensors that turn alike are sure of it. One alone is heard where it shows a rate without following a phase, for
    noise has one, too.
    """
    sizes = {name: one.means(told)[0] for name, one in shown.items()}
    turning = [name for name, size in sizes.items() if np.count_nonzero(size > _TURNS) >= FEWEST_SLOTS]
    alike = [[other for other in turning if other == one or _turn_alike(shown[one], shown[other])] for one in turning]
    saying = max(alike, key=len, default=[])
    if len(saying) < 2 and not (saying := [name for name in turning if name in _BY_THEMSELVES]):
        return None
    fastest = max(float(np.max(sizes[name])) for name in saying)
    shows = "show" if len(saying) > 1 else "shows"
    what = f"is 0 throughout while the {_all(saying)} {shows} up to {fastest:.3g} rad/s"
    if file == _REFERENCE:
        expected, remedy = "the rate that is there", "was it connected? leave it out"
    else:
        expected, remedy = "the rate that was asked for", "write its knots: the times and the rates of the profile"
    return ReferenceDoubt("still", file, what, expected, remedy, sure=len(saying) > 1)


def _known(samples: Samples | None) -> Samples | None:
    """Return the readings that were taken; None where there are too few."""
    if samples is None:
        return None
    known = np.isfinite(samples.value)
    return Samples(samples.t[known], samples.value[known]) if np.count_nonzero(known) >= 2 else None


def _all(names: Iterable[str]) -> str:
    """Return names as a sentence lists them."""
    *first, last = (name.replace("_", " ") for name in names)
    return f"{', '.join(first)} and {last}" if first else last


def _multiple(read: FloatArray, told: FloatArray, multiples: Sequence[float]) -> float | None:
    """Return which of some multiples of what was told (n,) a sensor read (n,); None for none of them."""
    square = float(told @ told)
    if not square > 0.0:
        return None
    for multiple in multiples:
        rest = read / multiple - told
        if abs(float(read @ told) / (multiple * square) - 1.0) < _NEAR and float(rest @ rest) < _NEAR * square:
            return multiple
    return None


def _unit(file: str, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told in another unit, where some sensor says so and none that it is rad/s."""
    sizes = {name: [np.abs(side) for side in one.beside(told)] for name, one in shown.items()}
    multiples = {name: _multiple(read, said, (1.0, *_UNITS)) for name, (read, said) in sizes.items()}
    saying = [name for name, multiple in multiples.items() if multiple in _UNITS]
    if not saying or 1.0 in multiples.values():
        return None
    factor = multiples[saying[0]]
    assert factor is not None
    what = f"is in {_UNITS[factor]}, by {_all(saying)}"
    return ReferenceDoubt("units", file, what, "rad/s under the name rate_rad_s", f"multiply its rates by {factor:.6g}")


def _sign(file: str, recording: Recording, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told with the other sign, where a rig lies upright and every sensor with a sign says so.

    A board upside down turns the other way, too: its accelerometer tells.
    """
    force = recording.get("accelerometer")
    if plant_of(recording).airborne or force is None or len(force) == 0:
        return None
    if not np.nanmedian(force.value[:, 2]) < -_UPRIGHT:
        return None
    signed = {name: _multiple(*one.beside(told), (1.0, -1.0)) for name, one in shown.items() if one.signed}
    if len(signed) < 2 or any(multiple != -1.0 for multiple in signed.values()):
        return None
    what = f"turns the other way than the {_all(signed)}, and the accelerometer shows the board the right way up"
    return ReferenceDoubt(
        "sign", file, what, "rates positive about the body's z axis, which points down", "turn the sign of its rates"
    )


def _late(file: str, recording: Recording, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told late or early beside two sensors, on a rig whose rate does not just run down.

    Where it runs down by a share of itself a second, late is no other than a scale. A table may trail its command.
    """
    if plant_of(recording).airborne or not plant_of(recording).commanded:
        return None
    # a place that is off reads as a scale, which moves the lag of an accelerometer by a tenth of a second
    lags = {name: lag for name, one in shown.items() if one.signed and (lag := _lag(one, told)) is not None}
    if len(lags) < 2 or float(np.ptp(list(lags.values()))) > _ALIKE:
        return None
    lag = float(np.mean(list(lags.values())))
    what = f"is {abs(lag):.2f} s {'late' if lag > 0 else 'early'} beside the {_all(lags)}"
    remedy = f"subtract {lag:.3f} s from its times" if lag > 0 else f"add {-lag:.3f} s to its times"
    if file == _COMMAND:
        remedy += "" if lag > 0.0 else ", unless the table trails it by so much"
        return ReferenceDoubt("late", file, what, "one clock", remedy, sure=False)
    return ReferenceDoubt("late", file, what, "one clock", remedy)


def _lag(one: ShownRate, told: Samples) -> float | None:
    """Return by how much what is told is late beside a sensor, s; None where no lag makes them agree."""
    found = best_lag(one, told, (-_LAGS, _LAGS))
    return found.lag if found.told else None


def _factor(file: str, recording: Recording, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are told a factor too large or too small, where some sensor says so and none that they are not.

    Two sensors that show one factor are sure of it: a field turns by the clock and a gyroscope by its scale, so that no
    single fault of either does it to both. One alone contradicts what is told, and either may be wrong.
    """
    multiples = {name: found for name, one in shown.items() if (found := one.multiple(told)) is not None}
    off = {name: one for name, one in multiples.items() if one.constant and not one.is_near(1.0)}
    said = {name: [other for other, its in off.items() if its.is_near(one.factor)] for name, one in off.items()}
    if not said:
        return None
    surest = max(said, key=lambda name: len(said[name]))
    factor, saying = off[surest].factor, said[surest]
    # against two that show it one must agree with what is told; one alone is not believed beside any that does not
    against = [one for one in multiples.values() if not one.is_near(factor) and (len(saying) == 1 or one.is_near(1.0))]
    if against:
        return None
    what = f"is {1.0 / factor:.3g} times the rate that the {_all(saying)} show{'s' if len(saying) == 1 else ''}"
    cause = "a profile of another run, or a gear" if file == _COMMAND else "edges per turn, or a wheel's ratio"
    cause += _late_for_a_factor(recording, told, factor)
    if len(saying) > 1:
        return ReferenceDoubt("factor", file, what, "one rate", f"multiply its rates by {factor:.4g} ({cause}?)")
    remedy = f"wrong is either {file} ({cause}; then multiply its rates by {factor:.4g}) or {_OWN_CAUSES[surest]}"
    return ReferenceDoubt("factor", file, what, "one rate", remedy, sure=False)


def _late_for_a_factor(recording: Recording, told: Samples, factor: float) -> str:
    """Say by how much a clock is off that reads as a factor where a rig runs down; empty where none would."""
    if plant_of(recording).airborne or plant_of(recording).commanded or not np.all(told.value[[0, -1]]):
        return ""
    falls = float(np.log(abs(told.value[0] / told.value[-1]))) / float(told.t[-1] - told.t[0])
    # r(t - lag) = r(t) exp(falls lag) is 1 / factor of what is shown
    lag = -float(np.log(factor)) / falls if falls > 0.0 else np.inf
    return f", or times {abs(lag):.2g} s {'late' if lag > 0.0 else 'early'}" if abs(lag) < _LAGS else ""


def _apart(one: ShownRate, told: Samples) -> float | None:
    """Return what is left between a rate that is shown and one that is told (rms of sizes) as a share of the larger.

    None where both are there for too short a time.
    """
    read, said = one.means(told)
    if read.size < FEWEST_SLOTS:
        return None
    size = max(float(np.mean(read**2)), float(np.mean(said**2)))
    return float(np.sqrt(np.mean((read - said) ** 2) / size)) if size > 0.0 else None


def _turn_alike(one: ShownRate, other: ShownRate) -> bool:
    """Tell whether two sensors show one rate while both show any."""
    off = _apart(one, Samples(other.t, other.rate))
    return off is not None and off < _ANOTHER


def _another(file: str, recording: Recording, shown: Mapping[str, ShownRate], told: Samples) -> ReferenceDoubt | None:
    """Return that rates are of another run: no sensor turns by them, and two that do not turn alike.

    A reference beside a command that no table followed is not doubted for it, nor is a command for sure.
    """
    if plant_of(recording).airborne:
        return None
    apart = {name: off for name, one in shown.items() if (off := _apart(one, told)) is not None}
    far = [name for name, off in apart.items() if off > _ANOTHER]
    if len(far) < len(apart):
        return None
    alike = {one: [other for other in far if other == one or _turn_alike(shown[one], shown[other])] for one in far}
    saying = max(alike.values(), key=len, default=[])
    command = file == _COMMAND
    if len(saying) < 2 and not (command and "rate_reference" in saying):
        return None
    show = "show" if len(saying) > 1 else "shows"
    what = f"is off what the {_all(saying)} {show} by {100 * apart[saying[0]]:.0f} % (rms) and follows no factor or lag"
    if not command:
        return ReferenceDoubt("another", file, what, "one rate", "is it the file of another run? leave it out")
    remedy = "is it the profile of another run? If not, the table did not turn as it was asked to"
    return ReferenceDoubt("another", file, what, "one rate", remedy, sure=False)
