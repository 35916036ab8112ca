"""Made-up outcomes of diagnoses, one of each verdict: what a report must be able to show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from discsim.effects import effect
from discsim.model_file import Model, ModelEffect
from discsim.shipped import load_disc
from discsim.validation.diagnosis.result import (
    Candidate,
    Confusion,
    Diagnosis,
    Evidence,
    FitFigures,
    HeldOut,
    Law,
    Located,
    NamedEffect,
    NoiseNote,
    Outcome,
    Outlier,
    ParameterValue,
    Recalibration,
    Residuals,
)

NAMES = ("01", "02", "03", "04", "05", "06")
AXES = {
    "magnetometer": (100.0, ("x_uT", "y_uT", "z_uT")),
    "accelerometer": (200.0, ("x_m_s2", "y_m_s2", "z_m_s2")),
    "gyroscope": (200.0, ("x_rad_s", "y_rad_s", "z_rad_s")),
    "gps": (10.0, ("north_m", "east_m", "down_m", "v_north_m_s", "v_east_m_s", "v_down_m_s")),
}
NOISE = (
    NoiseNote("gps.position", 0.15, 0.21, 1.5),
    NoiseNote("gps.velocity", 0.06, 0.061, 0.0),
    NoiseNote("magnetometer", 0.6, 0.59, 0.0),
    NoiseNote("accelerometer", None, 0.083, 0.0),
)


def residuals(mismatch: bool) -> tuple[Residuals, ...]:
    """Return residuals of six flights; with a mismatch GPS drifts, and one accelerometer is struck at 1.4 s."""
    rng = np.random.default_rng(5)
    found = []
    for number, name in enumerate(NAMES):
        for sensor, (rate, axes) in AXES.items():
            t = np.arange(0.0, 6.5 + 0.1 * number, 1.0 / rate)
            for axis in axes:
                noise = rng.standard_normal(t.size)
                before = noise.copy()
                if mismatch and sensor == "gps":
                    before += 2.0 * t * (1.0 if "north" in axis else -0.6 if "east" in axis else 0.1)
                if mismatch and sensor == "magnetometer":
                    before += 0.4 * t * np.sin(60.0 * t)
                if mismatch and sensor == "accelerometer" and name == "02":
                    before += 60.0 * np.exp(-(((t - 1.4) / 0.01) ** 2) / 2)
                if sensor == "gyroscope" and axis == "z_rad_s":
                    noise, before = np.full(t.size, np.nan), np.full(t.size, np.nan)  # clipped throughout
                found.append(Residuals(name, sensor, axis, t, before, noise))
    return tuple(found)


def consistent() -> Outcome:
    """Return an outcome with nothing to find."""
    disc, environment = load_disc("driver")
    answer = Diagnosis(
        ("calm-evening",),
        "flight",
        0,
        "consistent",
        FitFigures(1.002, 1.01),
        FitFigures(1.002, 1.01),
        recalibrated={"CL0": Recalibration(0.13, 0.0026, 0.1327, 0.0004)},
        noise=NOISE,
        heldout=tuple(HeldOut(name, 1.01, 1.01, 0.3) for name in NAMES),
    )
    ranking = tuple(
        Candidate(id, gain, note="no better than chance") for id, gain in (("aero.stall", 9.1), ("gyro.bias", 7.4))
    )
    return Outcome(answer, Model(environment, disc), residuals(False), ranking)


def recalibrated() -> Outcome:
    """Return an outcome in which a stated coefficient is off."""
    outcome = consistent()
    moved = {
        "CNr": Recalibration(-0.0045, 0.0002, -0.00531, 0.00002),
        "CL0": Recalibration(0.13, 0.0026, 0.1327, 0.0004),
    }
    answer = replace(
        outcome.diagnosis,
        datasets=("stated-loosely",),
        verdict="recalibrated",
        baseline=FitFigures(3.4, 3.5),
        recalibrated=moved,
    )
    return replace(outcome, diagnosis=answer, residuals=residuals(True))


#: what is found in `explained`
WIND = NamedEffect(
    "air.wind",
    {"w_north_m_s": ParameterValue(1.091, 0.021), "w_east_m_s": ParameterValue(-0.712, 0.019)},
    Evidence(5120.0, 640.2, 0.0),
)
TOUCH = NamedEffect(
    "event.impulse",
    {
        "t_s": ParameterValue(1.4013, 0.0004),
        "dv_north_m_s": ParameterValue(0.61, 0.01),
        "dv_east_m_s": ParameterValue(-0.02, 0.01),
        "dv_down_m_s": ParameterValue(0.3, 0.012),
    },
    Evidence(830.0, 95.0, 1e-180),
    ("02",),
)
OFFSET = NamedEffect(
    "accel.position_offset",
    {"dx_m": ParameterValue(0.00121, 0.00002)},
    Evidence(410.0, 44.0, 1e-90),
    confused_with=(Confusion("accel.scale", 404.0, "A rate-table run with the sensor at another radius"),),
)
LOCATED = (
    Located(
        "all",
        "gps",
        "v_north_m_s",
        0.0,
        7.0,
        0.61,
        "velocity drifts along a fixed compass direction whatever the heading of the throw",
        "time aloft",
    ),
    Located("02", "accelerometer", "all", 1.37, 1.43, 0.22, "one blow, felt on all three axes at once"),
    Located("all", "magnetometer", "x_uT", 0.0, 7.0, 0.05, "the spin phase runs away", "time aloft"),
)
RANKING = (
    Candidate("air.wind", 5141.0, {"w_north_m_s": 1.09, "w_east_m_s": -0.71}, note="named"),
    Candidate(
        "air.wind_shear",
        5140.2,
        {"w_north_m_s": 1.1, "w_east_m_s": -0.72, "exponent": 0.01},
        note="no better than the simpler air.wind",
    ),
    Candidate("gps.latency", 2201.0, {"delay_s": 0.08}, note="worse on held-out recordings"),
    Candidate("event.impulse", 842.0, {"t_s": 1.4}, ("02",), "named"),
    *(
        Candidate(id, 30.0 - k, note="no better than chance")
        for k, id in enumerate(
            (
                "aero.stall",
                "mag.lag",
                "clock.rate",
                "air.density",
                "gyro.bias",
                "gyro.scale",
                "accel.lag",
                "mag.soft_iron",
                "mag.hard_iron",
                "aero.spin_lift",
                "aero.spin_drag",
                "aero.yaw_alpha",
                "accel.bias",
            )
        )
    ),
)


def explained() -> Outcome:
    """Return an outcome with a wind, a touch in one flight, and a pair that these recordings cannot tell apart."""
    disc, environment = load_disc("driver")
    answer = Diagnosis(
        ("open-field", "second-day"),
        "flight",
        0,
        "explained",
        FitFigures(12.96, 13.02),
        FitFigures(1.00, 1.01),
        LOCATED,
        (TOUCH, WIND, OFFSET),
        {"CL0": Recalibration(0.13, 0.0026, 0.1327, 0.0004)},
        noise=NOISE,
        heldout=tuple(HeldOut(name, 9.0 + k, 1.0 + 0.01 * k, 100.0 + k) for k, name in enumerate(NAMES)),
        outliers=(Outlier("04", "gps", "north_m", 3.2, 8.4), Outlier("05", "gps", "east_m", 1.1, -6.0)),
        next_recordings=("A throw at 20 m/s with half the spin",),
        warnings=(
            "The gyroscope's z axis stands at its range throughout: it says only that the rate is above 34.9 rad/s.",
        ),
    )
    model = Model(
        environment,
        disc,
        effects=(
            ModelEffect(effect("air.wind", w_north_m_s=1.091, w_east_m_s=-0.712), {"w_north_m_s": 0.021}),
            ModelEffect(effect("event.impulse", t_s=1.4013, dv_north_m_s=0.61, dv_down_m_s=0.3), recordings=("02",)),
        ),
    )
    return Outcome(answer, model, residuals(True), RANKING, {"pieces": "0.5 s"})


def unexplained() -> Outcome:
    """Return an outcome with a law for a moment that the catalogue does not hold."""
    law = Law(
        "c * |r|^n * sign(r)",
        "moment_z_N_m",
        {"c": ParameterValue(-3.12e-6, 4e-8), "n": ParameterValue(1.503, 0.004)},
        210.0,
    )
    outcome = consistent()
    answer = replace(
        outcome.diagnosis,
        datasets=("odd-bearing",),
        verdict="unexplained",
        baseline=FitFigures(50.0, 52.0),
        final=FitFigures(1.02, 1.03),
        located=(
            Located(
                "all",
                "magnetometer",
                "all",
                0.0,
                7.0,
                0.97,
                "the rate falls faster than the stated friction allows",
                "spin rate",
            ),
        ),
        law=law,
    )
    model = replace(outcome.model, laws=(law.for_model(),))
    return replace(outcome, diagnosis=answer, model=model, residuals=residuals(True))


OUTCOMES = {"consistent": consistent, "recalibrated": recalibrated, "explained": explained, "unexplained": unexplained}
