"""Forces and moments on a platform in ball arithmetic by FLINT (extra ``certificate``), for proofs.

A pose is a displacement and the three Cayley parameters of a rotation from the commanded pose, all in metres at the
platform's edge. Where a wire may go slack its slope is the hull of both sides: the mean value theorem holds, and so do
proofs.
"""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import GRAVITY, Robot
from wirebayes.wire.laws import LAWS, ElasticLaw

Bounds = tuple[Floats, Floats]  # lower and upper, (w,) each


class Span(NamedTuple):
    """One line of a wire over a box: length, its gradient and its second derivative by the platform point."""

    length: Any
    direction: list[Any]
    curvature: list[list[Any]]


class Strand(NamedTuple):
    """A wire over a box of poses: stretched length, its slope by the pose, and the wrench of 1 N of tension."""

    length: Any
    slope: list[Any]
    wrench: list[Any]


class Balance:
    """Forces and moments (divided by the platform's size) and their slopes, in ball arithmetic."""

    def __init__(
        self, robot: Robot, law: ElasticLaw, k1: Bounds, zero: Bounds, offset: Floats, x: Floats, R: Floats
    ) -> None:
        from flint import arb

        self.robot = robot
        self.law = LAWS[law]
        self.arb = arb
        self.k1 = [self._hull(low, high) for low, high in zip(*k1, strict=True)]
        self.zero = [self._hull(low, high) for low, high in zip(*zero, strict=True)]
        self.offset = [arb(float(v)) for v in offset]
        self.x = [arb(float(v)) for v in x]
        # The turn starts from the given matrix as it is; that it is orthogonal only to rounding is part of the robot.
        self.R = ball_matrix(R)
        self.size = arb(robot.size_m)
        weight_N = -arb(robot.mass_kg) * arb(GRAVITY)
        self.weight = [arb(0), arb(0), weight_N]

    def _hull(self, low: float, high: float) -> Any:
        return self.arb(float(low)).union(self.arb(float(high)))

    def middle_slope(self) -> Floats:
        """Slope at the centre with the middle parameters, as numbers."""
        _, slope = self.evaluate([self.arb(0)] * self.robot.degrees)
        d = self.robot.degrees
        return np.array([[float(slope[i, j].mid()) for j in range(d)] for i in range(d)])

    def evaluate(self, y: list[Any], pulls: list[tuple[Any, Any]] | None = None) -> tuple[list[Any], Any]:
        """Balance (d,) and slope (d, d) over a box `y` of displacements and turns, both in metres.

        `pulls`: tension and slope of every wire, where they are known more narrowly than the box tells.
        """
        from flint import arb_mat

        d = self.robot.degrees
        turn, by_turn = self.R, None
        if d == 6:
            turn, by_turn = self._turn(y[3:])
        centre_of_mass = _times(turn, self.robot.centre_of_mass_m)
        force = self.weight
        moment = _cross(centre_of_mass, self.weight)
        slope = arb_mat(d, d)
        if d == 6:
            by_arm = _skew(self.weight) * _skew(centre_of_mass) * by_turn
            slope += _block(arb_mat(3, 3), None, by_arm, self.size)
        for i in range(self.robot.legs):
            r, line = self._line(i, y, turn)
            span = self._span(i, line)
            known = pulls[i] if pulls else None
            pull, by_place = self._pulled(i, span, known)
            force = _sum(force, pull)
            if d == 3:
                slope += by_place
                continue
            moment = _sum(moment, _cross(r, pull))
            slope += self._by_pose(_skew(r), by_turn, pull, by_place)
        if d == 3:
            return force, slope
        return force + [v / self.size for v in moment], slope

    def _by_pose(self, lever: Any, by_turn: Any, pull: list[Any], by_place: Any) -> Any:
        """Slope (6, 6) of a wire's force and moment by the pose, from that by its platform point."""
        by_arm = -(lever * by_turn)
        by_both = lever * by_place * by_arm - _skew(pull) * by_arm
        return _block(by_place, by_place * by_arm, by_both, self.size, lever * by_place)

    def _pulled(self, i: int, span: Span, known: tuple[Any, Any] | None) -> tuple[list[Any], Any]:
        """Force of a wire on the platform and its slope by the platform point.

        `known`: tension and its slope, where they are known.
        """
        m = self.arb(float(self.robot.lines[i]))
        if known is None:
            stretched = m * span.length + self.offset[i]
            strain = self.strain(i, stretched)
            known = self.pull(i, strain, stretched)
        tau, _ = known
        force = [-m * tau * a for a in span.direction]
        return force, _by_place(m, *known, span)

    def at_centre(self) -> tuple[Any, list[tuple[Any, Any]]]:
        """Balance at the centre in parts: the weight's, and each wire's wrench of 1 N with its tension."""
        robot = self.robot
        centre_of_mass = _times(self.R, robot.centre_of_mass_m)
        moment = [v / self.size for v in _cross(centre_of_mass, self.weight)]
        of_weight = column([*self.weight, *moment[: robot.degrees - 3]])
        still = [self.arb(0)] * robot.degrees
        pulls = []
        for i in range(robot.legs):
            strand = self.strand(i, still)
            strain = self.strain(i, strand.length)
            tau, _ = self.pull(i, strain, strand.length)
            pulls.append((column(strand.wrench), tau))
        return of_weight, pulls

    def strand(self, i: int, y: list[Any]) -> "Strand":
        """One wire's geometry over a box of poses."""
        m = self.arb(float(self.robot.lines[i]))
        turn, by_turn = self.R, None
        if self.robot.degrees == 6:
            turn, by_turn = self._turn(y[3:])
        r, line = self._line(i, y, turn)
        span = self._span(i, line)
        length = m * span.length + self.offset[i]
        u = [m * a for a in span.direction]
        pull = [-a for a in u]
        if by_turn is None:
            return Strand(length, u, pull)
        by_turning, moment = self._turning(r, u, by_turn)
        return Strand(length, u + by_turning, pull + moment)

    def _turning(self, r: list[Any], u: list[Any], by_turn: Any) -> tuple[list[Any], list[Any]]:
        """Stretch by a turn, which is the moment (u . (s x r) = s . (r x u)), and the moment of a pull."""
        moment = _cross(r, u)
        return (row(moment) * by_turn).entries(), [-v / self.size for v in moment]

    def _line(self, i: int, y: list[Any], turn: Any) -> tuple[list[Any], list[Any]]:
        """Platform point from the reference point, and from the exit point."""
        r = _times(turn, self.robot.platform_m[i])
        exit_m = [self.arb(float(v)) for v in self.robot.exit_m[i]]
        line = [self.x[k] + y[k] + r[k] - exit_m[k] for k in range(3)]
        return r, line

    def _span(self, i: int, line: list[Any]) -> Span:
        """A line from an exit point, over its pulley if it has one (`mechanics.pulleys` has the equations)."""
        pulleys = self.robot.pulleys
        if pulleys is None or not pulleys.radius_m[i]:
            return _straight(line)
        axis = [self.arb(float(a)) for a in pulleys.axis[i]]
        return self._over_pulley(line, axis, self.arb(float(pulleys.radius_m[i])))

    def _over_pulley(self, line: list[Any], axis: list[Any], rho: Any) -> Span:
        """A line that leaves a pulley of radius `rho` which swivels about an axis."""
        size = _square(axis).sqrt()
        s = [a / size for a in axis]
        z = _dot(line, s)
        beside = [a - z * b for a, b in zip(line, s, strict=True)]
        away = _square(beside).sqrt()
        e = [a / away for a in beside]
        tangent = self._tangent(away - rho, z, rho)
        cosine, sine = tangent.cosine, tangent.sine
        u, normal = [], []
        for a, b in zip(e, s, strict=True):
            u.append(sine * a + cosine * b)
            normal.append(cosine * a - sine * b)
        across = _cross(s, e)
        bends = _bends(normal, tangent.straight, across, sine, away)
        length = rho * tangent.wrap + tangent.straight
        return Span(length, u, bends)

    def _tangent(self, h: Any, z: Any, rho: Any) -> "_RimTangent":
        """The tangent from a rim to the point ``(h, z)``, seen from the pulley's centre."""
        straight = (h * h + z * z - rho * rho).sqrt()
        size = h * h + z * z
        cosine = (z * straight - h * rho) / size
        sine = (z * rho + h * straight) / size
        wrap = self.arb.pi() / 2 - self.arb.atan2(cosine, sine)  # cut where no pulley in use is wrapped that far
        return _RimTangent(straight, cosine, sine, wrap)

    def strain(self, i: int, S: Any) -> Any:
        """Strain at a stretched length."""
        return self.law.strain(S, self.zero[i])

    def pull(self, i: int, strain: Any, S: Any) -> tuple[Any, Any]:
        """Tension and its derivative by the stretched length; the hull of taut and slack where both are possible.

        Parameters
        ----------
        i : int
            The wire.
        strain, S : ball
            Its strain and its stretched length, m.

        Returns
        -------
        tension, slope : ball
            N and N/m.
        """
        slope = self.k1[i] * self.law.by_stretched(S, self.zero[i])
        taut, slope = self._taut(strain, slope)
        return self.k1[i] * taut, slope

    def by_wire(self, i: int, S: Any, strain: Any) -> tuple[Any, Any]:
        """Derivatives of the tension by the wire's own parameters, slackness treated as in `pull`.

        Parameters
        ----------
        i : int
            The wire.
        S, strain : ball
            Its stretched length, m, and its strain.

        Returns
        -------
        by_stiffness, by_zero_length : ball
            The first is the strain, the second in N/m.
        """
        by_zero = self.k1[i] * self.law.by_zero(S, self.zero[i])
        return self._taut(strain, by_zero)

    def _taut(self, strain: Any, slope: Any) -> tuple[Any, Any]:
        """Strain and slope of a wire that cannot push; the hull of taut and slack where both are possible."""
        if strain > 0:
            return strain, slope
        none = self.arb(0)
        if strain < 0:
            return none, none
        return strain.max(none), slope.union(none)

    def _turn(self, y: list[Any]) -> tuple[Any, Any]:
        """Rotation by Cayley's numbers s = y / (2 size), and the turn's slope by y."""
        s = [v / (2 * self.size) for v in y]
        norm = 1 + _square(s)
        K = _skew(s)
        eye = identity(3)
        by = (eye + K) * (1 / (norm * self.size))
        return (eye + (K + K * K) * (2 / norm)) * self.R, by


