"""Rows of the catalogue: what a baseline leaves out of sensors and their clocks.

The fields are those of `discsim.effects.kind.Row`; docs/effects.md is made from them.
"""

from __future__ import annotations

from math import inf

from discsim.effects import sensors
from discsim.effects.kind import EVERYWHERE, FLIGHT, UNSEEN_IN_MEANS, Row, with_article

__all__ = ["ROWS"]

_AWAY = "its spin phase runs away from that of the other sensors"


def _lag(prefix: str, sensor: str) -> Row:
    """Return the row of a sensor that lags to first order."""
    return Row(
        f"{prefix}.lag",
        sensors.Lag,
        sensor,
        EVERYWHERE,
        (1e-4,),
        title=f"{with_article(sensor)} that lags",
        form="{tau_s} ẏ = x − y, y the reading",
        grows_with="spin",
        trace="readings are late and too small, more so the faster the disc spins",
        bounds={"tau_s": (0.0, 0.5)},
        sign={"tau_s": 1.0},
    )


def _clock(prefix: str, sensor: str, called: str, trace: str, scale: float = 1e-5) -> Row:
    """Return the row of a sensor whose own clock runs at another rate."""
    return Row(
        f"{prefix}.clock_rate",
        sensors.ClockRate,
        sensor,
        FLIGHT if sensor == "gps" else EVERYWHERE,
        (scale,),
        title=f"a wrong clock of {called}",
        form=f"written time = {{ratio}} × true time, of {called}",
        grows_with="time",
        trace=trace,
        bounds={"ratio": (0.7, 1.4)},
        moves_time=True,
        unseen_on=UNSEEN_IN_MEANS.get(sensor, ()),
    )


def _dropped_samples(prefix: str, sensor: str) -> Row:
    """Return the row of a sensor that loses samples without a trace."""
    return Row(
        f"{prefix}.dropped_samples",
        sensors.DroppedSamples,
        sensor,
        EVERYWHERE,
        (0.001,),
        title=f"lost samples of the {sensor}",
        form=f"a share of {{fraction}} of the {sensor}'s samples is lost, the rest written as if none were",
        grows_with="time, in steps",
        trace="its spin phase steps ahead each time a sample is lost",
        detector="dropped_samples",
        unseen_on=UNSEEN_IN_MEANS.get(sensor, ()),
    )


