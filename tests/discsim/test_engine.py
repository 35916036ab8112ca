from __future__ import annotations

import dataclasses
import itertools

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.flights import BARE, DRIVER, FIELD, WEIGHTLESS, attitude, in_wind, mirrored, throw, turned, with_aero
from support.plain_air import plain_wrench

from discsim.disc import Aero, Disc, Release
from discsim.effects import Effect, effect
from discsim.engine import FlyingDisc, check_model, fly
from discsim.environment import Environment
from discsim.errors import InputError
from discsim.frames import C3, body_to_ned, rotation_error, to_body
from discsim.law import Law
from discsim.motion import Motion
from discsim.shipped import load_disc

G = FIELD.gravity
RHO = FIELD.air_density
DOWN = np.array([0.0, 0.0, 1.0])
#: a body that turns 60 rad/s and wobbles 3 rad/s, high enough to fall for 3 s
WOBBLING = throw(speed=20.0, climb_deg=60.0, spin_deg_s=float(np.degrees(60.0)), wobble=(3.0, 0.0), height=100.0)


def parabola(motion: Motion) -> np.ndarray:
    t = motion.t[:, None]
    return motion.position[0] + motion.velocity[0] * t + 0.5 * G * DOWN * t**2


def symmetric_top(disc: Disc, release: Release, t: np.ndarray) -> np.ndarray:
    """Attitudes (n, 4) of a torque-free body with Ixx = Iyy, in closed form.

    The angular velocity is h/Ixx - lambda z_B with h, the angular momentum, fixed in N and z_B fixed in B, and
    lambda = (Izz/Ixx - 1) r. So the body turns about h at |h|/Ixx (space cone) and within that frame about its own
    axis at -lambda (body cone).
    """
    C_NB = attitude(release)
    h = C_NB @ (np.array([disc.Ixx, disc.Ixx, disc.Izz]) * release.body_rate)
    own = -(disc.Izz / disc.Ixx - 1.0) * release.body_rate[2]
    space_cone = Rotation.from_rotvec(np.outer(t, h / disc.Ixx))
    body_cone = Rotation.from_rotvec(np.outer(t, own * DOWN))
    return (space_cone * Rotation.from_matrix(C_NB) * body_cone).as_quat(scalar_first=True)


