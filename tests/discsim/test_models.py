"""What is shipped in models/: discs, throws, places and the MuJoCo model."""

from __future__ import annotations

from datetime import date

import mujoco
import numpy as np
import pytest
from support.flights import DRIVER

from discsim.engine import FlyingDisc, check_model, fly
from discsim.environment import world_magnetic_field
from discsim.errors import InputError
from discsim.files import model_file, model_names
from discsim.shipped import load_disc, load_site, load_throw

DISCS = ("cd1", "cd5", "dd2", "driver", "fd2", "ultrastar")
GOLF = ("cd1", "cd5", "dd2", "fd2")


def test_the_discs_shipped_are_those_of_the_command_line():
    assert tuple(model_names("discs")) == DISCS


@pytest.mark.parametrize("name", DISCS)
def test_a_shipped_disc_flies_the_driver_s_throw(name):
    """Every one stays in the air for more than 4 s, lands 50 to 110 m away and keeps most of its spin."""
    disc, environment = load_disc(name)
    motion = fly(disc, environment, load_throw("driver"))
    assert motion.touched_down
    assert motion.end > 4.0
    assert 50.0 < np.linalg.norm(motion.position[-1, :2]) < 110.0
    assert 0.8 < motion.rate[-1, 2] / motion.rate[0, 2] < 0.95


def test_the_driver_flies_about_85_m_in_7_s_and_fades_left():
    """The figures are docs/physics.md's, "about": half a unit of their last digits."""
    disc, environment = load_disc("driver")
    motion = fly(disc, environment, load_throw("driver"))
    assert motion.end == pytest.approx(7.0, abs=0.5)
    assert np.linalg.norm(motion.position[-1, :2]) == pytest.approx(85.0, abs=0.5)
    turn, end = np.argmax(motion.position[:, 1]), motion.position[-1, 1]
    assert end < motion.position[turn, 1] - 2.0


def test_an_overstable_disc_fades_left_of_an_understable_one():
    """The names of the CFD discs: cd1 is sold as overstable, cd5 as understable; a backhand with r > 0."""
    sideways = {}
    for name in ("cd1", "cd5"):
        disc, environment = load_disc(name)
        sideways[name] = fly(disc, environment, load_throw("driver")).position[-1, 1]
    assert sideways["cd1"] < sideways["cd5"] - 10.0


@pytest.mark.parametrize("name", DISCS)
def test_a_disc_s_numbers_lie_where_physics_allows(name):
    """A flat body has Izz = Ixx + Iyy, a real disc a little less; a rim-heavy one has up to m d^2/4 about its axis."""
    disc, environment = load_disc(name)
    assert 1.9 < disc.Izz / disc.Ixx < 2.0
    assert 0.125 < disc.Izz / (disc.mass * disc.diameter**2) < 0.25
    assert 0.17 < disc.mass < 0.18
    assert disc.aero.CMq < 0
    assert disc.aero.CRp < 0
    assert -0.01 < disc.aero.CNr < 0
    assert environment.air_density == 1.204


@pytest.mark.parametrize("name", [*GOLF, "ultrastar"])
def test_a_coefficient_table_looks_like_a_disc(name):
    """Whole range of alpha, drag positive and least near zero, lift rising through small angles, nose up with alpha."""
    table = load_disc(name)[0].aero_table
    np.testing.assert_allclose(np.degrees(table.alpha[[0, -1]]), [-90.0, 90.0], atol=1e-6)
    assert np.all(table.CD > 0.04)
    assert abs(np.degrees(table.alpha[np.argmin(table.CD)])) <= 5.0
    small = np.abs(table.alpha) < np.radians(12.0)
    assert np.all(np.diff(table.CL[small]) > 0)
    assert np.all(np.diff(table.CM[small]) > 0)
    np.testing.assert_allclose(table.CL[[0, -1]], 0.0, atol=0.005)  # no lift with the wind along the axis


