"""Forward kinematics in batch against scipy.optimize.root on the same equations, and the largest batch asked for.

    python analyses/robots/speed.py

scipy's solver gets the analytic Jacobian and the same start; its functions are written lean, for one robot at a time.
"""

import resource
import time
from typing import Any

import numpy as np
from scipy import optimize

from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.mechanics.description import GRAVITY
from wirebayes.robot.motion import drift, forward, inverse

SOLVES, SCIPY_SOLVES, REPEATS = 20_000, 200, 4
root: Any = optimize.root  # its stubs want the method as a literal


def equations(robot, k1, zero, offset):
    """Net wrench and its derivative by (position, rotation vector of a left turn) for one robot, plain numpy."""
    A, P, m, weight = robot.exit_m, robot.platform_m, robot.lines, np.array([0.0, 0.0, -robot.mass_kg * GRAVITY])
    c = robot.centre_of_mass_m
    eye = np.eye(3)

    def pose(q):
        x, y, z = q[3:]
        angle = np.sqrt(x * x + y * y + z * z)
        a, b = np.sinc(angle / np.pi), 0.5 * np.sinc(angle / (2 * np.pi)) ** 2
        K = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
        return eye + a * K + b * (K @ K)

    def residual(q):
        R = pose(q)
        r = P @ R.T
        line = q[:3] + r - A
        d = np.sqrt((line * line).sum(1))
        tau = np.maximum(k1 * ((m * d + offset) / zero - 1.0), 0.0)
        pull = line * (-tau * m / d)[:, None]
        arm = R @ c
        return np.concatenate([pull.sum(0) + weight, np.cross(r, pull).sum(0) + np.cross(arm, weight)])

    def derivative(q):
        # the left Jacobian maps a change of the rotation vector to a turn in the world's axes
        R = pose(q)
        r = P @ R.T
        line = q[:3] + r - A
        d = np.sqrt((line * line).sum(1))
        s = (m * d + offset) / zero - 1.0
        taut = s > 0
        tau, slope = np.where(taut, k1 * s, 0.0), np.where(taut, k1 / zero, 0.0)
        u = line / d[:, None]
        J = np.hstack([u, np.cross(r, u)])
        beta = tau * m / d
        K = (J * (slope * m * m - beta)[:, None]).T @ J
        cross = np.zeros((len(r), 3, 3))
        cross[:, 0, 1], cross[:, 0, 2], cross[:, 1, 2] = -r[:, 2], r[:, 1], -r[:, 0]
        cross -= cross.transpose(0, 2, 1)
        both = np.concatenate([np.broadcast_to(eye, (len(r), 3, 3)), -cross], 2)
        K += np.einsum("w,wki,wkj->ij", beta, both, both)
        arm = R @ c
        pull = u * (tau * m)[:, None]
        K[3:, 3:] += pull.T @ r - np.outer(weight, arm) - ((pull * r).sum() - weight @ arm) * eye
        v = q[3:]
        angle = np.linalg.norm(v)
        if angle > 1e-12:
            V = np.array([[0.0, -v[2], v[1]], [v[2], 0.0, -v[0]], [-v[1], v[0], 0.0]])
            left = eye + (1 - np.cos(angle)) / angle**2 * V + (angle - np.sin(angle)) / angle**3 * (V @ V)
            K[:, 3:] = K[:, 3:] @ left
        return -K

    return residual, derivative


def speed():
    print("solves a second, law (1), start 2 mm and 0.5 degrees off, lengths 1 mm from the commanded ones")
    print(f"{'robot':14s} {'batch':>10s} {'root hybr':>10s} {'root lm':>10s} {'times':>7s} {'same pose':>10s} found")
    rng = np.random.default_rng(0)
    for name in ("cogiro-desk", "segesta-8", "ipanema-1", "linear-6", "linear-7"):
        robot = schema.read_robot_file(name)
        line = draws.WireDraws(
            {"k1": rng.normal(800 * max(1, robot.mass_kg), 20, SOLVES)}
            | {k: np.ones(SOLVES) for k in ("B", "U", "k2", "N")},
            1000.0,
        )
        wires = draws.for_robot(robot, line)
        x, R = robot.home_m[None], np.eye(3)[None]
        commands = inverse.commands(robot, wires, x, R, inverse.tensions(robot, x, R))
        zero = commands.zero_m + 1e-3 * rng.normal(size=commands.zero_m.shape)
        start = x + 2e-3 * rng.normal(size=(SOLVES, 3))
        turn = rng.normal(0, np.radians(0.5), (SOLVES, 3))
        R = rotation.matrix(turn)
        ours_s, rates, same = np.inf, {"hybr": np.inf, "lm": np.inf}, 0.0
        for _ in range(REPEATS):  # the best of a few: other work on the machine only ever slows
            began = time.perf_counter()
            ours = forward.solve_equilibrium(robot, wires, zero, commands.offset_m, start, R)
            ours_s = min(ours_s, (time.perf_counter() - began) / SOLVES)
            for method in rates:
                answers = []
                began = time.perf_counter()
                for i in range(SCIPY_SOLVES):
                    f, J = equations(robot, wires.theta["k1"][0, i], zero[i], commands.offset_m[i])
                    answers.append(root(f, np.concatenate([start[i], turn[i]]), jac=J, method=method, tol=1e-12).x[:3])
                rates[method] = min(rates[method], (time.perf_counter() - began) / SCIPY_SOLVES)
                if method == "hybr":
                    same = np.mean(np.abs(answers - ours.position_m[:SCIPY_SOLVES]).max(1) < 1e-6)
        print(
            f"{name:14s} {1 / ours_s:10.0f} {1 / rates['hybr']:10.0f} {1 / rates['lm']:10.0f} "
            f"{rates['hybr'] / ours_s:7.0f} {same:10.3f} {ours.found.mean():.4f}"
        )


def large():
    robot = schema.read_robot_file("cogiro-desk")
    rng = np.random.default_rng(1)
    n = 10_000
    line = draws.WireDraws(
        {
            "k1": rng.normal(800, 20, n),
            "B": rng.normal(0.3, 0.03, n),
            "U": rng.normal(1, 0.03, n),
            "k2": rng.normal(0.03, 0.002, n),
            "N": rng.normal(0.64, 0.02, n),
        },
        1000.0,
    )
    wires = draws.for_robot(robot, line, 0.05, rng)
    began = time.perf_counter()
    course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.geomspace(5, 3600, 20))
    spent = time.perf_counter() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    solved = course.found.mean()
    print(f"10,000 draws x 8 wires x 20 times in one call: {spent:.1f} s, peak {peak:.2f} GB, {solved:.4f} solved")


if __name__ == "__main__":
    speed()
    large()
