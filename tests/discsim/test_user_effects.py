"""Effects of the user's own: the examples of the documentation work, and a bad file is refused by line and reason."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from support.flights import DRIVER, FIELD
from support.places import ROOT

from discsim.aerodynamics import air_wrench, total_wrench
from discsim.effects.applied import compiled_wrench
from discsim.effects.own import load_user_effect, load_user_effects
from discsim.errors import InputError
from discsim.motion import State
from discsim.parameters import PARAMETERS, parameters, tables

PAGE = (ROOT / "docs" / "your-own-effect.md").read_text(encoding="utf-8")
SENSOR, MOTION = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.S) if "NamedTuple" in block)


def written(folder: Path, text: str, name: str = "mine.py") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def line_of(part: str, text: str) -> int:
    """Return the line of an example of the documents that has a part."""
    return next(k for k, line in enumerate(text.splitlines(), 1) if part in line)


def still(n: int) -> State:
    """Return a motion that rests: t (n,) s."""
    zero = np.zeros((n, 3))
    return State(np.arange(n) / 100.0, zero, zero, zero, np.tile([1.0, 0.0, 0.0, 0.0], (n, 1)), zero, zero)


def test_the_documents_sensor_example_bends_readings_in_proportion_to_their_square(tmp_path):
    effect = load_user_effect(written(tmp_path, SENSOR))
    assert effect.row.id == "my.nonlinearity"
    assert effect.row.acts_on == "accelerometer"
    assert effect.row.parameters == ("k_per_m_s2",)
    assert effect.row.scale == (1e-5,)
    assert effect.row.plants == ("flight", "rate_table", "spin_down", "free_spin")
    assert effect.text == "Sensitivity that grows with the reading, f -> f (1 + k |f|)."
    f = np.array([[10.0, -20.0, 0.0], [0.0, 1.0, 100.0]])
    bent = effect.on_readings((0.01,), f, np.array([0.0, 0.01]), still(2))
    np.testing.assert_allclose(bent, [[11.0, -24.0, 0.0], [0.0, 1.01, 200.0]], rtol=1e-14)


def test_the_documents_motion_example_drags_against_the_air(tmp_path):
    effect = load_user_effect(written(tmp_path, MOTION))
    assert effect.row.plants == ("flight",)
    wrench = compiled_wrench(effect)
    assert wrench(np.array([0.5]), 0.0, 1.0, 3.0, -2.0, 1.0, 0.1, 0.2, 60.0) == (-1.5, 1.0, -0.5, 0.0, 0.0, 0.0)


def test_a_motion_of_ones_own_is_added_to_what_the_air_does(tmp_path):
    """Each of the six numbers has a size of its own; the sum differs by rounding."""
    text = MOTION.replace("-k * u, -k * v, -k * w, 0.0, 0.0, 0.0", "k, 2 * k, 3 * k, 4 * k, 5 * k, 6 * k")
    acting = load_user_effect(written(tmp_path, text)).sized({"k_N_per_m_s": 0.125})
    p, given = parameters(FIELD, DRIVER).view(PARAMETERS)[0], (30.0, 20.0, 0.0, 1.0, 0.5, -0.7, 70.0)
    air = np.array(air_wrench(p, tables(DRIVER), *given))
    total = np.array(total_wrench(p, tables(DRIVER, None, [acting]), 0.0, *given))
    np.testing.assert_allclose(total - air, 0.125 * np.arange(1, 7), atol=1e-14)


def test_a_parameters_default_need_not_be_zero(tmp_path):
    text = SENSOR.replace("k_per_m_s2: float = 0.0", "gain: float = 1.0").replace(
        "readings * (1.0 + effect.k_per_m_s2 * np.abs(readings))", "readings * effect.gain"
    )
    effect = load_user_effect(written(tmp_path, text))
    assert effect.row.baseline == (1.0,)


def test_an_effect_sees_the_motion(tmp_path):
    text = SENSOR.replace("np.abs(readings)", "motion.rate").replace("readings * (1.0 +", "(readings +")
    effect = load_user_effect(written(tmp_path, text))
    motion = still(2)._replace(rate=np.full((2, 3), 5.0))
    np.testing.assert_array_equal(effect.on_readings((2.0,), np.ones((2, 3)), motion.t, motion), np.full((2, 3), 11.0))


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("def apply(", "def apply((", r"mine\.py:\d+: no valid Python"),
        (
            "SCALE = (1e-5,)",
            "SCALE = 1 / 0",
            rf"mine\.py:{line_of('SCALE', SENSOR)}: reading the file failed: ZeroDivisionError",
        ),
        ("SCALE = (1e-5,)", "", "defines no SCALE; expected ID, ACTS_ON, SCALE, apply"),
        ("SCALE = (1e-5,)", "SCALE = (1e-5, 1.0)", "expected 1 number above zero"),
        ("SCALE = (1e-5,)", "SCALE = (0.0,)", "expected 1 number above zero"),
        ('"my.nonlinearity"', '"nonlinearity"', "such as 'my.effect'"),
        ('"my.nonlinearity"', '"accel.scale"', "is an effect of the catalogue"),
        ('"accelerometer"', '"barometer"', "ACTS_ON is 'barometer', expected one of magnetometer"),
        ("SCALE =", 'PLANTS = ("flights",)\nSCALE =', "PLANTS is"),
        (" = 0.0", "", "k_per_m_s2 has no finite default"),
        ("(NamedTuple)", "", "0 NamedTuple types"),
        ("(1.0 + ", "(1.01 + ", "expected nothing at the defaults"),
        ("np.abs(readings)", "np.nan", "changes something"),
        ("readings * (1.0 +", "np.ravel(readings + 0 *", r"shape \(63,\), expected that of the readings"),
        ("np.abs(readings)", "np.log(-1.0 * (effect.k_per_m_s2 > 0) + 1.0)", "NaN or infinity"),
        (
            "np.abs(readings)",
            "np.absolut(readings)",
            rf"mine\.py:{line_of('np.abs', SENSOR)}: apply\(\) with .* AttributeError",
        ),
        ("    return readings *", "    readings *= 2.0\n    return readings *", "read-only"),
    ],
)
@pytest.mark.filterwarnings("ignore:divide by zero:RuntimeWarning")
def test_a_bad_file_is_refused_with_what_was_expected(tmp_path, old, new, expected):
    assert old in SENSOR
    path = written(tmp_path, SENSOR.replace(old, new, 1))
    with pytest.raises(InputError, match=expected) as refusal:
        load_user_effect(path)
    assert str(path) in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ("-k * u", "u.first", rf"mine\.py:{line_of('-k * u', MOTION)}: apply\(\) cannot be compiled .*first"),
        (", 0.0, 0.0, 0.0", ", 0.0, 0.0", "six of them returned"),
        ("-k * u", "1.0 - k * u", "expected nothing at the defaults"),
    ],
)
def test_a_motion_that_cannot_be_compiled_is_refused_at_its_line(tmp_path, old, new, expected):
    assert old in MOTION
    with pytest.raises(InputError, match=expected):
        load_user_effect(written(tmp_path, MOTION.replace(old, new, 1)))


def test_two_files_with_one_id_are_refused(tmp_path):
    paths = [written(tmp_path, SENSOR, name) for name in ("first.py", "second.py")]
    with pytest.raises(InputError, match=r"second\.py: ID 'my\.nonlinearity' is also that of .*first\.py"):
        load_user_effects(paths)
    assert [effect.id for effect in load_user_effects(paths[:1])] == ["my.nonlinearity"]


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_user_effect(tmp_path / "absent.py")