def test_the_ultrastar_s_derivatives_are_hummel_s_at_13_5_metres_a_second():
    """Per rad/s times 2 V/d, which is 100 there: -1.44e-2, -1.25e-2, -3.41e-5."""
    disc, _ = load_disc("ultrastar")
    factor = 2 * 13.5 / disc.diameter
    np.testing.assert_allclose(
        [disc.aero.CMq, disc.aero.CRp, disc.aero.CNr], np.array([-1.44e-2, -1.25e-2, -3.41e-5]) * factor, rtol=1e-12
    )


def test_the_golf_discs_damp_as_an_instrumented_driver_was_seen_to():
    """Spin 118.5 to 114.5 rad/s in 0.82 s, wobble 21.5 to 3.3 in 1 s at 25.9 m/s, on a 175 g disc of 0.211 m.

    The coefficients have two digits, so 3 %.
    """
    disc, environment = load_disc("dd2")
    Ixx, Izz = 6.263e-4, 1.231e-3
    per_rate = environment.air_density * 25.9 * disc.area * disc.diameter**2 / 4
    assert per_rate * disc.aero.CNr / Izz == pytest.approx(np.log(114.5 / 118.5) / 0.82, rel=0.03)
    wobble = per_rate * (disc.aero.CMq + disc.aero.CRp) / 2 / Ixx
    assert wobble == pytest.approx(np.log(3.3 / 21.5), rel=0.04)


def test_an_unknown_disc_lists_the_shipped_ones():
    with pytest.raises(InputError, match=r"no disc 'drivr'; expected one of cd1, cd5, dd2, driver, fd2, ultrastar"):
        load_disc("drivr")


def test_a_disc_may_be_a_file(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text(model_file("discs/dd2.toml").read_text().replace("mass_kg = 0.175", "mass_kg = 0.168"))
    mine, _ = load_disc(path)
    shipped, _ = load_disc("dd2")
    assert mine.mass == 0.168
    np.testing.assert_array_equal(mine.aero_table.CL, shipped.aero_table.CL)
    assert load_disc(str(path))[0].Izz == shipped.Izz


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("mass_kg", "mass_g", "missing key 'mass_kg'"),
        ("[disc.aero]", "[disc.aerodynamics]", "\\[disc.aero\\] is missing"),
        ("air_density_kg_m3 = 1.204", "", "missing key 'air_density_kg_m3'"),
        ("[environment]", "[surroundings]", "missing key 'environment'"),
        ("CNr = -0.0042", "CNr = -0.0042\nCNrr = 0.1", "unknown key 'disc.aero.CNrr'"),
        ("[disc]", "[extra]\n[disc]", "unknown key 'extra'"),
    ],
)
def test_a_damaged_disc_file_is_refused_with_its_name(tmp_path, old, new, message):
    path = tmp_path / "mine.toml"
    text = model_file("discs/dd2.toml").read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message) as caught:
        load_disc(path)
    assert "mine.toml" in str(caught.value)


@pytest.mark.parametrize(
    ("name", "heading", "angles"), [("driver", 0.0, (-12.0, 8.0, 0.0)), ("paper", 112.0, (-15.0, -17.0, 112.0))]
)
def test_a_shipped_throw_is_what_its_comments_say(name, heading, angles):
    """24 m/s, 10 deg up, 4200 deg/s, 1.3 m high; the files have six decimals."""
    release = load_throw(name)
    speed = np.linalg.norm(release.velocity)
    assert speed == pytest.approx(24.0, abs=1e-5)
    assert np.degrees(np.arcsin(-release.velocity[2] / speed)) == pytest.approx(10.0, abs=1e-4)
    assert np.degrees(np.arctan2(release.velocity[1], release.velocity[0])) == pytest.approx(heading, abs=1e-4)
    np.testing.assert_allclose(np.degrees([release.roll, release.pitch, release.yaw]), angles, atol=1e-4)
    np.testing.assert_allclose(np.degrees(release.body_rate), [0.0, 0.0, 4200.0], atol=1e-4)
    np.testing.assert_array_equal(release.position, [0.0, 0.0, -1.3])