class TestTorqueFreeTop:
    def test_its_attitude_is_the_closed_form_to_a_ten_thousandth_of_a_degree(self):
        """1e-4 deg after 3 s at 1 kHz is the stated tolerance; RK4 reaches 2e-5 deg."""
        motion = fly(BARE, FIELD, WOBBLING, duration=3.0)
        error = rotation_error(motion.attitude, symmetric_top(BARE, WOBBLING, motion.t))
        assert motion.end == pytest.approx(3.0, abs=1e-9)
        assert np.degrees(error.max()) <= 1e-4

    def test_the_error_is_of_fourth_order_in_the_step(self):
        """2, 1, 0.5 ms: below, rounding over 10^4 steps shows, above, the next order (4.3 at 4 ms)."""
        error = []
        for step in (2e-3, 1e-3, 0.5e-3):
            motion = fly(BARE, FIELD, WOBBLING, duration=3.0, timestep=step)
            error.append(rotation_error(motion.attitude[-1], symmetric_top(BARE, WOBBLING, motion.t[-1:])[0]))
        np.testing.assert_allclose(-np.diff(np.log2(error)), 4.0, atol=0.2)

    def test_the_wobble_turns_at_the_difference_of_the_inertias(self):
        """In B p + i q turns at lambda = (Izz - Ixx)/Ixx r = 55 rad/s.

        The phase error of RK4 is (lambda h)^5/120 a step, 1.26e-5 rad over 3 s, so 3.8e-5 rad/s of 3.
        """
        motion = fly(BARE, FIELD, WOBBLING, duration=3.0)
        turning = (BARE.Izz / BARE.Ixx - 1.0) * 60.0 * motion.t
        np.testing.assert_allclose(motion.rate[:, 0], 3.0 * np.cos(turning), atol=4e-5)
        np.testing.assert_allclose(motion.rate[:, 1], 3.0 * np.sin(turning), atol=4e-5)
        np.testing.assert_allclose(motion.rate[:, 2], 60.0, atol=1e-10)

    def test_energy_and_angular_momentum_are_kept(self):
        """RK4 damps an oscillation by (lambda h)^6/144 a step: 6e-7 of the wobble over 3 s, whose share of the energy
        is 0.0013, so 1e-9 of the energy (measured 1.5e-9); the angular momentum turns by the attitude's error, 3e-7.
        """
        motion = fly(BARE, FIELD, WOBBLING, duration=3.0)
        inertia = np.array([BARE.Ixx, BARE.Ixx, BARE.Izz])
        rotation = 0.5 * motion.rate**2 @ inertia
        fall = 0.5 * BARE.mass * np.sum(motion.velocity**2, axis=1) - BARE.mass * G * motion.position[:, 2]
        np.testing.assert_allclose(rotation, rotation[0], rtol=5e-9)
        np.testing.assert_allclose(fall, fall[0], rtol=1e-12)
        momentum = np.einsum("nij,nj->ni", body_to_ned(motion.attitude), inertia * motion.rate)
        np.testing.assert_allclose(momentum, np.tile(momentum[0], (motion.t.size, 1)), atol=3e-7 * inertia[2] * 60.0)

    def test_a_body_with_three_inertias_keeps_them_too(self):
        """No simple closed form, but energy and angular momentum still hold (tolerances as for the symmetric top)."""
        unequal = effect("body.inertia_asymmetry", dIyy_kg_m2=5e-5)
        motion = fly(BARE, FIELD, WOBBLING, [unequal], duration=3.0)
        inertia = np.array([BARE.Ixx, BARE.Ixx + 5e-5, BARE.Izz])
        rotation = 0.5 * motion.rate**2 @ inertia
        np.testing.assert_allclose(rotation, rotation[0], rtol=5e-9)
        momentum = np.einsum("nij,nj->ni", body_to_ned(motion.attitude), inertia * motion.rate)
        np.testing.assert_allclose(momentum, np.tile(momentum[0], (motion.t.size, 1)), atol=3e-7 * inertia[2] * 60.0)
        # not the symmetric top: rdot = (Ixx - Iyy)/Izz p q swings r by 5e-5/1.15e-3 * 3^2/(2 * 55) = 0.0036 rad/s
        assert np.ptp(motion.rate[:, 2]) == pytest.approx(0.0036, rel=0.2)


class TestVacuum:
    def test_the_centre_of_mass_follows_the_parabola(self):
        """RK4 is exact for it: rounding only, 1e-10 m over 2e3 steps."""
        motion = fly(BARE, FIELD, throw())
        np.testing.assert_allclose(motion.position, parabola(motion), atol=1e-10)
        np.testing.assert_allclose(motion.velocity, motion.velocity[0] + G * np.outer(motion.t, DOWN), atol=1e-10)

    @pytest.mark.parametrize("climb", [-20.0, 0.0, 10.0, 80.0])
    def test_touch_down_is_found(self, climb):
        """The stated tolerance is 0.1 ms; the root finder promises 1e-7 s. Its height is zero to 1e-6 m."""
        motion = fly(BARE, FIELD, throw(climb_deg=climb))
        up = -motion.velocity[0, 2]
        landing = (up + np.sqrt(up**2 + 2 * G * 1.3)) / G
        assert motion.touched_down
        assert motion.end == pytest.approx(landing, abs=1e-7)
        assert abs(motion.position[-1, 2]) < 1e-6

    def test_an_off_centre_mass_follows_the_parabola_while_the_disc_spins_around_it(self):
        """The joint's origin circles at 15 m/s^2; RK4 keeps the centre of mass to 2e-9 m (2.6e-8 m at 2 ms)."""
        unbalanced = effect("body.mass_imbalance", ex_m=0.002, ey_m=-0.001)
        release = throw(wobble=(2.0, 1.0))
        motion = fly(BARE, FIELD, release, [unbalanced])
        np.testing.assert_array_equal(motion.centre_of_mass, [0.002, -0.001, 0.0])
        np.testing.assert_allclose(motion.position, parabola(motion), atol=1e-8)
        np.testing.assert_allclose(motion.acceleration, np.tile(G * DOWN, (motion.t.size, 1)), atol=1e-9)
        np.testing.assert_allclose(motion.position[0], release.position, atol=1e-15)
        np.testing.assert_allclose(motion.velocity[0], release.velocity, atol=1e-14)
        # its inertia is stated about the centre of mass, so it turns like the balanced disc
        assert rotation_error(motion.attitude, symmetric_top(BARE, release, motion.t)).max() < np.radians(1e-4)
        landing = fly(BARE, FIELD, release).end
        assert motion.end == pytest.approx(landing, abs=1e-7)

    def test_without_gravity_it_flies_straight_on(self):
        motion = fly(BARE, WEIGHTLESS, throw(), duration=0.5)
        np.testing.assert_allclose(motion.velocity, np.tile(motion.velocity[0], (motion.t.size, 1)), atol=1e-12)
        assert not motion.touched_down


