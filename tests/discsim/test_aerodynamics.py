from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy.interpolate import RectBivariateSpline
from support.flights import DRIVER, FIELD, throw, with_aero
from support.plain_air import plain_wrench

from discsim.aerodynamics import advance_ratio, air_wrench, static_coefficients, yaw_damping
from discsim.disc import Aero, AeroTable, Disc, YawDampingTable
from discsim.engine import fly
from discsim.errors import InputError
from discsim.frames import C2, C3
from discsim.parameters import PARAMETERS, parameters, tables
from discsim.shipped import load_disc

#: the compiled air and the plain one round differently: some tens of operations on either side
ROUNDING = 1e-12

speeds = st.floats(-30.0, 30.0)
tilts = st.floats(-10.0, 10.0)
spins = st.floats(-120.0, 120.0)


def wrench(disc: Disc, velocity, rate, h: float = 50.0) -> tuple[np.ndarray, np.ndarray]:
    p = parameters(FIELD, disc).view(PARAMETERS)[0]
    six = air_wrench(p, tables(disc), h, *map(float, velocity), *map(float, rate))
    return np.array(six[:3]), np.array(six[3:])


def flow_at(alpha: float, V: float = 20.0) -> np.ndarray:
    return V * np.array([np.cos(alpha), 0.0, np.sin(alpha)])


@given(u=speeds, v=speeds, w=speeds, p=tilts, q=tilts, r=spins)
def test_force_and_moment_are_those_of_the_physics_reference(u, v, w, p, q, r):
    """(14)-(17), (20), (21)/(23) with the H frame (A2), in any wind, also backwards and upside down."""
    velocity, rate = np.array([u, v, w]), np.array([p, q, r])
    assume(np.hypot(u, v) > 1e-3)
    force, moment = wrench(DRIVER, velocity, rate)
    plain_force, plain_moment = plain_wrench(DRIVER, FIELD.air_density, velocity, rate)
    scale = np.linalg.norm(plain_force)
    np.testing.assert_allclose(force, plain_force, rtol=ROUNDING, atol=ROUNDING * scale)
    np.testing.assert_allclose(moment, plain_moment, rtol=ROUNDING, atol=ROUNDING * scale * DRIVER.diameter)


@given(alpha=st.floats(-np.pi, np.pi))
def test_the_matrix_that_21_prints_is_that_of_23(alpha):
    """(21) has the transpose of C2(-alpha), (23) C2(alpha)."""
    np.testing.assert_allclose(C2(-alpha).T, C2(alpha), rtol=0, atol=1e-16)


@given(u=speeds, v=speeds, w=speeds, p=tilts, q=tilts, r=spins, turn=st.floats(-np.pi, np.pi))
def test_an_axisymmetric_disc_does_not_know_where_its_x_axis_points(u, v, w, p, q, r, turn):
    """The same wind in axes turned about z_B: the same force and moment in those axes. Both engines rely on it."""
    assume(np.hypot(u, v) > 1e-3)
    into = C3(turn)
    force, moment = wrench(DRIVER, [u, v, w], [p, q, r])
    force_turned, moment_turned = wrench(DRIVER, into @ [u, v, w], into @ [p, q, r])
    scale = np.linalg.norm(force)
    np.testing.assert_allclose(force_turned, into @ force, atol=1e-11 * scale)
    np.testing.assert_allclose(moment_turned, into @ moment, atol=1e-11 * scale)


def test_drag_opposes_the_motion_and_lift_lifts():
    """Level disc sinking through the air (alpha > 0): drag against the velocity, lift across it and upwards."""
    velocity = flow_at(0.1)
    drag_only, _ = wrench(with_aero(CL0=0.0, CLa=0.0), velocity, [0, 0, 0])
    assert drag_only @ velocity == pytest.approx(-np.linalg.norm(drag_only) * 20.0, rel=1e-12)
    lift_only, _ = wrench(with_aero(CD0=0.0, CDa=0.0), velocity, [0, 0, 0])
    assert lift_only @ velocity == pytest.approx(0.0, abs=1e-12)
    assert lift_only[2] < 0.0  # z_B points down


def test_a_positive_pitching_moment_raises_the_nose():
    """C_M > 0 is nose up, +q; and CMq < 0 opposes the pitch rate."""
    _, moment = wrench(with_aero(CM0=0.05, CMa=0.0), flow_at(0.0), [0, 0, 0])
    assert moment[1] > 0.0
    _, still = wrench(DRIVER, flow_at(0.0), [0, 0, 0])
    _, pitching = wrench(DRIVER, flow_at(0.0), [0, 3.0, 0])
    assert pitching[1] < still[1]


