from itertools import product
from types import SimpleNamespace

import numpy as np
import pytest

from tests.robot import cases
from tests.robot.cases import HANGING
from wirebayes.robot.mechanics import rotation, schema, statics
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import claim, forward
from wirebayes.robot.proof import reach as module
from wirebayes.robot.proof.ball_arithmetic import Balance
from wirebayes.robot.proof.reach import each_on_its_own, reach


def _case(name, law, make=cases.commanded, seed=0):
    robot = schema.read_robot_file(name)
    c = make(robot, law, 6, np.random.default_rng(seed))
    found = cases.solved(robot, c)
    i = int(np.flatnonzero(found.found)[0])
    k1 = np.full(robot.legs, c.wires.theta["k1"][0, i])
    return robot, k1, c.zero_m[i], c.offset_m[i], found.position_m[i], found.rotation[i]


def _poses(robot, law, k1, zero, offset, x, R):
    """Forward solutions of many parameter sets, one a row."""
    wires = Wires(law, "saturating", {"k1": k1.T}, np.full((robot.legs, 1), 1000.0))
    found = forward.solve_equilibrium(robot, wires, zero, offset, x, R)
    assert found.found.all()
    return found


@pytest.mark.parametrize("law", ["hooke", "modified"])
@pytest.mark.parametrize("name", HANGING)
def test_wires_that_vary_each_on_its_own_are_enclosed_tightly(name, law):
    robot, k1, zero, offset, x, R = _case(name, law)
    half_k1, half_zero = 1e-4 * k1, 1e-5 * zero
    got = reach(robot, law, k1, zero, each_on_its_own(half_k1, half_zero), offset, x, R)
    assert got.proved
    rng = np.random.default_rng(1)
    corners = np.array(list(product((-1, 1), repeat=robot.legs)))
    signs = rng.choice(corners, (2, 300))
    found = _poses(robot, law, k1 + half_k1 * signs[0], zero + half_zero * signs[1], offset, x, R)
    moved = np.abs(found.position_m - x).max(0)
    assert (moved <= got.radius_m[:3]).all()
    assert (got.radius_m[:3] < 2.5 * moved).all()
    if robot.degrees == 6:
        turn = rotation.vector(found.rotation @ R.T)
        angle = np.linalg.norm(turn, axis=1, keepdims=True)
        cayley = 2 * np.tan(0.5 * angle) * turn / angle
        assert (robot.size_m * np.abs(cayley).max(0) <= got.radius_m[3:]).all()


def test_wires_that_change_together_reach_less_far_than_each_on_its_own():
    robot, k1, zero, offset, x, R = _case("linear-7", "hooke")
    half = 3e-5 * zero
    own = reach(robot, "hooke", k1, zero, each_on_its_own(0 * k1, half), offset, x, R)
    together = reach(robot, "hooke", k1, zero, (np.zeros((7, 1)), half[:, None]), offset, x, R)
    assert own.proved and together.proved
    share = np.linspace(-1, 1, 21)[:, None]
    found = _poses(robot, "hooke", np.tile(k1, (21, 1)), zero + share * half, offset, x, R)
    assert (np.abs(found.position_m - x).max(0) <= together.radius_m[:3]).all()
    assert (together.radius_m[:3] < own.radius_m[:3]).all()


def test_a_wire_that_may_go_slack_is_enclosed_or_refused():
    proofs = 0
    for seed in range(6):
        robot, k1, zero, offset, x, R = _case("hangprinter-4", "hooke", cases.disturbed, seed)
        half = 1e-4 * zero
        got = reach(robot, "hooke", k1, zero, each_on_its_own(0 * k1, half), offset, x, R)
        if not got.proved:
            continue
        proofs += 1
        signs = np.array(list(product((-1, 1), repeat=4)))
        found = _poses(robot, "hooke", np.tile(k1, (16, 1)), zero + half * signs, offset, x, R)
        assert (np.abs(found.position_m - x).max(0) <= got.radius_m[:3]).all()
    assert proofs > 0


