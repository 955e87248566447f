"""Fits with one cause more, which alone may explain what a calibration's readings contradict."""

from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from wirebayes.numeric.linear_algebra import inv
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone, shares_of
from wirebayes.robot.self_calibration.equations import Holds, State
from wirebayes.robot.self_calibration.estimate import estimate
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import trust
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import Unknowns

_TRIES = 4  # searches: each place is found along straight lines from the one before
_STILL = 0.5  # standard deviations: values that move by less are found
_HELD_BY = 1e-3  # of the weight: balance that fails by more was not restored


class Cause(Protocol):
    """One or several values that are exact in a calibration, and may be wrong."""

    @property
    def usual(self) -> float | Floats:
        """Standard deviation of each value before anything was read; one of all that is alike, or ``(c,)``."""

    def slopes(self, found: RobotPosterior) -> Floats:
        """How the residuals ``(p, k, c)`` follow a change of the values."""

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        """What is fitted, and from where, with values that have changed.

        Parameters
        ----------
        found : RobotPosterior
        holds : Holds
        by : (c,) array
            Change of the values.
        """


@dataclass(frozen=True)
class Explained:
    """A posterior in which nothing contradicts, and what it takes.

    Attributes
    ----------
    found : RobotPosterior
    covariance : (c, c) array
        Of the values.
    change : (c,) array
        Of the values, the steps of the search together.
    """

    found: RobotPosterior
    covariance: Floats
    change: Floats


def explained_by(
    cause: Cause, found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None
) -> Explained | None:
    """The posterior with values of a cause with which readings and model do belong together; None where there is none.

    Parameters
    ----------
    cause : Cause
    found : RobotPosterior
    holds : Holds
    progress : function of a share between 0 and 1
    """
    found = replace(found, unknowns=_with_error_of_loops(found))
    moved: Floats | float = 0.0
    for part in shares_of(progress, _TRIES):
        change, covariance = _least_squares(found, cause.slopes(found), cause.usual)
        if not _far(change, covariance):  # nor where the readings do not tell it
            break
        moved = moved + change
        unknowns, holds, state = cause.changed(found, holds, change)
        found = estimate(unknowns, holds, state, part)
    else:
        return None
    if not found.converged or trust(found) < SIGNIFICANT or found.noise.balance > _HELD_BY:
        return None
    return Explained(found, covariance, moved * np.ones_like(change))


def _with_error_of_loops(found: RobotPosterior) -> Unknowns:
    """The unknowns with the error of the loops as found, as `sensors` have it: else likelihoods do not compare."""
    errors = found.unknowns.errors
    stated = found.noise.joint_m if errors.joint_m is None else errors.joint_m
    return replace(found.unknowns, errors=replace(errors, joint_m=stated))


def _far(change: Floats, covariance: Floats) -> bool:
    """Whether values are still to move by a part of their standard deviations that matters."""
    squared = change @ inv(covariance) @ change
    return bool(squared > _STILL**2)


def _least_squares(found: RobotPosterior, slopes: Floats, usual: float | Floats) -> tuple[Floats, Floats]:
    """The change ``(c,)`` of further unknowns on which all residuals depend, and its covariance ``(c, c)``.

    Parameters
    ----------
    found : RobotPosterior
        At its mode.
    slopes : (p, k, c) array
        Of the residuals by them.
    usual : float or (c,) array
        Standard deviation of each before anything was read.
    """
    information, score = read_of(found, slopes)
    before = np.broadcast_to(usual, score.shape)
    covariance = inv(information + np.diag(before**-2.0))
    return -covariance @ score, covariance


def read_of(found: RobotPosterior, slopes: Floats) -> tuple[Floats, Floats]:
    """What was read says of further unknowns: information ``(c, c)``, and slope of half the sum of squares ``(c,)``.

    Parameters
    ----------
    found : RobotPosterior
        At its mode.
    slopes : (p, k, c) array
        Of the residuals by them.
    """
    e = found.equations
    by_own = np.einsum("pkc,pkh->phc", slopes, e.by_hold)
    by_robot = np.einsum("pkc,pkm->mc", slopes, e.by_robot) + np.einsum("phc,phm->mc", by_own, found.by_robot)
    alone = found.hold_covariance - found.by_robot @ found.covariance @ found.by_robot.mT
    taken_up = np.einsum("pic,pij,pjd->cd", by_own, alone, by_own) + by_robot.T @ found.covariance @ by_robot
    information = np.einsum("pkc,pkd->cd", slopes, slopes) - taken_up
    score = np.einsum("pkc,pk->c", slopes, e.residual)
    return information, score
