"""What a linearisation of a recording is: residuals, and how they depend on its own unknowns and on shared ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from discsim.arrays import FloatArray, IntArray

__all__ = ["Channel", "Linear"]


@dataclass(frozen=True)
class Channel:
    """One axis of one sensor in a linearisation: where its rows are, and their place among the sensor's samples."""

    sensor: str
    axis: str
    group: str
    rows: slice
    index: IntArray


@dataclass(frozen=True)
class Linear:
    """Residuals of a recording and how they depend on its unknowns: ``residual - J du``.

    The unknowns are the local ones, the first state and the allowed jumps (l,), and the shared ones (p,). Each row is
    kept by the state of its own piece (compact); `local` and `shared` chain the pieces on demand.

    Attributes
    ----------
    raw : (n,) array
        Measured minus predicted where the chain stands, rows by channel.
    own : (n, d + p) array
        Derivatives of the prediction by the state of the row's piece and by the parameters within it.
    piece : (n,) int array
        The piece of each row; -1 for a reading that hangs on several, as with a lag or where it is a mean.
    whole : (m, l + p) array
        Derivatives of those by the unknowns themselves, in their order.
    t, sd : (n,) arrays
        Written times, stated noise.
    channels : tuple of Channel
    jump, jump_kind, jump_piece : (l,) arrays
        Current size of each allowed jump, its direction within the state (-1 for the first state) and its piece.
    moves : (k, d, l + p) array
        How the states of the pieces follow the unknowns.
    passes : (k - 1, d, d + p) array
        How the state of each next piece follows that of the one before and the shared parameters.
    closing : (k, d) array
        How they move to close the jumps that are not allowed.
    gaps : (k - 1, d) array
        All jumps as they stand.
    shifts : (n,) array
        What the closing adds to the prediction.
    """

    raw: FloatArray
    own: FloatArray
    piece: IntArray
    whole: FloatArray
    t: FloatArray
    sd: FloatArray
    channels: tuple[Channel, ...]
    jump: FloatArray
    jump_kind: IntArray
    jump_piece: IntArray
    moves: FloatArray
    passes: FloatArray
    closing: FloatArray
    gaps: FloatArray
    shifts: FloatArray

    @property
    def unknowns(self) -> int:
        """Number of local unknowns, l."""
        return self.jump.size

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted (n,) once the jumps that are not allowed are closed."""
        return self.raw - self.shifts

    @cached_property
    def _full(self) -> FloatArray:
        d, width = self.moves.shape[1:]
        full = np.empty((self.raw.size, width))
        for i in range(self.moves.shape[0]):
            rows = np.flatnonzero(self.piece == i)
            full[rows] = self.own[rows, :d] @ self.moves[i]
        full[:, self.unknowns :] += self.own[:, d:]
        if self.whole.size:
            full[self.piece < 0] = self.whole
        return full

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
            moves=spread(self.moves, u),
            passes=spread(self.passes, d),
            whole=spread(self.whole, u),
        )

    def after(self, local: FloatArray, shared: FloatArray) -> FloatArray:
        """Return the residuals (n,) that a step of the unknowns is expected to leave."""
        d = self.moves.shape[1]
        step = np.concatenate([local, shared])
        tangents = self.moves @ step
        moved = np.einsum("nd,nd->n", self.own[:, :d], tangents[self.piece]) + self.own[:, d:] @ shared
        if self.whole.size:
            moved[self.piece < 0] = self.whole @ step
        return np.asarray(self.residual - moved)

    @property
    def local(self) -> FloatArray:
        """Derivatives of the prediction (n, l) by the local unknowns."""
        return self._full[:, : self.unknowns]

    @property
    def shared(self) -> FloatArray:
        """Derivatives of the prediction (n, p) by the shared parameters."""
        return self._full[:, self.unknowns :]
