"""What is left out aloud before a diagnosis, or refused in a sentence."""

from dataclasses import replace

import numpy as np
import pytest
from support.made import DRIVER as DISC
from support.made import FIELD as SITE

from discsim.errors import InputError
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.diagnosis.inertia import DISC as BARE
from discsim.validation.diagnosis.inertia import with_inertia
from discsim.validation.diagnosis.prepared import FASTEST, prepared
from discsim.validation.identification.plants.free_spin import FREE_SPIN

RATE, NOISE = 200.0, 0.01


def spinning(ratio=1.93, end=2.0, wobble=1.0, spin=50.0, seed=0, rate=RATE, disc=None):
    """A free spin in air that does nothing: the transverse rates turn by (ratio - 1) r in the body."""
    rng = np.random.default_rng(seed)
    t = np.arange(0.0, end, 1.0 / rate)
    turning = wobble * np.exp(1j * (ratio - 1.0) * spin * t)
    rates = np.column_stack([turning.real, turning.imag, np.full(t.size, spin)])
    north, east, down = SITE.magnetic_field
    field = (north + 1j * east) * np.exp(-1j * spin * t)
    fields = np.column_stack([field.real, field.imag, np.full(t.size, down)])
    return Recording(
        "free_spin",
        f"spin-{seed}",
        SITE,
        disc=disc,
        sheets={"gyroscope": SensorSheet(rate, NOISE), "magnetometer": SensorSheet(rate, 0.3)},
        samples={
            "gyroscope": Samples(t, rates + NOISE * rng.standard_normal(rates.shape)),
            "magnetometer": Samples(t, fields + 0.3 * rng.standard_normal(fields.shape)),
        },
    )


def changed(recording, sensor, change):
    samples = recording.samples[sensor]
    t, value = change(samples.t.copy(), samples.value.copy())
    return replace(recording, samples={**recording.samples, sensor: Samples(t, value)})


def test_sound_recordings_are_left_as_they_are_and_nothing_is_said():
    recordings = [spinning(seed=1), spinning(seed=2)]
    usable, said = prepared(recordings, ["01", "02"])
    assert said == []
    for before, after in zip(recordings, usable, strict=True):
        for sensor, samples in before.samples.items():
            np.testing.assert_array_equal(samples.value, after.samples[sensor].value)


def test_a_sensor_that_falls_silent_is_named_with_the_time_and_the_recording():
    silent = changed(spinning(seed=2), "magnetometer", lambda t, v: (t[t < 0.3], v[t < 0.3]))
    _, said = prepared([spinning(seed=1), silent], ["01", "02"])
    assert len(said) == 1
    assert said[0].startswith("02: the magnetometer is silent from 0.29 to 2.")


def test_an_axis_that_stands_still_becomes_a_gap_and_is_named():
    def stuck(t, value):
        value[:, 1] = 12.5
        return t, value

    usable, said = prepared([changed(spinning(), "magnetometer", stuck)], ["01"])
    assert np.all(np.isnan(usable[0].samples["magnetometer"].value[:, 1]))
    assert np.all(np.isfinite(usable[0].samples["magnetometer"].value[:, [0, 2]]))
    assert said == ["y_uT of the magnetometer stands still at 12.5: it is left out."]


def test_steps_coarser_than_the_noise_may_stand_still():
    def stuck(t, value):
        value[:, 1] = 12.5
        return t, value

    coarse = changed(spinning(), "magnetometer", stuck)
    sheets = {**coarse.sheets, "magnetometer": SensorSheet(RATE, 0.05, resolution=0.6)}
    usable, said = prepared([replace(coarse, sheets=sheets)], ["01"])
    assert said == []
    assert np.all(usable[0].samples["magnetometer"].value[:, 1] == 12.5)


def test_a_sensor_without_a_reading_goes_and_is_named():
    empty = changed(spinning(), "magnetometer", lambda t, v: (t, np.full_like(v, np.nan)))
    usable, said = prepared([empty, spinning(seed=1)], ["01", "02"])
    assert "magnetometer" not in usable[0]
    assert any("01: the magnetometer holds no reading" in one for one in said)
    assert any(one.startswith("01: no magnetometer") for one in said)


