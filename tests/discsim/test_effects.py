"""Every effect on a flight: nothing at its baseline, and in its size the form of docs/effects.md, written again."""

from __future__ import annotations

import numpy as np
import pytest
from support.flights import BARE, DRIVER, FIELD, WEIGHTLESS, in_wind, throw
from support.plain_air import Change, Coefficients, Flow, plain_wrench

from discsim.aerodynamics import air_wrench, wind
from discsim.effects import CATALOGUE, Effect, effect
from discsim.engine import FlyingDisc, fly
from discsim.errors import InputError
from discsim.frames import body_to_ned, to_body
from discsim.motion import Motion
from discsim.parameters import PARAMETERS, parameter_index, parameters, tables

ON_MOTION = [row for row in CATALOGUE.values() if row.acts_on == "motion"]
IN_FLIGHT = [row for row in ON_MOTION if "flight" in row.plants]
#: rounding of a few hundred operations written in another order
ROUNDING = 1e-11

VELOCITY = np.array([18.0, -3.0, 2.5])
RATE = np.array([1.5, -0.7, 71.0])
HEIGHT = 0.4


def compiled_wrench(effects: list[Effect], velocity=VELOCITY, rate=RATE) -> np.ndarray:
    p = parameters(FIELD, DRIVER, effects=effects).view(PARAMETERS)[0]
    return np.array(air_wrench(p, tables(DRIVER), HEIGHT, *map(float, velocity), *map(float, rate)))


def plain(change: Change | None, velocity=VELOCITY, rate=RATE, density_ratio: float = 1.0) -> np.ndarray:
    density = FIELD.air_density * density_ratio
    return np.concatenate(plain_wrench(DRIVER, density, velocity, rate, HEIGHT, change))


@pytest.mark.parametrize("row", ON_MOTION, ids=lambda row: row.id)
def test_an_effect_at_its_baseline_changes_no_bit_of_a_flight(row):
    """Near the ground and with wind, so that every term would have something to act on."""
    surroundings = in_wind(2.0, 1.0, 0.0)
    release = throw(speed=20.0, climb_deg=4.0, wobble=(2.0, -1.0))
    without = fly(DRIVER, surroundings, release, duration=0.4)
    at_baseline = fly(DRIVER, surroundings, release, [Effect(row.id, row.baseline)], duration=0.4)
    for name in ("t", "position", "velocity", "acceleration", "attitude", "rate", "angular_acceleration"):
        np.testing.assert_array_equal(getattr(at_baseline, name), getattr(without, name))


def test_all_baselines_together_change_no_bit_either():
    release = throw(wobble=(2.0, -1.0))
    everything = [Effect(row.id, row.baseline) for row in CATALOGUE.values()]
    np.testing.assert_array_equal(
        fly(DRIVER, FIELD, release, everything, duration=0.4).position,
        fly(DRIVER, FIELD, release, duration=0.4).position,
    )


@pytest.mark.parametrize("row", IN_FLIGHT, ids=lambda row: row.id)
def test_an_effect_on_flights_does_move_the_disc(row):
    """Ten times the catalogue's scale (a ratio or exponent off its baseline by as much) shows in the flight."""
    values = dict(zip(row.parameters, np.array(row.baseline) + 10 * np.array(row.scale), strict=True))
    if "alpha_stall_rad" in values:
        values["alpha_stall_rad"] = 0.02
    release = throw(speed=20.0, climb_deg=4.0, wobble=(2.0, -1.0))
    plain_flight = fly(DRIVER, FIELD, release, duration=0.6)
    changed = fly(DRIVER, FIELD, release, [effect(row.id, **values)], duration=0.6)
    moved = np.abs(changed.velocity - plain_flight.velocity).max() / 20.0
    turned = np.abs(changed.rate - plain_flight.rate).max() / 70.0
    assert max(moved, turned) > 1e-6


def spin_side_force(C: Coefficients, f: Flow) -> None:
    C["Y"] += 0.04 * f.gamma


def spin_lift(C: Coefficients, f: Flow) -> None:
    C["L"] += 0.04 * abs(f.gamma)


def spin_drag(C: Coefficients, f: Flow) -> None:
    C["D"] += 0.04 * f.gamma**2