def test_a_throw_without_spin_is_refused(tmp_path):
    path = tmp_path / "mine.toml"
    path.write_text("velocity_ned_m_s = [20.0, 0.0, 0.0]\n")
    with pytest.raises(InputError, match="missing key 'body_rate_rad_s'"):
        load_throw(path)
    with pytest.raises(InputError, match="expected one of driver, paper"):
        load_throw("backhand")


@pytest.mark.parametrize("name", ["berlin", "ponte_de_sor", "seoul"])
def test_a_site_s_field_is_the_world_magnetic_model_s(name):
    """Recomputed for the place and day stated: 0.05 uT; gravity is the WGS 84 formula's to its last digit."""
    site = load_site(name)
    field = world_magnetic_field(site.latitude_deg, site.longitude_deg, site.day, site.height_m)
    np.testing.assert_allclose(site.environment.magnetic_field, field, atol=0.05)
    sine2 = np.sin(np.radians(site.latitude_deg)) ** 2
    normal = 9.7803253359 * (1 + 0.00193185265241 * sine2) / np.sqrt(1 - 0.00669437999014 * sine2)
    assert site.environment.gravity == pytest.approx(normal - 3.086e-6 * site.height_m, abs=5.1e-5)
    assert site.environment.air_density == pytest.approx(1.225 * (1 - 2.25577e-5 * site.height_m) ** 4.2559, abs=5.1e-4)


def test_the_sites_are_where_they_are_said_to_be():
    """The field dips steeply in Berlin, points west of north in Seoul; all days fall in the models shipped."""
    sites = {name: load_site(name) for name in model_names("sites")}
    assert set(sites) == {"berlin", "ponte_de_sor", "seoul"}
    assert sites["ponte_de_sor"].day == date(2021, 10, 15)
    north, east, down = sites["seoul"].environment.magnetic_field
    assert np.degrees(np.arctan2(east, north)) == pytest.approx(-8.8, abs=0.3)
    north, _, down = sites["berlin"].environment.magnetic_field
    assert np.degrees(np.arctan2(down, north)) > 67.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("date = 2021-10-15", 'date = "15 Oct 2021"', r"'site.date' is '15 Oct 2021', expected a date"),
        ("latitude_deg = 39.2115", "latitude_deg = 93.0", "expected at most 90"),
        ("height_m = 119.0", "", "missing key 'height_m'"),
    ],
)
def test_a_damaged_site_file_is_refused(tmp_path, old, new, message):
    path = tmp_path / "mine.toml"
    text = model_file("sites/ponte_de_sor.toml").read_text()
    assert old in text
    path.write_text(text.replace(old, new))
    with pytest.raises(InputError, match=message):
        load_site(path)


def test_the_mujoco_model_s_numbers_are_the_driver_s():
    """disc.xml can be opened by itself in MuJoCo's viewer; what it states must not drift from driver.toml."""
    model = mujoco.MjModel.from_xml_path(str(model_file("disc.xml")))
    check_model(model)
    body = model.body("disc")
    assert body.mass[0] == DRIVER.mass
    np.testing.assert_array_equal(body.inertia, [DRIVER.Ixx, DRIVER.Ixx, DRIVER.Izz])
    assert model.geom("rim").size[0] == DRIVER.diameter / 2
    np.testing.assert_array_equal(model.site("imu").pos, [-0.0161, 0.0, 0.0])  # the paper's d_x
    assert model.nsensor > 0


@pytest.mark.parametrize("name", ["driver", "ultrastar"])
def test_the_drawn_disc_has_the_disc_s_diameter(name):
    disc, environment = load_disc(name)
    model = FlyingDisc(disc, environment).model
    assert model.geom("rim").size[0] == pytest.approx(disc.diameter / 2, rel=1e-12)
    mark = model.geom("mark_forward")
    assert mark.pos[0] + mark.size[0] < disc.diameter / 2
