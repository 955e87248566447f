"""Proof by interval arithmetic that a box of poses holds exactly one equilibrium, for all wire parameters in a box.

Krawczyk's operator on the balance of forces and moments, ball arithmetic by FLINT (extra ``certificate``). A pose is a
displacement and Cayley's three numbers of a turn from the pose in question, all in metres at the platform's edge. Where
a wire may go slack its slope is the hull of both sides, which keeps the mean value theorem and hence the proof.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wirebayes.robot.description import GRAVITY, Robot
from wirebayes.wire.laws import ElasticLaw

Floats = NDArray[np.float64]
Bounds = tuple[Floats, Floats]  # lower and upper, (w,) each


@dataclass(frozen=True)
class Certificate:
    """What was proved.

    Attributes
    ----------
    proved : bool
        For every choice of parameters within their bounds, exactly one equilibrium lies in the enclosure.
    centre_m, rotation : (3,), (3, 3) arrays
        Pose that the enclosure is about.
    radius_m : (6 or 3,) array
        Half widths of the enclosure: displacements, then turns times the platform's size. NaN when not proved.
    unique_m : float
        Half width of the largest tried box about the pose that was proved to hold no second equilibrium.
    """

    proved: bool
    centre_m: Floats
    rotation: Floats
    radius_m: Floats
    unique_m: float


def certify(
    robot: Robot,
    law: ElasticLaw,
    k1_N: Bounds,
    zero_m: Bounds,
    offset_m: Floats,
    position_m: Floats,
    rotation: Floats,
) -> Certificate:
    """Try to prove that one equilibrium, and only one, lies near a pose.

    Parameters
    ----------
    robot : Robot
    law : {"hooke", "modified"}
    k1_N, zero_m : pairs of (w,) arrays
        Bounds of stiffness and zero-tension length; equal bounds for known values.
    offset_m : (w,) array
        As in `forward.solve`.
    position_m, rotation : (3,), (3, 3) arrays
        Approximate solution for the middle of the bounds.

    Returns
    -------
    Certificate

    Raises
    ------
    ImportError
        python-flint is not installed.
    """
    system = _Balance(robot, law, k1_N, zero_m, offset_m, position_m, rotation)
    d = robot.degrees
    nothing = Certificate(False, position_m, rotation, np.full(d, np.nan), 0.0)
    try:
        C = np.asarray(np.linalg.inv(system.middle_slope()), np.float64)
    except np.linalg.LinAlgError:  # the platform is free to move: no isolated equilibrium
        return nothing
    radius = np.full(d, 1e-10)
    for _ in range(40):
        image = _krawczyk(system, C, radius)
        if np.all(image < radius):
            break
        radius = 1.2 * image + 1e-13
        if not np.all(radius < 0.5 * robot.size_m + 0.5 * np.ptp(robot.exit_m)):
            return nothing
    else:
        return nothing
    # Inside, further images only shrink the enclosure.
    for _ in range(3):
        radius = np.minimum(radius, _krawczyk(system, C, radius))
    unique, width = float(radius.min()), 1e-7
    while width < np.ptp(robot.exit_m):
        box = np.maximum(radius, width)
        if not np.all(_krawczyk(system, C, box) < box):
            break
        unique, width = max(unique, width), 1.5 * width
    return Certificate(True, position_m, rotation, radius, unique)


def _krawczyk(system: "_Balance", C: Floats, radius: Floats) -> Floats:
    """Largest distance from the centre of Krawczyk's image of the box of half widths `radius`."""
    import flint

    d = len(radius)
    box = [flint.arb(0, float(r)) for r in radius]
    _, slope = system.evaluate(box)
    precondition = flint.arb_mat(C.tolist())
    eye = flint.arb_mat([[int(i == j) for j in range(d)] for i in range(d)])
    image = (eye - precondition * slope) * flint.arb_mat([[b] for b in box])
    # Wire by wire: an uncertain tension moves all balances together, so it is multiplied in last.
    weight, pulls = system.at_centre()
    image -= precondition * weight
    for wrench, tau in pulls:
        image -= (precondition * wrench) * tau
    out = [image[i, 0].abs_upper() for i in range(d)]
    return np.array([np.nextafter(float(v), np.inf) if v.is_finite() else np.inf for v in out])