class TestClosedFormsInAir:
    """Falls and decays with a closed form.

    Drag linear in V cannot be had: the model's forces go with V^2, and what goes with V alone (spin lift, side force)
    stands across the motion. So the fall is held against the closed form of quadratic drag, and the terms that are
    linear in V, yaw damping and side force, against theirs.
    """

    flat = dataclasses.replace(BARE, aero=Aero(CD0=1.1, CNr=-0.02))
    terminal = float(np.sqrt(2 * BARE.mass * G / (RHO * BARE.area * 1.1)))
    #: rdot/r = -kappa V, (17)
    kappa = RHO * BARE.area * BARE.diameter**2 * 0.02 / (4 * BARE.Izz)

    def drop(self, speed_down: float, spin: float = 70.0) -> Motion:
        release = Release([0, 0, -60.0], [0, 0, speed_down], 0.0, 0.0, 0.0, [0, 0, spin])
        return fly(self.flat, FIELD, release, duration=3.0)

    def test_a_level_disc_falls_as_quadratic_drag_says(self):
        """From rest: v = v_t tanh(g t/v_t), s = v_t^2/g ln cosh(g t/v_t); RK4 at 1 ms errs by (g h/v_t)^4, 1e-12."""
        motion, v_t = self.drop(0.0), self.terminal
        np.testing.assert_allclose(motion.velocity[:, 2], v_t * np.tanh(G * motion.t / v_t), atol=1e-9)
        fallen = v_t**2 / G * np.log(np.cosh(G * motion.t / v_t))
        np.testing.assert_allclose(motion.position[:, 2] + 60.0, fallen, atol=1e-9)
        np.testing.assert_allclose(motion.velocity[:, :2], 0.0, atol=1e-12)

    def test_a_level_disc_thrown_straight_up_rises_and_falls_through_alpha_of_90_deg(self):
        """Rising: v = v_t tan(atan(v0/v_t) - g t/v_t), the wind from above; then the fall of the test before."""
        motion, v_t = self.drop(-15.0), self.terminal
        top = v_t / G * np.arctan(15.0 / v_t)
        rising = motion.t < top
        expected = np.where(
            rising,
            -v_t * np.tan(np.where(rising, np.arctan(15.0 / v_t) - G * motion.t / v_t, 0.0)),
            v_t * np.tanh(G * (motion.t - top) / v_t),
        )
        # at the top the drag's curvature jumps, which costs one step some of its order
        np.testing.assert_allclose(motion.velocity[:, 2], expected, atol=1e-8)

    def test_the_spin_of_a_falling_disc_decays_with_the_way_it_has_fallen(self):
        """rdot = -kappa V r, and V dt is the way: r = r0 exp(-kappa s) whatever the speed does."""
        motion = self.drop(0.0)
        fallen = motion.position[:, 2] + 60.0
        np.testing.assert_allclose(motion.rate[:, 2], 70.0 * np.exp(-self.kappa * fallen), rtol=1e-10)

    def test_at_terminal_speed_the_spin_decays_exponentially(self):
        """V constant: the linear drag of the spin, r = r0 exp(-kappa v_t t)."""
        motion = self.drop(self.terminal)
        np.testing.assert_allclose(motion.velocity[:, 2], self.terminal, rtol=1e-12)
        np.testing.assert_allclose(motion.rate[:, 2], 70.0 * np.exp(-self.kappa * self.terminal * motion.t), rtol=1e-10)

    def test_a_side_force_linear_in_speed_turns_the_flight_in_a_circle(self):
        """Weightless and without drag, C_Y = CYr gamma bends the path at rho A CYr d r/(4 m), whatever the speed."""
        spin, CYr = 70.0, 0.3
        rate = RHO * BARE.area * CYr * BARE.diameter * spin / (4 * BARE.mass)
        release = Release([0, 0, -10.0], [20.0, 0, 0], 0.0, 0.0, 0.0, [0, 0, spin])
        motion = fly(BARE, WEIGHTLESS, release, [effect("aero.spin_side_force", CYr=CYr)], duration=3.0)
        angle = rate * motion.t
        circle = 20.0 / rate * np.column_stack((np.sin(angle), 1.0 - np.cos(angle)))  # to the right for r > 0
        np.testing.assert_allclose(motion.position[:, :2], circle, atol=1e-9)
        assert angle[-1] > 0.5

    def test_a_wind_carries_a_still_disc_along(self):
        """Seen from the moving air the fall is the same: positions shift by wind x time."""
        still = self.drop(2.0)
        wind = np.array([3.0, -2.0, 0.0])
        release = Release([0, 0, -60.0], np.array([0, 0, 2.0]) + wind, 0.0, 0.0, 0.0, [0, 0, 70.0])
        carried = fly(self.flat, in_wind(*wind), release, duration=3.0)
        np.testing.assert_allclose(carried.position, still.position + np.outer(still.t, wind), atol=1e-9)


