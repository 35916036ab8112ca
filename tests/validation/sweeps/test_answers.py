"""What a sweep tells beside its arrays: rows for each case, tolerances, shares of variance, C_Nr and the landing."""

from __future__ import annotations

import csv

import numpy as np
import pytest
import xarray as xr

from discsim.errors import InputError
from discsim.shipped import load_disc, load_throw
from discsim.validation.sweeps.cases import READ, carried_on, landing_of, rows_of, write_rows
from discsim.validation.sweeps.chunks import Sweep
from discsim.validation.sweeps.mounts import MountDesign, closed_form
from discsim.validation.sweeps.plan import plan_file, read_plan
from discsim.validation.sweeps.shares import MODULE, shares_of
from discsim.validation.sweeps.swept import sweep
from discsim.validation.sweeps.tolerance import SHARE, sentences_of, tolerances_of

LOWER, UPPER = np.array([-0.004] * 3 + [-0.05] * 3), np.array([0.004] * 3 + [0.05] * 3)
RATES, RADII = np.array([1000.0, 4000.0]), np.array([0.02, 0.08])


class Asked:
    """A plan as the tables see it: its mounts, scored by one estimator on all of them."""

    def __init__(self, design: MountDesign) -> None:
        self.mounts = design

    def scored(self, name: str) -> np.ndarray:
        return np.arange(self.mounts.count)


def made(design: MountDesign, scatter: float = 0.0, read: float = 1.0) -> tuple[xr.Dataset, Sweep]:
    """A sweep of sensors that err by (9), each with an error of its own of relative size ``scatter``."""
    mounts = design.mounts(0)
    own = np.random.default_rng(1).standard_normal(design.count)
    share = scatter * own[[design.module_of(k) for k in range(design.count)]]
    bias = np.empty((1, RADII.size, design.count, RATES.size))
    for k, radius in enumerate(RADII):
        nine = closed_form(RATES, np.array([-radius, 0.0, 0.0]), mounts[:, :3])
        bias[0, k] = nine + share[:, None] * RATES
    dims = ("estimator", "radius_m", "mount", "segment")
    known = np.full(bias.shape, read)
    scores = xr.Dataset(
        {"bias_deg_s": (dims, bias), "rms_deg_s": (dims, np.abs(bias)), "known": (dims, known)},
        {
            "estimator": ["accelerometer"],
            "radius_m": RADII,
            "rate_deg_s": (("radius_m", "segment"), np.tile(RATES, (2, 1))),
        },
    )
    return scores, Sweep(Asked(design), mounts, ())  # type: ignore[arg-type]


class TestTolerance:
    def test_it_is_that_of_the_closed_form(self):
        """(9): 95 % of offsets within +-e along x err by less than sqrt(1 + 0.95 e/d) - 1."""
        scores, whole = made(MountDesign("sobol", 512, LOWER, UPPER))
        found = {(one.place["radius_m"], one.rate_deg_s): one for one in tolerances_of(scores, whole, 0.01)}
        for radius in RADII:
            for rate in RATES:
                expected = radius * ((1.01**2 - 1) / 0.95)
                assert found[radius, rate].place_m == pytest.approx(expected, rel=0.02)
                assert found[radius, rate].perfect < 1e-6
                assert found[radius, rate].at_least == (False, False, True)

    def test_it_shrinks_by_what_the_part_itself_errs(self):
        design = MountDesign("sobol", 512, LOWER, UPPER)
        ideal, drawn = (tolerances_of(*made(design, scatter), 0.01)[0] for scatter in (0.0, 0.003))
        assert drawn.place_m < ideal.place_m
        # of the errors that went in; the parabola's 28 terms take some of 512
        own = np.quantile(np.abs(np.random.default_rng(1).standard_normal(512)), SHARE)
        assert drawn.perfect == pytest.approx(own * 0.003, rel=0.06)
        # nothing is left where the part alone errs by more
        assert tolerances_of(*made(design, 0.02), 0.01)[0].place_m == 0.0

    def test_all_that_was_swept_is_said_as_at_least(self):
        scores, whole = made(MountDesign("sobol", 256, LOWER, UPPER))
        far = [one for one in tolerances_of(scores, whole, 0.2) if one.place["radius_m"] == 0.08]
        assert far[0].at_least[0]
        assert far[0].place_m == 0.004

    def test_what_cannot_be_read_has_none(self):
        assert tolerances_of(*made(MountDesign("sobol", 256, LOWER, UPPER), read=READ / 2), 0.01) == []

    def test_the_answer_names_the_best_case_from_a_rate_on(self):
        scores, whole = made(MountDesign("sobol", 256, LOWER, UPPER))
        lines = sentences_of(tolerances_of(scores, whole, 0.01), 0.01)
        assert lines[0].startswith("To stay below 1 %")
        assert lines[1].startswith("accelerometer, from 1000 deg/s on: 1.7 mm along each axis with 80 mm")
        assert 100 * SHARE == 95


