"""Starts for the calibration of a whole robot: poses from lengths, as far as these tell them."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.optimize import nnls

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Array, Bools, Floats, Indices
from wirebayes.progress import Progress, silent
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.motion import forward, inverse
from wirebayes.robot.self_calibration.equations import Holds, State, moved
from wirebayes.robot.self_calibration.estimate import estimate, progress_of, with_levels
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.residuals import lost, trust, unusually_open
from wirebayes.robot.self_calibration.strain import stretch
from wirebayes.robot.self_calibration.trust import SIGNIFICANT
from wirebayes.robot.self_calibration.unknowns import Unknowns

_TRIALS, _STEPS = 24, 25  # places a search begins from, and its steps: mirror images and far corners are among them
_WEAK = 1e-2  # pull towards the workspace and the home orientation, beside lengths
_SMALL = 1e-3  # N of imbalance for which a tension may be 1 N smaller: decides among those that carry alike
# A request whose wires would be off by so much of the span, beside so many errors of a reference length, is of another
# pose: the hold's place is looked for like one of which nothing is known.
_ASTRAY, _OFF = 0.05, 5.0
_OTHERS = 2  # further starts, where the first does not explain the readings
_HANGING = 2  # and where nobody read tensions: poses in balance, for wires that are slack close no loop


def seed(unknowns: Unknowns, holds: Holds, white: Floats, rng: Generator) -> State:
    """A state about a robot's unknowns: stated poses where there are some, else those that close the loops best.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    white : (m,) array
    rng : numpy Generator
        Draws the places that the search begins from.
    """
    robot = unknowns.robot
    session = holds.session
    lowest_N = robot.rule.lowest_N
    unread = ~np.isfinite(holds.tension_N)
    pull = np.where(unread, lowest_N, holds.tension_N)
    pull = np.maximum(pull, 1e-3 * lowest_N)
    home_turn = turns.matrix(robot.home_rotation_rad)
    position = chosen_rows(holds.placed, session.position_m, robot.home_m)
    turn = chosen_rows(holds.oriented, session.rotation, home_turn)
    pose = position, turn
    if _lost(unknowns, holds).any():
        ratio = stretch(unknowns, white, pull).ratio
        _locate(unknowns, holds, white, ratio, pose, rng)
    as_found = moved(robot, unknowns.parts(white))
    _fill_unread(as_found, pull, unread, pose)
    return State(np.array(white), position, turn, pull)


def _lost(unknowns: Unknowns, holds: Holds) -> Bools:
    """(p,) Whether a part of the hold's pose is not stated."""
    turns_freely = unknowns.robot.degrees == 6
    return ~holds.placed | (~holds.oriented & turns_freely)


def _fill_unread(robot: Robot, pull: Floats, unread: Bools, poses: Poses) -> None:
    """Put what carries the platform in place of tensions ``(p, w)`` that nobody read."""
    for k in np.flatnonzero(unread.any(1)):
        carried = _carrying(robot, poses[0][k], poses[1][k])
        pull[k, unread[k]] = carried[unread[k]]


def _carrying(robot: Robot, position_m: Floats, turn: Floats) -> Floats:
    """(w,) tensions above the lowest that carry the platform at a pose as nearly as they can, small ones rather."""
    shape = statics.geometry_at(robot, position_m, turn)
    unit = robot.edge_scale
    structure = -statics.jacobian(robot, shape)[..., 0] * robot.lines * unit[:, None]
    load = -statics.weight(robot, turn[..., None])[:, 0] * unit
    lowest = robot.rule.lowest_N
    left = load - structure.sum(1) * lowest
    rather_small = _SMALL * np.eye(robot.legs)
    no_tension = np.zeros(robot.legs)
    above, _ = nnls(np.vstack([structure, rather_small]), np.concatenate([left, no_tension]))
    return lowest + above


def _locate(unknowns: Unknowns, holds: Holds, white: Floats, ratio: Floats, poses: Poses, rng: Generator) -> None:
    """Put in place of the poses of lost holds those that close the loops best, of many trials each."""
    position, turn = poses
    lost = np.flatnonzero(_lost(unknowns, holds))
    parts = unknowns.parts(white)
    robot = moved(unknowns.robot, parts)
    bare, offset = inverse.lengths(robot, holds.session.joint_m[lost])
    goal = (bare + parts.reference_m) * ratio[lost]
    search = _PoseSearch(robot, _trials(goal), _trials(offset))
    start = _trials(position[lost]), _trials(turn[lost])
    placed = _trials(holds.placed[lost])
    x, R = search.descended(*start, placed, rng)
    best = search.best_trials(x, R)
    position[lost] = x.T[best]
    turn[lost] = batch_first(R)[best]


def _trials(values: Array) -> Array:
    """A row of each trial ``(l t, ...)``, of values ``(l, ...)`` of each hold."""
    return np.repeat(values, _TRIALS, 0)


