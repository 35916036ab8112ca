"""The notebooks of the documentation run as they stand, and are kept with outputs."""

from __future__ import annotations

import os
import runpy
from pathlib import Path

import nbformat
import pytest

ROOT = Path(__file__).parents[1]
RUNNER = runpy.run_path(str(ROOT / "docs" / "notebooks.py"))
NOTEBOOKS = sorted((ROOT / "docs" / "notebooks").glob("*.ipynb"))


def test_there_are_three_notebooks():
    assert len(NOTEBOOKS) == 3


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_a_notebook_is_kept_with_the_outputs_of_each_cell_and_without_an_error(path):
    notebook = nbformat.read(path, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert [cell.execution_count for cell in cells] == list(range(1, len(cells) + 1)), "run: python docs/notebooks.py"
    outputs = [output for cell in cells for output in cell.outputs]
    assert any("image/png" in output.get("data", {}) for output in outputs)
    assert not [output for output in outputs if output.output_type == "error"]
    assert not [output for output in outputs if output.get("name") == "stderr"]


@pytest.mark.filterwarnings("default")  # of the kernel's own packages
# what the notebook of a diagnosis runs, docs/tutorial.md runs as well
@pytest.mark.parametrize(
    "path",
    [pytest.param(path, marks=pytest.mark.slow) if path.stem == "diagnose-a-log" else path for path in NOTEBOOKS],
    ids=lambda path: path.stem,
)
def test_a_notebook_runs_and_says_what_it_said(path, tmp_path, monkeypatch):
    monkeypatch.setitem(os.environ, "PYTHONPATH", str(ROOT))
    kept = nbformat.read(path, as_version=4)
    made = RUNNER["executed"](path, str(tmp_path))

    def kinds(notebook: nbformat.NotebookNode) -> list[list[tuple[str, ...]]]:
        """What each cell gives, by the kinds of its outputs: figures and rounded numbers differ between machines."""
        return [
            [tuple(sorted(output.get("data", {output.get("name", ""): ""}))) for output in cell.get("outputs", [])]
            for cell in notebook.cells
        ]

    assert kinds(made) == kinds(kept)


def test_the_notebook_of_a_diagnosis_names_the_magnet_that_its_log_holds():
    notebook = nbformat.read(ROOT / "docs" / "notebooks" / "diagnose-a-log.ipynb", as_version=4)
    said = "".join(str(output) for cell in notebook.cells for output in cell.get("outputs", []))
    assert "mag.hard_iron" in said