#: symmetry holds up to rounding, which thousands of steps and a spin phase of 500 rad magnify
SYMMETRY = 1e-9


@pytest.mark.parametrize("degrees", [37.0, 90.0, 180.0, -112.0])
def test_turning_north_turns_the_flight(degrees):
    """Release and wind turned about the vertical: the whole flight turns, to the last moment."""
    angle = np.radians(degrees)
    wind, release = np.array([2.0, 1.0, 0.0]), throw()
    straight = fly(DRIVER, in_wind(*wind), release)
    into = C3(angle).T
    motion = fly(DRIVER, in_wind(*(into @ wind)), turned(release, angle))
    assert motion.end == pytest.approx(straight.end, abs=1e-9)
    np.testing.assert_allclose(motion.position, straight.position @ into.T, atol=SYMMETRY)
    np.testing.assert_allclose(motion.rate, straight.rate, atol=SYMMETRY)
    turned_back = into.T @ body_to_ned(motion.attitude)
    np.testing.assert_allclose(turned_back, body_to_ned(straight.attitude), atol=SYMMETRY)


def test_the_field_does_not_move_the_disc():
    strong = dataclasses.replace(FIELD, magnetic_field=np.array([0.0, 1e4, -5e4]))
    np.testing.assert_array_equal(fly(DRIVER, strong, throw()).position, fly(DRIVER, FIELD, throw()).position)


KEEP_THE_MIRROR = [
    effect("air.wind", w_north_m_s=3.0),
    effect("air.wind_shear", w_north_m_s=3.0, exponent=0.2),
    effect("air.gust", t_s=1.0, width_s=0.3, w_north_m_s=3.0),
    effect("air.density", ratio=0.9),
    effect("air.ground_effect", k=0.3),
    effect("aero.spin_side_force", CYr=0.05),
    effect("aero.spin_lift", CLr=0.05),
    effect("aero.spin_drag", CDrr=0.05),
    effect("aero.stall", k=0.5, alpha_stall_rad=0.1),
    effect("aero.yaw_reynolds", exponent=0.3),
    effect("aero.yaw_quadratic", CNrr=-0.002),
    effect("aero.yaw_alpha", CNraa=-0.1),
    effect("body.mass_imbalance", ex_m=0.001),
    effect("body.inertia_asymmetry", dIyy_kg_m2=2e-5),
    effect("event.impulse", t_s=1.0, dv_north_m_s=-1.0, dv_down_m_s=0.5),
    effect("event.spin_step", t_s=1.0, dr_rad_s=-5.0),
]
#: sideways things, and C_M = CMr gamma: a pitching moment that knows the direction of spin
BREAK_THE_MIRROR = [
    effect("aero.spin_pitching_moment", CMr=0.002),
    effect("air.wind", w_east_m_s=1.0),
    effect("air.wind_shear", w_east_m_s=1.0),
    effect("air.gust", t_s=1.0, w_east_m_s=1.0),
    effect("body.mass_imbalance", ey_m=0.001),
    effect("event.impulse", t_s=1.0, dv_east_m_s=1.0),
]


