"""Calibration from tensions alone, simulated: coverage of the lengths' intervals, pose error before and after.

    python analyses/robots/calibration.py [--robots 240] [--wires FOLDER]

Every simulated robot draws its line from the posterior, its specimens from a spread of 5 %, its reference lengths
with an error of 5 mm; creeps for ten minutes at home and reads tensions (0.02 N) at ten poses held 30 s each. The
truth creeps in finer steps than the estimator's model. Calibrated with the creep model, and by Hooke's law alone.
Poses are commanded with at least 2.5 N in every wire, so that an error of 5 mm leaves few of them slack.
"""

import argparse
from dataclasses import replace
from pathlib import Path

import numpy as np

from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.answer import holds_of, joint_values_to
from wirebayes.robot.self_calibration.predicted import predict_session
from wirebayes.robot.self_calibration.residuals import misfit
from wirebayes.robot.self_calibration.seeds import best, near_requests
from wirebayes.robot.self_calibration.session import LengthPrior, Session
from wirebayes.robot.self_calibration.summary import summarised
from wirebayes.robot.self_calibration.unknowns import StatedErrors, Unknowns

TENSION_SD_N, REFERENCE_SD_M, SPREAD, LOWEST_N = 0.02, 5e-3, 0.05, 2.5
POSES, CANDIDATES, TESTS = 10, 200, 6


def stand_in(rng, n=1000):
    """Round numbers near a Roc line's posterior, for when no fit is given."""
    return draws.WireDraws(
        {
            "k1": 803 * np.exp(0.01 * rng.normal(size=n)),
            "B": 0.31 * np.exp(0.1 * rng.normal(size=n)),
            "U": rng.normal(1, 0.05, n),
            "k2": 0.03 * np.exp(0.05 * rng.normal(size=n)),
            "N": rng.normal(0.64, 0.02, n),
        },
        1000.0,
    )


def choose_poses(change_N, count):
    """Poses that together shrink the lengths' joint uncertainty most, chosen one after another."""
    information = change_N.mT @ change_N / TENSION_SD_N**2
    total = np.eye(change_N.shape[-1]) / REFERENCE_SD_M**2
    chosen = []
    for _ in range(count):
        together = total + information
        chosen.append(int(np.argmax(np.linalg.slogdet(together)[1])))
        total = together[chosen[-1]]
    return chosen


def length_sd_m(change_N):
    """(w,) standard deviations of the lengths, where tensions at poses change by so much a metre."""
    information = (change_N.mT @ change_N).sum(0) / TENSION_SD_N**2
    return np.sqrt(np.diag(np.linalg.inv(information + np.eye(len(information)) / REFERENCE_SD_M**2)))


def plan(robot, line, rng):
    """The session: home, then the poses that shrink the lengths' uncertainty most; and random ones for comparison."""
    mean = draws.for_robot(robot, line.centre())
    x = rng.uniform(robot.lower_m, robot.upper_m, (CANDIDATES, 3))
    R = rotation.matrix(0.1 * rng.normal(size=(CANDIDATES, 3)) * (robot.degrees == 6))
    tau = inverse.tensions(robot, x, R)
    good = np.isfinite(tau).all(1)
    x, R, tau = x[good], R[good], tau[good]
    commands = inverse.commands(robot, mean, x, R, tau)
    change = observability.length_sensitivity(robot, mean, x, R, commands.zero_m, commands.offset_m)[1]
    pick = choose_poses(change, POSES)
    home = robot.home_m[None], rotation.matrix(robot.home_rotation_rad)[None]
    first = inverse.commands(robot, mean, *home, inverse.tensions(robot, *home)).joint_m

    def session(chosen):
        return Session(
            np.concatenate([home[0], x[chosen]]),
            np.concatenate([home[1], R[chosen]]),
            np.concatenate([first, commands.joint_m[chosen]]),
            np.array([600.0] + [30.0] * POSES),
            np.array([False] + [True] * POSES),
            TENSION_SD_N,
        )

    chosen, random = (length_sd_m(change[rows]).mean() for rows in (pick, list(range(POSES))))
    both = f"{1e3 * chosen:.3f} / {1e3 * random:.3f} mm"
    print(f"  sd of a length, chosen / {POSES} random poses: {both} (stiffness and creep known)")
    return session(np.array(pick))


