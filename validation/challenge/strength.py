"""How much of a concealed effect the recordings of its case can show, computed without any diagnosis.

The difference that an effect makes to noise-free readings, in standard deviations of the noise, less what the unknowns
of the recordings take in (release states, yaw phases, coefficients within their stated sigma), is the gain in chi2
that its true model brings on average: Fisher's information times the size squared. The detection limit is the size at
which this gain is `THRESHOLD`. Motions come from the standalone model and from the rigs; nothing is fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from math import pi, sqrt
from typing import TypeAlias

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.interpolate import BSpline

from discsim.arrays import BoolArray, FloatArray
from discsim.disc import Disc, Release, Rig
from discsim.effects.catalogue import Effect, effect
from discsim.frames import body_to_ned, multiply, to_body, turn
from discsim.motion import Motion
from discsim.rig import spin_down, turn_table
from discsim.sensors import Instruments, Noise, record
from discsim.trajectory import predict
from validation.challenge.cases import Case, Coast, Concealed, Run, Turning
from validation.challenge.sizes import HIDING

__all__ = ["THRESHOLD", "strength"]

#: gain in chi2 that chance does not bring among fifty hypotheses of one to three parameters: 25 + 2 ln(n) and more
THRESHOLD = 40.0
#: steps of the unknowns of a release: m, m/s, rad, rad/s; small enough to be linear, large beside rounding
_POSITION, _VELOCITY, _ANGLE, _RATE = 1e-3, 1e-4, 1e-5, 1e-4
#: knots of what is unknown but smooth in a free spin, s
_KNOTS_S = 0.3
#: readings by sensor: times (n,), values (n, k)
Readings: TypeAlias = Mapping[str, tuple[FloatArray, FloatArray]]


def strength(case: Case) -> float | None:
    """Return the least concealed effect's size in units of its detection limit; None where none is concealed."""
    if not case.concealed:
        return None
    return min(sqrt(max(noncentrality(case, item), 0.0) / THRESHOLD) for item in case.concealed)


def noncentrality(case: Case, item: Concealed) -> float:
    """Return the mean gain in chi2 of one concealed effect, all unknowns fitted with it and without."""
    small, share = _small(item.effect, case)
    shared = _Shared(len(case.stated_disc.sigma) if case.stated_disc is not None else len(_rig_sigma(case)))
    gain = 0.0
    for number, run in enumerate(case.runs):
        if item.recording in (None, number):
            sheet = _Sheet.of(case, readings(case, run, []))
            signature = sheet.column(readings(case, run, [small]), share)
        else:
            continue
        unknowns = np.column_stack([sheet.column(made, step) for made, step in _unknowns(case, run)])
        basis = _orthonormal(unknowns)
        signature -= basis @ (basis.T @ signature)
        gain += float(signature @ signature)
        uncertain = _uncertain(case, run)
        if uncertain:
            columns = np.column_stack([sheet.column(made, step) for made, step in uncertain])
            shared.add(columns - basis @ (basis.T @ columns), signature)
    return gain - shared.taken_in()


class _Shared:
    """Parameters that all recordings share, each known to one of its sigmas beforehand."""

    def __init__(self, count: int) -> None:
        self.information, self.right = np.eye(count), np.zeros(count)

    def add(self, columns: FloatArray, signature: FloatArray) -> None:
        self.information += columns.T @ columns
        self.right += columns.T @ signature

    def taken_in(self) -> float:
        """What of the gain these parameters can bring, too."""
        if not self.right.size:
            return 0.0
        return float(self.right @ np.linalg.solve(self.information, self.right))


def _orthonormal(columns: FloatArray) -> FloatArray:
    """Return an orthonormal basis of the columns' span; directions that nothing shows are left out."""
    norms = np.linalg.norm(columns, axis=0)
    u, s, _ = np.linalg.svd(columns[:, norms > 0] / norms[norms > 0], full_matrices=False)
    return np.asarray(u[:, s > 1e-7 * s[0]])


def _small(item: Effect, case: Case) -> tuple[Effect, float]:
    """Return the effect at a size where readings are linear in it, and the share of its size that this is."""
    hiding = HIDING[item.id]
    sizes = item.value._asdict()
    if item.id.endswith("dropped_samples"):
        # what the losses do on average: a clock that runs slow by the share that is lost
        return effect(item.id.replace("dropped_samples", "clock_rate"), ratio=1.0 - 1e-5), 1e-5 / sizes["fraction"]
    if item.id == "accel.saturation":
        return item, 1.0  # a clipped reading is not linear in the limit
    size = float(np.linalg.norm([sizes[name] - hiding.about for name in hiding.sized]))
    share = min(1.0, 0.1 * hiding.limits(case.plant)[0] / size)
    small = {name: hiding.about + share * (sizes[name] - hiding.about) for name in hiding.sized}
    return effect(item.id, **{**sizes, **small}), share


