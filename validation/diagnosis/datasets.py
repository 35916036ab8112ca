"""The data sets of a diagnosis: read, named, and checked to be of one kind."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from discsim.errors import InputError, require_type
from discsim.recording import Recording
from discsim.validation.running.given import read_given

__all__ = ["dataset_names", "need_field", "read_datasets", "recording_names", "recordings_of"]


def read_datasets(
    folders: Sequence[Path], say: Callable[[str], None] = lambda text: None
) -> tuple[list[list[Recording]], list[str]]:
    """Return the recordings of each data set, and the names of the sets; ``say`` as `read_given` has it.

    Raises `InputError` where a folder cannot be read, is given twice, or holds another plant than the others.
    """
    names = dataset_names(folders)
    datasets = [read_given(folder, say) for folder in folders]
    first = datasets[0][0]
    for recording in (recording for dataset in datasets for recording in dataset):
        if recording.plant != first.plant:
            raise InputError(
                f"{recording.path}: is a {recording.plant} recording and {first.path} a {first.plant} one; "
                "expected recordings of one plant (diagnose each plant by itself)"
            )
    return datasets, names


def need_field(datasets: Sequence[Sequence[Recording]]) -> None:
    """Raise `InputError` where a recording has a magnetometer and no magnetic field: nothing can be predicted."""
    for recording in (recording for dataset in datasets for recording in dataset):
        if "magnetometer" in recording and not recording.environment.field_known:
            where = recording.path / "recording.toml" if recording.path is not None else recording.name
            raise InputError(
                f"{where}: [environment] magnetic_field_ned_uT is [0, 0, 0], which stands for not known, and there is "
                "a magnetometer; expected the field of the place: --place LAT,LON --date YYYY-MM-DD looks it up"
            )


def dataset_names(folders: Sequence[Path]) -> list[str]:
    """Return a name for each folder: its own, with its parent's before it where two would be the same."""
    places = [folder.resolve() for folder in folders]
    for place in places:
        if places.count(place) > 1:
            raise InputError(f"{place.name}: given twice; expected each data set once")
    names = [place.name for place in places]
    depth = 1
    while len(set(names)) < len(names):
        depth += 1
        names = ["-".join(place.parts[1:][-depth:]) for place in places]
    return names


def recordings_of(datasets: Sequence[Sequence[Recording]]) -> tuple[Recording, ...]:
    """Return the recordings of all sets; raise `InputError` where there is none, or a set is no list."""
    for dataset in datasets:
        require_type(dataset, Sequence, "one of the data sets", "a list of recordings")
    recordings = tuple(recording for dataset in datasets for recording in dataset)
    if not recordings:
        raise InputError("no recordings were given; expected data sets, each a list of recordings of one plant")
    return recordings


def recording_names(datasets: Sequence[Sequence[Recording]], names: Sequence[str]) -> list[list[str]]:
    """Return what the answer calls each recording: its folder's name, after its set's and a slash if there are several.

    A recording that no folder holds goes by its own name. One whose name is taken has its number in the data set
    behind it.
    """
    several = len(names) > 1
    return [
        [f"{name}/{own}" if several else own for own in _each_its_own([_folder(recording) for recording in dataset])]
        for name, dataset in zip(names, datasets, strict=True)
    ]


def _each_its_own(names: Sequence[str]) -> list[str]:
    """Return names of which no two are the same, with a number behind those that were."""
    found: list[str] = []
    for number, name in enumerate(names, 1):
        own = name
        while own in found or (own != name and own in names):
            own = f"{own}-{number}"
        found.append(own)
    return found


def _folder(recording: Recording) -> str:
    return recording.path.resolve().name if recording.path is not None else recording.name
