"""What a challenge adds up to: detection against size, exponents of laws, masks, and what is written into the page."""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from discsim.errors import InputError
from discsim.validation.challenge.blind import Request
from discsim.validation.challenge.cases.conceal import Answer
from discsim.validation.challenge.masks import challenge_masks, masked_results
from discsim.validation.challenge.report.document import masks_text, plain_command, pooled, with_part
from discsim.validation.challenge.report.page import fault_of, goals_met
from discsim.validation.challenge.run import challenge
from discsim.validation.challenge.scores.detection import Sized, allowed, detections, fit_curve, has_curve
from discsim.validation.challenge.scores.result import Scored, both_times, processor_times, rates_of, read_result, times
from discsim.validation.challenge.scores.scoring import score_case
from discsim.validation.reporting.run import start_run
from discsim.validation.studies.catalogue import run_study

#: a "diagnosis" that finds nothing in anything
BLIND = """
import json, sys
from pathlib import Path
fit = {"chi2_per_sample": 1.0, "heldout_chi2_per_sample": 1.0}
out = Path(sys.argv[-1])
out.mkdir()
(out / "diagnosis.json").write_text(json.dumps({"verdict": "consistent", "effects": [], "located": [],
    "recalibrated": {}, "law": None, "fit": {"baseline": fit, "final": fit}}))
"""


def blind(folder: Path) -> list[str]:
    """Return the command of that diagnosis, written into a folder."""
    script = folder / "blind.py"
    script.write_text(BLIND)
    return [sys.executable, str(script)]


def drawn(half: float, width: float, cases: int, seed: int = 0) -> list[Sized]:
    rng = np.random.default_rng(seed)
    sizes = np.exp(rng.uniform(np.log(0.2), np.log(20.0), cases))
    named = rng.random(cases) < 1.0 / (1.0 + (sizes / half) ** (-1.0 / width))
    return [Sized("air.wind", float(size), bool(ok)) for size, ok in zip(sizes, named, strict=True)]


def test_the_half_detection_size_is_found_with_an_interval_that_holds_it():
    """Of twenty sets of 150 effects the interval of 95 % misses at most three (probability of more: 1.6 %)."""
    halves = np.tile([0.8, 1.5, 4.0, 1.5], 5)
    curves = [fit_curve(drawn(half, 0.3, 150, seed)) for seed, half in enumerate(halves)]
    held = [curve is not None and curve.low <= half <= curve.high for curve, half in zip(curves, halves, strict=True)]
    assert sum(held) >= 17
    found = [curve.half / half for curve, half in zip(curves, halves, strict=True) if curve is not None]
    assert np.median(found) == pytest.approx(1.0, rel=0.1)


def test_a_share_that_is_missed_however_large_does_not_move_the_half_detection_size():
    rng = np.random.default_rng(1)
    items = [item._replace(named=item.named and bool(rng.random() < 0.85)) for item in drawn(1.2, 0.2, 600)]
    curve = fit_curve(items)
    assert curve is not None
    assert curve.missed == pytest.approx(0.15, abs=0.06)  # three standard deviations of a share of 400 large ones
    assert curve.low <= 1.2 <= curve.high
    assert curve.at(curve.half) == pytest.approx(0.5)


def test_what_was_always_or_never_named_has_no_curve_and_few_cases_have_none_of_their_own():
    named = [Sized("air.wind", size, True) for size in (0.5, 1.0, 2.0)]
    assert fit_curve(named) is None
    assert fit_curve([item._replace(named=False) for item in named]) is None
    assert fit_curve([]) is None
    assert not has_curve([*named, Sized("air.wind", 0.3, False)])
    assert has_curve([*named * 2, *[Sized("air.wind", 0.3, False)] * 2])


def test_a_bound_that_the_cases_do_not_give_is_not_given():
    curve = fit_curve([Sized("air.wind", size, size != 5.0) for size in (3.0, 4.0, 5.0, 6.0, 9.0)])
    assert curve is not None
    assert curve.low == 0.0
    assert curve.text.startswith(("below", "unknown")) or "at most" in curve.text


def test_an_ideal_test_names_half_of_the_effects_at_the_limit():
    assert allowed(1.0) == pytest.approx(0.5)
    assert allowed(0.6) < 0.01
    assert allowed(1.5) > 0.99


def answer(**more: Any) -> Answer:
    return Answer(**{"seed": 5, "plant": "spin_down", "kind": "one", "verdict": "explained", **more})


def diagnosis(verdict: str, *ids: str, law: dict[str, Any] | None = None) -> dict[str, Any]:
    fit = {"chi2_per_sample": 1.0, "heldout_chi2_per_sample": 1.0}
    effects = [{"id": id, "recordings": "all", "parameters": {}, "confused_with": []} for id in ids]
    return {
        "verdict": verdict,
        "effects": effects,
        "located": [],
        "recalibrated": {},
        "law": law,
        "fit": {"baseline": fit, "final": fit},
    }