@pytest.mark.parametrize("spin", [70.0, -70.0])
def test_yaw_damping_opposes_the_spin_either_way(spin):
    _, moment = wrench(with_aero(CRr=0.0), flow_at(0.1), [0, 0, spin])
    assert moment[2] * spin < 0.0
    _, rolling = wrench(DRIVER, flow_at(0.1), [0, 0, spin])
    assert rolling[0] * spin > 0.0  # CRr > 0: the side that advances, left for r > 0, lifts more


def test_the_rolling_moment_leans_on_the_spin_axis_by_its_sine():
    """(23): R acts along the wind's x axis, so R sin(alpha) is felt about z_B, which (26) neglects."""
    alpha, spin = 0.2, 70.0
    disc = with_aero(CNr=0.0)
    _, moment = wrench(disc, flow_at(alpha), [0, 0, spin])
    QAd = 0.5 * FIELD.air_density * 20.0**2 * disc.area * disc.diameter
    R = QAd * disc.aero.CRr * disc.diameter * spin / 40.0
    assert moment[0] == pytest.approx(R * np.cos(alpha), rel=1e-12)
    assert moment[2] == pytest.approx(R * np.sin(alpha), rel=1e-12)


def test_the_advance_ratio_is_rim_speed_over_airspeed():
    """(15), with the sign of the spin."""
    assert advance_ratio(0.2, 80.0, 16.0) == pytest.approx(0.1 * 80.0 / 16.0, rel=1e-15)
    assert advance_ratio(0.2, -80.0, 16.0) < 0.0


@pytest.mark.parametrize("speed", [0.0, 1e-9, 1e-7])
def test_still_air_does_nothing(speed):
    """d/(2 V) has no meaning there; below a micrometre a second the wrench is exactly zero."""
    force, moment = wrench(DRIVER, [speed, 0, 0], [1.0, 2.0, 70.0])
    np.testing.assert_array_equal(np.concatenate((force, moment)), np.zeros(6))


@pytest.mark.parametrize("w", [12.0, -12.0])
@pytest.mark.parametrize("sideways", [0.0, 1e-9, 1e-6])
def test_the_force_has_no_singularity_along_the_axis(w, sideways):
    """alpha = +-90 deg: drag along the axis; the direction of x_H, and with it the lift's, jumps with beta."""
    disc = with_aero(CL0=0.0, CLa=0.0, CM0=0.0, CMa=0.0)
    force, moment = wrench(disc, [0.0, sideways, w], [0.0, 0.0, 70.0])
    a = disc.aero
    CD = a.CD0 + a.CDa * (np.copysign(np.pi / 2, w) - a.alpha0) ** 2
    drag = 0.5 * FIELD.air_density * w * w * disc.area * CD
    np.testing.assert_allclose(force, [0, 0, -np.copysign(drag, w)], atol=1e-6 * drag)
    assert np.all(np.isfinite(moment))


class TestStaticTable:
    nodes = np.array([-0.4, -0.1, 0.05, 0.3, 1.2])
    table = AeroTable(nodes, np.sin(nodes), 0.1 + nodes**2, 0.02 * np.cos(nodes))
    disc = dataclasses.replace(DRIVER, aero_table=table)

    def coefficients(self, alpha: float, disc: Disc | None = None) -> np.ndarray:
        disc = disc or self.disc
        return np.array(static_coefficients(parameters(FIELD, disc).view(PARAMETERS)[0], tables(disc), alpha))

    @given(alpha=st.floats(-1.57, 1.57))
    def test_it_is_linear_between_nodes_and_constant_outside(self, alpha):
        """`numpy.interp` is both; the two differ by rounding."""
        expected = [np.interp(alpha, self.nodes, column) for column in (self.table.CL, self.table.CD, self.table.CM)]
        np.testing.assert_allclose(self.coefficients(alpha), expected, rtol=1e-14, atol=1e-15)

    def test_it_passes_through_its_nodes(self):
        got = np.array([self.coefficients(alpha) for alpha in self.nodes])
        np.testing.assert_allclose(got, np.column_stack((self.table.CL, self.table.CD, self.table.CM)), rtol=1e-15)

    @given(alpha=st.floats(-0.5, 0.5), r=spins)
    def test_a_linear_law_tabulated_is_that_law(self, alpha, r):
        """CDa = 0, as a parabola is not linear between nodes."""
        linear = with_aero(CDa=0.0)
        a = linear.aero
        nodes = np.linspace(-0.5, 0.5, 7)
        table = AeroTable(nodes, a.CL0 + a.CLa * nodes, np.full(7, a.CD0), a.CM0 + a.CMa * nodes)
        # with the table, the seven static coefficients must not matter
        rates_only = Aero(CMq=a.CMq, CRr=a.CRr, CRp=a.CRp, CNr=a.CNr)
        tabulated = dataclasses.replace(linear, aero=rates_only, aero_table=table)
        for got, expected in zip(
            wrench(tabulated, flow_at(alpha), [1.0, 2.0, r]), wrench(linear, flow_at(alpha), [1.0, 2.0, r]), strict=True
        ):
            np.testing.assert_allclose(got, expected, rtol=1e-11, atol=1e-13)


