from types import SimpleNamespace

import numpy as np
import pytest

from analyses.robots.enclosure import enclose
from tests.robot.cases import HANGING
from wirebayes.robot.mechanics import rotation, schema
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import claim, forward
from wirebayes.robot.proof import certificate
from wirebayes.robot.proof.certificate import certify

from . import cases


def _case(name, law, make=cases.commanded, seed=0):
    robot = schema.read_robot_file(name)
    c = make(robot, law, 2, np.random.default_rng(seed))
    found = cases.solved(robot, c)
    return robot, c.wires.theta["k1"][0, 0], c.zero_m[0], c.offset_m[0], found.position_m[0], found.rotation[0]


def _of_known_wires(robot, k1, zero, offset, x, R, law="hooke", **how):
    """The proof for one stiffness of all wires and one set of lengths."""
    known = np.full(robot.legs, k1)
    return certify(robot, law, (known, known), (zero, zero), offset, x, R, **how)


@pytest.mark.parametrize("name", HANGING)
@pytest.mark.parametrize("law", ["hooke", "modified"])
def test_every_shipped_robot_can_be_certified(name, law):
    proof = _of_known_wires(*_case(name, law), law)
    assert proof.proved
    assert proof.radius_m.max() < 1e-11
    assert proof.unique_m > 1e-5


