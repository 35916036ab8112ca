"""Sound inputs to start from: recordings of a closed form, a raw log, one file of every kind that a person writes."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import cache
from types import MappingProxyType

import numpy as np

from discsim.arrays import FloatArray
from discsim.files import model_file
from discsim.recording import SENSORS

__all__ = ["FILES", "RAW", "RECORDINGS", "recording_files"]

FIELD, PLACE, GRAVITY = (30.1, -4.3, 39.2), -0.0161, 9.798
#: spin at the start rad/s, and the time constant of its decay s
SPIN, DECAY = 70.0, 18.0

HEAD = """\
format = "discsim-recording/1"
plant = "{plant}"
name = "seed"

[environment]
gravity_m_s2 = 9.798
magnetic_field_ned_uT = [30.1, -4.3, 39.2]
magnetic_field_sigma_uT = 0.15
air_density_kg_m3 = 1.204
wind_ned_m_s = [1.0, -0.5, 0.0]
wind_sigma_m_s = 0.5
"""
DISC = """
[disc]
mass_kg = 0.179
diameter_m = 0.212
Ixx_kg_m2 = 0.0006
Izz_kg_m2 = 0.00115
Izz_sigma_kg_m2 = 1.0e-5
[disc.aero]
CL0 = 0.13
CLa = 2.1
CD0 = 0.062
CDa = 1.35
alpha0_rad = -0.05
CM0 = -0.012
CMa = 0.12
CMq = -0.15
CRr = 0.0035
CRp = -0.12
CNr = -0.0045
[disc.aero_sigma]
CL0 = 0.0026
CNr = 0.001
"""
ENVIRONMENT = (
    "\n[environment]\ngravity_m_s2 = 9.798\nmagnetic_field_ned_uT = [30.1, -4.3, 39.2]\nair_density_kg_m3 = 1.204\n"
)
TABLES = """
[disc.aero_table]
alpha_rad = [-0.1, 0.0, 0.1]
CL = [-0.1, 0.13, 0.34]
CD = [0.07, 0.066, 0.09]
CM = [-0.02, -0.012, 0.0]
[disc.CR_table]
alpha_rad = [-0.1, 0.1]
advance_ratio = [0.1, 0.4]
CR = [[0.0, 0.001], [0.001, 0.002]]
CRp = [-0.12, -0.13]
"""
RELEASE = """
[release]
position_ned_m = [0.0, 0.0, -1.3]
velocity_ned_m_s = [23.6, 0.0, -4.2]
velocity_sigma_m_s = 0.6
roll_rad = -0.2
pitch_rad = 0.14
body_rate_rad_s = [0.0, 0.0, 70.0]
"""
RIG = "\n[rig]\nIzz_kg_m2 = 0.0011\nviscous_N_m_s = 6.0e-5\nviscous_sigma_N_m_s = 3.0e-6\n"
SHEETS: Mapping[str, str] = MappingProxyType(
    {
        "magnetometer": "rate_hz = 100.0\nnoise_rms_uT = 0.6\nresolution_uT = 0.15\nrange_uT = 4912.0\n",
        "accelerometer": "rate_hz = 200.0\nnoise_rms_m_s2 = 0.08\nresolution_m_s2 = 0.005\nrange_m_s2 = 156.9\n"
        "position_m = [-0.0161, 0.0, 0.0]\n",
        "gyroscope": "rate_hz = 200.0\nnoise_rms_rad_s = 0.003\nresolution_rad_s = 0.001\nrange_rad_s = 104.7\n",
        "gps": "rate_hz = 10.0\nposition_noise_rms_m = 0.5\nvelocity_noise_rms_m_s = 0.1\n",
        "rate_reference": "rate_hz = 100.0\nnoise_rms_rad_s = 0.01\n",
        "track": "rate_hz = 30.0\nnoise_rms_m = 0.02\n",
    }
)
ON_BOARD = ("magnetometer", "accelerometer", "gyroscope")
CARRIED: Mapping[str, tuple[str, ...]] = MappingProxyType(
    {
        "flight": (*ON_BOARD, "gps", "track"),
        "rate_table": (*ON_BOARD, "rate_reference"),
        "spin_down": (*ON_BOARD, "rate_reference"),
        "free_spin": ON_BOARD,
    }
)
RECORDINGS = tuple(CARRIED)


def _values(sensor: str, t: FloatArray) -> FloatArray:
    """Readings (n, k) of a body that spins about the vertical, ``psi`` the angle turned, and flies straight on."""
    r = SPIN * np.exp(-t / DECAY)
    psi = SPIN * DECAY * (1 - np.exp(-t / DECAY))
    north, east, down = FIELD
    still = np.zeros_like(t)
    flown = np.stack([20.0 * t, 3.0 * t, -1.3 - 4.0 * t + 2.0 * t**2], axis=1)
    return {
        "magnetometer": lambda: np.stack(
            [
                north * np.cos(psi) + east * np.sin(psi),
                east * np.cos(psi) - north * np.sin(psi),
                np.full_like(t, down),
            ],
            axis=1,
        ),
        "accelerometer": lambda: np.stack([-(r**2) * PLACE, -r / DECAY * PLACE, still - GRAVITY], axis=1),
        "gyroscope": lambda: np.stack([still, still, r], axis=1),
        "rate_reference": lambda: r[:, None],
        "gps": lambda: np.column_stack([flown, 20.0 + still, 3.0 + still, 4.0 * t - 4.0]),
        "track": lambda: flown,
    }[sensor]()


_NOISE = {
    "magnetometer": 0.6,
    "accelerometer": 0.08,
    "gyroscope": 0.003,
    "gps": 0.1,
    "rate_reference": 0.01,
    "track": 0.02,
}


@cache
def recording_files(plant: str, duration: float = 2.0) -> Mapping[str, str]:
    """Return the files of a recording of ``duration`` s, by name."""
    rng = np.random.default_rng(1)
    toml = HEAD.format(plant=plant)
    toml += {"flight": DISC + RELEASE, "free_spin": DISC, "spin_down": RIG, "rate_table": ""}[plant]
    files = {}
    for sensor in CARRIED[plant]:
        toml += f"\n[sensors.{sensor}]\n{SHEETS[sensor]}"
        rate = float(SHEETS[sensor].split()[2])
        t = np.arange(round(duration * rate)) / rate
        value = _values(sensor, t)
        value = value + _NOISE[sensor] * rng.standard_normal(value.shape)
        files[f"{sensor}.csv"] = _csv(SENSORS[sensor].header, np.column_stack([t, value]))
    if plant == "rate_table":
        files["command.csv"] = "time_s,rate_rad_s\n0.0,70.0\n0.5,68.1\n1.0,66.2\n1.5,64.4\n2.0,62.6\n"
    return MappingProxyType({"recording.toml": toml, **files})


def _csv(head: str, table: FloatArray) -> str:
    return "\n".join([head, *(",".join(f"{cell:.6g}" for cell in row) for row in table.tolist()), ""])


def _log() -> str:
    """One table as a logger writes it: counts of ms, other units, all sensors in one row."""
    t = np.arange(300) / 100
    mag, acc, gyro = (_values(sensor, t) for sensor in ON_BOARD)
    table = np.column_stack([1000 * t, acc / 9.80665, np.degrees(gyro), mag])
    return _csv("time_ms,ax_g,ay_g,az_g,gx_dps,gy_dps,gz_dps,mx_uT,my_uT,mz_uT", table)


MAP = """\
name = "seed"
plant = "free_spin"
repairs = ["width", "number", "time"]

