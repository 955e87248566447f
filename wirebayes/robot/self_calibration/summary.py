"""What the posterior of a whole robot says of everything by name: means, standard deviations and 90 % intervals.

Where the error of the joint values is estimated, it is itself uncertain: a quantity's standard deviation then rests on
as many degrees of freedom as that error's, times the square of how strongly it follows it (Satterthwaite).
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import ndtri, stdtrit

from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.mechanics.winches import of_each_leg
from wirebayes.robot.mechanics.wire_doubts import doubts, wire_warnings
from wirebayes.robot.self_calibration.posterior import RobotPosterior, at_joint_error

_FACTOR = 1.05  # of the error of the joint values: a step for slopes of logarithms, which are smooth
_MANY = 1e6  # degrees of freedom: more make no difference


class Moment(NamedTuple):
    """Mean, standard deviation, and half the width of a 90 % interval in standard deviations."""

    mean: Floats
    sd: Floats
    half: Floats


@dataclass(frozen=True)
class Summary:
    """What a robot's owner asks for.

    Attributes
    ----------
    exit_m, platform_m : of (w, 3) arrays
    reference_m, length_m, drum, bias_N : of (w,) arrays
        `length_m`: zero-tension lengths after the last hold, creep included.
    position_m, turn_rad : of (p, 3) arrays
        `turn_rad`: rotation vectors; their errors are small turns about the world's axes.
    pull_N : of (p, w) arrays
    strain : (w,) array
        Creep after the last hold.
    """

    exit_m: Moment
    platform_m: Moment
    reference_m: Moment
    length_m: Moment
    drum: Moment
    bias_N: Moment
    position_m: Moment
    turn_rad: Moment
    pull_N: Moment
    strain: Floats


def summarised(found: RobotPosterior) -> Summary:
    """Means, standard deviations and half widths of 90 % intervals.

    Parameters
    ----------
    found : RobotPosterior
    """
    sds = _standard_deviations(found)
    halves = {name: np.full(np.shape(sd), ndtri(0.95)) for name, sd in sds.items()}
    if np.isfinite(found.degrees):
        wider = _standard_deviations(at_joint_error(found, _FACTOR))
        halves = {name: _half(sd, wider[name], found.degrees) for name, sd in sds.items()}
    moments = {}
    for name, mean in _means(found).items():
        moments[name] = Moment(mean, sds[name], halves[name])
    return Summary(**moments, strain=found.creep.strain[-1])


def wire_notices(robot: Robot, line: WireDraws, durations_s: Floats, found: Summary, usable: bool) -> list[Notice]:
    """What speaks against the fits of the wires, and where an answer that may be used leaves what was tested.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    durations_s : (p,) array
        How long each hold of the session took.
    found : Summary
    usable : bool
    """
    if not usable:
        return doubts(robot, line)
    return wire_warnings(robot, line, found.pull_N.mean, float(durations_s.max()), found.length_m.mean)


def _means(found: RobotPosterior) -> dict[str, Floats]:
    state = found.state
    parts = found.unknowns.parts(found.state.white)
    return {
        "exit_m": parts.exit_m,
        "platform_m": parts.platform_m,
        "reference_m": parts.reference_m,
        "length_m": (found.last_m + parts.reference_m) * (1 + found.creep.strain[-1]),
        "drum": parts.drum,
        "bias_N": parts.bias_N,
        "position_m": state.position_m,
        "turn_rad": turns.vector(state.rotation),
        "pull_N": np.maximum(state.pull_N, 0.0),
    }


def _half(sd: Floats, wider: Floats, degrees: float) -> Floats:
    """Quantiles of Student's t; `wider` are the standard deviations with an error of the joint values larger."""
    with np.errstate(divide="ignore", invalid="ignore"):
        slope = np.nan_to_num(np.log(wider / sd) / np.log(_FACTOR))  # what is exact follows nothing
        follows = np.clip(slope, 0.0, 1.0)  # as it does of normal posteriors; beyond, equations are nearly singular
        own = np.minimum(degrees / follows**2, _MANY)
    return np.asarray(stdtrit(own, 0.95))


def _slope_of_lengths(found: RobotPosterior) -> Floats:
    """The last zero-tension lengths by all unknowns: references, drums, and creep with the tensions that it follows."""
    unknowns = found.unknowns
    creep = found.creep
    strain = creep.strain[-1]
    bare = found.last_m + unknowns.parts(found.state.white).reference_m
    leg = np.arange(len(bare))
    tensions = found.by_robot[:, unknowns.robot.degrees :]
    slope = bare[:, None] * np.einsum("pw,pwm->wm", creep.by_pull[-1], tensions)
    slope[:, unknowns.slices["wires"]] += bare[:, None] * creep.by_wires[-1]
    slope[leg, unknowns.references.start + leg] += (1 + strain) * unknowns.prior.reference_sd_m
    if unknowns.errors.drum > 0:
        slope[leg, unknowns.drum_columns] = unknowns.errors.drum * found.last_m * ~unknowns.robot.is_linear
    return slope


def _standard_deviations(found: RobotPosterior) -> dict[str, Floats]:
    unknowns = found.unknowns
    errors = found.unknowns.errors
    robot = unknowns.robot
    prior = unknowns.prior
    w = robot.legs
    d = robot.degrees
    sd = np.sqrt(np.diag(found.covariance))
    variance = np.einsum("pii->pi", found.hold_covariance)
    hold = np.sqrt(np.maximum(variance, 0.0))

    def unknown(name: str, error: float, shape: tuple[int, ...]) -> Floats:
        own = sd[unknowns.slices[name]]
        if not len(own):
            return np.zeros(shape)
        return error * own.reshape(shape)

    slope = _slope_of_lengths(found)
    length = np.sqrt(np.einsum("wi,ij,wj->w", slope, found.covariance, slope))
    drum = unknown("drum", errors.drum, (robot.joints,))
    bias = np.zeros(w)
    if prior.bias_sd_N > 0:
        bias = prior.bias_sd_N * sd[unknowns.slices["wires"]][-w:]
    turn = np.zeros((len(hold), 3))
    if d == 6:
        turn = hold[:, 3:d] / robot.size_m
    return {
        "exit_m": unknown("exit", errors.exit_m, (w, 3)),
        "platform_m": unknown("platform", errors.platform_m, (w, 3)),
        "reference_m": prior.reference_sd_m * sd[unknowns.references],
        "length_m": length,
        "drum": of_each_leg(robot, drum),
        "bias_N": bias,
        "position_m": hold[:, :3],
        "turn_rad": turn,
        "pull_N": hold[:, d:],
    }
