"""A plant is one value: no source outside its file names it, and another is added without touching any."""

from __future__ import annotations

import ast

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicHermiteSpline
from scipy.stats import binom, chi2
from support.places import ROOT

from discsim.environment import Environment
from discsim.recording import PLANTS as NAMES
from discsim.recording import Recording, Samples, SensorSheet
from discsim.validation.identification.dynamics import ROW
from discsim.validation.identification.gauss_newton import Fit, discontinuous, linearised, refit
from discsim.validation.identification.noise import stated_noise
from discsim.validation.identification.parameters import AllowedDefects, Parameter
from discsim.validation.identification.plants import PLANTS, Plant
from discsim.validation.identification.plants.plant import Durations, Dynamics, Initial, Layout, Sizes
from discsim.validation.identification.segments import resegmented, trajectory_of

ROOMS = [ROOT / "validation" / "diagnosis", ROOT / "validation" / "identification"]
#: source -> (name, why it may stand there)
EXCEPTIONS: dict[str, tuple[str, str]] = {}


def named_in(source: str) -> set[str]:
    """Return the plants whose names are string literals of a source, docstrings left out."""
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    literals = [node for node in ast.walk(tree) if isinstance(node, ast.Constant) and id(node) not in docstrings]
    return {node.value for node in literals if node.value in NAMES}


def test_no_source_outside_its_file_names_a_plant():
    sources = [path for room in ROOMS for path in sorted(room.rglob("*.py")) if path.parent.name != "plants"]
    assert len(sources) > 60
    found = {str(path.relative_to(ROOT)): names for path in sources if (names := named_in(path.read_text("utf-8")))}
    assert found == {place: {name} for place, (name, _) in EXCEPTIONS.items()}


def test_a_plant_s_name_is_found_in_code_and_not_in_a_docstring():
    assert named_in('def f():\n    """flight"""\n') == set()
    assert named_in('def f(x):\n    """A flight."""\n    return x in ("flight", "free_spin")\n') == {
        "flight",
        "free_spin",
    }
    assert named_in('X = {"spin_down": 1}\n"""the flight"""\n') == {"spin_down"}


def test_every_plant_of_the_format_is_registered_under_its_name():
    assert set(PLANTS) == set(NAMES)
    assert all(plant.name == name for name, plant in PLANTS.items())


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_sizes_hold_one_number_for_each_direction_of_a_state(plant):
    d = plant.layout.directions
    for sizes in (plant.sizes.differences, plant.sizes.unknown, plant.sizes.continuous.sd, plant.sizes.relaxed.sd):
        assert sizes.shape == (d,)
    assert np.all(plant.sizes.relaxed.sd >= plant.sizes.continuous.sd)


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_a_state_that_is_moved_is_as_far_away_as_it_was_moved(plant):
    rng = np.random.default_rng(3)
    states = rng.normal(size=(4, plant.layout.size))
    if plant.layout.attitude is not None:
        states[:, plant.layout.attitude] /= np.linalg.norm(states[:, plant.layout.attitude], axis=1, keepdims=True)
    tangents = 0.3 * rng.normal(size=(4, plant.layout.directions))
    np.testing.assert_allclose(
        plant.layout.difference(plant.layout.moved(states, tangents), states), tangents, atol=1e-12
    )


@pytest.mark.parametrize("plant", PLANTS.values(), ids=list(PLANTS))
def test_the_directions_of_a_named_part_of_a_state_move_that_part_alone(plant):
    layout = plant.layout
    state = np.zeros(layout.size)
    if layout.attitude is not None:
        state[layout.attitude] = 1.0, 0.0, 0.0, 0.0
    for name in ("position", "velocity", "attitude", "rate", "spin", "yaw"):
        places = getattr(layout, name)
        if places is None:
            continue
        mine = np.zeros(layout.size, dtype=bool)
        mine[places] = True
        for direction in layout.directions_of(places):
            moved = layout.moved(state, 0.1 * np.eye(layout.directions)[direction])
            assert np.any(moved[mine] != state[mine])
            np.testing.assert_array_equal(moved[~mine], state[~mine])


# ------------------------------------------------------------------------------- another plant, in this file alone

#: a pendulum of 0.6 m: angular frequency of small swings, 1/s, and damping, 1/s
SWING, DAMPING = np.sqrt(9.80665 / 0.6), 0.12
#: encoder: readings a second, noise, rad/s
RATE_HZ, NOISE = 50.0, 0.02
ANGLE, RATE = 0, 1


def acceleration(angle, rate, damping):
    """psi'' = -w^2 sin psi - c psi', as the moments of weight and of a viscous bearing make it."""
    return -(SWING**2) * np.sin(angle) - damping * rate


