"""A recording on disk to start from, and the message with which a damaged one is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from discsim.errors import InputError
from discsim.recording import read_recording

TOML = """\
format = "discsim-recording/1"
plant = "flight"
name = "field"

[environment]
gravity_m_s2 = 9.798
magnetic_field_ned_uT = [30.1, -4.3, 39.2]
air_density_kg_m3 = 1.204

[disc]
mass_kg = 0.179
diameter_m = 0.212
Ixx_kg_m2 = 0.0006
Izz_kg_m2 = 0.00115
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

[release]
velocity_ned_m_s = [23.6, 5.5, -4.2]

[sensors.magnetometer]
rate_hz = 100.0
noise_rms_uT = 0.6
[sensors.accelerometer]
rate_hz = 200.0
position_m = [-0.0161, 0.0, 0.0]
"""
CSV = {
    "magnetometer.csv": "time_s,x_uT,y_uT,z_uT\n0.0,1.0,2.0,3.0\n0.01,1.1,2.1,3.1\n0.02,1.2,2.2,3.2\n",
    "accelerometer.csv": "time_s,x_m_s2,y_m_s2,z_m_s2\n0.0,-9.0,0.1,-9.8\n0.005,-9.1,0.2,-9.7\n",
}
MATRIX = "[" + ", ".join(["[-0.004, -0.004, -0.004, -0.004]"] * 4) + "]"
AERO_TABLE = "[disc.aero_table]\nalpha_rad = [-0.1, 0.0, 0.1]\nCL = [-0.1, 0.13, 0.34]\nCD = [0.07, 0.066, 0.09]\n"
CNR_TABLE = f"[disc.CNr_table]\nrate_deg_s = [4500, 4550, 4600, 4650]\nspeed_m_s = [6, 6.5, 7, 7.5]\nCNr = {MATRIX}\n"
RATE_TABLE = TOML.replace('"flight"', '"rate_table"')
SPIN_DOWN = TOML.replace('"flight"', '"spin_down"') + "[rig]\nIzz_kg_m2 = 0.0011\nviscous_N_m_s = 3.0e-5\n"


HEADER = "time_s,x_uT,y_uT,z_uT"


def line_of(text: str, part: str) -> int:
    """Return the 1-based line of the first occurrence of ``part``."""
    return text[: text.index(part)].count("\n") + 1


def make(folder: Path, toml: str = TOML, csv: dict[str, str] = CSV) -> Path:
    folder.mkdir()
    (folder / "recording.toml").write_text(toml, encoding="utf-8")
    for name, text in csv.items():
        (folder / name).write_text(text, encoding="utf-8")
    return folder


def refusal(folder: Path) -> str:
    """Return the message with which the folder is refused: one line that names a file or the folder."""
    with pytest.raises(InputError) as caught:
        read_recording(folder)
    message = str(caught.value)
    assert "\n" not in message
    assert message.startswith(str(folder))
    assert "expected" in message
    return message.removeprefix(str(folder)).lstrip("/")
