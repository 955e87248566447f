"""Platforms on fewer wires than degrees of freedom: orientations by balance against an independent energy minimiser.

The package finds orientation and tensions at a position, and lengths from them. The minimiser is given the lengths
alone: potential energy of elastic wires and weight written anew, with scipy's rotations, minimised from a pose
displaced by a hundredth. Positions and rotations (at the platform's edge) are compared relative to the size of the
robot, tensions relative to the largest one.

    python -m analyses.robots.hanging --robots 400
"""

import argparse
from collections import Counter
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Actuator
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import hanging, inverse

G = 9.80665


def drawn(rng):
    """A robot of two to five wires and a position: hanging above the platform, two of them in a vertical plane."""
    legs = int(rng.integers(2, 6))
    span, reach = np.exp(rng.uniform(np.log(0.5), np.log(8.0))), rng.uniform(0.05, 0.2)
    around = 2 * np.pi * (np.arange(legs) + rng.uniform(-0.2, 0.2, legs)) / legs + rng.uniform(0, 2 * np.pi)
    ring = np.column_stack([np.cos(around), np.sin(around), np.zeros(legs)])
    exits = 0.5 * span * ring * rng.uniform(0.8, 1.2, (legs, 1)) + [0, 0, span * rng.uniform(0.8, 1.0)]
    exits[:, 2] += 0.05 * span * rng.standard_normal(legs)
    points = reach * span * ring * rng.uniform(0.8, 1.2, (legs, 1)) + [0, 0, 0.3 * reach * span]
    centre = reach * span * np.array([*(0.1 * rng.standard_normal(2)), -0.3 * rng.random()])
    position = span * np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.2, 0.5)])
    if legs == 2:  # all in the plane y = 0: two wires hold nothing beside a vertical plane
        exits[:, 1] = points[:, 1] = centre[1] = position[1] = 0.0
        exits[:, 0], points[:, 0] = span * np.array([-0.5, 0.5]), reach * span * np.array([-1.0, 1.0])
    mass = np.exp(rng.uniform(np.log(0.05), np.log(50.0)))
    base = schema.read_robot_file("cogiro")
    drum: Actuator = "drum"
    robot = replace(
        base, exit_m=exits, platform_m=points, lines=np.ones(legs), beyond_m=np.zeros(legs), mass_kg=mass,
        actuator=(drum,) * legs, ratio=np.zeros(legs), wire_m=np.zeros(legs), wire=("default",) * legs,
        centre_of_mass_m=centre, home_m=position, home_rotation_rad=np.zeros(3), pulleys=None, drums=None,
        mass_kg_m=None, rule=replace(base.rule, lowest_N=0.01 * mass * G, highest_N=5.0 * mass * G),
    )  # fmt: skip
    return robot, float(np.exp(rng.uniform(np.log(30.0), np.log(3000.0)))) * mass * G, rng


def compared(robot, k1, rng):
    """Differences of position, rotation and tension between package and minimiser; None where nothing hangs."""
    found = hanging.hang(robot, robot.home_m[None], np.eye(3))
    if not found.held[0]:
        return None
    legs = robot.legs
    wires = Wires("hooke", "saturating", {"k1": np.full((1, 1), k1)}, np.full((legs, 1), 1000.0))
    zero = inverse.commands(robot, wires, robot.home_m[None], found.rotation, found.tension_N).zero_m[0]
    R = found.rotation[0]
    start = robot.home_m + 0.01 * robot.size_m * rng.standard_normal(3)
    turn = Rotation.from_rotvec(0.01 * rng.standard_normal(3)).as_matrix() @ R
    x, turned, tension = lowest_energy(
        robot.exit_m,
        robot.platform_m,
        robot.centre_of_mass_m,
        robot.mass_kg,
        np.full(legs, k1),
        zero,
        start,
        turn,
        minimize,
    )
    size = robot.span_m
    angle = Rotation.from_matrix(turned @ R.T).magnitude()
    return (
        float(np.linalg.norm(x - robot.home_m) / size),
        float(robot.size_m * angle / size),
        float(np.abs(tension - found.tension_N[0]).max() / found.tension_N[0].max()),
    )


def lowest_energy(exits, points, centre, mass, k1, zero, start, turn, minimise):
    """Pose and tensions of least potential energy near a start: weight and wires that obey Hooke's law."""
    edge = np.linalg.norm(points, axis=1).max()

    def pose(q):
        return start + q[:3], Rotation.from_rotvec(q[3:] / edge).as_matrix() @ turn

    def energy(q):
        x, R = pose(q)
        line = x + points @ R.T - exits
        distance = np.linalg.norm(line, axis=1)
        stretch = np.maximum(distance - zero, 0.0)
        value = (0.5 * k1 * stretch**2 / zero).sum() + mass * G * (x + R @ centre)[2]
        pull = (k1 * stretch / zero / distance)[:, None] * line
        force = pull.sum(0) + [0.0, 0.0, mass * G]
        moment = np.cross(points @ R.T, pull).sum(0) + np.cross(R @ centre, [0.0, 0.0, mass * G])
        return value, force, moment

    def slope(q):
        _, force, moment = energy(q)
        v = q[3:] / edge
        angle = np.linalg.norm(v)
        K = np.cross(np.eye(3), v).T  # K @ y = v x y
        a = np.sinc(angle / (2 * np.pi)) ** 2 / 2
        b = (1 - np.sinc(angle / np.pi)) / angle**2 if angle > 1e-4 else 1 / 6
        left = np.eye(3) + a * K + b * K @ K  # turn in the world by a change of the rotation vector
        return np.concatenate([force, left.T @ moment / edge])

    def curvature(q):
        step = 1e-5 * edge
        H = np.column_stack([(slope(q + step * e) - slope(q - step * e)) / (2 * step) for e in np.eye(6)])
        return 0.5 * (H + H.T)

    # by trust regions: it only goes down, however stiff the wires
    found = minimise(
        lambda q: energy(q)[0],
        np.zeros(6),
        jac=slope,
        hess=curvature,
        method="trust-exact",
        options={"gtol": 1e-6 * mass * G, "maxiter": 3000, "initial_trust_radius": 1e-3 * edge},
    )
    q = found.x
    for _ in range(4):  # to rounding
        q = q - np.linalg.solve(curvature(q), slope(q))
    x, R = pose(q)
    distance = np.linalg.norm(x + points @ R.T - exits, axis=1)
    return x, R, k1 * np.maximum(distance - zero, 0.0) / zero


def main():
    """Print the largest differences by number of wires."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=400)
    count = parser.parse_args().robots
    worst, hung, tried = {}, Counter(), Counter()
    for seed in range(count):
        case = drawn(np.random.default_rng(seed))
        legs = case[0].legs
        tried[legs] += 1
        found = compared(*case)
        if found is not None:
            hung[legs] += 1
            worst[legs] = np.maximum(worst.get(legs, np.zeros(3)), found)
    print("wires  drawn  hang  position  rotation  tension (largest differences)")
    for legs in sorted(tried):
        print(f"{legs:5d}  {tried[legs]:5d}  {hung[legs]:4d}  " + "  ".join(f"{v:.1e}" for v in worst[legs]))
    print(f"all    {sum(tried.values()):5d}  {sum(hung.values()):4d}")


if __name__ == "__main__":
    main()
