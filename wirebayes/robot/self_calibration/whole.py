"""Calibration of the whole robot: the posterior of its unknowns and of every hold's pose, about their mode.

Levenberg-Marquardt over robot and holds together, the holds eliminated one by one. A wide error of the loops at first,
then ever smaller ones, lead from rough geometry to the mode.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2

from wirebayes.numeric.linear_algebra import inv, solve
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration import observability
from wirebayes.robot.self_calibration.equations import (
    EXACT,
    FRICTIONLESS,
    Equations,
    Holds,
    Noise,
    State,
    linearised,
    moved,
    scale,
)
from wirebayes.robot.self_calibration.strain import Grown, grown
from wirebayes.robot.self_calibration.trust import joint_test
from wirebayes.robot.self_calibration.unknowns import Unknowns

_FLOOR = 1e-6  # of the span: no encoder with drum and wire does better
_ROUNDS = 25  # of noise and creep
_SOFT = 0.03  # of what is known best of tensions
_WHOLE_ROUNDS = 3  # before creep goes half the way only
_STILL = 0.05  # of every unknown's standard deviation
_SETTLED = 0.02  # of a noise, relative
_CREEPING = 0.8  # slope of what is shown over what is thought: a secant of more would leap
_FAR, _TURN = 0.02, 0.3  # of the span, rad: a larger step leaves what slopes describe, for another equilibrium
_CORRECTIONS, _AS_FORESEEN = 3, 0.5  # of poses and tensions, where a step gains less than half of what slopes foresee
_GAIN = 1e-3  # of the sum of squares: less changes no estimate by a hundredth of its standard deviation
_STEPS = 12  # of a descent: noise and creep change before more are worth it
_EASINGS = 16  # quarterings that lead from a tenth of the span to a micrometre
# Of the range that a robot's file allows: tensions that nobody read lie anywhere in it, so this is their standard
# deviation about a level that the holds share. The level may be off by half the range, and does not average out.
_UNREAD, _LEVEL = 12**-0.5, 0.5
_LEAST_DEGREES = 1.0  # weight of `_FLOOR` beside the readings, in degrees of freedom
# Where nobody read tensions, their scatter explains what errors of lengths would: half a millimetre of five metres is
# then thought of these, as drums that wind layers have them, unless ten readings or more say otherwise.
_BLIND, _BLIND_DEGREES = 1e-4, 10.0


@dataclass(frozen=True)
class Whole:
    """Posterior of a robot and its session.

    Attributes
    ----------
    unknowns : Unknowns
    state : State
        The mode.
    covariance : (m, m) array
        Of the robot's unknowns, in units of their prior.
    by_robot : (p, d + w, m) array
        How a hold's motion and tensions follow the robot's unknowns.
    hold_covariance : (p, d + w, d + w) array
        Of a hold's small motion (metres at the platform's edge) and its tensions.
    equations : Equations
        At the mode.
    noise : Noise
    degrees : float
        Degrees of freedom that the error of the loops was estimated from; infinite where it was given.
    creep : Grown
    converged : bool
    cost : float
        Sum of squares, the prior's included.
    last_m : (w,) array
        Lengths that the last joint values stand for, without reference errors.
    """

    unknowns: Unknowns
    state: State
    covariance: Floats
    by_robot: Floats
    hold_covariance: Floats
    equations: Equations
    noise: Noise
    degrees: float
    creep: Grown
    converged: bool
    cost: float
    last_m: Floats

    @property
    def evidence(self) -> float:
        """What modes from different starts are compared by: log density, their estimated noise included."""
        e = self.equations
        noise = e.residual[:, e.rows["loop"]].size * np.log(self.noise.joint_m)
        noise += e.residual[:, e.rows["balance"]].size * np.log(self.noise.balance)
        return float(-0.5 * self.cost - noise)


@dataclass(frozen=True)
class _Normal:
    """Normal equations with the holds eliminated."""

    by_robot: Floats
    alone: Floats
    inverse: Floats
    matrix: Floats
    slope: Floats


def _eliminated(e: Equations, white: Floats, damping: float) -> _Normal:
    z, g, r = e.by_hold, e.by_robot, e.residual[..., None]
    zt = z.swapaxes(1, 2)
    A = zt @ z
    diagonal = np.einsum("pii->pi", A)
    A = A + (damping + 1e-13) * diagonal[:, None] * np.eye(A.shape[1])
    inverse_ = inv(A)
    B = zt @ g
    by_robot = -inverse_ @ B
    alone = -inverse_ @ (zt @ r)
    gt = g.swapaxes(1, 2)
    left = (gt @ g + B.swapaxes(1, 2) @ by_robot).sum(0)
    right = (gt @ r + B.swapaxes(1, 2) @ alone).sum(0)[:, 0]
    m = len(white)
    matrix = left + (1.0 + damping) * np.eye(m) + damping * np.diag(np.einsum("pki,pki->i", g, g))
    return _Normal(by_robot, alone[..., 0], inverse_, matrix, right + white)


def _cost(e: Equations, white: Floats) -> float:
    value = float((e.residual**2).sum() + white @ white)
    return value if np.isfinite(value) else np.inf


def _stepped(robot: Robot, state: State, change: Floats, hold: Floats) -> State:
    d = robot.degrees
    motion = hold[:, :d] * scale(robot)
    turn = state.rotation
    if d == 6:
        turn = np.moveaxis(turns.compose(motion[:, 3:].T, np.moveaxis(turn, 0, -1)), -1, 0)
    return State(state.white + change, state.position_m + motion[:, :3], turn, state.pull_N + hold[:, d:])


def _foreseen(e: Equations, change: Floats, hold: Floats) -> float:
    """Sum of squares of the residuals after a step, were they straight."""
    moved_by = e.by_robot @ change + (e.by_hold @ hold[..., None])[..., 0]
    return float(((e.residual + moved_by) ** 2).sum())


def _corrected(
    unknowns: Unknowns, holds: Holds, noise: Noise, state: State, e: Equations, creep: Grown, since: State
) -> tuple[State, Equations]:
    """Poses and tensions a Newton step nearer to where each hold has them for the same robot, where that is better.

    Loops and balance leave a narrow, curved valley; a step along its slope leaves it, and this leads back.
    """
    z = e.by_hold
    zt = z.swapaxes(1, 2)
    A = zt @ z
    A = A + 1e-12 * np.einsum("pii->pi", A)[:, None] * np.eye(A.shape[1])
    hold = -solve(A, zt @ e.residual[..., None])[..., 0]
    there = _stepped(unknowns.robot, state, np.zeros_like(state.white), np.nan_to_num(hold))
    ahead = linearised(unknowns, holds, noise, there, creep, since)
    better = (ahead.residual**2).sum(1) < (e.residual**2).sum(1)

    def chosen(new: Floats, old: Floats) -> Floats:
        return np.where(better.reshape(-1, *[1] * (new.ndim - 1)), new, old)

    state = State(
        state.white,
        chosen(there.position_m, state.position_m),
        chosen(there.rotation, state.rotation),
        chosen(there.pull_N, state.pull_N),
    )
    e = replace(
        e,
        residual=chosen(ahead.residual, e.residual),
        by_robot=chosen(ahead.by_robot, e.by_robot),
        by_hold=chosen(ahead.by_hold, e.by_hold),
    )
    return state, e


@dataclass(frozen=True)
class Descent:
    """Where Levenberg-Marquardt ended, the equations and the sum of squares there, and whether it had come down."""

    state: State
    equations: Equations
    cost: float
    converged: bool


def descend(
    unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, since: State, steps: int = _STEPS
) -> Descent:
    """Levenberg-Marquardt for one noise and one creep.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    noise : Noise
    state : State
        Where to start.
    creep : Grown
        About the state `since`.
    since : State
    steps : int
        At most.
    """
    damping, d = 1e-6, unknowns.robot.degrees
    reach = np.where(np.arange(d) < 3, _FAR * unknowns.robot.span_m, _TURN * unknowns.robot.size_m)
    equations = linearised(unknowns, holds, noise, state, creep, since)
    cost = _cost(equations, state.white)
    for _ in range(steps):
        normal = _eliminated(equations, state.white, damping)
        change = -solve(normal.matrix, normal.slope[:, None])[:, 0]
        hold = normal.alone + normal.by_robot @ change
        share = min(1.0, 1.0 / max(float((np.abs(hold[:, :d]) / reach).max()), 1e-300))
        there = _stepped(unknowns.robot, state, share * change, share * hold)
        ahead = linearised(unknowns, holds, noise, there, creep, since)
        new = _cost(ahead, there.white)
        foreseen = _foreseen(equations, share * change, share * hold) + float(there.white @ there.white)
        for _ in range(_CORRECTIONS):
            if cost - new > _AS_FORESEEN * (cost - foreseen):
                break
            there, ahead = _corrected(unknowns, holds, noise, there, ahead, creep, since)
            new = _cost(ahead, there.white)
        if new < cost:
            gain = cost - new
            state, equations, cost = there, ahead, new
            damping = max(damping / 10, 1e-12)
            if gain < _GAIN:
                return Descent(state, equations, cost, True)
        else:
            damping = max(damping * 10, 1e-9)
            if damping > 1e6:
                return Descent(state, equations, cost, True)
    return Descent(state, equations, cost, False)


def with_levels(unknowns: Unknowns, holds: Holds) -> Unknowns:
    """The unknowns with a level for the tensions of every wire, where some were not read.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    """
    if np.isfinite(holds.tension_N).all():
        return unknowns
    rule = unknowns.robot.rule
    return replace(unknowns, errors=replace(unknowns.errors, level_N=_LEVEL * (rule.highest_N - rule.lowest_N)))


def estimate(unknowns: Unknowns, holds: Holds, state: State) -> Whole:
    """The posterior next to a start.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    state : State
        A rough guess.
    """
    robot, stated = unknowns.robot, unknowns.errors.joint_m
    target = _usual_joint(robot, holds)[0] if stated is None else max(stated, EXACT * robot.span_m)
    low, high = robot.rule.lowest_N, robot.rule.highest_N
    usual = 0.5 * (low + high) if robot.rule.choice == "middle" else low
    finest = min(holds.session.tension_sd_N, low) if np.isfinite(holds.tension_N).any() else low
    noise = Noise(target, FRICTIONLESS, _UNREAD * (high - low), usual, _SOFT * finest)
    since, creep = state, _creep(unknowns, holds, state)

    state = _from_rough(unknowns, holds, noise, state, creep)
    noise = replace(noise, balance=_shown(unknowns, holds, noise, state, creep, "balance"))
    if stated is None and np.isfinite(holds.tension_N).any():
        noise = replace(noise, joint_m=_shown(unknowns, holds, noise, state, creep, "loop"))
    rounds: list[tuple[Floats, Floats]] = []
    for _ in range(_ROUNDS):
        since = _between(since, state) if len(rounds) > _WHOLE_ROUNDS else state
        creep = _creep(unknowns, holds, since)
        down = descend(unknowns, holds, noise, state, creep, since, _STEPS)
        state = down.state
        last = inverse.lengths(robot, holds.session.joint_m[-1])[0]
        found = _posterior(unknowns, down, noise, creep, last)
        shown, degrees = _noise_shown(found, *_usual_joint(robot, holds))
        found = replace(found, degrees=degrees)
        rounds.append((np.log([noise.joint_m, noise.balance]), shown))
        moved_on = np.abs(state.white - since.white) / np.sqrt(np.diag(found.covariance))
        if np.abs(shown - rounds[-1][0]).max() < _SETTLED and moved_on.max(initial=0.0) < _STILL:
            return found
        joint, balance = np.exp(_ahead(rounds))
        noise = replace(noise, joint_m=float(joint), balance=float(balance))
    return replace(found, converged=False)


def _between(before: State, after: State) -> State:
    """Where creep is taken about: halfway, since creep that wires slackened by would make them taut again in turns."""
    white, pull = 0.5 * (before.white + after.white), 0.5 * (before.pull_N + after.pull_N)
    return replace(after, white=white, pull_N=pull)


def _ahead(rounds: list[tuple[Floats, Floats]]) -> Floats:
    """Where logarithms of noises and of what the residuals then show will be the same: a secant for each of them."""
    noise, shown = rounds[-1]
    if len(rounds) == 1:
        return shown
    gone = noise - rounds[-2][0]
    slope = np.divide(shown - rounds[-2][1], gone, out=np.zeros_like(gone), where=np.abs(gone) > 1e-9)
    return np.asarray(noise + (shown - noise) / (1.0 - np.clip(slope, -1.0, _CREEPING)))


def _creep(unknowns: Unknowns, holds: Holds, state: State) -> Grown:
    """Creep under the tensions of a state."""
    response = _response(unknowns, holds, state)
    return grown(unknowns, state.white, state.pull_N, response, holds.session.duration_s)


def _response(unknowns: Unknowns, holds: Holds, state: State) -> Floats:
    """(p, w, w) change of the tensions with a strain of the wires."""
    parts = unknowns.parts(state.white)
    robot = moved(unknowns.robot, parts)
    wires = unknowns.prior.wires(unknowns.robot, parts.wires[None])[0]
    bare, offset = inverse.lengths(robot, holds.session.joint_m)
    stretched = _way(robot, state, offset)
    zero = stretched / (1 + np.maximum(state.pull_N, 0.0) / wires.theta["k1"].T)
    change = observability.sensitivity(robot, wires, state.position_m, state.rotation, zero, offset)[1]
    answer = change * zero[:, None]
    # beyond these, a state is no equilibrium yet
    usual = np.abs(answer).max((1, 2)) <= 2 * np.max(wires.theta["k1"])
    return np.where(usual[:, None, None] & np.isfinite(answer).all((1, 2), keepdims=True), answer, 0.0)


def _way(robot: Robot, state: State, offset: Floats) -> Floats:
    shape = statics.geometry(robot, state.position_m.T, np.moveaxis(state.rotation, 0, -1))
    return statics.stretched(robot, shape, offset.T).T


def _posterior(unknowns: Unknowns, down: Descent, noise: Noise, creep: Grown, last_m: Floats) -> Whole:
    state, e, cost = down.state, down.equations, down.cost
    normal = _eliminated(e, state.white, 0.0)
    covariance = inv(normal.matrix)
    by_robot = normal.by_robot
    hold = normal.inverse + by_robot @ covariance @ by_robot.swapaxes(1, 2)
    good = down.converged and bool(np.isfinite(covariance).all() and np.isfinite(cost))
    return Whole(unknowns, state, covariance, by_robot, hold, e, noise, np.inf, creep, good, cost, last_m)


def at_joint_error(found: Whole, factor: float) -> Whole:
    """The posterior about the same mode with the error of the loops larger by a factor.

    Parameters
    ----------
    found : Whole
    factor : float
    """
    e = found.equations
    unit = np.ones(e.residual.shape[1])
    unit[e.rows["loop"]] /= factor
    there = replace(
        e, residual=e.residual * unit, by_robot=e.by_robot * unit[:, None], by_hold=e.by_hold * unit[:, None]
    )
    down = Descent(found.state, there, _cost(there, found.state.white), found.converged)
    noise = replace(found.noise, joint_m=found.noise.joint_m * factor)
    return replace(_posterior(found.unknowns, down, noise, found.creep, found.last_m), degrees=found.degrees)


def _leverage(found: Whole, rows: slice) -> Floats:
    """(p, r) share of each residual's variance that the unknowns take up."""
    z, g = found.equations.by_hold[:, rows], found.equations.by_robot[:, rows]
    total = g + z @ found.by_robot
    alone = found.hold_covariance - found.by_robot @ found.covariance @ found.by_robot.swapaxes(1, 2)
    own = np.einsum("pri,pij,prj->pr", z, alone, z)
    return own + np.einsum("pri,ij,prj->pr", total, found.covariance, total)


