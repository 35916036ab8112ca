"""What a column's name says. Takes a name; gives the sensor, axis and unit that stand in it (`Name`)."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Sequence
from pathlib import Path
from typing import NamedTuple

from discsim.validation.importing.sniffing.units import readings_of, split_unit

__all__ = [
    "NO_READING",
    "Name",
    "about_axes",
    "foreign_words",
    "is_called_linear",
    "is_of_mavlink",
    "is_of_quaternion",
    "is_spacing_name",
    "is_time_name",
    "last_word",
    "penalty_of",
    "read_name",
    "says_nothing",
    "sensor_of",
    "sensor_of_code",
    "sensor_of_file",
    "timeless",
    "words_of",
]


class Name(NamedTuple):
    """A column's name taken apart: what is left without axis and unit, the axis (0, 1, 2 or None) and the unit."""

    base: str
    axis: int | None
    unit: str


#: Stems of the sensors' names in many languages, without accents; a phone's export is in the phone's language.
_STEMS = {
    "gyroscope": (
        "gyr giro ziro zyro jiro гиро ジャイロ 陀螺 자이로 omega rotationrate rotrate angularvel angvel angularrate "
        "rotationvel rotationalvel rotvel "
        "winkelgeschw drehrate vitesseangulaire vitessederotation velocidadangular velocitaangolare 각속도 角速度"
    ),
    "magnetometer": "mag compass kompass boussole bussola магн 磁 자기 manyetik hmc58 qmc58 lis3m mmc5 ak8963",
    "accelerometer": (
        "acc acel beschl versnell przysp zrychl akseler kiihty gyorsul ускор акселе 加速 가속 ivme "
        "specificforce gforce adxl highg lowg"
    ),
}
#: The same as whole names, once the axis is off: ax, gx, mx; wx, Bx and Hx as physics writes them; gFx of Physics
#: Toolbox; AsX (angular speed) of WitMotion.
_LETTERS = {
    "a": "accelerometer",
    "gf": "accelerometer",
    "g": "gyroscope",
    "w": "gyroscope",
    "om": "gyroscope",
    "as": "gyroscope",
    "ω": "gyroscope",
    "m": "magnetometer",
    "b": "magnetometer",
    "h": "magnetometer",
}
#: Sensors by their number in Android (Sensor.TYPE_GYROSCOPE is 4), and the last that is counted.
_ANDROID = {"1": "accelerometer", "2": "magnetometer", "4": "gyroscope"}
_LAST_OF_ANDROID = 42
#: Words before a g that is none of a gyroscope: high_g_x is an accelerometer's of wide range.
_RANGES = ("high", "low")
#: A column that stands this far back is no sensor's reading.
NO_READING = 9
#: Words of columns that are worked out from a sensor, or are another thing: a fused attitude, an acceleration
#: without gravity or in the earth's axes, errors, set points. The number is how far such a column stands back.
_STAND_BACK = {
    NO_READING: (
        "lin linear user fe fl ned enu earth world ohne without sans senza gravity err error bias offset setpoint "
        "target std var abs absolute absolutbetrag norm magnitude quat euler roll pitch yaw angle orientation vel "
        "velocity pos delta jerk heading recovery temp"
    ),
    2: "uncal uncalibrated unfilt debug 2 second motion",
    1: "filt filtered lpf",
}
#: Words of what a program converted: it goes before the counts beside it.
_CONVERTED = {"real", "si", "scaled", "converted"}
#: ... but these are read as they are: an angular velocity, and what ROS calls the specific force (sensor_msgs/Imu).
_AS_READ = re.compile(
    r"(?<![a-z])(?:ang(?:ular)?|rot(?:ation(?:al)?)?)[ _.-]?vel(?:ocity)?(?![a-z])|linear_acceleration"
)
#: An angular acceleration, which no sensor of a log reads.
_ANGULAR = re.compile(r"(?<![a-z])(?:ang|angular|rot|rotational)[ _.-]?acc|winkelbeschl|(?<![a-z])acc\w*[ _.-]ang")
_LINEAR = {"lin", "linear"}
_TIME_STEMS = (
    "time zeit temps tiempo tempo tijd czas cas czas tid aika zaman vreme время час 时间 時間 시간 timestamp stamp "
    "seconds millis micros elapsed clock epoch uhrzeit datum date"
)
#: Names of a column that holds what went by since the row before, without blanks and unit.
_SPACINGS = (
    "dt deltat deltatime timedelta tdelta delta difftime timediff elapsedsincelast sincelast interval looptime "
    "cycletime sampletime period dtime"
)
#: Words for time beside the name of a sensor.
_TIME_WORDS = ("t", "ts")
_TIME_NAMES = "t ts ms us ns sec secs second s msec usec tms tus"
#: Words of a name: GPS TOW, iTOW (time of week), UTC_Nano.
_OF_TIME = {"tow", "utc"}


