"""Whether wires unlike those that are stated would explain what a calibration contradicts, and how unlike they are."""

import numpy as np
from scipy.special import chdtrc

from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import whole_cost
from wirebayes.robot.self_calibration.trust import SIGNIFICANT, beyond_prior
from wirebayes.sentences import short

_NAMES = {"k1": "stiffness k1", "B": "creep amount B", "k2": "creep rate k2"}
_STEP = 1e-3  # of a prior sd: parameters are smooth
_LEAST = 1e-6  # of a variance: a parameter of which the readings say less has not been found


def unlike_wires(found: RobotPosterior) -> tuple[Notice, ...]:
    """Name the parameter of the wires that contradicts its prior most, where wires explain what contradicts.

    Parameters
    ----------
    found : RobotPosterior
    """
    moved, p_alone = _apart(found, found.unknowns.of_lines)
    _, p_geometry = _apart(found, found.unknowns.geometry)
    cost, count = whole_cost(found)
    left = chdtrc(count, max(cost - moved, 0.0))
    if not p_alone < SIGNIFICANT or p_geometry < p_alone or left < SIGNIFICANT:
        return ()
    name, times, chance_sd = _most_unlike(found)
    text = (
        f"wires whose {_NAMES[name]} is on average {short(times, 2)} times what is stated of them would explain what "
        f"contradicts, by {short(chance_sd, 2)} standard errors: check the wires' {name} (--wires, or the robot's "
        "file), or give --specimen-spread if wires of one line differ so"
    )
    return (Notice("misfit", text),)


def _apart(found: RobotPosterior, part: slice) -> tuple[float, float]:
    """How far some unknowns are from their prior (`beyond_prior`), and the probability of that."""
    moved = beyond_prior(found.state.white[None, part], found.covariance[None, part, part])
    return float(moved[0]), float(chdtrc(part.stop - part.start, moved[0]))


def _most_unlike(found: RobotPosterior) -> tuple[str, float, float]:
    """The parameter that is farthest from its prior on all wires' average: its name, times what, standard errors."""
    part = found.unknowns.of_lines
    white = found.state.white[part]
    learnt = np.eye(len(white)) - found.covariance[part, part]
    best = "k1", 1.0, 0.0
    for name, slope in _mean_logarithms(found).items():
        own = float(slope @ slope)
        variance = float(slope @ learnt @ slope)
        if variance <= _LEAST * own:
            continue
        shift = float(slope @ white)
        standard = abs(shift) / variance**0.5
        if standard > best[2]:
            # what the prior held back is given back: the readings alone would say so much
            best = name, float(np.exp(shift * own / variance)), standard
    return best


def _mean_logarithms(found: RobotPosterior) -> dict[str, Floats]:
    """How the mean logarithm of each parameter of all wires follows the white unknowns of the lines."""
    return {name: slopes.mean(0) for name, slopes in logarithms_of_legs(found).items()}


def logarithms_of_legs(found: RobotPosterior) -> dict[str, Floats]:
    """How the logarithm of each parameter of every wire ``(w, m)`` follows the white unknowns of the lines.

    Parameters
    ----------
    found : RobotPosterior
    """
    unknowns = found.unknowns
    mean, root = unknowns.moments
    first = unknowns.slices["wires"].start
    part = unknowns.of_lines
    columns = root[:, part.start - first : part.stop - first]
    wires, _ = unknowns.prior.wires(unknowns.robot, mean + _STEP * columns.T)
    about, _ = unknowns.prior.wires(unknowns.robot, mean[None])
    out = {}
    for name in _NAMES:
        if not (about.theta[name] > 0).all():  # a wire that does not creep
            continue
        ratio = np.log(wires.theta[name]) - np.log(about.theta[name])
        out[name] = np.asarray(np.broadcast_to(ratio, (unknowns.robot.legs, ratio.shape[1])) / _STEP)
    return out
