"""Check an installed wheel: every package imports and every shipped file is there, without a checkout.

Run by the interpreter that has the wheel, in a folder that has no sources: ``python -I - < .ci/try_wheel.py``.
"""

from __future__ import annotations

import pkgutil
import sys
import tomllib
from importlib import import_module
from importlib.metadata import distribution
from pathlib import Path

import mujoco

import discsim
from discsim.files import model_file, model_names

installed = Path(discsim.__file__).parent
assert "site-packages" in installed.parts, f"discsim comes from {installed}, expected site-packages"

modules = 0
for module in pkgutil.walk_packages(discsim.__path__, "discsim."):
    import_module(module.name)
    modules += 1
assert {"discsim.estimators.rate", "discsim.validation.cli"} <= set(sys.modules)
taken = {file.parts[0] for file in distribution("discsim").files or () if file.suffix == ".py"}
assert taken == {"discsim"}, f"top-level names taken: {sorted(taken)}"

names = {folder: model_names(folder) for folder in ("discs", "parts", "sites", "throws", "imports")}
for folder, found in names.items():
    assert found, f"no files in models/{folder}"
    for name in found:
        file = model_file(f"{folder}/{name}.toml")
        assert installed in file.parents, f"{file} is not in the installed package"
        tomllib.loads(file.read_text(encoding="utf-8"))
for name in ("disc.xml", "rate_table.xml"):
    mujoco.MjModel.from_xml_path(str(model_file(name)))

print(f"wheel: {modules} modules import, {sum(map(len, names.values()))} parameter files and 2 MuJoCo models found")