def test_too_much_is_refused():
    robot, k1, zero, offset, x, R = _case("cogiro-desk", "hooke")
    wide = reach(robot, "hooke", k1, zero, each_on_its_own(0.5 * k1, 0.01 * zero), offset, x, R)
    assert not wide.proved
    assert wide.line_m.shape == (6, 16) and np.isnan(wide.line_m).all()
    assert wide.radius_m.shape == wide.beside_m.shape == (6,) and np.isnan([wide.radius_m, wide.beside_m]).all()
    assert not reach(robot, "hooke", k1, zero, each_on_its_own(2.0 * k1, 0 * zero), offset, x, R).proved
    # far from equilibrium there is nothing to prove
    away = reach(robot, "hooke", k1, zero, each_on_its_own(1e-6 * k1, 1e-7 * zero), offset, x + [0, 0, 0.01], R)
    assert not away.proved or np.all(np.abs(away.centre_m - x) <= away.radius_m[:3])


@pytest.mark.parametrize("many", [2.0**7, 2.0**-30])
@pytest.mark.parametrize("share", [1e-9, 1e-5])  # the first box tried holds, and a wider one
def test_what_is_proved_grows_with_the_robot(many, share):
    """Lengths times a power of two, which rounds nothing: so is the box."""
    robot, k1, zero, offset, x, R = _case("linear-7", "hooke")
    small = reach(robot, "hooke", k1, zero, each_on_its_own(share * k1, share * zero), offset, x, R)
    big, zero = claim.scaled_robot(robot, many, robot.mass_kg), many * zero
    large = reach(big, "hooke", k1, zero, each_on_its_own(share * k1, share * zero), many * offset, many * x, R)
    assert small.proved and large.proved
    np.testing.assert_allclose(large.radius_m, many * small.radius_m, rtol=1e-6)
    np.testing.assert_allclose(large.beside_m, many * small.beside_m, rtol=1e-6)


def test_a_direction_that_is_balanced_to_the_last_bit_is_proved_too():
    robot, k1, zero, offset, x, R = cases.in_a_plane()
    got = reach(robot, "hooke", k1, zero, each_on_its_own(0 * k1, 1e-5 * zero), offset, x, R)
    assert got.proved
    signs = np.array(list(product((-1, 1), repeat=4)))
    found = _poses(robot, "hooke", np.tile(k1, (16, 1)), zero * (1 + 1e-5 * signs), offset, x, R)
    moved = np.abs(found.position_m).max(0)
    assert (moved <= got.radius_m).all() and (got.radius_m < 1.1 * moved + 1e-8).all()


CURVED = [("linear-7", "modified"), ("hangprinter-4", "hooke"), ("robocrane", "hooke")]


@pytest.mark.parametrize(("name", "law"), CURVED)
def test_what_is_left_beside_the_line_is_bounded(name, law):
    robot, k1, zero, offset, x, R = _case(name, law)
    w = robot.legs
    half = np.concatenate([1e-3 * k1, 1e-4 * zero])
    got = reach(robot, law, k1, zero, each_on_its_own(half[:w], half[w:]), offset, x, R)
    assert got.proved

    def poses(share):
        values = np.concatenate([k1, zero]) + share * half
        return _poses(robot, law, values[:, :w], values[:, w:], offset, x, R).position_m

    small = 0.03
    line = (poses(small * np.eye(2 * w)) - poses(-small * np.eye(2 * w))) / (2 * small)
    corners = np.random.default_rng(3).choice([-1.0, 1.0], (200, 2 * w))
    bent = np.abs(poses(corners) - (x + corners @ line)).max(0)
    assert (bent <= got.beside_m[:3]).all()
    assert (got.beside_m < got.radius_m - got.beside_m).all()  # the line is still the better part of the answer


