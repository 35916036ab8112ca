"""What the diagnosis leaves of measured throws of an instrumented disc, and what it costs.

Run: ``python benchmarks/disc_throws.py FILE...`` with logs of one logger that has a shipped map
(docs/real-recordings.md says where such files are). The first throw of each is brought in by ``discsim import``, all
are diagnosed in one call, and what each keeps of each sensor with the numbers of the others is printed: what the
baseline leaves, what the effects leave, and the pure error of its rows, in uT, deg/s and m/s^2, with the CPU seconds.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from math import degrees
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent.parent))  # a file beside this one is called estimators too

from discsim.recording import read_recording
from discsim.threads import limited
from discsim.validation.diagnosis.pipeline import diagnose


def main(files: list[str]) -> None:
    """Bring in the files' first throws, diagnose them together, and print what is left."""
    with tempfile.TemporaryDirectory() as folder:
        made = []
        for file in files:
            made.append(Path(folder) / Path(file).stem)
            words = ["import", "--throw", "1", file, "--out", str(made[-1])]
            subprocess.run([sys.executable, "-m", "discsim.validation.cli", *words], check=True, capture_output=True)
        recordings = [read_recording(path) for path in made]
    start = time.process_time()
    with limited():
        found = diagnose([recordings], ["throws"]).diagnosis
    print(
        f"{found.verdict}: {', '.join(effect.id for effect in found.effects)}; {time.process_time() - start:.0f} CPU-s"
    )
    print(f"chi2 per reading {found.baseline.chi2_per_sample:.4g} to {found.final.chi2_per_sample:.3g}")
    for one in found.leftovers:
        sizes = [one.baseline, one.left, float("nan") if one.pure is None else one.pure]
        if one.sensor == "gyroscope":
            sizes = [degrees(size) for size in sizes]
        print(f"{one.recording:24} {one.sensor:14}", *(f"{size:8.3f}" for size in sizes))


if __name__ == "__main__":
    if not sys.argv[1:]:
        raise SystemExit("no log was given; expected: python benchmarks/disc_throws.py FILE...")
    main(sys.argv[1:])
