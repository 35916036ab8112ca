"""The paper's figures and numbers, each beside what stands for it here."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from discsim.estimators.accelerometer import AccelerometerErrors
from discsim.estimators.fft import FftSettings
from discsim.rig import PLATEAUS_DEG_S
from discsim.sensors.instruments import read_part
from discsim.validation.yaw_damping.paper_table import RATES_DEG_S, SPEEDS_M_S

__all__ = ["BLOCKS", "FIGURES", "figure_rows", "number_rows"]

#: number, what it shows, our functions by full name, remark
FIGURES: tuple[tuple[str, str, tuple[str, ...], str], ...] = (
    ("1", "geometry of the mount", ("discsim.effects.sensors.PositionOffset",), "a drawing; Eq. (2)"),
    ("2", "the idea: a field that turns", ("discsim.sensors.magnetometer.Magnetometer",), "a drawing"),
    ("3", "waveform and spectrum of a flight", ("discsim.validation.studies.paper.spectrum.whole_flight",), "below"),
    ("4", "block diagram of the algorithm", ("discsim.estimators.fft.fft",), "(P-1) to (P-7)"),
    ("5", "prototype module", ("discsim.sensors.instruments.read_part",), "parts `mpu9250`, `adxrs649`, `neo_m8n`"),
    ("6", "module on the rate table", ("discsim.rig.turn_table",), "`discsim rate-table`"),
    ("7", "methods on the rate table", ("discsim.validation.scenarios.rate_table_figures.draw_methods",), "below"),
    ("8", "miniature module", ("discsim.module.Module",), "`discsim fly --module`"),
    ("9", "two modules compared", ("discsim.validation.studies.paper.modules.compare_modules",), "below"),
    ("10", "disc, module, map of a throw", ("discsim.shipped.load_disc",), "the printed text has no inertia in it"),
    ("11", "lines through spins, table", ("discsim.validation.studies.paper.prediction.predict_by_table",), "below"),
    ("12", "structure of the simulator", ("discsim.trajectory.predict",), "a block diagram, below"),
    ("13", "predicted path and spin", ("discsim.validation.studies.paper.prediction.predict_by_table",), "below"),
    ("A1", "order of the Euler angles", ("discsim.frames.attitude_matrix",), "a drawing; (A1)"),
    ("A2", "aerodynamic angles", ("discsim.frames.heading_angles",), "a drawing; (A2)"),
)


#: the blocks of Fig. 12, and our functions by full name
BLOCKS: tuple[tuple[str, str], ...] = (
    ("disc, with module", "discsim.module.loaded"),
    ("surroundings", "discsim.environment.Environment"),
    ("release", "discsim.disc.Release"),
    ("12 states over time", "discsim.trajectory.predict"),
    ("wind, velocity relative to the air", "discsim.aerodynamics.wind"),
    ("angle of attack, heading frame", "discsim.frames.heading_angles"),
    ("advance ratio", "discsim.aerodynamics.advance_ratio"),
    ("coefficients of lift, drag, pitch", "discsim.aerodynamics.static_coefficients"),
    ("of roll", "discsim.aerodynamics.rolling_coefficient"),
    ("of yaw, constant or from the table", "discsim.aerodynamics.yaw_damping"),
    ("force and moment in W, turned into B and N", "discsim.aerodynamics.air_wrench"),
    ("equations of motion", "discsim.flight_equations.derivative"),
    ("the same, integrated by MuJoCo", "discsim.engine.fly"),
)


def figure_rows() -> list[tuple[str, ...]]:
    """Return the rows of the table of figures."""
    return [
        (f"Fig. {number}", what, ", ".join(f"`{name}`" for name in names), remark)
        for number, what, names, remark in FIGURES
    ]


def number_rows(numbers: Mapping[str, Any]) -> list[tuple[str, ...]]:
    """Return the rows of the table of numbers: where, what, the paper's, ours, why they differ."""
    return [*_of_methods(numbers), *_of_flights(numbers)]