# ---------------------------------------------------------------------------------------------- readings


def readings(
    case: Case, run: Run, effects: Sequence[Effect], disc: Disc | None = None, rig: Rig | None = None
) -> Readings:
    """Return the noise-free readings of one run."""
    return _measured(case, _motion(case, run, effects, disc or case.stated_disc, rig or case.stated_rig), effects)


def _motion(case: Case, run: Run, effects: Sequence[Effect], disc: Disc | None, rig: Rig | None) -> Motion:
    if isinstance(run, Turning):
        return turn_table(run.profile, case.environment, effects, yaw=run.yaw, timestep=4e-3)
    if isinstance(run, Coast):
        assert rig is not None
        return spin_down(rig, case.environment, run.rate, run.duration, effects, yaw=run.yaw, timestep=4e-3)
    assert disc is not None
    return predict(disc, case.environment, run, effects).motion()


def _measured(case: Case, motion: Motion, effects: Sequence[Effect]) -> Readings:
    quiet: Instruments = case.sheets_of
    for name, sensor in quiet.sensors.items():
        names = {item.name for item in fields(sensor)}
        still = {item: Noise() for item in ("noise", "position_noise", "velocity_noise") if item in names}
        quiet = quiet.fitted(name, **still, **({"resolution": 0.0} if "resolution" in names else {}))
    if "track" in quiet.sensors:
        quiet = quiet.fitted("track", unseen=0.0)
    rng = np.random.default_rng(0)  # draws nothing: there is no noise
    taken = record(motion, quiet.with_effects(effects), rng, plant=case.plant, name="quiet")
    made = {}
    for name, samples in taken.samples.items():
        value = samples.value if samples.value.ndim == 2 else samples.value[:, None]
        made[name] = (samples.t, value)
    return made


@dataclass(frozen=True)
class _Sheet:
    """The readings of a baseline, which of them count, and their noise."""

    case: Case
    base: Readings
    kept: Mapping[str, BoolArray]

    @classmethod
    def of(cls, case: Case, base: Readings) -> _Sheet:
        kept = {}
        for name, (_, value) in base.items():
            limit = getattr(case.sheets_of.sensors[name], "range", np.inf)
            kept[name] = np.isfinite(value) & (np.abs(value) < 0.999 * limit)
        return cls(case, base, kept)

    def column(self, made: Readings, step: float) -> FloatArray:
        """Return the difference from the baseline per ``step``, in standard deviations, as one vector."""
        parts = []
        for name, (t, value) in self.base.items():
            other_t, other = made[name]
            _, mine, theirs = np.intersect1d(_ticks(t), _ticks(other_t), return_indices=True)
            change = np.zeros(value.shape)
            change[mine] = other[theirs] - value[mine]
            change[~self.kept[name]] = 0.0
            parts.append((self._averaged(name, change) / self._noise(name) / step).ravel())
        return np.nan_to_num(np.concatenate(parts))

    def _noise(self, name: str) -> FloatArray:
        sensor = self.case.sheets_of.sensors[name]
        if name == "gps":
            return np.repeat([sensor.position_noise.white, sensor.velocity_noise.white], 3)  # type: ignore[union-attr]
        rounding = getattr(sensor, "resolution", 0.0) / sqrt(12.0)
        noise = np.hypot(sensor.noise.white, rounding)  # type: ignore[union-attr]
        if self._per_turn(name):
            noise = noise / sqrt(self._block(name))
        return np.atleast_1d(noise)

    def _per_turn(self, name: str) -> bool:
        return self.case.plant == "free_spin" and name == "accelerometer"

    def _block(self, name: str) -> int:
        """Samples per turn."""
        run = self.case.runs[0]
        assert isinstance(run, Release)
        assert run.body_rate is not None
        turn_s = 2 * pi / abs(float(run.body_rate[2]))
        return max(round(self.case.sheets_of.sensors[name].sampling.rate_hz * turn_s), 1)

    def _averaged(self, name: str, change: FloatArray) -> FloatArray:
        """Return what counts of a sensor: of a free spin's accelerometer only the means over turns of x and y."""
        if not self._per_turn(name):
            return change
        block = self._block(name)
        whole = len(change) // block
        return np.asarray(change[: whole * block, :2].reshape(whole, block, 2).mean(axis=1))


def _ticks(t: FloatArray) -> FloatArray:
    return np.round(t * 1e6)


# ---------------------------------------------------------------------------------------------- unknowns


