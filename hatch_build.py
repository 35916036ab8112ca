"""A build hook: a wheel and an sdist hold the commit that they were built from, where git can tell it.

Called by hatchling; gives it ``discsim/commit.txt``, which `discsim.version` reads. Without git nothing is added.
"""

from __future__ import annotations

import runpy
import tempfile
from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface


class CommitHook(BuildHookInterface):
    """Adds the commit of the checkout to what is built."""

    PLUGIN_NAME = "custom"

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Add the file to a build; an editable installation asks git when it runs."""
        package = Path(self.root) / "discsim"
        if version == "editable" or (package / "commit.txt").is_file():  # the latter of an unpacked sdist
            return
        commit = runpy.run_path(str(package / "version.py"))["commit"]()
        if commit != "unknown":
            file = Path(tempfile.mkdtemp(prefix="discsim-build-")) / "commit.txt"
            file.write_text(f"{commit}\n", encoding="utf-8")
            build_data["force_include"][str(file)] = "discsim/commit.txt"