@dataclass(frozen=True)
class _PoseSearch:
    """Poses whose wires are as long as `goal` less `offset`, ``(n, w)`` m, pulled weakly towards workspace and home."""

    robot: Robot
    goal: Floats
    offset: Floats

    @property
    def middle(self) -> Floats:
        """(3,) of the workspace."""
        return 0.5 * (self.robot.lower_m + self.robot.upper_m)

    @property
    def half(self) -> Floats:
        """(3,) half of the workspace's sides, a flat one's too."""
        half = 0.5 * (self.robot.upper_m - self.robot.lower_m)
        return np.maximum(half, 0.05 * self.robot.span_m)

    def gap(self, shape: statics.Geometry) -> Floats:
        """(n, w) by how much wires are too long."""
        return statics.stretched(self.robot, shape, self.offset.T).T - self.goal

    def drawn(self, count: int, rng: Generator) -> Floats:
        """(count, 3) places in the workspace, and a little outside."""
        return self.middle + 1.2 * self.half * rng.uniform(-1, 1, (count, 3))

    def descended(self, position: Floats, turn: Floats, stated: Bools, rng: Generator) -> tuple[Floats, Floats]:
        """Poses ``(3, n)``, ``(3, 3, n)`` after all steps from drawn places; positions that are `stated` stay.

        Parameters
        ----------
        position, turn : (n, 3), (n, 3, 3) arrays
        stated : (n,) bool array
        rng : numpy Generator
        """
        x = chosen_rows(stated, position, self.drawn(len(stated), rng)).T
        R = batch_last(turn)
        for _ in range(_STEPS):
            step = self.step(x, R)
            x = x + chosen_rows(~stated, step[:, :3], 0.0).T
            if self.robot.degrees == 6:
                R = turns.compose(step[:, 3:].T, R)
        return x, R

    def step(self, x: Floats, R: Floats) -> Floats:
        """(n, d) Gauss-Newton steps, none longer than a fifth of the robot."""
        robot = self.robot
        shape = statics.geometry(robot, x, R)
        J = batch_first(statics.wire_jacobian(robot, shape)).mT * robot.edge_scale
        gap = self.gap(shape)
        toward, pull = self._toward_home(x, R)
        normal = J.mT @ J + _WEAK**2 * np.diag(pull**2)
        slope = (J.mT @ gap[..., None])[..., 0] + _WEAK**2 * pull * toward
        step = -solve(normal, slope[..., None])[..., 0]
        size = np.linalg.norm(step, axis=1, keepdims=True)
        longest = 0.2 * robot.span_m
        share = np.minimum(1.0, longest / np.maximum(size, 1e-300))
        return step * share * robot.edge_scale

    def _toward_home(self, x: Floats, R: Floats) -> tuple[Floats, Floats]:
        """(n, d) how far poses are from workspace and home, and (d,) the slopes of that."""
        robot = self.robot
        toward = np.zeros((x.shape[1], robot.degrees))
        pull = np.ones(robot.degrees)
        pull[:3] = robot.span_m / (10 * self.half)
        toward[:, :3] = (x.T - self.middle) * pull[:3]
        if robot.degrees == 6:
            home = turns.matrix(robot.home_rotation_rad)
            turned = turns.vector(batch_first(R) @ home.T)
            toward[:, 3:] = turned * robot.size_m
        return toward, pull

    def misfit(self, x: Floats, R: Floats) -> Floats:
        """(n,) how badly poses close the loops, and how far outside the workspace they are."""
        gap = self.gap(statics.geometry(self.robot, x, R))
        outside = np.abs(x.T - self.middle) - 1.2 * self.half
        out = np.maximum(outside, 0.0)
        return np.nan_to_num((gap**2).sum(1) + (out**2).sum(1), nan=np.inf)

    def best_trials(self, x: Floats, R: Floats) -> Indices:
        """(l,) The trial of each hold that closes the loops best."""
        misfit = self.misfit(x, R).reshape(-1, _TRIALS)
        return np.arange(len(misfit)) * _TRIALS + misfit.argmin(1)


def best(
    unknowns: Unknowns,
    holds: Holds,
    rng: Generator,
    progress: Progress = silent,
    called: str = "start",
    about: Holds | None = None,
) -> RobotPosterior:
    """The posterior from the likeliest of several starts: about the file's geometry, and about others near it.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    rng : numpy Generator
    progress : function of name, done and total
    called : str
        What progress calls a start, before its number.
    about : Holds, optional
        The same with poses that are no readings, but near which the first search begins.
    """
    near = holds if about is None else about
    starts = _Starts(with_levels(unknowns, holds), holds, near, rng, progress, called)
    found = starts.of_file()
    found = starts.near_file(found)
    if not starts.blind:
        return found
    found = starts.in_balance(found)
    given_up = unusually_open(found) and not _ended(found)
    return starts.continued(found) if given_up else found


