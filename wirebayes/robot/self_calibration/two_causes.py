"""Which two causes together would explain what a calibration's readings contradict, where none alone does.

What every pair would take off the sum of squares if all were straight is found without a search; only those that would
take off most are fitted. Real robots may have more wrong than two: the answer says "would explain", and of pairs that
explain as well as each other all are named.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.progress import ShareDone, shares_of
from wirebayes.robot.self_calibration.another_centre import Centre
from wirebayes.robot.self_calibration.another_weight import Mass
from wirebayes.robot.self_calibration.equations import Holds, State
from wirebayes.robot.self_calibration.leaning_frame import Lean
from wirebayes.robot.self_calibration.one_cause import Cause, Explained, explained_by, read_of
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.stiffness import Stiffness
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.sentences import short

_FITTED = 4  # pairs: those that would explain most, were all straight

Says = Callable[[RobotPosterior, Floats, Floats], str]  # of a posterior, the change of a cause, and its covariance


@dataclass(frozen=True)
class TwoCauses:
    """Pairs of causes each of which would explain what contradicts, and is not much less likely than the likeliest.

    Attributes
    ----------
    pairs : tuple of (str, str)
        What the causes are.
    evidence : float
        Log density of the readings with the likeliest pair.
    """

    pairs: tuple[tuple[str, str], ...]
    evidence: float

    def in_words(self) -> str:
        """What to do about it."""
        pairs = [" and ".join(pair) for pair in self.pairs]
        if len(pairs) == _FITTED:  # those that were not fitted may explain as much
            pairs.append("another pair")
        each = "; or ".join(pairs)
        which = "them" if len(self.pairs) == 1 else "which of them it is"
        return (
            f"no single cause that was tried explains what contradicts, but two together would: {each}; check {which}, "
            "and do not use these values"
        )


@dataclass(frozen=True)
class _Suspect:
    """A cause, how many values it has, and what is said of it."""

    cause: Cause
    count: int
    says: Says


def two_causes(found: RobotPosterior, holds: Holds, progress: ShareDone = lambda share: None) -> TwoCauses | None:
    """Pairs of causes with which readings and model do belong together; None where there is no such pair.

    Parameters
    ----------
    found : RobotPosterior
    holds : Holds
    progress : function of a share between 0 and 1
    """
    tried = _suspects(found, holds)
    likely = _likeliest(found, tried)
    explained = []
    for pair, part in zip(likely, shares_of(progress, len(likely)), strict=True):
        with_both = explained_by(_Together(pair), found, holds, part)
        if with_both is not None:
            explained.append((with_both.found.evidence, _said(pair, with_both)))
    progress(1.0)
    if not explained:
        return None
    likeliest = max(evidence for evidence, _ in explained)
    least = likeliest + np.log(SIGNIFICANT)
    return TwoCauses(tuple(texts for evidence, texts in explained if evidence > least), likeliest)


def _suspects(found: RobotPosterior, holds: Holds) -> list[_Suspect]:
    """What may be wrong; errors of sensors only where they have none already."""
    unknowns = found.unknowns
    robot = unknowns.robot
    out = [_Suspect(Mass(), 1, _mass), _Suspect(Lean(), 2, _lean), _Suspect(Stiffness(), 1, _stiffness)]
    if robot.degrees > 3:
        out.append(_Suspect(Centre(robot.size_m), 3, _centre))
    if not unknowns.prior.bias_sd_N > 0:
        widest = float(np.nanmax(np.abs(holds.tension_N)))
        signs = holds.session.signs
        for i in range(robot.legs):
            error = _SensorError(i, signs[:, i] / holds.session.tension_sd_N, widest, signs[:, i])
            out.append(_Suspect(error, 1, error.says))
    return out


def _likeliest(found: RobotPosterior, tried: list[_Suspect]) -> list[tuple[_Suspect, _Suspect]]:
    """The pairs that would take most off the sum of squares, were residuals straight in all values."""
    slopes = np.concatenate([one.cause.slopes(found) for one in tried], axis=-1)
    information, score = read_of(found, slopes)
    usual = np.concatenate([np.broadcast_to(one.cause.usual, one.count) for one in tried])
    precision = information + np.diag(usual**-2.0)
    ends = np.cumsum([one.count for one in tried])
    columns = [np.arange(end - one.count, end) for one, end in zip(tried, ends, strict=True)]
    gains = {}
    for i, j in combinations(range(len(tried)), 2):
        part = np.concatenate([columns[i], columns[j]])
        own = score[part]
        gains[i, j] = float(own @ solve(precision[np.ix_(part, part)], own[:, None])[:, 0])
    first = sorted(gains, key=lambda pair: -gains[pair])[:_FITTED]
    return [(tried[i], tried[j]) for i, j in first]


def _said(pair: tuple[_Suspect, _Suspect], explained: Explained) -> tuple[str, str]:
    """What each of two causes would be."""
    one, other = pair
    first, second = slice(one.count), slice(one.count, None)
    change, covariance = explained.change, explained.covariance
    return (
        one.says(explained.found, change[first], covariance[first, first]),
        other.says(explained.found, change[second], covariance[second, second]),
    )


@dataclass(frozen=True)
class _Together:
    """Values of two causes, those of the first before those of the second."""

    pair: tuple[_Suspect, _Suspect]

    @property
    def usual(self) -> Floats:
        return np.concatenate([np.broadcast_to(one.cause.usual, one.count) for one in self.pair])

    def slopes(self, found: RobotPosterior) -> Floats:
        return np.concatenate([one.cause.slopes(found) for one in self.pair], axis=-1)

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        one, other = self.pair
        unknowns, holds, state = one.cause.changed(found, holds, by[: one.count])
        between = replace(found, unknowns=unknowns, state=state)
        unknowns, holds, state = other.cause.changed(between, holds, by[one.count :])
        unknowns.robot.__dict__.update(span_m=found.unknowns.robot.span_m)  # a measure of length that stays
        return unknowns, holds, state


@dataclass(frozen=True)
class _SensorError:
    """What one sensor reads too much, N.

    Attributes
    ----------
    wire : int
        From 0.
    slope : (p,) array
        Of its residuals in the holds.
    usual : float
    signs : (p,) array
        How the error enters the readings.
    """

    wire: int
    slope: Floats
    usual: float
    signs: Floats

    def slopes(self, found: RobotPosterior) -> Floats:
        equations = found.equations
        row = equations.rows["tension"].start + self.wire
        out = np.zeros((*equations.residual.shape, 1))
        out[:, row, 0] = np.where(equations.known[:, row], self.slope, 0.0)
        return out

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        tension = holds.tension_N.copy()
        tension[:, self.wire] -= by[0] * self.signs
        return found.unknowns, replace(holds, tension_N=tension), found.state

    def says(self, found: RobotPosterior, change: Floats, covariance: Floats) -> str:
        much = "much" if change[0] > 0 else "little"
        error = f"{short(abs(change[0]), 3)} +- {_sd(covariance)} N"
        return f"a tension sensor of wire {self.wire + 1} that reads {error} too {much}"


def _mass(found: RobotPosterior, change: Floats, covariance: Floats) -> str:
    mass = found.unknowns.robot.mass_kg
    return f"a platform of {short(mass, 4)} +- {_sd(mass**2 * covariance)} kg"


def _lean(found: RobotPosterior, change: Floats, covariance: Floats) -> str:
    angle = float(np.linalg.norm(change))
    axis = change / max(angle, 1e-300)
    sd = np.degrees(float(axis @ covariance @ axis) ** 0.5)
    return f"a frame that leans by {short(np.degrees(angle), 3)} +- {short(sd, 2)} degrees"


def _stiffness(found: RobotPosterior, change: Floats, covariance: Floats) -> str:
    times = float(np.exp(change[0]))
    return f"wires whose stiffness k1 is {short(times, 3)} +- {_sd(times**2 * covariance)} times what is stated"


def _centre(found: RobotPosterior, change: Floats, covariance: Floats) -> str:
    centre = 1e3 * found.unknowns.robot.centre_of_mass_m
    sds = 1e3 * np.sqrt(np.diag(covariance))
    parts = [f"{short(at, 3)} +- {short(sd, 2)}" for at, sd in zip(centre, sds, strict=True)]
    return f"a centre of mass at ({', '.join(parts)}) mm"


def _sd(covariance: Floats) -> str:
    return short(float(covariance[0, 0]) ** 0.5, 2)