def _usual_joint(robot: Robot, holds: Holds) -> tuple[float, float]:
    """Error of a joint value before anything was read, m, and its weight in degrees of freedom."""
    if np.isfinite(holds.tension_N).any():
        return _FLOOR * robot.span_m, _LEAST_DEGREES
    return _BLIND * robot.span_m, _BLIND_DEGREES


def _noise_shown(found: Whole, usual_m: float, worth: float) -> tuple[Floats, float]:
    """Logarithms of the noises of loops and balance that the residuals show, and the degrees of freedom of the first.

    Restricted maximum likelihood; the usual error of the loops, `usual_m`, is `worth` some degrees of freedom.
    """
    e, robot, stated = found.equations, found.unknowns.robot, found.unknowns.errors.joint_m

    def shown(rows: str, sd: float, usual: float, worth: float) -> tuple[float, float]:
        residual = e.residual[:, e.rows[rows]]
        left = 1.0 - _leverage(found, e.rows[rows])
        squares = float((residual**2).sum()) * sd**2
        free = float(np.maximum(left, 0.0).sum()) + worth
        return float(np.sqrt((squares + worth * usual**2) / free)), free

    balance, _ = shown("balance", found.noise.balance, FRICTIONLESS, _LEAST_DEGREES)
    balance = float(np.clip(balance, 1e-2 * FRICTIONLESS, 1e2))
    if stated is not None:
        return np.log([found.noise.joint_m, balance]), np.inf
    joint, degrees = shown("loop", found.noise.joint_m, usual_m, worth)
    return np.log([np.clip(joint, 1e-2 * usual_m, robot.span_m), balance]), degrees