[time]
column = "time_ms"
unit = "ms"

[environment]
gravity_m_s2 = 9.80665
magnetic_field_ned_uT = [30.1, -4.3, 39.2]

[sensors.magnetometer]
columns = ["mx_uT", "my_uT", "mz_uT"]
unit = "uT"
rate_hz = 100.0

[sensors.accelerometer]
columns = ["ax_g", "ay_g", "az_g"]
unit = "g"
range_m_s2 = 156.9
position_m = [-0.0161, 0.0, 0.0]

[sensors.gyroscope]
columns = ["gx_dps", "gy_dps", "gz_dps"]
unit = "deg/s"
axes = ["x", "y", "z"]
"""
RAW: Callable[[], Mapping[str, str]] = cache(lambda: MappingProxyType({"log.csv": _log(), "map.toml": MAP}))

MODEL = """\
[[effects]]
id = "air.wind"
recordings = "all"
[effects.parameters]
w_north_m_s = 1.5
w_east_m_s = -0.5
[effects.sigma]
w_north_m_s = 0.2

[[effects]]
id = "mag.axes"
recordings = ["01"]
[effects.setting]
axes = "x -y z"

[law]
text = "a * V^2 + b * |r|^c"
target = "force_z_N"
[law.coefficients]
a = -1.0e-4
b = 1.0e-5
c = 1.5
[law.sigma]
a = 1.0e-5
"""
PLAN = """\
name = "seed"
seed = 3
drawn = true
fft_step = 64

