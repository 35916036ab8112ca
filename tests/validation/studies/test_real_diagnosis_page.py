"""The page on diagnosed recordings says in prose what its numbers say, whatever they are."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace as Made

import numpy as np
import pytest

import validation.studies.real_diagnosis as study
from validation.reporting.markdown import page_text

PAGE = Path(study.__file__).with_name("page.md.j2")
NAMES = ("throw1", "throw6", "throw15")


def answered(verdict: str, effects: list[dict], law: dict | None, final: float) -> Made:
    """Return a diagnosis as the study reads it."""
    chi2 = {"baseline": 456.7, "final": final}
    answer = {"effects": effects, "law": law, "heldout": [], "located": [{"text": "a place"}]}
    return Made(answer=answer, verdict=verdict, chi2=chi2.__getitem__)


def rows(late: float) -> Made:
    return Made(usual=0.0095, late=late, by_field=1.06, by_wobble=1.1, spin={"gyroscope": 0.05})


def golf(found: Made, distance: float, left: float, named: str = "") -> dict[str, object]:
    """Return what fills the part on the golf throws, ``distance`` m off by the best cause where 10 m are stated."""
    rms, moves = dict.fromkeys(NAMES, 2.0), {"speed": 1.5}
    fit = Made(cause=Made(name="drag"), x=0.1, sd=0.02, rms=rms, moves=moves, wind=(1, -2))
    flown = dict.fromkeys(NAMES, Made(distance=distance))
    best = Made(together=fit, landings=flown, gains=dict.fromkeys(NAMES, 3.0))
    return {
        "answer": found,
        "named": named,
        "noise": 0.5,
        "left": left,
        "reached": 2.0,
        "stated": dict.fromkeys(NAMES, Made(distance=10.0)),
        "APART": 0.5,
        "LEFT": 1.0,
        "GROUND": 0.2,
        "without": best,
        "best": best,
        "names": NAMES,
        "causes": [["none"] * 6],
        "off": lambda flights: ", ".join(f"{flights[name].distance:.1f}" for name in NAMES),
        "sizes": "+0.1, +0.1, +0.1",
        "spread": 1.0,
        "nearer": NAMES if distance < 10.0 else (),
        "farther": () if distance < 10.0 else NAMES,
        "worst": "throw1",
        "by_wind": 3 if distance < 10.0 else 0,
    }


def page(found: Made, distance: float = 5.0, left: float = 3.0, named: str = "", iron: float = 1.0) -> str:
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
        golf=golf(found, distance, left, named),
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
    unnamed = page(answered("unexplained", [], None, 900.0), left=15.0)
    assert "No effect is named, and no law that would hold on throws set aside." in unnamed
    assert "says **unexplained**, and names nothing. It offers no law either" in unnamed
    assert "15.0 m are left. That is no verdict to rely on" in unnamed


def test_a_law_is_written_out():
    law = {"text": "a*r", "target": "force_x_N", "heldout_delta_log_likelihood": 4.5}
    text = page(answered("unexplained", [], law, 1.0))
    assert "No effect is named. Its law for what remains: `a*r` on `force_x_N` (a = 1), with a gain" in text
    assert "It offers no law either" not in text


@pytest.mark.parametrize(
    ("distance", "said"),
    [
        (
            5.0,
            "throw1, throw6, throw15 would land nearer than as stated; the worst is throw1, 5.0 m off",
        ),
        (12.0, "no throw would land nearer than as stated, and throw1, throw6, throw15 farther; the worst is throw1"),
    ],
)
def test_a_cause_is_supported_only_where_no_throw_lands_farther_by_it(distance, said):
    text = page(answered("consistent", [], None, 1.0), distance)
    assert said in text
    supports = "Leave-one-throw-out supports it; three throws of one evening are too few to name it."
    assert (supports in text) == (distance < 10.0)
    assert ("in each case." in text) == (distance < 10.0)
    assert "late rows alone (2 %)" in text


def test_an_iron_that_explains_little_is_none():
    explained, not_ = (page(answered("consistent", [], None, 1.0), iron=iron) for iron in (1.0, 8.0))
    assert "leave 1.0 of 10.0 uT. - Gyroscope" in explained
    assert "leave 8.0 of 10.0 uT: **no constant iron explains it**." in not_
    assert "is 0.990 to 1.010 on the six axes" in not_
