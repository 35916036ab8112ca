"""The packages build on one another in one direction, so that an estimator sees no truth."""

from __future__ import annotations

import ast
from collections import defaultdict
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
OURS = ("discsim", "estimators", "validation", "tests", "benchmarks")

#: packages that are imported from within discsim, and called by their folders here
INNER = ("estimators", "validation")

#: package -> what of ours it may import: a name stands for itself and everything below it
MAY_IMPORT = {
    "discsim": ("discsim",),
    "estimators": (
        "estimators",
        "discsim.arrays",
        "discsim.clipping",
        "discsim.compiled",
        "discsim.disc",
        "discsim.errors",
        "discsim.glitches",
        "discsim.recording",
        "discsim.result",
        "discsim.threads",
    ),
    "validation": ("discsim", "estimators", "validation"),
}
#: the door of the whole package names what users call, from every room, and loads it when it is asked for
DOOR = ROOT / "discsim" / "__init__.py"
SOURCES = [
    (package, source) for package in MAY_IMPORT for source in sorted((ROOT / package).rglob("*.py")) if source != DOOR
]


def imported(source: str, module: str, is_package: bool) -> set[str]:
    """Return the full names of what ``source``, the text of ``module``, imports anywhere in it.

    ``from a import b`` counts as ``a.b``, for b may be a module; ``discsim.estimators`` as the folder ``estimators``.
    """
    return {by_folder(name) for name in imported_as_written(source, module, is_package)}


def by_folder(name: str) -> str:
    """Return a module by the folder that it lies in; ``?estimators`` where it is not asked for within discsim."""
    top, _, rest = name.partition(".")
    if top in INNER:
        return f"?{name}"
    return rest if top == "discsim" and rest.split(".")[0] in INNER else name


def imported_as_written(source: str, module: str, is_package: bool) -> set[str]:
    """Return the full names as `imported` does, as they are written."""
    module = f"discsim.{module}" if module.split(".")[0] in INNER else module
    names = set()
    for node in ast.walk(ast.parse(source)):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            parts = module.split(".")
            base = parts[: len(parts) + is_package - node.level] if node.level else []
            origin = [*base, *filter(None, [node.module])]
            names |= {".".join([*origin, alias.name]) for alias in node.names}
        elif isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
            function = getattr(node.func, "attr", getattr(node.func, "id", ""))
            if function in ("import_module", "__import__") and isinstance(node.args[0].value, str):
                names.add(node.args[0].value)
    return names


def forbidden(package: str, names: set[str]) -> set[str]:
    """Return those of ``names`` that ``package`` may not import."""

    def within(name: str, allowed: str) -> bool:
        return name == allowed or name.startswith(f"{allowed}.")

    ours = {name for name in names if name.lstrip("?").split(".")[0] in OURS}
    return {name for name in ours if not any(within(name, allowed) for allowed in MAY_IMPORT[package])}


@pytest.mark.parametrize(("package", "source"), SOURCES, ids=[str(source.relative_to(ROOT)) for _, source in SOURCES])
def test_no_import_points_the_wrong_way(package, source):
    relative = source.relative_to(ROOT)
    is_package = relative.name == "__init__.py"
    module = ".".join(relative.parent.parts if is_package else relative.with_suffix("").parts)
    assert forbidden(package, imported(source.read_text(encoding="utf-8"), module, is_package)) == set()


def test_the_diagnosis_reaches_no_code_that_conceals():
    """Followed through every import of ours: a blind test needs an examinee that cannot ask the examiner."""
    files = {
        ".".join((path.parent if path.name == "__init__.py" else path.with_suffix("")).relative_to(ROOT).parts): path
        for package in MAY_IMPORT
        for path in (ROOT / package).rglob("*.py")
        if path != DOOR
    }
    ahead = {"validation.commands.diagnose", *(name for name in files if name.startswith("validation.diagnosis"))}
    reached: set[str] = set()
    while ahead:
        name = ahead.pop()
        reached.add(name)
        path = files[name]
        found = imported(path.read_text(encoding="utf-8"), name, path.name == "__init__.py")
        modules = {target.rpartition(".")[0] if target not in files else target for target in found}
        ahead |= (modules & files.keys()) - reached
    assert "discsim.trajectory" in reached
    assert not {name for name in reached if name.startswith("validation.challenge")}


