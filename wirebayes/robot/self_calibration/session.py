"""A calibration session: what the robot did and read, and what was known before.

Unknown are the error of every wire's reference length, the line's parameters, each specimen's own deviation and, where
a prior allows it, the bias of each tension sensor: its zero, or friction of guides and winch between it and the wire.
"""

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from wirebayes.numeric.typing import Array, Bools, Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import (
    CORE,
    LENGTH_EXPONENT,
    WireDraws,
    differing,
    differing_by,
    for_robot,
    lines_of,
    spread_of,
    typical_of_legs,
)
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion.creep import without_creep

_LEAST = 1e-6  # relative: wires that are said to be alike still get a spread, far below anything that matters


@dataclass(frozen=True)
class Session:
    """What the robot did, in order, from wires never loaded on.

    Attributes
    ----------
    position_m, rotation : (p, 3), (p, 3, 3) arrays
        Requested poses. The robot went there in small steps, so it is at the equilibrium next to them.
    joint_m : (p, w) array
    duration_s : (p,) array
    read : (p,) bool array
        True where tensions were read, at the hold's end; readings of single wires may be missing.
    tension_sd_N : float
    tilt_sd_rad : float or None
        Error of the two components of the platform's normal, when an inclinometer is on board.
    motion : (p, w) array, optional
        1 where a wire was pulled in last, -1 where it was let out, 0 where it did not move: the sign of its sensor's
        bias. Without it the bias is a constant.
    number : (p,) array, optional
        What the holds are called; without it they are counted from 1.
    """

    position_m: Floats
    rotation: Floats
    joint_m: Floats
    duration_s: Floats
    read: Bools
    tension_sd_N: float
    tilt_sd_rad: float | None = None
    motion: Floats | None = None
    number: Floats | None = None

    @property
    def numbers(self) -> Array:
        """(p,) What the holds are called."""
        return np.arange(1, len(self.duration_s) + 1) if self.number is None else self.number

    @property
    def readings(self) -> int:
        """Number of values that were read."""
        tilts = 0 if self.tilt_sd_rad is None else 2
        return int(self.read.sum()) * (self.joint_m.shape[1] + tilts)

    def without_poses(self) -> "Session":
        """The same where nothing is known of the poses."""
        position = np.full_like(self.position_m, np.nan)
        turn = np.full(self.rotation.shape, np.nan)
        return replace(self, position_m=position, rotation=turn)

    @property
    def signs(self) -> Floats:
        """(p, w) How the bias enters a tension that is read."""
        return np.ones_like(self.joint_m) if self.motion is None else self.motion


@dataclass(frozen=True)
class LengthPrior:
    """What is known before: the line's posterior, the spread of specimens, the error of the reference lengths.

    Attributes
    ----------
    line : WireDraws
    reference_sd_m : float
    spread : float
        Relative, of k1, B and k2 from wire to wire; a line with an estimated spread has its own.
    creeps : bool
        False: calibration by Hooke's law alone, lengths thought constant.
    bias_sd_N : float
        Standard deviation of a tension sensor's bias; 0: the sensors have none.
    """

    line: WireDraws
    reference_sd_m: float
    spread: float = 0.05
    creeps: bool = True
    bias_sd_N: float = 0.0

    @property
    def names(self) -> list[str]:
        """The parameters of all lines among the unknowns, those of further lines with the line's name before them."""
        names = []
        for wire, line in self.line.each.items():
            before = "" if line is self.line else f"{wire} "
            names += [before + name for name in _own(line)]
        return names

    @property
    def own(self) -> tuple[str, ...]:
        """The parameters in which specimens differ."""
        return differing(self.line)

    @property
    def own_sd(self) -> float:
        """Standard deviation of the unknowns that say how a specimen differs; they are scaled for each leg's line."""
        return max(self.spread, _LEAST)

    @property
    def fitted(self) -> Floats:
        """(p, n) draws of all lines' parameters, logarithms of those that are positive."""
        values = []
        for line in self.line.each.values():
            for name in _own(line):
                drawn = line.parameters[name]
                values.append(np.log(drawn) if name in CORE else drawn)
        return np.array(values)

    def moments(self, legs: int) -> tuple[Floats, Floats]:
        """Mean ``(d,)`` and covariance ``(d, d)`` of the unknowns: references, (log) parameters, specimens, biases."""
        values = self.fitted
        own = len(self.own) * legs
        biased = legs if self.bias_sd_N > 0 else 0
        mean = np.concatenate([np.zeros(legs), values.mean(1), np.zeros(own + biased)])
        # A parameter that is given exactly still gets a relative uncertainty, far below anything that matters.
        fitted = 1e-12 * np.eye(len(values))
        if self.line.count > 1:
            fitted = fitted + np.cov(values)
        sds = ((self.reference_sd_m, legs), (self.own_sd, own), (self.bias_sd_N, biased))
        references, specimens, sensors = (sd**2 * np.eye(count) for sd, count in sds)
        return mean, block_diag(references, fitted, specimens, sensors)

    def wires(self, robot: Robot, unknowns: Floats) -> tuple[Wires, Floats]:
        """Wires, and reference errors ``(n, w)``, of unknowns ``(n, d)``."""
        legs = robot.legs
        first_own = legs + len(self.names)
        wires = self._without_specimens(robot, unknowns[:, legs:first_own])
        differs = {}
        for k, name in enumerate(self.own):
            start = first_own + k * legs
            deviation = unknowns[:, start : start + legs].T
            scale = self._specimen_scale(robot, name)
            differs[name] = np.exp(scale * deviation)
        typical = typical_of_legs(self.line, lines_of(robot, self.line))
        theta = dict(wires.theta) | differing_by(wires.theta, differs, typical)
        whole = replace(wires, theta=theta)
        if not self.creeps:
            whole = without_creep(whole)
        references = unknowns[:, :legs]
        return whole, references

    def _without_specimens(self, robot: Robot, fitted: Floats) -> Wires:
        """Wires of the lines' parameters ``(n, p)``, specimens of one line alike."""
        columns = iter(fitted.T)
        lines = {}
        for wire, line in self.line.each.items():
            values = {name: next(columns) for name in _own(line)}
            for name in CORE:
                values[name] = np.exp(values[name])
            lines[wire] = replace(line, parameters=values)
        first = lines.pop(self.line.name)
        return for_robot(robot, replace(first, others=lines))

    def _specimen_scale(self, robot: Robot, name: str) -> Floats:
        """(w, 1) how much more than `own_sd` the specimens of each leg's line differ."""
        rms: list[float] = []
        lines = lines_of(robot, self.line)
        for i, line in enumerate(lines):
            if i and line is lines[i - 1]:  # as of most robots: this is asked at every step of a search
                rms.append(rms[-1])
                continue
            spread = spread_of(line, name, self.own_sd)
            rms.append(np.sqrt(np.mean(np.square(spread))))
        return np.array(rms)[:, None] / self.own_sd

    def bias_N(self, legs: int, unknowns: Floats) -> Floats:
        """Biases ``(n, w)`` of the tension sensors among unknowns ``(n, d)``; zero where sensors have none."""
        return unknowns[:, -legs:] if self.bias_sd_N > 0 else np.zeros((len(unknowns), legs))


def _own(line: WireDraws) -> list[str]:
    """The parameters of one line."""
    names = list(CORE)
    for effect in line.material():
        names += effect.columns()
    if LENGTH_EXPONENT in line.parameters:
        names.append(LENGTH_EXPONENT)
    return names