class _Balance:
    """Forces and moments (divided by the platform's size) and their slopes, in ball arithmetic."""

    def __init__(
        self, robot: Robot, law: ElasticLaw, k1: Bounds, zero: Bounds, offset: Floats, x: Floats, R: Floats
    ) -> None:
        import flint

        self.robot, self.law, self.arb = robot, law, flint.arb
        self.k1 = [self._hull(*pair) for pair in zip(*k1, strict=True)]
        self.zero = [self._hull(*pair) for pair in zip(*zero, strict=True)]
        self.offset = [flint.arb(float(v)) for v in offset]
        self.x = [flint.arb(float(v)) for v in x]
        # The turn starts from the given matrix as it is; that it is orthogonal only to rounding is part of the robot.
        self.R = flint.arb_mat(R.tolist())
        self.size = flint.arb(robot.size_m)

    def _hull(self, low: float, high: float) -> Any:
        return self.arb(float(low)).union(self.arb(float(high)))

    def middle_slope(self) -> Floats:
        """Slope at the centre with the middle parameters, as numbers."""
        _, slope = self.evaluate([self.arb(0)] * self.robot.degrees)
        d = self.robot.degrees
        return np.array([[float(slope[i, j].mid()) for j in range(d)] for i in range(d)])

    def evaluate(self, y: list[Any]) -> tuple[list[Any], Any]:
        """Balance (d,) and slope (d, d) over a box `y` of displacements and turns, both in metres."""
        from flint import arb_mat

        arb, robot = self.arb, self.robot
        d = robot.degrees
        turn, by_turn = self._turn(y[3:]) if d == 6 else (self.R, None)
        weight = [arb(0), arb(0), -arb(robot.mass_kg) * arb(GRAVITY)]
        force = list(weight)
        c = _times(turn, robot.centre_of_mass_m, arb)
        moment = _cross(c, weight)
        slope = arb_mat(d, d)
        if d == 6:
            slope += _block(arb_mat(3, 3), None, _skew(weight, arb) * _skew(c, arb) * by_turn, self.size)
        for i in range(robot.legs):
            r, line = self._line(i, y, turn)
            length = _square(line).sqrt()
            m = arb(float(robot.lines[i]))
            tau, stiff = self._tension(i, m * length + self.offset[i])
            u = [a / length for a in line]
            pull = [-m * tau * a for a in u]
            swing = tau / length
            along = stiff * m - swing
            rows = [[-m * (along * a * b + (swing if a is b else 0)) for b in u] for a in u]
            A = arb_mat(rows)
            force = [p + q for p, q in zip(force, pull, strict=True)]
            if d == 3:
                slope += A
                continue
            moment = [p + q for p, q in zip(moment, _cross(r, pull), strict=True)]
            by_arm = -(_skew(r, arb) * by_turn)
            lever = _skew(r, arb)
            slope += _block(A, A * by_arm, lever * A * by_arm - _skew(pull, arb) * by_arm, self.size, lever * A)
        return (force if d == 3 else force + [v / self.size for v in moment]), slope

    def at_centre(self) -> tuple[Any, list[tuple[Any, Any]]]:
        """Balance at the centre in parts: the weight's, and each wire's wrench of 1 N with its tension."""
        from flint import arb_mat

        arb, robot = self.arb, self.robot

        def stacked(force: list[Any], arm: list[Any]) -> Any:
            moment = [] if robot.degrees == 3 else [v / self.size for v in _cross(arm, force)]
            return arb_mat([[v] for v in [*force, *moment]])

        pulls = []
        for i in range(robot.legs):
            r, line = self._line(i, [arb(0)] * 3, self.R)
            length = _square(line).sqrt()
            m = arb(float(robot.lines[i]))
            tau, _ = self._tension(i, m * length + self.offset[i])
            pulls.append((stacked([-m * a / length for a in line], r), tau))
        weight = [arb(0), arb(0), -arb(robot.mass_kg) * arb(GRAVITY)]
        return stacked(weight, _times(self.R, robot.centre_of_mass_m, arb)), pulls

    def _line(self, i: int, y: list[Any], turn: Any) -> tuple[list[Any], list[Any]]:
        """Platform point from the reference point, and from the exit point."""
        r = _times(turn, self.robot.platform_m[i], self.arb)
        return r, [self.x[k] + y[k] + r[k] - self.arb(float(self.robot.exit_m[i, k])) for k in range(3)]

    def _tension(self, i: int, S: Any) -> tuple[Any, Any]:
        """Tension and its slope; the hull of taut and slack where both are possible."""
        arb, k1, zero = self.arb, self.k1[i], self.zero[i]
        if self.law == "hooke":
            strain, slope = S / zero - 1, k1 / zero
        else:
            strain, slope = 1 - zero / S, k1 * zero / (S * S)
        if strain > 0:
            return k1 * strain, slope
        if strain < 0:
            return arb(0), arb(0)
        return k1 * strain.max(arb(0)), slope.union(arb(0))

    def _turn(self, y: list[Any]) -> tuple[Any, Any]:
        """Rotation by Cayley's numbers s = y / (2 size), and the turn's slope by y."""
        from flint import arb_mat

        arb = self.arb
        s = [v / (2 * self.size) for v in y]
        norm = 1 + _square(s)
        K = _skew(s, arb)
        eye = arb_mat([[int(i == j) for j in range(3)] for i in range(3)])
        by = (eye + K) * (1 / (norm * self.size))
        return (eye + (K + K * K) * (2 / norm)) * self.R, by


def _times(matrix: Any, vector: Floats, arb: Any) -> list[Any]:
    return [sum((matrix[i, j] * arb(float(vector[j])) for j in range(3)), arb(0)) for i in range(3)]


def _square(v: list[Any]) -> Any:
    # not v**2: the power of a ball that holds zero is taken by logarithms and lost
    return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _skew(v: list[Any], arb: Any) -> Any:
    from flint import arb_mat

    z = arb(0)
    return arb_mat([[z, -v[2], v[1]], [v[2], z, -v[0]], [-v[1], v[0], z]])


def _block(corner: Any, right: Any, below_right: Any, size: Any, below: Any = None) -> Any:
    """Six by six from three by three blocks, the lower rows divided by the platform's size."""
    from flint import arb_mat

    out = arb_mat(6, 6)
    for i in range(3):
        for j in range(3):
            out[i, j] = corner[i, j]
            out[i + 3, j + 3] = below_right[i, j] / size
            if right is not None:
                out[i, j + 3] = right[i, j]
            if below is not None:
                out[i + 3, j] = below[i, j] / size
    return out