def spin_pitching_moment(C: Coefficients, f: Flow) -> None:
    C["M"] += 0.004 * f.gamma


def stall(C: Coefficients, f: Flow) -> None:
    if f.alpha > 0.05:
        C["L"] -= 0.6 * DRIVER.aero.CLa * (f.alpha - 0.05)


def yaw_reynolds(C: Coefficients, f: Flow) -> None:
    C["N"] *= (f.V / 15.0) ** 0.7


def yaw_quadratic(C: Coefficients, f: Flow) -> None:
    C["N"] += -0.002 * f.gamma * abs(f.gamma)


def yaw_alpha(C: Coefficients, f: Flow) -> None:
    C["N"] += -0.3 * f.gamma * f.alpha**2


def ground_effect(C: Coefficients, f: Flow) -> None:
    C["L"] *= 1 + 0.3 * np.exp(-f.h / (2 * f.d))


FORMS: list[tuple[Effect, Change]] = [
    (effect("aero.spin_side_force", CYr=0.04), spin_side_force),
    (effect("aero.spin_lift", CLr=0.04), spin_lift),
    (effect("aero.spin_drag", CDrr=0.04), spin_drag),
    (effect("aero.spin_pitching_moment", CMr=0.004), spin_pitching_moment),
    (effect("aero.stall", k=0.6, alpha_stall_rad=0.05), stall),
    (effect("aero.yaw_reynolds", exponent=0.7), yaw_reynolds),
    (effect("aero.yaw_quadratic", CNrr=-0.002), yaw_quadratic),
    (effect("aero.yaw_alpha", CNraa=-0.3), yaw_alpha),
    (effect("air.ground_effect", k=0.3), ground_effect),
]


@pytest.mark.parametrize("spin", [71.0, -71.0])
@pytest.mark.parametrize(("given", "form"), FORMS, ids=[given.id for given, _ in FORMS])
def test_a_coefficient_s_effect_has_the_form_of_the_reference(given, form, spin):
    """At alpha = 0.14 rad, both directions of spin, 0.4 m above the ground."""
    rate = np.array([*RATE[:2], spin])
    expected = plain(form, rate=rate)
    scale = np.abs(expected).max()
    np.testing.assert_allclose(compiled_wrench([given], rate=rate), expected, atol=ROUNDING * scale)
    assert np.abs(expected - plain(None, rate=rate)).max() > 1e-4 * scale  # the effect is there to be seen


def test_no_lift_is_lost_below_the_stall():
    late = effect("aero.stall", k=0.6, alpha_stall_rad=0.2)  # the flow here has alpha = 0.14 rad
    np.testing.assert_array_equal(compiled_wrench([late]), compiled_wrench([]))


def test_ground_effect_multiplies_the_lift_last():
    """Spin lift and stall are inside the bracket, whatever the order they are given in."""

    def all_three(C: Coefficients, f: Flow) -> None:
        spin_lift(C, f)
        stall(C, f)
        ground_effect(C, f)

    given = [
        effect("air.ground_effect", k=0.3),
        effect("aero.stall", k=0.6, alpha_stall_rad=0.05),
        effect("aero.spin_lift", CLr=0.04),
    ]
    np.testing.assert_allclose(compiled_wrench(given), plain(all_three), atol=ROUNDING * 10)
    np.testing.assert_array_equal(compiled_wrench(given), compiled_wrench(given[::-1]))


def test_ground_effect_stops_growing_at_2_cm():
    """h = max(-down, 0.02 m): on the ground and below it counts as 2 cm."""
    p = parameters(FIELD, DRIVER, effects=[effect("air.ground_effect", k=0.3)]).view(PARAMETERS)[0]
    flow = (*VELOCITY, *RATE)
    low, ground, below = (air_wrench(p, tables(DRIVER), h, *flow) for h in (0.02, 0.0, -1.0))
    assert low == ground == below
    assert low != air_wrench(p, tables(DRIVER), 0.03, *flow)


def test_density_scales_all_of_the_air():
    np.testing.assert_allclose(
        compiled_wrench([effect("air.density", ratio=0.93)]), plain(None, density_ratio=0.93), rtol=1e-12
    )


