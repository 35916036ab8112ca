"""Where things are: the project, and measured and practice recordings, which are no part of it."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
#: beside the project unless DISCSIM_RECORDINGS says where
RECORDINGS = Path(os.environ.get("DISCSIM_RECORDINGS") or ROOT.parent / "shared" / "recordings")
REAL, PRACTICE = RECORDINGS / "real", RECORDINGS / "practice"
#: of a test that needs measured recordings
real = pytest.mark.skipif(not REAL.is_dir(), reason="no measured recordings here (DISCSIM_RECORDINGS)")
