"""What the pages tell a reader to run is run here as it stands, or says above itself why it is not."""

from __future__ import annotations

import inspect
import os
import re
import runpy
import shlex
import subprocess
import sys
import typing
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path

import pytest

from discsim.validation.cli import main
from discsim.validation.commands import COMMANDS

ROOT = Path(__file__).parents[1]
PAGES = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *sorted((ROOT / "docs").rglob("*.md"))]
WRAP = runpy.run_path(str(ROOT / "docs" / "wrap.py"))
#: pages that a test of their own runs
ELSEWHERE = {
    "your-own-log.md": "tests/validation/commands/test_own_log.py",
    "architecture.md": "tests/test_architecture.py",
}
#: blocks of these kinds are run; others (toml, json, yaml, plain output) are read
KINDS = ("sh", "console", "python")
#: average words of a sentence that a page may have
LONGEST = 25


@dataclass(frozen=True)
class Block:
    """A fenced block: its kind, its text, and the comment on the line above."""

    page: Path
    kind: str
    text: str
    above: str

    @property
    def commands(self) -> list[str]:
        """The commands of the block, continued lines joined, comments left out."""
        text = self.text.replace("\\\n", " ")
        lines = [line.removeprefix("$ ") for line in text.splitlines() if self.kind == "sh" or line.startswith("$ ")]
        said = [(line, shlex.split(line, comments=True)) for line in lines]
        # what is not ours is the shell's: a redirection is no word
        return [shlex.join(words) if words[0] == "discsim" else line for line, words in said if words]


def blocks(page: Path) -> list[Block]:
    text = page.read_text(encoding="utf-8")
    found = re.finditer(r"(?:^<!-- ((?:not )?run[^\n]*?) -->\n)?^```(\w*)\n(.*?)^```", text, re.M | re.S)
    return [Block(page, match[2], match[3], match[1] or "") for match in found]


BLOCKS = [block for page in PAGES for block in blocks(page) if block.kind in KINDS]
RUN = [page for page in PAGES if any(block.above == "run" for block in blocks(page))]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_block_is_run_or_says_why_it_is_not(page):
    if page.name in ELSEWHERE:
        assert (ROOT / ELSEWHERE[page.name]).is_file()
        return
    for block in blocks(page):
        made = ("discsim study ", "python benchmarks/")  # what makes a page has a test, or is measured by hand
        if block.kind in KINDS and not all(line.startswith(made) for line in block.commands or [""]):
            assert re.match(r"^(run|not run: \w.{10,})$", block.above), f"{page.name}: {block.text}"


def options(command: str) -> set[str]:
    """Return the options that a command declares, as typer names them."""
    function = import_module(f"discsim.validation.commands.{COMMANDS[command][0]}").command
    known = {"--help", "-h", "--debug"}
    hints = typing.get_type_hints(function, include_extras=True)
    for name, parameter in inspect.signature(function).parameters.items():
        notes = [*getattr(hints[name], "__metadata__", ()), parameter.default]
        # the first name of an annotated option stands where a default would
        declared = [note.default for note in notes if str(getattr(note, "default", "")).startswith("-")]
        declared += [part for note in notes for part in getattr(note, "param_decls", None) or ()]
        known |= {one for part in declared for one in part.split("/")} or {f"--{name.replace('_', '-')}"}
    return known


@pytest.mark.parametrize("name", [name for name in COMMANDS if name != "study"])
def test_every_command_of_a_page_has_the_options_that_it_shows(name):
    known = options(name)
    shown = [
        words for block in BLOCKS for line in block.commands if (words := shlex.split(line))[:2] == ["discsim", name]
    ]
    for words in shown:
        used = {word.partition("=")[0] for word in words[2:] if word.startswith("-") and not re.match(r"-\d", word)}
        assert used <= known, " ".join(words)


def test_every_command_of_a_page_is_there():
    names = {words[1] for block in BLOCKS for line in block.commands if (words := shlex.split(line))[0] == "discsim"}
    assert {"import", "check", "estimate", "diagnose"} <= names
    assert {name for name in names if not name.startswith("-")} <= set(COMMANDS)


def run_command(command: str, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """Run a command as a reader's shell does, one of discsim in this process; return the lines that it prints."""
    words = shlex.split(command)
    if words[0] != "discsim":
        done = subprocess.run(["bash", "-euc", command], capture_output=True, text=True, check=True)
        return (done.stdout + done.stderr).splitlines()
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", words)
        with pytest.raises(SystemExit) as stop:
            main()
    captured = capsys.readouterr()
    assert not stop.value.code, captured.err
    return [line.rstrip() for line in (captured.err + captured.out).splitlines()]


@pytest.mark.parametrize("page", RUN, ids=lambda page: page.name)
def test_the_blocks_of_a_page_run_in_their_order_and_give_the_lines_that_it_shows(page, tmp_path, monkeypatch, capsys):
    """A line that ends in an ellipsis shows its beginning. Blocks of one page share a folder and their names."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setitem(os.environ, "COLUMNS", "100")
    names: dict[str, object] = {}
    for block in (block for block in blocks(page) if block.above == "run"):
        if block.kind == "python":
            exec(compile(block.text, f"{page.name}", "exec"), names)
            capsys.readouterr()
            continue
        said = [line for command in block.commands for line in run_command(command, capsys)]
        shown = (
            [line for line in block.text.splitlines() if not line.startswith("$ ")] if block.kind == "console" else []
        )
        for line in filter(str.strip, shown):
            start = line.removesuffix("...").rstrip()
            assert any(one == start or (line.endswith("...") and one.startswith(start)) for one in said), line


@pytest.mark.parametrize("page", WRAP["pages"](), ids=lambda page: page.name)
def test_prose_is_wrapped(page):
    text = page.read_text(encoding="utf-8")
    assert WRAP["wrapped"](text) == text, "run: python docs/wrap.py"


def prose(text: str) -> list[str]:
    """Return the sentences of a page's paragraphs and items; tables, code and headings are none."""
    text = re.sub(r"^(```|~~~).*?^\1", "\n", text, flags=re.M | re.S)
    text = re.sub(r"<!--.*?-->", "", text, flags=re.S)
    lines = [("\n" if re.match(r"\s*([-*+]|\d+\.)\s", line) else "") + line for line in text.splitlines()]
    kept = [line for line in lines if not re.match(r"^\s*(\||#|!\[|:::|<|    )", line)]
    paragraphs = re.split(r"\n\s*\n|\n(?=\n?\s*[-*+]\s)", "\n".join(kept))
    return [one for part in paragraphs for one in re.split(r"(?<=[.!?])\s+", " ".join(part.split())) if " " in one]


@pytest.mark.parametrize("page", WRAP["pages"](), ids=lambda page: page.name)
def test_sentences_are_short(page):
    sentences = prose(page.read_text(encoding="utf-8"))
    words = sum(len(sentence.split()) for sentence in sentences)
    assert not sentences or words / len(sentences) < LONGEST
