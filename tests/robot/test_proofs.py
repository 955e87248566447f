"""The proved box of the pose after creep: it holds every pose that the bands allow, hardly more, and nothing else."""

from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import control, drift, forward, inverse
from wirebayes.robot.proof import proofs

TIMES = np.array([0.0, 60.0, 600.0])


@pytest.fixture(scope="module")
def hung() -> Any:
    """A platform on four wires, thirty draws of them, and their drift."""
    pytest.importorskip("flint")
    rng = np.random.default_rng(0)
    wire = {"k1": 5000.0, "B": 0.03, "U": 0.9, "k2": 0.03, "N": 0.64}
    line = draws.WireDraws({k: v * np.exp(0.01 * rng.standard_normal(30)) for k, v in wire.items()}, 1000.0)
    robot = schema.read("hangprinter-4")
    wires = draws.for_robot(robot, line)
    return robot, wires, drift.from_command(robot, wires, robot.home_m, np.eye(3), TIMES)


def bands(wires: Wires, course: drift.Course, share: float) -> list[tuple[np.ndarray, np.ndarray]]:
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


def way(robot: Any, wires: Wires, course: drift.Course) -> proofs._Way:
    k1, strain = bands(wires, course, 1.0)
    return proofs._Way(robot, wires.law, k1, strain, *commanded(robot, wires))


def test_the_box_holds_every_pose_that_the_bands_allow_and_is_no_wider_than_they_ask(hung: Any) -> None:
    robot, wires, course = hung
    band = proofs.enclosed(robot, wires, course, robot.home_m, np.eye(3))["band"]
    assert band["share"] == 1.0 and band["time_s"] == 600.0
    k1, strain = bands(wires, course, 1.0)
    bare, offset = commanded(robot, wires)
    corners = np.array(list(product((0, 1), repeat=8)))
    stiff, grown = (np.where(side, high, low) for side, (low, high) in zip((corners[:, :4], corners[:, 4:]),
                                                                           (k1, strain), strict=True))  # fmt: skip
    every = Wires(wires.law, "saturating", {"k1": stiff.T}, np.full((4, 1), 1000.0))
    found = forward.solve(robot, every, bare * (1 + grown), offset, robot.home_m, np.eye(3))
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