@pytest.mark.parametrize("name", ["hangprinter-4", "robocrane", "linear-7"])
def test_strains_along_the_linear_answer_are_enclosed_and_what_cancels_does(name):
    """All lengths grow together: pose and length each change the strain, and on a robot of six wires almost cancel."""
    from flint import arb_mat

    robot, k1, zero, offset, x, R = _case(name, "hooke")
    w, longer = robot.legs, 1e-4 * zero
    generators = np.zeros((w, 1)), longer[:, None]
    middle = Balance(robot, "hooke", (k1, k1), (zero, zero), offset, x, R)
    wide = Balance(robot, "hooke", (k1, k1), (zero - longer, zero + longer), offset, x, R)
    line = module._linear_answer(middle, np.linalg.inv(middle.middle_slope()), generators)
    balls = module.balls(np.abs(line[:, 0]) * (1 + 1e-12)), module.balls(0 * line[:, 0])
    box = module._Box(*balls, arb_mat(line.tolist()))

    p = np.linspace(-1, 1, 101)
    moved = line * p
    turn = moved[3:].T / robot.size_m if robot.degrees == 6 else np.zeros((len(p), 3))
    turn *= 1 - (turn**2).sum(1, keepdims=True) / 12  # Cayley's numbers to a rotation vector
    shape = statics.geometry(robot, x[:, None] + moved[:3], np.moveaxis(rotation.matrix(turn) @ R, 0, -1))
    strain = statics.stretched(robot, shape, offset[:, None]) / (zero[:, None] + longer[:, None] * p) - 1
    for i in range(w):
        ball = module._strain(middle, wide, i, wide.strand(i, box.whole), box, generators[1][i])
        assert float(ball.lower()) <= strain[i].min() and strain[i].max() <= float(ball.upper())
        assert float(ball.upper() - ball.lower()) < 1.2 * np.ptp(strain[i])


def proved(beside, line=None, turned=None):
    """A proof about the origin; the linear answer to two parameters."""
    d = len(beside)
    line = np.zeros((d, 2)) if line is None else line
    R = np.eye(3) if turned is None else turned
    return module.Reach(True, np.array([1.0, 2.0, 3.0]), R, np.ones(d), np.array(beside), line)


def test_a_pose_within_the_proof_is_the_equilibrium_that_was_proved():
    """Beside the linear answer to the parameters, no farther than was proved, with what is not known of the pose."""
    none = np.zeros(2)
    proof = proved([0.5, 0.25, 0.125])
    for k, far in enumerate((0.5, 0.25, 0.125)):
        for side in (1.0, -1.0):
            way = side * np.eye(3)[k]
            assert proof.holds([1.0, 2.0, 3.0] + far * way, np.eye(3), none, 1.0, 0.0)  # to the bound itself
            assert not proof.holds([1.0, 2.0, 3.0] + 1.01 * far * way, np.eye(3), none, 1.0, 0.0)
            assert not proof.holds([1.0, 2.0, 3.0] + far * way, np.eye(3), none, 1.0, 0.01)
            assert proof.holds(
                [1.0, 2.0, 3.0] + 0.5 * far * way, np.eye(3), none, 1.0, 0.5 * np.array([0.5, 0.25, 0.125])
            )
    line = np.array([[1.0, 0.0], [0.0, -2.0], [0.5, 0.0]])
    p = np.array([0.5, -0.25])
    at = np.array([1.0, 2.0, 3.0]) + line @ p
    assert proved([1e-9] * 3, line).holds(at, np.eye(3), p, 1.0, 0.0)
    assert not proved([1e-9] * 3, line).holds(at, np.eye(3), -p, 1.0, 0.0)
    unproved = module.Reach(
        False, *(getattr(proof, n) for n in ("centre_m", "rotation", "radius_m", "beside_m", "line_m"))
    )
    assert not unproved.holds(np.array([1.0, 2.0, 3.0]), np.eye(3), none, 1.0, 0.0)


