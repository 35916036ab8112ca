"""Execute the notebooks of the documentation and keep their outputs: ``python docs/notebooks.py [NAME ...]``."""

from __future__ import annotations

import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import nbformat
from nbclient import NotebookClient

FOLDER = Path(__file__).resolve().parent / "notebooks"
#: s; each takes less than a minute of CPU time, but a machine may be busy
PATIENCE = 900


def executed(path: Path, folder: str) -> nbformat.NotebookNode:
    """Return a notebook with its outputs, run in ``folder``; raises what a cell raises."""
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(
        notebook, timeout=PATIENCE, kernel_name="python3", resources={"metadata": {"path": folder}}
    ).execute()
    for cell in notebook.cells:  # times of execution are no content
        cell.metadata.pop("execution", None)
    return notebook


if __name__ == "__main__":
    for path in sorted(FOLDER.glob("*.ipynb")):
        if len(sys.argv) == 1 or path.stem in sys.argv[1:]:
            with TemporaryDirectory() as folder:
                nbformat.write(executed(path, folder), path)
            print(path.name)
