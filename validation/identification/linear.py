"""What a linearisation of a recording is: residuals, and their sensitivities to nuisance and common unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from discsim.arrays import FloatArray, IntArray

__all__ = ["Channel", "Linear"]


@dataclass(frozen=True)
class Channel:
    """One axis of one sensor in a linearisation: where its rows are, and their place among the sensor's samples.

    A row is worth as many independent samples as ``worth`` says: more than one where it is a mean.
    """

    sensor: str
    axis: str
    group: str
    rows: slice
    index: IntArray
    worth: float = 1.0


@dataclass(frozen=True)
class Linear:
    """Residuals of a recording and how they depend on its unknowns: ``residual - J du``.

    The unknowns are the local ones, the first state and the allowed continuity defects (l,), and the shared ones (p,).
    Each row is kept by the state of its own segment (compact); `nuisance` and `common` trajectory the segments on
    demand.

    Attributes
    ----------
    raw : (n,) array
        Measured minus predicted where the trajectory stands, rows by channel.
    own : (n, d + p) array
        Derivatives of the prediction by the state of the row's segment and by the parameters within it.
    segment : (n,) int array
        The segment of each row; -1 for a reading that hangs on several, as with a lag or where it is a mean.
    whole : (m, l + p) array
        Derivatives of those by the unknowns themselves, in their order.
    t, sd : (n,) arrays
        Written times, stated noise.
    channels : tuple of Channel
    defect, defect_kind, defect_segment : (l,) arrays
        Current size of each allowed continuity defect, its direction within the state (-1 for the first state) and its
        segment.
    sensitivities : (k, d, l + p) array
        How the states of the segments follow the unknowns.
    transitions : (k - 1, d, d + p) array
        How the state of each next segment follows that of the one before and the shared parameters.
    matching : (k, d) array
        How they move to close the defects that are not allowed.
    mismatch : (k - 1, d) array
        All defects as they stand.
    shifts : (n,) array
        What the closing adds to the prediction.
    counted : bool
        Whether instants were counted one by one: what is left then is more than noise.
    """

    raw: FloatArray
    own: FloatArray
    segment: IntArray
    whole: FloatArray
    t: FloatArray
    sd: FloatArray
    channels: tuple[Channel, ...]
    defect: FloatArray
    defect_kind: IntArray
    defect_segment: IntArray
    sensitivities: FloatArray
    transitions: FloatArray
    matching: FloatArray
    mismatch: FloatArray
    shifts: FloatArray
    counted: bool = False

    @property
    def unknowns(self) -> int:
        """Number of local unknowns, l."""
        return self.defect.size

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted (n,) once the defects that are not allowed are closed."""
        return self.raw - self.shifts

    @property
    def full(self) -> FloatArray:
        """Derivatives of the prediction (n, l + p) by all unknowns.

        They are worked out each time: kept for every recording they would be most of what a fit holds in memory.
        """
        d, width = self.sensitivities.shape[1:]
        # zero also where a reading hangs on several segments: numbers that happen to stand there may add to NaN
        full = np.zeros((self.raw.size, width))
        for i in range(self.sensitivities.shape[0]):
            rows = np.flatnonzero(self.segment == i)
            full[rows] = self.own[rows, :d] @ self.sensitivities[i]
        full[:, self.unknowns :] += self.own[:, d:]
        if self.whole.size:
            full[self.segment < 0] = self.whole
        return full

    @property
    def acting(self) -> IntArray:
        """The shared columns (a,) that say anything of this recording."""
        d, u = self.sensitivities.shape[1], self.unknowns
        parts = [self.own[:, d:], self.transitions[..., d:], *([self.whole[:, u:]] if self.whole.size else [])]
        return np.flatnonzero(np.any([np.any(part != 0.0, axis=tuple(range(part.ndim - 1))) for part in parts], axis=0))

    def only(self, shared: IntArray) -> Linear:
        """Return the linearisation with these of its shared columns (a,) alone."""
        d, u = self.sensitivities.shape[1], self.unknowns
        if shared.size == self.own.shape[1] - d:
            return self

        def chosen(columns: FloatArray, kept: int) -> FloatArray:
            """Return the first columns (..., kept) of some (..., kept + p), and those of the shared ones."""
            return columns[..., np.concatenate([np.arange(kept), kept + shared])]

        return replace(
            self,
            own=chosen(self.own, d),
            sensitivities=chosen(self.sensitivities, u),
            transitions=chosen(self.transitions, d),
            whole=chosen(self.whole, u) if self.whole.size else np.empty((0, u + shared.size)),
        )

    def spread(self, places: Sequence[int], width: int) -> Linear:
        """Return the linearisation with its shared columns at ``places`` of ``width``, the others zero."""
        d, u = self.own.shape[1] - len(places), self.unknowns

        def spread(columns: FloatArray, kept: int) -> FloatArray:
            """Return columns (..., kept + p) with the shared ones, behind those that are kept, at their places."""
            out = np.zeros((*columns.shape[:-1], kept + width))
            out[..., :kept] = columns[..., :kept]
            out[..., [kept + j for j in places]] = columns[..., kept:]
            return out

        return replace(
            self,
            own=spread(self.own, d),
            sensitivities=spread(self.sensitivities, u),
            transitions=spread(self.transitions, d),
            whole=spread(self.whole, u),
        )

    def after(self, nuisance: FloatArray, common: FloatArray) -> FloatArray:
        """Return the residuals (n,) that a step of the unknowns is expected to leave."""
        d = self.sensitivities.shape[1]
        step = np.concatenate([nuisance, common])
        tangents = self.sensitivities @ step
        moved = np.einsum("nd,nd->n", self.own[:, :d], tangents[self.segment]) + self.own[:, d:] @ common
        if self.whole.size:
            moved[self.segment < 0] = self.whole @ step
        return np.asarray(self.residual - moved)

    @property
    def nuisance(self) -> FloatArray:
        """Derivatives of the prediction (n, l) by the local unknowns."""
        return self.full[:, : self.unknowns]

    @property
    def common(self) -> FloatArray:
        """Derivatives of the prediction (n, p) by the shared parameters."""
        return self.full[:, self.unknowns :]
