"""Calibration: the posterior of a robot's unknowns and of every hold's pose, about their mode.

Levenberg-Marquardt over robot and holds together, the holds eliminated one by one. A wide error of the loops at first,
then ever smaller ones, lead from rough geometry to the mode.
"""

from dataclasses import replace

import numpy as np

from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Floats
from wirebayes.progress import Progress, ShareDone, shares_of
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.approach import onward
from wirebayes.robot.self_calibration.descent import descend
from wirebayes.robot.self_calibration.equations import FRICTIONLESS, Equations, Holds, Noise, State
from wirebayes.robot.self_calibration.holds_creep import ROUGHLY, creep_of
from wirebayes.robot.self_calibration.linearisation import linearised
from wirebayes.robot.self_calibration.posterior import RobotPosterior, gaussian_posterior
from wirebayes.robot.self_calibration.residuals import (
    contradicted,
    joint_error,
    length_rms_m,
    lengths_tell,
    lost,
    lost_m,
    most_open_m,
    noise_shown,
    trust,
    unusually_open,
    usual_joint,
)
from wirebayes.robot.self_calibration.strain import Grown
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import Unknowns

_ROUNDS = 60  # of noise and creep: most end in ten
_FINER_ROUNDS = 12  # with slopes by every tension: of 22 searches of drawn robots the longest took seven
# Rounds after which a search is given up whose loops are open by so much of the span, and by more than stated errors
# explain: they close no more. Of sessions that fit, however rough, they are open by a twentieth at most then; some go
# astray later and come back.
_PATIENT, _HOPELESS = 5, 0.1
# Rounds in which loops that are another robot's (`residuals.lost`) come no tenth nearer, after which a search is given
# up: of sessions that fit, none had any such round among 194 searches. Unknowns that come no tenth nearer to rest for
# as long go to and fro: slopes by every tension then lead on.
_STALLED, _NEARER = 10, 0.9
_SOFT = 0.03  # of what is known best of tensions
_BEND = 3.0  # times that range: within it a wire is neither taut nor slack, which hardly any wire is
_WHOLE_ROUNDS = 3  # before creep goes half the way only
_STILL = 0.05  # of every unknown's standard deviation
_STEADY = 10.0  # creep may err as many times more as unknowns move by tenths of a standard deviation
# Where unknowns do not come to rest, it may be creep's own error that moves them: half as large after three rounds.
_FINER, _FINEST = 0.8, 0.02
_LEVEL_FIT = 0.5  # of the sum of squares, from one round to the next: more, and there is a way to go still
_SURE = 8  # rounds from which on noises go ever smaller shares of their way
_SETTLED = 0.02  # of a noise, relative
_CREEPING = 0.8  # slope of what is shown over what is thought: a secant of more would leap
# Logarithm of what a secant may go beyond what is shown: another mode, whose loops are open as far as noise lets them,
# lies a few times farther, and a search that leaps there stays.
_LEAP = np.log(2.0)
_UNEVEN = 0.3  # of the weight: tensions that were read badly, at a rough pose
_EASINGS = 16  # quarterings that lead from a tenth of the span to a micrometre
# Of the range that a robot's file allows: tensions that nobody read lie anywhere in it, so this is their standard
# deviation about a level that the holds share. The level may be off by half the range, and does not average out.
_UNREAD, _LEVEL = 12**-0.5, 0.5
_ANYTHING = 1e6  # times as much, where nothing is thought of such tensions: a stiff wire's gap is a large negative one


def with_levels(unknowns: Unknowns, holds: Holds) -> Unknowns:
    """The unknowns with a level for the tensions of every wire, where some were not read.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    """
    read = np.isfinite(holds.tension_N)
    if read.all() or lengths_tell(unknowns, read):
        return unknowns
    rule = unknowns.robot.rule
    level_N = _LEVEL * (rule.highest_N - rule.lowest_N)
    return replace(unknowns, errors=replace(unknowns.errors, level_N=level_N))


def progress_of(progress: Progress, name: str) -> ShareDone:
    """The progress of one search, of which only the share is known that is done."""
    return lambda share: progress(name, share, 1.0)


