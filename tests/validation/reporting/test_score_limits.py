"""Limits of one's own, recorded limits, and a run against an earlier one."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.files import model_file
from discsim.validation.reporting.ci import github_commands, markdown_summary
from discsim.validation.reporting.limits import (
    SHARE,
    Limit,
    limited,
    limits_text,
    margin,
    read_limits,
    shipped_limits,
    unguarded,
)
from discsim.validation.reporting.regression import compare_scores, read_scores, write_regression
from discsim.validation.reporting.run import json_text
from discsim.validation.reporting.scores import Score, at_most, score

NOISE = score("rate table: noise", 15.0, "deg/s", 14.0, 1.4)
ERROR = at_most("throws: worst error", 0.3, "deg/s", 0.5)


def written(folder: Path, text: str) -> Path:
    path = folder / "limits.toml"
    path.write_text(text, encoding="utf-8")
    return path


class TestLimits:
    def test_a_number_is_a_tolerance_and_a_table_may_say_what_is_expected(self, tmp_path):
        text = '[limits]\n"throws: worst error" = 0.2\n"rate table: noise" = { tolerance = 0.5, expected = 15.2 }\n'
        limits = read_limits(written(tmp_path, text))
        noise, error = limited([NOISE, ERROR], limits)
        assert (noise.expected, noise.tolerance, noise.ok) == (15.2, 0.5, True)
        assert (error.expected, error.tolerance, error.ok) == (0.0, 0.2, False)

    def test_a_score_without_a_limit_keeps_its_own(self):
        assert limited([NOISE, ERROR], {ERROR.name: Limit(1.0)})[0] == NOISE

    def test_a_limit_of_no_score_fails_by_its_name(self):
        misspelt = {ERROR.name: Limit(1.0), "throws: worst eror": Limit(1.0)}
        *same, lost = limited([NOISE, ERROR], misspelt)
        assert [item.name for item in same] == [NOISE.name, ERROR.name]
        assert (lost.name, lost.ok) == ("throws: worst eror", False)
        (line,) = unguarded([NOISE, ERROR], misspelt)
        assert line == f"a limit of 'throws: worst eror', which is no score of this run; did you mean '{ERROR.name}'?"

    @pytest.mark.parametrize(
        "text",
        [
            "", "limits = 3\n", '[limits]\na = "much"\n', "[limits]\na = true\n", "[limits]\na = -1.0\n",
            "[limits]\na = nan\n", "[limits]\na = { expected = 1.0 }\n", "[limits]\na = { tolerance = 1, low = 0 }\n",
            "[limits]\na = 1\n[more]\n", "[limits\n",
        ],
    )  # fmt: skip
    def test_what_is_no_file_of_limits_is_refused_by_name(self, tmp_path, text):
        with pytest.raises(InputError, match=r"limits\.toml"):
            read_limits(written(tmp_path, text))


class TestRecorded:
    def runs(self, count: int, rng: np.random.Generator) -> list[list[Score]]:
        return [
            [
                score("noise", 14.5 + 0.2 * rng.standard_normal(), "deg/s", 14.0, 5.0),
                at_most("exact", 1e-5, "m", 1e-4),
                at_most("unknown", float("nan"), "m", 2.0),
            ]
            for _ in range(count)
        ]

    def test_a_tolerance_is_the_distance_of_the_mean_and_a_margin_of_the_spread(self, tmp_path):
        runs = self.runs(20, np.random.default_rng(0))
        limits = read_limits(written(tmp_path, limits_text(runs, "discsim validate")))
        seen = np.array([run[0].value for run in runs])
        expected = seen.mean() - 14.0 + margin(20) * seen.std(ddof=1)
        assert limits["noise"].tolerance == pytest.approx(expected, rel=5e-3)
        assert limits["noise"].tolerance < 2.0

    def test_a_regression_of_three_standard_deviations_fails(self, tmp_path):
        """By the margin of the shipped limits, with made numbers; what was seen in the runs still passes."""
        runs = self.runs(20, np.random.default_rng(0))
        seen = np.array([run[0].value for run in runs])
        limits = read_limits(written(tmp_path, limits_text(runs, "discsim validate", 3.0)))

        def judged(value: float) -> bool:
            return limited([score("noise", value, "deg/s", 14.0, 5.0)], {"noise": limits["noise"]})[0].ok

        assert all(judged(value) for value in seen)
        assert judged(seen.mean() + 2.99 * seen.std(ddof=1))
        assert not judged(seen.mean() + 3.01 * seen.std(ddof=1))

    def test_what_does_not_scatter_or_is_not_known_keeps_its_own(self, tmp_path):
        limits = read_limits(written(tmp_path, limits_text(self.runs(3, np.random.default_rng(0)), "")))
        assert (limits["exact"].tolerance, limits["unknown"].tolerance) == (1e-4, 2.0)

    def test_what_was_computed_once_keeps_its_own_and_says_so(self):
        first, *others = self.runs(3, np.random.default_rng(0))
        text = limits_text([[*first, at_most("once", 0.25, "m", 1.0)], *others], "")
        assert '"once" = 1.0  # in one run 0.25, expected 0' in text

    def test_the_margin_holds_as_many_as_it_says(self):
        """Howe's factor: of samples of five, 95 % of the intervals hold the share; with 2000 draws 94 to 96 %."""
        from scipy.stats import norm

        drawn = np.random.default_rng(1).standard_normal((2000, 5))
        half = margin(5) * drawn.std(axis=1, ddof=1)
        held = norm.cdf(drawn.mean(axis=1) + half) - norm.cdf(drawn.mean(axis=1) - half)
        assert np.mean(held >= SHARE) == pytest.approx(0.95, abs=0.015)

    def test_few_seeds_make_wide_limits_and_one_makes_none(self):
        assert margin(3) > margin(5) > margin(20) > margin(1000) > 3.8
        with pytest.raises(ValueError, match="at least two"):
            margin(1)


