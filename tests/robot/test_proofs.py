"""The proved box of the pose after creep: it holds every pose that the bands allow, hardly more, and nothing else."""

from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.robot.lines import STRONGER, line_about
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import control, drift, forward, inverse
from wirebayes.robot.motion.course import Course
from wirebayes.robot.proof import proofs

TIMES = np.array([0.0, 60.0, 600.0])


@pytest.fixture(scope="module")
def hung() -> Any:
    """A platform on four wires, thirty draws of them, and their drift."""
    pytest.importorskip("flint")
    line = line_about(STRONGER | {"k1": 5000.0, "B": 0.03}, 0.01, 30)
    robot = schema.read_robot_file("hangprinter-4")
    wires = draws.for_robot(robot, line)
    return robot, wires, drift.from_command(robot, wires, robot.home_m, np.eye(3), TIMES)


def bands(wires: Wires, course: Course, share: float) -> list[tuple[np.ndarray, np.ndarray]]:
    """Least and largest stiffness and creep of each wire, in a share of the 90 % about its middle."""
    out = []
    for values in (np.broadcast_to(wires.theta["k1"], (4, 30)), course.end.strain(wires)):
        low, high = np.quantile(np.broadcast_to(values, (4, 30)), [0.05, 0.95], axis=1)
        out.append((0.5 * (low + high) - 0.5 * share * (high - low), 0.5 * (low + high) + 0.5 * share * (high - low)))
    return out


def commanded(robot: Any, wires: Wires) -> tuple[np.ndarray, np.ndarray]:
    """Lengths of the mean wire at home, (w,) each: zero-tension and beyond."""
    home, turn = robot.home_m[None], np.eye(3)[None]
    commands = inverse.commands(robot, control.known(wires), home, turn, inverse.tensions(robot, home, turn))
    return commands.zero_m[0], commands.offset_m[0]


def way(robot: Any, wires: Wires, course: Course) -> proofs._Way:
    k1, strain = bands(wires, course, 1.0)
    return proofs._Way(robot, wires.law, k1, strain, *commanded(robot, wires))


def test_the_box_holds_every_pose_that_the_bands_allow_and_is_no_wider_than_they_ask(hung: Any) -> None:
    robot, wires, course = hung
    band = proofs.enclosed(robot, wires, course, robot.home_m, np.eye(3))["band"]
    assert band["share"] == 1.0 and band["time_s"] == 600.0
    k1, strain = bands(wires, course, 1.0)
    bare, offset = commanded(robot, wires)
    corners = np.array(list(product((0, 1), repeat=8)))
    stiff, grown = (
        np.where(side, high, low)
        for side, (low, high) in zip((corners[:, :4], corners[:, 4:]), (k1, strain), strict=True)
    )
    every = Wires(wires.law, "saturating", {"k1": stiff.T}, np.full((4, 1), 1000.0))
    found = forward.solve_equilibrium(robot, every, bare * (1 + grown), offset, robot.home_m, np.eye(3))
    assert found.found.all()
    shift = 1e3 * (found.position_m - robot.home_m)
    low, high = np.asarray(band["low_mm"]), np.asarray(band["high_mm"])
    assert (low <= shift.min(0)).all() and (shift.max(0) <= high).all()
    assert (high - low < 1.5 * np.ptp(shift, axis=0)).all()


def test_of_a_platform_that_falls_or_is_not_found_nothing_is_proved(hung: Any) -> None:
    robot, wires, course = hung
    nothing = {"band": {"time_s": 600.0, "share": 0.0, "low_mm": None, "high_mm": None}}
    lost = SimpleNamespace(times_s=course.times_s, found=np.zeros(30, bool), falls=None)
    fallen = SimpleNamespace(times_s=course.times_s, found=course.found, falls=SimpleNamespace(fell=np.array([True])))
    for one in (lost, fallen):
        assert proofs.enclosed(robot, wires, one, robot.home_m, np.eye(3)) == nothing


