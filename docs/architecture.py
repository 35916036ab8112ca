"""Draw the rooms of the code and who imports whom, from the imports: ``python docs/architecture.py``.

Writes ``docs/images/architecture.png`` and the table of rooms between two marks in ``docs/architecture.md``.
"""

from __future__ import annotations

import ast
from collections import defaultdict
from collections.abc import Mapping
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components

ROOT = Path(__file__).resolve().parents[1]
PAGE, PICTURE = ROOT / "docs" / "architecture.md", ROOT / "docs" / "images" / "architecture.png"
MARKS = "<!-- rooms: begin -->", "<!-- rooms: end -->"
#: it names all that users call, from every room, and imports none of it before it is asked for
DOOR = Path("discsim") / "__init__.py"
#: packages whose own folders are rooms of their own, and those of which files beside them are, too
OPENED = ("discsim", "validation", "validation.diagnosis")
APART = ("validation.diagnosis",)


def room_of(module: str, packages: set[str]) -> str:
    """Return the room of a module: the deepest package that is no part of a room, or an opened package itself."""
    parts = module.split(".")
    room = parts[0]
    for part in parts[1:]:
        if room not in OPENED or f"{room}.{part}" not in packages:
            break
        room = f"{room}.{part}"
    return room


def rooms() -> tuple[dict[str, str], dict[str, set[str]]]:
    """Return what each room says of itself, and the rooms that each imports.

    A file beside the rooms of an opened package that one of these imports lies below them: it is a room of its own.
    """
    files = {
        path: path.relative_to(ROOT)
        for top in ("discsim", "estimators", "validation")
        for path in (ROOT / top).rglob("*.py")
    }
    packages = {".".join(path.parent.parts) for path in files.values() if path.name == "__init__.py"}
    known = {".".join(path.with_suffix("").parts) for path in files.values()} | packages
    said: dict[str, str] = {}
    arrows: dict[str, set[str]] = {}
    for path, relative in files.items():
        module = ".".join(relative.parent.parts if path.name == "__init__.py" else relative.with_suffix("").parts)
        tree = ast.parse(path.read_text(encoding="utf-8"))
        said[module] = (ast.get_docstring(tree) or "").partition("\n\n")[0].replace("\n", " ")
        arrows[module] = set() if relative == DOOR else imported(tree, known)
    place = {module: room_of(module, packages) for module in arrows}
    below = {
        target
        for module, targets in arrows.items()
        for target in targets
        if target not in packages and place[target] in APART and place[module].startswith(f"{place[target]}.")
    }
    place |= {module: module for module in below}
    edges: dict[str, set[str]] = defaultdict(set)
    for module, targets in arrows.items():
        edges[place[module]] |= {place[target] for target in targets} - {place[module]}
    return said, edges


def imported(tree: ast.AST, known: set[str]) -> set[str]:
    """Return the modules of ours, called as their folders, that a source imports."""
    inner = tuple(f"discsim.{top}" for top in ("estimators", "validation"))
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module and not node.level:
            origin = node.module.removeprefix("discsim.") if node.module.startswith(inner) else node.module
            for name in (f"{origin}.{alias.name}" for alias in node.names):
                name = name.removeprefix("discsim.") if name in inner else name
                target = name if name in known else origin
                found |= {target} & known
    return found


def floors(edges: Mapping[str, set[str]]) -> dict[str, int]:
    """Return the floor of each room: one above the highest that it imports; rooms that import one another share one."""
    names = sorted(edges)
    matrix = np.array([[other in edges[room] for other in names] for room in names])
    _, group = connected_components(csr_array(matrix), connection="strong")
    level = np.zeros(len(names), dtype=int)
    for _ in names:
        for i, j in np.argwhere(matrix & (group[:, None] != group[None, :])):
            level[group == group[i]] = max(level[i], level[j] + 1)
    return dict(zip(names, level.tolist(), strict=True))


def draw(edges: Mapping[str, set[str]]) -> None:
    """Draw rooms as boxes on their floors, imports as lines down to what is imported."""
    level = floors(edges)
    by_floor = defaultdict(list)
    for room in sorted(level):
        by_floor[level[room]].append(room)
    figure, axes = plt.subplots(figsize=(13, 1.15 * len(by_floor) + 1))
    place = {}
    order: dict[str, float] = {}
    for floor in sorted(by_floor):
        # a room stands above what it imports
        own = sorted(
            by_floor[floor],
            key=lambda room: (sum(order.get(o, 0.5) for o in edges[room]) / max(len(edges[room]), 1), room),
        )
        for k, room in enumerate(own):
            order[room] = (k + 1) / (len(own) + 1)
            place[room] = (order[room], float(floor))
    for room in sorted(edges):
        for other in sorted(edges[room]):
            (x0, y0), (x1, y1) = place[room], place[other]
            axes.plot([x0, x1], [y0 - 0.16, y1 + 0.16], color="0.7", lw=0.6, zorder=1)
    colours = {"discsim": "#cfe3f5", "estimators": "#d9efd2", "validation": "#f7e3c4"}
    for room, (x, y) in place.items():
        label = room.removeprefix("validation.").replace("diagnosis.", "diagnosis.\n") if room != "validation" else room
        axes.text(
            x,
            y,
            label,
            ha="center",
            va="center",
            fontsize=9,
            zorder=2,
            bbox={"boxstyle": "round,pad=0.35", "fc": colours[room.split(".")[0]], "ec": "0.4"},
        )
    axes.set_xlim(0, 1)
    axes.set_ylim(-0.6, max(level.values()) + 0.6)
    axes.axis("off")
    figure.tight_layout()
    figure.savefig(PICTURE, dpi=110)
    plt.close(figure)


def table() -> str:
    """Return the rooms from the ground floor up, what each is and which it imports, as Markdown."""
    said, edges = rooms()
    level = floors(edges)
    lines = ["| room | what it is | imports |", "| --- | --- | --- |"]
    for room in sorted(edges, key=lambda room: (level[room], room)):
        lines.append(
            f"| `{room}` | {said.get(room, '')} | {', '.join(f'`{other}`' for other in sorted(edges[room]))} |"
        )
    return "\n".join(lines)


def main() -> None:
    """Draw the picture and renew the table of the page."""
    _, edges = rooms()
    draw(edges)
    text = PAGE.read_text(encoding="utf-8")
    before, _, rest = text.partition(MARKS[0])
    _, _, after = rest.partition(MARKS[1])
    PAGE.write_text(f"{before}{MARKS[0]}\n\n{table()}\n\n{MARKS[1]}{after}", encoding="utf-8")


if __name__ == "__main__":
    main()
