"""What takes a second a case: C_Nr fits, diagnoses, sweeps, and the files of their results."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Mapping
from dataclasses import replace
from functools import cache
from html.parser import HTMLParser
from pathlib import Path
from types import MappingProxyType

import numpy as np
from support import made

from discsim.recording import Recording, read_recording, write_recording
from discsim.sensors import Instruments
from discsim.validation.diagnosis.diagnosed import diagnose_recordings
from discsim.validation.estimating.rate_files import read_rates, read_truth
from discsim.validation.estimating.scored import score_rates
from discsim.validation.reporting.run import json_text
from discsim.validation.sweeps.plan import read_plan
from discsim.validation.sweeps.swept import sweep
from discsim.validation.yaw_damping.fitted import fit_recordings

from .judge import possible

__all__ = ["RATES", "SETS", "SWEEPS", "diagnose", "fit", "score", "swept"]

Files = Mapping[str, str]

#: tags that pages consist of; what a recording is called adds none
_TAGS_OF_NONE = ("iframe", "object", "embed", "link", "base", "form")


def _set(plant: str) -> Recording:
    """Return one short recording of a plant, from MuJoCo."""
    if plant == "rate_table":
        return made.tables()[0]
    if plant == "spin_down":
        return made.coasts(seconds=2.0)[0]
    if plant == "free_spin":
        spin = made.throws(seconds=1.0, plant="free_spin", module=Instruments.from_parts("mpu9250"))[0]
        return replace(spin, disc=made.DRIVER)
    return made.throws(seconds=1.0)[0]


@cache
def _files(plant: str) -> Files:
    with tempfile.TemporaryDirectory() as place:
        write_recording(_set(plant), Path(place) / "one")
        return MappingProxyType(
            {file.name: file.read_text(encoding="utf-8") for file in sorted((Path(place) / "one").iterdir())}
        )


#: the files of a recording of each plant, a second or three long
SETS: Mapping[str, Callable[[], Files]] = MappingProxyType(
    {
        plant: lambda plant=plant: _files(plant)  # type: ignore[misc]
        for plant in ("flight", "rate_table", "spin_down", "free_spin")
    }
)


class _Page(HTMLParser):
    """Looks for what a page of ours does not have: a foreign element, or a handler of events within a tag."""

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        possible(tag not in _TAGS_OF_NONE, f"a <{tag}> in a page")
        possible(not any(name.startswith("on") for name, _ in attrs), f"a handler in <{tag}>")


def _sound_files(out: Path) -> None:
    """Every file of a result is whole: JSON and pages that can be read, and no name from an input among their names."""
    for file in out.rglob("*"):
        possible(not file.name.startswith("."), f"{file.name} is left over")
        if file.suffix == ".html":
            text = file.read_text(encoding="utf-8")
            _Page().feed(text)
            possible(text.count("<script") == text.count("</script>") <= 2, "a foreign script in a page")


def fit(folder: Path) -> None:
    """Fit C_Nr to one throw and write the result; C_Nr of no disc is beyond 1000, and its sd is above zero."""
    found = fit_recordings(read_recording(folder), compare=True)
    possible(bool(np.isfinite(found.CNr)) and abs(found.CNr) < 1e3, f"CNr = {found.CNr}")
    possible(bool(np.isfinite(found.sd)) and found.sd > 0.0, f"CNr with an sd of {found.sd}")
    json_text(found.to_json())
    found.report(folder / "out")
    _sound_files(folder / "out")


def diagnose(folder: Path) -> None:
    """Diagnose one recording and write the report; what is named has finite sizes."""
    found = diagnose_recordings(read_recording(folder))
    possible(found.verdict in ("consistent", "recalibrated", "explained", "unexplained"), found.verdict)
    for effect in found.effects:
        for name, item in effect.parameters.items():
            possible(bool(np.isfinite(item.value)), f"{effect.id}: {name} = {item.value}")
            possible(item.sd is None or bool(item.sd >= 0.0), f"{effect.id}: {name} with an sd of {item.sd}")
    for name, moved in found.diagnosis.recalibrated.items():
        possible(bool(np.all(np.isfinite(moved.value))), f"{name} recalibrated to {moved.value}")
    json_text(found.diagnosis.to_json())
    found.report(folder / "out")
    _sound_files(folder / "out")


_SWEEP = """\
name = "seed"
seed = 3
drawn = true
fft_step = 64

[truth]
plant = "rate_table"
rates_deg_s = [0.0, 1500.0]
hold_s = 2.0
ramp_s = 0.5

[axes]
dip_deg = [0.0, 60.0]

[mounts]
design = "random"
count = 4
x_m = [-0.001, 0.001]
about_x_deg = [-3.0, 3.0]

[estimators]
accelerometer = "all"
fft = 1
"""
SWEEPS: Mapping[str, Callable[[], Files]] = MappingProxyType({"small": lambda: {"plan.toml": _SWEEP}})


def swept(folder: Path) -> None:
    """Work through a plan of few mounts in this process and report it; a share is between nothing and all."""
    plan = read_plan(folder / "plan.toml")
    if plan.mounts.count * len(plan.cases) > 300:  # a large sweep is no fault, and takes its time
        return
    found = sweep(plan, workers=1)
    known = found.scores.known.values
    possible(bool(np.all(np.isnan(known) | ((known >= 0.0) & (known <= 1.0)))), "a share beyond 1")
    for name in ("bias_deg_s", "rms_deg_s", "worst_deg_s"):
        possible(not np.any(np.isinf(found.scores[name].values)), f"{name} is infinite")
    found.report(folder / "out")
    _sound_files(folder / "out")


RATES: Mapping[str, Callable[[], Files]] = MappingProxyType(
    {
        "rates": lambda: {
            "rates.csv": "\n".join(
                ["time_s,method,rate_rad_s,sd_rad_s"]
                + [f"{k / 50},gyroscope,{70 - k / 50:.4f},0.01" for k in range(60)]
                + [f"{k / 50},fft,{70.1 - k / 50:.4f},0.1" for k in range(60)]
                + [""]
            ),
            "truth.csv": "\n".join(["time_s,rate_rad_s", *(f"{k / 40},{70 - k / 40:.4f}" for k in range(50)), ""]),
        }
    }
)


def score(folder: Path) -> None:
    """Score rates against a truth, and write the answer; nothing is later than all of the truth is long."""
    truth = read_truth(folder / "truth.csv")
    found = score_rates(read_rates(folder / "rates.csv"), truth)
    json_text(found.to_json())
    span = float(truth.t[-1] - truth.t[0])
    for one in found.errors:
        possible(bool(np.isnan(one.delay)) or abs(one.delay) <= span, f"a delay of {one.delay:g} s within {span:g} s")