def _from_rough(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown) -> State:
    """A state near the mode: errors of loops and balance are thought as large as they are at first, then ever less."""
    since = state
    fine = {"joint_m": noise.joint_m, "balance": noise.balance}
    eased = replace(noise, joint_m=_shown(unknowns, holds, noise, state, creep, "loop"), balance=0.3,
                    soft_N=float(np.median(np.abs(state.pull_N))))  # fmt: skip
    for _ in range(_EASINGS):
        down = descend(unknowns, holds, eased, state, creep, since, 6)
        state, equations = down.state, down.equations
        smaller = {}
        for name, rows in (("joint_m", "loop"), ("balance", "balance")):
            fits = np.mean(equations.residual[:, equations.rows[rows]] ** 2) < 2
            smaller[name] = max(getattr(eased, name) / 4, fine[name]) if fits else getattr(eased, name)
        if smaller == {name: getattr(eased, name) for name in smaller} and eased.soft_N == noise.soft_N:
            break
        eased = replace(eased, **smaller, soft_N=max(eased.soft_N / 4, noise.soft_N))
    return state


def _shown(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, rows: str) -> float:
    """Root mean square of the loops (m) or of the balance (over the weight) at a state, no less than what is exact."""
    e = linearised(unknowns, holds, noise, state, creep, state)
    unit = noise.joint_m if rows == "loop" else noise.balance
    size = float(np.sqrt(np.mean(e.residual[:, e.rows[rows]] ** 2))) * unit
    return max(size, unit) if np.isfinite(size) else 1e3 * unit