def mirror_error(effects: list[Effect]) -> float:
    """Largest distance (m) between a flight of 2 s and the reflection of its mirror throw."""
    release = throw(wobble=(2.0, -1.0))
    flight = fly(DRIVER, FIELD, release, effects, duration=2.0)
    other = fly(DRIVER, FIELD, mirrored(release), effects, duration=2.0)
    assert np.sign(other.rate[0, 2]) == -1.0
    return float(np.abs(other.position * [1.0, -1.0, 1.0] - flight.position).max())


def test_a_mirror_throw_with_reversed_spin_flies_the_mirror_flight():
    """The baseline, rolling moment included, to touch-down: roll, east, p and r change sign."""
    release = throw(wobble=(2.0, -1.0))
    flight, other = fly(DRIVER, FIELD, release), fly(DRIVER, FIELD, mirrored(release))
    assert abs(flight.position[-1, 1]) > 0.01  # it does curve
    np.testing.assert_allclose(other.position, flight.position * [1.0, -1.0, 1.0], atol=SYMMETRY)
    np.testing.assert_allclose(other.rate, flight.rate * [-1.0, 1.0, -1.0], atol=SYMMETRY)


@pytest.mark.parametrize("given", KEEP_THE_MIRROR, ids=lambda e: e.id)
def test_effects_without_a_sense_of_left_keep_the_mirror(given):
    assert mirror_error([given]) < SYMMETRY


@pytest.mark.parametrize("given", BREAK_THE_MIRROR, ids=lambda e: f"{e.id}-{e.value}")
def test_effects_with_a_sense_of_left_break_the_mirror(given):
    assert mirror_error([given]) > 1e6 * SYMMETRY


def spin_coefficient(motion: Motion, disc: Disc) -> np.ndarray:
    """C_Nr by (26) at every instant, V relative to the air."""
    V = np.linalg.norm(motion.velocity - motion.environment.wind, axis=1)
    rdot, r = motion.angular_acceleration[:, 2], motion.rate[:, 2]
    return 16 * disc.Izz * rdot / (V * r * RHO * np.pi * disc.diameter**4)


ORDINARY_THROWS = [
    throw(),
    throw(spin_deg_s=-4200.0, roll_deg=12.0),
    throw(speed=18.0),
    throw(speed=28.0, climb_deg=6.0),
    throw(speed=22.0, spin_deg_s=5500.0),
    throw(roll_deg=-25.0),
]


@pytest.mark.parametrize("release", ORDINARY_THROWS)
def test_the_paper_s_formula_gives_the_yaw_damping_back_where_there_is_no_rolling_moment(release):
    """(26) with CRr = CRp = 0, at every instant of a flight in wind: 1e-6 of CNr stated, rounding measured."""
    disc = with_aero(CRr=0.0, CRp=0.0)
    motion = fly(disc, in_wind(1.5, -2.0, 0.0), release)
    np.testing.assert_allclose(spin_coefficient(motion, disc), DRIVER.aero.CNr, rtol=1e-6)


@pytest.mark.parametrize("release", ORDINARY_THROWS)
def test_a_rolling_moment_biases_the_paper_s_formula_by_its_part_along_the_spin_axis(release):
    """R sin(alpha) on z_B, which (26) leaves out: sin(alpha) (CRr + CRp p_H/r) at every instant.

    Fitted to a flight by least squares of rdot on V r it is -3 to -18 % of C_Nr on ordinary throws.
    """
    motion = fly(DRIVER, FIELD, release)
    u, v, w = to_body(motion.attitude, motion.velocity).T
    p, q, r = motion.rate.T
    beta, alpha = np.arctan2(v, u), np.arctan2(w, np.hypot(u, v))
    p_H = np.cos(beta) * p + np.sin(beta) * q
    predicted = DRIVER.aero.CNr + np.sin(alpha) * (DRIVER.aero.CRr + DRIVER.aero.CRp * p_H / r)
    found = spin_coefficient(motion, DRIVER)
    np.testing.assert_allclose(found, predicted, atol=1e-12)
    weight = np.sum(motion.velocity**2, axis=1) * r**2
    bias = np.average(found, weights=weight) / DRIVER.aero.CNr - 1.0
    assert -0.18 < bias < -0.03