def test_the_door_imports_nothing_of_ours_before_it_is_asked():
    body = ast.parse(DOOR.read_text(encoding="utf-8")).body
    executed = [node for node in body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert {getattr(node, "module", None) for node in executed} == {"__future__", "importlib", "typing"}


def test_no_room_goes_through_the_door_to_one_above_it():
    above = {
        name
        for node in ast.walk(ast.parse(DOOR.read_text(encoding="utf-8")))
        if isinstance(node, ast.ImportFrom)
        and (node.module or "").startswith(tuple(f"discsim.{name}" for name in INNER))
        for name in (alias.asname or alias.name for alias in node.names)
    }
    assert {"challenge", "diagnose", "estimate", "fft"} <= above
    for _, source in SOURCES:
        for node in ast.walk(ast.parse(source.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Attribute) and isinstance(node.value, ast.Name) and node.value.id == "discsim":
                assert node.attr not in above, source
            elif isinstance(node, ast.ImportFrom) and node.module == "discsim":
                assert not above & {alias.name for alias in node.names}, source


@pytest.mark.parametrize(
    ("below", "above"),
    [
        ("validation.identification", ("diagnosis", "challenge", "studies", "experiments", "commands", "yaw_damping")),
        ("validation.diagnosis", ("challenge", "studies", "experiments", "commands", "sweeps")),
        ("validation.yaw_damping", ("diagnosis", "challenge", "studies", "commands")),
    ],
)
def test_no_arrow_runs_up_between_rooms(below, above):
    places = [(".".join(path.relative_to(ROOT).with_suffix("").parts), path) for _, path in SOURCES]
    found = {
        target
        for module, path in places
        if module.startswith(f"{below}.")
        for target in imported(path.read_text(encoding="utf-8"), module, path.name == "__init__.py")
    }
    assert any(target.startswith(f"{below}.") for target in found)
    assert not [target for target in found if target.startswith(tuple(f"validation.{room}." for room in above))]


@pytest.mark.parametrize("package", ["estimators", "validation.diagnosis", "validation.identification"])
def test_rooms_of_a_package_import_one_another_in_one_direction(package):
    """A file beside the rooms counts as a room of its own; a circle is told by the rooms on it."""
    above = defaultdict(set)
    for _, path in SOURCES:
        is_package = path.name == "__init__.py"
        module = ".".join((path.parent if is_package else path.with_suffix("")).relative_to(ROOT).parts)
        for target in imported(path.read_text(encoding="utf-8"), module, is_package):
            if module.startswith(f"{package}.") and target.startswith(f"{package}."):
                room, other = (name.removeprefix(f"{package}.").split(".")[0] for name in (module, target))
                above[room] |= {other} - {room}
    assert len(list(TopologicalSorter(above).static_order())) > 5


def test_every_package_is_looked_at():
    assert {package for package, _ in SOURCES} == set(MAY_IMPORT)


def test_models_holds_no_python():
    assert sorted(file for file in (ROOT / "models").rglob("*.py*")) == []


@pytest.mark.parametrize(
    ("package", "text"),
    [
        ("discsim", "import discsim.estimators"),
        ("validation", "import estimators"),
        ("validation", "from validation.reporting.run import start_run"),
        ("estimators", "from estimators.rate import YawRate"),
        ("discsim", "from discsim.validation.reporting.run import start_run"),
        ("discsim", "def f():\n    from discsim.estimators.rate import YawRate"),
        ("discsim", "import_module('discsim.validation.cli')"),
        ("discsim", "from . import validation"),
        ("estimators", "import discsim"),
        ("estimators", "from discsim import engine"),
        ("estimators", "from discsim.motion import Motion"),
        ("estimators", "import discsim.recordings"),
        ("estimators", "from .. import motion"),
        ("estimators", "if TYPE_CHECKING:\n    from discsim.motion import Motion"),
        ("validation", "from tests.conftest import x"),
    ],
)
def test_an_import_that_points_the_wrong_way_is_found(package, text):
    assert forbidden(package, imported(text, f"{package}.module", is_package=False))


@pytest.mark.parametrize(
    ("package", "text"),
    [
        ("discsim", "import numpy\nfrom discsim.arrays import readonly\nfrom .arrays import readonly"),
        (
            "estimators",
            "from discsim.recording import Recording\nfrom discsim.estimators import YawRate\nfrom . import rate",
        ),
        (
            "validation",
            "import discsim.engine\nfrom discsim.estimators import fft\n"
            "from discsim.validation.reporting.run import start_run",
        ),
    ],
)
def test_an_import_that_points_the_right_way_is_allowed(package, text):
    assert forbidden(package, imported(text, f"{package}.module", is_package=False)) == set()
