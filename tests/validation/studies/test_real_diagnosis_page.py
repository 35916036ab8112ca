"""The page on diagnosed recordings says in prose what its numbers say, whatever they are."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np

import discsim.validation.studies.real_diagnosis as study
from discsim.validation.reporting.markdown import page_text

PAGE = Path(study.__file__).with_name("page.md.j2")
NAMES = ("throw1", "throw6", "throw15")


def answered(verdict: str, effects: list[dict], law: dict | None, final: float) -> Made:
    """Return a diagnosis as the study reads it."""
    chi2 = {"baseline": 456.7, "final": final}
    answer = {"effects": effects, "law": law, "heldout": [], "located": [{"text": "a place"}]}
    return Made(answer=answer, verdict=verdict, chi2=chi2.__getitem__)


def rows(late: float) -> Made:
    return Made(usual=0.0095, late=late, by_field=1.06, by_wobble=1.1, spin={"gyroscope": 0.05})


def cause(name: str, left: float) -> Made:
    """Return a cause that leaves a share of each throw's rms."""
    fit = Made(cause=Made(name=name, told=lambda x: "its size"), x=0.1, rms=dict.fromkeys(NAMES, 0.3 * left))
    tried = dict.fromkeys(NAMES, Made(rms=dict.fromkeys(NAMES, 0.3 * left), touch_down=dict.fromkeys(NAMES, 2.0)))
    shares = dict.fromkeys(NAMES, left)
    return Made(together=fit, tried=tried, left=shares, worsens=left > 1.0, helps=left < 0.5)


def golf(found: Made, left: float, partly: list[dict], named: str = "") -> dict[str, object]:
    """Return what fills the part on the golf throws; the best cause leaves a share of each throw's rms."""
    return {
        "answer": found,
        "partly": partly,
        "cuts": [("throw1", 0.0, 0.2), ("throw6", 0.1, 0.3)],
        "named": named,
        "noise": 0.025,
        "stated": dict.fromkeys(NAMES, Made(distance=10.0)),
        "APART": 0.5,
        "LEFT": 1.0,
        "GROUND": 0.2,
        "LITTLE": 0.5,
        "names": NAMES,
        "without": cause("none", 1.0),
        "causes": [["drag"] * 7],
        "pairs": [["drag and lift"] * 7],
        "asked": 400,
        "free": [cause("drag", left), cause("lift", 0.8), cause("wind", 1.4)],
        "better_pairs": [],
        "decided": [Made(throw="high", track=3.0, touch_down=0.4)],
        "off": lambda flights: ", ".join(f"{flights[name].distance:.1f}" for name in NAMES),
    }


def page(found: Made, left: float = 0.3, partly: list[dict] | None = None, named: str = "", iron: float = 1.0) -> str:
    """Return the page, in one line; ``iron`` uT are left of 10 by what the cameras allow of a magnet."""
    seen = Made(late=0.01, at_once=0.2, left=0.1, apart=10.0)
    sensors = {
        "logs": [["log"] * 8],
        "repairs": "log 3",
        "cameras": [["trial"] * 9],
        "DISTURBED": 0.1,
        "names": ["trial 07", "trial 32"],
        "clean": {"magnetometer": seen, "gyroscope": seen},
        "disturbed": {"magnetometer": Made(**{**vars(seen), "left": iron}), "gyroscope": seen},
        "disturbed_share": 0.05,
        "disturbed_span": (1.0, 9.0),
        "iron": [1.0, 20.0],
        "gains": np.array([0.99, 1.01]),
    }
    flatball = {
        "answer": found,
        "rows": {"003-rf": rows(0.02), "004": rows(0.3)},
        "cells": [["004"] * 10],
        "effects": [["`air.wind`", "all", "1", "20"]] if found.answer["effects"] else [],
        "heldout": [],
        "coefficients": "a = 1",
        "agreement": Made(contradiction=True, sentences=("The gyroscope agrees.",)),
        "tables": [("Captioned", ("a", "b"), [("1", "2")])],
        "literature": 1.8,
        "as_filed": [1.9, 2.0],
        "as_turned": [1.8, 1.8],
        "decays": [0.04, 0.05],
    }
    text = page_text(
        PAGE,
        seed=3,
        version="1",
        digest="abc",
        flatball=flatball,
        golf=golf(found, left, partly or [], named),
        sensors=sensors,
    )
    assert [line for line in text.splitlines() if "## " in line and not line.startswith("#")] == []
    assert max(len(line) for line in text.splitlines() if not line.startswith("|")) <= 118
    return " ".join(text.split())


def test_what_is_named_stands_in_a_table_and_what_is_not_is_said():
    named = page(answered("explained", [{"id": "air.wind"}], None, 1.0), named="`air.wind`")
    assert "| `air.wind` | all | 1 | 20 |" in named
    assert "says **explained**: `air.wind`. χ²" in named
    assert "No effect is named" not in named
    unnamed = page(answered("unexplained", [], None, 900.0))
    assert "No effect is named, and no law that would hold on throws set aside." in unnamed
    assert "says **unexplained**, and names nothing as the whole explanation. χ²" in unnamed
    assert "Nor does it name what explains the mismatch in part" in unnamed


def test_a_law_is_written_out():
    law = {"text": "a*r", "target": "force_x_N", "heldout_delta_log_likelihood": 4.5}
    text = page(answered("unexplained", [], law, 1.0))
    assert "No effect is named. Its law for what remains: `a*r` on `force_x_N` (a = 1), with a gain" in text


def test_what_explains_in_part_is_said_with_its_share_on_each_throw():
    sizes = {"height_m": {"value": 90.0, "sd": 8.0}, "east_m": {"value": -4.0, "sd": None}}
    held = [{"recording": name, "share_of_excess": 0.8} for name in NAMES]
    text = page(answered("unexplained", [], None, 1.0), partly=[{"id": "a.b", "parameters": sizes, "heldout": held}])
    assert "`a.b` explains the mismatch in part (height_m = 90 ± 8, east_m = -4): with the numbers" in text
    assert "80 % of χ² away in throw1, 80 % of χ² away in throw6" in text


def test_causes_are_sorted_into_those_that_help_that_hardly_do_and_that_are_refuted():
    text = page(answered("consistent", [], None, 1.0))
    assert "**drag** gains most on throws that took no part, of those that worsen none." in text
    assert "it leaves 30 %, 30 %, 30 % of the rms that is left without a cause (throw1, throw6, throw15)." in text
    assert "Refuted, as what two throws say of it makes the third worse: wind." in text
    assert "more than 50 % of the rms somewhere: lift." in text
    assert "somewhere: drag" not in page(answered("consistent", [], None, 1.0), left=0.8)
    assert "No pair leaves less" in text
    assert "throw1 its last 0.20 s, throw6 its first 0.10 s and its last 0.30 s." in text
    assert "late rows alone (2 %)" in text


def test_an_iron_that_explains_little_is_none():
    explained, not_ = (page(answered("consistent", [], None, 1.0), iron=iron) for iron in (1.0, 8.0))
    assert "leave 1.0 of 10.0 uT. - Gyroscope" in explained
    assert "leave 8.0 of 10.0 uT: **no constant iron explains it**." in not_
    assert "is 0.990 to 1.010 on the six axes" in not_