@pytest.mark.parametrize("angle", [0.3, 1e-3, 0.0])
def test_a_turn_counts_by_twice_the_tangent_of_its_half(angle):
    """Against the turn that was proved, times the platform's size."""
    base = rotation.matrix(np.array([0.4, -0.2, 0.1]))
    turn = rotation.matrix(angle * np.array([0.0, 0.6, 0.8])) @ base
    far = 0.7 * 2.0 * np.tan(0.5 * angle) * np.array([0.0, 0.6, 0.8])
    x, none = np.array([1.0, 2.0, 3.0]), np.zeros(2)
    for part, held in ((1.001, True), (0.999, angle == 0.0)):
        beside = np.concatenate([np.full(3, 1e-12), part * far + 1e-12])
        assert proved(beside, turned=base).holds(x, turn, none, 0.7, 0.0) is held


def test_wires_that_vary_apart_have_a_parameter_each_for_stiffness_and_length():
    G, H = each_on_its_own(np.array([1.0, 2.0]), np.array([3.0, 4.0]))
    assert G.tolist() == [[1.0, 0.0, 0.0, 0.0], [0.0, 2.0, 0.0, 0.0]]
    assert H.tolist() == [[0.0, 0.0, 3.0, 0.0], [0.0, 0.0, 0.0, 4.0]]


def test_bounds_hold_every_sum_of_the_generators():
    """To the outside of what rounding may add, and hardly more."""
    middle, generators = np.array([0.1, 7.0]), np.array([[0.1, -0.2, 0.3], [0.0, 0.0, 0.0]])
    low, high = module._bounds(middle, generators)
    assert (low < middle - [0.6, 0.0]).all() and (high > middle + [0.6, 0.0]).all()
    np.testing.assert_allclose([low, high], [[-0.5, 7.0], [0.7, 7.0]], rtol=1e-11)


@pytest.mark.parametrize(("stiff", "long"), [(1.001, 0.1), (0.1, 1.001), (1.0, 0.1), (0.1, 1.0)])
def test_wires_that_might_have_no_stiffness_or_no_length_are_refused_at_once(stiff, long, monkeypatch):
    """One of them is enough, though the others are sound; nothing is computed."""
    robot, k1, zero, offset, x, R = _case("hangprinter-4", "hooke")

    def none(*given):
        raise AssertionError("computed")

    monkeypatch.setattr(module, "Balance", none)
    half_k1, half_zero = 0.1 * k1, 0.1 * zero
    half_k1[2], half_zero[1] = stiff * k1[2], long * zero[1]
    got = reach(robot, "hooke", k1, zero, each_on_its_own(half_k1, half_zero), offset, x, R)
    assert not got.proved and got.centre_m is x and got.rotation is R and got.line_m.shape == (3, 8)


def test_a_platform_free_to_move_has_no_proof():
    robot, k1, zero, offset, x, R = _case("hangprinter-4", "hooke")
    got = reach(robot, "hooke", k1, zero + 5.0, each_on_its_own(1e-6 * k1, 1e-6 * zero), offset, x, R)
    assert not got.proved and np.isnan(got.radius_m).all()


def test_the_linear_answer_is_the_slope_of_the_pose():
    """By each wire's stiffness and length, against differences of solutions."""
    robot, k1, zero, offset, x, R = _case("cogiro-desk", "hooke")
    w = robot.legs
    half = np.concatenate([1e-5 * k1, 1e-6 * zero])
    middle = Balance(robot, "hooke", (k1, k1), (zero, zero), offset, x, R)
    line = module._linear_answer(middle, np.linalg.inv(middle.middle_slope()), each_on_its_own(half[:w], half[w:]))
    values = np.concatenate([k1, zero]) + np.vstack([np.diag(half), -np.diag(half)])
    found = _poses(robot, "hooke", values[:, :w], values[:, w:], offset, x, R)
    turn = robot.size_m * rotation.vector(found.rotation @ R.T)
    moved = np.concatenate([found.position_m - x, turn], axis=1)
    slope = 0.5 * (moved[: 2 * w] - moved[2 * w :])
    np.testing.assert_allclose(line.T, slope, atol=1e-3 * np.abs(slope).max())


