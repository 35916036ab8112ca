"""A rig's stated friction or inertia that no run-down explains is told, and ordinary friction beside it is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from support.made import FIELD, RIG
from support.thinned import one_in

from discsim.disc import Rig
from discsim.effects import Effect, effect
from discsim.recording import Recording
from discsim.rig import spin_down
from discsim.sensors import Instruments, record
from discsim.validation.checking.checked import check
from discsim.validation.checking.run_down import run_down_findings


def coast(*effects: Effect, rig: Rig = RIG, sensors: tuple[str, ...] = (), last: float = 20.0) -> Recording:
    """Return a rig that coasts down from 60 rad/s; with ``sensors`` alone where some are named."""
    motion = spin_down(rig, FIELD, 60.0, last, effects, yaw=0.5)
    board = Instruments.from_parts("mpu9250", "ac1120s")
    found = record(motion, board, np.random.default_rng(5), plant="spin_down", name="mine", rig=rig)
    return replace(found, samples={name: found.samples[name] for name in sensors}) if sensors else found


def stated(recording: Recording, *, inertia: float = 1.0, friction: float = 1.0, sigma: float = 0.0) -> Recording:
    """Return a recording that states so many times its rig's inertia and friction, the latter with a sigma, N m s."""
    rig = Rig(inertia * RIG.Izz, friction * RIG.viscous, {"viscous_N_m_s": sigma} if sigma else {})
    return replace(recording, rig=rig)


SLIPS = {
    "g cm2 for kg m2": ({"inertia": 1e7}, "is Izz_kg_m2 in g cm2?"),
    "kg cm2 for kg m2": ({"inertia": 1e4}, "is Izz_kg_m2 in kg cm2?"),
    "mN m s for N m s": ({"friction": 1e3}, "is viscous_N_m_s in mN m s?"),
    "ten times the friction": ({"friction": 10.0}, "the ratio of the two is 0.1 times that"),
    "a tenth of the friction": ({"friction": 0.1}, "the ratio of the two is 10 times that"),
}


@pytest.mark.parametrize("sensors", [(), ("magnetometer",), ("gyroscope",)], ids=["all", "field", "gyroscope"])
@pytest.mark.parametrize("slip", one_in(2, SLIPS))
def test_a_slip_in_the_rigs_numbers_is_told_with_its_factor(slip, sensors):
    """Nothing was held against them: a fit took the friction for uncertain, or dry friction for what was missing."""
    numbers, told = SLIPS[slip]
    (found,) = run_down_findings(stated(coast(sensors=sensors), **numbers))
    assert (found.id, found.severity) == ("rig.friction", "warning")
    assert told in found.sentence


def test_check_tells_it():
    (checked,) = check([stated(coast(), inertia=1e7)]).checks
    assert "rig.friction" in [one.id for one in checked.of("warning")]


@pytest.mark.parametrize(
    "hidden",
    [
        (),
        (effect("rig.coulomb_friction", torque_N_m=3e-4),),
        (effect("rig.quadratic_drag", coefficient_N_m_s2=3e-7),),
        (effect("rig.axis_tilt", tilt_north_rad=0.05, tilt_east_rad=0.0),),
        (effect("event.spin_step", t_s=9.0, dr_rad_s=-5.0),),
    ],
    ids=lambda hidden: hidden[0].id if hidden else "nothing",
)
@pytest.mark.parametrize("friction", one_in(3, [2.0, 0.5, 1.0]))
def test_what_a_bench_has_beside_its_stated_friction_is_no_slip(hidden, friction):
    """The largest that the blind test conceals, and friction that is known to a factor of two."""
    assert list(run_down_findings(stated(coast(*hidden), friction=friction))) == []


def test_nothing_is_told_where_nothing_is_known():
    """A friction with a wide sigma, none, a run too short to show any."""
    assert list(run_down_findings(stated(coast(), friction=0.1, sigma=RIG.viscous))) == []
    assert list(run_down_findings(stated(coast(), friction=0.0))) == []
    assert list(run_down_findings(stated(coast(last=1.0), friction=0.1))) == []


def test_a_rig_that_is_still_driven_is_told():
    driven = coast(rig=replace(RIG, viscous=1e-9))
    (found,) = run_down_findings(stated(driven))
    assert "was the rig still driven?" in found.remedy
