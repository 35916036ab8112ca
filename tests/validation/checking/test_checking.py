"""`check` says what a recording holds, what is wrong with it, and what it can tell; of sound ones it says nothing."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console
from support.made import throws
from support.places import PRACTICE

from discsim.disc import Disc, Release
from discsim.environment import Environment
from discsim.estimators.methods import all_methods
from discsim.files import model_file, model_names
from discsim.recording import Recording, Samples, SensorSheet, read_dataset, write_recording
from discsim.shipped import load_disc
from discsim.validation.checking import Check, check_recording
from discsim.validation.checking.checked import check as checked
from discsim.validation.checking.noise import noise_of
from discsim.validation.checking.table import print_checks
from discsim.validation.commands.check import command
from discsim.validation.diagnosis.setup import find_setup_faults
from discsim.validation.importing.imported_log import import_log

practice = pytest.mark.skipif(not PRACTICE.is_dir(), reason="no practice sets here (DISCSIM_RECORDINGS)")

G = 9.798
DISC = Disc(0.179, 0.212, 6.0e-4, 1.15e-3)


def rolled(seconds: float = 6.0, rate_deg_s: float = 1500.0, rest: float = 2.0) -> Recording:
    """A disc that lies flat, then spins about its vertical axis: 100 Hz field, 200 Hz force and rates, with noise."""
    rng = np.random.default_rng(0)
    slow, fast = np.arange(0, seconds, 0.01), np.arange(0, seconds, 0.005)
    rate = np.radians(rate_deg_s)

    def spin(t: np.ndarray) -> np.ndarray:
        return np.where(t > rest, rate, 0.0)

    phase = rate * np.maximum(slow - rest, 0)
    field = np.stack([30 * np.cos(phase), -30 * np.sin(phase), 0 * phase + 39], 1)
    force = np.stack([0.0161 * spin(fast) ** 2, 0 * fast, 0 * fast - G], 1)
    rates = np.stack([0 * fast, 0 * fast, spin(fast)], 1)

    def read(ideal: np.ndarray, noise: float, step: float) -> np.ndarray:
        return np.round(np.round((ideal + noise * rng.standard_normal(ideal.shape)) / step) * step, 9)

    sheets = {
        "magnetometer": SensorSheet(100.0, 0.6, 0.15, 4912.0),
        "accelerometer": SensorSheet(200.0, 0.08, 0.005, 156.9, position=np.array([-0.0161, 0.0, 0.0])),
        "gyroscope": SensorSheet(200.0, 0.003, 0.001, 34.9066),
    }
    samples = {
        "magnetometer": Samples(slow, read(field, 0.6, 0.15)),
        "accelerometer": Samples(fast, read(force, 0.08, 0.005)),
        "gyroscope": Samples(fast, read(rates, 0.003, 0.001)),
    }
    there = Environment(G, np.array([30.0, 0.0, 39.0]))
    return Recording("free_spin", "rolled", there, DISC, sheets=sheets, samples=samples)


def scaled(recording: Recording, sensor: str, factor: float | list[float]) -> Recording:
    old = recording.samples[sensor]
    sheet = SensorSheet(recording.sheets[sensor].rate_hz, position=recording.sheets[sensor].position)
    return replace(
        recording,
        samples=recording.samples | {sensor: Samples(old.t, old.value * factor)},
        sheets=recording.sheets | {sensor: sheet},
    )


def ids(check: Check, severity: str = "") -> list[str]:
    return [finding.id for finding in check.findings if not severity or finding.severity == severity]


def sentence(check: Check, id: str) -> str:
    return next(finding.sentence for finding in check.findings if finding.id == id)


def test_of_a_sound_recording_nothing_is_said_and_its_sensors_are_measured():
    check = check_recording(rolled())
    assert check.findings == ()
    assert check.not_told == ()
    assert check.duration == pytest.approx(5.995)
    mag, force, gyro = check.sensors
    assert (mag.rows, mag.gaps, mag.held, mag.late, mag.lost, mag.doubled) == (600, 0, 0, 0, 0, 0)
    assert mag.rate_hz == pytest.approx(100.0)
    assert mag.resolution == pytest.approx(0.15)
    # 9 blocks of 64 readings, 3 axes, 14 free values each: 4 % of scatter
    assert mag.noise == pytest.approx(0.6, rel=0.15)
    assert force.noise == pytest.approx(0.08, rel=0.15)
    assert gyro.noise == pytest.approx(0.003, rel=0.15)


@pytest.mark.parametrize("rate_deg_s", [0.0, 300.0, 2500.0, 6000.0])
@pytest.mark.parametrize("amplitude", [0.0, 5.0, 40.0])
def test_noise_is_found_under_a_spin_and_a_nutation_of_any_size(rate_deg_s, amplitude):
    rng = np.random.default_rng(1)
    phase = np.radians(rate_deg_s) * np.arange(1500) / 100
    spin = amplitude * np.stack([np.cos(phase), np.sin(phase), 0.2 * np.cos(0.93 * phase)], 1)
    assert noise_of(spin + 0.6 * rng.standard_normal((1500, 3))) == pytest.approx(0.6, rel=0.1)


def test_noise_that_cannot_be_told_is_not_told():
    rng = np.random.default_rng(2)
    assert noise_of(rng.standard_normal((40, 3))) is None  # too few
    assert noise_of(np.round(0.05 * rng.standard_normal((1000, 3)))) is None  # the resolution hides it


# ------------------------------------------------------------------------------------------- what is wrong in it


@pytest.mark.parametrize(
    ("sensor", "factor", "id", "words"),
    [
        ("accelerometer", 1 / 9.80665, "accel.units", "it is written in g"),
        ("accelerometer", 1000 / 9.80665, "accel.units", "it is written in mg"),
        ("magnetometer", 0.01, "mag.units", "it is written in gauss"),
        ("magnetometer", 10.0, "mag.units", "it is written in mG"),
        ("magnetometer", 1000.0, "mag.units", "it is written in nT"),
        ("gyroscope", 180 / np.pi, "gyro.units", "it is written in deg/s"),
    ],
)
def test_a_unit_that_is_not_the_files_is_an_error_that_names_it(sensor, factor, id, words):
    check = check_recording(scaled(rolled(), sensor, factor))
    assert id in ids(check, "error")
    assert words in sentence(check, id)


def with_rates(rows: slice, rate: float) -> Recording:
    recording = rolled()
    gyro = recording.samples["gyroscope"]
    value = gyro.value.copy()
    value[rows, 2] *= rate / np.radians(1500.0)
    return replace(recording, samples={**recording.samples, "gyroscope": Samples(gyro.t, value)})


def test_single_rates_that_no_throw_has_are_named_with_their_time_and_are_no_noise():
    """A lost decimal point: 26.18 rad/s written as 2618."""
    check = check_recording(with_rates(slice(500, 1200, 90), 2618.0))
    assert ids(check) == ["gyroscope.glitch"]
    said = sentence(check, "gyroscope.glitch")
    assert "8 readings of z are beyond 250 rad/s, the first at 2.500 s, the largest 2619" in said
    (gyroscope,) = (sensor for sensor in check.sensors if sensor.sensor == "gyroscope")
    assert gyroscope.noise == pytest.approx(0.003, rel=0.2)


def test_rates_that_no_throw_has_over_four_rows_are_an_error_for_estimate_uses_them():
    check = check_recording(with_rates(slice(600, 604), 2618.0))
    assert ids(check, "error") == ["gyroscope.glitch"]
    assert "`estimate` uses them" in sentence(check, "gyroscope.glitch")


def test_z_up_is_said_with_the_line_to_write():
    check = check_recording(replace(scaled(rolled(), "accelerometer", [1.0, -1.0, -1.0])))
    assert ids(check) == ["accel.upside_down"]
    assert 'axes = ["x", "-y", "-z"]' in sentence(check, "accel.upside_down")


def test_a_steady_spin_or_a_fall_is_not_taken_for_a_rest():
    spinning = rolled(rest=0.0)
    assert ids(check_recording(scaled(spinning, "accelerometer", 2.0))) == []
    alone = replace(spinning, samples={"accelerometer": spinning.samples["accelerometer"]})
    assert "accel.scale" not in ids(check_recording(alone))


@pytest.mark.parametrize(
    ("environment", "id", "severity"),
    [
        ({"gravity": 1.0}, "site.gravity", "error"),
        ({"gravity": 9.75}, "site.gravity", "warning"),
        ({"magnetic_field": np.array([3e4, 0.0, 3.9e4])}, "site.field", "error"),
        ({"magnetic_field": np.zeros(3)}, "site.field", "warning"),
        ({"air_density": 1204.0}, "air.density", "error"),
        ({"wind": np.array([40.0, 0.0, 0.0])}, "air.wind", "warning"),
    ],
)
def test_a_place_that_is_not_on_earth_is_named(environment, id, severity):
    recording = rolled()
    check = check_recording(replace(recording, environment=replace(recording.environment, **environment)))
    assert id in ids(check, severity)


@pytest.mark.parametrize(
    ("disc", "id", "words"),
    [
        (Disc(179.0, 0.212, 6.0e-4, 1.15e-3), "disc.mass", "a disc in grams: write 0.179"),
        (Disc(0.179, 212.0, 6.0e-4, 1.15e-3), "disc.diameter", "a disc in mm: write 0.212"),
        (Disc(0.179, 0.212, 6000.0, 11500.0), "disc.Izz", "in g cm^2?"),
        (Disc(0.179, 0.212, 600.0, 1150.0), "disc.Izz", "in kg mm^2?"),
    ],
)
def test_a_disc_in_other_units_is_an_error_that_names_them(disc, id, words):
    check = check_recording(replace(rolled(), disc=disc))
    assert ids(check, "error") == [id]
    assert words in sentence(check, id)


@pytest.mark.parametrize(
    ("change", "id", "words"),
    [
        ({"alpha0": -3.0}, "disc.alpha0", "in degrees?"),
        ({"CNr": 0.0045}, "disc.CNr", "expected at most zero"),
    ],
)
def test_an_aerodynamic_number_that_cannot_be_is_named(change, id, words):
    disc, there = load_disc("driver")
    assert disc.aero is not None
    recording = replace(rolled(), disc=replace(disc, aero=disc.aero._replace(**change)), environment=there)
    assert words in sentence(check_recording(recording), id)


@pytest.mark.parametrize("name", model_names("discs"))
def test_every_shipped_disc_is_one(name):
    disc, there = load_disc(name)
    recording = replace(rolled(), plant="flight", disc=disc, environment=there)
    assert [id for id in ids(check_recording(recording)) if id.startswith("disc.")] == []


def test_inertia_is_bounded_by_a_heavy_middle_and_a_rim():
    """m d^2/16 (half of the mass in the middle of a flat disc) to m d^2/4 (all of it in the rim)."""
    unit = 0.179 * 0.212**2
    for share, fine in ((0.06, False), (0.07, True), (0.24, True), (0.26, False)):
        disc = Disc(0.179, 0.212, share * unit * 0.52, share * unit)
        check = check_recording(replace(rolled(), plant="flight", disc=disc))
        assert ("disc.Izz" not in ids(check)) is fine
    ball = Disc(0.179, 0.212, 0.15 * unit, 0.15 * unit)
    assert "disc.Ixx" in ids(check_recording(replace(rolled(), plant="flight", disc=ball)), "warning")


def test_a_release_and_a_place_of_the_accelerometer_in_other_units_are_named():
    release = Release(
        position=np.array([0.0, 0.0, 1.5]),
        velocity=np.array([80.0, 0.0, -5.0]),
        roll=-12.0,
        body_rate=np.array([0.0, 0.0, 4200.0]),
    )
    recording = replace(rolled(), release=release)
    sheet = replace(recording.sheets["accelerometer"], position=np.array([-16.1, 0.0, 0.0]))
    check = check_recording(replace(recording, sheets=recording.sheets | {"accelerometer": sheet}))
    assert ids(check, "error") == ["release.spin", "release.angle", "accel.position"]
    assert ids(check, "warning") == ["release.speed", "release.height"]
    assert "in deg/s?" in sentence(check, "release.spin")
    assert "in mm?" in sentence(check, "accel.position")


def test_held_late_lost_and_silent_rows_are_counted_apart():
    recording = rolled()
    mag = recording.samples["magnetometer"]
    held = np.repeat(mag.value[:300], 2, axis=0)
    check = check_recording(replace(recording, samples=recording.samples | {"magnetometer": Samples(mag.t, held)}))
    assert check.sensors[0].held == pytest.approx(300, abs=2)
    assert "magnetometer.held" in ids(check, "warning")
    keep = np.ones(600, dtype=bool)
    keep[[50, 51, 90]] = False
    keep[200:260] = False
    late = mag.t.copy()
    late[400] += 0.004
    thin = Samples(late[keep], mag.value[keep])
    check = check_recording(replace(recording, samples=recording.samples | {"magnetometer": thin}))
    found = check.sensors[0]
    assert (found.late, found.lost, found.held) == (2, 63, 0)
    assert found.silent == ((pytest.approx(1.99), pytest.approx(0.61)),)
    assert "silent for 0.61 s from 1.990 s on" in sentence(check, "magnetometer.lost")


def test_milliseconds_written_as_seconds_are_an_error():
    recording = rolled()
    slow = {name: Samples(1000 * one.t, one.value) for name, one in recording.samples.items()}
    check = check_recording(replace(recording, samples=slow))
    assert ids(check, "error") == ["clock.units"]
    assert "they are milliseconds: multiply time_s of every file by 0.001" in sentence(check, "clock.units")


def test_one_sensor_in_milliseconds_is_told_by_its_file():
    recording = rolled()
    own = recording.samples["gyroscope"]
    slow = {**recording.samples, "gyroscope": Samples(1000 * own.t, own.value)}
    check = check_recording(replace(recording, samples=slow))
    assert ids(check, "error") == ["clock.units"]
    assert "multiply time_s of gyroscope.csv by 0.001" in sentence(check, "clock.units")
    assert [id for id in ids(check, "warning") if id.endswith(".rate")] == []


def test_ticks_of_a_timer_in_the_place_of_seconds_are_one_error():
    """Each sensor had a warning that its rate was another than rate_hz, and nothing said that a clock was at fault."""
    recording = rolled()
    ticks = {name: Samples(200 * one.t, one.value) for name, one in recording.samples.items()}
    check = check_recording(replace(recording, samples=ticks))
    assert ids(check, "error") == ["clock.units"]
    assert "are they ticks of 0.005 s? Then multiply time_s of every file by 0.005" in sentence(check, "clock.units")
    assert [id for id in ids(check, "warning") if id.endswith(".rate")] == []


def test_a_flight_in_milliseconds_has_one_error_and_no_path_in_kilometres():
    """Positions over such times were a velocity in mm/s, or a position in km."""
    throw = throws(seconds=2.5)[0]
    slow = replace(throw, samples={name: Samples(1000 * one.t, one.value) for name, one in throw.samples.items()})
    (found,) = checked([slow]).checks
    assert ids(found, "error") == ["clock.units"]
    assert found.duration == pytest.approx(throw.end)
    alone = {**throw.samples, "gps": slow.samples["gps"]}
    assert ids(check_recording(replace(throw, samples=alone)), "error") == ["clock.units"]


def test_a_frozen_magnetometer_and_a_dead_axis_are_said_and_a_clipped_one_is_not_called_dead():
    recording = rolled()
    mag, gyro = recording.samples["magnetometer"], recording.samples["gyroscope"]
    frozen, dead, full = mag.value.copy(), gyro.value.copy(), gyro.value.copy()
    frozen[400:] = frozen[400]
    dead[:, 0] = 0.5
    full[:, 2] = 34.9066
    check = check_recording(replace(recording, samples=recording.samples | {"magnetometer": Samples(mag.t, frozen)}))
    assert check.sensors[0].frozen == ((4.0, pytest.approx(5.99)),)
    check = check_recording(replace(recording, samples=recording.samples | {"gyroscope": Samples(gyro.t, dead)}))
    assert check.sensors[2].dead_axes == ("x_rad_s",)
    check = check_recording(replace(recording, samples=recording.samples | {"gyroscope": Samples(gyro.t, full)}))
    assert check.sensors[2].dead_axes == ()
    assert check.sensors[2].clipped_axes == {"z_rad_s": 1.0}
    assert check.sensors[2].clipped_share == 1.0  # of rows, though two of three axes are within the range
    assert "z_rad_s in 100 % of its rows" in sentence(check, "gyroscope.clipped")


def test_a_gps_whose_down_is_up_in_one_of_its_columns_is_named():
    t = np.arange(60) / 10
    place = np.stack([20 * t, 3 * t, -1 - 8 * t + 1.5 * t**2], 1)
    speed = np.stack([20 + 0 * t, 3 + 0 * t, -8 + 3 * t], 1)
    sound = replace(rolled(), samples={"gps": Samples(t, np.hstack([place, speed]))}, sheets={"gps": SensorSheet(10.0)})
    assert "gps.axes" not in ids(check_recording(sound))
    wrong = replace(sound, samples={"gps": Samples(t, np.hstack([place, speed * [1, 1, -1]]))})
    assert "down position and velocity go opposite ways" in sentence(check_recording(wrong), "gps.axes")


def test_what_is_absent_is_said_with_what_cannot_be_asked_then():
    recording = rolled()
    check = check_recording(replace(recording, disc=None, samples={"gyroscope": recording.samples["gyroscope"]}))
    assert check.methods == ("gyroscope",)
    assert check.methods_left_out["fft"] == "no magnetometer"
    text = "\n".join(check.not_told)
    assert "no magnetometer" in text
    assert "mag.hard_iron" in text
    assert "no [disc]" in text


def test_setup_faults_join_the_findings():
    class Fault:
        id = "mag.axes"
        sentence = "the magnetometer's z axis is reversed"

    assert ids(check_recording(rolled(), [Fault()])) == ["mag.axes"]


# ------------------------------------------------------------------------------------------------- the command


def test_the_command_prints_a_table_and_writes_only_where_it_is_told_to(tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("sys.argv", ["discsim", "check"])
    monkeypatch.chdir(tmp_path)
    wrong = replace(rolled(), disc=Disc(179.0, 0.212, 6.0e-4, 1.15e-3))
    for name in ("01", "02"):
        write_recording(wrong, tmp_path / "set" / name)
    command(tmp_path / "set")
    shown = capsys.readouterr().out
    assert "magnetometer" in shown
    assert "that is a disc in grams" in " ".join(shown.split())
    assert "2 errors, 0 warnings in 2 recordings" in shown
    assert {path.name for path in tmp_path.iterdir()} == {"set"}
    command(tmp_path / "set", out=tmp_path / "out")
    assert {path.name for path in (tmp_path / "out").iterdir()} == {"check.json", "run.json"}
    one, two = json.loads((tmp_path / "out" / "check.json").read_text())["recordings"]
    assert (one["recording"], two["recording"]) == ("01", "02")
    assert one["findings"][0]["id"] == "disc.mass"
    assert one["sensors"][0]["rows"] == 600


def test_what_several_recordings_share_is_said_once():
    low = replace(rolled(), environment=replace(rolled().environment, magnetic_field=np.zeros(3)))
    text = io.StringIO()
    print_checks([check_recording(low)] * 3, Console(file=text, width=200))
    assert text.getvalue().count("the field is not known") == 1
    assert text.getvalue().count("as in a recording above: site.field") == 2


def test_a_log_without_a_field_is_checked_and_what_estimate_can_use_is_what_it_uses():
    low = replace(rolled(), environment=replace(rolled().environment, magnetic_field=np.zeros(3)))
    assert find_setup_faults([low]).faults == ()
    bare = replace(low, samples={"magnetometer": low.samples["magnetometer"]})
    assert find_setup_faults([bare]).faults == ()
    check = check_recording(low)
    rates, _ = all_methods(low)
    assert {rate.method for rate in rates} <= set(check.methods)
    assert "fusion" in check.methods


def test_a_log_that_mostly_rests_is_not_taken_for_one_in_g_and_one_in_g_is():
    """One second of spin in twenty: the mean square of the whole log says little of the pull in that second."""
    log = rolled(seconds=20.0, rate_deg_s=3200.0, rest=19.0)
    assert find_setup_faults([log]).faults == ()
    faults = find_setup_faults([scaled(log, "accelerometer", 1 / G)]).faults
    assert [(fault.id, fault.effect.value.written_in) for fault in faults] == [("accel.units", "g")]


@practice
@pytest.mark.parametrize("folder", sorted(PRACTICE.iterdir()) if PRACTICE.is_dir() else [], ids=lambda path: path.name)
def test_the_practice_sets_are_sound_but_for_gyroscopes_that_clip(folder):
    for recording in read_dataset(folder):
        check = check_recording(recording)
        assert set(ids(check)) <= {"gyroscope.clipped"}
        for sensor in check.sensors:
            assert sensor.held == sensor.late == sensor.lost == sensor.doubled == 0
            if sensor.noise is not None and sensor.stated_noise:
                rounding = (sensor.stated_resolution or 0.0) / np.sqrt(12)
                # the shortest flights have 11 blocks of 64 readings; noise that is coloured comes on top
                assert sensor.noise == pytest.approx(np.hypot(sensor.stated_noise, rounding), rel=0.2)


@pytest.mark.parametrize("rows", [1, 2, 5, 40])
@pytest.mark.parametrize("gap", [False, True])
def test_the_shortest_and_the_emptiest_recordings_are_checked_without_a_fault(rows, gap):
    recording = rolled()
    samples = {
        name: Samples(one.t[:rows], np.full_like(one.value[:rows], np.nan) if gap else one.value[:rows])
        for name, one in recording.samples.items()
    }
    gps = np.full((rows, 6), np.nan if gap else 1.0)
    samples |= {"gps": Samples(np.arange(rows) / 10, gps), "rate_reference": Samples(np.arange(rows) / 10, gps[:, 0])}
    sheets = recording.sheets | {"gps": SensorSheet(10.0), "rate_reference": SensorSheet(10.0)}
    check = check_recording(replace(recording, samples=samples, sheets=sheets))
    text = io.StringIO()
    print_checks([check], Console(file=text, width=120))
    json.dumps(check.to_json())
    assert ids(check, "error") == []
    assert ("magnetometer.dead" in ids(check, "warning")) is gap


# --------------------------------------------------------------------------------------- the axis of the spin


def without_field(axes: tuple[int, int, int]) -> Recording:
    """The disc without its magnetometer, and the columns of its gyroscope in this order."""
    spun = rolled()
    samples = {name: own for name, own in spun.samples.items() if name != "magnetometer"}
    sheets = {name: own for name, own in spun.sheets.items() if name != "magnetometer"}
    gyro = samples["gyroscope"]
    samples["gyroscope"] = Samples(gyro.t, gyro.value[:, list(axes)])
    return replace(spun, samples=samples, sheets=sheets)


@pytest.mark.parametrize(
    ("axes", "seen", "swapped", "turned"),
    [((2, 1, 0), "x", '["z", "y", "x"]', '["y", "z", "x"]'), ((0, 2, 1), "y", '["x", "z", "y"]', '["z", "x", "y"]')],
)
def test_a_spin_about_x_or_y_is_told_without_a_magnetometer_and_the_remedies_mend_it(
    tmp_path, axes, seen, swapped, turned
):
    wrong = without_field(axes)
    (said,) = [one for one in check_recording(wrong).findings if one.id == "gyro.axes"]
    assert f"100 % of the rate's square is on {seen}" in said.what
    line = f"axes = {swapped} and mirrored = true"
    assert f"[sensors.gyroscope] {line}" in said.remedy
    assert f"give every sensor axes = {turned}" in said.remedy
    write_recording(wrong, tmp_path / "raw")
    (tmp_path / "raw" / "recording.toml").unlink()
    plain = model_file("imports/csv.toml").read_text()
    for written in (line.replace(" and ", "\n"), f"axes = {turned}"):
        mended = plain.replace('unit = "rad/s"', f'unit = "rad/s"\n{written}', 1)
        (tmp_path / "mine.toml").write_text(mended)
        recording = import_log(tmp_path / "raw", str(tmp_path / "mine.toml")).recordings[0]
        assert not [one for one in check_recording(recording).findings if one.id == "gyro.axes"]
        assert np.median(recording.samples["gyroscope"].value[-200:, 2]) == pytest.approx(np.radians(1500), rel=0.01)


def test_a_spin_about_z_or_about_no_one_axis_is_not_told():
    assert not [one for one in check_recording(without_field((0, 1, 2))).findings if one.id == "gyro.axes"]
    tumbling = without_field((2, 1, 0))
    gyro = tumbling.samples["gyroscope"]
    turned = gyro.value @ np.array([[0.8, 0.0, 0.6], [0.0, 1.0, 0.0], [-0.6, 0.0, 0.8]]).T
    tumbling = replace(tumbling, samples={**tumbling.samples, "gyroscope": Samples(gyro.t, turned)})
    assert not [one for one in check_recording(tumbling).findings if one.id == "gyro.axes"]