def wind_at(t: float, h: float, *effects: Effect) -> np.ndarray:
    p = parameters(in_wind(2.0, -1.0, 0.25), DRIVER, effects=effects).view(PARAMETERS)[0]
    return np.array(wind(p, tables(DRIVER), t, 0.0, 0.0, h))


KNOWN = np.array([2.0, -1.0, 0.25])


def test_wind_adds_to_the_known_wind():
    np.testing.assert_array_equal(wind_at(1.0, 5.0), KNOWN)
    got = wind_at(1.0, 5.0, effect("air.wind", w_north_m_s=0.5, w_east_m_s=1.5))
    np.testing.assert_allclose(got, KNOWN + np.array([0.5, 1.5, 0.0]), rtol=1e-15)


@pytest.mark.parametrize("h", [0.5, 10.0, 25.0])
def test_wind_shear_grows_as_a_power_of_height(h):
    got = wind_at(1.0, h, effect("air.wind_shear", w_north_m_s=4.0, w_east_m_s=-2.0, exponent=0.25))
    np.testing.assert_allclose(got, KNOWN + np.array([4.0, -2.0, 0.0]) * (h / 10.0) ** 0.25, rtol=1e-14)


def test_wind_shear_stops_falling_at_2_cm():
    shear = effect("air.wind_shear", w_north_m_s=4.0, exponent=0.25)
    np.testing.assert_array_equal(wind_at(1.0, 0.0, shear), wind_at(1.0, 0.02, shear))
    np.testing.assert_array_equal(wind_at(1.0, -0.5, shear), wind_at(1.0, 0.02, shear))


@pytest.mark.parametrize("t", [0.0, 1.1, 1.5, 3.0])
def test_a_gust_passes_as_a_gaussian(t):
    got = wind_at(t, 5.0, effect("air.gust", t_s=1.5, width_s=0.4, w_north_m_s=3.0, w_east_m_s=1.0))
    expected = KNOWN + np.array([3.0, 1.0, 0.0]) * np.exp(-(((t - 1.5) / 0.4) ** 2) / 2)
    np.testing.assert_allclose(got, expected, rtol=1e-14)


def test_wind_effects_add_up():
    all_of_them = wind_at(
        1.4,
        3.0,
        effect("air.wind", w_north_m_s=0.5),
        effect("air.wind_shear", w_north_m_s=4.0, exponent=0.25),
        effect("air.gust", t_s=1.5, width_s=0.4, w_north_m_s=3.0),
    )
    north = 2.0 + 0.5 + 4.0 * 0.3**0.25 + 3.0 * np.exp(-0.5 * 0.25**2)
    np.testing.assert_allclose(all_of_them, [north, -1.0, 0.25], rtol=1e-14)


def test_wind_in_the_effect_is_wind_in_the_surroundings():
    """Known and unknown wind are the same air: 1e-12 m, as 0 + w and w + 0 differ by nothing."""
    as_effect = fly(DRIVER, FIELD, throw(), [effect("air.wind", w_north_m_s=1.5, w_east_m_s=-2.0)], duration=1.0)
    as_known = fly(DRIVER, in_wind(1.5, -2.0, 0.0), throw(), duration=1.0)
    np.testing.assert_allclose(as_effect.position, as_known.position, atol=1e-12)


@pytest.mark.parametrize("t", [0.9, 1.0, 1.1])
def test_the_engine_hands_wind_the_time_and_the_height_of_the_centre_of_mass(t):
    """Acceleration in a gust and a shear, at the engine's own instants, against (18) written here."""
    given = [
        effect("air.gust", t_s=1.0, width_s=0.05, w_north_m_s=6.0, w_east_m_s=-4.0),
        effect("air.wind_shear", w_north_m_s=5.0, exponent=0.3),
    ]
    motion = fly(DRIVER, FIELD, throw(), given, duration=1.2)
    k = round(t * 1000)
    gust = np.array([6.0, -4.0, 0.0]) * np.exp(-(((motion.t[k] - 1.0) / 0.05) ** 2) / 2)
    shear = np.array([5.0, 0.0, 0.0]) * (-motion.position[k, 2] / 10.0) ** 0.3
    relative = to_body(motion.attitude[k], motion.velocity[k] - gust - shear)
    force, _ = plain_wrench(DRIVER, FIELD.air_density, relative, motion.rate[k])
    expected = body_to_ned(motion.attitude[k]) @ force / DRIVER.mass + [0, 0, FIELD.gravity]
    np.testing.assert_allclose(motion.acceleration[k], expected, atol=1e-9)