def _plain(text: str) -> str:
    """Return text in small letters without accents; words that only a capital parts are parted by a blank."""
    parted = re.sub(r"(?<=[a-z])(?=[A-Z])", " ", text)
    bare = unicodedata.normalize("NFKD", parted.replace("Ż", "Z").replace("ż", "z"))
    return "".join(c for c in bare if not unicodedata.combining(c)).casefold().strip()


#: The stems as names are after `_plain`, which takes Hangul and voiced kana apart as well.
_PLAIN_STEMS = {sensor: tuple(map(_plain, stems.split())) for sensor, stems in _STEMS.items()}
_PLAIN_TIME_STEMS = tuple(map(_plain, _TIME_STEMS.split()))


#: Those that are written in no Latin letters: an encoding under which they stand in a text is the text's.
_FOREIGN = frozenset(
    stem for stems in (*_PLAIN_STEMS.values(), _PLAIN_TIME_STEMS) for stem in stems if not stem.isascii()
)


def foreign_words(text: str) -> int:
    """Return how many signs of a text are words known here that are written in no Latin letters, each word once.

    >>> foreign_words("時間, 加速度 x, 加速度 y"), foreign_words("Zeit, Beschleunigung"), foreign_words("ŽžŠÔ")
    (4, 0, 0)
    """
    plain = _plain(text)
    return sum(len(stem) for stem in _FOREIGN if stem in plain)


#: The rates about a body's axes as flight mechanics and inertial units call them, and the axis of each.
_RATES = {"p": 0, "q": 1, "r": 2, "rollrate": 0, "pitchrate": 1, "yawrate": 2, "ratex": 0, "ratey": 1, "ratez": 2}

#: Angles, which are rates where their unit says so (Yaw in deg/s).
_ANGLES = {"roll": 0, "pitch": 1, "yaw": 2}
#: Sensors behind an axis by a capital (x_A, y_M, z_R), as watches write them: no ampere, no metre.
_CAPITALS = {"A": "acc", "M": "mag", "R": "rotrate"}
#: An axis called by the angle that turns about it.
_ROLLING = re.compile(r"(.+[\s_.-]|.*[a-z])([RPY]|(?<=[\s_.-])[rpy]|[Rr]oll|[Pp]itch|[Yy]aw|ROLL|PITCH|YAW)")
#: A gyroscope's axis called by the angle of Euler's about it.
_ABOUT = re.compile(r"(.+?)[\s_.-]*(phi|theta|psi)", re.IGNORECASE)


