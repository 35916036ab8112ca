"""Code comes in pieces that a reader takes in at once: lines and arguments of a function, lines of a file.

Kernels that numba compiles are free of the first two: they pass numbers and not objects, and a loop stays one loop.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FOLDERS = ("discsim", "estimators", "validation", "tests", "benchmarks", "docs")

LINES_OF_A_FUNCTION, ARGUMENTS, LINES_OF_A_FILE = 60, 8, 600
#: beginnings of the names of decorators that make a compiled kernel
COMPILED = ("compiled", "inlined", "numba.", "njit", "intrinsic", "overload", "cfunc", "compiler.cfunc")

#: where a rule does not hold, and why: "file" for its lines, "file:function" for its lines or its arguments
LONG_FILES: dict[str, str] = {}
LONG_FUNCTIONS = {
    "validation/commands/estimate.py:command": "one option after another, and the help that users read",
    "validation/commands/fly.py:command": "one option after another, and the help that users read",
    "validation/commands/plan.py:command": "one option after another, and the help that users read",
    "validation/commands/scatter.py:command": "one option after another, and the help that users read",
    "validation/planning/planned.py:plan": "a door: most of it says what its arguments are",
    "validation/scattering/scattered.py:scatter": "a door: most of it says what its arguments are",
    "validation/commands/rate_table.py:command": "older than the rule; its body is to call and not to work",
    "validation/sweeps/result.py:labelled": "older than the rule; to be split by idea",
}
MANY_ARGUMENTS = {
    "validation/planning/planned.py:plan": "a door: what is planned, with which parts, instead of which",
    "validation/scattering/scattered.py:scatter": "a door: what is thrown, and what of it is uncertain",
    "tests/support/made_logs.py:write_table": "older than the rule, one above it",
    "tests/support/spinning_sensor.py:tone": "older than the rule; what a tone is made of belongs together",
}


def sources() -> Iterator[tuple[str, str]]:
    """Yield each of our files by its name from the root, with its text."""
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*.py")):
            yield path.relative_to(ROOT).as_posix(), path.read_text(encoding="utf-8")


@cache
def functions(text: str) -> list[ast.FunctionDef | ast.AsyncFunctionDef]:
    """Return the functions of a text that are no compiled kernels, and nothing inside of those."""
    found: list[ast.FunctionDef | ast.AsyncFunctionDef] = []
    ahead: list[ast.AST] = [ast.parse(text)]
    while ahead:
        for node in ast.iter_child_nodes(ahead.pop()):
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
                if any(ast.unparse(each).startswith(COMPILED) for each in node.decorator_list):
                    continue
                found.append(node)
            ahead.append(node)
    return found


def length(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return the lines of a function, docstring and comments with it, decorators left out."""
    assert function.end_lineno is not None
    return function.end_lineno - function.lineno + 1


def arguments(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Return how many arguments a caller may give."""
    given = function.args
    return len([one for one in [*given.posonlyargs, *given.args, *given.kwonlyargs] if one.arg not in ("self", "cls")])


def is_command(file: str, function: str) -> bool:
    """Tell whether it is what typer calls: one argument for each option of the command."""
    return function == "command" and file.startswith(("validation/commands/", "validation/studies/"))


def test_no_file_is_longer_than_a_reader_wants():
    long = {file: lines for file, text in sources() if (lines := len(text.splitlines())) > LINES_OF_A_FILE}
    assert {file: lines for file, lines in long.items() if file not in LONG_FILES} == {}


def test_no_function_is_longer_than_a_screen():
    long = {
        f"{file}:{function.name}": length(function)
        for file, text in sources()
        for function in functions(text)
        if length(function) > LINES_OF_A_FUNCTION
    }
    assert {name: lines for name, lines in long.items() if name not in LONG_FUNCTIONS} == {}


def test_no_function_takes_more_arguments_than_one_remembers():
    many = {
        f"{file}:{function.name}": arguments(function)
        for file, text in sources()
        for function in functions(text)
        if arguments(function) > ARGUMENTS and not is_command(file, function.name)
    }
    assert {name: count for name, count in many.items() if name not in MANY_ARGUMENTS} == {}


@pytest.mark.parametrize("decorator", ["compiled", "compiled_sums", "numba.njit(cache=True)", "intrinsic"])
def test_a_kernel_is_passed_over_with_all_that_is_in_it(decorator):
    inside = f"@{decorator}\ndef kernel(a):\n    def inner(b):\n        pass\n"
    assert [each.name for each in functions(f"{inside}class A:\n    def method(self):\n        pass\n")] == ["method"]


def test_all_lines_and_arguments_are_counted():
    (found,) = functions("@cache\ndef f(a, /, b, *, c):\n    '''Text.\n\n    More.\n    '''\n    return a\n")
    assert length(found) == 6
    assert arguments(found) == 3
