"""The equations of a session's holds about a state: residuals in standard deviations, and their slopes."""

from dataclasses import dataclass, replace

import numpy as np

from wirebayes.numeric.batches import batch_first, batch_last
from wirebayes.numeric.rows import chosen_rows
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics import rotation as turns
from wirebayes.robot.mechanics import statics
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.robot.mechanics.winches import turned_by
from wirebayes.robot.motion import inverse
from wirebayes.robot.self_calibration.by_points import by_points, swing
from wirebayes.robot.self_calibration.equations import EXACT, Equations, Holds, Noise, State, moved, pulled
from wirebayes.robot.self_calibration.internal_tensions import without_carried
from wirebayes.robot.self_calibration.strain import Grown, Stretch, stretch
from wirebayes.robot.self_calibration.unknowns import Parts, Unknowns, one_after_another


@dataclass(frozen=True)
class _About:
    """The state about which equations are linearised, and what several of them are made of.

    Attributes
    ----------
    here : Robot
        With its points where the state has them.
    turn : (3, 3, p) array
    J : (p, w, d) array
        Growth of the wires' lengths by a small motion, rotations in metres at the platform's edge.
    """

    unknowns: Unknowns
    holds: Holds
    noise: Noise
    state: State
    parts: Parts
    here: Robot
    turn: Floats
    shape: statics.Geometry
    J: Floats

    @classmethod
    def at(cls, unknowns: Unknowns, holds: Holds, noise: Noise, state: State) -> "_About":
        parts = unknowns.parts(state.white)
        here = moved(unknowns.robot, parts)
        turn = batch_last(state.rotation)
        shape = statics.geometry(here, state.position_m.T, turn)
        J = batch_first(statics.wire_jacobian(here, shape)).mT * here.edge_scale
        return cls(unknowns, holds, noise, state, parts, here, turn, shape, J)


def linearised(unknowns: Unknowns, holds: Holds, noise: Noise, state: State, creep: Grown, since: State) -> Equations:
    """The equations about a state.

    Parameters
    ----------
    unknowns : Unknowns
    holds : Holds
    noise : Noise
    state : State
    creep : Grown
        About `since`; straight from there.
    since : State
    """
    about = _About.at(unknowns, holds, noise, state)
    out = _empty(unknowns, holds)
    lengths = _Lengths.at(about, creep, since)
    _loops(out, about, creep, lengths)
    _balance(out, about)
    _tensions(out, about)
    _poses(out, about)
    if holds.tilt is not None:
        _tilts(out, about)
    return replace(out, by_earlier=_by_earlier(about, creep, lengths))


def _empty(unknowns: Unknowns, holds: Holds) -> Equations:
    """Equations of which nothing is written yet."""
    robot = unknowns.robot
    counts = {"loop": robot.legs, "balance": robot.degrees, "tension": robot.legs, "pose": robot.degrees}
    if unknowns.errors.level_N > 0:
        counts["carried"] = robot.degrees
    if holds.tilt is not None:
        counts["tilt"] = 2
    shape = len(holds.session.duration_s), sum(counts.values())
    by_robot = np.zeros((*shape, unknowns.count))
    by_hold = np.zeros((*shape, robot.degrees + robot.legs))
    return Equations(np.zeros(shape), by_robot, by_hold, one_after_another(counts), np.ones(shape, bool))


@dataclass(frozen=True)
class _Lengths:
    """Parts of the wires' lengths, ``(p, w)``: bare lengths that creep and tension make longer, and offsets.

    Attributes
    ----------
    drawn : (p, w) array
        What the joint values draw, by which errors of drums grow.
    strain : (p, w) array
        By creep.
    elastic : Stretch
    """

    bare: Floats
    offset: Floats
    drawn: Floats
    strain: Floats
    elastic: Stretch

    @classmethod
    def at(cls, about: _About, creep: Grown, since: State) -> "_Lengths":
        robot = about.unknowns.robot
        parts = about.parts
        state = about.state
        joint_m = about.holds.session.joint_m
        linear = robot.is_linear
        bare, offset = inverse.lengths(robot, joint_m)
        drawn = robot.ratio * joint_m * linear + joint_m * ~linear
        bare = bare + parts.reference_m + parts.drum * drawn * ~linear
        offset = offset + parts.drum * drawn * linear
        strain = creep.strain + _more_creep(about, creep, since)
        elastic = stretch(about.unknowns, state.white, state.pull_N)
        return cls(bare, offset, drawn, strain, elastic)

    @property
    def longer(self) -> Floats:
        """(p, w) how often as long as before creep and stretch."""
        return (1 + self.strain) * self.elastic.ratio

    def by_pull(self, creep: Grown) -> Floats:
        """(p, w) slopes of `longer` by the tensions."""
        elastic = self.elastic
        by_own = np.einsum("hhw->hw", creep.by_pull)
        return by_own * elastic.ratio + (1 + self.strain) * elastic.by_pull

    def by_earlier(self, creep: Grown) -> Floats:
        """(p, p, w) slopes of `longer` by the tensions of earlier holds."""
        before = np.tri(len(self.bare), k=-1)[..., None] * creep.by_pull
        return before * self.elastic.ratio[:, None]

    def by_wires(self, creep: Grown) -> Floats:
        """(p, w, d) slopes of `longer` by the wires' unknowns."""
        elastic = self.elastic
        crept = creep.by_wires * elastic.ratio[..., None]
        return crept + (1 + self.strain)[..., None] * elastic.by_wires


