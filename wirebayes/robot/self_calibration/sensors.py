"""Which tension sensor is at fault, where readings contradict each other: one whose constant error explains it.

All sensors are given an unknown error at once. Estimates that are zero to their errors show no fault; where all but one
are, given that one, it is the one; where that is true of several, the readings do not tell them apart. Real sensors
have more errors than one: where none explains all, one that explains most of it is still named.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from wirebayes.json_files.calibrate import SensorsAtFault
from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone, shares_of
from wirebayes.result_warnings import Notice
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.estimate import estimate
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import misfit, trust
from wirebayes.robot.self_calibration.trust import SIGNIFICANT, chance
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.sentences import short

LEAST_HOLDS = 2  # read: at a single one an error of a sensor and one of a length look the same
_TRIES, _STILL = 3, 0.5  # searches, and standard deviations: along a narrow valley the last steps change little
MOST = 0.8  # of what contradicts: two sensors as bad as each other explain half of it each
_NEARLY_ALL = 99.5  # percent, which are rounded to all of it


@dataclass(frozen=True)
class Suspects:
    """Sensors whose constant error explains what the others contradict.

    Attributes
    ----------
    bias_N, sd_N : (w,) arrays
        Error of every sensor, were it alone at fault, and its standard deviation.
    p_none : float
        Probability of errors as large where no sensor has one.
    p_alone : (w,) array
        Probability that the other sensors' errors are as large where this one alone has one.
    explains : (w,) array
        Share of the sum of squares of all errors that this one alone explains.
    """

    bias_N: Floats
    sd_N: Floats
    p_none: float
    p_alone: Floats
    explains: Floats

    @property
    def wires(self) -> list[int]:
        """Wires, from 0, one of whose sensors is at fault; none where nothing or no single sensor explains it."""
        if not self.p_none < SIGNIFICANT:  # nor where it is not known
            return []
        alone = self.p_alone >= SIGNIFICANT
        return [int(i) for i in np.flatnonzero(alone if alone.any() else self.explains >= MOST)]


def weighed(bias_N: Floats, covariance: Floats, prior_sd_N: float) -> Suspects:
    """What estimates of all sensors' errors say of each.

    Parameters
    ----------
    bias_N : (w,) array
        With a prior of mean zero.
    covariance : (w, w) array
    prior_sd_N : float
        The prior's standard deviation, which is taken out.
    """
    w = len(bias_N)
    unit = np.eye(w)
    precision = inv(covariance)
    information = precision - unit / prior_sd_N**2
    score = precision @ bias_N  # of the readings alone: the prior's own is zero at zero
    own = np.maximum(np.diag(information), 1e-300)
    least = 1e-9 * np.trace(information) / w  # of a combination that the readings do not show
    together = solve(information + least * unit, score[:, None])[:, 0]
    total = float(score @ together)
    explained = score**2 / own
    left = np.maximum(total - explained, 0.0)
    alone = np.ones(w)
    if w > 1:
        alone = chdtrc(w - 1, left)
    share = np.clip(explained / max(total, 1e-300), 0.0, 1.0)
    by_chance = float(chdtrc(w, max(total, 0.0)))
    return Suspects(score / own, own**-0.5, by_chance, alone, share)


def suspects(found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None) -> Suspects | None:
    """Estimate an error of every sensor beside all else; None where they have one already, or nothing converged.

    Parameters
    ----------
    found : RobotPosterior
    holds : Holds
    progress : function of a share between 0 and 1
    """
    unknowns = found.unknowns
    if unknowns.prior.bias_sd_N > 0:
        return None
    read = np.isfinite(holds.tension_N)
    if read.all(1).sum() < LEAST_HOLDS:
        return None
    widest = float(holds.tension_N[read].max())  # no sensor is off by more than it ever read
    if not widest > 0:
        return None
    free = _with_biases(found, widest)
    legs = unknowns.robot.legs
    end = free.slices["wires"].stop
    sensors = slice(end - legs, end)
    white = np.insert(found.state.white, end - legs, np.zeros(legs))
    state = replace(found.state, white=white)
    bias = np.full(legs, np.inf)
    for part in shares_of(progress, _TRIES):
        other = estimate(free, holds, state, part)
        state = other.state
        before = bias
        bias = widest * state.white[sensors]
        covariance = widest**2 * other.covariance[sensors, sensors]
        sd = np.sqrt(np.diag(covariance))
        still = np.abs(bias - before) < _STILL * sd
        if other.converged or still.all():
            progress(1.0)
            return None if _explain_little(found, other) else weighed(bias, covariance, widest)
    return None


def _explain_little(found: RobotPosterior, other: RobotPosterior) -> bool:
    """Whether errors of all sensors together leave more of what contradicts stated errors than one may leave.

    Where the error of the joint values is estimated, it has taken up what contradicts.
    """
    if found.unknowns.errors.joint_m is None or trust(other) >= SIGNIFICANT:
        return False
    return misfit(other) > (1 - MOST) * misfit(found)


def _with_biases(found: RobotPosterior, sd_N: float) -> Unknowns:
    """The unknowns with an error of every tension sensor."""
    unknowns = found.unknowns
    # the error of the loops stays: it explains nothing that a sensor would, and the balance is exact
    errors = replace(unknowns.errors, joint_m=found.noise.joint_m)
    return replace(unknowns, prior=replace(unknowns.prior, bias_sd_N=sd_N), errors=errors)


def sensors_json(found: Suspects | None) -> SensorsAtFault | None:
    """What ``calibration.json`` holds of them.

    Parameters
    ----------
    found : Suspects or None
    """
    if found is None:
        return None
    named_wires = found.wires
    return {
        "wires": [i + 1 for i in named_wires],
        "bias_N": {"mean": found.bias_N[named_wires], "sd": found.sd_N[named_wires]},
        "explains": found.explains[named_wires],
        "p_none": found.p_none,
    }


def sensor_notices(found: Suspects | None) -> list[Notice]:
    """What to say of them.

    Parameters
    ----------
    found : Suspects or None
    """
    if found is None or not found.p_none < SIGNIFICANT:
        return []
    if not found.wires:
        text = f"several tension sensors are off ({chance(found.p_none)} if none were): do not use these values"
        return [Notice("misfit", text)]
    texts = [_in_words(i, found.bias_N[i], found.sd_N[i]) for i in found.wires]
    said = f"the tension sensor of {' or of '.join(texts)} would explain {_how_much(found)}what contradicts"
    correct = "zero it" if len(texts) == 1 else "find out which, zero it"
    return [Notice("misfit", f"{said}: do not use these values; {correct}, or give --tension-bias")]


def _how_much(found: Suspects) -> str:
    """How much of what contradicts any of the sensors explains; empty where it is all."""
    share = 100 * found.explains[found.wires].min()
    all_explain = bool((found.p_alone[found.wires] >= SIGNIFICANT).all())
    return "" if all_explain or share >= _NEARLY_ALL else f"{share:.0f} % of "


def _in_words(wire: int, bias_N: float, sd_N: float) -> str:
    much = "much" if bias_N > 0 else "little"
    return f"wire {wire + 1} (reads {short(abs(bias_N), 3)} +- {short(sd_N, 2)} N too {much})"
