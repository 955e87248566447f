"""A guaranteed box for the pose while stiffness and lengths vary, each wire on its own or several together.

The pose depends on the parameters almost linearly, so Krawczyk's operator is applied only to the remainder of that
linear map: tensions then stay apart from slackness where a plain box of poses and lengths would mix up all of them.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import vector
from wirebayes.robot.proof.ball_arithmetic import Balance
from wirebayes.typing import Floats
from wirebayes.wire.laws import ElasticLaw

_UP = 1.0 + 1e-12  # more than the few roundings of a sum


@dataclass(frozen=True)
class Reach:
    """How far the pose can be.

    Attributes
    ----------
    proved : bool
        For every choice of the parameters an equilibrium lies within `radius_m` of the centre, and it is the only one
        within `beside_m` of the pose that the linear answer predicts.
    centre_m, rotation : (3,), (3, 3) arrays
    radius_m, beside_m : (6 or 3,) arrays
        Half widths: displacements, then turns times the platform's size. NaN when not proved.
    line_m : (6 or 3, q) array
        The linear answer to each ``p``.
    """

    proved: bool
    centre_m: Floats
    rotation: Floats
    radius_m: Floats
    beside_m: Floats
    line_m: Floats

    def holds(self, position_m: Floats, rotation: Floats, p: Floats, size_m: float, slack_m: Floats | float) -> bool:
        """Whether a pose is the equilibrium that was proved for some parameters.

        Parameters
        ----------
        position_m : (3,) array
        rotation : (3, 3) array
        p : array
            The parameters, between -1 and 1 in their ranges.
        size_m : float
            By which the turn is multiplied to make metres.
        slack_m : float or array
            How well the pose is known.
        """
        turn = vector(rotation @ self.rotation.T)
        angle = float(np.linalg.norm(turn))
        cayley = turn * (2 * np.tan(0.5 * angle) / angle) if angle > 0 else turn
        here = np.concatenate([position_m - self.centre_m, size_m * cayley])[: len(self.beside_m)]
        return self.proved and bool(np.all(np.abs(here - self.line_m @ p) + slack_m <= self.beside_m))


def apart(half_k1_N: Floats, half_zero_m: Floats) -> tuple[Floats, Floats]:
    """Generators for wires that vary each on its own: half widths ``(w,)`` of stiffness and of length."""
    none = np.zeros((len(half_k1_N), len(half_k1_N)))
    return np.hstack([np.diag(half_k1_N), none]), np.hstack([none, np.diag(half_zero_m)])


def reach(
    robot: Robot,
    law: ElasticLaw,
    k1_N: Floats,
    zero_m: Floats,
    generators: tuple[Floats, Floats],
    offset_m: Floats,
    position_m: Floats,
    rotation: Floats,
) -> Reach:
    """Enclose the pose for all parameters ``k1 + G p``, ``zero + H p`` with every ``p`` between -1 and 1.

    Parameters
    ----------
    robot : Robot
    law : {"hooke", "modified"}
    k1_N, zero_m, offset_m : (w,) arrays
        In the middle.
    generators : (w, q), (w, q) arrays
        G (N) and H (m); from `apart`, or one column for wires that change together.
    position_m, rotation : (3,), (3, 3) arrays
        Approximate solution for the middle.

    Raises
    ------
    ImportError
        python-flint is not installed.
    """
    d = robot.degrees
    nothing = Reach(False, position_m, rotation, np.full(d, np.nan), np.full(d, np.nan), np.full((d, 1), np.nan))
    k1_bounds, zero_bounds = _bounds(k1_N, generators[0]), _bounds(zero_m, generators[1])
    if min(k1_bounds[0].min(), zero_bounds[0].min()) <= 0:
        return nothing
    middle = Balance(robot, law, (k1_N, k1_N), (zero_m, zero_m), offset_m, position_m, rotation)
    wide = Balance(robot, law, k1_bounds, zero_bounds, offset_m, position_m, rotation)
    try:
        C = np.asarray(np.linalg.inv(middle.middle_slope()), np.float64)
    except np.linalg.LinAlgError:
        return nothing
    Y = _linear_answer(middle, C, generators)
    along = np.abs(Y).sum(1) * _UP
    beside = np.full(d, 1e-10 * robot.span_m) + 1e-3 * along
    for _ in range(30):
        image = _image(middle, wide, C, Y, generators, along, beside)
        if np.all(image < beside):
            return Reach(True, position_m, rotation, (along + beside) * _UP, beside, Y)
        beside = 1.2 * image + 1e-13 * robot.span_m
        if not np.all(beside < robot.span_m):
            break
    return nothing


def _bounds(middle: Floats, generators: Floats) -> tuple[Floats, Floats]:
    half = np.abs(generators).sum(1) * _UP
    return np.nextafter(middle - half, -np.inf), np.nextafter(middle + half, np.inf)


def _linear_answer(middle: Balance, C: Floats, generators: tuple[Floats, Floats]) -> Floats:
    """Approximate change of the pose by each parameter, (d, q)."""
    legs, d = len(generators[0]), len(C)
    still = [middle.arb(0)] * d
    out = np.zeros((d, generators[0].shape[1]))
    for i in range(legs):
        strand = middle.strand(i, still)
        by_k1, by_zero = (float(v.mid()) for v in middle.by_wire(i, strand.length, middle.strain(i, strand.length)))
        push = np.array([float(v.mid()) for v in strand.wrench])
        out -= np.outer(C @ push, by_k1 * generators[0][i] + by_zero * generators[1][i])
    return out


def _image(
    middle: Balance,
    wide: Balance,
    C: Floats,
    Y: Floats,
    generators: tuple[Floats, Floats],
    along: Floats,
    beside: Floats,
) -> Floats:
    """Largest distance of Krawczyk's image from the linear answer, (d,)."""
    import flint

    arb, d, q = flint.arb, len(C), Y.shape[1]
    any_ = arb(0, 1)
    box = [arb(0, float(r)) for r in (along + beside) * _UP]
    rest = [arb(0, float(r)) for r in beside]
    lines = flint.arb_mat(Y.tolist())
    pulls, pushes, by_parameter = [], [], []
    for i in range(wide.robot.legs):
        strand = wide.strand(i, box)
        # the strain by the mean value theorem in pose and parameters at once, so that what cancels does
        stretch = [sum((strand.slope[k] * lines[k, j] for k in range(d)), arb(0)) for j in range(q)]
        by_strain, by_own = wide.strain_slopes(i, strand.length)
        strain = middle.strain(i, middle.strand(i, [arb(0)] * d).length)
        for j in range(q):
            strain += (by_strain * stretch[j] + by_own * arb(float(generators[1][i, j]))) * any_
        strain += by_strain * sum((a * b for a, b in zip(strand.slope, rest, strict=True)), arb(0))
        pulls.append(wide.pull(i, strain, strand.length))
        by_k1, by_zero = wide.by_wire(i, strand.length, strain)
        pushes.append(flint.arb_mat([[v] for v in strand.wrench]))
        by_parameter.append((by_k1, by_zero))
    _, slope = wide.evaluate(box, pulls)
    precondition = flint.arb_mat(C.tolist())
    turned = precondition * slope
    eye = flint.arb_mat([[int(i == j) for j in range(d)] for i in range(d)])
    weight, forces = middle.at_centre()
    image = (eye - turned) * flint.arb_mat([[r] for r in rest]) - precondition * weight
    for wrench, tau in forces:
        image -= (precondition * wrench) * tau
    change = turned * lines
    for push, (by_k1, by_zero), G, H in zip(pushes, by_parameter, *generators, strict=True):
        moved = precondition * push
        pulled = [by_k1 * arb(float(g)) + by_zero * arb(float(h)) for g, h in zip(G, H, strict=True)]
        change += moved * flint.arb_mat([pulled])
    image -= change * flint.arb_mat([[any_] for _ in range(q)])
    out = [image[k, 0].abs_upper() for k in range(d)]
    return np.array([np.nextafter(float(v), np.inf) if v.is_finite() else np.inf for v in out])
