"""The measured sources: what each is, whose it is, which spans are looked at, and against what."""

from __future__ import annotations

import csv
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal, TypeAlias

import numpy as np
import typer

from discsim.arrays import FloatArray
from discsim.errors import InputError
from discsim.estimators.fft import FftSettings
from discsim.estimators.gyroscope import gyroscope
from discsim.estimators.rate import YawRate
from discsim.recording import Recording, Samples
from discsim.validation.importing import find_map, import_recording, read_map
from discsim.validation.studies.real_recordings.optical import optical_rate

__all__ = ["SOURCES", "Cut", "Measured", "RecordingsOption", "Source", "find_recordings", "load", "raw_columns"]


@dataclass(frozen=True)
class Cut:
    """A stretch of one log.

    Attributes
    ----------
    label : str
        What the page calls it.
    raw : str
        File below the source's folder; empty for the folder itself.
    map : str
        Shipped import map.
    rows : slice or None
        Data rows to read, as `discsim import --rows`; None reads all.
    span : (float, float) or None
        Seconds on the log's own clock over which methods are compared; None compares over all that is read.
    """

    label: str
    raw: str
    map: str
    rows: slice | None = None
    span: tuple[float, float] | None = None


@dataclass(frozen=True)
class Source:
    """A measured source.

    Attributes
    ----------
    key, folder, title, about, terms : str
        Name of the figure's file, folder of the raw files, and the page's words.
    reference : {"gyroscope", "optical", "none"}
        What the methods are held against.
    cuts : sequence of Cut
        Recordings of it.
    clock : (str, str) or None
        File and column whose first number is the log's time at the import's time zero; None where that is 0.
    lowered : FftSettings or None
        A second set of options of `fft`, where the paper's look for faster spins than this source has.
    steady : bool
        True where one axis spins for many samples: methods beside the paper's are tried too.
    slow : bool
        True where a turn takes so long that the field's phase is worth following itself.
    """

    key: str
    folder: str
    title: str
    about: str
    terms: str
    reference: Literal["gyroscope", "optical", "none"]
    cuts: Sequence[Cut]
    clock: tuple[str, str] | None = None
    lowered: FftSettings | None = None
    steady: bool = False
    slow: bool = False


@dataclass(frozen=True)
class Measured:
    """A loaded cut: the whole log, the span that is compared, and the reference's rate over the whole log.

    ``vector`` is the reference's body rate, (n, 3) rad/s at ``reference.t``.
    """

    cut: Cut
    whole: Recording
    recording: Recording
    reference: YawRate | None
    vector: FloatArray | None


def _settings(window: int, threshold_deg_s: float) -> FftSettings:
    return FftSettings(window, 2**14 - window, float(np.radians(threshold_deg_s)), remove_mean=True)


SOURCES = (
    Source(
        key="flatball",
        folder="flatball-ins-ultimate-disc",
        title="An instrumented 175 g Ultimate disc, four throws",
        about=(
            "A Discraft Ultra-Star with magnetometer (MMC5983MA), gyroscope to 4000 deg/s and accelerometer to 16 g "
            "(ISM330DHCX), thrown outdoors on 2025-08-31. No time column, no video, no GPS: the sensors' mutual "
            "consistency is the only truth. The source's software takes every row as 10 ms, and so does the import."
        ),
        terms=(
            "`misc-protolabs/flatball-ins`. Attribution: Flatball INS, Copyright 2025 Michael V. Schaefer. Flight logs "
            "under Creative Commons Attribution (the source names no version)."
        ),
        reference="gyroscope",
        cuts=(
            Cut("001-rb, right-hand backhand", "2025-08-31-001-rb.csv", "flatball", slice(1590, 1830)),
            Cut("003-rf, right-hand forehand", "2025-08-31-003-rf.csv", "flatball", slice(860, 1125)),
            Cut("004-rf, right-hand forehand", "2025-08-31-004-rf.csv", "flatball", slice(680, 908)),
            Cut("005-rh, hammer (upside down)", "2025-08-31-005-rh.csv", "flatball", slice(735, 988)),
        ),
        steady=True,
    ),
    Source(
        key="aris-euler",
        folder="cats-euroc21-aris-euler-rocket",
        title="The rocket Aris Euler under its parachute",
        about=(
            "CATS flight computer at EuRoC 2021: two equal IMUs (ICM20601) and a magnetometer (MMC5983MA) on one "
            "clock. Between 9.8 and 14.4 s after lift-off it spins steadily under the parachute. Where the "
            "accelerometers sit is not stated."
        ),
        terms=(
            "`catsystems/euroc21-team-data`, GPL-3.0. The data are described here, nothing of them is copied into this "
            "project."
        ),
        reference="gyroscope",
        cuts=(
            Cut("Euler, IMU 0", "", "cats", span=(9.8, 14.4)),
            Cut("Euler, IMU 1", "", "cats_imu1", span=(9.8, 14.4)),
        ),
        clock=("imu.csv", "ts"),
        lowered=_settings(256, 180.0),
        steady=True,
        slow=True,
    ),
    Source(
        key="srp",
        folder="srp-sa-rocket",
        title="The SRP rocket, whose roll dies out",
        about=(
            "A small rocket with an AltIMU-10 v5 (LSM6DS33, LIS3MDL) on a Raspberry Pi. Compared over 10.5 s of its "
            "ascent, in which the roll decays; times are those of the log's last 90 s. Where the accelerometer sits is "
            "not stated."
        ),
        terms="`eckp/SRP_SA`, MIT, Copyright (c) 2019 eckp.",
        reference="gyroscope",
        cuts=(Cut("SRP, ascent", "", "srp", span=(59.0, 69.5)),),
        lowered=_settings(64, 30.0),
        steady=True,
        slow=True,
    ),
    Source(
        key="broad",
        folder="broad-mocap-rotation",
        title="BROAD: turned by hand under motion capture",
        about=(
            "An IMU turned by hand while eight cameras measured its attitude; 30 s each of trial 07 (fast rotation) "
            "and trial 32 (a magnet 1 cm from the sensor). Truth: the optical attitude, differentiated here. The axis "
            "wanders: nothing spins steadily about z, and no method for a spinning body has what it assumes."
        ),
        terms=(
            "Berlin Robust Orientation Estimation Assessment Dataset, CC BY 4.0: D. Laidig, M. Caruso, A. Cereatti, "
            "T. Seel, Data 6(7):72 (2021), doi 10.3390/data6070072. Changed: 30 s cut out of each trial."
        ),
        reference="optical",
        cuts=(
            Cut("trial 07, fast rotation", "07_undisturbed_fast_rotation_B_30s.csv", "broad"),
            Cut("trial 32, magnet attached", "32_disturbed_attached_magnet_1cm_30s.csv", "broad"),
        ),
        lowered=_settings(128, 300.0),
    ),
    Source(
        key="lynx",
        folder="cats-euroc21-skyward-lynx-rocket",
        title="The rocket SkywardER Lynx, magnetometer only",
        about=(
            "Deathstack computer (BMX160) at EuRoC 2021. Rolls during the ascent, 1 to 22 s after lift-off, and swings "
            "under parachutes from 22.8 s on. Its gyroscope's log is not among the files: there is no truth."
        ),
        terms=(
            "`catsystems/euroc21-team-data`, GPL-3.0. The data are described here, nothing of them is copied into this "
            "project."
        ),
        reference="none",
        cuts=(Cut("Lynx, ascent", "", "lynx", span=(1.0, 22.0)),),
        clock=("imu_compass.csv", "time"),
        lowered=_settings(256, 90.0),
        slow=True,
    ),
    Source(
        key="phyphox",
        folder="ubsuny-phyphox-roller",
        title="A phone on an exercise wheel",
        about="A phyphox export, gyroscope alone: spun up by hand (z_acc), and driven round a circle (z_cir).",
        terms="`ubsuny/data-analysis-final20`, MIT, Copyright (c) 2020 University at Buffalo.",
        reference="gyroscope",
        cuts=(Cut("phyphox, z_acc", "z_acc.csv", "phyphox"), Cut("phyphox, z_cir", "z_cir.csv", "phyphox")),
    ),
)