def pose_error(robot, prior, truth, reached, joints, x, R):
    """Distance, mm, from where each true robot ends up when told joint values."""
    wires, error = prior.wires(robot, truth)
    bare, offset = inverse.lengths(robot, np.broadcast_to(joints, error.shape))
    found = forward.solve_equilibrium(robot, wires, (bare + error) * (1 + reached.creep), offset, x, R)
    return 1e3 * np.linalg.norm(found.position_m - x, axis=1)


def found_lengths(robot, prior, session, readings):
    """What one robot's readings say of its lengths, all else but its wires exact."""
    unknowns, sent = Unknowns(robot, prior, StatedErrors(joint_m=0.0)), holds_of(robot, session, readings)
    holds = replace(sent, session=session.without_poses())
    with np.errstate(all="ignore"):
        return best(unknowns, holds, np.random.default_rng(0), about=near_requests(unknowns, sent))


def study(name, line, count, rng):
    print(name)
    robot = schema.read_robot_file(name)
    robot = replace(robot, rule=replace(robot.rule, lowest_N=LOWEST_N))
    session = plan(robot, line, rng)
    prior = LengthPrior(line, REFERENCE_SD_M, SPREAD)
    mean, cov = prior.moments(robot.legs)
    truth = rng.multivariate_normal(mean, cov, count)
    draw = rng.integers(line.count, size=count)
    for k, parameter in enumerate(prior.names):
        value = line.parameters[parameter][draw]
        truth[:, robot.legs + k] = np.log(value) if parameter in draws.CORE else value
    real = predict_session(robot, prior, session, truth, longest_step=0.35)
    readings = np.maximum(real.readings + rng.normal(size=real.readings.shape), 0.0)
    print(f"  readings of slack wires: {(real.readings == 0).mean():.3f} of all")
    models = {"creep model": prior, "Hooke only": replace(prior, creeps=False)}
    results = {label: [found_lengths(robot, one, session, read) for read in readings] for label, one in models.items()}
    for label, each in results.items():
        length = [summarised(found).length_m for found in each]
        middle, sd, half = (np.array(part) for part in zip(*length, strict=True))
        inside = (np.abs(middle - real.length_m) <= half * sd).mean(1)
        error = 1e3 * (middle - real.length_m)
        print(
            f"  {label:12s} converged {np.mean([found.converged for found in each]):.3f}  "
            f"covers {inside.mean():.3f} +- "
            f"{inside.std() / np.sqrt(count):.3f} (90 % asked)  sd {1e3 * sd.mean():.3f} mm  "
            f"rmse {np.sqrt((error**2).mean()):.3f} mm  misfit {np.mean([misfit(found) for found in each]):.2f}"
        )
    tests = rng.uniform(robot.lower_m, robot.upper_m, (TESTS, 3))
    labels = "before, Hooke", "before, creep foreseen", "after, Hooke only", "after, creep model"
    errors = {label: [] for label in labels}
    centre = mean[None]
    foreseen = predict_session(robot, prior, session, centre)
    for x in tests:
        R = np.eye(3)
        tau = inverse.tensions(robot, x[None], R[None])
        if not np.isfinite(tau).all():
            continue
        plain = inverse.commands(robot, prior.wires(robot, centre)[0], x[None], R[None], tau)
        ahead = inverse.commands(robot, prior.wires(robot, centre)[0], x[None], R[None], tau, foreseen.creep.T)
        commands = {"before, Hooke": plain.joint_m, "before, creep foreseen": ahead.joint_m}
        for label, key in (("after, Hooke only", "Hooke only"), ("after, creep model", "creep model")):
            commands[label] = np.array([joint_values_to(found, x, R) for found in results[key]])
        for label, joints in commands.items():
            errors[label].append(pose_error(robot, prior, truth, real, joints, x, R))
    for label, values in errors.items():
        middle, high = np.quantile(values, [0.5, 0.95])
        print(f"  pose error {label:24s} median {middle:6.3f} mm, 95 % below {high:6.3f} mm")


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--robots", type=int, default=240)
    parser.add_argument("--wires", type=Path)
    parser.add_argument("--names", nargs="*", default=["cogiro-desk", "segesta-8", "linear-7"])
    options = parser.parse_args()
    rng = np.random.default_rng(7)
    if options.wires:
        from wirebayes.commands.wire_draws import read_wires

        line = read_wires(options.wires, 1000)
    else:
        line = stand_in(rng)
    for name in options.names:
        study(name, line, options.robots, rng)


if __name__ == "__main__":
    main()