class Image:
    """Images as they are written down, one after the other, of a linear answer that is; how large the boxes were."""

    def __init__(self, monkeypatch, Y, *factors):
        self.boxes, self.factors = [], list(factors)
        system = SimpleNamespace(middle_slope=lambda: np.eye(3))
        monkeypatch.setattr(module, "Balance", lambda *given: system)
        monkeypatch.setattr(module, "_linear_answer", lambda *given: Y)
        monkeypatch.setattr(module, "_image", self)

    def __call__(self, middle, wide, C, Y, generators, along, beside):
        self.along = along
        self.boxes.append(beside.copy())
        factor = self.factors.pop(0) if len(self.factors) > 1 else self.factors[0]
        return factor * beside


def asked(monkeypatch, *factors):
    robot = schema.read_robot_file("hangprinter-4")
    Y = np.array([[0.1, -0.2, 0.3, 0.0], [0.0, 0.0, 0.0, 0.0], [1e-3, 1e-3, -1e-3, 1e-3]])
    images = Image(monkeypatch, Y, *factors)
    generators = np.zeros((4, 4)), np.zeros((4, 4))
    got = reach(robot, "hooke", np.ones(4), np.ones(4), generators, np.zeros(4), np.zeros(3), np.eye(3))
    return robot, Y, images, got


def test_the_box_beside_the_line_grows_until_its_image_lies_within(monkeypatch):
    """Sums are rounded outwards, so that no digit of what is proved is lost."""
    robot, Y, images, got = asked(monkeypatch, 10.0, 1.0, 0.9)
    first = 1e-10 * robot.span_m
    np.testing.assert_allclose([box[0] for box in images.boxes], [first, 12.0 * first, 14.4 * first])
    assert got.proved and got.line_m is Y
    np.testing.assert_array_equal(got.beside_m, images.boxes[-1])
    most = np.abs(Y).sum(1)
    assert (images.along[[0, 2]] > most[[0, 2]]).all()
    np.testing.assert_allclose(images.along, most, rtol=1e-11)
    assert (got.radius_m > most + got.beside_m).all()
    np.testing.assert_allclose(got.radius_m, most + got.beside_m, rtol=1e-11)


@pytest.mark.parametrize(("factor", "images"), [(1.0, 40), (1e5, 2), (np.array([0.5, 0.5, 1.0]), 40), (np.inf, 1)])
def test_a_box_that_does_not_hold_its_image_is_given_up(factor, images, monkeypatch):
    """After thirty images, or once it is as wide as the robot."""
    _, _, seen, got = asked(monkeypatch, factor)
    assert not got.proved and len(seen.boxes) == images


def test_all_poses_of_a_box_are_those_on_the_line_and_beside_it(monkeypatch):
    """Rounded outwards; what lies beside the line is a part of them."""
    robot, k1, zero, offset, x, R = _case("hangprinter-4", "hooke")
    generators = each_on_its_own(1e-6 * k1, 1e-7 * zero)
    middle = Balance(robot, "hooke", (k1, k1), (zero, zero), offset, x, R)
    wide = Balance(robot, "hooke", module._bounds(k1, generators[0]), module._bounds(zero, generators[1]), offset, x, R)
    C = np.linalg.inv(middle.middle_slope())
    Y = module._linear_answer(middle, C, generators)
    along, beside = np.abs(Y).sum(1), np.array([1e-7, 2e-7, 3e-7])
    seen, balls = [], module.balls

    def watched(radii):
        seen.append(np.array(radii))
        return balls(radii)

    monkeypatch.setattr(module, "balls", watched)
    image = module._image(middle, wide, C, Y, generators, along, beside)
    assert (seen[0] > along + beside).all() and (image < beside).all() and (image > 0).all()
    np.testing.assert_allclose(seen[:2], [along + beside, beside], rtol=1e-11)
    wider = module._image(middle, wide, C, Y, generators, along, 100.0 * beside)
    assert (wider > image).all()  # a wider box bends more