def steady(motion: Motion, before: float, after: float) -> tuple[np.ndarray, np.ndarray]:
    """Row numbers of two instants."""
    return np.argmin(np.abs(motion.t - before)), np.argmin(np.abs(motion.t - after))


class TestImpulse:
    """Without air and gravity nothing else moves the disc. The pulse has sigma = 10 ms; seven of them hold it but for
    2.6e-12 of its area, and RK4 at 1 ms integrates a Gaussian of ten steps a sigma to 1e-9."""

    dv = np.array([0.8, -0.5, 0.3])
    touch = effect("event.impulse", t_s=0.2, dv_north_m_s=0.8, dv_east_m_s=-0.5, dv_down_m_s=0.3)

    @pytest.mark.parametrize("imbalance", [0.0, 0.002])
    def test_it_changes_the_velocity_by_dv_and_leaves_the_rates(self, imbalance):
        unbalanced = effect("body.mass_imbalance", ex_m=imbalance, ey_m=-imbalance)
        release = throw(wobble=(2.0, 1.0))
        untouched = fly(BARE, WEIGHTLESS, release, [unbalanced], duration=0.4)
        motion = fly(BARE, WEIGHTLESS, release, [unbalanced, self.touch], duration=0.4)
        before, after = steady(motion, 0.13, 0.27)
        np.testing.assert_allclose(motion.velocity[after] - motion.velocity[before], self.dv, atol=1e-8)
        np.testing.assert_allclose(motion.rate, untouched.rate, atol=1e-8)
        np.testing.assert_allclose(motion.angular_acceleration, untouched.angular_acceleration, atol=1e-8)

    def test_its_acceleration_is_the_gaussian_of_the_reference(self):
        motion = fly(BARE, WEIGHTLESS, throw(), [self.touch], duration=0.4)
        pulse = np.exp(-(((motion.t - 0.2) / 0.01) ** 2) / 2) / (0.01 * np.sqrt(2 * np.pi))
        np.testing.assert_allclose(motion.acceleration, np.outer(pulse, self.dv), atol=1e-10)

    def test_it_shifts_the_path_half_way_through(self):
        """A symmetric pulse acts as a step at its middle: at 0.4 s the disc is 0.2 s of dv further."""
        motion = fly(BARE, WEIGHTLESS, throw(), [self.touch], duration=0.4)
        straight = fly(BARE, WEIGHTLESS, throw(), duration=0.4)
        np.testing.assert_allclose(motion.position[-1] - straight.position[-1], 0.2 * self.dv, atol=1e-9)


class TestSpinStep:
    @pytest.mark.parametrize("spin", [70.0, -70.0])
    @pytest.mark.parametrize("dr", [4.0, -4.0])
    def test_it_adds_to_the_spin_in_its_own_direction(self, spin, dr):
        """Positive dr speeds either spin up, negative slows it; nothing else moves. Area as for the impulse."""
        release = throw(spin_deg_s=float(np.degrees(spin)))
        motion = fly(BARE, WEIGHTLESS, release, [effect("event.spin_step", t_s=0.2, dr_rad_s=dr)], duration=0.4)
        before, after = steady(motion, 0.13, 0.27)
        change = motion.rate[after] - motion.rate[before]
        np.testing.assert_allclose(change, [0.0, 0.0, np.sign(spin) * dr], atol=1e-8)
        np.testing.assert_allclose(motion.velocity, np.tile(motion.velocity[0], (motion.t.size, 1)), atol=1e-10)

    def test_its_angular_acceleration_is_the_gaussian_of_the_reference(self):
        motion = fly(BARE, WEIGHTLESS, throw(), [effect("event.spin_step", t_s=0.2, dr_rad_s=4.0)], duration=0.4)
        pulse = 4.0 * np.exp(-(((motion.t - 0.2) / 0.01) ** 2) / 2) / (0.01 * np.sqrt(2 * np.pi))
        np.testing.assert_allclose(motion.angular_acceleration[:, 2], pulse, atol=1e-9)