@pytest.mark.parametrize("run", ["quick", "full"])
class TestShipped:
    """The limits of both runs, recorded from 20 seeds each: `discsim validate` is judged by them."""

    REMARK = re.compile(r'^(".+") = (\S+)  # seen .+, mean (\S+), sd (\S+), expected (\S+)$', re.MULTILINE)

    def test_the_file_says_by_which_command_and_when_it_was_recorded(self, run):
        text = model_file(f"limits/{run}.toml").read_text(encoding="utf-8")
        options = "--quick " if run == "quick" else ""
        made_by = f"discsim validate {options}--record-limits models/limits/{run}.toml --repeat 20 --margin 3"
        assert f"`{made_by}" in text
        assert re.search(r"20 seeds.+on \d{4}-\d\d-\d\d", text)

    def test_every_score_that_scatters_has_three_of_its_standard_deviations_and_its_bias(self, run):
        rows = self.REMARK.findall(model_file(f"limits/{run}.toml").read_text(encoding="utf-8"))
        assert len(rows) >= 10
        for name, tolerance, mean, sd, expected in rows:
            wanted = abs(float(mean) - float(expected)) + 3 * float(sd)
            # the remark has four digits of the mean and three of the deviation
            loose = 1e-3 * abs(float(mean)) + 0.02 * float(sd)
            assert float(tolerance) == pytest.approx(wanted, abs=loose), name

    def test_all_of_it_is_read(self, run):
        limits = shipped_limits(run == "quick")
        assert len(limits) == model_file(f"limits/{run}.toml").read_text(encoding="utf-8").count('\n"')
        assert all(limit.expected is None for limit in limits.values())


class TestAgainst:
    BEFORE = (NOISE, ERROR, at_most("gone", 0.0, "m", 1.0), at_most("mends", 2.0, "m", 1.0))
    AFTER = (
        score("rate table: noise", 15.01, "deg/s", 14.0, 1.4),
        at_most("throws: worst error", 0.45, "deg/s", 0.5),
        at_most("mends", 0.5, "m", 1.0),
        at_most("arrives", 2.0, "m", 1.0),
    )

    def test_a_change_is_counted_in_tolerances(self):
        found = {change.name: change for change in compare_scores(self.BEFORE, self.AFTER)}
        assert found["rate table: noise"].verdict == "same"
        assert found["throws: worst error"].in_tolerances == pytest.approx(0.3)
        verdicts = {name: change.verdict for name, change in found.items()}
        assert verdicts == {
            "rate table: noise": "same",
            "throws: worst error": "worse",
            "mends": "ok again",
            "arrives": "new, FAIL",
            "gone": "gone",
        }

    def test_a_share_without_a_tolerance_that_moves_is_worse(self):
        (change,) = compare_scores([at_most("a", 0.0, "1", 0.0)], [at_most("a", 0.1, "1", 0.0)])
        assert change.verdict == "FAIL now"
        assert change.in_tolerances == np.inf

    def test_an_earlier_run_is_read_from_its_folder_nan_and_all(self, tmp_path):
        scores = [*self.BEFORE, at_most("unknown", float("nan"), "m", 1.0)]
        (tmp_path / "scores.json").write_text(json_text([item.as_dict() for item in scores]))
        again = read_scores(tmp_path)
        assert again[:-1] == scores[:-1]
        assert np.isnan(again[-1].value)
        assert not again[-1].ok

    @pytest.mark.parametrize("text", ["", "{}x", '[{"name": "a"}]', '{"a": 1}'])
    def test_what_holds_no_scores_is_refused(self, tmp_path, text):
        (tmp_path / "scores.json").write_text(text)
        with pytest.raises(InputError, match=r"scores\.json"):
            read_scores(tmp_path)

    def test_the_page_names_what_got_worse_first(self, tmp_path):
        write_regression(tmp_path, compare_scores(self.BEFORE, self.AFTER), "last")
        page = (tmp_path / "against.html").read_text(encoding="utf-8")
        assert "1 new, FAIL, 1 gone, 1 worse, 1 ok again, 1 same" in page
        assert page.index(">arrives<") < page.index(">throws: worst error<") < page.index(">rate table: noise<")
        assert (tmp_path / "against.png").exists()


class TestInCi:
    def test_a_failure_is_an_error_and_what_got_worse_a_warning_with_special_characters_escaped(self):
        failed = at_most("C_Nr: error, 1 mm", 2.0, "%", 1.0)
        lines = github_commands([NOISE, failed], compare_scores([ERROR], [at_most(ERROR.name, 0.45, "deg/s", 0.5)]))
        assert lines == [
            "::error title=C_Nr%3A error%2C 1 mm::2 %25 (expected <= 1 %25)",
            "::warning title=throws%3A worst error::+0.30 tolerances: 0.45 deg/s (expected <= 0.5 deg/s)",
        ]

    def test_the_summary_says_what_fails_first(self):
        failed = at_most("a | b", 2.0, "%", 1.0)
        text = markdown_summary("discsim validate", [NOISE, failed])
        assert text.startswith("## discsim validate: 1 of 2 scores outside their tolerance\n")
        assert text.index("a \\| b") < text.index("rate table: noise")
        assert "all 1 scores within" in markdown_summary("discsim validate", [NOISE])

    def test_scores_json_of_the_command_is_what_against_reads(self, tmp_path):
        content = json_text([NOISE.as_dict()])
        (tmp_path / "scores.json").write_text(content)
        assert [item.as_dict() for item in read_scores(tmp_path / "scores.json")] == json.loads(content)
