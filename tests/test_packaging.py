"""What users are told to run is what CI runs, and everything that a wheel needs is declared."""

from __future__ import annotations

import re
import runpy
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import pytest

ROOT = Path(__file__).parents[1]
README = (ROOT / "README.md").read_text(encoding="utf-8")
CI = (ROOT / ".ci" / "run").read_text(encoding="utf-8")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
#: what lies in discsim/ as links of a checkout, and as folders of an installation
LINKS = ("/discsim/estimators", "/discsim/validation")


def shell_lines(text: str) -> list[str]:
    """Return the lines of a Markdown text's shell blocks."""
    blocks = re.findall(r"^```sh\n(.*?)^```", text, re.M | re.S)
    return [line for block in blocks for line in block.splitlines() if line]


@pytest.mark.parametrize("job", ["pytest", "discsim validate"])
def test_ci_runs_the_readmes_own_line(job):
    done = subprocess.run([ROOT / ".ci" / "readme-line", job], capture_output=True, text=True, check=True)
    line = done.stdout.rstrip("\n")
    assert shell_lines(README).count(line) == 1
    assert line.startswith("python3 -m venv .venv && .venv/bin/pip install ")
    assert line.endswith(f" && .venv/bin/{job}")
    assert re.search(rf'^\w+=\$\(\.ci/readme-line "?{job}"?\)$', CI, re.M)


def test_ci_runs_both_lines_that_it_takes_from_the_readme():
    assert 'bash -c "$test_line"\n' in CI
    assert 'bash -c "$main_line --quick"\n' in CI


def test_a_line_that_the_readme_lacks_is_an_error():
    done = subprocess.run([ROOT / ".ci" / "readme-line", "make"], capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "expected exactly one line of README.md" in done.stderr


def test_the_workflow_runs_ci_and_the_same_tests():
    workflow = (ROOT / ".github" / "workflows" / "ci.yml").read_text(encoding="utf-8")
    assert "- run: .ci/run\n" in workflow
    assert '- run: bash -c "$(.ci/readme-line pytest)"\n' in workflow


def test_the_lowest_versions_are_those_of_all_that_the_package_uses_and_of_no_tool():
    done = subprocess.run([sys.executable, ROOT / ".ci" / "lowest"], capture_output=True, text=True, check=True)
    used = [*PROJECT["project"]["dependencies"]]
    for extra in set(PROJECT["project"]["optional-dependencies"]) - {"test", "docs", "dev"}:
        used += PROJECT["project"]["optional-dependencies"][extra]
    assert sorted(done.stdout.splitlines()) == sorted(re.sub(r">=([\d.]+).*", r"==\1", line) for line in used)


def test_the_wheel_holds_every_package_and_the_models():
    wheel = PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]
    packages = sorted(path.parent.name for path in ROOT.glob("*/__init__.py") if path.parent.name != "tests")
    assert sorted(wheel["packages"]) == packages
    assert wheel["sources"] == {link.rpartition("/")[2]: link[1:] for link in LINKS}
    for link in LINKS:
        assert (ROOT / link[1:]).resolve() == ROOT.resolve() / link.rpartition("/")[2]
        assert {link} <= set(wheel["exclude"]) & set(PROJECT["tool"]["hatch"]["build"]["targets"]["sdist"]["exclude"])
    assert wheel["force-include"] == {"models": "discsim/models", "docs/glossary.md": "discsim/glossary.md"}
    for package in packages:
        assert (ROOT / package / "py.typed").exists()


def test_what_leaves_the_wheel_is_imported_by_nothing_that_stays():
    left = [
        folder for folder in PROJECT["tool"]["hatch"]["build"]["targets"]["wheel"]["exclude"] if folder not in LINKS
    ]
    assert all((ROOT / folder / "__init__.py").is_file() for folder in left)
    names = [f"discsim.{folder}".replace("/", ".") for folder in left]
    for package in ("discsim", "estimators", "validation"):
        for source in (ROOT / package).rglob("*.py"):
            if not any((ROOT / folder) in source.parents for folder in left):
                text = source.read_text(encoding="utf-8")
                found = [name for name in names if re.search(rf"^\s*(from|import) {re.escape(name)}\b", text, re.M)]
                assert not found, source


def test_the_package_says_whose_it_is_under_which_licence_and_how_to_cite_it():
    project = PROJECT["project"]
    assert project["license"] == "Apache-2.0"
    assert "Apache License" in (ROOT / project["license-files"][0]).read_text(encoding="utf-8")
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    assert f"version: {project['version']}\n" in citation
    assert "doi: 10.3390/s18103564\n" in citation
    assert f"## {project['version']}" in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    assert "docs/architecture.md" in (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")


def built(root: Path, monkeypatch: pytest.MonkeyPatch, version: str = "standard") -> dict[str, str]:
    """Return what the build hook adds to a build of a folder, by its place there: the text of the file."""
    interface = ModuleType("hatchling.builders.hooks.plugin.interface")
    interface.BuildHookInterface = object
    monkeypatch.setitem(sys.modules, interface.__name__, interface)
    hook = runpy.run_path(str(ROOT / "hatch_build.py"))["CommitHook"]()
    hook.root, data = str(root), {"force_include": {}}
    hook.initialize(version, data)
    return {place: Path(file).read_text(encoding="utf-8") for file, place in data["force_include"].items()}


def test_a_build_holds_the_commit_that_it_was_made_from(tmp_path, monkeypatch):
    (tmp_path / "discsim").mkdir()
    shutil.copy(ROOT / "discsim" / "version.py", tmp_path / "discsim")
    assert built(tmp_path, monkeypatch) == {}  # no history, as in an archive of the sources
    git = ["git", "-C", str(tmp_path), "-c", "user.name=a", "-c", "user.email=a@b"]
    for words in (["init", "-q"], ["add", "."], ["commit", "-qm", "first"]):
        subprocess.run([*git, *words], check=True)
    head = subprocess.run([*git, "rev-parse", "--short=12", "HEAD"], capture_output=True, text=True, check=True).stdout
    assert built(tmp_path, monkeypatch) == {"discsim/commit.txt": head}
    assert built(tmp_path, monkeypatch, "editable") == {}
    (tmp_path / "discsim" / "commit.txt").write_text(head)  # in an sdist, which holds it already
    assert built(tmp_path, monkeypatch) == {}
    assert runpy.run_path(str(tmp_path / "discsim" / "version.py"))["commit"]() == head.strip()


def test_the_build_hook_is_told_of_and_goes_with_the_sources():
    build = PROJECT["tool"]["hatch"]["build"]
    assert "custom" in build["hooks"]
    assert "hatch_build.py" in build["targets"]["sdist"]["only-include"]