def _more_creep(about: _About, creep: Grown, since: State) -> Floats:
    """(p, w) creep strain, to first order, that a state has beyond the one since which creep was not simulated."""
    state = about.state
    wires = about.unknowns.slices["wires"]
    change = state.white[wires] - since.white[wires]
    by_tension = np.einsum("hkw,kw->hw", creep.by_pull, state.pull_N - since.pull_N)
    return creep.by_wires @ change + by_tension


def _by_earlier(about: _About, creep: Grown, lengths: _Lengths) -> Floats | None:
    """(p, p, w, w) slopes of every hold's loops, as `_weigh_loops` has them, by the tensions of earlier holds."""
    longer = lengths.by_earlier(creep)
    if not longer.any():
        return None
    robot = about.here
    slope = -lengths.bare[:, None] * longer / about.noise.joint_m
    alone = _errors_apart(robot)
    mixes = np.eye(robot.legs) if alone is None else alone
    return mixes * slope[:, :, None]


def _loops(out: Equations, about: _About, creep: Grown, lengths: _Lengths) -> None:
    """Every wire is as long as its way: stretched from what the joint value, its reference and creep make of it."""
    robot = about.here
    unknowns = about.unknowns
    loop = out.rows["loop"]
    d = robot.degrees
    leg = np.arange(robot.legs)
    way = statics.stretched(robot, about.shape, lengths.offset.T).T
    out.residual[:, loop] = way - lengths.bare * lengths.longer
    out.by_hold[:, loop, :d] = about.J
    out.by_hold[:, leg, d + leg] = -lengths.bare * lengths.by_pull(creep)
    _loops_by_wires(out, about, lengths, creep)
    if unknowns.errors.drum > 0:
        _loops_by_drum(out, unknowns, lengths)
    _loops_by_points(out, about)
    _weigh_loops(out, robot, about.noise)


def _loops_by_wires(out: Equations, about: _About, lengths: _Lengths, creep: Grown) -> None:
    """Slopes by the wires' unknowns, the errors of the reference lengths among them."""
    unknowns = about.unknowns
    leg = np.arange(about.here.legs)
    wires = out.by_robot[:, out.rows["loop"], unknowns.slices["wires"]]
    wires -= lengths.bare[..., None] * lengths.by_wires(creep)
    wires[:, leg, leg] -= lengths.longer * unknowns.prior.reference_sd_m


def _loops_by_points(out: Equations, about: _About) -> None:
    along = batch_first(about.shape.direction).mT * about.here.lines[:, None]  # (p, w, 3)
    by_platform = np.einsum("pwi,pij->pwj", along, about.state.rotation)
    by_points(out.by_robot[:, out.rows["loop"]], about.unknowns, -along, by_platform)


def _loops_by_drum(out: Equations, unknowns: Unknowns, lengths: _Lengths) -> None:
    """Slopes by the errors of drums: of what is drawn of the line, or of the line that is longer than bare."""
    lengthens = np.where(unknowns.robot.is_linear, lengths.drawn, -lengths.drawn * lengths.longer)
    leg = np.arange(unknowns.robot.legs)
    out.by_robot[:, leg, unknowns.drum_columns] = lengthens * unknowns.errors.drum


def _weigh_loops(out: Equations, robot: Robot, noise: Noise) -> None:
    """Equations of the wires in standard deviations of their errors, which are made independent."""
    loop = out.rows["loop"]
    alone = _errors_apart(robot)
    for values in (out.residual, out.by_robot, out.by_hold):
        values[:, loop] /= noise.joint_m
        if alone is not None:
            values[:, loop] = np.einsum("ij,pj...->pi...", alone, values[:, loop])


def _errors_apart(robot: Robot) -> Floats | None:
    """(w, w) What makes the errors of all lines' lengths independent of each other; None where they are.

    Half of the variance is the winch's, whose encoder and drum its lines share; half is each line's, as it lies there.
    """
    if robot.winch is None:
        return None
    share = turned_by(robot)
    covariance = 0.5 * (np.eye(robot.legs) + share @ share.T)
    return np.linalg.inv(np.linalg.cholesky(covariance))