def trust(found: Whole) -> float:
    """Probability of residuals and estimates this far from model and priors: `trust.joint_test`.

    A hold's own unknowns have no prior, so each of them costs a degree of freedom. Geometry and references are tested
    alone too, and so are tensions that nobody read: far outside the range that the robot's file allows, they show that
    lengths and geometry contradict each other.
    """
    e, unknowns = found.equations, found.unknowns
    rows = e.rows["tension"]
    unread = ~e.known[:, rows]
    open_ = float(_leverage(found, rows)[unread].sum())
    beyond = float((e.residual[:, rows][unread] ** 2).sum())
    count = float(e.known.sum()) - e.by_hold.shape[0] * e.by_hold.shape[2] + open_
    first = np.r_[0 : unknowns.slices["wires"].start, unknowns.references]
    white, spread = found.state.white[first], found.covariance[np.ix_(first, first)]
    p = float(joint_test(np.array([found.cost - beyond]), max(count, 1.0), white[None], spread[None], len(first))[0])
    if not unread.any():
        return p
    tensions = float(chi2.sf(beyond, max(unread.sum() - open_, 1.0)))
    return min(1.0, 1.5 * p, 3.0 * tensions)  # p has the better of two tests times two


def misfit(found: Whole) -> float:
    """Mean squared residual of what was read or stated, the balance aside."""
    e = found.equations
    read = [e.residual[:, part][e.known[:, part]] for name, part in e.rows.items() if name != "balance"]
    return float(np.mean(np.concatenate(read) ** 2))
