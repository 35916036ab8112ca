"""Spin rate from plain arrays, where a recording would be too much."""

from __future__ import annotations

from types import NoneType

from numpy.typing import ArrayLike

from discsim.arrays import real
from discsim.errors import InputError, require_type
from discsim.estimators import fft as of_samples
from discsim.estimators.fft import FftSettings
from discsim.estimators.rate import YawRate
from discsim.recording import Samples

__all__ = ["fft"]


def fft(t: ArrayLike, xyz: ArrayLike, settings: FftSettings | None = None) -> YawRate:
    """Spin rate from a magnetometer's readings by the paper's moving, zero-padded FFT, (P-1) to (P-7).

    Parameters
    ----------
    t : (n,) array
        Times, s, ascending.
    xyz : (n, 3) array
        Readings in body axes, in any unit; z is the axis of spin. NaN is a gap.
    settings : FftSettings, optional
        Window, padding, threshold; the paper's by default. The lowest rate looked for is 500 deg/s.

    Returns
    -------
    YawRate
        Magnitude of the rate, rad/s, at the centre of each window, with its standard deviation; NaN where the data
        cannot tell (see `discsim.estimators.fft.fft`).

    Raises
    ------
    InputError
        For arrays of other shapes, or times that do not ascend.

    Examples
    --------
    >>> import numpy as np
    >>> t = np.arange(0, 2, 0.01)
    >>> field = 40 * np.column_stack([np.cos(30 * t), -np.sin(30 * t), 0 * t])
    >>> round(float(np.median(fft(t, field).rate)))
    30
    """
    require_type(settings, (FftSettings, NoneType), "settings", "FftSettings(...), or nothing for the paper's")
    try:
        samples = Samples(real(t), real(xyz))
    except (ValueError, TypeError) as error:
        raise InputError(f"fft: {error}") from None
    if samples.value.shape[1:] != (3,):
        raise InputError(f"fft: got readings {samples.value.shape}, expected (n, 3): x, y and z of a magnetometer")
    return of_samples(samples, settings)