class TestNewtonAndEuler:
    """The motion written by the engine against force and moment equations written here."""

    release = throw(wobble=(3.0, -2.0))
    wind = np.array([2.5, -1.5, 0.3])

    def residuals(self, imbalance: tuple[float, float], dIyy: float) -> tuple[float, float]:
        effects = [
            effect("body.mass_imbalance", ex_m=imbalance[0], ey_m=imbalance[1]),
            effect("body.inertia_asymmetry", dIyy_kg_m2=dIyy),
        ]
        motion = fly(DRIVER, in_wind(*self.wind), self.release, effects, duration=1.0)
        e = np.array([*imbalance, 0.0])
        inertia = np.array([DRIVER.Ixx, DRIVER.Ixx + dIyy, DRIVER.Izz])
        force_error, moment_error = [], []
        for k in range(0, motion.t.size, 25):
            C_NB = body_to_ned(motion.attitude[k])
            rate = motion.rate[k]
            # air forces act at the geometric centre, with the velocity of the centre of mass
            force, moment = plain_wrench(DRIVER, RHO, C_NB.T @ (motion.velocity[k] - self.wind), rate)
            acceleration = G * DOWN + C_NB @ force / DRIVER.mass
            about_centre_of_mass = moment + np.cross(-e, force)
            turning = (about_centre_of_mass - np.cross(rate, inertia * rate)) / inertia
            force_error.append(motion.acceleration[k] - acceleration)
            moment_error.append(motion.angular_acceleration[k] - turning)
        return float(np.abs(force_error).max()), float(np.abs(moment_error).max())

    @pytest.mark.parametrize("imbalance", [(0.0, 0.0), (0.003, 0.0), (-0.001, 0.002)])
    @pytest.mark.parametrize("dIyy", [0.0, 4e-5])
    def test_every_recorded_acceleration_obeys_them(self, imbalance, dIyy):
        """m a = m g + F, I wdot + w x I w = M - e x F, to rounding: 1e-10 of some 10 m/s^2 and some 300 rad/s^2."""
        force_error, moment_error = self.residuals(imbalance, dIyy)
        assert force_error < 1e-9
        assert moment_error < 3e-8

    def test_an_off_centre_mass_makes_lift_twist_the_disc(self):
        """Three millimetres ahead of the lift the nose is heavy: wdot_y = -ex L/Iyy, against the balanced disc's."""
        given = [effect("body.mass_imbalance", ex_m=0.003)]
        release = throw(roll_deg=0.0, pitch_deg=0.0, climb_deg=0.0)
        balanced = fly(DRIVER, FIELD, release, duration=0.01)
        nose_heavy = fly(DRIVER, FIELD, release, given, duration=0.01)
        lift = 0.5 * RHO * 24.0**2 * DRIVER.area * DRIVER.aero.CL0
        change = nose_heavy.angular_acceleration[0] - balanced.angular_acceleration[0]
        # no side force and no drag moment at alpha = 0, where the lift stands along -z
        np.testing.assert_allclose(change, [0.0, -0.003 * lift / DRIVER.Ixx, 0.0], atol=1e-9)


AWKWARD = {
    "straight up": throw(speed=15.0, climb_deg=90.0, roll_deg=0.0, pitch_deg=0.0),
    "straight down": throw(speed=15.0, climb_deg=-90.0, roll_deg=0.0, pitch_deg=0.0, height=20.0),
    "edge on, the axis level and across": throw(roll_deg=90.0, pitch_deg=0.0),
    "edge on, the axis along the flight": throw(climb_deg=0.0, roll_deg=0.0, pitch_deg=90.0),
    "hammer": throw(climb_deg=35.0, roll_deg=170.0, pitch_deg=0.0),
    "pitch beyond the vertical": throw(roll_deg=180.0, pitch_deg=100.0),
    "dropped from rest": throw(speed=0.0, roll_deg=0.0, pitch_deg=0.0),
    "without spin": throw(spin_deg_s=0.0, roll_deg=0.0, pitch_deg=2.0),
}