@dataclass(frozen=True)
class _Starts:
    """Searches from several starts, each of which is asked for only where what was found before explains too little.

    Attributes
    ----------
    about : Holds
        The holds with the poses that searches from the file's geometry begin near.
    """

    unknowns: Unknowns
    holds: Holds
    about: Holds
    rng: Generator
    progress: Progress
    called: str

    @property
    def blind(self) -> bool:
        """Whether no tension was read: poses with slack wires are then hard to come to."""
        return not bool(np.isfinite(self.holds.tension_N).any())

    def of_file(self) -> RobotPosterior:
        """From the file's geometry."""
        white = np.zeros(self.unknowns.count)
        state = seed(self.unknowns, self.about, white, self.rng)
        return self._searched(state, 1)

    def near_file(self, found: RobotPosterior) -> RobotPosterior:
        """From other geometries: first what was found, where holds that went astray are looked for again."""
        for k in range(_OTHERS):
            if _explains(found):
                break
            white = _near_file(self.unknowns, self.rng) if k > 0 else np.array(found.state.white)
            state = seed(self.unknowns, self.holds, white, self.rng)
            other = self._searched(state, k + 2)
            likelier = other.evidence > found.evidence
            if likelier and not (_ended(other) or unusually_open(other)):  # only short of rounds
                other = estimate(self.unknowns, self.holds, other.state)
            if other.converged > found.converged or other.evidence > found.evidence:
                found = other
        return found

    def in_balance(self, found: RobotPosterior) -> RobotPosterior:
        """From poses in balance in which some wire is slack: of the file's geometry, then of what was found."""
        for k in range(_HANGING):
            nothing_new = k > 0 and not found.converged
            if _explains(found) or nothing_new:
                break
            white = np.array(found.state.white) if k > 0 else np.zeros(self.unknowns.count)
            near = seed(self.unknowns, self.about, white, self.rng)
            hanging = hanging_state(self.unknowns, self.holds, near)
            if not _slack(hanging):
                continue
            other = self._searched(hanging, _OTHERS + 2 + k)
            as_good = found.converged and trust(found) >= trust(other)
            if other.converged and not as_good:
                found = other
        return found

    def continued(self, found: RobotPosterior) -> RobotPosterior:
        """The search that was given up in favour of others, none of which ended."""
        watched = progress_of(self.progress, f"{self.called} continued")
        return estimate(self.unknowns, self.holds, found.state, watched)

    def _searched(self, state: State, number: int) -> RobotPosterior:
        watched = progress_of(self.progress, f"{self.called} {number}")
        return estimate(self.unknowns, self.holds, state, watched, others_follow=self.blind)


def _ended(found: RobotPosterior) -> bool:
    """Whether a search came to rest or to another robot."""
    return found.converged or lost(found)


def _slack(state: State) -> bool:
    """Whether any wire is slack: if none is, the searches from other poses could have come there, too."""
    return bool((state.pull_N < 0.0).any())


def _explains(found: RobotPosterior) -> bool:
    """Whether a search ended, and model and priors allow what was read."""
    return found.converged and trust(found) >= SIGNIFICANT


def hanging_state(unknowns: Unknowns, holds: Holds, state: State) -> State:
    """A state whose poses are the equilibria under the joint values, wires that are too long for them slack.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    state : State
        Where the equilibria are looked for; its poses stay where there is none.
    """
    parts = unknowns.parts(state.white)
    robot = moved(unknowns.robot, parts)
    wires, _ = unknowns.prior.wires(robot, parts.wires[None])
    bare, offset = inverse.lengths(robot, holds.session.joint_m)
    zero = bare + parts.reference_m
    of_holds = wires.part(np.zeros(len(zero), int))
    balance = forward.solve_equilibrium(robot, of_holds, zero, offset, state.position_m, state.rotation)
    position = chosen_rows(balance.found, balance.position_m, state.position_m)
    turn = chosen_rows(balance.found, balance.rotation, state.rotation)
    strain = statics.stretched_at(robot, position, turn, offset) / zero - 1.0
    by_strain = of_holds.theta["k1"].T * strain  # of slack wires negative, as latent tensions are
    latent = np.where(balance.tension_N > 0.0, balance.tension_N, by_strain)
    pull = chosen_rows(balance.found, latent, state.pull_N)
    return State(state.white, position, turn, pull)


def near_requests(unknowns: Unknowns, holds: Holds) -> Holds:
    """The holds with those stated poses alone that the joint values lead near, so that a search can begin there.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
        With the poses that the robot was sent to.
    """
    robot = unknowns.robot
    session = holds.session
    bare, offset = inverse.lengths(robot, session.joint_m)
    gap = statics.stretched_at(robot, session.position_m, session.rotation, offset) - bare
    largest = np.abs(gap / robot.lines).max(1)
    near = largest < _ASTRAY * robot.span_m + _OFF * unknowns.prior.reference_sd_m
    lost = session.without_poses()
    position = chosen_rows(near, session.position_m, lost.position_m)
    rotation = chosen_rows(near, session.rotation, lost.rotation)
    some_lost = replace(session, position_m=position, rotation=rotation)
    return replace(holds, session=some_lost)


def _near_file(unknowns: Unknowns, rng: Generator) -> Floats:
    """(m,) unknowns about the robot's file, geometry and references half as far off as their prior says."""
    white = np.zeros(unknowns.count)
    first = unknowns.slices["drum"].start
    white[:first] = 0.5 * rng.standard_normal(first)
    return white