def estimate(
    unknowns: Unknowns,
    holds: Holds,
    state: State,
    progress: ShareDone = lambda share: None,
    others_follow: bool = False,
) -> RobotPosterior:
    """The posterior next to a start; not converged where nothing near the robot has such joint values.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    state : State
        A rough guess.
    progress : function of a share between 0 and 1
    others_follow : bool
        Whether other starts follow: a search whose loops stay open unusually far then makes way for them.
    """
    found = _searched(unknowns, holds, state, progress, others_follow)
    if found.converged and _stuck(found, holds):
        freed = _searched(unknowns, holds, found.state, progress, others_follow)
        found = freed if freed.converged and freed.evidence > found.evidence else found
    progress(1.0)
    return found


def _searched(
    unknowns: Unknowns, holds: Holds, state: State, progress: ShareDone, others_follow: bool
) -> RobotPosterior:
    """What one search finds from a rough guess."""
    noise = _before_reading(unknowns, holds)
    creep = creep_of(unknowns, holds, state, roughly=ROUGHLY)
    state = _from_rough(unknowns, holds, noise, state, creep)
    if unknowns.errors.joint_m is None:
        noise = _noise_at(unknowns, holds, noise, state, creep)
    search = _Search(unknowns, holds, noise, state, creep, others_follow)
    found = search.at_rest(progress)
    return replace(found, converged=found.converged and not lost(found))


def _stuck(found: RobotPosterior, holds: Holds) -> bool:
    """Whether a wire that was read lies where it begins to pull: slopes change there, and steps lead to no lower sum.

    Balance, eased, leads on from there.
    """
    read = np.isfinite(holds.tension_N)
    return bool((np.abs(found.state.pull_N[read]) < _BEND * found.noise.soft_N).any())


def _noise_at(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown) -> Noise:
    """Noises as large as the residuals at a state show."""
    balance = _shown(unknowns, holds, noise, state, creep, "balance")
    noise = replace(noise, balance=balance)
    if not np.isfinite(holds.tension_N).any():
        return noise
    return replace(noise, joint_m=_shown(unknowns, holds, noise, state, creep, "loop"))