def _straight(line: list[Any]) -> Span:
    """A line from a point."""
    length = _square(line).sqrt()
    u = [a / length for a in line]
    bends = [[((1 if j == k else 0) - u[j] * u[k]) / length for k in range(3)] for j in range(3)]
    return Span(length, u, bends)


class _RimTangent(NamedTuple):
    """Straight part of a line that leaves a rim, its direction in the pulley's plane, and the arc on the rim."""

    straight: Any
    cosine: Any
    sine: Any
    wrap: Any


def _bends(normal: list[Any], straight: Any, across: list[Any], sine: Any, away: Any) -> list[list[Any]]:
    """Curvature of a line's length by the platform point: in the pulley's plane, and as the pulley swivels."""
    out = []
    for j in range(3):
        in_plane = [normal[j] * normal[k] / straight for k in range(3)]
        swivelling = [across[j] * across[k] * sine / away for k in range(3)]
        out.append(_sum(in_plane, swivelling))
    return out


def _by_place(m: Any, tau: Any, stiff: Any, span: Span) -> Any:
    """Slope (3, 3) of a wire's force by its platform point, of so many lines."""
    from flint import arb_mat

    u, bends = span.direction, span.curvature
    out = arb_mat(3, 3)
    for j in range(3):
        for k in range(3):
            stretching = stiff * m * u[j] * u[k]
            turning = tau * bends[j][k]
            out[j, k] = -m * (stretching + turning)
    return out