def scored(given: Answer, found: dict[str, Any] | None, seconds: float = 1.0, **sizes: float) -> Scored:
    return Scored(given, found, score_case(given, found), None, seconds, "0" * 64, sizes)


POWER = answer(
    kind="off_catalogue", verdict="unexplained", law="a torque", parameters={"coefficient": 1e-9, "exponent": 2.8}
)


def law(text: str, target: str = "moment_z_N_m", **coefficients: tuple[float, float]) -> dict[str, Any]:
    told = {name: {"value": value, "sd": sd} for name, (value, sd) in coefficients.items()}
    return {"text": text, "target": target, "coefficients": told, "heldout_delta_log_likelihood": 50.0}


def test_the_exponent_of_a_law_is_compared_with_the_concealed_one():
    found = law("c * |r|^n * sign(r)", n=(2.815, 0.01), c=(-1e-9, 1e-10))
    item = scored(POWER, diagnosis("unexplained", law=found))
    assert item.score.right
    assert item.score.exponent is not None
    assert item.score.exponent.in_sd == pytest.approx(1.5)
    rates = rates_of([item, scored(POWER, diagnosis("unexplained"))])
    assert (rates["law_given_rate"].hits, rates["law_given_rate"].of) == (1, 2)
    assert (rates["exponent_given_rate"].hits, rates["exponent_given_rate"].of) == (1, 2)
    assert (rates["exponent_within_2sd_rate"].hits, rates["exponent_within_2sd_rate"].of) == (1, 1)


def test_a_power_that_was_not_fitted_has_no_sd_and_a_product_is_read_by_its_symbol():
    fixed = score_case(POWER, diagnosis("unexplained", law=law("c * |r|^2.5 * sign(r)", c=(-1e-9, 1e-10)))).exponent
    assert fixed is not None
    assert (fixed.value, fixed.sd, fixed.in_sd) == (2.5, None, None)
    both = law("c * |V|^n_V * |r|^n_r * sign(r)", n_V=(0.1, 0.1), n_r=(2.7, 0.1))
    found = score_case(POWER, diagnosis("unexplained", law=both)).exponent
    assert found is not None
    assert found.value == 2.7


@pytest.mark.parametrize(
    "other",
    [
        law("c * |V|^n * sign(r)", n=(2.0, 0.1)),
        law("c * |r|^n * sign(r)", "force_x_N", n=(2.8, 0.1)),
        law("c1 * |r|^n1 * sign(r) + c2 * |r|^n2 * sign(r)", n1=(2.0, 0.1), n2=(3.0, 0.1)),
        law("c * |r|^1 * sign(r) * exp(-t/tau)", tau=(4.0, 1.0)),
        None,
    ],
)
def test_another_law_has_no_exponent_to_compare(other):
    assert score_case(POWER, diagnosis("unexplained", law=other)).exponent is None


def test_a_catalogued_effect_with_an_exponent_is_no_power_law_of_the_test():
    shear = answer(effects=("aero.yaw_reynolds",), plant="flight", parameters={"exponent": 0.5})
    found = diagnosis("unexplained", law=law("c * |r|^n", n=(2.0, 0.1)))
    assert score_case(shear, found).exponent is None


def test_each_way_to_be_wrong_has_its_name():
    two = answer(kind="two", effects=("mag.lag", "clock.rate"))
    nothing = answer(kind="nothing", verdict="consistent")
    told = [
        (two, diagnosis("explained", "mag.lag"), "one of two effects not named"),
        (two, diagnosis("explained", "mag.lag", "gyro.bias"), "another effect named"),
        (two, diagnosis("explained", "mag.lag", "clock.rate", "gyro.bias"), "effects named beside the right ones"),
        (two, diagnosis("consistent"), "not noticed"),
        (two, diagnosis("unexplained"), "noticed, called unexplained"),
        (two, diagnosis("explained", "mag.lag", "clock.rate"), "right effects in another place"),
        (two, None, "no answer"),
        (nothing, diagnosis("explained", "mag.lag"), "false alarm"),
        (nothing, diagnosis("recalibrated"), "consistent and recalibrated confused"),
        (nothing, diagnosis("consistent"), ""),
        (POWER, diagnosis("explained", "mag.lag"), "physics of no catalogue named as an effect"),
        (POWER, diagnosis("consistent"), "physics of no catalogue not noticed"),
    ]
    assert [fault_of(scored(given, found)) for given, found, _ in told] == [fault for _, _, fault in told]