class _Search:
    """State, noise and creep in turns, each from the others, until none of them moves on.

    Attributes
    ----------
    passed : list of State
        About which creep was taken.
    rounds : list of (2,) arrays
        Logarithms of the noises that were thought, and of those that the residuals then showed.
    opened_m, costs : lists of float
        How far loops were open after each round, and the sum of squares.
    came_down : bool
        Whether the last descent ended at a least sum of squares, not for want of steps.
    each : bool
        Whether creep follows the tension of every hold by itself (`strain.grown`).
    moved : list of float
        How far unknowns moved on in each round, in standard deviations.
    """

    def __init__(
        self, unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, others_follow: bool
    ) -> None:
        self.unknowns = unknowns
        self.holds = holds
        self.others_follow = others_follow
        self.noise = noise
        self.state = state
        self.creep = creep
        self.passed = [state]
        self.roughly = ROUGHLY
        self.cost = np.inf
        self.came_down = self.each = False
        self.rounds: list[tuple[Floats, Floats]] = []
        self.opened_m: list[float] = []
        self.moved: list[float] = []
        self.costs: list[float] = []
        self.last_m, _ = inverse.lengths(unknowns.robot, holds.session.joint_m[-1])
        self.usual = usual_joint(unknowns.robot, holds)
        read = np.isfinite(holds.tension_N).any()
        self.unit_N = holds.session.tension_sd_N if read else noise.pull_N

    def at_rest(self, progress: ShareDone) -> RobotPosterior:
        """The posterior where nothing moves on; not converged where the search is given up.

        Slopes by every tension are expensive and right near the mode alone. So they come in once nothing moves on
        without them, or once estimates that explain the readings come no nearer to rest.
        """
        roughly, finely = shares_of(progress, 2)
        found = self._until_still(_ROUNDS, roughly)
        promising = self._circling and trust(found) >= SIGNIFICANT
        if not (self.unknowns.prior.creeps and (found.converged or promising)):
            return found
        most = _FINER_ROUNDS if found.converged else _ROUNDS - len(self.rounds)
        self.each = True
        finer = self._until_still(most, finely)
        return finer if finer.converged else found

    def _until_still(self, most: int, progress: ShareDone) -> RobotPosterior:
        """The posterior where nothing moves on with one kind of slopes; not converged where the search ends before."""
        for taken in range(most):
            progress(taken / most)
            found = self._round()
            sd = np.sqrt(np.diag(found.covariance))
            change = self.state.white - self.passed[-1].white
            moved = np.abs(change) / sd
            moved_on = float(moved.max(initial=0.0))
            if self._settled(found) and moved_on < _STILL:
                return found
            if self._leads_nowhere(found):
                break
            self.moved.append(moved_on)
            if self._circling:
                break
            self._go_on(found, sd, moved_on)
        return replace(found, converged=False)

    @property
    def _circling(self) -> bool:
        """Whether unknowns go to and fro and come no nearer to rest; not asked of slopes by every tension."""
        return not self.each and _no_nearer(self.moved, _STILL)

    def _leads_nowhere(self, found: RobotPosterior) -> bool:
        """Whether further rounds would not come to what was read."""
        if not np.isfinite(found.cost):  # no step leads on from there
            return True
        self.opened_m.append(length_rms_m(found))
        hopeless_m = most_open_m(found, _HOPELESS)
        elsewhere = self.others_follow and not self.each and unusually_open(found)
        far_m = 0.0 if elsewhere else lost_m(found)
        return _given_up(self.opened_m, hopeless_m, far_m) or self._contradicted(found)

    def _contradicted(self, found: RobotPosterior) -> bool:
        """Whether rounds come no nearer to readings that contradict what is stated: of no use is where they end."""
        self.costs.append(found.cost)
        return contradicted(found) and _no_nearer(self.costs)

    def _round(self) -> RobotPosterior:
        """The posterior with creep about the last state, and the noise that its residuals show."""
        since = self.passed[-1]
        self.creep = creep_of(self.unknowns, self.holds, since, self.creep, self.roughly, self.each)
        down = descend(self.unknowns, self.holds, self.noise, self.state, self.creep, since)
        self.state = down.state
        self.came_down = down.converged
        found = gaussian_posterior(self.unknowns, down, self.noise, self.creep, self.last_m)
        shown, degrees = noise_shown(found, *self.usual)
        thought = np.log([self.noise.joint_m, self.noise.balance])
        self.rounds.append((thought, shown))
        return replace(found, degrees=degrees)

    def _settled(self, found: RobotPosterior) -> bool:
        """Whether noise and sum of squares are what they were, and the last descent was not cut short."""
        thought, shown = self.rounds[-1]
        level = np.abs(shown - thought).max() < _SETTLED
        return bool(self.came_down and level and abs(self.cost - found.cost) < _LEVEL_FIT)

    def _go_on(self, found: RobotPosterior, sd: Floats, moved_on: float) -> None:
        """What the next round begins with."""
        taken = len(self.rounds)
        self.cost = found.cost
        usual = ROUGHLY * _FINER**taken
        self.roughly = max(_FINEST, min(_STEADY * moved_on, usual))
        if self.each or taken <= _WHOLE_ROUNDS:
            self.passed = [self.state]
        else:
            self.passed = onward(self.passed, self.state, sd, self.unit_N)
        self.noise = _next_noise(self.noise, self.rounds)


def _no_nearer(sizes: list[float], small: float = 0.0) -> bool:
    """Whether sizes, none of them small, have fallen by less than a tenth in the last rounds.

    Parameters
    ----------
    sizes : list of float
        One of each round.
    small : float
        A size up to which nothing is left to fall.
    """
    before = sizes[:-_STALLED]
    since = sizes[-_STALLED:]
    return bool(before) and min(sizes) > small and min(since) > _NEARER * min(before)


