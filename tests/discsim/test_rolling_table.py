"""(16) in full: C_Rr over angle of attack and advance ratio, and C_Rp over angle of attack, as tables of a disc."""

from __future__ import annotations

import dataclasses
import re

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import RegularGridInterpolator
from support.flights import DRIVER, FIELD, mirrored, throw
from support.recording_folder import TOML, line_of, make, refusal

from discsim.aerodynamics import rolling_coefficient
from discsim.disc import Disc, RollingTable
from discsim.engine import fly
from discsim.model_file import Model, read_model, write_model
from discsim.parameters import PARAMETERS, parameters, tables
from discsim.recording import read_recording
from discsim.trajectory import predict

ALPHA = np.radians([-8.0, -2.0, 1.0, 6.0, 15.0, 40.0])
RATIO = np.array([0.15, 0.3, 0.5, 0.8, 1.5])
#: of the size and shape that wind tunnels find: against the spin when level, with it nose up, growing with gamma
CR = 0.02 * np.outer(np.sin(3.0 * (ALPHA - 0.1)), RATIO**2)
CRP = -0.15 + 0.3 * ALPHA**2
FULL = RollingTable(ALPHA, RATIO, CR, CRP)
TABLE_TOML = """[disc.CR_table]
alpha_rad = [-0.1, 0.0, 0.2]
advance_ratio = [0.2, 0.5]
CR = [[-0.002, -0.006], [0.0, -0.002], [0.001, 0.003]]
CRp = [-0.1, -0.12, -0.14]
"""


def with_table(table: RollingTable, disc: Disc = DRIVER) -> Disc:
    return dataclasses.replace(disc, rolling_table=table)


def coefficient(disc: Disc, alpha: float, gamma: float, roll: float) -> float:
    return float(rolling_coefficient(parameters(FIELD, disc).view(PARAMETERS)[0], tables(disc), alpha, gamma, roll))


class TestCoefficient:
    disc = with_table(FULL)
    grid = RegularGridInterpolator((ALPHA, np.append(0.0, RATIO)), np.column_stack([np.zeros(6), CR]))

    @given(alpha=st.floats(-1.5, 1.5), gamma=st.floats(-3.0, 3.0), roll=st.floats(-0.5, 0.5))
    def test_it_is_linear_between_the_nodes_constant_outside_and_odd_in_gamma(self, alpha, gamma, roll):
        inside = (np.clip(alpha, ALPHA[0], ALPHA[-1]), np.clip(abs(gamma), 0.0, RATIO[-1]))
        expected = np.sign(gamma) * float(np.squeeze(self.grid(inside))) + np.interp(alpha, ALPHA, CRP) * roll
        assert coefficient(self.disc, alpha, gamma, roll) == pytest.approx(expected, rel=1e-12, abs=1e-15)

    @given(alpha=st.floats(-0.1, 0.6), gamma=st.floats(-1.5, 1.5), roll=st.floats(-0.5, 0.5))
    def test_derivatives_tabulated_are_the_derivatives(self, alpha, gamma, roll):
        a = DRIVER.aero
        linear = RollingTable(ALPHA, RATIO, np.tile(a.CRr * RATIO, (6, 1)), np.full(6, a.CRp))
        bare = dataclasses.replace(DRIVER, aero=a._replace(CRr=0.0, CRp=0.0))
        expected = a.CRr * gamma + a.CRp * roll
        assert coefficient(with_table(linear, bare), alpha, gamma, roll) == pytest.approx(
            expected, rel=1e-12, abs=1e-16
        )

    def test_what_is_not_tabulated_stays_a_derivative(self):
        a = DRIVER.aero
        damped = with_table(RollingTable(ALPHA, CRp=CRP))
        assert coefficient(damped, 0.1, 0.4, 0.0) == pytest.approx(a.CRr * 0.4, rel=1e-14)
        spun = with_table(RollingTable(ALPHA, RATIO, CR))
        assert coefficient(spun, 0.1, 0.0, 0.2) == pytest.approx(a.CRp * 0.2, rel=1e-14)


