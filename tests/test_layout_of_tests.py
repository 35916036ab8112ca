"""The tests themselves: each lies in the room that it tests, goes through a public door, and can be read at a go."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

TESTS = Path(__file__).parent
ROOT = TESTS.parent
OURS = ("discsim", "estimators", "validation")
FILES = sorted(TESTS.rglob("*.py"))
NAMES = [str(path.relative_to(TESTS)) for path in FILES]

#: most lines of a file, and of a function
LONGEST_FILE, LONGEST_FUNCTION = 600, 60


def is_private(name: str) -> bool:
    return name.startswith("_") and not name.startswith("__")


def private_names(source: str) -> list[str]:
    """Return the private names of our packages that a source imports, reads off a module or class, or replaces."""
    tree = ast.parse(source)
    ours: set[str] = set()
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and (node.module or "").split(".")[0] in OURS:
            found += [alias.name for alias in node.names if is_private(alias.name)]
            found += [part for part in (node.module or "").split(".") if is_private(part)]
            ours |= {alias.asname or alias.name for alias in node.names}
        elif isinstance(node, ast.Import):
            mine = [alias for alias in node.names if alias.name.split(".")[0] in OURS]
            ours |= {alias.asname or alias.name.split(".")[0] for alias in mine}
    for node in ast.walk(tree):
        if isinstance(node, ast.Attribute) and is_private(node.attr) and node.attr not in NAMED_TUPLE:
            base = node.value
            while isinstance(base, ast.Attribute):
                base = base.value
            found += [node.attr] if isinstance(base, ast.Name) and base.id in ours else []
        elif isinstance(node, ast.Call) and getattr(node.func, "attr", getattr(node.func, "id", "")) in REACHING:
            texts = [a.value for a in node.args[:2] if isinstance(a, ast.Constant) and isinstance(a.value, str)]
            found += [text for text in texts if is_private(text.rpartition(".")[2])]
    return found


#: what named tuples offer to all, with an underscore only so that no field can be in its way
NAMED_TUPLE = ("_asdict", "_fields", "_make", "_replace")
#: calls that reach an attribute by its name
REACHING = ("setattr", "getattr", "delattr", "patch", "import_module")


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_no_test_drives_a_private_name(path):
    assert private_names(path.read_text(encoding="utf-8")) == []


@pytest.mark.parametrize(
    "text",
    [
        "from discsim.native import _passive",
        "from discsim.validation.identification import gauss_newton\ngauss_newton._solved(1)",
        "import discsim.native\ndiscsim.native._passive()",
        "from discsim.law import Law as L\nL._symbols",
        "from discsim import native\nmonkeypatch.setattr(native, '_passive', None)",
        "monkeypatch.setattr('discsim.native._passive', None)",
        "from discsim.validation.diagnosis._hidden import what",
    ],
)
def test_a_private_name_that_a_test_drives_is_found(text):
    assert private_names(text)


@pytest.mark.parametrize(
    "text",
    [
        "from discsim.disc import Aero\nAero._fields",
        "from discsim.native import at\nmodel._address\ndef _own(): pass\n_own()",
        "monkeypatch.setattr(builtins, '__import__', None)",
    ],
)
def test_a_private_name_of_somebody_else_is_left_alone(text):
    assert private_names(text) == []


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_every_folder_of_tests_is_named_after_the_room_that_it_tests(path):
    place = path.parent.relative_to(TESTS)
    if place.parts and place.parts[0] in OURS:
        assert (ROOT / place).is_dir(), f"{place} is no room of the code"
    else:
        assert place.parts[:1] in ((), ("faults",), ("fuzz",), ("support",))


def test_no_two_files_of_tests_have_the_same_name():
    """They are imported by it."""
    names = [path.name for path in FILES if path.name.startswith("test_")]
    assert sorted(set(names)) == sorted(names)


@pytest.mark.parametrize("path", FILES, ids=NAMES)
def test_files_and_functions_of_tests_can_be_read_at_a_go(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) <= LONGEST_FILE
    functions = [n for n in ast.walk(ast.parse(text)) if isinstance(n, ast.FunctionDef | ast.AsyncFunctionDef)]
    long = [n.name for n in functions if (n.end_lineno or n.lineno) - n.lineno >= LONGEST_FUNCTION]
    assert long == []