def _of_methods(numbers: Mapping[str, Any]) -> list[tuple[str, ...]]:
    settings, errors, seven = FftSettings(), AccelerometerErrors(), numbers["fig_7"]
    table = read_part("ac1120s").sensors["rate_reference"]
    places = numbers["fig_7"]["share_percent"]
    return [
        ("(P-1), (P-2)", "window, zeros", "128, 2^14 - 128", f"{settings.window}, {settings.pad}", "the same"),
        ("3", "threshold, deg/s", "500", f"{_degrees(settings.threshold):.0f}", "the same"),
        (
            "(13)", "nonlinearity, cross-axis, bias, noise, %", "0.5, 2, 6, 0.3",
            f"{100 * errors.nonlinearity:g}, {100 * errors.cross_axis:g}, {_g(errors.bias):g}, {_g(errors.noise):g}",
            "the same; the 8 % of z do not enter a rate",
        ),
        ("3", "share of 16.1 mm, 1 and 5 mm, %", "6.2, 31", f"{places[0]:.1f}, {places[1]:.0f}", "the same"),
        (
            "Fig. 7", "what 1 and 5 mm are worth, %", "not printed",
            f"{seven['mount_percent'][0]:.1f}, {seven['mount_percent'][2]:.0f}", "the root of (9) halves them",
        ),
        (
            "Fig. 7", "MPU-9250's gyroscope ends at, deg/s", "2000", f"{seven['gyroscope_last_deg_s']:.0f}",
            "drawn within its sheet: its last reading below the limit",
        ),
        ("Fig. 7", "delay of the window, s", "half a window: 0.64", f"{seven['delay_s']:.2f}", "127 spacings, not 128"),
        (
            "3", "ADXRS649's range, deg/s", "20000", f"{_degrees(_range('adxrs649', 'gyroscope')):.0f}", "the same",
        ),
        (
            "3", "magnetometer's resolution, uT", "0.6 (6 mG)", f"{_step('mpu9250', 'magnetometer'):g}",
            "the data sheet's step at 16 bit; 0.6 is our noise",
        ),
        (
            "3", "rate table's accuracy, %", "0.001", f"{100 * _relative(table):.1g}",
            f"its read-out's noise at {PLATEAUS_DEG_S[-1]} deg/s; the motion itself is exact",
        ),
    ]  # fmt: skip


def _of_flights(numbers: Mapping[str, Any]) -> list[tuple[str, ...]]:
    three, nine, thirteen, far = (numbers[name] for name in ("fig_3", "fig_9", "fig_13", "distance"))
    best = nine["ways"]["driver: speed and spin 10 % lower with 37 g"]
    domain = thirteen["table"]["domain"]
    nodes = f"{domain['rate_deg_s'][0]:.0f} to {domain['rate_deg_s'][1]:.0f}, {domain['speed_m_s'][0]:g} to "
    predicted = thirteen["predicted"]
    return [
        (
            "Fig. 3", "dominant frequency, Hz", "9 to 10", f"{three['dominant_hz'][0]:.1f} to "
            f"{three['dominant_hz'][1]:.1f}",
            "spin at release taken as 3600 deg/s; the width is the decay",
        ),
        (
            "4.1", "disc, modules, g", "164, 37, 15", f"{1000 * (nine['mass'][1] - 0.015):.0f}, 37, 15",
            "the driver's 179 g are disc and module",
        ),
        ("4.1", "spin with 15 g over 37 g", "+10 %", "0 to +0.5 %", "inertia is all but the same: the arm did it"),
        (
            "4.1", "spin at release with 15 g, deg/s", "about 4200", "4200", "taken from there",
        ),
        (
            "4.1", "time with 15 g over 37 g", "+30 %", f"up to {100 * (best['time'] - 1):+.0f} %",
            "of mass, and of speed and spin 10 % lower; the rest is drag",
        ),
        (
            "4.1", "distance with 15 g over 37 g", "+30 %", f"up to {100 * (best['distance'] - 1):+.0f} %",
            f"{100 * (best['distance_with_bluff_module'] - 1):+.0f} % if the old module sticks out into the wind",
        ),
        (
            "(27)", "nodes: rates deg/s, speeds m/s", "4500 to 7000, 6 to 23; 51 x 35",
            f"{nodes}{domain['speed_m_s'][1]:g}; {RATES_DEG_S.size} x {SPEEDS_M_S.size}", "the same",
        ),
        (
            "Fig. 11b", "C_Nr", "surface, no numbers in the text",
            f"{thirteen['table']['fft']['nodes'][1]:.4f} to {thirteen['table']['fft']['nodes'][0]:.4f}",
            "another disc; the shape 1/(r V) comes from one slope",
        ),
        ("4.4", "attitude at release, deg", "-15, -17, 112", "the same", "`models/throws/paper.toml`"),
        (
            "Fig. 10", "distance, m", "72 (70 to 80)", f"{far['m']:.0f}", "speed, heading and coefficients are not "
            "printed",
        ),
        (
            "Fig. 13", "magnetometer nearer than accelerometer", "yes, no numbers",
            f"{predicted['fft, (28)']['landing_m']:.2f} against "
            f"{predicted['accelerometer, 1 mm, (28)']['landing_m']:.2f} and "
            f"{predicted['accelerometer, 5 mm, (28)']['landing_m']:.2f} m (1, 5 mm)",
            "this release is hardly sensitive to spin",
        ),
    ]  # fmt: skip


def _degrees(radians: float) -> float:
    return float(radians) * 57.29577951308232


def _g(acceleration: float) -> float:
    """Return an acceleration in per cent of g."""
    return round(100 * acceleration / 9.80665, 6)


def _range(part: str, sensor: str) -> float:
    return read_part(part).sensors[sensor].sheet.range or 0.0


def _step(part: str, sensor: str) -> float:
    return read_part(part).sensors[sensor].sheet.resolution or 0.0


def _relative(reference: Any) -> float:
    """Return the read-out's noise over the highest plateau's rate."""
    return float(reference.noise.white / (PLATEAUS_DEG_S[-1] / 57.29577951308232))