class TestYawDampingTable:
    """The paper's grid (27), 4500 to 7000 deg/s in 50s, 6 to 23 m/s in 0.5s; between its nodes a bicubic spline."""

    rate_deg = np.arange(4500.0, 7000.1, 50.0)
    speed = np.arange(6.0, 23.01, 0.5)
    random = np.random.default_rng(26)
    values = -0.0045 + 0.0005 * random.standard_normal((51, 35))
    disc = dataclasses.replace(DRIVER, yaw_damping_table=YawDampingTable(np.radians(rate_deg), speed, values))

    def CNr(self, rate_deg: float, V: float, disc: Disc | None = None) -> float:
        disc = disc or self.disc
        p = parameters(FIELD, disc).view(PARAMETERS)[0]
        return yaw_damping(p, tables(disc), float(np.radians(rate_deg)), V)

    def test_the_papers_grid_has_51_by_35_nodes(self):
        assert (self.rate_deg.size, self.speed.size) == (51, 35)

    def test_it_passes_through_every_node(self):
        p, lookup = parameters(FIELD, self.disc).view(PARAMETERS)[0], tables(self.disc)
        got = [[yaw_damping(p, lookup, r, V) for V in self.speed] for r in self.disc.yaw_damping_table.rate]
        np.testing.assert_allclose(got, self.values, rtol=1e-12)

    def test_between_the_nodes_it_is_the_bicubic_spline(self):
        """Second route: FITPACK's interpolating spline, not-a-knot in both directions as well."""
        fitpack = RectBivariateSpline(np.radians(self.rate_deg), self.speed, self.values, kx=3, ky=3, s=0)
        for rate, V in np.random.default_rng(27).uniform([4500, 6], [7000, 23], (200, 2)):
            assert self.CNr(rate, V) == pytest.approx(float(fitpack(np.radians(rate), V)[0, 0]), rel=1e-9)

    def test_the_direction_of_spin_does_not_matter(self):
        assert self.CNr(-5130.0, 11.1) == self.CNr(5130.0, 11.1)

    @pytest.mark.parametrize(("rate", "V"), [(4499.0, 12.0), (7001.0, 12.0), (5000.0, 5.9), (5000.0, 23.1)])
    def test_outside_there_is_no_number(self, rate, V):
        assert np.isnan(self.CNr(rate, V))

    @pytest.mark.parametrize(("rate", "V"), [(4500.0, 6.0), (7000.0, 23.0)])
    def test_the_corners_belong_to_it(self, rate, V):
        """In radians and back the corner must not slip out of its own table."""
        table = self.disc.yaw_damping_table
        p, lookup = parameters(FIELD, self.disc).view(PARAMETERS)[0], tables(self.disc)
        corner = table.rate[0] if rate == 4500.0 else table.rate[-1]
        assert np.isfinite(yaw_damping(p, lookup, corner, V))

    def test_a_flight_that_leaves_it_says_when_and_how_fast(self):
        """A disc released at 4600 deg/s loses 100 deg/s within a second."""
        with pytest.raises(InputError, match=r"at 0\.\d{3} s the disc spins at 4500 deg/s .* outside its C_Nr table"):
            fly(self.disc, FIELD, throw(speed=22.0, spin_deg_s=4600.0))

    def test_a_constant_table_flies_like_the_constant(self):
        """A spline through equal values is that value up to rounding; so is the flight."""
        flat = YawDampingTable(self.disc.yaw_damping_table.rate, self.speed, np.full((51, 35), DRIVER.aero.CNr))
        release = throw(speed=22.0, spin_deg_s=6000.0)
        with_table = fly(dataclasses.replace(DRIVER, yaw_damping_table=flat), FIELD, release, duration=1.0)
        constant = fly(DRIVER, FIELD, release, duration=1.0)
        np.testing.assert_allclose(with_table.rate, constant.rate, atol=1e-9)


def test_the_density_scales_the_wrench():
    force, moment = wrench(DRIVER, flow_at(0.1), [1.0, 2.0, 70.0])
    thin = dataclasses.replace(FIELD, air_density=FIELD.air_density / 2)
    p = parameters(thin, DRIVER).view(PARAMETERS)[0]
    half = air_wrench(p, tables(DRIVER), 50.0, *flow_at(0.1), 1.0, 2.0, 70.0)
    np.testing.assert_allclose(half, np.concatenate((force, moment)) / 2, rtol=1e-14)


def test_every_shipped_disc_has_a_wrench_at_every_angle_of_attack():
    for name in ("driver", "ultrastar", "dd2", "cd1", "cd5", "fd2"):
        disc, _ = load_disc(name)
        for alpha in np.radians(np.arange(-90.0, 91.0)):
            assert np.all(np.isfinite(wrench(disc, flow_at(alpha), [1.0, 2.0, 70.0])))
