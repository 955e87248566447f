"""Which tension sensor is at fault, where readings contradict each other: one whose constant error explains it.

All sensors are given an unknown error at once. Estimates that are zero to their errors show no fault. Each that might
explain it is then given one by itself, since errors that leave wires slack do not add up: where one makes readings as
likely as all do, it is the one; where that is true of several, the readings do not tell them apart. Real sensors have
more errors than one: where none does, the likeliest is still named if nothing contradicts beside its error, or little.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from wirebayes.json_files.calibrate import SensorsAtFault
from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.progress import ShareDone, shares_of
from wirebayes.result_warnings import Notice
from wirebayes.robot.self_calibration.equations import Holds, State
from wirebayes.robot.self_calibration.estimate import estimate
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import misfit, trust
from wirebayes.robot.self_calibration.trust import SIGNIFICANT, chance
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.sentences import short

LEAST_HOLDS = 2  # read: at a single one an error of a sensor and one of a length look the same
_TRIES, _STILL = 3, 0.5  # searches, and standard deviations: along a narrow valley the last steps change little
MOST = 0.8  # of what contradicts: two sensors as bad as each other explain half of it each
_PERHAPS = 0.5  # of what the likeliest sensor explains, were all straight: sensors that explain less are not tried
_NEVER = 1e-300  # a probability whose logarithm can still be taken
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
        Share of what the errors of all explain that this one alone explains.
    suffices : (w,) bool array
        Whether an error of this one alone leaves readings that do not contradict model and priors.
    evidence : (w,) array
        Log density of the readings where this one alone has an error; minus infinity where that was not tried.
    """

    bias_N: Floats
    sd_N: Floats
    p_none: float
    p_alone: Floats
    explains: Floats
    suffices: Bools
    evidence: Floats

    @property
    def whole(self) -> Bools:
        """(w,) Which sensors alone would explain all that contradicts."""
        return np.asarray((self.p_alone >= SIGNIFICANT) | self.suffices)

    @property
    def wires(self) -> list[int]:
        """Wires, from 0, one of whose sensors is at fault; none where nothing or no single sensor explains it."""
        if not self.p_none < SIGNIFICANT:  # nor where it is not known
            return []
        likeliest = self.explains == self.explains.max()
        named = self.p_alone >= SIGNIFICANT
        if not named.any():
            named = self.suffices & likeliest
        if not named.any():
            named = self.explains >= MOST
        return [int(i) for i in np.flatnonzero(named)]


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
    return Suspects(score / own, own**-0.5, by_chance, alone, share, np.zeros(w, bool), np.full(w, -np.inf))


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
    together, alone = shares_of(progress, 2)
    of_all = _errors(free, holds, found, together)
    if of_all is None or _explain_little(found, of_all.found):
        progress(1.0)
        return None
    screened = weighed(of_all.bias_N, of_all.covariance, widest)
    gain = _gain(found, of_all.found)
    if not gain > 0.0:  # a search that came to a worse place
        progress(1.0)
        return screened
    tried = _perhaps(screened)
    each = {}
    for i, part in zip(tried, shares_of(alone, len(tried)), strict=True):
        of_one = _errors(free, _holds_of_one(holds, i), found, part)
        if of_one is not None:
            each[i] = of_one
    progress(1.0)
    return _compared(screened, found, gain, each)


@dataclass(frozen=True)
class _Errors:
    """A posterior with errors of sensors, and these, N."""

    found: RobotPosterior
    bias_N: Floats
    covariance: Floats


def _errors(free: Unknowns, holds: Holds, found: RobotPosterior, progress: ShareDone) -> _Errors | None:
    """The posterior in which sensors have errors, from one in which they have none; None where nothing converged."""
    legs = free.robot.legs
    widest = free.prior.bias_sd_N
    end = free.slices["wires"].stop
    sensors = slice(end - legs, end)
    state = _with_no_error_yet(found.state, sensors)
    bias = np.full(legs, np.inf)
    for part in shares_of(progress, _TRIES):
        other = estimate(free, holds, state, part)
        state = other.state
        before = bias
        bias = widest * state.white[sensors]
        covariance = widest**2 * other.covariance[sensors, sensors]
        still = np.abs(bias - before) < _STILL * np.sqrt(np.diag(covariance))
        if other.converged or still.all():
            return _Errors(other, bias, covariance)
    return None


