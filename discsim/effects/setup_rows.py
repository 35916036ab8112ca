"""Rows of the catalogue: faults of the setup, which are no physics: columns, units, times, mounts, the stated field.

The fields are those of `discsim.effects.kind.Row`; docs/effects.md is made from them.
"""

from __future__ import annotations

from typing import Any

from discsim.effects import setup
from discsim.effects.kind import BOARD, EVERYWHERE, FLIGHT, UNSEEN_IN_MEANS, Row, with_article

__all__ = ["ROWS"]

_SHIFTED = "readings are early or late by one and the same time"
_TURNED = f"{_SHIFTED}, all of their size there"


def _axes(prefix: str, sensor: str) -> Row:
    """Return the row of a sensor of the board whose columns are a signed permutation of the body's axes."""
    return Row(
        f"{prefix}.axes",
        setup.Axes,
        sensor,
        EVERYWHERE,
        (),
        setup=True,
        title=f"{with_article(sensor)} whose axes are mixed up",
        form="columns x, y, z hold {axes} of the body",
        grows_with="nothing: it is constant",
        trace=f"the {sensor}'s columns hold other axes than stated",
    )


def _unit(prefix: str, sensor: str, type: type[Any], quantity: str) -> Row:
    """Return the row of a sensor whose numbers are written in another unit."""
    return Row(
        f"{prefix}.units",
        type,
        sensor,
        EVERYWHERE,
        (),
        setup=True,
        title=f"{with_article(sensor)} in another unit",
        form="numbers are written in {written_in}",
        grows_with=quantity,
        trace=f"{quantity}s are off by the factor between two units",
    )


def _time_offset(prefix: str, sensor: str, grows_with: str, trace: str) -> Row:
    """Return the row of a sensor whose times are all early or late by the same."""
    return Row(
        f"{prefix}.time_offset",
        setup.TimeOffset,
        sensor,
        EVERYWHERE if sensor in BOARD else FLIGHT,
        (1e-4,),
        setup=True,
        title=f"times of the {sensor} that are shifted",
        form="written time = true time + {offset_s}",
        grows_with=grows_with,
        trace=trace,
        bounds={"offset_s": (-2.0, 2.0)},
        moves_time=True,
        unseen_on=UNSEEN_IN_MEANS.get(sensor, ()),
        each_its_own=sensor not in BOARD,
    )


ROWS = (
    _axes("mag", "magnetometer"),
    _axes("accel", "accelerometer"),
    _axes("gyro", "gyroscope"),
    Row(
        "gps.axes",
        setup.GpsAxes,
        "gps",
        FLIGHT,
        (),
        setup=True,
        title="a GPS in other directions than stated",
        form="columns north, east, down, and their velocities, hold {axes}",
        grows_with="nothing: it is constant",
        trace="the GPS's columns hold other directions than stated",
    ),
    _unit("mag", "magnetometer", setup.MagnetometerUnit, "field"),
    _unit("accel", "accelerometer", setup.AccelerometerUnit, "specific force"),
    _unit("gyro", "gyroscope", setup.GyroscopeUnit, "rate"),
    _time_offset("mag", "magnetometer", "spin", _TURNED),
    _time_offset("accel", "accelerometer", "spin", _TURNED),
    _time_offset("gyro", "gyroscope", "rate of change", _SHIFTED),
    # a film, or a receiver's log, is begun by hand; that fixes come late by themselves is gps.latency
    _time_offset("track", "track", "speed", "the track shows where the disc will be a moment later, or was before"),
    _time_offset("gps", "gps", "speed", "fixes show where the disc will be a moment later")._replace(
        title="GPS fixes that are stamped early",
        form="written time = true time + {offset_s}, of the GPS; a late one is its latency",
        scale=(0.002,),
        bounds={"offset_s": (-2.0, 0.0)},
        sign={"offset_s": -1.0},
    ),
    Row(
        "board.rotation",
        setup.BoardRotation,
        "board",
        EVERYWHERE,
        (0.002, 0.002, 0.002),
        setup=True,
        title="a sensor board that is turned in the disc",
        form="readings = C<sup>T</sup> (true vector), C the rotation by ({rx_rad}, {ry_rad}, {rz_rad})",
        grows_with="the vector itself",
        trace="all sensors of the board show what is along other axes of the disc",
        in_all=True,
    ),
    Row(
        "site.field",
        setup.SiteField,
        "magnetometer",
        EVERYWHERE,
        (0.002, 0.002, 0.002),
        setup=True,
        title="another magnetic field than stated",
        form="stated field turned about down by {declination_rad}, dipped further by {inclination_rad}, times {ratio}",
        grows_with="nothing: it is constant",
        trace="the field points elsewhere, or is of another size, than stated",
        bounds={"ratio": (0.2, 5.0)},
        positive=("ratio",),
        # a free spin has no direction beside that of the field
        untold={"free_spin": ("declination_rad", "inclination_rad")},
        in_all=True,
    ),
    Row(
        "clock.units",
        setup.ClockUnit,
        "clock",
        EVERYWHERE,
        (),
        setup=True,
        title="times in another unit",
        form="times of all sensors are written in {written_in}",
        grows_with="time",
        trace="times are off by the factor between two units",
    ),
)