ROWS = (
    Row(
        "mag.hard_iron",
        sensors.HardIron,
        "magnetometer",
        EVERYWHERE,
        (0.5, 0.5, 0.5),
        title="a magnet on board (hard iron)",
        form="m → m + ({bx_uT}, {by_uT}, {bz_uT}) in body axes",
        grows_with="nothing: it is constant",
        trace="a constant field in body axes",
    ),
    Row(
        "mag.soft_iron",
        sensors.SoftIron,
        "magnetometer",
        EVERYWHERE,
        (0.005,) * 6,
        title="iron on board that bends the field (soft iron)",
        form="m → (I + S) m, S symmetric: xx {sxx}, xy {sxy}, xz {sxz}, yy {syy}, yz {syz}, zz {szz}",
        grows_with="field in body axes",
        trace="the field is bent: the circle of the readings is an ellipse",
        in_percent=True,
    ),
    _lag("mag", "magnetometer"),
    Row(
        "mag.stray_field",
        sensors.StrayField,
        "magnetometer",
        FLIGHT,
        (0.5, 0.5, 0.5, 0.1),
        title="a stray magnetic field near the ground",
        form="m += ({bn_uT} north, {be_uT} east, {bd_uT} down) · exp(−h / {height_m})",
        grows_with="nearness of the ground",
        trace="a foreign field fixed to the ground, stronger near it",
        bounds={"height_m": (0.05, 100.0)},
        grid={"height_m": (0.3, 0.6, 1.2, 2.5, 6.0)},
        grid_sigma={"height_m": 20.0},
    ),
    _clock("mag", "magnetometer", "the magnetometer", _AWAY),
    _dropped_samples("mag", "magnetometer"),
    _lag("accel", "accelerometer"),
    _clock("accel", "accelerometer", "the accelerometer", _AWAY),
    _dropped_samples("accel", "accelerometer"),
    Row(
        "accel.position_offset",
        sensors.PositionOffset,
        "accelerometer",
        EVERYWHERE,
        (5e-05, 5e-05, 5e-05),
        title="an accelerometer that sits elsewhere than stated",
        form="position = stated + ({dx_m}, {dy_m}, {dz_m})",
        grows_with="square of the spin",
        trace="a reading that grows with the square of the spin",
        on_disc=True,
    ),
    Row(
        "accel.bias",
        sensors.AccelerometerBias,
        "accelerometer",
        EVERYWHERE,
        (0.02, 0.02, 0.02),
        title="a bias of the accelerometer",
        form="f → f + ({bx_m_s2}, {by_m_s2}, {bz_m_s2})",
        grows_with="nothing: it is constant",
        trace="a constant reading in body axes",
    ),
    Row(
        "accel.bias_drift",
        sensors.BiasDrift,
        "accelerometer",
        EVERYWHERE,
        (0.01, 0.01, 0.01),
        title="a drifting bias of the accelerometer",
        form="f → f + ({bx_m_s3}, {by_m_s3}, {bz_m_s3}) · t",
        grows_with="time",
        trace="a reading that grows with time",
    ),
    Row(
        "accel.scale",
        sensors.Scale,
        "accelerometer",
        EVERYWHERE,
        (0.002, 0.002, 0.002),
        title="a scale error of the accelerometer",
        form="f<sub>i</sub> → (1 + s<sub>i</sub>) f<sub>i</sub>, s = ({sx}, {sy}, {sz})",
        grows_with="specific force",
        trace="readings are off in proportion to themselves",
        in_percent=True,
    ),
    Row(
        "accel.cross_axis",
        sensors.CrossAxis,
        "accelerometer",
        EVERYWHERE,
        (0.002,) * 6,
        title="cross-axis sensitivity of the accelerometer",
        form="f → (I + S) f, S: xy {sxy}, xz {sxz}, yx {syx}, yz {syz}, zx {szx}, zy {szy}",
        grows_with="specific force on another axis",
        trace="one axis shows a share of another",
        in_percent=True,
    ),
    Row(
        "accel.saturation",
        sensors.AccelerometerSaturation,
        "accelerometer",
        EVERYWHERE,
        (1.0,),
        title="an accelerometer that clips below its range",
        form="|f<sub>i</sub>| is cut at {limit_m_s2}",
        grows_with="specific force",
        trace="readings stop below the stated range",
        bounds={"limit_m_s2": (0.5, inf)},
        detector="saturation",
        hides_readings=True,
    ),
    _lag("gyro", "gyroscope"),
    _clock("gyro", "gyroscope", "the gyroscope", "its phase runs away from that of the other sensors"),
    Row(
        "gyro.bias",
        sensors.GyroscopeBias,
        "gyroscope",
        EVERYWHERE,
        (0.001, 0.001, 0.001),
        title="a bias of the gyroscope",
        form="ω → ω + ({bx_rad_s}, {by_rad_s}, {bz_rad_s})",
        grows_with="nothing: it is constant",
        trace="a constant reading in body axes",
    ),
    Row(
        "gyro.scale",
        sensors.Scale,
        "gyroscope",
        EVERYWHERE,
        (0.002, 0.002, 0.002),
        title="a scale error of the gyroscope",
        form="ω<sub>i</sub> → (1 + s<sub>i</sub>) ω<sub>i</sub>, s = ({sx}, {sy}, {sz})",
        grows_with="rate",
        trace="readings are off in proportion to themselves",
        in_percent=True,
    ),
    Row(
        "gyro.g_sensitivity",
        sensors.GSensitivity,
        "gyroscope",
        EVERYWHERE,
        (1e-05, 1e-05, 1e-05),
        title="a gyroscope that feels acceleration",
        form="ω<sub>i</sub> → ω<sub>i</sub> + k<sub>i</sub> f<sub>i</sub>, k = ({kx}, {ky}, {kz})",
        grows_with="specific force",
        trace="readings grow with the specific force",
        units={"kx": "rad/s per m/s²", "ky": "rad/s per m/s²", "kz": "rad/s per m/s²"},
        needs=("accelerometer",),
    ),
    _clock("gps", "gps", "the GPS", "fixes run away from the motion that the other sensors show", 1e-4),
    Row(
        "gps.latency",
        sensors.Latency,
        "gps",
        FLIGHT,
        (0.002,),
        title="GPS fixes that come late",
        form="a fix stamped t shows the state at t − {delay_s}",
        grows_with="speed",
        trace="fixes show where the disc was a moment before",
        bounds={"delay_s": (0.0, 2.0)},
        sign={"delay_s": 1.0},
        moves_time=True,
    ),
    Row(
        "clock.rate",
        sensors.ClockRate,
        "clock",
        EVERYWHERE,
        (1e-05,),
        title="a wrong clock of the recorder",
        form="written time = {ratio} × true time, of all sensors",
        grows_with="time",
        trace="all rates and times are off by one and the same factor",
        bounds={"ratio": (0.7, 1.4)},
        moves_time=True,
    ),
)