def test_times_are_those_of_all_diagnoses_also_of_one_that_was_given_up():
    found = [scored(POWER, diagnosis("unexplained"), seconds=float(s)) for s in range(1, 12)]
    assert times(found) == (6.0, 10.0, 11.0)
    assert times([*found, scored(POWER, None, seconds=1800.0)]).longest_s == 1800.0
    assert np.isnan(times([]).median_s)


def test_processor_time_is_told_beside_the_clock_where_it_is_known():
    one = scored(POWER, diagnosis("unexplained"), seconds=20.0)
    assert both_times([one]) == "20 s (median), nine in ten within 20 s, longest 20 s by the clock"
    known = [replace(one, cpu_seconds=busy) for busy in (8.0, 10.0, 30.0)]
    assert processor_times([one, *known]).median_s == 10.0
    assert both_times(known).endswith("; of processor time 10 s (median), nine in ten within 26 s, longest 30 s")
    assert [Scored.from_json(item.to_json()).cpu_seconds for item in (one, *known)] == [None, 8.0, 10.0, 30.0]


def test_of_two_effects_each_counts_by_its_own_size():
    two = answer(kind="two", effects=("mag.lag", "clock.rate"))
    item = scored(two, diagnosis("explained", "mag.lag"), **{"mag.lag": 30.0, "clock.rate": 0.4})
    assert item.strength == 0.4
    assert detections([item]) == [Sized("mag.lag", 30.0, True), Sized("clock.rate", 0.4, False)]


def test_a_half_detection_size_above_the_goal_misses_it():
    good = rates_of([scored(answer(kind="nothing", verdict="consistent"), diagnosis("consistent"))])
    late, early = fit_curve(drawn(6.0, 0.2, 200)), fit_curve(drawn(1.0, 0.2, 200))
    assert not goals_met(good, late, few=True)
    assert goals_met(good, early, few=True)


PAGE = "top\n<!-- masks -->\nold\n<!-- /masks -->\nmiddle\n<!-- result -->\nold\n<!-- /result -->\nend\n"


REQUESTS = [
    Request(40, "flight", (), "nothing"),
    Request(41, "flight", ("air.wind",)),
    Request(42, "flight", ("lift_hysteresis",)),
]


@pytest.fixture(scope="module")
def plain(tmp_path_factory) -> Path:
    """The folder of a challenge that nobody answers."""
    folder = tmp_path_factory.mktemp("challenge")
    with start_run(folder / "plain", 40) as run:
        challenge(run, REQUESTS, workers=1, command=blind(folder))
    return folder / "plain"


@pytest.fixture(scope="module")
def masked(tmp_path_factory) -> Path:
    """The same under two masks of seven."""
    folder = tmp_path_factory.mktemp("masked")
    with pytest.MonkeyPatch.context() as patch, start_run(folder / "masks", 40) as run:
        patch.setattr("discsim.validation.challenge.masks.MASKS", {"short": "short", "few_recordings": "two only"})
        assert list(challenge_masks(run, REQUESTS, workers=1, command=blind(folder))) == ["short", "few_recordings"]
    return folder / "masks"


def documented(page: Path, plain: Path, *more: object) -> str:
    """Write a challenge into a page of documents, and return its text."""
    if not page.exists():
        page.parent.mkdir()
        page.write_text(PAGE)
    run_study("blind-test", [str(plain), *map(str, more), "--page", str(page)])
    return page.read_text()


def test_a_challenge_under_masks_leaves_a_report_and_a_command_for_each_case(masked):
    assert "few_recordings" in (masked / "report.html").read_text()
    written = json.loads((masked / "short" / "challenge.json").read_text())
    told = "--seed 41 --cases 1 --plant flight --effect air.wind --mask short"
    assert written["cases"][1]["reproduce"].endswith(told)


def test_a_result_is_written_between_its_marks_and_nowhere_else(tmp_path, plain, masked):
    """A page with tables, figures and a command for each failure; a mask without a result is left out."""
    shutil.copytree(masked, tmp_path / "masks")
    shutil.rmtree(tmp_path / "masks" / "short")
    assert list(masked_results([tmp_path / "masks"])) == ["few_recordings"]
    page = tmp_path / "docs" / "page.md"
    text = documented(page, plain, "--masks", tmp_path / "masks")
    assert text.startswith("top\n")
    assert text.endswith("\nend\n")
    assert "\nold\n" not in text
    assert "1 are answered rightly" in text
    assert "`discsim challenge --seed 41 --cases 1 --plant flight --effect air.wind`" in text
    assert "| none (the same seeds) | 3 |" in text
    assert "| `few_recordings` | 3 |" in text
    assert "`short`" not in text
    drawn_there = {path.name for path in (page.parent / "images").iterdir()}
    assert {f"images/{name}" in text for name in drawn_there} == {True}
    assert documented(page, plain, "--masks", tmp_path / "masks") == text


