"""Limits that no sane input meets: the readers refuse what lies beyond, with the place, and take what lies within."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from support.recording_folder import CSV, HEADER, SPIN_DOWN, TOML, line_of, make, refusal

from discsim.disc import Release
from discsim.effects.catalogue import effect
from discsim.engine import fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.limits import BY_KEY, BY_UNIT, FASTEST_SPIN, LARGEST_READING, LATEST, LONGEST_SPAN, limit_of, time_fault
from discsim.recording import Samples, SensorSheet, read_recording, write_recording
from discsim.rig import read_profile
from discsim.sensors.sampling import Sampling
from discsim.shipped import load_disc
from discsim.trajectory import predict
from discsim.written import corrected, require_seconds


def field_file(t: np.ndarray) -> dict[str, str]:
    return CSV | {"magnetometer.csv": "\n".join([HEADER, *(f"{time!r},1,2,3" for time in t.tolist()), ""])}


EVEN = np.arange(200) / 100
BEYOND = [
    ("seconds since 1970", 1.7e9 + EVEN, 2, r"time is 1.7e\+09 s; expected seconds from the start"),
    ("a clock that jumps by days", EVEN + 2e5 * (EVEN > 1), 103, r"the rows span 200002 s; expected at most 100000 s"),
    ("a clock that jumps by hours", EVEN + 3e4 * (EVEN > 1), 103, r"room for 3e\+06 of them.*jump by 30000 s here"),
    ("times one ulp apart", 1.0 + np.arange(200) * 2.0**-52, 3, r"rows are 2.22e-16 s apart \(median\); expected"),
    ("times in kiloseconds", 1e-6 * EVEN, 3, r"rows are 1e-08 s apart.*is time in seconds\?"),
]


@pytest.mark.parametrize(("t", "line", "says"), [row[1:] for row in BEYOND], ids=[row[0] for row in BEYOND])
def test_times_that_no_recording_has_are_refused_at_their_line(tmp_path, t, line, says):
    message = refusal(make(tmp_path / "flight", csv=field_file(t)))
    assert message.startswith(f"magnetometer.csv:{line}: ")
    assert re.search(says, message)


@pytest.mark.parametrize(
    "t",
    [
        EVEN - 5.0,
        np.concatenate([EVEN, 3600.0 + EVEN]),  # two bursts an hour apart
        np.arange(0.0, LONGEST_SPAN, 100.0),  # a day of a slow sensor
        LATEST - 2.0 + EVEN,
        np.array([0.0]),
        np.arange(200) * 1e-5,
    ],
    ids=["before the start", "bursts", "a day", "late", "one row", "100 kHz"],
)
def test_times_of_recordings_at_the_edge_are_taken(tmp_path, t):
    recording = read_recording(make(tmp_path / "flight", csv=field_file(t)))
    np.testing.assert_array_equal(recording.samples["magnetometer"].t, t)


@pytest.mark.parametrize("unit", [1e3, 1e6], ids=["ms", "us"])
def test_milliseconds_and_microseconds_written_as_seconds_are_read_for_the_setup_to_find(tmp_path, unit):
    t = unit * np.arange(0.0, 20.0, 0.01)
    whole = read_recording(make(tmp_path / "flight", csv=field_file(t)))
    recording = replace(whole, samples={"magnetometer": whole.samples["magnetometer"]})
    np.testing.assert_array_equal(recording.samples["magnetometer"].t, t)
    require_seconds(corrected(recording, [effect("clock.units", written_in="ms" if unit == 1e3 else "us")]))
    if unit == 1e6:
        with pytest.raises(InputError, match=r"magnetometer, row \d+: "):
            require_seconds(recording)


def test_an_hour_at_a_kilohertz_is_within_the_limits():
    assert time_fault(np.arange(3_600_000) / 1000) is None


def test_a_reading_that_no_sensor_gives_is_refused_at_its_cell(tmp_path):
    rows = CSV["magnetometer.csv"].replace("2.1", "3.4e38")
    message = refusal(make(tmp_path / "flight", csv=CSV | {"magnetometer.csv": rows}))
    assert (
        message
        == f"magnetometer.csv:3: y_uT is 3.4e+38, expected at most {LARGEST_READING:g} in size, or an empty cell"
    )


NUMBERS = [
    ("mass_kg = 0.179", "mass_kg = 1e300", r"'disc.mass_kg' is 1e\+300, expected at most 1000 in size"),
    ("mass_kg = 0.179", "mass_kg = 1e-320", r"'disc.mass_kg' is 1e-320, expected at least 1e-06"),
    (
        "diameter_m = 0.212",
        "diameter_m = 212.0",
        r"'disc.diameter_m' is 212.0, expected at most 100 .*; in mm\? that is 0.212",
    ),
    ("Izz_kg_m2 = 0.00115", "Izz_kg_m2 = 11500", r"at most 10000 in size; in g cm2\? that is 0.00115"),
    ("density_kg_m3 = 1.204", "density_kg_m3 = 1204", r"at most 100 in size; in g/m3\? that is 1.204"),
    ("CLa = 2.1", "CLa = 1e12", r"'disc.aero.CLa' is 1000000000000.0, expected at most 1000 in size"),
    ("CLa = 2.1", "CLa = 2.1\nCLa_sigma = 1e-40", r"'disc.aero.CLa_sigma' is 1e-40, expected at least 1e-30"),
    ("[23.6, 5.5", "[2.36e7, 5.5", r"'release.velocity_ned_m_s' is 23600000.0, expected at most 10000 in size"),
    ("rate_hz = 100.0", "rate_hz = 1e9", r"'sensors.magnetometer.rate_hz' is 1000000000.0, expected at most 100000"),
    ("noise_rms_uT = 0.6", "noise_rms_uT = 1e300", r"noise_rms_uT' is 1e\+300, expected at most 1e\+09"),
    ("= 9.798", "= 99999999999999999999", r"gravity_m_s2' is 99999999999999999999, expected a finite number \(an int"),
    *(
        ("= 9.798", f"= {text}", rf"'environment.gravity_m_s2' is an integer of {digits} digits, expected a finite")
        for text, digits in (("0x" + "f" * 5000, 6021), ("0o" + "7" * 5000, 4516), ("0b" + "1" * 20000, 6021))
    ),
]


@pytest.mark.parametrize(("old", "new", "says"), NUMBERS, ids=[row[1][:30] for row in NUMBERS])
def test_a_number_beyond_its_limit_is_refused_at_its_line(tmp_path, old, new, says):
    text = TOML.replace(old, new, 1)
    message = refusal(make(tmp_path / "flight", text))
    assert message.startswith(f"recording.toml:{line_of(text, new.splitlines()[-1])}: ")
    assert re.search(says, message)


def test_zero_stays_a_size_where_it_was_one(tmp_path):
    """A bearing without friction, noise of nothing, and a component as small as rounding leaves it."""
    text = SPIN_DOWN.replace("viscous_N_m_s = 3.0e-5", "viscous_N_m_s = 0").replace(
        "noise_rms_uT = 0.6", "noise_rms_uT = 0"
    )
    text = text.replace("[-0.0161, 0.0, 0.0]", "[-0.0161, 1e-19, 5e-324]")
    recording = read_recording(make(tmp_path / "rig", text))
    assert recording.rig is not None
    assert (recording.rig.viscous, recording.sheets["magnetometer"].noise_rms) == (0.0, 0.0)


def test_a_key_of_two_thousand_letters_makes_no_error_of_as_many(tmp_path):
    message = refusal(make(tmp_path / "flight", TOML.replace("name =", f"name = 'a'\n{'x' * 2000} =", 1)))
    assert "unknown key 'xxx" in message
    assert len(message) < 300


def test_what_is_written_is_within_the_limits_too(tmp_path):
    recording = read_recording(make(tmp_path / "flight"))
    for t, value in ((1.7e9, 1.0), (0.0, 1e10)):
        wild = Samples(np.array([t]), np.full((1, 3), value))
        made = type(recording)(
            "free_spin", "made", Environment(), None, None, None, {"gyroscope": SensorSheet(1.0)}, {"gyroscope": wild}
        )
        with pytest.raises(InputError, match=r"made: gyroscope, row 0: .*expected"):
            write_recording(made, tmp_path / "made")
        assert not (tmp_path / "made").exists()


@pytest.mark.parametrize(
    ("knots", "says"),
    [
        ("time_s,rate_deg_s\n0,0\n1e9,100\n", r":3: time is 1e\+09 s; expected seconds from the start"),
        ("time_s,rate_deg_s\n0,0\n4000,100\n", r":3: the profile ends at 4000 s, expected at most 3600 s"),
        ("time_s,rate_deg_s\n0,0\n1,1e8\n2,0\n", r":3: the rate is 1.74533e\+06 rad/s, expected at most 5000 rad/s"),
    ],
)
def test_a_profile_beyond_what_is_simulated_is_refused(tmp_path, knots, says):
    (tmp_path / "profile.csv").write_text(knots)
    with pytest.raises(InputError, match=says):
        read_profile(tmp_path / "profile.csv")


def test_a_sensor_that_would_give_too_many_rows_is_refused():
    with pytest.raises(InputError, match=r"sampling 30 s at 1e\+06 Hz .* gives 3e\+07 rows; expected at most 20000000"):
        Sampling(1e6).instants(0.0, 30.0, np.random.default_rng(0))


def test_a_flight_that_turns_too_far_in_a_step_is_refused_and_not_flown_wrongly():
    """At 1000 rad/s and 1 ms all of a wobble is lost, and MuJoCo gives no warning."""
    disc, there = load_disc("driver")
    thrown = Release(velocity=np.array([20.0, 0.0, -4.0]), body_rate=np.array([2.0, 0.0, 1000.0]))
    with pytest.raises(
        InputError, match=r"turns at 1000 rad/s, 1 rad in a step; expected at most 0.5 rad \(500 rad/s\)"
    ):
        fly(disc, there, thrown, duration=0.1)
    fine = fly(disc, there, thrown, duration=0.1, timestep=1e-4)
    known = predict(disc, there, thrown, duration=0.1).motion()
    # a thousandth of the wobble; at 1 ms as much as a tenth of it is lost in this time
    np.testing.assert_allclose(fine.at(np.array([0.099])).rate, known.at(np.array([0.099])).rate, atol=2e-3)


def test_a_spin_that_a_step_in_flight_makes_too_fast_is_refused_too():
    disc, there = load_disc("driver")
    thrown = Release(velocity=np.array([20.0, 0.0, -4.0]), body_rate=np.array([0.0, 0.0, 70.0]))
    with pytest.raises(InputError, match=r"rad in a step; expected at most"):
        fly(disc, there, thrown, [effect("event.spin_step", t_s=0.05, dr_rad_s=800.0)], duration=0.2)


def test_the_standalone_model_refuses_a_spin_that_its_shortest_steps_do_not_follow():
    """They are taken whatever their error: two axes within the limit of one turn at more."""
    disc, there = load_disc("driver")
    thrown = Release(velocity=np.array([20.0, 0.0, -4.0]), body_rate=np.array([4900.0, 0.0, 4900.0]))
    with pytest.raises(InputError, match=r"the disc turns at .* rad/s; expected at most 5000 rad/s"):
        predict(disc, there, thrown, duration=0.1)


def test_the_standalone_model_keeps_a_wobble_at_the_fastest_spin():
    """Without air a symmetric body's wobble neither grows nor dies out, however fast it spins."""
    disc, there = load_disc("driver")
    thrown = Release(velocity=np.array([20.0, 0.0, -4.0]), body_rate=np.array([2.0, 0.0, FASTEST_SPIN - 1.0]))
    state = predict(disc, replace(there, air_density=1e-12), thrown, duration=0.2).motion().at(np.array([0.19]))
    # 1e-8 of 5000 rad/s may be lost in a step; a nutation of 9600 rad/s takes a step per radian, 1800 in 0.19 s
    np.testing.assert_allclose(np.hypot(*state.rate[0, :2]), 2.0, atol=1800 * 1e-8 * FASTEST_SPIN)


def test_a_key_finds_its_own_limit_then_its_longest_unit():
    assert limit_of("diameter_m") == BY_KEY["diameter_m"]
    assert limit_of("viscous_N_m_s") == BY_UNIT["N_m_s"]
    assert limit_of("w_north_m_s") == BY_UNIT["m_s"]
    assert limit_of("s").largest == limit_of("exponent").largest == 1e30


def test_every_shipped_file_and_default_is_within_the_limits(tmp_path: Path):
    """Reading them is the proof; here the sizes of what the catalogue shows by."""
    from discsim.effects.catalogue import CATALOGUE

    for row in CATALOGUE.values():
        for name, size in zip(row.parameters, row.scale, strict=True):
            value = 1.0 if name in ("ratio",) else size
            assert not limit_of(name).fault(value, divides=name in row.positive), (row.id, name)
