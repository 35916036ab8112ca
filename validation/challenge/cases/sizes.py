"""How large concealed effects are: from about what data like these can show up to far more than anybody would miss.

The smallest sizes are detection limits as `discsim.validation.challenge.cases.detection_limit` computes them on
ordinary cases (each case has its own, by which it is scored), rounded; larger where something else in the catalogue
does the same to the data.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from discsim.effects.catalogue import CATALOGUE, Effect, effect
from discsim.recording import Plant

__all__ = [
    "HIDING",
    "LATEST",
    "ON_REQUEST",
    "Hiding",
    "conceivable",
    "draw_effect",
    "earlier",
    "hiding_of",
    "ordinary",
    "scaled",
]

#: the latest that an event falls into a run, as a share of its time
LATEST = 0.8


@dataclass(frozen=True)
class Hiding:
    """How one effect is drawn.

    The parameters named in ``sized`` share one size, log-uniform from ``smallest`` to ``largest``, in a random
    direction (one parameter: a random sign, unless ``positive``); ``ranges`` gives the others, drawn evenly (an instant
    ``t_s`` as a share of the recorded time). ``about``
    is added to the sized ones (1 for a ratio). ``by_plant`` holds other limits where a plant shows more or less.
    """

    sized: tuple[str, ...]
    smallest: float
    largest: float
    reason: str
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    about: float = 0.0
    positive: bool = False
    by_plant: Mapping[str, tuple[float, float]] = field(default_factory=dict)

    def limits(self, plant: Plant) -> tuple[float, float]:
        """Return the smallest and the largest size on a plant."""
        return self.by_plant.get(plant, (self.smallest, self.largest))


_WIND = ("w_north_m_s", "w_east_m_s")
_CLOCK = "phase of the spin slips by ratio x turns; two per cent is a poor RC oscillator"
_LOST = "one lost sample shifts all that follow; a twentieth lost is a bus that chokes"
_TURNED = ("rx_rad", "ry_rad", "rz_rad")
_GLUED = "a module glued in by eye is turned by up to 6 degrees"
_FREE = "parts that free-run make 50 to 2000 samples a second"

HIDING: Mapping[str, Hiding] = MappingProxyType(
    {
        "air.wind": Hiding(_WIND, 0.015, 3.0, "information limit 0.003 m/s, times seven; 3 m/s is a fresh day"),
        "air.wind_shear": Hiding(
            _WIND,
            0.3,
            4.0,
            "as wind, and the exponent must show within a few metres of height",
            {"exponent": (0.2, 0.5)},
        ),
        "air.gust": Hiding(
            _WIND,
            0.1,
            3.0,
            "a tenth of a second to half of one, in one throw",
            {"t_s": (0.18, 0.75), "width_s": (0.1, 0.5)},
        ),
        "air.density": Hiding(("ratio",), 0.001, 0.1, "ten per cent is a mountain, or thirty kelvin", about=1.0),
        "air.ground_effect": Hiding(("k",), 0.01, 1.0, "felt in the last half metre only", positive=True),
        "aero.spin_side_force": Hiding(("CYr",), 0.0007, 0.05, "information limit 0.0001, times seven"),
        "aero.spin_lift": Hiding(("CLr",), 0.002, 0.1, "a tenth of CL0 at ordinary spin when large"),
        "aero.spin_drag": Hiding(("CDrr",), 0.0008, 0.1, "a quarter of CD0 at ordinary spin when large"),
        "aero.spin_pitching_moment": Hiding(("CMr",), 0.00015, 0.01, "as large as CM0 when large"),
        "aero.stall": Hiding(
            ("k",),
            0.01,
            0.9,
            "above angles that an ordinary flight reaches as it slows",
            {"alpha_stall_rad": (0.1, 0.2)},
            positive=True,
        ),
        "aero.yaw_reynolds": Hiding(("exponent",), 0.004, 1.0, "information limit 0.0005, times seven"),
        "aero.yaw_quadratic": Hiding(("CNrr",), 1e-5, 5e-3, "as large as CNr when large"),
        "aero.yaw_alpha": Hiding(("CNraa",), 2e-4, 0.1, "doubles the damping at 12 degrees when large"),
        "body.mass_imbalance": Hiding(
            ("ex_m", "ey_m"),
            3e-5,
            2e-3,
            "2 mm is a sensor module on one side; below the smallest it moves the accelerometer only",
        ),
        "body.inertia_asymmetry": Hiding(
            ("dIyy_kg_m2",),
            1e-6,
            3e-5,
            "a twentieth of Ixx; a disc as flat as these cannot have less than Ixx",
            positive=True,
            by_plant={"free_spin": (3e-6, 3e-5)},
        ),
        "event.impulse": Hiding(
            ("dv_north_m_s", "dv_east_m_s", "dv_down_m_s"), 0.01, 2.0, "a leaf to a hand", {"t_s": (0.15, LATEST)}
        ),
        "event.spin_step": Hiding(
            ("dr_rad_s",),
            0.01,
            6.0,
            "a brush to a knock; a rig's encoder sees far less",
            {"t_s": (0.15, LATEST)},
            by_plant={"spin_down": (0.0003, 3.0)},
        ),
        "rig.coulomb_friction": Hiding(("torque_N_m",), 1e-8, 3e-4, "to a tenth of the viscous torque", positive=True),
        "rig.quadratic_drag": Hiding(
            ("coefficient_N_m_s2",), 1e-11, 3e-7, "half the viscous torque at 60 rad/s when large", positive=True
        ),
        "rig.axis_tilt": Hiding(
            ("tilt_north_rad", "tilt_east_rad"), 4e-4, 0.05, "three degrees is a rig that nobody levelled"
        ),
        "rig.speed_ripple": Hiding(
            ("amplitude_rad_s",),
            0.0005,
            0.5,
            "an encoder of 0.6 mrad/s sees it",
            {"order": (1.0, 6.0), "phase_rad": (-3.1, 3.1)},
            positive=True,
        ),
        "mag.hard_iron": Hiding(("bx_uT", "by_uT", "bz_uT"), 0.06, 30.0, "half the field when large"),
        "mag.soft_iron": Hiding(
            ("sxx", "sxy", "sxz", "syy", "syz", "szz"), 0.0025, 0.15, "noise of one per cent over hundreds of samples"
        ),
        "mag.lag": Hiding(
            ("tau_s",),
            8e-5,
            5e-3,
            "0.3 rad of phase at ordinary spin when large",
            positive=True,
            by_plant={"free_spin": (3e-4, 5e-3), "spin_down": (1.5e-4, 5e-3)},
        ),
        "mag.stray_field": Hiding(
            ("bn_uT", "be_uT", "bd_uT"), 0.3, 40.0, "a car or reinforced ground", {"height_m": (0.4, 3.0)}
        ),
        "mag.clock_rate": Hiding(("ratio",), 3e-5, 0.02, _CLOCK, about=1.0),
        "mag.dropped_samples": Hiding(("fraction",), 0.004, 0.05, _LOST, positive=True),
        "accel.lag": Hiding(
            ("tau_s",),
            8e-5,
            5e-3,
            "little of the signal turns with the spin",
            positive=True,
            by_plant={"spin_down": (8e-4, 5e-3)},
        ),
        "accel.clock_rate": Hiding(
            ("ratio",), 4e-5, 0.02, _CLOCK, about=1.0, by_plant={"rate_table": (1e-4, 0.02), "spin_down": (1e-4, 0.02)}
        ),
        "accel.dropped_samples": Hiding(("fraction",), 0.004, 0.05, _LOST, positive=True),
        "accel.position_offset": Hiding(
            ("dx_m", "dy_m"),
            1e-5,
            3e-3,
            "3 mm is a module glued in by eye; a tenth of the smallest shows, but as well as a scale",
        ),
        "accel.bias": Hiding(("bx_m_s2", "by_m_s2", "bz_m_s2"), 0.007, 1.0, "the data sheet allows 0.6 to 0.8 m/s^2"),
        "accel.bias_drift": Hiding(
            ("bx_m_s3", "by_m_s3", "bz_m_s3"),
            0.002,
            0.3,
            "a part that warms up",
            by_plant={"rate_table": (3e-4, 0.05), "spin_down": (3e-4, 0.05)},
        ),
        "accel.scale": Hiding(
            ("sx", "sy", "sz"),
            0.0007,
            0.03,
            "the part is stated to 0.5 %, poor ones to 3 %",
            by_plant={"rate_table": (1.5e-4, 0.03), "spin_down": (1.5e-4, 0.03), "free_spin": (3e-4, 0.03)},
        ),
        "accel.cross_axis": Hiding(
            ("sxy", "sxz", "syx", "syz", "szx", "szy"), 0.0002, 0.05, "the data sheet allows 2 %"
        ),
        "accel.saturation": Hiding(
            ("limit_m_s2",),
            30.0,
            75.0,
            "below what the spin asks for",
            positive=True,
            by_plant={"rate_table": (40.0, 130.0), "spin_down": (40.0, 110.0)},
        ),
        "gyro.lag": Hiding(
            ("tau_s",),
            6e-5,
            1e-2,
            "seen where p and q turn with the spin",
            positive=True,
            by_plant={"rate_table": (2e-4, 2e-2), "spin_down": (2e-3, 5e-2)},
        ),
        "gyro.clock_rate": Hiding(
            ("ratio",), 4e-5, 0.02, _CLOCK, about=1.0, by_plant={"rate_table": (5e-5, 0.02), "spin_down": (1e-3, 0.02)}
        ),
        "gyro.bias": Hiding(
            ("bx_rad_s", "by_rad_s", "bz_rad_s"),
            0.003,
            0.1,
            "the data sheet allows 0.087 rad/s",
            by_plant={"free_spin": (3e-4, 0.1), "rate_table": (3e-4, 0.1), "spin_down": (3e-4, 0.1)},
        ),
        "gyro.scale": Hiding(
            ("sx", "sy", "sz"),
            0.001,
            0.03,
            "the data sheet allows 3 %; in flight z is clipped as a rule and p, q are small",
            by_plant={"flight": (0.01, 0.05)},
        ),
        "gyro.g_sensitivity": Hiding(
            ("kx", "ky", "kz"),
            1e-4,
            1e-3,
            "the data sheet allows 1.8e-4 rad/s per m/s^2",
            by_plant={"free_spin": (1.5e-5, 1e-3), "rate_table": (1.5e-5, 1e-3), "spin_down": (1.5e-5, 1e-3)},
        ),
        "gps.clock_rate": Hiding(("ratio",), 2e-3, 0.02, "a fix is wrong by speed x time x rate", about=1.0),
        "gps.latency": Hiding(("delay_s",), 0.008, 0.4, "information limit 0.9 ms, times seven", positive=True),
        "clock.rate": Hiding(
            ("ratio",), 5e-5, 0.02, _CLOCK, about=1.0, by_plant={"rate_table": (1e-5, 0.02), "free_spin": (1e-3, 0.02)}
        ),
        "mag.mount": Hiding(_TURNED, 0.002, 0.1, _GLUED),
        "gyro.mount": Hiding(_TURNED, 0.002, 0.1, _GLUED),
        "accel.mount": Hiding(_TURNED, 0.002, 0.1, _GLUED),
        "gyro.cross_axis": Hiding(
            ("sxy", "sxz", "syx", "syz", "szx", "szy"), 0.0005, 0.05, "the data sheet allows 2 %"
        ),
        "clock.lost_rows": Hiding(("fraction",), 0.004, 0.3, "a loop that writes to a slow card", positive=True),
        "clock.late_rows": Hiding(
            ("tick_s",), 2e-4, 5e-3, "a loop's tick is 1 to 5 ms", {"fraction": (0.05, 0.5)}, positive=True
        ),
        "mag.own_clock": Hiding(("period_s",), 1e-3, 0.02, _FREE, positive=True),
        "imu.own_clock": Hiding(("period_s",), 5e-4, 0.01, _FREE, positive=True),
        "mag.average": Hiding(("weight",), 0.005, 0.5, "a mean of two samples weighs them alike", positive=True),
    }
)

#: of an effect that has no place here yet, from what is visible of it, by the row's scale, to what nobody would miss
_VISIBLE, _PLAIN = 1.0, 30.0


def hiding_of(id: str) -> Hiding:
    """Return how an effect is drawn; one that is new in the catalogue goes by its row's scale.

    Its first parameter and those alike share one size, the others are drawn evenly up to ten times their scale.
    """
    if id in HIDING:
        return HIDING[id]
    row = CATALOGUE[id]
    scale, about = dict(zip(row.parameters, row.scale, strict=True)), row.sizes
    first = row.parameters[0]
    alike = tuple(name for name in row.parameters if (scale[name], about[name]) == (scale[first], about[first]))
    ranges = {
        name: (about[name] + scale[name], about[name] + 10.0 * scale[name])
        for name in row.parameters
        if name not in alike
    }
    low, high = _VISIBLE * scale[first], _PLAIN * scale[first]
    return Hiding(alike, low, high, "the row's scale", ranges, about[first], row.sign.get(first, 0.0) > 0.0)


#: what is concealed only where it is asked for by name: it came after cases whose seeds are known, which stay the same
ON_REQUEST = frozenset(
    {
        "mag.mount",
        "gyro.mount",
        "accel.mount",
        "gyro.cross_axis",
        "clock.lost_rows",
        "clock.late_rows",
        "mag.own_clock",
        "imu.own_clock",
        "mag.average",
        "track.camera",
        "track.time_offset",
        "gps.time_offset",
    }
)
#: effects that unknowns of a plant take in: the part of a free spin's acceleration that turns with the spin is
#: unmodelled, and the rest hardly changes
_HIDDEN_FOR_GOOD: Mapping[Plant, frozenset[str]] = MappingProxyType(
    {"free_spin": frozenset({"accel.lag", "accel.cross_axis", "accel.dropped_samples", "accel.clock_rate"})}
)


def conceivable(plant: Plant, sensors: tuple[str, ...]) -> list[str]:
    """Return the ids of physical effects that can act, and show, on a plant with these sensors on board."""
    return [
        row.id
        for row in CATALOGUE.values()
        if plant in row.plants
        and not row.setup
        and row.acts_with(sensors)
        and row.id not in _HIDDEN_FOR_GOOD.get(plant, ())
    ]


def draw_effect(
    id: str, plant: Plant, rng: np.random.Generator, recorded: float = 3.5, *, largest: bool = False
) -> Effect:
    """Draw the size of an effect on a plant, or take its ``largest``; an event falls well within ``recorded`` (s)."""
    hiding = hiding_of(id)
    low, high = hiding.limits(plant)
    size = float(np.exp(rng.uniform(np.log(low), np.log(high))))
    if largest:
        # a saturation hides the more the lower it is
        size = low if id == "accel.saturation" else high
    if len(hiding.sized) > 1:
        direction = rng.standard_normal(len(hiding.sized))
        direction /= np.linalg.norm(direction)
    else:
        direction = np.array([1.0 if hiding.positive or rng.random() < 0.5 else -1.0])
    sizes = {name: hiding.about + size * share for name, share in zip(hiding.sized, direction.tolist(), strict=True)}
    for name, (least, most) in hiding.ranges.items():
        sizes[name] = float(rng.uniform(least, most)) * (recorded if name == "t_s" else 1.0)
    return effect(id, **{name: float(f"{value:.7g}") for name, value in sizes.items()})


def ordinary(item: Effect, plant: Plant) -> bool:
    """Tell whether an effect is of ordinary size: in the upper half, by logarithm, of those that are drawn."""
    hiding = hiding_of(item.id)
    low, high = hiding.limits(plant)
    size = float(np.linalg.norm([item.sizes[name] - hiding.about for name in hiding.sized]))
    middle = float(np.sqrt(low * high))
    return size <= middle if item.id == "accel.saturation" else size >= middle


def earlier(item: Effect, share: float) -> Effect:
    """Return an event at a share of its instant; what is no event as it is."""
    values = item.value._asdict()
    if "t_s" not in values:
        return item
    return effect(item.id, **{**values, "t_s": float(f"{share * values['t_s']:.7g}")})


def scaled(item: Effect, factor: float, plant: Plant) -> Effect:
    """Return an effect of so many times its size, in the same direction, at the same instant.

    It does not become larger than effects are drawn.
    """
    hiding, values = hiding_of(item.id), item.value._asdict()
    size = float(np.linalg.norm([values[name] - hiding.about for name in hiding.sized]))
    factor = min(factor, hiding.limits(plant)[1] / size)
    for name in hiding.sized:
        values[name] = float(f"{hiding.about + factor * (values[name] - hiding.about):.7g}")
    return effect(item.id, **values)
