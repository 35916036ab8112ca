"""A module on board: mass and inertia against sums over points, and where its place sends the centre of mass."""

from __future__ import annotations

import numpy as np
import pytest

from discsim.effects.catalogue import by_id
from discsim.engine import fly
from discsim.errors import InputError
from discsim.module import Module, loaded
from discsim.shipped import load_disc, load_throw
from discsim.trajectory import predict

DISC, AIR = load_disc("driver")


def plate(module: Module, n: int = 400) -> tuple[np.ndarray, np.ndarray]:
    """Masses (k,) and places (k, 2) of a module's plate cut into small squares."""
    edge = (np.arange(n) + 0.5) / n * 2 - 1
    x, y = (module.radius * grid.ravel() for grid in np.meshgrid(edge, edge))
    inside = np.hypot(x, y) <= module.radius
    places = np.column_stack((x[inside] + module.x, y[inside] + module.y))
    return np.full(len(places), module.mass / len(places)), places


@pytest.mark.parametrize(
    "module", [Module(0.037, radius=0.03), Module(0.015, x=-0.02, radius=0.0161), Module(0.02, y=0.05, radius=0.01)]
)
def test_mass_and_inertia_are_those_of_disc_and_plate_added_point_by_point(module):
    """400 x 400 squares: the circle's edge is off by a cell in a thousand."""
    disc, effects = loaded(DISC, module)
    given = by_id(effects)
    mass, places = plate(module)
    centre = mass @ places / (DISC.mass + module.mass)
    away = places - centre
    xx = DISC.Ixx + DISC.mass * centre[1] ** 2 + mass @ away[:, 1] ** 2
    yy = DISC.Ixx + DISC.mass * centre[0] ** 2 + mass @ away[:, 0] ** 2
    assert disc.mass == pytest.approx(DISC.mass + module.mass)
    added = {"Ixx": (disc.Ixx, xx, DISC.Ixx), "Izz": (disc.Izz, xx + yy + DISC.Izz - 2 * DISC.Ixx, DISC.Izz)}
    for name, (ours, by_points, bare) in added.items():
        assert ours - bare == pytest.approx(by_points - bare, rel=2e-3), name
    if module.x or module.y:
        assert given["body.mass_imbalance"] == pytest.approx(centre, abs=1e-9)
        assert given["body.inertia_asymmetry"].dIyy_kg_m2 == pytest.approx(yy - xx, rel=2e-3)
    else:
        assert effects == []


def test_a_point_in_the_middle_adds_mass_and_no_inertia():
    disc, effects = loaded(DISC, Module(0.015))
    assert (disc.mass, disc.Ixx, disc.Izz, effects) == (pytest.approx(0.194), DISC.Ixx, DISC.Izz, [])


def test_a_module_off_the_middle_makes_the_disc_wobble_in_both_engines_alike():
    disc, effects = loaded(DISC, Module(0.015, x=0.03))
    release = load_throw("driver")
    truth, standalone = fly(disc, AIR, release, effects), predict(disc, AIR, release, effects)
    plain = predict(disc, AIR, release)
    t = np.linspace(0.0, 1.0, 200)
    wobble = np.abs(standalone.at(t).rate[:, :2] - plain.at(t).rate[:, :2]).max()
    assert wobble > 0.1
    np.testing.assert_allclose(standalone.landing, truth.position[-1], atol=2e-3)


@pytest.mark.parametrize(
    ("sizes", "what"),
    [
        ({"mass": 0.0}, "mass above zero"),
        ({"mass": float("nan")}, "mass above zero"),
        ({"mass": 0.01, "radius": -0.01}, "radius"),
        ({"mass": 0.01, "x": 0.01, "y": 0.01}, "principal"),
        ({"mass": 0.01, "x": 0.1, "radius": 0.01}, "beyond the rim"),
        ({"mass": 0.1, "x": 0.1}, "exceeds Ixx"),
    ],
)
def test_a_module_that_cannot_be_is_refused_by_name(sizes, what):
    with pytest.raises(InputError, match=what):
        loaded(DISC, Module(**sizes))
