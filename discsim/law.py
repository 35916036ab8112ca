"""A law: a missing force, moment or sensor term as an explicit formula of the state, read from its text.

The text is a sum of products of powers. A factor is a number, a coefficient, a symbol of `SYMBOLS`, its magnitude
``|r|`` or its direction ``sign(r)``; an exponent is a number or a coefficient. ``c * |r|^n * sign(r) + b * V^2`` with
the coefficients c, n and b is a law, and so is ``-c r V``: a blank or a dot multiplies, too. What dies away in time has
the factor ``exp(-t/tau)``; what swings in time, ``cos(w t + phase)`` or ``sin(w t)``; what repeats as a disc turns,
``cos(k psi + w t + phase)``, psi being the angle turned since the recording began: it stands only in a law about a
sensor. In one about the axis of a rig ``yaw`` stands in its place, the angle of the rig itself. Only in a law about a
sensor does ``play(x, w)`` stand, what a reading x shows behind a play of +-w: Prandtl's operator, the simplest
hysteresis. A law about the wind holds of the symbols only t and h, and may have the factor
``exp(-((north - a)^2 + (east - b)^2) / (2 s^2))``: air that moves about a place in the field, within s metres of it.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import cos, exp, isfinite, pi, pow
from types import MappingProxyType

import numpy as np
from numpy.typing import ArrayLike

from discsim.arrays import FloatArray, readonly
from discsim.compiled import compiled
from discsim.errors import InputError, printable
from discsim.frames import heading_angles, norm3
from discsim.recording import SENSORS

__all__ = [
    "AIR_SHARE",
    "LAW_WIDTH",
    "MOTION_TARGETS",
    "SYMBOLS",
    "WIND_TARGETS",
    "WRENCH_TARGETS",
    "Law",
    "behind_play",
    "law_wind",
    "law_wrench",
]

#: symbols that a law may hold: time s, height m, airspeed m/s, angle of attack rad, rates in the H frame and spin
#: rad/s; x, y, z are a sensor's own reading before noise, in its unit, and stand only in a law about that sensor
SYMBOLS = ("t", "h", "V", "alpha", "p_H", "q_H", "r", "x", "y", "z")
#: by which share of what is modelled the force and moment of the air are larger: of a disc that grows lighter, too
AIR_SHARE = "air_share"
#: what a law about motion may give: force and moment of the H frame, whose z axis is that of the body
WRENCH_TARGETS = ("force_x_N", "force_y_N", "force_z_N", "moment_x_N_m", "moment_y_N_m", "moment_z_N_m")
#: how much faster than known the air moves to the north, to the east and upwards
WIND_TARGETS = ("wind_north_m_s", "wind_east_m_s", "wind_up_m_s")
#: and all that it may be about
MOTION_TARGETS = (*WRENCH_TARGETS, AIR_SHARE, *WIND_TARGETS)
_FUNCTIONS = ("sign", "exp", "cos", "sin", "play")
_READINGS = ("x", "y", "z")
#: what stands in a law as an angle or a place
_PLACES = ("psi", "yaw", "north", "east")
_COUNT = len(SYMBOLS)
#: symbols that a law about the wind may hold, and where its targets begin
_OF_WIND, _FIRST_WIND = 2, MOTION_TARGETS.index(WIND_TARGETS[0])
#: characters of a law's text: the longest law that a diagnosis writes has some two hundred
_LONGEST = 5000
#: size of an exponent: r^30 is 1e111 at the fastest spin, and no force grows so
_STEEPEST = 30.0
#: a row of a law's numbers: place of its target, coefficient, of each symbol the power of its magnitude and its sign
#: to a power, decay in 1/s, order of the angle, phase, play of its sensor's reading, rad/s of what swings, north and
#: east of a place and the size of what is about it, all three in m, a size of zero being none
_DECAY, _ORDER, _PHASE, _PLAY, _SWING, _NORTH, _EAST, _SIZE, LAW_WIDTH = (2 + 2 * _COUNT + k for k in range(9))
_TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][-+]?\d+)?|\.\d+(?:[eE][-+]?\d+)?)|([A-Za-z_]\w*)|(\*\*|[-+*·/^|(),]))")


@dataclass(frozen=True)
class Law:
    """A term that the catalogue does not hold: ``target = text``.

    ``target`` is one of `MOTION_TARGETS` (``moment_z_N_m`` also for a rig's axis) or ``SENSOR.COLUMN`` as in
    ``magnetometer.x_uT``. ``sigma`` has one standard deviation per coefficient, absent where it is unknown. Raises
    `InputError` for a text that is no law.
    """

    text: str
    target: str
    coefficients: Mapping[str, float]
    sigma: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "coefficients", MappingProxyType(dict(self.coefficients)))
        object.__setattr__(self, "sigma", MappingProxyType(dict(self.sigma)))
        columns = [f"{sensor}.{column}" for sensor, kind in SENSORS.items() for column in kind.columns]
        if self.target not in (*MOTION_TARGETS, *columns):
            raise InputError(
                f"law: target is {self.target!r}, expected one of {', '.join(MOTION_TARGETS)} or a sensor's column "
                "such as magnetometer.x_uT"
            )
        for name, value in self.coefficients.items():
            if not re.fullmatch(r"[A-Za-z_]\w*", name) or name in (*SYMBOLS, *_FUNCTIONS, *_PLACES):
                raise InputError(
                    f"law: a coefficient is called '{name}'; expected a name that is no symbol of the state"
                )
            if not isfinite(value):
                raise InputError(f"law: {name} is not finite ({value}); expected a finite number")
        if strange := set(self.sigma) - set(self.coefficients):
            known = ", ".join(self.coefficients) or "none"
            raise InputError(f"law: sigma of '{min(strange)}', which is no coefficient; expected some of {known}")
        rows = self.rows
        if self.target in MOTION_TARGETS:
            if np.any(rows[:, 2 + SYMBOLS.index("x") : 2 + _COUNT]):
                raise InputError("law: x, y and z are a sensor's reading; expected them only in a law about a sensor")
            if "psi" in self._angles:
                raise InputError("law: psi is the angle turned; expected it only in a law about a sensor")
        if "yaw" in self._angles and self.target != "moment_z_N_m":
            raise InputError("law: yaw is the angle of a rig; expected it only in a law about moment_z_N_m")
        if self.target not in WIND_TARGETS:
            if np.any(rows[:, _SIZE]):
                raise InputError("law: north and east are a place; expected them only in a law about the wind")
        elif np.any(rows[:, 2 + _OF_WIND : 2 + _COUNT]) or np.any(rows[:, 2 + _COUNT + _OF_WIND : 2 + 2 * _COUNT]):
            raise InputError("law: a wind is the same for every disc; expected only t, h, north and east in its law")

    @cached_property
    def rows(self) -> FloatArray:
        """The law as numbers, a row per term, for `law_wrench`."""
        place = MOTION_TARGETS.index(self.target) if self.target in MOTION_TARGETS else -1
        return readonly([[place, *term] for term in _Parser(self.text, self.coefficients).terms()])

    @cached_property
    def _angles(self) -> frozenset[str]:
        """Which of the angles psi and yaw stand in the text."""
        return frozenset(re.findall(r"[A-Za-z_]\w*", self.text)) & {"psi", "yaw"}

    @property
    def about_a_rig(self) -> bool:
        """Whether it holds the angle of a rig, which a disc in the air does not have."""
        return "yaw" in self._angles

    def evaluate(self, state: Mapping[str, ArrayLike]) -> FloatArray:
        """Return the law at states given by symbol (psi, yaw, north and east, too), in the order of time.

        Each is a number or (n,), a place in m.

        Raises KeyError where one is missing.
        """
        total: FloatArray = np.zeros(())
        for row in self.rows:
            term = np.asarray(row[1])
            for k, symbol in enumerate(SYMBOLS):
                power, odd = row[2 + k], row[2 + _COUNT + k]
                if power or odd:
                    x = np.asarray(state[symbol], dtype=np.float64)
                    if row[_PLAY] and symbol in _READINGS:
                        x = behind_play(np.atleast_1d(x), row[_PLAY]).reshape(x.shape)
                    term = term * np.abs(x) ** power * (np.sign(x) if odd else 1.0)
            if row[_DECAY]:
                term = term * np.exp(-row[_DECAY] * np.asarray(state["t"], dtype=np.float64))
            if row[_ORDER] or row[_SWING]:
                angle = np.asarray(row[_PHASE])
                for factor, symbol in ((row[_ORDER], "yaw" if row[0] >= 0.0 else "psi"), (row[_SWING], "t")):
                    if factor:
                        angle = angle + factor * np.asarray(state[symbol], dtype=np.float64)
                term = term * np.cos(angle)
            if row[_SIZE]:
                north, east = (np.asarray(state[way], dtype=np.float64) for way in ("north", "east"))
                term = term * np.exp(-0.5 * ((north - row[_NORTH]) ** 2 + (east - row[_EAST]) ** 2) / row[_SIZE] ** 2)
            total = total + term
        return total


class _Parser:
    """Reads a sum of products into rows: coefficient, powers of the magnitudes, whether the sign is kept."""

    def __init__(self, text: str, coefficients: Mapping[str, float]) -> None:
        self._text, self._coefficients = printable(text if len(text) <= 200 else f"{text[:197]}..."), coefficients
        self._tokens: list[str] = []
        if len(text) > _LONGEST:
            raise self._error(f"{len(text)} characters, at most {_LONGEST} are read")
        place = 0
        while text[place:].strip():
            token = _TOKEN.match(text, place)
            if token is None:
                raise self._error(f"cannot read '{printable(text[place:].strip()[:20])}'")
            self._tokens.append(token[0].strip())
            place = token.end()
        self._next = 0

    def _error(self, message: str) -> InputError:
        return InputError(f"law '{self._text}': {message}; expected a sum of products of powers such as c * |r|^n * V")

    def _peek(self) -> str:
        return self._tokens[self._next] if self._next < len(self._tokens) else ""

    def _take(self, *expected: str) -> str:
        token = self._peek()
        if not token or (expected and token not in expected):
            found = f"'{token}'" if token else "the end"
            raise self._error(f"found {found} where {' or '.join(expected) or 'a factor'} belongs")
        self._next += 1
        return token

    def _skip(self, *tokens: str) -> bool:
        """Tell whether one of the tokens is next, and step over it."""
        there = self._peek() in tokens
        self._next += there
        return there

    def terms(self) -> list[list[float]]:
        """Return the rows of all terms."""
        rows = []
        sign = -1.0 if self._skip("-") else 1.0
        while True:
            rows.append(self._product(sign))
            if not self._peek():
                return rows
            sign = {"+": 1.0, "-": -1.0}[self._take("+", "-")]

    def _product(self, sign: float) -> list[float]:
        coefficient, powers, odd = sign, [0.0] * _COUNT, [0.0] * _COUNT
        decay, order, phase, width, swing = 0.0, 0.0, 0.0, 0.0, 0.0
        about = [0.0, 0.0, 0.0]
        inverse = 1.0
        while True:
            if self._peek() == "exp":
                rate, found = self._exponential()
                if any(found) and (any(about) or inverse < 0.0):
                    raise self._error("a second place in one product, or one below a stroke")
                decay, about = decay + inverse * rate, found if any(found) else about
            elif self._peek() in ("cos", "sin"):
                if order or swing or inverse < 0.0:
                    raise self._error("a second cos or sin in one product, or one below a stroke")
                order, swing, phase = self._turn()
                if not (order or swing):
                    coefficient *= np.cos(phase)
            elif self._peek() == "play":
                if width or inverse < 0.0:
                    raise self._error("a second play in one product, or one below a stroke")
                place, width = self._play()
                powers[place] += 1.0
                odd[place] = (odd[place] + 1.0) % 2.0
            else:
                value, place, power, is_odd = self._factor()
                if place < 0:
                    coefficient *= self._power(value, inverse * power)
                else:
                    powers[place] += inverse * power
                    odd[place] = (odd[place] + is_odd) % 2.0
            if self._peek() in ("", "+", "-"):
                row = [float(coefficient), *powers, *odd, decay, order, phase, width, swing, *about]
                if width and sum(map(abs, powers[-len(_READINGS) :])) != 1.0:
                    raise self._error("a play times a reading")
                if not all(map(isfinite, row)) or max(map(abs, powers)) > _STEEPEST:
                    raise self._error(f"a number that is not finite, or a power above {_STEEPEST:g} in all")
                return row
            inverse = -1.0 if self._skip("/") else 1.0
            if inverse > 0.0:
                self._skip("*", "·")

    def _power(self, value: float, exponent: float) -> float:
        try:
            return pow(value, exponent)
        except (OverflowError, ValueError):  # too large for a number; zero to a negative power
            raise self._error(f"{value:g} to the power {exponent:g}") from None

    def _exponential(self) -> tuple[float, list[float]]:
        """Read ``exp(-t/tau)`` or ``exp(-((north - a)^2 + (east - b)^2) / (2 s^2))``.

        Returns 1/tau, and a, b and s; zeros for those of the other.
        """
        self._expect("exp", "(", "-")
        if not self._skip("("):
            self._expect("t", "/")
            tau = self._number(self._take())
            self._take(")")
            if not tau:
                raise self._error("a time constant of zero")
            return 1.0 / tau, [0.0, 0.0, 0.0]
        north = self._squared_distance("north")
        self._take("+")
        east = self._squared_distance("east")
        self._expect(")", "/", "(", "2")
        self._skip("*", "·")
        size = self._number(self._take())
        self._take("^", "**")
        self._expect("2", ")", ")")
        if not size > 0.0:
            raise self._error(f"a place {size:g} m wide, which must be positive")
        return 0.0, [north, east, size]

    def _squared_distance(self, way: str) -> float:
        """Read ``(north - a)^2`` or that of the east; return a."""
        self._expect("(", way)
        sign = {"-": 1.0, "+": -1.0}[self._take("-", "+")]
        middle = sign * self._number(self._take())
        self._take(")")
        self._take("^", "**")
        self._take("2")
        return middle

    def _expect(self, *tokens: str) -> None:
        """Step over tokens that must follow one another."""
        for token in tokens:
            self._take(token)

    def _turn(self) -> tuple[float, float, float]:
        """Read ``cos(k psi + w t + phase)`` or the sine; return k, w and the phase of the cosine."""
        found = {"psi": 0.0, "yaw": 0.0, "t": 0.0, "": -0.5 * pi if self._take("cos", "sin") == "sin" else 0.0}
        self._take("(")
        sign = -1.0 if self._skip("-") else 1.0
        while True:
            factor, of = 1.0, self._take()
            if of not in ("psi", "yaw", "t"):
                factor, of = self._number(of), ""
                if self._skip("*", "·") or self._peek() in ("psi", "yaw", "t"):
                    of = self._take("psi", "yaw", "t")
            found[of] += sign * factor
            if self._take("+", "-", ")") == ")":
                return found["psi"] + found["yaw"], found["t"], found[""]
            sign = -1.0 if self._tokens[self._next - 1] == "-" else 1.0

    def _play(self) -> tuple[int, float]:
        """Read ``play(x, w)``; return the place of the reading and w."""
        self._expect("play", "(")
        place = SYMBOLS.index(self._take(*_READINGS))
        self._take(",")
        width = self._number(self._take())
        self._take(")")
        if not width > 0.0:
            raise self._error(f"a play of {width:g}, which must be positive")
        return place, width

    def _factor(self) -> tuple[float, int, float, float]:
        """Return value of a number, place of a symbol (-1: a number), its power, and whether its sign is kept."""
        token = self._take()
        if token == "|":
            place = self._symbol()
            self._take("|")
            return 1.0, place, self._exponent(), 0.0
        if token == "sign":
            self._take("(")
            place = self._symbol()
            self._take(")")
            return 1.0, place, 0.0, 1.0
        if token in SYMBOLS:
            power = self._exponent()
            if not power.is_integer():
                raise self._error(f"{token} to a power that is no integer; write |{token}|^{power:g}")
            return 1.0, SYMBOLS.index(token), power, abs(power) % 2.0
        value = self._number(token)
        power = self._exponent()
        if (value == 0.0 and power < 0.0) or (value < 0.0 and not power.is_integer()):
            raise self._error(f"{value:g} to the power {power:g}")
        return value, -1, power, 0.0

    def _symbol(self) -> int:
        return SYMBOLS.index(self._take(*SYMBOLS))

    def _exponent(self) -> float:
        if not self._skip("^", "**"):
            return 1.0
        closing = self._skip("(")
        sign = -1.0 if self._skip("-") else 1.0
        value = sign * self._number(self._take())
        if closing:
            self._take(")")
        return value

    def _number(self, token: str) -> float:
        if token in self._coefficients:
            return float(self._coefficients[token])
        try:
            return float(token)
        except ValueError:
            known = ", ".join((*self._coefficients, *SYMBOLS))
            raise self._error(f"unknown '{token}' (known are {known})") from None


@compiled
def behind_play(x: FloatArray, width: float) -> FloatArray:
    """Return what a part with play +-width shows, (n,), that x (n,) pushes to and fro: Prandtl's operator."""
    y = np.empty_like(x)
    y[0] = x[0]
    for k in range(1, x.size):
        y[k] = min(max(y[k - 1], x[k] - width), x[k] + width)
    return y


@compiled
def _term(rows: FloatArray, i: int, state: tuple[float, ...], t: float, yaw: float) -> float:
    """Return what the i-th row is at a state of the first symbols, time t and angle yaw, but for its place and play."""
    term = rows[i, 1]
    for k in range(len(state)):
        power, odd = rows[i, 2 + k], rows[i, 2 + _COUNT + k]
        if power != 0.0:
            term *= abs(state[k]) ** power
        if odd != 0.0:
            term *= np.sign(state[k])
    if rows[i, _DECAY] != 0.0:
        term *= exp(-rows[i, _DECAY] * t)
    if rows[i, _SWING] != 0.0 or rows[i, _ORDER] != 0.0:
        term *= cos(rows[i, _ORDER] * yaw + rows[i, _SWING] * t + rows[i, _PHASE])
    return float(term)


@compiled
def law_wrench(
    rows: FloatArray, t: float, h: float, u: float, v: float, w: float, P: float, Q: float, r: float, yaw: float = 0.0
) -> tuple[float, float, float, float, float, float, float]:
    """Force (N) and moment (N m) of a law's rows, to be added to those of the air; arguments as for ``air_wrench``.

    Last comes the share by which those of the air are larger themselves.

    Like it, in any frame whose z axis is that of the body. For a rig's axis only r and yaw matter.
    """
    V = norm3(u, v, w)
    cos_beta, sin_beta, alpha = heading_angles(u, v, w)
    state = (t, h, V, alpha, cos_beta * P + sin_beta * Q, cos_beta * Q - sin_beta * P, r)
    out = np.zeros(7)
    for i in range(rows.shape[0]):
        if rows[i, 0] < _FIRST_WIND:
            out[int(rows[i, 0])] += _term(rows, i, state, t, yaw)
    return (
        cos_beta * out[0] - sin_beta * out[1],
        sin_beta * out[0] + cos_beta * out[1],
        out[2],
        cos_beta * out[3] - sin_beta * out[4],
        sin_beta * out[3] + cos_beta * out[4],
        out[5],
        out[6],
    )


@compiled
def law_wind(rows: FloatArray, t: float, h: float, north: float, east: float) -> tuple[float, float, float]:
    """Wind in N (m/s) of a law's rows at time t s and a place, m, to be added to the one that is known."""
    state = (t, h)
    wn, we, up = 0.0, 0.0, 0.0
    for i in range(rows.shape[0]):
        if rows[i, 0] < _FIRST_WIND:
            continue
        term = _term(rows, i, state, t, 0.0)
        if rows[i, _SIZE] != 0.0:
            away = (north - rows[i, _NORTH]) ** 2 + (east - rows[i, _EAST]) ** 2
            term *= exp(-0.5 * away / rows[i, _SIZE] ** 2)
        if rows[i, 0] == _FIRST_WIND:
            wn += term
        elif rows[i, 0] == _FIRST_WIND + 1:
            we += term
        else:
            up += term
    return wn, we, -up