def _without_axis(name: str) -> tuple[str, int | None]:
    """Return a name without its axis, and the axis: x, y, z (0, 1, 2 in brackets) at the end, in front or between."""
    patterns = (
        (r"^(.*?)[\s_\-.]*[\[\(]?(?<![iI][tT])([xyzXYZ])[\]\)]?$", (1, 2)),  # the y of velocity is none
        (r"^(.*?)[\s_\-.]*\[([012])\]$", (1, 2)),
        (r"^()([xyzXYZ])(?:[\s_\-.]+|(?=[A-Z]))(.*)$", (3, 2)),
        (r"^(.+?[\s_\-.:])([xyzXYZ])[\s_\-.](.+)$", (1, 2)),
        (r"^(.+?[a-z])([XYZ])[\s_\-]?([A-Za-z]+)$", (1, 2)),
        (r"^((?:.+[\s_.])?)([xyz])((?:acc|gyr|mag)[a-z]*\d?)$", (1, 2)),  # xacc, as MAVLink has it
    )
    for pattern, (base, axis) in patterns:
        match = re.match(pattern, name)
        if match:
            rest = match[3] if len(match.groups()) > 2 and base == 1 else ""
            letter = match[axis].lower()
            return f"{match[base]}{rest}".strip(" _-."), "xyz".find(letter) if letter in "xyz" else int(letter)
    return name, None


def about_axes(names: Sequence[str]) -> tuple[str, ...]:
    """Return names with x, y, z for roll, pitch and yaw where a sensor has all three, as a CanSat's telemetry.

    >>> about_axes(["GYRO_R", "GYRO_P", "GYRO_Y", "ACC_ROLL", "ACC_PITCH"])
    ('GYRO_X', 'GYRO_Y', 'GYRO_Z', 'ACC_ROLL', 'ACC_PITCH')
    """
    read = {k: match for k, name in enumerate(names) if (match := _ROLLING.fullmatch(split_unit(name.strip())[0]))}
    by_stem: dict[str, dict[str, int]] = {}
    for k, match in read.items():
        if sensor_of(stem := match[1].strip(" _.-")) is not None:
            by_stem.setdefault(stem.casefold(), {})[match[2][0].lower()] = k
    bases = {base.casefold() for base, axis in map(_without_axis, names) if axis == 0}
    renamed = list(names)
    for stem, places in by_stem.items():
        if set(places) == {"r", "p", "y"} and stem not in bases:
            for axis, letter in zip("XYZ", "rpy", strict=True):
                k = places[letter]
                unit = split_unit(names[k].strip())[1]
                renamed[k] = f"{read[k][1]}{axis}" + f" [{unit}]" * bool(unit)
    return tuple(renamed)


def read_name(name: str) -> Name:
    """Take a column's name apart.

    >>> read_name("Gyro X (deg/s)"), read_name("yaw_rate"), read_name("Rate_Z").base
    (Name(base='Gyro', axis=0, unit='deg/s'), Name(base='rotrate', axis=2, unit=''), 'rotrate')
    >>> read_name("Gyro_Psi"), read_name("y_M"), read_name("y_m")
    (Name(base='Gyro', axis=2, unit=''), Name(base='mag', axis=1, unit=''), Name(base='', axis=1, unit='m'))
    """
    rest, unit = split_unit(name.strip())
    if (axis := _RATES.get(re.sub(r"[\s_\-]+", "", rest.lower()))) is not None:
        return Name("rotrate", axis, unit)
    if (axis := _ANGLES.get(rest.lower())) is not None and any(r.sensor == "gyroscope" for r in readings_of(unit)):
        return Name("rotrate", axis, unit)
    if (about := _ABOUT.fullmatch(rest)) is not None and sensor_of(about[1]) == "gyroscope":
        return Name(about[1], ("phi", "theta", "psi").index(about[2].lower()), unit)
    if (lettered := re.fullmatch(r"([xyz])_([AMR])", name.strip())) is not None:
        return Name(_CAPITALS[lettered[2]], "xyz".index(lettered[1]), "")
    base, axis = _without_axis(rest)
    base = base.rstrip(" /")
    if not unit and base:
        inner, unit = split_unit(base)  # acc_mg_x
        base, unit = (inner, unit) if readings_of(unit) and sensor_of(inner) else (base, "")
    return Name(base, axis, unit)


