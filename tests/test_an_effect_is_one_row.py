"""An effect is one file and one row: all of the program knows it, and no code but its own names it by its id."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest
from support.page_diff import told_with

from discsim.effects import CATALOGUE

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "architecture.md").read_text(encoding="utf-8")

#: files that may hold an id as a string -> why
NAMED = {
    "validation/checking/statements.py": "findings about stated numbers go by the table and key that they stand in, "
    "some of which spell like an effect: air.wind says that a stated wind is a storm",
}


def ids_in(source: str) -> set[str]:
    """The ids of the catalogue among the string literals of a source, and families of them that are asked for."""
    heads, tails = ({id.partition(".")[place] for id in CATALOGUE} for place in (0, 2))
    nodes = list(ast.walk(ast.parse(source)))
    asked = [
        leaf
        for node in nodes
        if isinstance(node, ast.Call) and getattr(node.func, "attr", "") in ("startswith", "endswith")
        for leaf in ast.walk(node)
    ]

    def texts(some: list[ast.AST]) -> set[str]:
        return {str(node.value) for node in some if isinstance(node, ast.Constant)}

    return texts(nodes) & {*CATALOGUE} | texts(asked) & ({f"{head}." for head in heads} | {f".{t}" for t in tails})


def test_no_code_outside_the_challenge_names_an_effect_by_its_id():
    sources = [path for path in (ROOT / "validation").rglob("*.py") if "challenge" not in path.parts]
    assert len(sources) > 150
    named = {str(path.relative_to(ROOT)): ids_in(path.read_text(encoding="utf-8")) for path in sources}
    named = {path: sorted(ids) for path, ids in named.items() if ids}
    assert set(named) == set(NAMED), named
    assert len(NAMED) <= 5


def test_ids_and_their_parts_are_seen_in_a_source():
    source = 'x = {"air.wind": "air.", "air": 1}; y = id.startswith(("aero.", "no.")) or id.endswith(".lag")'
    assert ids_in(source) == {"air.wind", "aero.", ".lag"}


@pytest.mark.parametrize("row", [row for row in CATALOGUE.values() if row.detector], ids=lambda row: row.id)
def test_a_detector_that_a_row_names_is_there(row):
    assert (ROOT / "validation" / "diagnosis" / "detectors" / f"{row.detector}.py").is_file()


def test_an_effect_becomes_another_by_a_parameter_whose_spread_is_known():
    for row in CATALOGUE.values():
        if row.becomes is not None:
            other, name, _ = row.becomes
            assert other in CATALOGUE
            assert name in row.grid_sigma
        if isinstance(row.lasts, str):
            assert row.lasts in row.parameters
        assert row.per_turn in ("", *row.parameters)


# ------------------------------------------------------------------------------ a file that is put beside the others

ASKED = """
import json, runpy, sys
from pathlib import Path
from dataclasses import replace
import numpy as np
from discsim import engine
from discsim.effects import CATALOGUE, effect
from discsim.model_file import Model, ModelEffect, read_model, write_model
from discsim.recording import read_recording
from discsim.sensors import Instruments, record
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict
from discsim.validation.challenge.cases.conceal import Answer, recordings
from discsim.validation.challenge.cases.draw import draw_case
from discsim.validation.challenge.cases.sizes import conceivable
from discsim.validation.commands.fly import command as fly
from discsim.validation.diagnosis.first_trajectory import first_trajectory
from discsim.validation.diagnosis.report.wording import form, name_of
from discsim.validation.diagnosis.candidates.candidate import candidates_for
from discsim.validation.identification.linearisation import linearise
from discsim.validation.identification.plants.flight import FLIGHT

out, ids = Path(sys.argv[1]), ("air.rim_damping", "gyro.bending")
told = {"listed": [id for id in CATALOGUE if id in ids]}

# fly and record
fly(out=out / "plain")
fly(out=out / "with", effect=["air.rim_damping:k_N_m_s=3e-4", "gyro.bending:k_per_rad_s=1e-3"])
plain = read_recording(out / "plain")
disc, environment = load_disc("driver")
damped = [effect("air.rim_damping", k_N_m_s=3e-4)]
ends = [predict(disc, environment, load_throw("driver"), some).state[-1, :3] for some in ([], damped)]
told["moved"] = float(np.linalg.norm(ends[1] - ends[0]))
truth = np.genfromtxt(out / "with" / "truth.csv", delimiter=",", names=True)
told["apart"] = float(np.hypot(truth["north_m"][-1] - ends[1][0], truth["east_m"][-1] - ends[1][1]))