def _given_up(opened_m: list[float], hopeless_m: float, far_m: float) -> bool:
    """Whether the loops of the last rounds are so far open, and close so slowly, that they never will.

    Parameters
    ----------
    opened_m : list of float
        How far loops were open after each round.
    hopeless_m, far_m : float
        How far they are open where they close no more, and where they must come nearer.
    """
    if len(opened_m) == _PATIENT and opened_m[-1] > hopeless_m:
        return True
    return _no_nearer(opened_m, far_m)


def _before_reading(unknowns: Unknowns, holds: Holds) -> Noise:
    """What is stated of every noise, or usual."""
    rule = unknowns.robot.rule
    low = rule.lowest_N
    high = rule.highest_N
    usual = 0.5 * (low + high) if rule.choice == "middle" else low
    finest = low
    read = np.isfinite(holds.tension_N)
    if read.any():
        finest = min(holds.session.tension_sd_N, low)
    pull_N = _UNREAD * (high - low)
    if lengths_tell(unknowns, read):
        pull_N *= _ANYTHING
    return Noise(joint_error(unknowns, holds), FRICTIONLESS, pull_N, usual, _SOFT * finest)


def _next_noise(noise: Noise, rounds: list[tuple[Floats, Floats]]) -> Noise:
    """Noises nearer to where they are what the residuals show; steps about such a place shrink to it."""
    thought, _ = rounds[-1]
    share = min(1.0, _SURE / len(rounds))
    joint, balance = np.exp(thought + share * (_ahead(rounds) - thought))
    return replace(noise, joint_m=float(joint), balance=float(balance))


def _ahead(rounds: list[tuple[Floats, Floats]]) -> Floats:
    """Where logarithms of noises and of what the residuals then show will be the same: a secant for each of them."""
    noise, shown = rounds[-1]
    if len(rounds) == 1:
        return shown
    noise_before, shown_before = rounds[-2]
    gone = noise - noise_before
    slope = np.divide(shown - shown_before, gone, out=np.zeros_like(gone), where=np.abs(gone) > 1e-9)
    closing = 1.0 - np.clip(slope, -1.0, _CREEPING)
    step = shown - noise
    beyond = np.where(slope < 1.0, step / closing - step, 0.0)
    return shown + np.clip(beyond, -_LEAP, _LEAP)


def _from_rough(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown) -> State:
    """A state near the mode: errors of loops and balance are thought as large as they are at first, then ever less.

    The balance is eased only where tensions were read: those that nobody read would go where wires are slack, another
    mode, and no reading would bring them back.
    """
    since = state
    eased = _eased(unknowns, holds, noise, state, creep)
    for _ in range(_EASINGS):
        down = descend(unknowns, holds, eased, state, creep, since, 6)
        state = down.state
        next_ = replace(
            eased,
            joint_m=_smaller(down.equations, "loop", eased.joint_m, noise.joint_m),
            balance=_smaller(down.equations, "balance", eased.balance, noise.balance),
        )
        if next_ == eased and eased.soft_N == noise.soft_N:
            break
        eased = replace(next_, soft_N=max(eased.soft_N / 4, noise.soft_N))
    return state


def _eased(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown) -> Noise:
    """Errors of loops and balance as large as they are at a rough state."""
    joint_m = _shown(unknowns, holds, noise, state, creep, "loop")
    if not np.isfinite(holds.tension_N).all():
        return replace(noise, joint_m=joint_m)
    soft_N = float(np.median(np.abs(state.pull_N)))
    return replace(noise, joint_m=joint_m, balance=_UNEVEN, soft_N=soft_N)


def _smaller(equations: Equations, rows: str, error: float, finest: float) -> float:
    """A quarter of an error, where the equations it weighs fit."""
    residual = equations.residual[:, equations.rows[rows]]
    return max(error / 4, finest) if np.mean(residual**2) < 2 else error


def _shown(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, rows: str) -> float:
    """Root mean square of the loops (m) or of the balance (over the weight) at a state, no less than what is exact."""
    e = linearised(unknowns, holds, noise, state, creep, state)
    unit = noise.joint_m if rows == "loop" else noise.balance
    size = root_mean_square(e.residual[:, e.rows[rows]]) * unit
    return max(size, unit) if np.isfinite(size) else 1e3 * unit