def last_word(name: str) -> str:
    """Return the last word of a name without its unit.

    >>> last_word("gps_lat [deg]"), last_word("GPS Altitude (ft)"), last_word("gpsLon"), last_word("locationLongitude")
    ('lat', 'altitude', 'lon', 'longitude')
    """
    return _split(read_name(name).base)[-1].removeprefix("gps")


def words_of(name: str) -> set[str]:
    """Return the words of a name without its unit.

    >>> sorted(words_of("ground speed (m/s)")), sorted(words_of("locationSpeed(m/s)"))
    (['ground', 'speed'], ['location', 'speed'])
    """
    return {word.strip("()[]") for word in _split(split_unit(name.strip())[0])} - {""}


def is_of_mavlink(name: str) -> bool:
    """Tell a sensor's column that is called as MAVLink's messages of an IMU have it.

    >>> [is_of_mavlink(name) for name in ("xacc", "RAW_IMU.zmag", "ygyro2", "acc_x", "xaccel")]
    [True, True, True, False, False]
    """
    return re.fullmatch(r"(?:.+[\s_.])?[xyz](?:acc|gyro|mag)\d?", name.strip()) is not None


def is_of_quaternion(name: str) -> bool:
    """Tell a column that is called one of the four numbers of a quaternion.

    >>> [is_of_quaternion(name) for name in ("q_w", "quat_x", "Q0()", "imu.qr", "orientation.w", "mag_x", "q", "freq1")]
    [True, True, True, True, True, False, False, False]
    """
    plain = _plain(split_unit(name.strip())[0]).removesuffix("()")
    return re.fullmatch(r"(?:.*[\s_.\-/])?(?:q|quat\w*|orientation)[\s_.\-\[(]*[wxyzrijk0-4][\])]*", plain) is not None


def _split(name: str) -> list[str]:
    return re.split(r"[\s_.\-:/]+", re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name.strip()).lower())


def sensor_of(base: str) -> str | None:
    """Return the sensor that a name (of a column without axis and unit, of a file, of an id) speaks of, or None.

    >>> [sensor_of(base) for base in ("gF", "g", "high_g", "gyr", "f")]
    ['accelerometer', 'gyroscope', 'accelerometer', 'gyroscope', None]
    """
    words = _parts(base)
    words = ["gf"] if words == ["g", "f"] else words  # a capital parts words
    letter = re.sub(r"\d+$", "", words[-1])
    if letter in _LETTERS and not (letter == "g" and words[:-1] and words[-2] in _RANGES):
        return _LETTERS[letter]
    return _by_stem(words)


def sensor_of_file(path: Path) -> str | None:
    """Return the sensor that a file's name speaks of, or None.

    A letter behind other words counts the files (throw_a, throw_b), but where one of them is a gyroscope's (run_a,
    run_g) and none is called by a letter that no sensor has.

    >>> [sensor_of_file(Path(stem)) for stem in ("run_gyr", "throw_a", "a", "acc_2")]
    ['gyroscope', None, 'accelerometer', 'accelerometer']
    """
    words = _parts(path.stem)
    if len(words) > 1 and len(words[-1]) == 1:
        besides = [path.with_name(f"{path.stem[:-1]}{letter}{path.suffix}").exists() for letter in "gc"]
        if besides != [True, False]:
            return _by_stem(words)
    return sensor_of(path.stem)


def sensor_of_code(text: str, codes: Collection[str]) -> str | None:
    """Return the sensor that a number in a column of such ``codes`` stands for, or None where they are no Android's.

    >>> sensor_of_code("4", ("1", "4", "2")), sensor_of_code("1", ("1", "2")), sensor_of_code("4", ("4", "1", "77"))
    ('gyroscope', None, None)
    """
    counted = all(code.isdecimal() and 1 <= int(code) <= _LAST_OF_ANDROID for code in codes)
    known = counted and "4" in codes and len(_ANDROID.keys() & codes) > 1
    return _ANDROID.get(text) if known else None


