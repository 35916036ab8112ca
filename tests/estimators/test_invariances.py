"""What no estimate of a spin may depend on: which way north is, the handedness of the axes, the unit of the field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from fuzz.seeds import recording_files

from discsim.recording import Recording, Samples, read_recording
from estimators.methods import Options
from estimators.rate import YawRate
from validation.estimating.spin_estimates import estimate_all

#: of one standard deviation: rounding, and where an iteration ends
CLOSE = 1e-3


@pytest.fixture(scope="module")
def spin(tmp_path_factory) -> Recording:
    folder = tmp_path_factory.mktemp("spin")
    for name, text in recording_files("free_spin", 2.0).items():
        (folder / name).write_text(text, encoding="utf-8")
    return read_recording(folder)


def rates_of(recording: Recording) -> dict[str, YawRate]:
    return {rate.method: rate for rate in estimate_all(recording, "all", Options())[0]}


@pytest.fixture(scope="module")
def as_it_is(spin) -> dict[str, YawRate]:
    found = rates_of(spin)
    assert {"fft", "accelerometer", "gyroscope", "fusion", "tracking", "likelihood"} <= set(found)
    return found


def assert_same(found: dict[str, YawRate], expected: dict[str, YawRate], sign: float = 1.0) -> None:
    assert found.keys() == expected.keys()
    for method, rate in expected.items():
        other = found[method]
        turned = sign if rate.signed else 1.0
        np.testing.assert_array_equal(other.t, rate.t, err_msg=method)
        np.testing.assert_array_equal(np.isnan(other.rate), np.isnan(rate.rate), err_msg=method)
        known = np.isfinite(rate.rate)
        apart = np.abs(other.rate[known] - turned * rate.rate[known])
        assert np.all(apart <= CLOSE * rate.sd[known] + 1e-9), (method, float(np.max(apart)))
        np.testing.assert_allclose(other.sd[known], rate.sd[known], rtol=CLOSE, err_msg=method)


@pytest.mark.parametrize("angle", [0.7, -2.4])
def test_north_may_lie_anywhere(spin, as_it_is, angle):
    """The same readings in a field that points elsewhere along the horizon: another yaw, and the same rate."""
    c, s = np.cos(angle), np.sin(angle)
    turned = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]) @ spin.environment.magnetic_field
    assert_same(rates_of(replace(spin, environment=replace(spin.environment, magnetic_field=turned))), as_it_is)


def test_a_mirror_turns_the_sign_of_the_rate(spin, as_it_is):
    """Behind a mirror along y a force changes its y alone, a rate and a field, which are axial, their x and z."""
    polar, axial = np.array([1.0, -1.0, 1.0]), np.array([-1.0, 1.0, -1.0])
    signs = {"accelerometer": polar, "gyroscope": axial, "magnetometer": axial}
    samples = {name: Samples(one.t, one.value * signs[name]) for name, one in spin.samples.items()}
    environment = replace(spin.environment, magnetic_field=axial * spin.environment.magnetic_field)
    assert_same(rates_of(replace(spin, environment=environment, samples=samples)), as_it_is, sign=-1.0)


@pytest.mark.parametrize("factor", [0.25, 8.0])
def test_the_unit_of_the_field_may_be_any(spin, as_it_is, factor):
    """Readings, stated field and sheet of the magnetometer by one power of two, which costs no rounding."""
    sheet = spin.sheets["magnetometer"]
    assert None not in (sheet.noise_rms, sheet.resolution, sheet.range)
    scaled = replace(
        sheet, noise_rms=factor * sheet.noise_rms, resolution=factor * sheet.resolution, range=factor * sheet.range
    )
    magnetometer = spin.samples["magnetometer"]
    moved = replace(
        spin,
        environment=replace(
            spin.environment,
            magnetic_field=factor * spin.environment.magnetic_field,
            sigma={key: value * (factor if "field" in key else 1.0) for key, value in spin.environment.sigma.items()},
        ),
        sheets={**spin.sheets, "magnetometer": scaled},
        samples={**spin.samples, "magnetometer": Samples(magnetometer.t, factor * magnetometer.value)},
    )
    assert_same(rates_of(moved), as_it_is)