def _unknowns(case: Case, run: Run) -> list[tuple[Readings, float]]:
    """Return readings with each unknown of one recording moved by a step, and the step."""
    if isinstance(run, Turning):
        return [(readings(case, replace(run, yaw=run.yaw + _ANGLE), []), _ANGLE)]
    if isinstance(run, Coast):
        return [
            (readings(case, replace(run, yaw=run.yaw + _ANGLE), []), _ANGLE),
            (readings(case, replace(run, rate=run.rate + _RATE), []), _RATE),
        ]
    if case.plant == "free_spin":
        return _smooth_unknowns(case, run)
    assert run.position is not None
    assert run.velocity is not None
    assert run.body_rate is not None
    moved: list[tuple[Release, float]] = []
    for axis in np.eye(3):
        moved.append((replace(run, position=run.position + _POSITION * axis), _POSITION))
        moved.append((replace(run, velocity=run.velocity + _VELOCITY * axis), _VELOCITY))
        moved.append((replace(run, body_rate=run.body_rate + _RATE * axis), _RATE))
    moved.append((replace(run, roll=(run.roll or 0.0) + _ANGLE), _ANGLE))
    moved.append((replace(run, pitch=(run.pitch or 0.0) + _ANGLE), _ANGLE))
    moved.append((replace(run, yaw=(run.yaw or 0.0) + _ANGLE), _ANGLE))
    return [(readings(case, release, []), step) for release, step in moved]


def _smooth_unknowns(case: Case, run: Release) -> list[tuple[Readings, float]]:
    """Return readings with the attitude of a free spin turned by every smooth function of time, and by a wobble.

    This is more than unknown air moments and an unknown spin decay can do, so the limit errs on the large side.
    """
    assert case.stated_disc is not None
    motion = _motion(case, run, [], case.stated_disc, None)
    t = motion.t
    count = max(round((motion.end - motion.start) / _KNOTS_S), 2)
    apart = (motion.end - motion.start) / count
    knots = motion.start + apart * np.arange(-3, count + 4)
    made = []
    for k in range(len(knots) - 4):
        bump = BSpline.basis_element(knots[k : k + 5], extrapolate=False)
        shape = [np.nan_to_num(form(t)) for form in (bump, bump.derivative(1), bump.derivative(2))]
        for axis in np.eye(3):
            made.append(_turned(case, motion, *(np.outer(part, axis) for part in shape)))
    z = body_to_ned(motion.attitude)[..., 2]
    first = np.array([1.0, 0.0, 0.0]) - z[:, :1] * z
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(z, first)
    pace = case.stated_disc.Izz / case.stated_disc.Ixx * motion.rate[:, 2]
    phase = cumulative_trapezoid(pace, t, initial=0)
    for growth in (np.ones_like(t), t / t[-1]):
        for shift in (0.0, pi / 2):
            way = np.cos(phase + shift)[:, None] * first + np.sin(phase + shift)[:, None] * second
            on = np.cross(z, way)
            by, squared = pace[:, None], (pace**2)[:, None]
            grown = growth[:, None]
            made.append(_turned(case, motion, grown * way, grown * by * on, -grown * squared * way))
    return made


def _turned(
    case: Case, motion: Motion, angle: FloatArray, speed: FloatArray, push: FloatArray
) -> tuple[Readings, float]:
    """Return readings of a motion whose attitude is turned by a small rotation in N with these derivatives."""
    step = _ANGLE
    extra = to_body(motion.attitude, step * speed)
    moved = replace(
        motion,
        attitude=multiply(turn(step * angle), motion.attitude),
        rate=motion.rate + extra,
        angular_acceleration=motion.angular_acceleration
        + to_body(motion.attitude, step * push)
        - np.cross(motion.rate, extra),
    )
    return _measured(case, moved, []), step


def _rig_sigma(case: Case) -> Mapping[str, object]:
    return case.stated_rig.sigma if case.stated_rig is not None else {}


def _uncertain(case: Case, run: Run) -> list[tuple[Readings, float]]:
    """Return readings with each parameter that has a stated sigma moved, and the step in sigmas."""
    step = 0.01
    made: list[tuple[Readings, float]] = []
    if isinstance(run, Coast) and case.stated_rig is not None and case.stated_rig.sigma:
        sigma = case.stated_rig.sigma["viscous_N_m_s"]
        rig = replace(case.stated_rig, viscous=case.stated_rig.viscous + step * float(sigma))
        made.append((readings(case, run, [], rig=rig), step))
    disc = case.stated_disc
    if isinstance(run, Release) and disc is not None and disc.sigma and disc.aero is not None:
        for name, sigma in disc.sigma.items():
            value = getattr(disc.aero, name) + step * float(sigma)
            moved = replace(disc, aero=disc.aero._replace(**{name: value}))
            made.append((readings(case, run, [], disc=moved), step))
    return made