def _times(turn: Any, vector: Floats) -> list[Any]:
    return (turn * column(vector.tolist())).entries()


def _sum(a: list[Any], b: list[Any]) -> list[Any]:
    return [p + q for p, q in zip(a, b, strict=True)]


def _square(v: list[Any]) -> Any:
    # not v**2: the power of a ball that holds zero is taken by logarithms and lost
    return _dot(v, v)


def _dot(a: list[Any], b: list[Any]) -> Any:
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _cross(a: list[Any], b: list[Any]) -> list[Any]:
    return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]


def _skew(v: list[Any]) -> Any:
    from flint import arb_mat

    return arb_mat([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])


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


def balls(radii: Floats) -> list[Any]:
    """Balls about zero."""
    from flint import arb

    return [arb(0, float(radius)) for radius in radii]


def ball_matrix(values: Floats) -> Any:
    from flint import arb_mat

    return arb_mat(values.tolist())


def column(values: Sequence[Any]) -> Any:
    from flint import arb_mat

    return arb_mat([[value] for value in values])


def row(values: Sequence[Any]) -> Any:
    from flint import arb_mat

    return arb_mat([list(values)])


def identity(size: int) -> Any:
    return ball_matrix(np.eye(size))


def upper_bounds(image: Any) -> Floats:
    """Numbers above the absolute values in a column of balls; infinite where a ball is."""
    out = []
    for value in image.entries():
        largest = value.abs_upper()
        out.append(np.nextafter(float(largest), np.inf) if largest.is_finite() else np.inf)
    return np.array(out)