def test_poses_that_the_commands_do_not_hold_are_not_proved(hung: Any) -> None:
    """The way begins at the commanded pose: from lengths that hold the platform elsewhere nothing is proved of it."""
    robot, wires, course = hung
    k1 = np.broadcast_to(control.known(wires).theta["k1"][:, 0], 4)
    one = way(robot, wires, course)
    assert one.proved(robot.home_m, np.eye(3), k1) is not None
    assert one.proved(robot.home_m + [0.0, 0.0, 0.01], np.eye(3), k1) is None
    near = np.array([0.0, 0.0, 1e-6 * robot.span_m])  # what counts as the same place, relative to the robot's size
    assert one.proved(robot.home_m + 0.8 * near, np.eye(3), k1) is not None
    assert one.proved(robot.home_m + 1.2 * near, np.eye(3), k1) is None
    slack = proofs._Way(robot, wires.law, one.k1, one.strain, one.bare + 5.0, one.offset)
    assert slack.proved(robot.home_m, np.eye(3), k1) is None


def test_a_proof_counts_only_about_the_equilibrium_that_is_followed(hung: Any) -> None:
    robot, wires, course = hung
    one = way(robot, wires, course)
    k1, none = np.broadcast_to(control.known(wires).theta["k1"][:, 0], 4), np.zeros(4)
    here = one._certain((robot.home_m, np.eye(3)), k1, none)
    assert here is not None
    ahead = none, 0.1 * one.strain[1]
    assert one._reach(here, k1, none, ahead) is not None
    assert one._reach((here[0] + [0.0, 0.0, 0.01], *here[1:]), k1, none, ahead) is None


def test_the_mean_wire_is_proved_alone_where_it_is(hung: Any) -> None:
    robot, wires, _ = hung
    found = proofs.only_equilibrium(robot, wires, robot.home_m, np.eye(3))
    bare, offset = commanded(robot, wires)
    k1 = np.broadcast_to(control.known(wires).theta["k1"][:, 0], 4)
    proof = proofs.certify(robot, wires.law, (k1, k1), (bare, bare), offset, robot.home_m, np.eye(3))
    assert found["proved"] is True and found["alone_within_m"] == proof.unique_m > 1e-5
    assert np.array_equal(found["enclosure_m"], proof.radius_m) and proof.radius_m.max() < 1e-11


