"""Which encoding a raw file's bytes are in. Takes a path; gives a codec's name, or one sentence why it is no text."""

from __future__ import annotations

import codecs
import re
from pathlib import Path

from discsim.errors import InputError
from discsim.files import BLOCK
from discsim.validation.importing.logs import kind_of
from discsim.validation.importing.sniffing.names import foreign_words

__all__ = ["encoding_of"]

#: First bytes of files that are no tables, and what to do with them.
SIGNATURES = (
    (b"\x89PNG", "a PNG image"),
    (b"\xff\xd8\xff", "a JPEG image"),
    (b"GIF8", "a GIF image"),
    (b"RIFF", "a sound, film or image"),
    (b"%PDF", "a PDF document"),
    (b"PK\x03\x04", "a zip archive or spreadsheet (.xlsx); export it as CSV"),
    (b"\xd0\xcf\x11\xe0", "an old Excel or Word document; export it as CSV"),
    (b"\x1f\x8b", "a gzip archive; unpack it first"),
    (b"\x89HDF", "an HDF5 file; write its tables as CSV"),
    (b"MATLAB 7.3 MAT-file", "a MATLAB file of version 7.3; save it by `save(FILE, '-v7')`, or tables by writetable"),
    (b"SQLite format 3", "an SQLite data base among other files; import that file itself"),
    (b"PAR1", "a Parquet table; write it as CSV (in Python: pandas.read_parquet(FILE).to_csv(OTHER))"),
    (b"ARROW1", "an Arrow table; write it as CSV (in Python: pandas.read_feather(FILE).to_csv(OTHER))"),
    (b"\x80\x04\x95", "a pickle of Python's, which may run anything once it is opened; write its table as CSV"),
    (b"\x80\x05\x95", "a pickle of Python's, which may run anything once it is opened; write its table as CSV"),
    (b"TDSm", "a TDMS file of LabVIEW; write its channels as CSV (in Python: nptdms.TdmsFile(FILE).as_dataframe())"),
    (b"#ROSBAG V2", "a bag of ROS 1; make it an MCAP (`mcap convert FILE OTHER.mcap`)"),
    (b'[{"', "JSON; write it as CSV (in Python: pandas.read_json(FILE).to_csv(OTHER))"),
    (b'{"', "JSON; write it as CSV (in Python: pandas.read_json(FILE, lines=True).to_csv(OTHER))"),
    (b"<?xml", "XML; write its readings as CSV"),
)
_BOMS = (
    (codecs.BOM_UTF8, "utf-8"),
    (codecs.BOM_UTF32_LE, "utf-32"),  # before UTF-16, whose mark it begins with
    (codecs.BOM_UTF32_BE, "utf-32"),
    (codecs.BOM_UTF16_LE, "utf-16"),
    (codecs.BOM_UTF16_BE, "utf-16"),
)
#: Encodings of Windows in Korea, Japan, China and Taiwan, and of Cyrillic.
FOREIGN = ("cp949", "cp932", "gb18030", "big5", "cp1251")
_LOOKED_AT = 1 << 16
#: Zeros that a file system laid out for a log, and that no row was written over before the power went: no encoding of
#: text has so many in a row.
_BLANK = re.compile(rb"\0{16,}")
_CONTROL = frozenset(range(1, 32)) - {9, 10, 12, 13, 27}  # what no text has: not tab, line ends, form feed, escape


def encoding_of(path: Path) -> str:
    """Return the encoding of a text file; raises `InputError` for an empty file and for what is no text.

    A log's text is ASCII but for a few signs (degree, micro, accents of a locale), so no statistics of languages are
    needed: valid UTF-8 is UTF-8 (a Latin-1 text with an accent is not valid). Else it is in the encoding of `FOREIGN`
    under which words for time and sensors stand in it, or in Windows' Latin-1.
    """
    try:
        head, empty = _head_of(path)
    except OSError as error:
        raise InputError.at(path, None, f"cannot be read ({error.strerror}); expected what a logger wrote") from None
    if empty:
        raise InputError.at(path, None, "the file is empty; expected rows of numbers")
    kind = kind_of(path)
    if kind is not None:
        raise InputError.at(path, None, f"is {kind.name} among other files; import that file itself")
    for start, what in SIGNATURES:
        if head.startswith(start):
            raise InputError.at(path, None, f"is {what}; expected text with rows of numbers")
    for mark, encoding in _BOMS:
        if head.startswith(mark):
            return encoding
    head = _BLANK.sub(b"", head)
    if sum(head.count(byte) for byte in _CONTROL) > 0.01 * len(head):  # a damaged line of a text is far below
        raise InputError.at(path, None, "is binary, no text; expected text with rows of numbers")
    if head.count(0):
        return _wide(path, head)
    if _decodes(path, "utf-8"):
        return "utf-8"
    return _foreign(head) or ("cp1252" if _decodes(path, "cp1252") else "latin-1")


def _head_of(path: Path) -> tuple[bytes, bool]:
    """Return the first bytes of a file, and whether nothing but blanks is in it."""
    with path.open("rb") as stream:
        head = piece = stream.read(_LOOKED_AT)
        while piece and not piece.strip():
            piece = stream.read(_LOOKED_AT)
    return head, not piece


def _decodes(path: Path, encoding: str) -> bool:
    decoder = codecs.getincrementaldecoder(encoding)()
    with path.open("rb") as stream:
        try:
            while piece := stream.read(BLOCK):
                decoder.decode(piece)
            decoder.decode(b"", final=True)
        except UnicodeDecodeError:
            return False
    return True


def _foreign(head: bytes) -> str | None:
    """Return the encoding under which most known words of other scripts stand in a text; None where none has two signs.

    One sign may be there by chance. What an encoding cannot read (a damaged line holds some) counts against it.
    """
    found = {}
    for encoding in FOREIGN:
        text = head.decode(encoding, errors="replace")
        found[encoding] = foreign_words(text) - text.count("\ufffd")
    best = max(found, key=lambda encoding: found[encoding])
    return best if found[best] >= 2 else None


def _wide(path: Path, head: bytes) -> str:
    """Return the UTF-16 that has no byte-order mark: of ASCII signs every second byte is zero."""
    even, odd = head[::2], head[1::2]
    if odd.count(0) > 0.9 * len(odd) and not even.count(0):
        return "utf-16-le"
    if even.count(0) > 0.9 * len(even) and not odd.count(0):
        return "utf-16-be"
    if head.count(0) < 0.01 * len(head):  # a block of zeros that a power cut left in a log
        return "utf-8"
    raise InputError.at(path, None, "is binary, no text; expected text with rows of numbers")
