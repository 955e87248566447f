"""Forward kinematics of commands: whether they lead back to their pose, and where else the platform could hang."""

import numpy as np
from numpy.random import Generator

from wirebayes.json_files.pose import EquilibriaJson, EquilibriumPose, ForwardKinematics
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import plane
from wirebayes.robot.mechanics import rotation as turning
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import control, equilibria, forward, inverse, one_sided, outcome
from wirebayes.robot.pose.request import band_over_draws

_SAME = 1e-6  # of the robot's span: nearer, two poses are one


def round_trip(robot: Robot, wires: Wires, commands: inverse.Commands, x: Floats, R: Floats) -> ForwardKinematics:
    """Forward kinematics of the commands, from a start beside the pose, must return to it.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        ``n`` draws.
    commands : Commands
        To the pose.
    x, R : (3,), (3, 3) arrays
        The pose.
    """
    lengths = commands.zero_m, commands.offset_m
    beside = x + 0.01 * robot.size_m
    near, turned = plane.onto(robot, beside[None], R[None])
    back = forward.solve_equilibrium(robot, wires, *lengths, near[0], turned[0])
    off_m = np.abs(back.position_m - x)[back.found]
    slack = commands.tension_N[0] <= 0
    everywhere = np.repeat(x[None], len(commands.zero_m), axis=0)
    stiffness = one_sided.lowest_stiffness(robot, wires, (everywhere, commands.rotation), lengths)
    statuses = {}
    for code, text in outcome.STATUS.items():
        ended_so = back.status == code
        statuses[text] = int(ended_so.sum())
    return {
        "solved": float(back.found.mean()),
        "statuses": statuses,
        "largest_round_trip_error_m": float(off_m.max(initial=0.0)),
        "slack_wires": int(slack.sum()),
        "lowest_stiffness_N_m": band_over_draws(stiffness[commands.feasible]),
    }


def stable_poses(robot: Robot, wires: Wires, x: Floats, R: Floats, rng: Generator) -> EquilibriaJson:
    """The commanded pose, and every stable pose that the same lengths of the mean wire allow, from many starts.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        Draws; the mean wire counts.
    x, R : (3,), (3, 3) arrays
        The commanded pose.
    rng : numpy Generator
    """
    mean = control.known(wires)
    tau = inverse.tensions(robot, x[None], R[None])
    commands = inverse.commands(robot, mean, x[None], R[None], tau)
    if robot.winch is not None:
        R = commands.rotation[0]
    if not commands.feasible[0]:  # some draws are strong enough, their mean is not
        return {"stable_found": 0, "starts": 0, "commanded_stable": False, "poses": []}
    here = forward.solve_equilibrium(robot, mean, commands.zero_m, commands.offset_m, x, R)
    away_m = np.abs(here.position_m[0] - x).max()
    returned = here.found[0] and away_m < _SAME * robot.span_m
    found = equilibria.equilibria(robot, mean, commands.zero_m[0], commands.offset_m[0], rng, known=(x, R))
    is_own = _is_at(robot, found, x, R)
    poses = []
    for position, turn, tension, own in zip(*found.poses, found.tension_N, is_own, strict=True):
        poses.append(_equilibrium(position, turn, tension, own, stable=True))
    if not is_own.any():
        poses.append(_equilibrium(x, R, tau[0], True, stable=False))
    return {
        "stable_found": len(found.position_m),
        "starts": 65,
        "commanded_stable": bool(returned),
        "poses": poses,
    }


def _is_at(robot: Robot, found: forward.Equilibria, x: Floats, R: Floats) -> Bools:
    """(n,) Which equilibria are at a pose, rotations being compared at the platform's edge."""
    moved = np.abs(found.position_m - x).max(1)
    turned = robot.size_m * np.abs(found.rotation - R).max((1, 2))
    return np.maximum(moved, turned) < _SAME * robot.span_m


def _equilibrium(x: Floats, R: Floats, tension_N: Floats, commanded: bool, *, stable: bool) -> EquilibriumPose:
    return {
        "position_m": x,
        "rotation_vector_rad": turning.vector(R),
        "slack_wires": int((tension_N <= 0).sum()),
        "commanded": bool(commanded),
        "stable": stable,
    }