def _parts(name: str) -> list[str]:
    """Return a name's words as they are after `_plain`."""
    return re.split(r"[\s_\-.]+", _plain(name))


def _by_stem(words: Sequence[str]) -> str | None:
    squeezed = "".join(words).replace("magnitude", "")
    return next((sensor for sensor, stems in _PLAIN_STEMS.items() if any(stem in squeezed for stem in stems)), None)


def penalty_of(base: str) -> int:
    """Return how far a column stands back behind the plain sensor's: words of what was worked out from it.

    >>> penalty_of("lin_acc"), penalty_of("acc"), penalty_of("acc_real"), penalty_of("lin_acc_real")
    (9, 0, -1, 9)
    >>> [penalty_of(name) for name in ("angAcc", "Angular Velocity", "7_AngularVelocity", "rotRate", "imu_rot_acc")]
    [9, 0, 0, 0, 9]
    """
    if _ANGULAR.search(_plain(base)):
        return NO_READING
    words = _words_beside(base)
    back = sum(weight for weight, listed in _STAND_BACK.items() for word in listed.split() if word in words)
    return back if back or words.isdisjoint(_CONVERTED) else -1


def _words_beside(base: str) -> set[str]:
    """Return the words of a name but those that are read as they are."""
    return set(re.split(r"[\s_\-.()]+", _AS_READ.sub("", _plain(base))))


def is_called_linear(base: str) -> bool:
    """Tell whether a name says of an acceleration that it is linear: mostly, but not always, one without gravity.

    >>> is_called_linear("Lin Acc"), is_called_linear("acc")
    (True, False)
    """
    return not _LINEAR.isdisjoint(_words_beside(base))


def timeless(name: str) -> str:
    """Return what stands beside a word for time in a column's name, without the unit; empty where there is none.

    >>> timeless("mag_timestamp_us"), timeless("t_gyro"), timeless("time"), timeless("gyro_x")
    ('mag', 'gyro', '', '')
    """
    words = _parts(split_unit(name.strip())[0])
    left = [word for word in words if word not in _TIME_WORDS]
    for stem in sorted(_PLAIN_TIME_STEMS, key=len, reverse=True):
        left = [word.replace(stem, "") for word in left]
    return "" if left == words else " ".join(word for word in left if word)


def is_time_name(name: str) -> bool:
    """Tell whether a column is called after time."""
    rest, unit = split_unit(name.strip())
    plain = _plain(rest)
    return (
        any(stem in plain for stem in _PLAIN_TIME_STEMS)
        or plain in _TIME_NAMES.split()
        or not _OF_TIME.isdisjoint(re.split(r"[\s_\-.]+", plain))
        or (timeless(rest) != "" and sensor_of(timeless(rest)) is not None)  # t_gyro
        or (unit != "" and any(r.sensor == "time" for r in readings_of(unit)) and sensor_of(rest) is None)
    )


def is_spacing_name(name: str) -> bool:
    """Tell whether a column is called after what went by since the row before.

    >>> [is_spacing_name(name) for name in ("dt_us", "delta [ms]", "loopTime", "Δt", "dt", "time", "t_ms")]
    [True, True, True, True, True, False, False]
    """
    rest, unit = split_unit(name.strip().replace("Δ", "d"))
    known = not unit or any(reading.sensor == "time" for reading in readings_of(unit))
    return known and re.sub(r"[\s_\-.]+", "", _plain(rest)) in _SPACINGS.split()


def says_nothing(base: str) -> bool:
    """Tell a name that could be anything's: none, a letter, a column's number, a word for data."""
    words = "c|ch|chan|channel|col|column|v|val|value|values|data|d|f|field|raw|in|adc|s|var"
    return re.fullmatch(rf"({words})?[\s_\-]*\d*", _plain(base)) is not None
