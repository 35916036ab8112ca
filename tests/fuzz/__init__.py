"""A fuzz harness: sound inputs are mutated at random and everything that reads them is run on the result.

``python -m tests.fuzz --mutations 20000 --seed N [--target NAME]``. A case is right where the code answers with
something that can be, or refuses with one line that says where, what it found and what it expected.
"""

from __future__ import annotations

import sys
from pathlib import Path

# what tests share lies beside this package, and pytest alone puts its folder on the path
if str(Path(__file__).parents[1]) not in sys.path:
    sys.path.append(str(Path(__file__).parents[1]))
