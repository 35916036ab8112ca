"""What is stated of a case, and how the truth differs: louder noise than on the sheet, coefficients with a sigma."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.arrays import FloatArray
from discsim.disc import Release, Rig
from discsim.sensors import Noise
from discsim.validation.challenge.cases.case import Case, Run

__all__ = ["noisy", "stated", "with_sigmas"]

#: coefficients that an ordinary flight determines far better than a sigma of some per cent
_WELL_KNOWN = ("CL0", "CLa", "CD0", "CDa", "CM0", "CMa", "CNr")
#: effects that moving the coefficients within a few per cent cannot imitate
_BESIDE_COEFFICIENTS = ("air.wind", "aero.spin_side_force", "event.", "mag.", "accel.", "gyro.", "gps.")


def noisy(case: Case, rng: np.random.Generator, *, everywhere: bool) -> Case:
    """Let some sensors of a ``noise`` case be louder, quieter or slower than stated; ``everywhere`` all are slower."""
    if case.kind != "noise" and not everywhere:
        return case
    instruments = case.instruments
    names = list(instruments.sensors)
    some = len(names) if everywhere else int(rng.integers(1, min(3, len(names)) + 1))
    for name in rng.choice(names, size=some, replace=False).tolist():
        fields = ("position_noise", "velocity_noise") if name == "gps" else ("noise",)
        coloured, louder = everywhere or rng.random() < 0.5, rng.random() < 0.6
        factor = float(rng.uniform(1.3, 3.0) if louder else rng.uniform(0.4, 0.75))
        correlation = float(np.exp(rng.uniform(np.log(0.03), np.log(1.5))))
        for item in fields:
            white = getattr(instruments.sensors[name], item).white
            noise = Noise(white, white * rng.uniform(0.5, 1.5), correlation) if coloured else Noise(white * factor)
            instruments = instruments.fitted(name, **{item: noise})
    return replace(case, instruments=instruments)


def stated(case: Case, rng: np.random.Generator, *, loosely: bool) -> Case:
    """Turn what is drawn so far (the stated numbers) into stated ones with a sigma, and true ones that differ."""
    case = with_sigmas(case, rng, loosely=loosely)
    if case.plant == "flight" and rng.random() < 0.25:
        case = replace(case, stated_releases=tuple(_stated_release(run, rng) for run in case.runs))
    return case


def with_sigmas(case: Case, rng: np.random.Generator, *, loosely: bool) -> Case:
    """State some numbers with a sigma, by which the true ones differ; ``loosely``: all that can have one."""
    if case.plant == "spin_down":
        return _stated_rig(case, rng, loosely=loosely)
    return _stated_coefficients(case, rng, loosely=loosely) if case.plant == "flight" else case


def _within(rng: np.random.Generator, size: int, largest: float) -> FloatArray:
    """Draw standard deviates (size,) none of which exceeds ``largest``."""
    z = rng.standard_normal(size)
    while np.any(far := np.abs(z) > largest):
        z[far] = rng.standard_normal(int(np.count_nonzero(far)))
    return z


def _beyond(rng: np.random.Generator) -> float:
    return float(rng.uniform(4.5, 8.0) * (1.0 if rng.random() < 0.5 else -1.0))


def _stated_rig(case: Case, rng: np.random.Generator, *, loosely: bool) -> Case:
    uncertain = rng.random() < 0.5
    if not (uncertain or loosely):
        return case
    assert case.stated_rig is not None
    viscous = case.stated_rig.viscous
    sigma = float(f"{0.1 * viscous:.3g}")
    z = _beyond(rng) if case.kind == "beyond_sigma" else float(_within(rng, 1, 2.2)[0])
    true = float(f"{viscous + z * sigma:.6g}")
    stated = replace(case.stated_rig, sigma={"viscous_N_m_s": sigma})
    return replace(case, stated_rig=stated, rig=Rig(stated.Izz, true), moved={"viscous_N_m_s": true})


def _stated_coefficients(case: Case, rng: np.random.Generator, *, loosely: bool) -> Case:
    beside = all(item.effect.id.startswith(_BESIDE_COEFFICIENTS) for item in case.concealed)
    competing = case.kind == "one" and beside and rng.random() < 0.15
    disc = case.stated_disc
    assert disc is not None
    assert disc.aero is not None
    if not (competing or loosely) or disc.aero_table is not None:
        return case
    share = float(rng.choice([0.02, 0.03, 0.04]))
    names = [name for name in disc.aero._fields if name != "alpha0"]
    z = dict(zip(names, _within(rng, len(names), 1.5 if case.kind == "beyond_sigma" else 2.2), strict=True))
    if case.kind == "beyond_sigma":
        z[str(rng.choice(_WELL_KNOWN))] = _beyond(rng)
    stated = disc.aero._asdict()
    sigma = {name: float(f"{abs(share * stated[name]):.6g}") for name in names}
    true = {name: float(f"{stated[name] + float(z[name]) * sigma[name]:.7g}") for name in names}
    return replace(
        case,
        disc=replace(disc, aero=disc.aero._replace(**true)),
        stated_disc=replace(disc, sigma=sigma),
        moved=true,
    )


def _stated_release(run: Run, rng: np.random.Generator) -> Release:
    """State a release as a hand-held camera would see it."""
    assert isinstance(run, Release)
    assert run.velocity is not None
    assert run.body_rate is not None
    sigma: dict[str, float | FloatArray] = {"velocity_ned_m_s": 0.6, "body_rate_rad_s": 2.0}
    velocity = np.round(run.velocity + 0.6 * rng.standard_normal(3), 2)
    body_rate = np.round(run.body_rate + 2.0 * rng.standard_normal(3), 2)
    return Release(velocity=velocity, body_rate=body_rate, sigma=sigma)
