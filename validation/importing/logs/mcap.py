"""An MCAP log (ROS 2, Foxglove) as tables: messages of sensor_msgs, in CDR or JSON.

Units are those of the messages' definitions (sensor_msgs, REP 103): Imu rad/s and m/s^2, MagneticField tesla, NavSatFix
degrees and m above the ellipsoid. Times are those of the readings (header.stamp), or of logging where there are none.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

import numpy as np

from discsim.validation.importing.logs.tables import Log, Rows, chosen

__all__ = ["MESSAGES", "begins", "read"]

MAGIC = b"\x89MCAP0\r\n"
MESSAGES = ("Imu", "MagneticField", "NavSatFix")
#: The first element of a covariance that says that the log has no such reading (sensor_msgs/Imu).
NO_READING = -1.0
#: The status of a NavSatFix without a fix (sensor_msgs/NavSatStatus).
NO_FIX = -1
MICRO = 1e6  # uT in a tesla


def begins(head: bytes) -> bool:
    """Tell an MCAP log."""
    return head.startswith(MAGIC)


def read(raw: Path) -> Log:
    """Return the tables of a log; one that breaks off, or is damaged somewhere, is read up to there."""
    gathered = _Gathered()
    problem = ""
    with raw.open("rb") as stream:
        try:
            gathered.take(stream)
        except ImportError:
            raise
        except Exception as error:  # whatever a parser of bytes stumbles on in a damaged file
            problem = str(error) or type(error).__name__
    notes = [f"it breaks off or is damaged ({problem}); read up to there"] * bool(problem)
    notes += [f"topic {topic} is not read; its encoding is {what}" for topic, what in gathered.unread.items()]
    tables, others = chosen(gathered.rows.sources())
    return Log(tables, (*notes, *others), bool(problem))


class _Gathered:
    """Gathers readings by topic; ``unread`` are topics of a sensor in an encoding that is not known here."""

    def __init__(self) -> None:
        self.rows = Rows()
        self.unread: dict[str, str] = {}
        self._origin: int | None = None
        self._decoders: dict[int, Callable[[bytes], Any] | None] = {}

    def take(self, stream: IO[bytes]) -> None:
        """Take the messages of a log in the order of the file; raises what the parser stumbles on."""
        from mcap.reader import NonSeekingReader
        from mcap_ros2.decoder import DecoderFactory

        ros2 = DecoderFactory()
        for schema, channel, message in NonSeekingReader(stream, validate_crcs=True).iter_messages(
            log_time_order=False
        ):
            package, _, kind = ("" if schema is None else schema.name).replace("/msg/", "/").partition("/")
            if schema is None or package != "sensor_msgs" or kind not in MESSAGES:
                continue
            if channel.id not in self._decoders:
                is_json = channel.message_encoding == "json"
                known = json.loads if is_json else ros2.decoder_for(channel.message_encoding, schema)
                self._decoders[channel.id] = known
                if known is None:
                    self.unread[channel.topic] = f"{channel.message_encoding} with a schema in {schema.encoding}"
            decode = self._decoders[channel.id]
            if decode is not None:
                self._add(channel.topic, kind, decode(message.data), message.log_time)

    def _add(self, topic: str, kind: str, content: Any, logged: int) -> None:
        stamp = _stamp(content) or logged
        self._origin = stamp if self._origin is None else self._origin
        # ns since 1970 are more digits than a float holds: times count from the first message
        time = 1e-3 * (stamp - self._origin)
        if kind == "Imu":
            for sensor, field in (("gyroscope", "angular_velocity"), ("accelerometer", "linear_acceleration")):
                covariance = _get(content, f"{field}_covariance")
                if not covariance or covariance[0] != NO_READING:
                    self.rows.add(topic, sensor, time, _xyz(_get(content, field)))
        elif kind == "MagneticField":
            values = [MICRO * value for value in _xyz(_get(content, "magnetic_field"))]
            self.rows.add(topic, "magnetometer", time, values)
        elif _get(_get(content, "status"), "status") != NO_FIX:
            place = [float(_get(content, name)) for name in ("latitude", "longitude", "altitude")]
            self.rows.add(topic, "gps", time, (*place, np.nan, np.nan, np.nan))


def _get(content: Any, name: str) -> Any:
    """Return a field of a decoded message, or of one in JSON; None where it is not there."""
    return content.get(name) if isinstance(content, dict) else getattr(content, name, None)


def _xyz(vector: Any) -> list[float]:
    values = [_get(vector, axis) for axis in "xyz"]
    return [np.nan if value is None else float(value) for value in values]  # JSON writes null for no number


def _stamp(content: Any) -> int:
    """Return the time of the reading, ns; 0 where none is stated. JSON calls the fraction as ROS 1 or ROS 2 does."""
    stamp = _get(_get(content, "header"), "stamp")
    fraction = _get(stamp, "nanosec")
    fraction = _get(stamp, "nsec") if fraction is None else fraction
    return int(1_000_000_000 * (_get(stamp, "sec") or 0) + (fraction or 0))