RecordingsOption: TypeAlias = Annotated[
    Path | None,
    typer.Option(
        "--recordings",
        help="Folder of recordings with 'real' in it. Default: DISCSIM_RECORDINGS, or beside the checkout.",
    ),
]


def find_recordings(chosen: Path | None = None) -> Path:
    """Return the folder of the measured sources.

    It is ``real`` in ``chosen``, else in DISCSIM_RECORDINGS, else in ``../shared/recordings`` beside the checkout.
    Raises `InputError` where it is not there.
    """
    beside = Path(__file__).resolve().parents[4] / "shared" / "recordings"
    folder = chosen or Path(os.environ.get("DISCSIM_RECORDINGS") or beside)
    if not (folder / "real").is_dir():
        raise InputError.at(folder, None, "no folder 'real' in it; expected the recordings (--recordings DIR)")
    return folder / "real"


def raw_columns(path: Path, names: Sequence[str]) -> FloatArray:
    """Return columns of a plain CSV file, (n, k); raises `InputError` if it cannot be read or one is not there."""
    try:
        with path.open(encoding="utf-8", newline="") as stream:
            return np.array([[float(row[name]) for name in names] for row in csv.DictReader(stream)])
    except (OSError, KeyError, ValueError) as error:
        raise InputError.at(path, None, f"{error}; expected numbers in the columns {', '.join(names)}") from None


def load(source: Source, cut: Cut, real: Path) -> Measured:
    """Import one cut with the times of its log; raises `InputError` as the import does."""
    folder = real / source.folder
    raw = folder / cut.raw
    whole = import_recording(raw, read_map(find_map(cut.map)), cut.rows).recording
    if source.clock is not None:
        file, column = source.clock
        zero = float(raw_columns(folder / file, [column])[0, 0])
        moved = {name: Samples(one.t + zero, one.value) for name, one in whole.samples.items()}
        whole = replace(whole, samples=moved)
    recording = whole
    if cut.span is not None:
        start, stop = cut.span
        recording = replace(whole, samples={name: one.between(start, stop) for name, one in whole.samples.items()})
    reference, vector = _reference(source, whole, raw)
    return Measured(cut, whole, recording, reference, vector)


def _reference(source: Source, whole: Recording, raw: Path) -> tuple[YawRate | None, FloatArray | None]:
    if source.reference == "gyroscope":
        samples = whole.need("gyroscope")
        return gyroscope(samples, whole.sheets["gyroscope"]), samples.value
    if source.reference == "optical":
        attitude = raw_columns(raw, ["opt_qw", "opt_qx", "opt_qy", "opt_qz"])
        t = whole.need("gyroscope").t
        if len(attitude) != t.size:
            raise InputError.at(raw, None, f"{len(attitude)} optical attitudes for {t.size} rows; expected one each")
        vector, sd = optical_rate(t, attitude)
        return YawRate("optical", t, vector[:, 2], sd, signed=True), vector
    return None, None
