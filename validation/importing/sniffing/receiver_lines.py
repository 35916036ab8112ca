"""Sentences of a satellite receiver (NMEA) between the lines of a log, as firmware that passes them on prints them.

Takes a text; gives a folder of its own lines and of the sentences: a log, and a receiver's track beside it.
"""

from __future__ import annotations

import re
from pathlib import Path

from discsim.errors import InputError
from discsim.validation.importing.logs import nmea
from discsim.validation.importing.sniffing.other_forms.written import FEWEST, first_lines

__all__ = ["between", "parted"]

#: A sentence with its checksum, whatever a terminal has put before it.
_SENTENCE = re.compile(r"\$[A-Z]{2}(?:" + "|".join(nmea.SENTENCES) + r"),[ -#%-)+-~]*\*[0-9A-Fa-f]{2}\s*$")


def between(raw: Path) -> bool:
    """Tell a text some of whose first lines are sentences of a receiver, and more are others."""
    _, lines = first_lines(raw)
    lines = [line for line in lines if line.strip()]
    sentences = sum(_SENTENCE.search(line) is not None for line in lines)
    return FEWEST <= sentences < len(lines) - FEWEST and not nmea.begins("\n".join(lines).encode())


def parted(raw: Path, folder: Path) -> list[str]:
    """Write a text's own lines and the sentences between them as two files in ``folder``, and return what to say.

    A line of the log is not moved: where a sentence stood an empty one stands, which keeps line numbers. Raises
    `InputError` where the file cannot be read.
    """
    encoding, _ = first_lines(raw)
    count = 0
    try:
        with (
            raw.open(encoding=encoding, errors="replace") as lines,
            (folder / raw.name).open("w", encoding="utf-8") as log,
            (folder / f"{raw.stem}.nmea").open("w", encoding="utf-8") as track,
        ):
            for line in lines:
                found = _SENTENCE.search(line)
                if found is None:
                    log.write(line)
                else:
                    track.write(f"{found[0].strip()}\n")
                    log.write("\n")
                    count += 1
    except OSError as error:
        raise InputError.at(raw, None, f"cannot be read ({error}); expected lines of text") from None
    return [f"{raw.name}: {count} sentences of a satellite receiver (NMEA) stand between its lines; read apart"]
