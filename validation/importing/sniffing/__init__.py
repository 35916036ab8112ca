"""Import without a map: what a raw file's text, names and readings say of it (docs/importing.md, docs/your-own-log.md).

`opened` unpacks a zip, `sniff` proposes a map, `map_text` writes it, `recognised` finds a shipped map that was made for
the logger, `several_logs` tells a folder of logs from that of one, `stretches` finds the throws and `write_raw_page`
draws it all.
"""

from discsim.validation.importing.sniffing.archive import opened
from discsim.validation.importing.sniffing.decision import Decision
from discsim.validation.importing.sniffing.proposal import Proposal, map_text
from discsim.validation.importing.sniffing.raw_page import write_raw_page
from discsim.validation.importing.sniffing.recognise import recognised
from discsim.validation.importing.sniffing.several import listed, several_logs
from discsim.validation.importing.sniffing.sniffer import sniff
from discsim.validation.importing.sniffing.stretches import Stretch, stretches

__all__ = [
    "Decision",
    "Proposal",
    "Stretch",
    "listed",
    "map_text",
    "opened",
    "recognised",
    "several_logs",
    "sniff",
    "stretches",
    "write_raw_page",
]