def _balance(out: Equations, about: _About) -> None:
    """The wires carry the platform."""
    robot = about.here
    noise = about.noise
    d = robot.degrees
    scale = robot.edge_scale
    pull, taut = pulled(about.state.pull_N, noise.soft_N)
    none = np.zeros_like(pull.T)
    gradient, hessian = statics.unbalance_and_stiffness(robot, about.shape, about.turn, pull.T, none)
    stiffness = batch_first(hessian) * scale * scale[:, None]
    by_pull = about.J.mT * taut[:, None]
    force = noise.balance * robot.mass_kg * GRAVITY
    rows = out.rows["balance"]
    out.residual[:, rows] = gradient.T * scale / force
    by_hold = out.by_hold[:, rows]
    by_hold[..., :d] = stiffness / force
    by_hold[..., d:] = by_pull / force
    _balance_by_points(out, about, pull, force)


def _balance_by_points(out: Equations, about: _About, pull: Floats, force: float) -> None:
    """Slopes of the balance, in units of a force, by the points at which wires pull."""
    unit = about.here.edge_scale[:, None, None]
    by_exit, by_platform = swing(about.here, about.shape, about.state.rotation, pull)
    by_points(out.by_robot[:, out.rows["balance"]], about.unknowns, by_exit * unit / force, by_platform * unit / force)


def _tensions(out: Equations, about: _About) -> None:
    """Tensions that were read, and what is usual where none was."""
    read = np.isfinite(about.holds.tension_N)
    rows = out.rows["tension"]
    leg = np.arange(about.here.legs)
    sd_N = about.holds.session.tension_sd_N
    pull_N = about.noise.pull_N
    pull, taut = pulled(about.state.pull_N, about.noise.soft_N)
    out.known[:, rows] = read
    out.residual[:, rows] = np.where(read, _off_reading(about, pull) / sd_N, _off_usual(about) / pull_N)
    by_pull = np.where(read, taut / sd_N, 1.0 / pull_N)
    out.by_hold[:, rows.start + leg, about.here.degrees + leg] = by_pull
    _tensions_by_robot(out, about, read)
    if about.unknowns.errors.level_N > 0:
        without_carried(out, about.unknowns, about.here, about.shape, about.state.rotation, ~read)


def _off_reading(about: _About, pull: Floats) -> Floats:
    """(p, w) N beyond what was read, with the sensors' biases."""
    bias = about.holds.session.signs * about.parts.bias_N
    return pull + bias - about.holds.tension_N


def _off_usual(about: _About) -> Floats:
    """(p, w) N beyond what is usual."""
    return about.state.pull_N - about.parts.level_N - about.noise.usual_N


def _tensions_by_robot(out: Equations, about: _About, read: Bools) -> None:
    """Slopes by levels and by the sensors' biases, where these are unknown."""
    unknowns = about.unknowns
    session = about.holds.session
    legs = unknowns.robot.legs
    leg = np.arange(legs)
    row = out.rows["tension"].start + leg
    level_N = unknowns.errors.level_N
    if level_N > 0:
        slope = np.where(read, 0.0, -level_N / about.noise.pull_N)
        column = unknowns.slices["level"].start + leg
        out.by_robot[:, row, column] = slope
    bias_N = unknowns.prior.bias_sd_N
    if bias_N > 0:
        by_bias = session.signs * bias_N / session.tension_sd_N
        slope = np.where(read, by_bias, 0.0)
        column = unknowns.slices["wires"].stop - legs + leg
        out.by_robot[:, row, column] = slope


def _poses(out: Equations, about: _About) -> None:
    """Poses that were stated."""
    robot = about.unknowns.robot
    rows = out.rows["pose"]
    sd = max(about.unknowns.errors.pose_m, EXACT * robot.span_m)
    known = out.known[:, rows]
    residual = out.residual[:, rows]
    known[:, :3] = about.holds.placed[:, None]
    residual[:, :3] = _displaced(about) / sd
    if robot.degrees == 6:
        known[:, 3:] = about.holds.oriented[:, None]
        residual[:, 3:] = _turned(about) * robot.size_m / sd
    out.by_hold[:, rows, : robot.degrees] = known[..., None] * np.eye(robot.degrees) / sd


def _displaced(about: _About) -> Floats:
    """(p, 3) m from the positions that were stated; zero where none was."""
    displaced = about.state.position_m - about.holds.session.position_m
    return chosen_rows(about.holds.placed, displaced, 0.0)


def _turned(about: _About) -> Floats:
    """(p, 3) rad from the orientations that were stated; zero where none was."""
    rotation = about.state.rotation
    stated = chosen_rows(about.holds.oriented, about.holds.session.rotation, rotation)
    return turns.vector(rotation @ stated.mT)


def _tilts(out: Equations, about: _About) -> None:
    """Components of the platform's normal that an inclinometer read."""
    tilt = about.holds.tilt
    sd = about.holds.session.tilt_sd_rad
    if tilt is None or sd is None:
        return
    rows = out.rows["tilt"]
    read = np.isfinite(tilt)
    normal = about.state.rotation[:, :, 2]
    out.known[:, rows] = read
    out.residual[:, rows] = np.where(read, normal[:, :2] - tilt, 0.0) / sd
    if about.here.degrees == 6:
        slope = -turns.cross_matrix(normal)[:, :2] / about.here.size_m
        out.by_hold[:, rows, 3:6] = read[..., None] * slope / sd
