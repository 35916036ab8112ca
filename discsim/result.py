"""`Result`: what every result offers a reader of Python, whether it was simulated, estimated or diagnosed."""

from __future__ import annotations

from collections.abc import Mapping
from html import escape
from importlib.util import find_spec
from typing import TYPE_CHECKING, ClassVar

import numpy as np

from discsim.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    import xarray as xr
    from matplotlib.figure import Figure
    from numpy.typing import ArrayLike

__all__ = ["Result", "installed", "require"]


def installed(package: str) -> bool:
    """Tell whether a package is installed."""
    try:
        return find_spec(package) is not None
    except ValueError:  # its module was set to None
        return False


def require(package: str, what: str, extra: str) -> None:
    """Raise `InputError` where an optional package is not installed; ``what`` needs it, ``extra`` brings it."""
    if not installed(package):
        raise InputError(f"{what}: needs {package}, which is not installed; pip install 'discsim[{extra}]'")


class Result:
    """A result: text, a table, labelled arrays and a figure, from the `summary` and `table` of a subclass."""

    #: name of the dimension that the rows of the table go along; a column of that name is its coordinate
    _dimension: ClassVar[str] = "row"

    def summary(self) -> str:
        """Return what a reader must know, a line each."""
        raise NotImplementedError

    def table(self) -> Mapping[str, ArrayLike]:
        """Return columns of equal length by name, units in the names."""
        raise NotImplementedError

    def plot(self) -> Figure:
        """Return a figure of the columns over the first of them."""
        from matplotlib.figure import Figure

        columns = {name: np.asarray(values) for name, values in self.table().items()}
        (across, x), *others = columns.items()
        drawn = [(name, y) for name, y in others if y.dtype.kind in "fiu"]
        figure = Figure(figsize=(9.0, 1.2 + 1.6 * len(drawn)), layout="constrained")
        for axes, (name, y) in zip(
            figure.subplots(len(drawn), 1, sharex=True, squeeze=False)[:, 0], drawn, strict=True
        ):
            axes.plot(x, y, lw=1.0)
            axes.set_ylabel(name)
            axes.grid(color="#dddddd", lw=0.6)
        figure.axes[-1].set_xlabel(across)
        return figure

    def to_dataframe(self) -> pd.DataFrame:
        """Return the table as a `pandas.DataFrame`; raises `InputError` where pandas is not installed."""
        require("pandas", "to_dataframe()", "tables")
        import pandas as pd

        return pd.DataFrame({name: np.asarray(values) for name, values in self.table().items()})

    def to_xarray(self) -> xr.Dataset:
        """Return the table as an `xarray.Dataset`; raises `InputError` where xarray is not installed."""
        require("xarray", "to_xarray()", "tables")
        import xarray as xr

        columns = {name: (self._dimension, np.asarray(values)) for name, values in self.table().items()}
        coordinate = {name: columns.pop(name) for name in [self._dimension] if name in columns}
        return xr.Dataset(columns, coords=coordinate)

    def _repr_html_(self) -> str:
        """Return the summary as a notebook shows it."""
        return f"<pre>{escape(self.summary())}</pre>"
