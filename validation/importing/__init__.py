"""Raw logger files to recordings by a map: `find_map`, `read_map`, `import_recording` (docs/importing.md)."""

from discsim.validation.importing.conversion import (
    Imported,
    RawReadings,
    import_recording,
    parse_rows,
    read_readings,
    recording_of,
    repairs_csv,
)
from discsim.validation.importing.import_map import ImportMap, find_map, read_map
from discsim.validation.importing.raw_table import Repair

__all__ = [
    "ImportMap",
    "Imported",
    "RawReadings",
    "Repair",
    "find_map",
    "import_recording",
    "parse_rows",
    "read_map",
    "read_readings",
    "recording_of",
    "repairs_csv",
]