class TestShares:
    DESIGN = MountDesign("saltelli", 1, LOWER, UPPER, base=128)

    def test_blocks_mix_two_sets_of_mounts_one_field_at_a_time(self):
        blocks = self.DESIGN.mounts(3).reshape(9, 128, 6)
        for k in range(6):
            same = [j for j in range(6) if j != k]
            np.testing.assert_array_equal(blocks[2 + k][:, same], blocks[0][:, same])
            np.testing.assert_array_equal(blocks[2 + k][:, k], blocks[1][:, k])
        np.testing.assert_array_equal(blocks[8], blocks[0])
        modules = np.array([self.DESIGN.module_of(k) for k in range(self.DESIGN.count)]).reshape(9, 128)
        for block in (0, *range(2, 8)):
            np.testing.assert_array_equal(modules[block], np.arange(128))
        for block in (1, 8):
            np.testing.assert_array_equal(modules[block], 128 + np.arange(128))

    def test_they_are_the_shares_that_went_in(self):
        """Offset along x and the modules' own error are independent: their variances add up."""
        scatter = 0.05
        shares = [one for one in shares_of(*made(self.DESIGN, scatter)) if one.place["radius_m"] == 0.02]
        total = {one.source: one.total for one in shares if one.rate_deg_s == 4000.0}
        by_mount = (0.5 * 0.004 / 0.02) ** 2 / 3  # (9) to first order
        assert total["x"] == pytest.approx(by_mount / (by_mount + scatter**2), abs=0.1)
        assert total[MODULE] == pytest.approx(scatter**2 / (by_mount + scatter**2), abs=0.1)
        assert max(abs(total[name]) for name in ("y", "z", "about_x", "about_y", "about_z")) < 1e-6

    def test_another_design_has_none(self):
        assert shares_of(*made(MountDesign("sobol", 64, LOWER, UPPER))) == []

    @pytest.mark.parametrize("base", [0, 1, 48])
    def test_blocks_are_powers_of_two(self, base):
        with pytest.raises(InputError, match="expected a power of two"):
            MountDesign("saltelli", 1, LOWER, UPPER, base=base)