def propagate(given, flats, own, states, times, last, out):
    """Classical fourth-order steps, and Hermite's cubics between them."""
    del given, flats
    damping, h = own[:, 0], np.diff(times)
    path = np.empty((times.size, 2, states.shape[0]))
    path[0] = states.T

    def slope(at):
        return np.stack([at[RATE], acceleration(at[ANGLE], at[RATE], damping)])

    for k in range(times.size - 1):
        k1 = slope(path[k])
        k2 = slope(path[k] + 0.5 * h[k] * k1)
        k3 = slope(path[k] + 0.5 * h[k] * k2)
        k4 = slope(path[k] + h[k] * k3)
        path[k + 1] = path[k] + h[k] / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    slopes = np.stack([slope(at) for at in path])
    at = CubicHermiteSpline(times, path, slopes)(out)
    rows = np.zeros((states.shape[0], out.size, ROW))
    rows[:, :, 9], rows[:, :, 12] = np.cos(0.5 * at[:, ANGLE].T), np.sin(0.5 * at[:, ANGLE].T)
    rows[:, :, 15] = at[:, RATE].T
    rows[:, :, 18] = acceleration(at[:, ANGLE].T, at[:, RATE].T, damping[:, None])
    return rows, path[last].T.copy()


def first_states(recording, t, ratio):
    """Rate as the encoder reads it; angle by its sum, about the mean that a swing has."""
    del ratio
    read = recording.samples["rate_reference"]
    angle = np.cumsum(read.value) / RATE_HZ
    return np.stack([np.interp(t, read.t, angle - np.mean(angle)), np.interp(t, read.t, read.value)], axis=1)


PENDULUM = Plant(
    name="pendulum",
    motion="swing",
    layout=Layout(2, spin=RATE),
    dynamics=Dynamics(propagate, lambda given, state, start, stop: 0.02),
    initial=Initial(first_states),
    sizes=Sizes(
        np.array([1e-5, 1e-4]), np.array([3.0, 30.0]), AllowedDefects(np.zeros(2)), AllowedDefects(np.array([0.1, 0.3]))
    ),
    durations=Durations(segment=0.8, first_look=4.0, window=1.0, longest=60.0, setup=60.0),
    own=(Parameter("pendulum", "damping_1_s", 0.0, 1e-4),),
)


def swing(seed: int, start=(0.9, 0.0), seconds: float = 8.0) -> Recording:
    """Return a swing as an encoder reads it: integrated by another method than the plant's, to 1e-10."""
    t = np.arange(0.0, seconds, 1.0 / RATE_HZ)
    truth = solve_ivp(
        lambda _, at: [at[1], acceleration(at[0], at[1], DAMPING)], (0.0, seconds), start, "DOP853", t, rtol=1e-10
    ).y[RATE]
    value = truth + NOISE * np.random.default_rng(seed).normal(size=t.size)
    sheets = {"rate_reference": SensorSheet(RATE_HZ, noise_rms=NOISE)}
    return Recording(
        PENDULUM.name, "swing", Environment(), sheets=sheets, samples={"rate_reference": Samples(t, value)}
    )


def fitted(recordings) -> Fit:
    """Return the fit of what they share, their damping, from no damping at all."""
    trajectories = []
    for one in recordings:
        nodes = PENDULUM.nodes(one, PENDULUM.durations.segment)
        trajectories.append(trajectory_of(one, nodes, PENDULUM.initial.states(one, nodes[:-1], 1.0)))
    fit = Fit(tuple(trajectories), PENDULUM.own, np.zeros(1), PENDULUM.sizes.continuous, {})
    return refit(
        Fit(fit.trajectories, fit.parameters, fit.at, fit.defects, stated_noise(linearised(fit))), iterations=12
    )


@pytest.fixture
def registered(monkeypatch):
    monkeypatch.setitem(PLANTS, PENDULUM.name, PENDULUM)


@pytest.mark.usefixtures("registered")
def test_the_damping_of_a_pendulum_is_fitted_by_its_plant_alone():
    fit = fitted([swing(1), swing(2, (0.0, 2.0))])
    sd = float(np.sqrt(fit.covariance[0, 0]))
    assert not discontinuous(fit)
    assert fit.merit == pytest.approx(fit.count, abs=4.0 * np.sqrt(2.0 * fit.count))
    assert abs(fit.at[0] - DAMPING) < sd
    assert sd < 0.02 * DAMPING


@pytest.mark.usefixtures("registered")
def test_the_error_of_its_damping_is_as_large_as_the_fit_says():
    """Over its standard deviation it is a standard normal deviate: limits of one in a thousand either way."""
    fits = [fitted([swing(seed)]) for seed in range(10, 40)]
    z = np.array([(fit.at[0] - DAMPING) / np.sqrt(fit.covariance[0, 0]) for fit in fits])
    low, high = chi2.ppf([1e-3, 1.0 - 1e-3], z.size)
    assert low < np.sum(z**2) < high
    assert abs(np.mean(z)) < 3.1 / np.sqrt(z.size)
    within = np.count_nonzero(np.abs(z) < 1.0)
    assert binom.ppf(1e-3, z.size, 0.6827) <= within <= binom.ppf(1.0 - 1e-3, z.size, 0.6827)


@pytest.mark.usefixtures("registered")
def test_a_pendulum_goes_on_from_one_segment_into_the_next_as_it_would_in_one():
    one = swing(1)
    whole = trajectory_of(one, np.array([0.0, 4.0]), np.array([[0.9, 0.0]]))
    values = {PENDULUM.own_keys[0]: DAMPING}
    halves = resegmented(whole, values, np.array([0.0, 2.0, 4.0]))
    quarters = resegmented(halves, values, np.array([0.0, 1.0, 2.0, 3.0, 4.0]))
    np.testing.assert_allclose(quarters.states[[0, 2]], halves.states, atol=1e-9)