@pytest.mark.parametrize("name", AWKWARD)
def test_no_attitude_is_singular(name):
    """A table keeps the coefficients sane at any angle; every state is finite and the flight reaches the ground."""
    disc, field = load_disc("dd2")
    motion = fly(disc, field, AWKWARD[name], duration=20.0)
    for values in (motion.position, motion.velocity, motion.acceleration, motion.rate, motion.angular_acceleration):
        assert np.all(np.isfinite(values))
    assert motion.touched_down
    assert np.abs(motion.rate).max() < 150.0


@pytest.mark.parametrize("name", ["edge on, the axis level and across", "hammer", "straight up"])
def test_awkward_flights_converge(name):
    """Halving the step moves half a second of flight by less than a micrometre."""
    disc, field = load_disc("dd2")
    coarse = fly(disc, field, AWKWARD[name], duration=0.5)
    fine = fly(disc, field, AWKWARD[name], duration=0.5, timestep=0.5e-3)
    np.testing.assert_allclose(coarse.position[-1], fine.position[-1], atol=1e-6)


class TestGround:
    @pytest.mark.parametrize("effects", [[], [effect("body.mass_imbalance", ex_m=0.003)]], ids=["plain", "unbalanced"])
    def test_a_stopped_flight_ends_with_the_centre_of_mass_on_the_ground(self, effects):
        motion = fly(DRIVER, FIELD, throw(), effects)
        assert motion.touched_down
        assert abs(motion.position[-1, 2]) < 1e-6
        assert np.all(motion.position[:-1, 2] < 0.0)

    def test_touch_down_does_not_depend_on_the_step(self):
        """Flights with 1 and 0.4 ms agree to the 0.1 ms stated for touch-down, and better: RK4 differs by 1e-7 s."""
        coarse, fine = fly(DRIVER, FIELD, throw()), fly(DRIVER, FIELD, throw(), timestep=0.4e-3)
        assert coarse.end == pytest.approx(fine.end, abs=1e-6)

    def test_a_skipping_disc_comes_to_rest_above_the_ground(self):
        """Contact starts at the rim, so up to its first touch the flight is the stopped one; then it rests flat."""
        release = throw(speed=14.0, climb_deg=2.0, roll_deg=0.0, pitch_deg=6.0)
        stopped = fly(DRIVER, FIELD, release)
        skipping = fly(DRIVER, FIELD, release, ground="skip")
        before = stopped.position[:, 2] < -DRIVER.diameter / 2
        n = np.argmin(before)
        np.testing.assert_array_equal(skipping.position[:n], stopped.position[:n])
        assert n > 100
        assert not skipping.touched_down
        assert stopped.end + 0.1 < skipping.end < 29.0
        half_height = 0.008
        assert -skipping.position[-1, 2] == pytest.approx(half_height, abs=0.001)  # turf gives way a little
        assert np.abs(skipping.velocity[-1]).max() < 0.02
        assert np.linalg.norm(skipping.position[-1, :2] - stopped.position[-1, :2]) > 0.5  # it slid on

    def test_a_flight_ends_after_its_duration(self):
        motion = fly(DRIVER, FIELD, throw(), duration=0.25)
        assert motion.end == pytest.approx(0.25, abs=1e-12)
        assert not motion.touched_down


