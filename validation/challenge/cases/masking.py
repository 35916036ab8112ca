"""Put a mask over a case: the same plant, runs, sensors and secrets, with one thing that makes them harder to find.

What a mask needs by chance is drawn from a stream of its own, so that everything it does not touch stays as it is.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from discsim.effects.catalogue import row
from discsim.errors import InputError
from discsim.sensors import Instruments
from discsim.shipped import load_disc
from discsim.validation.challenge.cases.case import Case, Coast, Concealed, Mask
from discsim.validation.challenge.cases.detection_limit import sizes
from discsim.validation.challenge.cases.hiding import can_act, choose, choose_secret, possible
from discsim.validation.challenge.cases.off_catalogue import log_uniform
from discsim.validation.challenge.cases.sensor_kits import module
from discsim.validation.challenge.cases.sizes import earlier, scaled
from discsim.validation.challenge.cases.stating import noisy, with_sigmas

__all__ = ["masked"]

#: lengths of what a ``short`` case records, s
SHORT_FLIGHT_S, SHORT_RUN_S = 1.5, 6.0
#: ranges of ``clipped`` sensors: 8 g in m/s^2, 500 deg/s in rad/s
_CLIPPED = {"accelerometer": 78.4532, "gyroscope": 8.7266}
#: how far from its detection limit an effect is that lies near it, in limits
_NEAR = (0.4, 4.0)
#: effects that have no limit to scale to: a saturation does not grow with its size, and of losses as rare as one
#: sensor's clock is accurate not one falls into a recording
_NOT_SCALED = ("accel.saturation", "mag.dropped_samples", "accel.dropped_samples")


def masked(case: Case, mask: Mask, asked: Sequence[str] = ()) -> Case:
    """Return a case under a mask; effects that were ``asked`` for are not exchanged.

    Raises `InputError` where such an effect cannot act under the mask.
    """
    rng = np.random.default_rng([case.seed, 1])
    if mask == "near_limit":
        return _near_limit(case, rng)
    if mask == "stated_loosely":
        return _stated_loosely(case, rng)
    if mask == "coloured_noise":
        return noisy(case, rng, everywhere=True)
    if mask == "second_effect":
        return _doubled(case, rng)
    if mask == "few_recordings":
        few = [replace(item, recording=item.recording and item.recording % 2) for item in case.concealed]
        return replace(case, runs=case.runs[:2], stated_releases=case.stated_releases[:2], concealed=tuple(few))
    if mask == "short":
        return _shortened(case)
    return _with_what_shows(_with_fewer_readings(case, mask, rng), mask, asked, rng)


def _near_limit(case: Case, rng: np.random.Generator) -> Case:
    """Draw the sizes of what is concealed anew, near the case's own detection limits."""
    limits, near = sizes(case), []
    for item in case.concealed:
        size = limits[item.effect.id]
        if size > 0.0 and item.effect.id not in _NOT_SCALED:
            item = replace(item, effect=scaled(item.effect, log_uniform(rng, *_NEAR) / size, case.plant))
        near.append(item)
    return replace(case, concealed=tuple(near))


def _stated_loosely(case: Case, rng: np.random.Generator) -> Case:
    """Let every stated number be off by its sigma; a disc with tables, which have none, is the driver instead."""
    if case.moved:
        return case
    if case.plant == "flight" and case.stated_disc is not None and case.stated_disc.aero_table is not None:
        driver, _ = load_disc("driver")
        case = replace(case, disc=driver, stated_disc=driver)
    return with_sigmas(case, rng, loosely=True)


def _doubled(case: Case, rng: np.random.Generator) -> Case:
    """Put another effect of its largest size beside the first."""
    if not case.concealed:
        return case
    first = case.concealed[:1]
    return replace(case, kind="two", concealed=(*first, choose(case, rng, first, largest=True)))


def _shortened(case: Case) -> Case:
    """Record less of each run; an event falls as far into what is left as it did before."""
    runs = [replace(run, duration=SHORT_RUN_S) if isinstance(run, Coast) else run for run in case.runs]
    shorter = replace(case, runs=tuple(runs), longest=SHORT_FLIGHT_S)
    share = shorter.recorded / case.recorded
    concealed = [replace(item, effect=earlier(item.effect, share)) for item in case.concealed]
    return replace(shorter, concealed=tuple(concealed))


def _with_fewer_readings(case: Case, mask: Mask, rng: np.random.Generator) -> Case:
    """Clip accelerometer and gyroscope, or leave the magnetometer alone on board."""
    sensors = case.instruments.sensors
    if mask == "magnetometer_only":
        magnetometer = sensors.get("magnetometer") or module(case.plant, rng)["magnetometer"]
        left, sheets = Instruments({"magnetometer": magnetometer}), magnetometer
        if "magnetometer" in sensors:
            sheets = case.sheets_of.sensors["magnetometer"]
        return replace(case, instruments=left, sheets_of=Instruments({"magnetometer": sheets}))
    instruments, sheets_of = case.instruments, case.sheets_of
    for name in sorted(_CLIPPED.keys() & sensors.keys()):
        instruments = instruments.fitted(name, range=_CLIPPED[name])
        sheets_of = sheets_of.fitted(name, range=_CLIPPED[name])
    return replace(case, instruments=instruments, sheets_of=sheets_of)


def _with_what_shows(case: Case, mask: Mask, asked: Sequence[str], rng: np.random.Generator) -> Case:
    """Exchange what cannot act or show with these sensors."""
    showing = possible(case)
    lost = [item.effect.id for item in case.concealed if item.effect.id not in showing]
    if wanted := sorted(set(asked) & set(lost)):
        raise InputError(f"mask {mask}: leaves no {row(wanted[0]).acts_on} to conceal {wanted[0]} in")
    concealed: list[Concealed] = [item for item in case.concealed if item.effect.id in showing]
    for _ in lost:
        concealed.append(choose(case, rng, concealed))
    if case.secret is not None and not can_act(case.secret, case):
        case = replace(case, secret=choose_secret(case, rng))
    return replace(case, concealed=tuple(concealed))
