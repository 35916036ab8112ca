"""The magnetic field of a rate table itself: of its frame, of magnets that turn with it, of its motor's currents."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from discsim.arrays import FloatArray, readonly
from discsim.motion import Motion
from discsim.second_axis import SecondAxis
from discsim.table_drive import TableDrive
from discsim.toml_table import TomlTable

__all__ = ["TableField", "read_field"]


def _nothing() -> FloatArray:
    return readonly([0.0, 0.0, 0.0])


@dataclass(frozen=True)
class TableField:
    """Field at the sensor, uT, beside that of the place.

    ``still`` (3,) in N is that of the frame, ``turning`` (3,) in B that of magnets which turn with the table.
    ``per_torque`` (3,) uT/(N m) in N is that of the motor's windings, in proportion to its torque and so to its
    current. ``poles`` uT is a field across the axis that runs ahead of the table ``pole_pairs`` times as fast, as that
    of windings which are switched on in turn; in B it turns ``pole_pairs - 1`` times with each turn of the table.
    """

    still: FloatArray = field(default_factory=_nothing)
    turning: FloatArray = field(default_factory=_nothing)
    per_torque: FloatArray = field(default_factory=_nothing)
    poles: float = 0.0
    pole_pairs: int = 1

    @property
    def is_none(self) -> bool:
        """Whether there is no such field."""
        return not (self.still.any() or self.turning.any() or self.per_torque.any() or self.poles)

    def at(self, t: FloatArray, motion: Motion, drive: TableDrive, second: SecondAxis | None) -> FloatArray:
        """Return the field in B, (n, 3) uT, at times t (n,) s of the table's motion.

        The frame and the windings stand still in N but for the second axis, which turns them with the table.
        """
        from scipy.interpolate import CubicSpline  # loads in a third of a second, and few tables have a field

        rate = motion.rate[:, 2:]
        spin = CubicSpline(motion.t, (rate if second is None else second.unseen(rate, motion.t, motion))[:, 0])
        stands = self.still + drive.torque(spin(t), spin(t, 1))[:, None] * self.per_torque
        ahead = (self.pole_pairs - 1) * spin.antiderivative()(t)
        poles = self.poles * np.stack([np.cos(ahead), np.sin(ahead), np.zeros(t.size)], axis=1)
        seen = motion.at(t).in_body(stands if second is None else second.with_it(stands, t))
        return np.asarray(self.turning + seen + poles)


def read_field(table: TomlTable | None) -> TableField:
    """Read a ``[field]`` table (docs/rate-table.md); raises `InputError` naming key, line and what was expected."""
    if table is None:
        return TableField()
    zero = (0.0, 0.0, 0.0)
    still = table.vector("still", "uT", default=zero)
    turning = table.vector("turning", "uT", default=zero)
    per_torque = table.vector("per_torque", "uT_N_m", default=zero)
    poles = table.number("poles", "uT", required=False, minimum=0.0) or 0.0
    pairs = table.raw("pole_pairs")
    if pairs is not None and (isinstance(pairs, bool) or not isinstance(pairs, int) or pairs < 1):
        raise table.error("pole_pairs", f"'{table.name}.pole_pairs' is {pairs!r}, expected a whole number from 1")
    table.finish()
    assert still is not None
    assert turning is not None
    assert per_torque is not None
    return TableField(still, turning, per_torque, poles, pairs or 1)