slow = replace(load_throw("driver"), body_rate=np.array([9.0, 0.0, 30.0]))
motion = engine.fly(disc, environment, slow, duration=0.5)
part = Instruments.from_parts("mpu9250")
sound, bent = (
    record(motion, module, np.random.default_rng(1), plant="flight", name="").samples["gyroscope"].value
    for module in (part, part.with_effects([effect("gyro.bending", k_per_rad_s=1e-3)]))
)
told["bent"] = np.max(np.abs(sound)), np.max(np.abs(bent - sound - 1e-3 * sound * np.abs(sound)))

# diagnose
candidates = {candidate.id: candidate for candidate in candidates_for([plain]) if candidate.id in ids}
told["candidates"] = sorted(candidates)
columns = [column for candidate in candidates.values() for column in candidate.columns]
slopes = linearise(first_trajectory(plain), {}, columns, FLIGHT.sizes.continuous.allowed).common
told["slopes"] = {c.group: float(np.max(np.abs(slopes[:, k]))) for k, c in enumerate(columns)}

# challenge
told["conceivable"] = [id for id in conceivable("flight", ("gyroscope",)) if id in ids]
case = draw_case(3, "flight", list(ids))
told["concealed"] = list(Answer.of(case).effects)
one = replace(case, runs=case.runs[:1])
sound = recordings(replace(one, concealed=()))[0]
shown = [recording.samples["gyroscope"].value[:50] for recording in (recordings(one)[0], sound)]
told["hidden"] = float(np.nanmax(np.abs(shown[0] - shown[1])))

# the page, the report, a model file
page = runpy.run_path(sys.argv[2])["page"]()
told["page"] = [id for id in ids if f"| `{id}` |" in page]
told["report"] = [name_of(ids[0]), form(ids[1])]
write_model(Model(environment, disc, None, (ModelEffect(damped[0], {}, None),), ()), out / "model.toml")
told["model"] = read_model(out / "model.toml").effects[0].effect == damped[0]
print("TOLD" + json.dumps(told, default=float))
"""


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """What the program says of the page's two effects, in a process of its own whose catalogue has their file."""
    folder = tmp_path_factory.mktemp("effects")
    (module,) = re.findall(r"^```python\n(\"\"\".*?ROWS = .*?)^```", PAGE, re.MULTILINE | re.DOTALL)
    (folder / "discsim" / "effects").mkdir(parents=True)
    (folder / "discsim" / "effects" / "flutter_rows.py").write_text(module, encoding="utf-8")
    return told_with(folder, ASKED, str(ROOT / "docs" / "effects.py"))


BOTH = ["air.rim_damping", "gyro.bending"]


def test_a_file_beside_the_others_adds_its_rows_to_the_catalogue(told):
    assert told["listed"] == BOTH


def test_both_engines_fly_an_effect_that_is_one_row(told):
    """It moves the landing by far more than the engines are apart."""
    assert told["moved"] > 0.1
    assert told["apart"] < 0.02 * told["moved"]


def test_its_sensor_records_an_effect_that_is_one_row(told):
    largest, off = told["bent"]
    assert 1e-3 * largest**2 > 0.5
    assert off < 2 * 0.0010653  # the gyroscope's steps, one of each recording


def test_a_diagnosis_tries_an_effect_that_is_one_row(told):
    assert told["candidates"] == BOTH
    assert all(0.0 < slope < float("inf") for slope in told["slopes"].values())
    assert len(told["slopes"]) == 2


def test_the_challenge_conceals_an_effect_that_is_one_row(told):
    assert told["conceivable"] == BOTH
    assert told["concealed"] == BOTH
    assert told["hidden"] > 0.0


def test_the_page_the_report_and_model_files_tell_of_an_effect_that_is_one_row(told):
    assert told["page"] == BOTH
    assert told["report"] == ["a rim that damps the wobble", "ω → ω · (1 + <i>k</i> · |ω|)"]
    assert told["model"]
