"""The column of a rate table's own rate, in the log of the sensors that turn on it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from discsim.arrays import FloatArray
from discsim.validation.importing import import_recording, read_map
from discsim.validation.importing.sniffing import map_text, sniff
from discsim.validation.importing.sniffing.proposal import Proposal

T = np.arange(0.0, 24.0, 0.01)
COMMAND = np.interp(
    T, [0.0, 3.0, 5.0, 10.0, 12.0, 17.0, 19.0, 24.0], [0.0, 0.0, 360.0, 360.0, 1000.0, 1000.0, -500.0, -500.0]
)


def turned() -> FloatArray:
    """Return the rates (n,) deg/s of a table that trails its command by 0.2 s, and wobbles by a thousandth."""
    return np.interp(T - 0.2, T, COMMAND) * (1.0 + 1e-3 * np.sin(9.0 * T))


def written(folder: Path, columns: dict[str, FloatArray], *, gyroscope: bool = True) -> Path:
    """Write the log of a table with a magnetometer and a gyroscope on it, and columns of what the table did."""
    rng, rate = np.random.default_rng(5), turned()
    psi = np.radians(np.concatenate([[0.0], np.cumsum(0.5 * (rate[1:] + rate[:-1]) * 0.01)]))
    log = {"time_ms": 1e3 * T}
    if gyroscope:
        log |= {f"g{axis}_dps": rng.normal(0.0, 0.3, T.size) + rate * (axis == "z") for axis in "xyz"}
    field = {"x": 22.0 * np.cos(psi), "y": -22.0 * np.sin(psi), "z": np.full(T.size, 40.0)}
    log |= {f"m{axis}_uT": value + rng.normal(0.0, 0.3, T.size) for axis, value in field.items()}
    log |= columns
    path = folder / "table.csv"
    np.savetxt(path, np.column_stack([*log.values()]), delimiter=",", fmt="%.3f", header=",".join(log), comments="")
    return path


def reference(path: Path, proposal: Proposal) -> FloatArray:
    """Return the rate reference (n,) rad/s of the recording that a proposed map makes."""
    file = path.parent / "map.toml"
    file.write_text(map_text(proposal), encoding="utf-8")
    imported = import_recording(path, read_map(file))
    return imported.recording.samples["rate_reference"].value


@pytest.mark.parametrize(
    ("name", "worth"), [("encoder_dps", 1.0), ("table_rpm", 1.0 / 6.0), ("turntable (deg/s)", -1.0)]
)
def test_the_rate_that_the_gyroscope_turns_by_is_the_reference(tmp_path, name, worth):
    path = written(tmp_path, {name: turned() * worth})
    found = sniff(path, "rate_table")
    assert found.reference is not None
    assert found.reference.decision.sure == "likely"
    np.testing.assert_allclose(reference(path, found), np.radians(turned()), atol=0.06)


def test_what_an_encoder_read_goes_before_what_the_table_was_told(tmp_path):
    found = sniff(written(tmp_path, {"setpoint_dps": COMMAND, "encoder_dps": turned()}), "rate_table")
    assert found.reference is not None
    assert found.reference.column == "encoder_dps"
    assert any("not used" in note and "setpoint_dps" in note for note in found.notes)


def test_what_the_table_was_told_is_taken_with_that_said_where_nothing_else_tells_its_rate(tmp_path):
    found = sniff(written(tmp_path, {"command_dps": COMMAND}), "rate_table")
    assert found.reference is not None
    assert "what a table was told it has not quite done" in found.reference.decision.text


def test_without_a_gyroscope_its_sign_is_a_guess(tmp_path):
    found = sniff(written(tmp_path, {"encoder_dps": turned()}, gyroscope=False), "rate_table")
    assert found.reference is not None
    assert (found.reference.sign, found.reference.decision.sure) == (1.0, "guess")


@pytest.mark.parametrize(
    "columns", [{"fan_rpm": 900.0 + 30.0 * np.sin(T)}, {"left_dps": turned(), "right_dps": turned()}]
)
def test_another_rate_or_two_that_fit_are_none(tmp_path, columns):
    found = sniff(written(tmp_path, columns), "rate_table")
    assert found.reference is None
    assert any("not used" in note and next(iter(columns)) in note for note in found.notes)


def test_of_a_spin_that_is_free_it_is_no_part_and_the_option_is_said(tmp_path):
    found = sniff(written(tmp_path, {"encoder_dps": turned()}), "free_spin")
    assert found.reference is None
    assert any("--plant rate_table takes it" in note for note in found.notes)
