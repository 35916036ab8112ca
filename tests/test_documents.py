"""The documents agree with the program, and their links lead somewhere."""

from __future__ import annotations

import inspect
import re
from pathlib import Path

import pytest
import yaml

from discsim.disc import Aero, aero_key
from discsim.recording import COMMAND_HEADER, PLANTS, SENSORS, read_recording
from discsim.toml_text import sigma_key
from discsim.validation.commands.validate import command as validate

ROOT = Path(__file__).parents[1]
DOCUMENTS = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]
FORMAT_PAGE = (ROOT / "docs" / "recording-format.md").read_text(encoding="utf-8")


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda document: str(document.relative_to(ROOT)))
def test_links_lead_somewhere(document):
    links = re.findall(r"\]\(([^)#\s]+)(?:#[^)]*)?\)", document.read_text(encoding="utf-8"))
    local = [link for link in links if not link.startswith(("http://", "https://", "mailto:"))]
    assert [link for link in local if not (document.parent / link).exists()] == []


def test_the_index_lists_every_page():
    index = (ROOT / "docs" / "index.md").read_text(encoding="utf-8")
    pages = {page.name for page in (ROOT / "docs").glob("*.md")} - {"index.md"}
    assert set(re.findall(r"\]\(([\w-]+\.md)\)", index)) == pages


def test_the_sites_navigation_lists_every_page():
    """Else `mkdocs build --strict` ends with a warning, which no other test runs."""
    navigation = (ROOT / "mkdocs.yml").read_text(encoding="utf-8").split("\nnav:\n")[1]
    docs = ROOT / "docs"
    pages = {str(page.relative_to(docs)) for kind in ("*.md", "*.ipynb") for page in docs.rglob(kind)}
    assert set(re.findall(r": ([\w/.-]+\.(?:md|ipynb))$", navigation, re.M)) == pages


def test_the_format_page_has_every_file_and_header():
    table = dict(re.findall(r"^\| `(\w+)\.csv` \| `([^`]+)` \|$", FORMAT_PAGE, re.M))
    assert table == {sensor: kind.header for sensor, kind in SENSORS.items()} | {"command": COMMAND_HEADER}


def test_the_format_pages_example_is_a_recording(tmp_path):
    example = re.search(r"^```toml\n(.*?)^```", FORMAT_PAGE, re.M | re.S)
    assert example
    (tmp_path / "recording.toml").write_text(example[1], encoding="utf-8")
    (tmp_path / "magnetometer.csv").write_text(SENSORS["magnetometer"].header + "\n0,1,2,3\n")
    recording = read_recording(tmp_path)
    assert recording.name == "open-field-01"
    assert recording.environment.sigma == {"air_density_kg_m3": 0.005, "wind_ned_m_s": 0.5}


def test_the_format_page_knows_every_sensor_key_plant_and_coefficient(tmp_path):
    rows = dict(re.findall(r"^\| `(\w+)` \| (`rate_hz`.*) \|$", FORMAT_PAGE, re.M))
    for sensor, kind in SENSORS.items():
        keys = re.findall(r"`(\w+)`", rows.pop(sensor))
        values = "\n".join(f"{key} = {'[0, 0, 0]' if key == 'position_m' else 1}" for key in keys)
        (tmp_path / f"{sensor}.csv").write_text(kind.header + "\n" + ",".join(["0"] * (len(kind.columns) + 1)))
        (tmp_path / "recording.toml").write_text(
            'format = "discsim-recording/1"\nplant = "free_spin"\nname = ""\n[environment]\ngravity_m_s2 = 9.8\n'
            f"magnetic_field_ned_uT = [1, 0, 0]\n[sensors.{sensor}]\n{values}\n"
        )
        assert sensor in read_recording(tmp_path)
        (tmp_path / f"{sensor}.csv").unlink()
    assert not rows
    for word in [*PLANTS, *map(aero_key, Aero._fields)]:
        assert f"`{word}`" in FORMAT_PAGE


def test_the_format_pages_uncertainties_are_the_programs():
    rows = re.findall(r"^\| `(\w+)` \| `(\w*sigma\w*)`", FORMAT_PAGE, re.M)
    assert len(rows) > 5
    for key, sigma in rows:
        assert sigma_key(key) == sigma


def test_the_pipelines_of_the_ci_page_are_yaml_and_use_options_that_there_are():
    page = (ROOT / "docs" / "headless-ci.md").read_text(encoding="utf-8")
    pipelines = re.findall(r"^```yaml\n(.*?)^```", page, re.M | re.S)
    assert len(pipelines) == 2
    assert all("validate" in yaml.safe_load(text).get("jobs", yaml.safe_load(text)) for text in pipelines)
    options = {
        f"--{name.replace('_', '-')}" for name in inspect.signature(validate).parameters
    }  # what typer makes of a parameter's name
    used = set(
        re.findall(r"(--[a-z-]+)", "".join(re.findall(r"discsim validate.*?(?=\n\s*- |\n```|\n\n)", page, re.S)))
    )
    assert used >= {"--quick", "--limits", "--against", "--junit", "--summary"}
    assert used <= options