class TestCarriedOn:
    def test_an_error_in_proportion_leaves_c_nr_as_it_is_and_moves_the_landing(self):
        landing = landing_of()
        found = carried_on(np.array([[0.03, 0.03], [-0.05, -0.05]]), RATES, landing)
        np.testing.assert_allclose(found.CNr, 0.0, atol=1e-12)
        np.testing.assert_allclose(found.landing, np.array([0.03, 0.05]) * np.hypot(*landing.by_spin))

    def test_c_nr_by_26_of_a_rate_that_is_read_wrong_is_as_far_off(self):
        """A spin that decays exponentially, read by a sensor whose error fades as a power of the rate."""
        power, t = 0.1, np.linspace(0.0, 3.0, 301)
        rate = 4000.0 * np.exp(-t / 18.0)
        read = rate * (rate / 4000.0) ** power
        slope, wrong = (np.polyfit(t, np.log(r), 1)[0] for r in (rate, read))
        error = (RATES / 4000.0) ** power - 1.0
        found = carried_on(error[None], RATES, landing_of())
        assert found.CNr[0] == pytest.approx(wrong / slope - 1.0, rel=1e-6)

    def test_a_mount_that_is_read_at_one_rate_tells_nothing(self):
        assert np.isnan(carried_on(np.array([[np.nan, 0.01]]), RATES, landing_of()).CNr[0])

    def test_the_landing_s_derivatives_are_those_of_flights(self):
        from dataclasses import replace

        from discsim.trajectory import predict

        disc, environment = load_disc("driver")
        release = load_throw("driver")
        faster = replace(release, body_rate=1.01 * np.array(release.body_rate) * [0, 0, 1])
        moved = predict(disc, environment, faster).state[-1, :2] - predict(disc, environment, release).state[-1, :2]
        np.testing.assert_allclose(moved, 0.01 * landing_of().by_spin, atol=0.02)


def test_the_table_has_a_row_for_each_case_rate_and_all_of_them(tmp_path):
    scores, _ = made(MountDesign("sobol", 64, LOWER, UPPER))
    write_rows(tmp_path, rows_of(scores, landing_of()))
    rows = list(csv.DictReader((tmp_path / "cases.csv").read_text().splitlines()))
    assert [(row["radius_m"], row["rate_deg_s"]) for row in rows] == [
        (radius, rate) for radius in ("0.02", "0.08") for rate in ("1000", "4000", "all")
    ]
    # (9), offsets even within +-4 mm: rms e/2d
    assert float(rows[3]["rms_percent"]) == pytest.approx(100 * 0.5 * 0.004 / 0.08 / np.sqrt(3), rel=0.05)
    assert rows[0]["landing_rms_m"] == ""
    assert float(rows[2]["landing_rms_m"]) > 0.0
    assert len((tmp_path / "cases.md").read_text().splitlines()) == 2 + len(rows)


def test_a_saltelli_plan_of_two_is_swept_and_told(tmp_path):
    text = plan_file("shares").read_text().replace("radius_m = [0.0161, 0.04, 0.09]", "radius_m = 0.0161")
    text = text.replace('parts = ["mpu9250", "mpu9250+adxl375"]', 'parts = "mpu9250"').replace("5000]", "]")
    (tmp_path / "plan.toml").write_text(text)
    plan = read_plan(tmp_path / "plan.toml", count=16)
    assert plan.mounts.count == 16 * 9
    found = sweep(plan, workers=1)
    found.report(tmp_path / "out")
    names = {path.name for path in (tmp_path / "out").iterdir()}
    assert {"sweep.nc", "sweep.png", "cases.csv", "cases.md", "shares.csv", "shares.png", "report.html"} <= names
    assert "Which error of the mount it is" in (tmp_path / "out" / "report.html").read_text()
    # with the same module A and its neighbour along z differ by nothing but z
    rows = list(csv.DictReader((tmp_path / "out" / "shares.csv").read_text().splitlines()))
    fastest = {row["source"]: float(row["total_order"]) for row in rows if row["rate_deg_s"] == "2500"}
    assert fastest["x"] > 0.7
    assert abs(fastest["z"]) < 0.1


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("count = 64", "count = 48", "expected a power of two"),
        ('design = "saltelli"', 'design = "saltell"', "expected one of grid, random, sobol, saltelli"),
    ],
)
def test_a_plan_that_cannot_be_is_refused_by_key(tmp_path, old, new, says):
    (tmp_path / "plan.toml").write_text(plan_file("shares").read_text().replace(old, new))
    with pytest.raises(InputError, match=says):
        read_plan(tmp_path / "plan.toml")
