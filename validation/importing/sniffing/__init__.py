"""Import without a map: what a raw file's text, names and readings say of it (docs/importing.md, docs/your-own-log.md).

`opened` unpacks a zip, `sniff` proposes a map, `map_text` writes it, `recognised` finds a shipped map that was made for
the logger, `stretches` finds the throws and `write_raw_page` draws it all.
"""

from validation.importing.sniffing.archive import opened
from validation.importing.sniffing.decision import Decision
from validation.importing.sniffing.proposal import Proposal, map_text
from validation.importing.sniffing.raw_page import write_raw_page
from validation.importing.sniffing.recognise import recognised
from validation.importing.sniffing.sniffer import sniff
from validation.importing.sniffing.stretches import Stretch, stretches

__all__ = [
    "Decision",
    "Proposal",
    "Stretch",
    "map_text",
    "opened",
    "recognised",
    "sniff",
    "stretches",
    "write_raw_page",
]