def _with_no_error_yet(state: State, sensors: slice) -> State:
    """The state with errors of sensors among its unknowns, zero."""
    none = np.zeros(sensors.stop - sensors.start)
    return replace(state, white=np.insert(state.white, sensors.start, none))


def _holds_of_one(holds: Holds, sensor: int) -> Holds:
    """The holds where the error of no other sensor shows."""
    signs = np.zeros_like(holds.session.signs)
    signs[:, sensor] = holds.session.signs[:, sensor]
    return replace(holds, session=replace(holds.session, motion=signs))


def _gain(found: RobotPosterior, other: RobotPosterior) -> float:
    """By how much errors of sensors make readings likelier: twice the difference of log densities."""
    return 2.0 * (other.evidence - found.evidence)


def _perhaps(screened: Suspects) -> list[int]:
    """The sensors that might explain what contradicts."""
    likely = screened.explains >= _PERHAPS * screened.explains.max()
    return [int(i) for i in np.flatnonzero(likely | (screened.p_alone >= SIGNIFICANT))]


def _compared(screened: Suspects, found: RobotPosterior, gain: float, each: dict[int, _Errors]) -> Suspects:
    """What likelihoods say: what errors of all sensors gain, and that of each that was tried alone."""
    w = len(screened.bias_N)
    bias = screened.bias_N.copy()
    sd = screened.sd_N.copy()
    share = np.zeros(w)
    p_alone = np.zeros(w)
    suffices = np.zeros(w, bool)
    evidence = np.full(w, -np.inf)
    for i, one in each.items():
        evidence[i] = one.found.evidence
        own = _gain(found, one.found)
        bias[i] = one.bias_N[i]
        sd[i] = np.sqrt(one.covariance[i, i])
        share[i] = np.clip(own / gain, 0.0, 1.0)
        p_alone[i] = chdtrc(w - 1, max(gain - own, 0.0)) if w > 1 else 1.0
        suffices[i] = trust(one.found) >= max(SIGNIFICANT, _explained_from(found))
    return Suspects(bias, sd, float(chdtrc(w, gain)), p_alone, share, suffices, evidence)


def _explain_little(found: RobotPosterior, other: RobotPosterior) -> bool:
    """Whether errors of all sensors together leave more of what contradicts than one may leave.

    Not asked where nothing but the balance contradicts. That they restore it is not enough: they would restore it for
    geometry that is wrong, too.
    """
    if trust(found) >= SIGNIFICANT or trust(other) >= min(SIGNIFICANT, _explained_from(found)):
        return False
    return misfit(other) > (1 - MOST) * misfit(found)


def _explained_from(found: RobotPosterior) -> float:
    """Probability from which on most of what contradicts is explained: of its logarithm, which follows the misfit."""
    return float(max(trust(found), _NEVER) ** (1 - MOST))


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
        text = (
            "no single cause that was tried explains what contradicts: several tension sensors are off "
            f"({chance(found.p_none)} if none were), or more than one value of the robot's file is wrong; do not use "
            "these values"
        )
        return [Notice("misfit", text)]
    texts = [_in_words(i, found.bias_N[i], found.sd_N[i]) for i in found.wires]
    said = f"the tension sensor of {' or of '.join(texts)} would explain {_how_much(found)}what contradicts"
    correct = "zero it" if len(texts) == 1 else "find out which, zero it"
    return [Notice("misfit", f"{said}: do not use these values; {correct}, or give --tension-bias")]


def _how_much(found: Suspects) -> str:
    """How much of what contradicts any of the sensors explains; empty where it is all."""
    share = 100 * found.explains[found.wires].min()
    all_explain = bool(found.whole[found.wires].all())
    return "" if all_explain or share >= _NEARLY_ALL else f"{share:.0f} % of "


def _in_words(wire: int, bias_N: float, sd_N: float) -> str:
    much = "much" if bias_N > 0 else "little"
    return f"wire {wire + 1} (reads {short(abs(bias_N), 3)} +- {short(sd_N, 2)} N too {much})"
