"""Scores and the files they become."""

from __future__ import annotations

import json
from pathlib import Path
from xml.etree import ElementTree

import pytest

from discsim.validation.reporting.run import json_text
from discsim.validation.reporting.scores import Score, at_most, score, write_junit

GOOD = score("engine: attitude of a top", 1e-5, "deg", 0.0, 1e-4)
BAD = score("rate table: noise of a <gyroscope> & its range", 18.0, "deg/s", 14.0, 1.4)
UNKNOWN = at_most("throws: worst error", float("nan"), "deg/s", 20.0)


@pytest.mark.parametrize(
    ("value", "ok"), [(14.0, True), (15.4, True), (12.6, True), (15.41, False), (12.59, False), (-14.0, False)]
)
def test_a_score_is_ok_within_its_tolerance_to_either_side(value, ok):
    assert score("a", value, "deg/s", 14.0, 1.4 + 1e-12).ok is ok


@pytest.mark.parametrize(("value", "ok"), [(0.0, True), (0.1, True), (-0.1, True), (0.11, False), (-0.11, False)])
def test_an_error_may_reach_its_limit_with_either_sign(value, ok):
    assert at_most("a", value, "m", 0.1).ok is ok


@pytest.mark.parametrize("value", [float("nan"), float("inf"), float("-inf")])
def test_what_is_not_known_is_never_ok(value):
    assert not score("a", value, "m", 0.0, 1e9).ok
    assert not at_most("a", value, "m", 1e9).ok
    assert not score("a", 1.0, "m", float("nan"), 1.0).ok


def test_the_line_for_a_log_says_what_was_found_and_expected():
    assert GOOD.text == "ok   engine: attitude of a top: 1e-05 deg (expected <= 0.0001 deg)"
    assert BAD.text.startswith(
        "FAIL rate table: noise of a <gyroscope> & its range: 18 deg/s (expected 14 +- 1.4 deg/s)"
    )


def test_scores_json_has_the_fields_of_the_command_line_and_no_nan():
    entries = json.loads(json_text([item.as_dict() for item in (GOOD, BAD, UNKNOWN)]))
    assert list(entries[0]) == ["name", "value", "unit", "expected", "tolerance", "ok"]
    assert [entry["ok"] for entry in entries] == [True, False, False]
    assert entries[2]["value"] is None


class TestJUnit:
    @staticmethod
    def written(folder: Path, scores: list[Score]) -> ElementTree.Element:
        path = folder / "deep" / "scores.xml"
        write_junit(path, scores, 12.3456)
        assert path.read_bytes().startswith(b"<?xml")
        return ElementTree.parse(path).getroot()

    def test_every_score_is_a_case_and_failures_are_counted(self, tmp_path):
        root = self.written(tmp_path, [GOOD, BAD, UNKNOWN])
        (suite,) = root
        assert (root.tag, suite.tag) == ("testsuites", "testsuite")
        for element in (root, suite):
            assert (element.get("tests"), element.get("failures")) == ("3", "2")
        assert (suite.get("errors"), suite.get("skipped"), suite.get("time")) == ("0", "0", "12.346")
        cases = suite.findall("testcase")
        assert [case.get("name") for case in cases] == [
            "attitude of a top",
            "noise of a <gyroscope> & its range",
            "worst error",
        ]
        assert [case.get("classname") for case in cases] == ["discsim.engine", "discsim.rate table", "discsim.throws"]
        assert [case.find("failure") is not None for case in cases] == [False, True, True]

    def test_a_failure_says_what_was_found(self, tmp_path):
        (suite,) = self.written(tmp_path, [BAD])
        failure = suite[0].find("failure")
        assert failure.get("message") == failure.text == BAD.text
        assert suite[0].find("system-out").text == BAD.text

    def test_a_name_without_a_group_is_kept(self, tmp_path):
        (suite,) = self.written(tmp_path, [at_most("alone", 0.0, "m", 1.0)])
        assert suite[0].get("name") == "alone"

    def test_no_scores_are_an_empty_suite(self, tmp_path):
        assert self.written(tmp_path, [])[0].get("tests") == "0"