[truth]
plant = "rate_table"
rates_deg_s = [0.0, 1000.0, 3000.0]
hold_s = 3.0
ramp_s = 1.0

[axes]
dip_deg = [0.0, 60.0]
radius_m = 0.016
[axes.effect]
"accel.bias.bx_m_s2" = [0.0, 0.5]

[mounts]
design = "random"
count = 8
x_m = [-0.001, 0.001]
about_x_deg = [-3.0, 3.0]

[estimators]
accelerometer = "all"
fft = 2
"""
THROWS = """\
[[recording]]
text = "slow"
velocity_ned_m_s = [12.0, 0.0, -2.0]
roll_rad = -0.1
body_rate_rad_s = [0.0, 0.0, 45.0]
duration_s = 2.0

[[recording]]
velocity_ned_m_s = [-20.0, 0.0, -3.0]
body_rate_rad_s = [0.0, 0.0, -60.0]
"""
RUN_DOWNS = "[[recording]]\nrate_rad_s = 80.0\nduration_s = 20.0\ntilt_north_rad = 0.1\n"
TABLE_RUNS = "[[recording]]\ntime_s = [0.0, 5.0, 10.0]\nrate_rad_s = [0.0, 60.0, 0.0]\n"
SPINS = "[[recording]]\nbody_rate_rad_s = [0.5, 0.0, 60.0]\nduration_s = 3.0\npitch_rad = 0.2\n"


def _shipped(name: str) -> str:
    return model_file(name).read_text(encoding="utf-8")


#: one file of every kind that a person writes, by the name of the kind
FILES: Mapping[str, Callable[[], Mapping[str, str]]] = MappingProxyType(
    {
        "disc": lambda: {"disc.toml": ENVIRONMENT + DISC + TABLES},
        "throw": lambda: {"throw.toml": RELEASE.replace("[release]", "")},
        "site": lambda: {"site.toml": _shipped("sites/seoul.toml")},
        "part": lambda: {
            "part.toml": _shipped("parts/mpu9250.toml") + _shipped("parts/neo_m8n.toml").replace("name =", "#")
        },
        "model": lambda: {"model.toml": 'format = "discsim-model/1"\n' + ENVIRONMENT + DISC + RIG + MODEL},
        "plan": lambda: {"plan.toml": PLAN},
        "candidates-flight": lambda: {"candidates.toml": THROWS},
        "candidates-spin_down": lambda: {"candidates.toml": RUN_DOWNS},
        "candidates-rate_table": lambda: {"candidates.toml": TABLE_RUNS},
        "candidates-free_spin": lambda: {"candidates.toml": SPINS},
        "profile": lambda: {"profile.csv": "time_s,rate_deg_s\n0,0\n1,0\n2,3000\n5,3000\n6,0\n7,0\n"},
    }
)