class TestFlights:
    def test_both_engines_fly_it_alike_to_a_hundredth_of_a_millimetre(self):
        """RK4 at 1 ms is 3 um from the standalone model without a table; kinks at the nodes cost it some more."""
        release = throw(wobble=(2.0, -1.0))
        truth, model = fly(with_table(FULL), FIELD, release), predict(with_table(FULL), FIELD, release).motion()
        assert np.linalg.norm(truth.position[-1] - model.position[-1]) < 1e-5
        assert np.linalg.norm(truth.position[-1] - fly(DRIVER, FIELD, release).position[-1]) > 1.0

    def test_a_mirror_throw_with_reversed_spin_flies_the_mirror_flight(self):
        release = throw(wobble=(2.0, -1.0))
        flight = predict(with_table(FULL), FIELD, release).motion()
        other = predict(with_table(FULL), FIELD, mirrored(release)).motion()
        np.testing.assert_allclose(other.position[-1], flight.position[-1] * [1.0, -1.0, 1.0], atol=1e-6)

    def test_steps_of_the_standalone_model_end_on_the_angles_of_the_table(self):
        flight = predict(with_table(FULL), FIELD, throw(wobble=(2.0, -1.0)))

        def incidence(t: np.ndarray) -> np.ndarray:
            at = flight.at(t)
            u, v, w = at.in_body(at.velocity).T
            return np.asarray(np.arctan2(w, np.hypot(u, v)))

        fine, ends = incidence(np.arange(0.0, flight.end, 1e-4)), incidence(flight.t)
        passed = sum(int(np.sum(np.diff(np.sign(fine - node)) != 0)) for node in ALPHA)
        met = np.abs(ends[:, None] - ALPHA).min(axis=1) < 2e-7
        assert passed >= 3
        assert met.sum() >= passed


class TestFiles:
    def test_a_recording_states_it_and_may_leave_the_derivatives_out(self, tmp_path):
        bare = re.sub(r"^(CRr|CRp) = .*\n", "", TOML, flags=re.M)
        disc = read_recording(make(tmp_path / "flight", bare + TABLE_TOML)).disc
        assert disc is not None
        table = disc.rolling_table
        assert table is not None
        np.testing.assert_array_equal(table.CR, [[-0.002, -0.006], [0.0, -0.002], [0.001, 0.003]])
        np.testing.assert_array_equal(table.CRp, [-0.1, -0.12, -0.14])

    def test_a_derivative_that_is_not_tabulated_is_still_required(self, tmp_path):
        text = TOML.replace("CRp = -0.12\n", "") + TABLE_TOML.replace("CRp = [-0.1, -0.12, -0.14]\n", "")
        assert "missing key 'CRp' in [disc.aero]" in refusal(make(tmp_path / "flight", text))

    @pytest.mark.parametrize("table", [FULL, RollingTable(ALPHA, CRp=CRP), RollingTable(ALPHA, RATIO, CR)])
    def test_a_model_that_is_written_is_read_back_the_same(self, tmp_path, table):
        write_model(Model(FIELD, with_table(table)), tmp_path / "model.toml")
        again = read_model(tmp_path / "model.toml").disc.rolling_table
        assert again is not None
        for name, value in vars(table).items():
            np.testing.assert_array_equal(getattr(again, name), value)

    @pytest.mark.parametrize(
        ("change", "says"),
        [
            (("[0.2, 0.5]", "[0.0, 0.5]"), "advance_ratio to ascend from above zero .at zero C_R is zero by symmetry"),
            (("[0.2, 0.5]", "[0.5, 0.2]"), "advance_ratio to ascend"),
            (("[-0.1, 0.0, 0.2]", "[-0.1, 0.2, 0.0]"), "alpha_rad to ascend"),
            (("[0.2, 0.5]", "[0.2, 0.5, 0.7]"), "CR is 3 x 2, expected angles x advance ratios = 3 x 3"),
            (("CRp = [-0.1, ", "CRp = ["), "2 values of CRp, expected one per alpha_rad .3"),
            (("advance_ratio = [0.2, 0.5]\n", ""), "advance_ratio and CR, both or neither"),
        ],
    )
    def test_a_damaged_table_is_refused_by_its_line(self, tmp_path, change, says):
        text = TOML + TABLE_TOML.replace(*change)
        message = refusal(make(tmp_path / "flight", text))
        assert message.startswith(f"recording.toml:{line_of(text, '[disc.CR_table]')}: ")
        assert re.search(says, message)

    def test_an_empty_table_is_refused(self, tmp_path):
        text = TOML + "[disc.CR_table]\nalpha_rad = [0.0, 0.1]\n"
        assert "neither CR nor CRp" in refusal(make(tmp_path / "flight", text))
