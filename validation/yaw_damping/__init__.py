"""C_Nr from throws: the paper's way (24)-(28), and by output error of the whole model flight."""

from discsim.validation.yaw_damping.compared import SOURCES, Compared, Source, compare_sources
from discsim.validation.yaw_damping.observations import Throw, observe
from discsim.validation.yaw_damping.output_error import Fit, fit_yaw_damping
from discsim.validation.yaw_damping.paper_table import PaperTable, paper_table

__all__ = [
    "SOURCES",
    "Compared",
    "Fit",
    "PaperTable",
    "Source",
    "Throw",
    "compare_sources",
    "fit_yaw_damping",
    "observe",
    "paper_table",
]
