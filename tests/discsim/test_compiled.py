"""What compiles: linear algebra is loaded by what calls it, and by nothing else."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]

#: a product by BLAS, in a file of its own so that its code is cached
PRODUCT = """
import numpy as np
from discsim.compiled import compiled

@compiled
def product(a, b):
    return np.dot(a, b)
"""
#: tells whether linear algebra is there before and after the product, and whether the code came from the cache
ASKED = """
import sys
import numpy as np
from product import product
before = "scipy.linalg" in sys.modules
a = np.arange(12.0).reshape(3, 4)
right = np.array_equal(product(a, a.T.copy()), a @ a.T)
print(before, "scipy.linalg" in sys.modules, right, sum(product.stats.cache_hits.values()))
"""


def said(folder: Path, code: str, kept: Path | None = None) -> list[str]:
    environment = {**os.environ, "NUMBA_CACHE_DIR": str((kept or folder) / "cache"), "PYTHONPATH": str(folder)}
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, cwd=folder, capture_output=True, text=True, check=True
    )
    return done.stdout.split()


def test_a_compiled_product_finds_its_linear_algebra_compiled_or_from_the_cache(tmp_path):
    (tmp_path / "product.py").write_text(PRODUCT)
    assert said(tmp_path, ASKED) == ["False", "True", "True", "0"]
    assert said(tmp_path, ASKED) == ["False", "True", "True", "1"]


def test_numba_is_left_as_it_was(tmp_path):
    """Who imports numba alone after us, and asks for linear algebra, gets it or numba's own error."""
    code = (
        "import discsim.compiled, numba.np.linalg as linalg, numba.np.arraymath as arrays\n"
        "print(linalg.ensure_blas.__module__, arrays.ensure_blas is linalg.ensure_blas, arrays._HAVE_BLAS)"
    )
    assert said(tmp_path, code) == ["numba.np.linalg", "True", "True"]


def test_what_was_compiled_serves_the_same_sources_elsewhere(tmp_path):
    """A new environment, or an image whose files have other dates, need not compile anew."""
    code = (
        "import discsim\nfrom discsim.aerodynamics import advance_ratio as some\nsome(1.0, 2.0, 3.0)\n"
        "print(discsim.__file__, *some.stats.cache_hits.values())"
    )
    for number in range(2):
        shutil.copytree(
            ROOT / "discsim",
            tmp_path / str(number) / "discsim",
            ignore=shutil.ignore_patterns("__pycache__"),
            copy_function=shutil.copyfile,
        )
    files = [str(tmp_path / str(number) / "discsim" / "__init__.py") for number in range(2)]
    assert said(tmp_path / "0", code, tmp_path) == [files[0]]
    assert said(tmp_path / "1", code, tmp_path) == [files[1], "1"]
