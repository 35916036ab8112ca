"""The noise in which the figures of an unexplained diagnosis stand: no misfit has a part in it.

Takes a search; gives the level of each group of readings. Noise that is estimated from what a fit leaves makes a good
fit of a bad one wherever the fit misses the data.
"""

from __future__ import annotations

from discsim.validation.diagnosis.consistency.followed import true_noise
from discsim.validation.diagnosis.selection.search_state import Search
from discsim.validation.identification.noise import GroupNoise, NoiseModel
from discsim.validation.identification.residual_tests import unmodelled_residuals

__all__ = ["capped", "spoilt_groups", "uninflated_noise"]


def spoilt_groups(found: Search) -> set[str]:
    """Return the groups of readings on which even the relaxed fit leaves more than noise."""
    linears = found.relaxed_fit.linears
    left = unmodelled_residuals(linears, [linear.residual for linear in linears], found.relaxed_noise)
    return {item.group for item in left}


def uninflated_noise(found: Search) -> dict[str, GroupNoise]:
    """Return the noise of each group, white: as the relaxed fit shows it, which follows the data.

    Where even that leaves more than noise it is as stated, else by the readings' differences, and no louder than what
    that fit leaves.
    """
    white = {group: noise._replace(correlation=0.0) for group, noise in found.relaxed_noise.items()}
    seen = true_noise([readings for trajectory in found.relaxed_fit.trajectories for readings in trajectory.readings])
    spoilt = spoilt_groups(found) & seen.keys()
    return {**white, **capped({group: white[group] for group in spoilt}, seen)}


def capped(noise: NoiseModel, most: NoiseModel) -> dict[str, GroupNoise]:
    """Return noise that is nowhere louder than ``most`` is of the same group."""
    return {
        group: level._replace(sd=min(level.sd, most[group].sd)) if group in most else level
        for group, level in noise.items()
    }
