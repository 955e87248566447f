"""Robots drawn at random: 3 to 9 wires in space, 2 and 4 in a plane, any origin, masses from 10 g to 50 t."""

from dataclasses import dataclass

import numpy as np

from wirebayes.robot.mechanics import draws, rotation
from wirebayes.robot.mechanics.description import GRAVITY, Robot, TensionRule
from wirebayes.robot.motion import inverse

KINDS = ("planar-2", "planar-4", "point-3", "point-4", "point-5", "body-6", "body-7", "body-8", "body-9")


@dataclass
class Drawn:
    """A robot, wires that suit its mass, and a pose that its tensions hold."""

    robot: Robot
    line: draws.WireDraws
    position_m: np.ndarray
    rotation: np.ndarray


def draw(kind, rng, count=1, sd=0.0):
    """One robot of a kind with `count` draws of its wires, at a feasible random pose."""
    for _ in range(500):
        robot = _robot(kind, rng)
        x = rng.uniform(robot.lower_m, robot.upper_m)
        R = rotation.matrix(rng.normal(0.0, 0.05, 3)) if robot.degrees == 6 else np.eye(3)
        tau = inverse.tensions(robot, x[None], R[None])[0]
        if np.isfinite(tau).all():
            return Drawn(robot, _line(robot, tau, rng, count, sd), x, R)
    raise RuntimeError(f"no feasible pose found for {kind}")


def _robot(kind, rng):
    shape, legs = kind.split("-")
    legs = int(legs)
    span = float(np.exp(rng.uniform(np.log(0.5), np.log(30.0))))
    mass = float(np.exp(rng.uniform(np.log(0.01), np.log(5e4))))
    origin = rng.choice([0.0, 1.0, 100.0]) * rng.normal(size=3) * span
    force = mass * GRAVITY
    exits, points = {"planar": _planar, "point": _point, "body": _body}[shape](legs, span, rng)
    lower, upper = np.array([[-0.15, -0.15, -0.25], [0.15, 0.15, 0.1]]) * span
    if shape == "planar":
        lower[1] = upper[1] = 0.0
        if rng.random() < 0.5:  # the other vertical plane
            exits, points, lower, upper = (v[..., [1, 0, 2]] for v in (exits, points, lower, upper))
    zeros = np.zeros(legs)
    return Robot(
        kind, kind, "drawn", "pose" if shape == "body" else "position", mass,
        points.mean(0) + (rng.normal(0, 0.02, 3) - [0, 0, 0.1]) * span * 0.2 if shape == "body" else np.zeros(3),
        exits + origin, points, np.ones(legs), np.full(legs, rng.choice([0.0, 0.3]) * span), ("drum",) * legs,
        zeros, zeros, ("default",) * legs, {}, TensionRule("minimum_norm", 0.1 * force, 5.0 * force),
        0.5 * (lower + upper) + origin, np.zeros(3), lower + origin, upper + origin,
    )  # fmt: skip


def _planar(legs, span, rng):
    x = np.array([-0.5, 0.5, -0.5, 0.5])[:legs]
    z = np.array([0.5, 0.5, -0.5, -0.5])[:legs]
    exits = np.stack([x, 0 * x, z], 1) * span * rng.uniform(0.9, 1.1, (legs, 3))
    return exits, np.zeros((legs, 3))


def _point(legs, span, rng):
    above = legs if legs == 3 else legs - 1 if rng.random() < 0.5 else legs
    turn = 2 * np.pi * (np.arange(above) + rng.uniform(-0.2, 0.2, above)) / above
    exits = np.stack([0.5 * np.cos(turn), 0.5 * np.sin(turn), rng.uniform(0.4, 0.6, above)], 1)
    below = np.column_stack([rng.uniform(-0.1, 0.1, (legs - above, 2)), np.full(legs - above, -0.6)])
    return np.vstack([exits, below]) * span, np.zeros((legs, 3))


def _body(legs, span, rng):
    """An octahedron's six wires from above, further ones from below."""
    corner = 2 * np.pi * np.repeat(np.arange(3), 2) / 3 + rng.uniform(-0.15, 0.15, 6)
    across = 2 * np.pi * (np.array([5, 0, 1, 2, 3, 4]) // 2) / 3 + np.pi / 3 + rng.uniform(-0.1, 0.1, 6)
    exits = np.stack([0.5 * np.cos(corner), 0.5 * np.sin(corner), rng.uniform(0.45, 0.55, 6)], 1)
    size = rng.uniform(0.1, 0.2)
    points = np.stack([size * np.cos(across), size * np.sin(across), rng.uniform(-0.02, 0.02, 6)], 1)
    more = legs - 6
    turn = 2 * np.pi * (np.arange(more) + rng.random()) / max(more, 1)
    low = np.stack([0.4 * np.cos(turn), 0.4 * np.sin(turn), np.full(more, -0.6)], 1)
    under = np.stack([0.5 * size * np.cos(turn + 0.4), 0.5 * size * np.sin(turn + 0.4), np.full(more, -0.03)], 1)
    return np.vstack([exits, low]) * span, np.vstack([points, under]) * span


def _line(robot, tau, rng, count, sd):
    """Wires that stretch by .2 to 2 % and creep by a fraction of that under the largest tension."""
    strain, creep = 10 ** rng.uniform(-2.7, -1.7), 10 ** rng.uniform(-0.7, 0.0)
    U, length = rng.uniform(0.7, 1.2), 1000.0
    means = {
        "k1": tau.max() / strain,
        "B": creep * strain * length / tau.max() ** U,
        "U": U,
        "k2": rng.uniform(0.02, 0.06),
        "N": rng.uniform(0.4, 0.8),
    }
    values = {k: v * np.exp(sd * rng.standard_normal(count)) for k, v in means.items()}
    return draws.WireDraws(values, length, str(rng.choice(["hooke", "modified"])))