class TestRefusals:
    @pytest.mark.parametrize("integrator", ["mjINT_EULER", "mjINT_IMPLICIT", "mjINT_IMPLICITFAST"])
    def test_an_integrator_that_spoils_spin_is_refused_with_the_reason(self, integrator):
        flying = FlyingDisc(DRIVER, FIELD)
        flying.model.opt.integrator = getattr(mujoco.mjtIntegrator, integrator)
        with pytest.raises(InputError, match=rf"{integrator[6:]}, expected RK4: .* wobble"), flying.air():
            pass

    def test_disabled_springs_and_dampers_are_refused_as_they_silence_the_callback(self):
        flying = FlyingDisc(DRIVER, FIELD)
        spring, damper = mujoco.mjtDisableBit.mjDSBL_SPRING, mujoco.mjtDisableBit.mjDSBL_DAMPER
        flying.model.opt.disableflags = spring
        check_model(flying.model)  # one of them does no harm
        flying.model.opt.disableflags = spring | damper
        with pytest.raises(InputError, match="switches the passive callback off"), flying.air():
            pass

    @pytest.mark.parametrize("field", ["density", "viscosity"])
    def test_mujocos_own_air_is_refused(self, field):
        flying = FlyingDisc(DRIVER, FIELD)
        setattr(flying.model.opt, field, 0.01)
        with pytest.raises(InputError, match=r"MuJoCo's own air is on .* brake the disc"), flying.air():
            pass

    def test_a_disc_without_coefficients_does_not_fly(self):
        with pytest.raises(InputError, match=r"expected \[disc.aero\]"):
            FlyingDisc(dataclasses.replace(DRIVER, aero=None), FIELD)

    def test_a_place_without_air_does_not_fly_a_disc(self):
        with pytest.raises(InputError, match="expected air_density_kg_m3"):
            FlyingDisc(DRIVER, Environment(air_density=None))

    @pytest.mark.parametrize("missing", ["velocity", "body_rate"])
    def test_a_throw_needs_velocity_and_spin(self, missing):
        with pytest.raises(InputError, match=f"a throw needs {missing}"):
            fly(DRIVER, FIELD, dataclasses.replace(throw(), **{missing: None}))

    def test_a_throw_starts_above_the_ground(self):
        with pytest.raises(InputError, match="expected above the ground"):
            fly(DRIVER, FIELD, throw(height=0.0))


def test_the_model_is_the_disc_that_was_asked_for():
    disc = dataclasses.replace(DRIVER, mass=0.15, Ixx=5e-4, Izz=9e-4)
    effects = [effect("body.mass_imbalance", ex_m=0.002), effect("body.inertia_asymmetry", dIyy_kg_m2=1e-5)]
    model = FlyingDisc(disc, FIELD, effects, timestep=5e-4).model
    body = model.body("disc")
    assert body.mass[0] == 0.15
    np.testing.assert_allclose(body.inertia, [5e-4, 5.1e-4, 9e-4], rtol=1e-15)
    np.testing.assert_allclose(body.ipos, [0.002, 0.0, 0.0], rtol=1e-15)
    assert model.opt.timestep == 5e-4
    assert model.opt.gravity[2] == -FIELD.gravity
    assert all(model.geom(i).contype[0] == 0 for i in range(model.ngeom))


def test_flights_repeat_to_the_last_bit():
    flights = [fly(DRIVER, FIELD, throw(), duration=1.0) for _ in range(2)]
    for name, (one, two) in itertools.product(("position", "attitude", "rate"), [flights]):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))


class TestDivergence:
    @pytest.mark.parametrize(
        ("rate", "push", "expected"),
        [([4900.0, 0.0, 4900.0], 0.0, "6.93 rad in a step"), ([0.0, 0.0, 73.0], 1e300, "no number")],
    )
    def test_a_motion_that_diverges_is_one_error_and_leaves_no_log(self, rate, push, expected, tmp_path, monkeypatch):
        """6930 rad/s turn a disc once in a step; MuJoCo itself would start such a state anew without a word.

        A moment that is infinite either way is no number.
        """
        monkeypatch.chdir(tmp_path)
        disc, environment = load_disc("driver")
        law = Law("c * V^30 * |r|^30 - c * V^30 * |r|^30", "moment_z_N_m", {"c": push})
        with pytest.raises(InputError, match=expected):
            fly(disc, environment, Release(velocity=[24.0, 0.0, -4.0], body_rate=rate), law=law)
        assert not any(tmp_path.iterdir())
        assert mujoco.get_mjcb_passive() is None

    def test_inertias_that_no_body_has_are_refused(self):
        disc, environment = load_disc("driver")
        throw = Release(velocity=[24.0, 0.0, -4.0], body_rate=[0.0, 0.0, 73.0])
        with pytest.raises(InputError, match="no rigid body"):
            fly(disc, environment, throw, [effect("body.inertia_asymmetry", dIyy_kg_m2=-1.0)])

    @pytest.mark.parametrize(("id", "name"), [("air.density", "ratio"), ("air.gust", "width_s")])
    def test_sizes_without_a_meaning_are_refused(self, id, name):
        with pytest.raises(InputError, match=f"{id}: {name} is 0; expected a number above zero"):
            effect(id, **{name: 0.0})
