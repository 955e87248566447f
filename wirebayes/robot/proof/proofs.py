"""What interval arithmetic proves about a robot at a pose: a single equilibrium, and a box of it for all wires."""

import numpy as np

from wirebayes.json_files.pose import CertificateJson, EnclosedBand
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Poses, Robot
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import control, forward, inverse
from wirebayes.robot.motion.course import Course
from wirebayes.robot.proof.certificate import certify
from wirebayes.robot.proof.reach import Reach, each_on_its_own, reach
from wirebayes.wire.laws import ElasticLaw

_Pose = tuple[Floats, Floats, Floats]  # position, rotation, and how exactly they are known
_Band = tuple[Floats, Floats]  # low and high
_STEP = 0.1  # how far, of the whole creep, wires may be out of step
SHARES = (1.0, 0.5, 0.25, 0.125, 0.0625)  # of the bands, the largest that can be proved


def only_equilibrium(robot: Robot, wires: Wires, position_m: Floats, rotation: Floats) -> CertificateJson:
    """Proof that the mean wire has exactly one equilibrium here, when interval arithmetic is installed.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        Draws; their mean stiffness is used.
    position_m : (3,) array
    rotation : (3, 3) array
        The commanded pose.

    Returns
    -------
    dict
        ``proved``: True, False, or None where no proof was tried, for the reason in ``sentence``; ``enclosure_m``: how
        far the equilibrium may be from the pose; ``alone_within_m``: where there is no other.
    """
    if robot.motions is not None:
        return {"proved": None, "sentence": "Proofs know robots that hang on their wires alone."}
    if wires.at("strain"):
        return {"proved": None, "sentence": "Proofs know laws (1), (3) and (6) without further effects."}
    mean = control.known(wires)
    k1 = np.broadcast_to(mean.theta["k1"][:, 0], robot.legs)
    here = inverse.commands_at(robot, mean, position_m, rotation)
    zero, offset, turn = here.zero_m[0], here.offset_m[0], here.rotation[0]
    try:
        proof = certify(robot, wires.law, (k1, k1), (zero, zero), offset, position_m, turn)
    except ImportError:
        return {"proved": None, "sentence": "python-flint is not installed (extra: certificate)."}
    return {"proved": proof.proved, "enclosure_m": proof.radius_m, "alone_within_m": proof.unique_m}


def enclosed(robot: Robot, wires: Wires, course: Course, position_m: Floats, rotation: Floats) -> EnclosedBand:
    """Where the platform surely is at the last time while every wire's stiffness and creep lie in their 90 % bands.

    Each wire may lie anywhere in the bands on its own: a box that holds more than the joint posterior does. Commanded
    are the mean wire's joint values. The whole way from the commanded pose is proved, not its end alone: the
    equilibrium at the end must be the one that continues the pose. Where the whole band cannot be proved, a share of it
    about its middle is.

    Parameters
    ----------
    robot : Robot
    wires : Wires
        Draws whose 5 and 95 % quantiles are the bands.
    course : Course
        The drift of these draws; its end gives the bands of the creep.
    position_m : (3,) array
    rotation : (3, 3) array
        The commanded pose.

    Returns
    -------
    dict
        ``band`` with the time, the share of the band that was proved and the box, mm from the commanded position;
        empty where no proof can be tried.
    """
    if wires.at("strain") or robot.motions is not None:
        return {}
    end_s = course.times_s[-1]
    nothing: EnclosedBand = {"band": {"time_s": end_s, "share": 0.0, "low_mm": None, "high_mm": None}}
    fell = course.falls is not None and course.falls.fell.any()
    if fell or not course.found.any():
        return nothing
    mean = control.known(wires)
    commands = inverse.commands_at(robot, mean, position_m, rotation)
    stiffness = _band(robot, wires.theta["k1"], course)
    creep = _band(robot, course.end.strain(wires), course)
    for share in SHARES:
        try:
            proof = _proved_share(robot, mean, commands, (stiffness, creep), share, position_m)
        except ImportError:
            return {}
        if proof is not None:
            middle = proof.centre_m - position_m
            half = proof.radius_m[:3]
            low, high = 1e3 * (middle - half), 1e3 * (middle + half)
            return {"band": {"time_s": end_s, "share": share, "low_mm": low, "high_mm": high}}
    return nothing


def _band(robot: Robot, values: Floats, course: Course) -> _Band:
    """5 and 95 % quantiles (w,) of the wires' values in the draws that hold the platform to the end."""
    each = np.broadcast_to(values, (robot.legs, len(course.found)))
    held = each[:, course.found]
    return np.quantile(held, 0.05, axis=1), np.quantile(held, 0.95, axis=1)


def _proved_share(
    robot: Robot,
    mean: Wires,
    commands: inverse.Commands,
    bands: tuple[_Band, _Band],
    share: float,
    position_m: Floats,
) -> Reach | None:
    """The proof of a share of the bands of stiffness and strain about their middle, from the commanded pose on."""
    known = np.broadcast_to(mean.theta["k1"][:, 0], robot.legs)
    bare, offset = inverse.lengths(robot, commands.joint_m[0])
    low, high = _middle(*bands[0], share)
    # the commanded pose itself must be among what is proved
    stiff = np.minimum(low, known), np.maximum(high, known)
    way = _Way(robot, mean.law, stiff, _middle(*bands[1], share), bare, offset)
    return way.proved(position_m, commands.rotation[0], known)