def test_more_cases_without_anything_in_them_count_for_the_false_alarms_and_only_such_cases(tmp_path, plain):
    with start_run(tmp_path / "blank", 50) as run:
        challenge(run, [Request(50, "flight", (), "nothing")], workers=1, command=blind(tmp_path))
    page = tmp_path / "docs" / "page.md"
    text = documented(page, plain, "--blank", tmp_path / "blank")
    (alarms,) = [line for line in text.splitlines() if line.startswith("| false alarms")]
    assert "| 0 of 2 |" in alarms
    with pytest.raises(InputError, match="conceals something"):
        documented(page, plain, "--blank", plain)


def test_challenges_of_one_code_on_other_seeds_are_pooled_also_from_what_was_kept(tmp_path, plain):
    with start_run(tmp_path / "more", 60) as run:
        challenge(run, [Request(60, "flight", (), "nothing")], workers=1, command=blind(tmp_path))
    page, kept = tmp_path / "docs" / "page.md", tmp_path / "kept"
    made = json.loads((tmp_path / "more" / "challenge.json").read_text())
    made["made_by"] = f"discsim challenge --seed 60 --out {tmp_path / 'more'}"
    (tmp_path / "more" / "challenge.json").write_text(json.dumps(made))
    text = documented(page, plain, "--more", tmp_path / "more", "--keep", kept)
    assert read_result(kept / "60.json.gz").command == "discsim challenge --seed 60 --out more"
    assert "(seeds 40 to 42)" in text
    assert "(seeds 60 to 60)" in text
    assert "Together 4 cases. 2 are answered rightly" in text
    assert sorted(file.name for file in kept.iterdir()) == ["40.json.gz", "60.json.gz"]
    assert documented(page, kept / "40.json.gz", "--more", kept / "60.json.gz") == text
    with pytest.raises(InputError, match="3 seeds are there already, the first 40"):
        documented(page, plain, "--more", kept / "40.json.gz")
    other = json.loads((tmp_path / "more" / "challenge.json").read_text()) | {"code_sha256": "0" * 64}
    (tmp_path / "more" / "challenge.json").write_text(json.dumps(other))
    with pytest.raises(InputError, match="code 000000000000, mask None; expected"):
        documented(page, plain, "--more", tmp_path / "more")
    (kept / "40.json.gz").write_bytes(b"no gzip")
    with pytest.raises(InputError, match="cannot be read"):
        read_result(kept / "40.json.gz")


def test_every_challenge_that_was_kept_is_a_row_of_the_page_on_runs(tmp_path, plain):
    page, kept = tmp_path / "docs" / "runs.md", tmp_path / "kept"
    documented(tmp_path / "docs" / "page.md", plain, "--keep", kept)
    page.write_text("top\n<!-- runs -->\n<!-- /runs -->\nend\n")
    run_study("blind-test", ["--runs", str(kept), "--page", str(page)])
    (row,) = [line for line in page.read_text().splitlines() if line.startswith("| 40 to 42 |")]
    assert "| 3 | 0.0 % (0 of 1) |" in row
    assert "| 100.0 % (1 of 1) |" not in row  # one kind of other physics was concealed, and nobody answered
    with pytest.raises(InputError, match="holds no challenge"):
        run_study("blind-test", ["--runs", str(tmp_path), "--page", str(page)])


def test_effects_near_their_limit_count_in_the_curve(tmp_path, plain, monkeypatch):
    """The same ones here, so there are twice as many."""
    near = tmp_path / "near" / "challenge.json"
    near.parent.mkdir()
    near.write_text(json.dumps({**json.loads((plain / "challenge.json").read_text()), "mask": "near_limit"}))
    monkeypatch.setattr("discsim.validation.challenge.masks.MASKS", {"near_limit": "near"})
    assert len(pooled(read_result(plain), read_result(near.parent))) == 2
    text = documented(tmp_path / "docs" / "page.md", plain, "--masks", near.parent)
    assert "whose sizes lie near the limit: `discsim" in text


def test_what_is_not_there_is_not_written(tmp_path):
    with pytest.raises(InputError, match="no marks <!-- other -->"):
        with_part(PAGE, "other", "text")
    with pytest.raises(InputError, match="no finished challenge with a mask"):
        masks_text([tmp_path], None)


def test_a_command_is_told_without_folder_and_cluster():
    told = "discsim challenge --cases 300 --seed 7 --scheduler tcp://a:1 --workers=2 --anew --out /somewhere/else"
    assert plain_command(told) == "discsim challenge --cases 300 --seed 7"