@pytest.mark.parametrize("name", ["cogiro-desk", "linear-7", "hangprinter-4"])
def test_every_sampled_pose_lies_in_the_guaranteed_enclosure(name):
    robot, k1, zero, offset, x, R = _case(name, "hooke")
    rng = np.random.default_rng(1)
    w = robot.legs
    low, high = np.full(w, k1 * 0.9997), np.full(w, k1 * 1.0003)
    half = 2e-5
    proof = certify(robot, "hooke", (low, high), (zero - half, zero + half), offset, x, R)
    assert proof.proved
    n = 400
    corners = rng.random((2, n, w)) < 0.5
    inside = rng.random((2, n, w))
    share = np.where(np.arange(n)[:, None] < n // 2, corners, inside)
    wires = Wires("hooke", "saturating", {"k1": (low + (high - low) * share[0]).T}, np.full((w, 1), 1000.0))
    found = forward.solve_equilibrium(robot, wires, zero + half * (2 * share[1] - 1), offset, x, R)
    assert found.found.all()
    reach = np.abs(found.position_m - x).max(0)
    assert (reach <= proof.radius_m[:3]).all()
    assert (proof.radius_m[:3] < 4 * reach).all()  # an enclosure, not a room
    if robot.degrees == 6:
        turn = rotation.vector(found.rotation @ R.T)
        cayley = (
            2
            * np.tan(0.5 * np.linalg.norm(turn, axis=1, keepdims=True))
            * turn
            / np.linalg.norm(turn, axis=1, keepdims=True)
        )
        assert (robot.size_m * np.abs(cayley).max(0) <= proof.radius_m[3:]).all()


@pytest.mark.parametrize("many", [2.0**7, 2.0**-30])
def test_a_proof_grows_with_the_robot(many):
    """Lengths times a power of two, which rounds nothing: so are both boxes."""
    robot, k1, zero, offset, x, R = _case("linear-7", "hooke")
    small = _of_known_wires(robot, k1, zero, offset, x, R)
    big = claim.scaled_robot(robot, many, robot.mass_kg)
    large = _of_known_wires(big, k1, many * zero, many * offset, many * x, R)
    assert large.proved and large.unique_m == pytest.approx(many * small.unique_m, rel=1e-6)
    np.testing.assert_allclose(large.radius_m, many * small.radius_m, rtol=1e-6)


def test_a_direction_that_is_balanced_to_the_last_bit_is_proved_too():
    """A weight on wires in a plane swings out of it like a pendulum: no force there, and none that rounding adds."""
    proof = _of_known_wires(*cases.in_a_plane())
    assert proof.proved and proof.radius_m.max() < 1e-14


def test_a_wrong_pose_is_not_certified():
    robot, k1, zero, offset, x, R = _case("linear-7", "hooke")
    proof = _of_known_wires(robot, k1, zero, offset, x - [0.0, 0.0, 0.002], R)
    # the enclosure must hold the true pose, or nothing may be said
    assert not proof.proved or np.all(np.abs(x - proof.centre_m) <= proof.radius_m[:3])


def test_a_platform_free_to_move_is_not_certified():
    robot, k1, zero, offset, x, R = _case("linear-7", "hooke")
    assert not _of_known_wires(robot, k1, zero + 1, offset, x, R).proved


def test_bounds_too_wide_are_not_certified():
    robot, k1, zero, offset, x, R = _case("cogiro-desk", "hooke")
    known = np.full(robot.legs, k1)
    proof = certify(robot, "hooke", (0.5 * known, 2 * known), (zero - 0.05, zero + 0.05), offset, x, R)
    assert not proof.proved
    assert proof.unique_m == 0.0 and np.isnan(proof.radius_m).all()


def test_wires_on_the_edge_of_slackness_are_handled():
    assert _of_known_wires(*_case("cogiro-desk", "hooke", cases.disturbed, seed=2)).proved


@pytest.mark.parametrize("name", ["linear-7", "hangprinter-4"])
def test_lengths_that_change_together_are_enclosed_piece_by_piece(name):
    robot, k1, zero, offset, x, R = _case(name, "hooke")
    longer = zero * (1 + 3e-4 * np.linspace(0.8, 1.2, robot.legs))
    box = enclose(robot, "hooke", k1, zero, longer, offset, x, R)
    assert box.proved
    assert box.proofs > 1
    share = np.linspace(0, 1, 101)[:, None]
    wires = Wires("hooke", "saturating", {"k1": np.full((1, 1), k1)}, np.full((robot.legs, 1), 1000.0))
    found = forward.solve_equilibrium(robot, wires, zero + share * (longer - zero), offset, x, R).position_m
    assert (box.low_m <= found.min(0)).all()
    assert (found.max(0) <= box.high_m).all()
    assert (box.high_m - box.low_m).max() < 2 * np.ptp(found, axis=0).max()
    assert not enclose(robot, "hooke", k1, zero, longer, offset, x, R, most=1).proved


def test_the_box_without_a_second_equilibrium_is_the_enclosure_itself_where_nobody_asks():
    case = robot, _, _, _, x, R = _case("linear-7", "hooke")
    quick, whole = _of_known_wires(*case, how_alone=False), _of_known_wires(*case)
    assert quick.proved and quick.unique_m == quick.radius_m.min() and quick.centre_m is x and quick.rotation is R
    np.testing.assert_array_equal(quick.radius_m, whole.radius_m)
    # boxes are tried from a ten-millionth of the robot's size on, each half as wide again
    times = np.log(whole.unique_m / (1e-7 * robot.span_m)) / np.log(1.5)
    assert times > 5 and times == pytest.approx(round(times), abs=1e-6)


def test_what_was_not_proved_has_no_size():
    robot, k1, zero, offset, x, R = _case("linear-7", "hooke")
    proof = _of_known_wires(robot, k1, zero + 1, offset, x, R)
    assert (proof.proved, proof.unique_m) == (False, 0.0) and proof.centre_m is x and proof.rotation is R
    assert proof.radius_m.shape == (robot.degrees,) and np.isnan(proof.radius_m).all()


NOWHERE = None, None, None, "x", "R"  # bounds and pose, which written images do not look at


class Image:
    """Krawczyk's images as they are written down, one after the other; how large the boxes were."""

    def __init__(self, monkeypatch, *factors):
        self.boxes, self.factors = [], list(factors)
        system = SimpleNamespace(middle_slope=lambda: np.eye(3))
        monkeypatch.setattr(certificate, "Balance", lambda *given: system)
        monkeypatch.setattr(certificate, "_image", self)

    def __call__(self, system, C, radius):
        self.boxes.append(radius.copy())
        factor = self.factors.pop(0) if len(self.factors) > 1 else self.factors[0]
        return factor(radius) if callable(factor) else factor * radius


def test_a_box_grows_until_its_image_lies_within_and_then_shrinks(monkeypatch):
    robot = schema.read_robot_file("hangprinter-4")
    first = 1e-10 * robot.span_m
    images = Image(monkeypatch, 10.0, 2.0, 0.9, 0.8, 1.5, 0.5)
    proof = certify(robot, "hooke", *NOWHERE, how_alone=False)
    grown = first * 1.2 * 10.0 * 1.2 * 2.0
    sizes = [first, first * 12.0, grown, grown, 0.8 * grown, 0.8 * grown]
    np.testing.assert_allclose([box[0] for box in images.boxes], sizes)
    np.testing.assert_allclose(proof.radius_m, 0.4 * grown)


def test_a_box_must_hold_its_image_in_every_direction(monkeypatch):
    robot = schema.read_robot_file("hangprinter-4")
    narrow = lambda radius: radius * np.array([0.5, 0.5, 1.01])  # noqa: E731
    images = Image(monkeypatch, narrow, narrow, 0.5)
    assert certify(robot, "hooke", *NOWHERE, how_alone=False).proved
    first = 1e-10 * robot.span_m
    np.testing.assert_allclose(images.boxes[1], 1.2 * first * np.array([0.5, 0.5, 1.01]))
    assert len(images.boxes) == 3 + 3


def test_a_box_that_keeps_growing_is_given_up(monkeypatch):
    """After forty images, or once it is as wide as the robot in any direction."""
    robot = schema.read_robot_file("hangprinter-4")
    images = Image(monkeypatch, 1.0)
    assert not certify(robot, "hooke", *NOWHERE).proved and len(images.boxes) == 40
    images = Image(monkeypatch, 1e5)
    assert not certify(robot, "hooke", *NOWHERE).proved and len(images.boxes) == 2
    sideways = lambda radius: radius * np.array([0.5, 0.5, 1e12])  # noqa: E731
    images = Image(monkeypatch, sideways)
    assert not certify(robot, "hooke", *NOWHERE).proved and len(images.boxes) == 1


def test_a_box_holds_no_second_equilibrium_only_if_its_image_lies_within(monkeypatch):
    """Not at its edge, and not as far as the robot's size: the last width that held is the answer."""
    robot = schema.read_robot_file("hangprinter-4")
    for edge in (1.0, 1.5):
        images = Image(monkeypatch, 0.9, 0.5, 0.5, 0.5, 0.5, 0.5, edge)
        proof = certify(robot, "hooke", *NOWHERE)
        np.testing.assert_allclose([box[0] for box in images.boxes[4:]], 1e-7 * robot.span_m * 1.5 ** np.arange(3))
        assert proof.unique_m == pytest.approx(1.5e-7 * robot.span_m)
    none = Image(monkeypatch, 0.9, 0.5, 0.5, 0.5, 1.0)
    assert certify(robot, "hooke", *NOWHERE).unique_m < 1e-7 * robot.span_m and len(none.boxes) == 5
    one_way = lambda radius: radius * np.array([0.5, 0.5, 1.0])  # noqa: E731
    Image(monkeypatch, 0.9, 0.5, 0.5, 0.5, one_way)
    assert certify(robot, "hooke", *NOWHERE).unique_m < 1e-7 * robot.span_m
    whole = Image(monkeypatch, 0.5)
    assert 0.6 * robot.span_m < certify(robot, "hooke", *NOWHERE).unique_m < robot.span_m
    assert max(box[0] for box in whole.boxes) < robot.span_m
