"""Platforms that a plane carries: no weight on the wires, motion in the plane alone, friction as a set of poses."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize

from wirebayes.commands.asked_pose import _refuse_off_plane
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import plane, rotation, schema, statics
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.pose import on_plane
from wirebayes.robot.pose.answer import _why_not
from wirebayes.robot.pose.orientation import Orientation
from wirebayes.robot.self_calibration import identified

G = 9.80665


@pytest.fixture(scope="module")
def sled():
    return schema.read_robot_file("sled-4")


def _held(robot, x, R, k1=5000.0):
    tau = inverse.tensions(robot, x[None], R[None])
    wires = Wires("hooke", "saturating", {"k1": np.array([[k1]])}, np.full((robot.legs, 1), 1000.0))
    return tau[0], wires, inverse.commands(robot, wires, x[None], R[None], tau)


def test_the_wires_pull_at_each_other_and_the_plane_has_the_weight(sled):
    tau, _, _ = _held(sled, sled.home_m, np.eye(3))
    assert tau.min() >= sled.rule.lowest_N - 1e-9
    assert plane.normal_force(sled, sled.home_m, np.eye(3), tau) == pytest.approx(sled.mass_kg * G)


def test_without_the_plane_the_sentence_says_how_to_state_it(sled):
    hanging = replace(sled, plane=None)
    assert np.isnan(inverse.tensions(hanging, sled.home_m[None], np.eye(3)[None])).all()
    sentence, kind = _why_not(hanging, sled.home_m, Orientation(sled.home_m, np.eye(3)))
    assert "[plane]" in sentence and kind == "uncarried"
    above = replace(hanging, exit_m=sled.exit_m + [0.0, 0.0, 1.0], rule=replace(sled.rule, highest_N=4.1))
    sentence, kind = _why_not(above, sled.home_m, Orientation(sled.home_m, np.eye(3)))
    assert "[plane]" not in sentence and kind != "uncarried"


def test_the_equilibrium_in_the_plane_is_that_of_an_energy_in_three_coordinates(sled):
    """Lengths disturbed; a minimiser that knows x, y and the angle alone."""
    rng = np.random.default_rng(3)
    _, wires, commands = _held(sled, sled.home_m, np.eye(3))
    zero = commands.zero_m[0] - 2e-3 * rng.random(sled.legs)
    found = forward.solve_equilibrium(sled, wires, zero[None], commands.offset_m, sled.home_m, np.eye(3))

    def energy(q):
        x, c, s = sled.home_m + [q[0], q[1], 0.0], np.cos(q[2]), np.sin(q[2])
        points = sled.platform_m @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
        stretch = np.maximum(np.linalg.norm(x + points - sled.exit_m, axis=1) - zero, 0.0)
        return float((0.5 * 5000.0 * stretch**2 / zero).sum())

    best = minimize(
        energy, np.zeros(3), method="Nelder-Mead", options={"xatol": 1e-10, "fatol": 1e-16, "maxiter": 4000}
    )
    assert found.found[0]
    np.testing.assert_allclose(found.position_m[0], sled.home_m + [best.x[0], best.x[1], 0.0], atol=1e-7)
    np.testing.assert_allclose(rotation.vector(found.rotation)[0], [0.0, 0.0, best.x[2]], atol=1e-6)


def test_a_leaning_plane_leaves_the_weight_along_it(sled):
    lean = rotation.matrix(np.array([0.4, 0.0, 0.0]))
    leaning = replace(
        sled,
        exit_m=sled.exit_m @ lean.T,
        home_m=lean @ sled.home_m,
        home_rotation_rad=np.array([0.4, 0.0, 0.0]),
        plane=replace(sled.plane, normal=lean @ sled.plane.normal),
    )
    tau, _, _ = _held(leaning, leaning.home_m, lean)
    pulls = tau[:, None] * statics.geometry(leaning, leaning.home_m[:, None], lean[..., None]).direction[..., 0].T
    upwards = lean @ np.array([0.0, 1.0, 0.0])
    assert -(pulls.sum(0) @ upwards) == pytest.approx(sled.mass_kg * G * np.sin(0.4))
    assert plane.normal_force(leaning, leaning.home_m, lean, tau) == pytest.approx(sled.mass_kg * G * np.cos(0.4))


def test_friction_holds_as_far_as_its_largest_force_moves_the_platform(sled):
    """Forces of friction in all directions, as small loads on the balance: the farthest displacement is the width."""
    tau, wires, commands = _held(sled, sled.home_m, np.eye(3))
    K = statics.stiffness(
        sled, wires, sled.home_m[:, None], np.eye(3)[..., None], commands.zero_m.T, commands.offset_m.T
    )
    width, turn = plane.friction_half_width(sled, K, plane.normal_force(sled, sled.home_m, np.eye(3), tau))
    most, radius = sled.plane.friction * sled.mass_kg * G, sled.plane.contact_radius_m
    u = np.random.default_rng(0).standard_normal((20000, 3))
    u /= np.linalg.norm(u, axis=1)[:, None]
    loads = np.column_stack([most * u[:, :2], np.zeros((len(u), 3)), most * radius * u[:, 2]])
    moved = np.linalg.solve(K[0], loads.T).T
    np.testing.assert_allclose(np.abs(moved[:, :2]).max(0), width[0, :2], rtol=2e-3)
    np.testing.assert_allclose(np.abs(moved[:, 5]).max(), turn[0], rtol=2e-3)
    assert width[0, 2] == 0.0


@pytest.mark.parametrize(("coefficient", "warned"), [(0.2, 0), (3.0, 1)])
def test_friction_that_holds_farther_than_the_stiffness_reaches_is_called_extrapolated(sled, coefficient, warned):
    """By the pull at the end of the half width along x, where wires of a few millimetres of stretch have gone slack."""
    rough = replace(sled, plane=replace(sled.plane, friction=coefficient, contact_radius_m=0.0))
    tau, wires, commands = _held(rough, rough.home_m, np.eye(3))
    said = on_plane.on_plane(rough, wires, commands, rough.home_m, np.eye(3), tau)
    assert [one.kind for one in on_plane.friction_notices(said)] == warned * ["extrapolation"]
    zero, offset = commands.zero_m.T, commands.offset_m.T
    K = statics.stiffness(rough, wires, rough.home_m[:, None], np.eye(3)[..., None], zero, offset)[0]
    most = coefficient * rough.mass_kg * G
    free = [0, 1, 5]
    slack = np.linalg.inv(K[np.ix_(free, free)])[:, :2]
    push = most * slack[0] / np.linalg.norm(slack[0])  # the friction that takes the platform farthest along x
    end = np.zeros(6)
    end[free] = slack @ push
    turned = rotation.matrix(end[3:])
    shape = statics.geometry(rough, (rough.home_m + end[:3])[:, None], turned[..., None])
    stretched = statics.stretched(rough, shape, offset)
    taut = 5000.0 * np.maximum(stretched / zero - 1.0, 0.0)
    pull = -(shape.direction * taut).sum(1)[:2, 0]
    off = np.linalg.norm(-pull - push) / most
    assert said["friction_departure"] >= off - 1e-9
    assert (off > 0.2) == bool(warned)


def test_wires_that_lift_the_platform_are_refused_on_a_table_and_not_on_a_rail(sled):
    high = replace(sled, exit_m=sled.exit_m + [0.0, 0.0, 1.0], mass_kg=0.1)
    tau, _, _ = _held(high, high.home_m, np.eye(3))
    assert "lift" in on_plane.lifted(high, high.home_m, np.eye(3), tau)
    rail = replace(high, plane=replace(high.plane, contact="rail"))
    assert not on_plane.lifted(rail, rail.home_m, np.eye(3), tau)
    heavy = replace(high, mass_kg=100.0)
    assert not on_plane.lifted(heavy, heavy.home_m, np.eye(3), tau)


@pytest.mark.parametrize(("share", "lifts"), [(0.0, False), (-0.9e-9, False), (-1.1e-9, True)])
def test_a_force_of_rounding_size_lifts_nothing(sled, monkeypatch, share, lifts):
    """On a wall whose wires run in its plane the force is nothing, of either sign."""
    monkeypatch.setattr(plane, "normal_force", lambda *given: share * sled.mass_kg * G)
    assert bool(on_plane.lifted(sled, sled.home_m, np.eye(3), np.ones(4))) == lifts


AXES = ("x", "y", "the vertical")


@pytest.mark.parametrize(
    ("height_m", "ways"),
    [
        (0.0, ["moved along x", "moved along y", "turned about the vertical", "scaled"]),
        (0.1, [f"{way} {axis}" for way in ("moved along", "turned about") for axis in AXES] + ["scaled"]),
    ],
)
def test_a_robot_in_a_plane_is_moved_in_it_only(sled, height_m, ways):
    """Four lines of the answer spoke of motions that no plotter could make, and left out what mattered."""
    exits = np.array([[-1.0, -0.8, 0.0], [1.0, -0.8, 0.0], [1.0, 0.8, 0.0], [-1.0, 0.8, 0.0]])
    flat = replace(sled, exit_m=exits, platform_m=0.1 * exits, home_m=np.array([0.0, 0.0, height_m]))
    assert list(identified._motions(flat)) == ways


def test_a_pose_off_the_plane_is_refused(sled):
    with pytest.raises(InputError, match="off the plane"):
        _refuse_off_plane(sled, sled.home_m + [0.0, 0.0, 0.01], np.eye(3))
    with pytest.raises(InputError, match="off the plane"):
        _refuse_off_plane(sled, sled.home_m, rotation.matrix(np.array([0.1, 0.0, 0.0])))
    _refuse_off_plane(sled, sled.home_m, rotation.matrix(np.array([0.0, 0.0, 0.1])))


@pytest.mark.parametrize(
    ("normal", "choice", "refused"),
    [("[0, 0, 2]", "minimum_norm", True), ("[0, 0.1, 1]", "minimum_norm", False), ("[0, 0, 1]", "middle", False)],
)
def test_wires_that_need_not_pull_hold_nothing_on_a_level_plane(normal, choice, refused):
    text = schema.robot_text("sled-4").replace("lowest_N = 4.0", "lowest_N = 0").replace("minimum_norm", choice)
    text = text.replace("normal = [0.0, 0.0, 1.0]", f"normal = {normal}")
    if not refused:
        schema.parse(text, "sled.toml")
        return
    with pytest.raises(
        InputError, match=r"sled.toml, line \d+, key tension.lowest_N: found 0, expected a number above 0"
    ):
        schema.parse(text, "sled.toml")


@pytest.mark.parametrize(("friction", "ends"), [(0.2, ", so that no friction holds it."), (0.0, ".")])
def test_a_plane_that_nothing_presses_on_holds_nothing_by_friction(friction, ends):
    """Wires that run along a wall: a sentence without a place for distances that are none."""
    sled = schema.read_robot_file("sled-4")
    known = replace(sled.plane, friction=friction)
    said = on_plane._sentence(sled, known, 0.0, np.zeros((5, 3)), np.zeros(5))
    assert said == f"The plane carries nothing of the platform{ends}"
    pressed = on_plane._sentence(sled, known, 2.0, np.tile([1e-3, 2e-3, 0.0], (5, 1)), np.zeros(5))
    held = "; its friction, 0.4 N at most, can hold the platform ±1 mm along x, ±2 mm along y" if friction else ""
    assert pressed == f"The plane carries the platform with 2 N{held}."