def test_repeats_of_a_slower_sensor_are_named_where_they_are_too_few_to_tell_its_rate():
    held = changed(spinning(end=0.1), "magnetometer", lambda t, v: (t, v[(np.arange(t.size) // 4) * 4]))
    _, said = prepared([held], ["01"])
    assert len(said) == 1
    assert "repeats 79 % of its readings" in said[0]


def test_what_is_faster_than_a_disc_needs_is_thinned_aloud():
    usable, said = prepared([spinning(rate=5000.0, end=0.5)], ["01"])
    assert usable[0].samples["gyroscope"].interval == pytest.approx(1.0 / FASTEST)
    assert usable[0].sheets["gyroscope"].rate_hz == FASTEST
    assert sum("one of 5 of its readings" in one for one in said) == 2


def test_what_lasts_longer_than_any_throw_is_cut_aloud():
    usable, said = prepared([spinning(end=30.0, rate=50.0)], ["01"])
    assert usable[0].end <= FREE_SPIN.durations.longest
    assert any("longer than any free_spin lasts" in one for one in said)


@pytest.mark.parametrize(
    ("recording", "word"),
    [
        (spinning(end=0.04), "too few readings"),
        (replace(spinning(), plant="flight"), "a flight needs [disc]"),
        (replace(spinning(), plant="spin_down"), "needs [rig]"),
        (replace(spinning(), plant="rate_table"), "needs command.csv"),
        (changed(changed(spinning(), "gyroscope", lambda t, v: (t + 300, v)), "magnetometer",
                 lambda t, v: (t + 300, v)), "its first reading is at 300"),
    ],
    ids=["short", "flight", "spin_down", "rate_table", "late"],
)  # fmt: skip
def test_what_cannot_be_diagnosed_is_refused_in_one_sentence(recording, word):
    with pytest.raises(InputError) as refused:
        prepared([recording], ["01"])
    assert word in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_free_spin_that_states_its_disc_keeps_it():
    recordings = [spinning(disc=DISC)]
    given, said = with_inertia(recordings)
    assert given[0] is recordings[0]
    assert said == []


def test_a_free_spin_without_a_disc_takes_that_of_the_others():
    given, said = with_inertia([spinning(disc=DISC), spinning(seed=1)])
    assert given[1].disc == DISC
    assert "that of the others" in said[0]


@pytest.mark.parametrize("wobble", [0.0, 1.0], ids=["no wobble", "wobble"])
def test_without_any_disc_the_ratio_has_the_prior_of_a_bare_disc(wobble):
    given, said = with_inertia([spinning(wobble=wobble), spinning(seed=1, wobble=wobble)])
    disc = given[0].disc
    assert disc.Izz / disc.Ixx == pytest.approx(BARE)
    assert disc.sigma["Izz_kg_m2"] / disc.Ixx == pytest.approx(0.05)
    assert "prior 1.93" in said[0]


def test_a_wobble_that_dies_beside_a_moment_that_grows_is_that_of_a_disc():
    """What the air turns a disc by is no wobble of a ratio near 0, at which a free spin without [disc] then began."""

    def dying(t, value):
        rates = np.exp(1j * 0.93 * 30.0 * t) * np.exp(-6.0 * t) + 0.4 * (t / 1.25 - 1.0) * np.exp(-30j * t)
        return t, np.column_stack([rates.real, rates.imag, value[:, 2]])

    spins = [changed(spinning(end=2.5, spin=30.0, seed=seed), "gyroscope", dying) for seed in range(2)]
    given, said = with_inertia(spins)
    assert given[0].disc.Izz / given[0].disc.Ixx == pytest.approx(BARE)
    assert "prior 1.93" in said[0]


@pytest.mark.parametrize("ratio", [0.12, 0.5, 1.3])
def test_the_wobble_of_a_body_that_is_no_disc_tells_its_ratio(ratio):
    """A free symmetric body turns its transverse rates by (Izz/Ixx - 1) r.

    The grid of ratios has steps of 0.005, and a course of the wobble hides half a radian of the 100 that it turns by.
    """
    disc = with_inertia([spinning(ratio=ratio)])[0][0].disc
    assert disc.Izz / disc.Ixx == pytest.approx(ratio, abs=0.005 + 0.5 / 100.0)


def test_a_body_that_tumbles_by_no_ratio_is_refused_with_what_to_add():
    rng = np.random.default_rng(3)

    def tumbling(t, value):
        slow = sum(
            rng.normal(0.0, 12.0, (1, 2)) * np.sin(f * t[:, None] + rng.uniform(0, 6, 2)) for f in (5, 9, 14, 23)
        )
        value[:, :2] = slow
        return t, value

    with pytest.raises(InputError, match=r"add \[disc\] with Ixx_kg_m2 and Izz_kg_m2"):
        with_inertia([changed(spinning(), "gyroscope", tumbling)])


def test_stamps_in_whole_milliseconds_are_taken_as_even_and_it_is_said():
    """Throws with nothing concealed came out unexplained: the field of 400 rows a second was off by 0.8 uT."""
    whole = spinning(seed=3, rate=400.0)
    rounded = whole
    for sensor in whole.samples:
        rounded = changed(rounded, sensor, lambda t, v: (np.round(t, 3), v))
    (usable,), said = prepared([rounded], ["01"])
    for sensor, samples in whole.samples.items():
        assert np.max(np.abs(usable.samples[sensor].t - samples.t)) < 5e-5
        assert f"the stamps of the {sensor} are rounded to 1 ms, and even but for that" in " ".join(said)