def _middle(low: Floats, high: Floats, share: float) -> _Band:
    middle, half = 0.5 * (low + high), 0.5 * share * (high - low)
    return middle - half, middle + half


def _centre(band: _Band) -> Floats:
    return 0.5 * (band[0] + band[1])


class _Way:
    """Proofs from the commanded lengths to the crept ones, piece by piece, each joined to the one before.

    In a piece from share a to share b of the creep, every wire's creep is anywhere between a times the least and b
    times the most that it comes to, and a tenth of the whole beyond: wires of different rates need not keep step.
    """

    def __init__(
        self,
        robot: Robot,
        law: ElasticLaw,
        k1_N: _Band,
        strain: _Band,
        bare_m: Floats,
        offset_m: Floats,
    ) -> None:
        self.robot, self.law, self.k1, self.strain = robot, law, k1_N, strain
        self.bare, self.offset = bare_m, offset_m

    def proved(self, x: Floats, R: Floats, k1_N: Floats) -> Reach | None:
        """The proof for the end of the way, from the commanded pose and stiffness.

        Parameters
        ----------
        x : (3,) array
        R : (3, 3) array
            The commanded pose.
        k1_N : (w,) array
            The stiffness that the commands were computed with.

        Returns
        -------
        Reach or None
            None where a piece of the way is not proved.
        """
        commanded = self._certain((x, R), k1_N, np.zeros(self.robot.legs))
        if commanded is None:
            return None
        away_m = np.abs(commanded[0] - x).max()
        if away_m > 1e-6 * self.robot.span_m:  # not held stably
            return None
        here, at = commanded, k1_N
        strain = np.zeros(self.robot.legs)
        pieces = [(0.0, 1.0)]
        while pieces:
            a, b = pieces.pop()
            ahead = self._ahead(a, b)
            piece = self._reach(here, at, strain, ahead)
            if piece is None:
                if b - a < _STEP:  # what varies now is not the creep: smaller pieces are as wide
                    return None
                middle = 0.5 * (a + b)
                pieces.append((middle, b))
                pieces.append((a, middle))
                continue
            at = 0.5 * (self.k1[0] + self.k1[1])
            strain = 0.5 * b * (self.strain[0] + self.strain[1])
            there = self._certain((here[0], here[1]), at, strain)
            if there is None or not self._joined(piece, there, at, strain, ahead):
                return None
            here = there
        return self._reach(here, at, strain, self.strain)

    def _ahead(self, a: float, b: float) -> _Band:
        """Creep strains of a piece of the way, from share a to share b."""
        low, high = self.strain
        return np.maximum(a * low - _STEP * high, 0.0), np.minimum(b + _STEP, 1.0) * high

    def _certain(self, near: Poses, k1_N: Floats, strain: Floats) -> _Pose | None:
        """A pose proved for known wires, with the width of its proof."""
        pose = self._solved(near, k1_N, strain)
        if pose is None:
            return None
        zero = self.bare * (1 + strain)
        proof = certify(self.robot, self.law, (k1_N, k1_N), (zero, zero), self.offset, *pose, how_alone=False)
        return (*pose, proof.radius_m) if proof.proved else None

    def _solved(self, near: Poses, k1_N: Floats, strain: Floats) -> Poses | None:
        modulus = Wires(self.law, "saturating", {"k1": k1_N[:, None]}, np.full((self.robot.legs, 1), 1000.0))
        zero = self.bare * (1 + strain)
        found = forward.solve_equilibrium(self.robot, modulus, zero[None], self.offset, *near)
        if not found.found[0]:
            return None
        left, _, right = np.linalg.svd(found.rotation[0])
        return found.position_m[0], left @ right

    def _reach(self, here: _Pose, k1_N: Floats, strain: Floats, band: _Band) -> Reach | None:
        """A piece's proof about its middle, if the pose here is the equilibrium that it proves."""
        stiff, grown = _centre(self.k1), _centre(band)
        middle = self._solved((here[0], here[1]), stiff, grown)
        if middle is None:
            return None
        half_k1 = 0.5 * (self.k1[1] - self.k1[0])
        half_zero = 0.5 * self.bare * (band[1] - band[0])
        zero = self.bare * (1 + grown)
        proof = reach(self.robot, self.law, stiff, zero, each_on_its_own(half_k1, half_zero), self.offset, *middle)
        joined = proof.proved and self._joined(proof, here, k1_N, strain, band)
        return proof if joined else None

    def _joined(self, proof: Reach, here: _Pose, k1_N: Floats, strain: Floats, band: _Band) -> bool:
        p = []
        for value, (low, high) in ((k1_N, self.k1), (strain, band)):
            if not np.all((low <= value) & (value <= high)):  # of wires that the proof does not cover
                return False
            half = 0.5 * (high - low)
            p.append((value - 0.5 * (low + high)) / np.where(half > 0, half, 1.0))
        return proof.holds(here[0], here[1], np.concatenate(p), self.robot.size_m, here[2])
