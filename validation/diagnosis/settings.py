"""The limits of a diagnosis, stage by stage, each with where it comes from.

What chance alone reaches against the limits that decide is measured by ``benchmarks/thresholds.py`` (docs/thresholds.md
has the picture). Limits that only save time say so: too wide a one costs a refit, and changes no answer. The residual
tests have theirs in `discsim.validation.identification.residual_tests`, faults of the setup in
`discsim.validation.diagnosis.setup`, beside the relations that they limit. A gain is in twice the log likelihood, or in
chi-squared.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from discsim.validation.identification.residual_tests import RESIDUAL_TESTS

__all__ = ["CONSISTENCY", "DETECTORS", "RELAXED_FIT", "SELECTION", "UNKNOWN_LAW", "settings_told"]


@dataclass(frozen=True)
class Consistency:
    """Limits of the early look, whether any motion follows all sensors.

    The figures are of 44 sound flights and runs (``discsim study conceal --seed 70000 --cases 40``, and flights with
    ``--effects`` of each clock, lag and loss of samples) and of sensors put together from other throws and runs.

    Attributes
    ----------
    astray : float
        A robust rms of what is left of a sensor, in its noise, above which a look does not follow it. Sound recordings
        leave 0.7 to 6.3, noise that is three times what is stated leaves 3, sensors of other throws or runs 17 and
        more; 15 to 31 are left where three to five samples in a hundred were lost, which a shift reconciles.
    reconciled : float
        What a sensor may leave that is late, lags or lost samples: with one sample in twenty lost 1.7 (magnetometer)
        and 4 (accelerometer), while sensors of another throw or run leave 9 to 40.
    ripple : float
        Share of its rate by which a table's speed may pulse: one of another run is off by as much as rates differ.
    left_of_ripple : float
        Share of a ripple that a look with one may leave of a sensor: relaxed segments place its phase to some
        milliradians, 0.5 % are left at order 6 and 1.2 rad/s; sensors of another run leave as much as without it.
    left_of_turn : float
        Share of a contradiction that a small turn in its board may leave of a sensor: of 1 to 3 degrees 2 to 12 % are
        left, of a sensor of another throw as much as without a turn.
    ripples : int
        Ripples of a table's speed that are tried, the likeliest first.
    lost : float
        Two sensors of a free spin that are both astray, one by this much, follow no motion: sensors of other throws
        leave 300 and more, a clock or lost samples of one sensor stay below it.
    beyond_pure : float
        How many times the pure error of its rows effects may leave of a sensor that explain recordings whose rows were
        counted: at twice, what a motion with physics lacks beside one without is less than the root of 3 of it. Throws
        without any effect leave 5 to 300 times.
    beyond_pure_others : int
        How many others that is with the numbers of. With those of one other it may be 2.3 times: these err as it does.
    few, again : int
        Recordings that are looked at, and those that are looked at again without some sensors: time alone.
    """

    astray: float = 12.0
    reconciled: float = 6.0
    ripple: float = 0.1
    left_of_ripple: float = 0.01
    left_of_turn: float = 0.2
    ripples: int = 2
    lost: float = 100.0
    beyond_pure: float = 2.0
    beyond_pure_others: int = 3
    few: int = 3
    again: int = 2


@dataclass(frozen=True)
class RelaxedFit:
    """Limits of the relaxed fit: whether it is beside the data, and what brings it there.

    Attributes
    ----------
    astray : float
        Chi-squared per reading of a recording, in the noise that is stated, above which its fit may have started wrong
        and others are tried: a phase off by a turn leaves hundreds, noise that is three times what is stated 9. How
        often that takes time for nothing is measured by ``benchmarks/thresholds.py``.
    rescued : float
        Another start, or a free clock, is taken up where it leaves less than this share of what was left: the same
        minimum reached twice differs by less than one in a hundred, another one by a factor.
    time_sigma : float
        How far a clock may be wrong where sensors say that the written time is: as far as a ratio of turns is looked
        for (0.4 in its logarithm), as one sigma.
    least_wrong : float
        Written time that is less wrong than this is left to the clocks of single sensors, which are tried to 3 %.
    clock_sigma : float
        How far such a clock may be from right, one sigma: lost samples of one in fifty look like that.
    first_look : float
        Length of the beginning that tells the clocks, s: until then one that is 2 % off has turned the phase of a spin
        of 80 rad/s by 2 rad, less than half a turn.
    lost : float
        A gyroscope on a rig whose residual is this many times its stated noise may have a clock far from right, an
        accelerometer in a body out of balance a place that moves: no noise of the blind test is more than three times
        as loud as stated.
    reconciled : float
        What else is supposed is taken up where it leaves less than this share: from ten times the noise back to twice.
    across : float
        Mean square of what is left of a gyroscope's x and y in a free spin, in its noise, above which its body may be
        out of balance: four with a part that slides leave 24 to 1820 (seeds 627064, 635033, 633010, 635023), and
        followed as such 0.8 to 0.9, one 7.
    unbalanced : float
        Measured discs are out of balance where that leaves less than this share of the mean square of their
        gyroscope's x and y: four throws of one keep 0.27 to 0.38 with the
        numbers of the others, three simulated ones in balance 0.76 to 0.90 (like_real, seeds 650002, 650003, 650005).
    outlier, neighbour : float
        A reading this many robust standard deviations off, its neighbours within the second number, is left out:
        normal noise has the one once in 4e18 readings, the other once in 1.5e5.
    most_outliers : float
        Larger shares of a sensor's readings than this are no outliers, but how it reads.
    """

    astray: float = 8.0
    rescued: float = 0.8
    time_sigma: float = 0.3
    least_wrong: float = 0.03
    clock_sigma: float = 0.02
    first_look: float = 1.3
    lost: float = 10.0
    reconciled: float = 0.2
    across: float = 1.5
    unbalanced: float = 0.5
    outlier: float = 9.0
    neighbour: float = 4.5
    most_outliers: float = 0.03


@dataclass(frozen=True)
class Selection:
    """Prices and limits of the stepwise selection.

    Attributes
    ----------
    entry, per_parameter : float
        What an effect must gain, and more for each of its parameters: ``benchmarks/thresholds.py`` measures what chance
        gains. At equal chance a parameter more would be worth 2.9 (quantiles of chi-squared at 1e-6).
    event_entry, gust_entry : float
        The same of an event, whose instant is chosen, and of a gust, whose width is chosen, too: measured there.
    other_disc : float
        What it costs more that a disc's aerodynamics or build should differ in some recordings, or how a sensor is made
        and soldered: one disc is thrown with one logger, and what does so is mostly something else; the benchmark
        measures how much room chance leaves.
    miscounted : float
        What it costs more beside rows that were counted one by one: single ones that are miscounted leave as much.
        Among throws like real ones false effects had gained 39 and 55, true ones 100 and more.
    turned : float
        What it costs more that one sensor is turned in its board, where another effect explains as much: parts are
        soldered square to within a degree, and at one spin a turn about its axis is a delay. As much as to believe in
        an effect at all.
    mistimed : float
        What it costs more that a sensor's times are off by as much all along, where another effect explains as much: a
        lag of 4 ms has lost up to 7 to such an offset, for what its starts may have been is charged to it.
    rival : float
        What a parameter costs between effects that are both worth their price: the Bayesian information criterion's
        logarithm of the number of readings, at 3000 of them.
    far : float
        Chi-squared per reading, in the noise of the relaxed fit, above which a fit is far from the data: measured by
        the benchmark.
    near : float
        The same below which it is near, so that fewer candidates are refitted: what the baseline reaches in the
        benchmark where nothing is hidden.
    followed : float
        Chi-squared per reading of the relaxed fit, in the noise that is stated, up to which it follows the data, so
        that a fit which does not misses something. Beyond it noise may be louder than stated, by the root of 2 and
        more on the whole, and the residual tests decide alone.
    no_nearer : float
        An effect that leaves more than this share leads no nearer: of two that are hidden the larger leaves half.
    most_effects : int
        How many effects are added: a fifth on the motion has yet to be found in recordings that leave nothing else.
    most_with_sensors : int
        The same where all but one of them are errors of sensors: those of a module within its sheet are five of three
        sensors, beside what is hidden.
    steps_alike : float
        What is left may be this many times what all further effects would take if each took as much as the last: the
        largest comes first, and two that are asked for one by one take less than together.
    refitted, refitted_at_most : int
        Candidates that are refitted at a step, near the data and while none comes near, or none gains though more than
        noise is left: algebra ranks many a wrong one before the right one, which was the eighth at worst.
    pairs_refitted : int
        Pairs that are refitted where no effect alone comes near: time alone.
    hopeless, hopeless_near : float
        A refit that will leave this many times the best chi-squared so far is given up, and where that is near the
        data: time alone.
    hopeless_held : float
        The same after steps that are held: what these expect of the end is within a tenth of it.
    out_of_reach : float
        The same of a refit that expects to stay so much worse than the fit beside it: no price nor tie comes near.
    right_sign : float
        What it counts that an effect came out with the sign that physics gives it: a parameter's price. A lag and an
        offset of time are one to first order.
    worse : float
        A fit with one more effect that is worse than that without by more than this has gone astray: rounding and a
        noise that was estimated anew make a few.
    doubtful : float
        A gain below this may be due to where the fits of a weakly identified motion started, and is asked for once more
        from there: time alone.
    borne_out : float
        Share of such a gain that the square of an effect's size, in its standard deviations, must reach beyond that:
        of fits at their optimum the two are alike, or it is more where noise swallowed the effect. One of 14.5 sd that
        gained 385 was none.
    short : float
        Where most readings lie within this many times the stated noise, what raises its level is short.
    refuted : float
        An effect that loses on recordings set aside is left out where it gains less than so many times its price on
        all. In 402 effects named in blind cases 335 of the right ones could be asked so: one lost, which gained 3.6
        prices; of 14 wrong ones two did, which gained 1.1 and 1.4.
    unlike : float
        Nor does one of so little gain stay of which recordings ask for sizes as unlike as this chance, at most. An
        asymmetric inertia named in two blind cases without one had 1e-6 and 2e-10, right effects of eight cases 0.07
        and more.
    exchanges : int
        How often a named effect may give way to another.
    simpler, better : float
        By how much a rival must be better where it has fewer parameters, charged for: more than nothing; and where it
        has as many or more: twice what counts as very strong evidence (10; R. Kass and A. Raftery, Bayes factors,
        J. Am. Stat. Assoc. 90, 1995, p. 777), as several rivals are asked.
    worst, worst_share : float
        Rivals that algebra finds worse than this, and than this share of what the effect gains, are not refitted: time
        alone, for five times what leaves a rival confused.
    rivals, alike : int
        Rivals of an effect that are refitted, and of those that algebra cannot tell from it, which are mostly its
        twins: time alone. At one spin a lag, an offset of time, a clock, a scale and a cross-axis error are alike.
    confused : float
        Hypotheses whose scores differ by less cannot be told apart: very strong evidence is 10 (Kass and Raftery).
    """

    entry: float = 24.0
    per_parameter: float = 4.0
    event_entry: float = 42.0
    gust_entry: float = 60.0
    other_disc: float = 40.0
    miscounted: float = 40.0
    turned: float = 24.0
    mistimed: float = 12.0
    rival: float = 8.0
    far: float = 1.6
    near: float = 1.2
    followed: float = 2.0
    no_nearer: float = 0.7
    most_effects: int = 4
    most_with_sensors: int = 8
    steps_alike: float = 3.0
    refitted: int = 4
    refitted_at_most: int = 9
    pairs_refitted: int = 5
    hopeless: float = 10.0
    hopeless_near: float = 4.0
    hopeless_held: float = 2.0
    out_of_reach: float = 500.0
    right_sign: float = 4.0
    worse: float = 10.0
    doubtful: float = 200.0
    borne_out: float = 0.8
    short: float = 2.0
    refuted: float = 2.0
    unlike: float = 1e-4
    exchanges: int = 2
    simpler: float = 2.0
    better: float = 20.0
    worst: float = 60.0
    worst_share: float = 0.05
    rivals: int = 3
    alike: int = 6
    confused: float = 12.0


@dataclass(frozen=True)
class Detectors:
    """Limits of the detectors; what they propose must still gain its price by a refit.

    Attributes
    ----------
    least : float
        What an event, a gust or a ripple must promise: just above an effect's entry, below an event's.
    least_dropped : float
        What lost samples must gain by a relaxed fit with them counted: about an event's price.
    fewest_steps : int
        Steps of the magnetometer's phase, over all recordings, that are followed up: below, less is lost than one
        sensor's clock is wrong.
    followed : int
        Events of one kind and recording that are followed up at a time: time alone, the others come after them.
    """

    least: float = 25.0
    least_dropped: float = 40.0
    fewest_steps: int = 3
    followed: int = 3


@dataclass(frozen=True)
class UnknownLaw:
    """Limits of the search for a law.

    Attributes
    ----------
    stack : int
        So many effects on the motion, or in a free spin on one sensor, may be a bad copy of something that is none of
        them: a law competes then.
    worth : float
        Share of the best candidate's gain below which another is not fitted: time alone.
    fitted : int
        Candidates that are fitted: time alone.
    share : float
        Share of the excess that a law must explain where it leaves more than noise: more than it leaves.
    held_out : float
        What it must gain on recordings held out: very strong evidence is 10 (Kass and Raftery, as for `Selection`).
    all : float
        Share of the excess beyond which no other candidate is fitted: time alone.
    """

    stack: int = 2
    worth: float = 0.7
    fitted: int = 2
    share: float = 0.5
    held_out: float = 12.0
    all: float = 0.98


CONSISTENCY, RELAXED_FIT, SELECTION = Consistency(), RelaxedFit(), Selection()
DETECTORS, UNKNOWN_LAW = Detectors(), UnknownLaw()


def settings_told() -> Mapping[str, str]:
    """Return the limits of all stages, a line for each stage, as a report shows them."""
    stages: dict[str, Any] = {
        "consistency": CONSISTENCY,
        "relaxed fit": RELAXED_FIT,
        "selection": SELECTION,
        "detectors": DETECTORS,
        "residual tests": RESIDUAL_TESTS,
        "unknown law": UNKNOWN_LAW,
    }
    return {
        f"limits: {name}": ", ".join(f"{one.name} {getattr(stage, one.name):g}" for one in fields(stage))
        for name, stage in stages.items()
    }