def test_without_interval_arithmetic_or_with_effects_on_the_strain_no_proof_is_tried(
    hung: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    robot, wires, course = hung
    given = robot.home_m, np.eye(3)

    def missing(*arguments: Any) -> None:
        raise ImportError

    with monkeypatch.context() as patch:
        patch.setattr(proofs, "certify", missing)
        patch.setattr(proofs._Way, "proved", missing)
        found = proofs.only_equilibrium(robot, wires, *given)
        assert found["proved"] is None and "python-flint is not installed" in found["sentence"]
        assert proofs.enclosed(robot, wires, course, *given) == {}
    bent: Any = SimpleNamespace(at=lambda place: ["effect"] if place == "strain" else [])
    found = proofs.only_equilibrium(robot, bent, *given)
    assert found["proved"] is None and "without further effects" in found["sentence"]
    assert proofs.enclosed(robot, bent, course, *given) == {}


@pytest.mark.parametrize(("tried", "share"), [(1, 1.0), (3, 0.25), (5, 0.0625), (6, 0.0)])
def test_the_largest_share_that_can_be_proved_is_reported(
    tried: int, share: float, hung: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Bands about their middle, halved until one is proved, with the commanded stiffness among them; mm from there."""
    robot, wires, course = hung
    asked: list[Any] = []

    def proved(self: proofs._Way, x: Any, R: Any, k1: Any) -> Any:
        asked.append((self.k1, self.strain, self.bare, self.offset))
        assert x is home and np.array_equal(k1, known)
        if len(asked) < tried:
            return None
        return SimpleNamespace(centre_m=home + [1e-3, 0.0, -2e-3], radius_m=np.array([5e-4, 1e-3, 2e-3, 9.0]))

    home = robot.home_m
    known = np.broadcast_to(control.known(wires).theta["k1"][:, 0], 4)
    monkeypatch.setattr(proofs._Way, "proved", proved)
    band = proofs.enclosed(robot, wires, course, home, np.eye(3))["band"]
    assert band["share"] == share and band["time_s"] == 600.0 and len(asked) == min(tried, 5)
    if share:
        assert band["low_mm"] == pytest.approx([0.5, -1.0, -4.0]) and band["high_mm"] == pytest.approx([1.5, 1.0, 0.0])
    else:
        assert band["low_mm"] is None and band["high_mm"] is None
    for n, (k1, strain, bare, offset) in enumerate(asked):
        stiff, grown = bands(wires, course, 0.5**n)
        assert strain[0] == pytest.approx(grown[0]) and strain[1] == pytest.approx(grown[1])
        assert k1[0] == pytest.approx(np.minimum(stiff[0], known)) and k1[1] == pytest.approx(
            np.maximum(stiff[1], known)
        )
        assert (k1[0] <= known).all() and (known <= k1[1]).all()
        zero, beyond = commanded(robot, wires)
        assert bare == pytest.approx(zero) and offset == pytest.approx(beyond)


def test_only_draws_that_were_followed_count_for_the_bands(hung: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, wires, course = hung
    asked: list[Any] = []

    def proved(self: proofs._Way, *given: Any) -> Any:
        asked.append((self.k1, self.strain))
        return SimpleNamespace(centre_m=robot.home_m, radius_m=np.zeros(3))

    monkeypatch.setattr(proofs._Way, "proved", proved)
    few: Any = SimpleNamespace(times_s=course.times_s, found=np.arange(30) < 3, falls=None, end=course.end)
    proofs.enclosed(robot, wires, few, robot.home_m, np.eye(3))
    strain = np.broadcast_to(course.end.strain(wires), (4, 30))[:, :3]
    assert asked[0][1][1] == pytest.approx(np.quantile(strain, 0.95, axis=1))
    # a platform that did not fall is proved of; one that did in a single draw is not
    for fell, pieces in ((np.zeros(30, bool), 2), (np.arange(30) == 7, 2)):
        some: Any = SimpleNamespace(
            times_s=course.times_s, found=course.found, falls=SimpleNamespace(fell=fell), end=course.end
        )
        proofs.enclosed(robot, wires, some, robot.home_m, np.eye(3))
        assert len(asked) == pieces


class Walked(proofs._Way):
    """A way on which it is written down what is proved; what was asked, in order."""

    def __init__(self, widest: float, joined: bool = True, lost_at: int = 99, least: float = 0.5) -> None:
        robot: Any = SimpleNamespace(legs=2, span_m=1.0)
        k1, most = (np.array([9.0, 9.0]), np.array([11.0, 13.0])), np.array([3.0, 4.0])
        strain = least * most, most
        super().__init__(robot, "hooke", k1, strain, np.ones(2), np.zeros(2))
        self.widest, self.all_joined, self.lost_at = widest, joined, lost_at
        self.pieces: list[Any] = []
        self.stops: list[Any] = []

    def _certain(self, near: Any, k1_N: Any, strain: Any) -> Any:
        self.stops.append((k1_N.tolist(), strain.tolist()))
        return None if len(self.stops) == self.lost_at else (np.zeros(3), np.eye(3), np.zeros(3))

    def _reach(self, here: Any, k1_N: Any, strain: Any, band: Any) -> Any:
        self.pieces.append((k1_N.tolist(), strain.tolist(), band[0].tolist(), band[1].tolist()))
        return "proof" if (band[1] - band[0])[0] <= self.widest * 3.0 or band is self.strain else None

    def _joined(self, *given: Any) -> bool:
        return self.all_joined


def test_a_way_in_one_piece_is_proved_from_the_command_to_the_end() -> None:
    """A tenth of the creep beyond either side of a piece, but neither below nothing nor beyond all of it."""
    one = Walked(widest=1.0)
    assert one.proved(np.zeros(3), np.eye(3), np.array([10.0, 10.0])) == "proof"
    known, middle = [10.0, 10.0], [10.0, 11.0]
    assert one.stops == [(known, [0.0, 0.0]), (middle, [2.25, 3.0])]
    assert one.pieces == [(known, [0.0, 0.0], [0.0, 0.0], [3.0, 4.0]), (middle, [2.25, 3.0], [1.5, 2.0], [3.0, 4.0])]


def test_a_piece_that_is_not_proved_is_halved() -> None:
    """All wires creep alike: a piece is as wide as its share of the creep, and a tenth on either side."""
    one = Walked(widest=0.46, least=1.0)
    assert one.proved(np.zeros(3), np.eye(3), np.array([10.0, 10.0])) == "proof"
    assert [stop[1][1] / 4.0 for stop in one.stops] == pytest.approx([0.0, 0.25, 0.5, 0.75, 1.0])
    spans = [(piece[2][0] / 3.0, piece[3][0] / 3.0) for piece in one.pieces]
    expected = [(0.0, 1.0), (0.0, 0.6), (0.0, 0.35), (0.15, 0.6), (0.4, 1.0), (0.4, 0.85), (0.65, 1.0), (1.0, 1.0)]
    np.testing.assert_allclose(spans, expected)
    # the first piece begins with the commanded wires, the others with those in the middle of the bands
    assert [piece[0] for piece in one.pieces[2:4]] == [[10.0, 10.0], [10.0, 11.0]]


def test_a_way_that_is_not_joined_lost_or_too_wide_is_not_proved() -> None:
    given = np.zeros(3), np.eye(3), np.array([10.0, 10.0])
    assert Walked(widest=1.0, joined=False).proved(*given) is None
    for lost_at in (1, 2):
        assert Walked(widest=1.0, lost_at=lost_at).proved(*given) is None
    hopeless = Walked(widest=-1.0)
    assert hopeless.proved(*given) is None
    assert len(hopeless.pieces) == 5  # 1, 1/2, 1/4, 1/8 and 1/16, which is less than a tenth
    far = Walked(widest=1.0)
    assert far.proved(np.array([0.0, 2e-6, 0.0]), *given[1:]) is None and far.pieces == []


def test_a_proof_is_joined_by_parameters_in_units_of_its_bands() -> None:
    """A wire outside of what was proved joins nothing; one whose band has no width lies in its middle."""
    asked: list[Any] = []

    def holds(x: Any, R: Any, p: Any, size: float, slack: Any) -> bool:
        asked.append((x, R, p.tolist(), size, slack))
        return True

    robot: Any = SimpleNamespace(size_m=0.4)
    one = proofs._Way(robot, "hooke", (np.array([9.0, 9.0]), np.array([11.0, 9.0])), None, None, None)  # type: ignore[arg-type]
    proof: Any = SimpleNamespace(holds=holds)
    here: Any = ("x", "R", "slack")
    band = np.array([1.0, 2.0]), np.array([3.0, 4.0])
    assert one._joined(proof, here, np.array([10.5, 9.0]), np.array([1.0, 4.0]), band)
    assert asked == [("x", "R", [0.5, 0.0, -1.0, 1.0], 0.4, "slack")]
    for k1, strain in (
        ([11.1, 9.0], [1.0, 4.0]),
        ([8.9, 9.0], [1.0, 4.0]),
        ([10.0, 9.0], [0.9, 4.0]),
        ([10.0, 9.0], [1.0, 4.1]),
    ):
        assert not one._joined(proof, here, np.array(k1), np.array(strain), band)
    assert len(asked) == 1
    assert one._joined(SimpleNamespace(holds=lambda *given: False), here, np.array([9.0, 9.0]), band[0], band) is False  # type: ignore[arg-type]


def test_a_piece_is_proved_about_its_middle(hung: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, wires, course = hung
    one = way(robot, wires, course)
    given: list[Any] = []
    answer: Any = SimpleNamespace(proved=True)

    def reach(*arguments: Any) -> Any:
        given.append(arguments)
        return answer

    monkeypatch.setattr(proofs, "reach", reach)
    monkeypatch.setattr(proofs._Way, "_solved", lambda self, near, k1, strain: (near, (k1, strain)))
    monkeypatch.setattr(proofs._Way, "_joined", lambda self, *arguments: joined)
    joined = True
    low, high = 0.2 * one.strain[0], 0.6 * one.strain[1]
    here: Any = ("x", "R", "slack")
    assert one._reach(here, "k1", "strain", (low, high)) is answer  # type: ignore[arg-type]
    ((used, law, stiff, zero, (G, H), offset, near, at),) = given
    grown = 0.5 * (low + high)
    assert used is robot and law == wires.law and near == ("x", "R") and offset is one.offset
    assert stiff == pytest.approx(0.5 * (one.k1[0] + one.k1[1])) and zero == pytest.approx(one.bare * (1.0 + grown))
    assert np.array_equal(at[0], stiff) and at[1] == pytest.approx(grown)
    assert np.diag(G[:, :4]) == pytest.approx(0.5 * (one.k1[1] - one.k1[0]))
    assert np.diag(H[:, 4:]) == pytest.approx(0.5 * one.bare * (high - low))
    joined = False
    assert one._reach(here, "k1", "strain", (low, high)) is None  # type: ignore[arg-type]
    joined, answer = True, SimpleNamespace(proved=False)
    assert one._reach(here, "k1", "strain", (low, high)) is None  # type: ignore[arg-type]
    monkeypatch.setattr(proofs._Way, "_solved", lambda self, *arguments: None)
    assert one._reach(here, "k1", "strain", (low, high)) is None  # type: ignore[arg-type]


def test_on_the_way_nobody_asks_how_far_an_equilibrium_is_alone(hung: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Which takes most of the time; the lengths are those that have crept so far, known exactly."""
    robot, wires, course = hung
    one = way(robot, wires, course)
    asked: list[Any] = []

    def certify(*given: Any, **known: Any) -> Any:
        asked.append((given, known))
        return SimpleNamespace(proved=len(asked) == 1, radius_m="radius")

    monkeypatch.setattr(proofs, "certify", certify)
    monkeypatch.setattr(proofs._Way, "_solved", lambda self, near, k1, strain: ("x", "R"))
    k1, strain = np.full(4, 5000.0), np.array([0.0, 1e-3, 2e-3, 3e-3])
    assert one._certain(("near", "R"), k1, strain) == ("x", "R", "radius")  # type: ignore[arg-type, comparison-overlap]
    (used, law, stiff, (low, high), offset, *pose), known = asked[0]
    assert used is robot and law == wires.law and stiff == (k1, k1) and offset is one.offset and pose == ["x", "R"]
    assert low is high and low == pytest.approx(one.bare * (1.0 + strain)) and known == {"how_alone": False}
    assert one._certain(("near", "R"), k1, strain) is None  # type: ignore[arg-type]
    monkeypatch.setattr(proofs._Way, "_solved", lambda self, *given: None)
    assert one._certain(("near", "R"), k1, strain) is None and len(asked) == 2  # type: ignore[arg-type]


def test_a_pose_is_solved_with_the_lengths_that_have_crept(hung: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its rotation is one to the last digits; a pose that is not found is none."""
    robot, wires, course = hung
    one = way(robot, wires, course)
    k1, strain = np.full(4, 5000.0), np.full(4, 1e-3)
    found = one._solved((robot.home_m, np.eye(3)), k1, strain)
    assert found is not None
    every = Wires("hooke", "saturating", {"k1": k1[:, None]}, np.ones((4, 1)))
    same = forward.solve_equilibrium(robot, every, (one.bare * 1.001)[None], one.offset, robot.home_m, np.eye(3))
    assert found[0] == pytest.approx(same.position_m[0], abs=1e-12) and found[1] == pytest.approx(np.eye(3), abs=1e-15)
    lost = SimpleNamespace(found=np.array([False]), position_m=same.position_m, rotation=same.rotation)
    monkeypatch.setattr(proofs.forward, "solve_equilibrium", lambda *given: lost)
    assert one._solved((robot.home_m, np.eye(3)), k1, strain) is None