class TestBody:
    def test_inertia_asymmetry_is_the_inertia_about_the_y_axis(self):
        """Euler's equations without torque, at every instant of a wobbling flight."""
        dIyy = 4e-5
        release = throw(wobble=(3.0, -2.0))
        motion = fly(BARE, FIELD, release, [effect("body.inertia_asymmetry", dIyy_kg_m2=dIyy)], duration=0.3)
        inertia = np.array([BARE.Ixx, BARE.Ixx + dIyy, BARE.Izz])
        expected = -np.cross(motion.rate, inertia * motion.rate) / inertia
        np.testing.assert_allclose(motion.angular_acceleration, expected, atol=1e-8)
        assert np.abs(motion.angular_acceleration[:, 2]).max() > 0.1

    def test_mass_imbalance_moves_the_centre_of_mass_and_not_the_release(self):
        unbalanced = [effect("body.mass_imbalance", ex_m=0.002, ey_m=-0.001)]
        flying = FlyingDisc(DRIVER, FIELD, unbalanced)
        release = throw(wobble=(3.0, -2.0))
        flying.release(release)
        motion = fly(DRIVER, FIELD, release, unbalanced, duration=0.1)
        np.testing.assert_array_equal(motion.centre_of_mass, [0.002, -0.001, 0.0])
        np.testing.assert_allclose(motion.position[0], release.position, atol=1e-15)
        np.testing.assert_allclose(motion.velocity[0], release.velocity, atol=1e-13)
        # MuJoCo's joint holds the geometric centre: sensors keep their place in the disc
        C_NB = body_to_ned(motion.attitude[0])
        np.testing.assert_allclose(
            flying.data.qpos[:3] * [1, -1, -1], release.position - C_NB @ [0.002, -0.001, 0.0], atol=1e-15
        )


class TestCatalogue:
    def test_every_row_s_baseline_and_scale_fit_its_parameters(self):
        for row in CATALOGUE.values():
            assert len(row.scale) == len(row.parameters) == len(row.baseline) - len(row.settings), row.id
            assert all(scale > 0 for scale in row.scale), row.id

    def test_parameters_stand_where_their_names_say(self):
        for row in ON_MOTION:
            for name in row.parameters:
                flat = parameters(FIELD, DRIVER)
                flat[parameter_index(row.id, name)] = 0.123
                assert flat.view(PARAMETERS)[0][row.key][name] == 0.123
        with pytest.raises(KeyError, match="no parameter 'CNr' of 'disc'"):
            parameter_index("disc", "CNr")

    def test_an_unknown_effect_names_its_neighbour(self):
        with pytest.raises(InputError, match=r"unknown effect 'air.wimd'; did you mean 'air.wind'\?"):
            effect("air.wimd")

    def test_an_unknown_parameter_lists_the_known_ones(self):
        with pytest.raises(InputError, match="unknown parameter 'w_up'; expected w_north_m_s, w_east_m_s"):
            effect("air.wind", w_up=1.0)

    def test_an_effect_given_twice_is_refused(self):
        twice = [effect("air.wind", w_north_m_s=1.0), effect("air.wind", w_east_m_s=1.0)]
        with pytest.raises(InputError, match=r"'air.wind' is given twice"):
            parameters(FIELD, DRIVER, effects=twice)

    def test_a_value_of_another_row_is_refused(self):
        with pytest.raises(InputError, match="got Wind, expected Gust"):
            Effect("air.gust", effect("air.wind").value)

    def test_a_parameter_that_is_no_number_is_refused(self):
        with pytest.raises(InputError, match="not finite"):
            fly(DRIVER, FIELD, throw(), [effect("air.wind", w_north_m_s=float("nan"))])


def test_an_effect_on_a_sensor_leaves_the_flight_alone():
    with_bias = fly(DRIVER, FIELD, throw(), [effect("accel.bias", bx_m_s2=1.0)], duration=0.2)
    np.testing.assert_array_equal(with_bias.position, fly(DRIVER, FIELD, throw(), duration=0.2).position)
