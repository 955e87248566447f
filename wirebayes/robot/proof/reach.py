"""A guaranteed box for the pose while stiffness and lengths vary, each wire on its own or several together.

The pose depends on the parameters almost linearly, so Krawczyk's operator is applied only to the remainder of that
linear map: tensions then stay apart from slackness where a plain box of poses and lengths would mix up all of them.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import vector
from wirebayes.robot.proof.ball_arithmetic import (
    Balance,
    Strand,
    ball_matrix,
    balls,
    column,
    identity,
    row,
    upper_bounds,
)
from wirebayes.robot.proof.krawczyk import box_around_image, image_of_centre, preconditioner
from wirebayes.wire.laws import ElasticLaw

Generators = tuple[Floats, Floats]  # by how much each parameter varies stiffness and zero-tension length, (w, q) each
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
        The linear answer to each ``p``. NaN when not proved.
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
        if not self.proved:
            return False
        turn = vector(rotation @ self.rotation.T)
        angle = float(np.linalg.norm(turn))
        if angle > 0:
            turn = turn * (2 * np.tan(0.5 * angle) / angle)  # Cayley's
        here = np.concatenate([position_m - self.centre_m, size_m * turn])
        off = np.abs(here[: len(self.beside_m)] - self.line_m @ p)
        return bool(np.all(off + slack_m <= self.beside_m))


def each_on_its_own(half_k1_N: Floats, half_zero_m: Floats) -> Generators:
    """Generators for wires that vary each on its own: half widths ``(w,)`` of stiffness and of length."""
    none = np.zeros((len(half_k1_N), len(half_k1_N)))
    return np.hstack([np.diag(half_k1_N), none]), np.hstack([none, np.diag(half_zero_m)])


def reach(
    robot: Robot,
    law: ElasticLaw,
    k1_N: Floats,
    zero_m: Floats,
    generators: Generators,
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
        G (N) and H (m); from `each_on_its_own`, or one column for wires that change together.
    position_m, rotation : (3,), (3, 3) arrays
        Approximate solution for the middle.

    Raises
    ------
    ImportError
        python-flint is not installed.
    """
    d = robot.degrees
    by_k1, by_zero = generators
    unknown = np.full(d, np.nan)
    unknown_line = np.full((d, by_k1.shape[1]), np.nan)
    nothing = Reach(False, position_m, rotation, unknown, unknown, unknown_line)
    k1_bounds = _bounds(k1_N, by_k1)
    zero_bounds = _bounds(zero_m, by_zero)
    if min(k1_bounds[0].min(), zero_bounds[0].min()) <= 0:
        return nothing
    middle = Balance(robot, law, (k1_N, k1_N), (zero_m, zero_m), offset_m, position_m, rotation)
    C = preconditioner(middle)
    if C is None:
        return nothing
    wide = Balance(robot, law, k1_bounds, zero_bounds, offset_m, position_m, rotation)
    line = _linear_answer(middle, C, generators)
    along = np.abs(line).sum(1) * _UP
    image = partial(_image, middle, wide, C, line, generators, along)
    beside = box_around_image(image, d, robot.span_m)
    if beside is None:
        return nothing
    radius = (along + beside) * _UP
    return Reach(True, position_m, rotation, radius, beside, line)


def _bounds(middle: Floats, generators: Floats) -> tuple[Floats, Floats]:
    half = np.abs(generators).sum(1) * _UP
    return np.nextafter(middle - half, -np.inf), np.nextafter(middle + half, np.inf)


def _linear_answer(middle: Balance, C: Floats, generators: Generators) -> Floats:
    """Approximate change of the pose by each parameter, (d, q)."""
    d = len(C)
    still = [middle.arb(0)] * d
    of_k1, of_zero = generators
    out = np.zeros((d, of_k1.shape[1]))
    for i, (by_k1, by_zero) in enumerate(zip(of_k1, of_zero, strict=True)):
        strand = middle.strand(i, still)
        strain = middle.strain(i, strand.length)
        slopes = middle.by_wire(i, strand.length, strain)
        slope_k1, slope_zero = (float(slope.mid()) for slope in slopes)
        push = np.array([float(force.mid()) for force in strand.wrench])
        pull = slope_k1 * by_k1 + slope_zero * by_zero
        out -= np.outer(C @ push, pull)
    return out


class _Box(NamedTuple):
    """Poses around the commanded one, in balls: all of them, and what is left of them beside the linear answer."""

    whole: list[Any]
    beside: list[Any]
    line: Any  # (d, q), the linear answer to each parameter


class _WireInBox(NamedTuple):
    """One wire for all poses of a box and all parameters."""

    pull: tuple[Any, Any]  # tension, N, and its slope by the stretched length, N/m
    wrench: Any  # (d, 1), of 1 N
    by_parameter: list[Any]  # the tension by each parameter, N


def _image(
    middle: Balance,
    wide: Balance,
    C: Floats,
    Y: Floats,
    generators: Generators,
    along: Floats,
    beside: Floats,
) -> Floats:
    """Largest distance of Krawczyk's image from the linear answer, (d,)."""
    whole = balls((along + beside) * _UP)
    box = _Box(whole, balls(beside), ball_matrix(Y))
    wires = []
    for i, (G, H) in enumerate(zip(*generators, strict=True)):
        wires.append(_wire_in_box(middle, wide, i, box, G, H))
    _, slope = wide.evaluate(box.whole, [wire.pull for wire in wires])
    precondition = ball_matrix(C)
    turned = precondition * slope
    remainder = (identity(len(C)) - turned) * column(box.beside)
    by_parameters = _by_parameters(precondition, turned * box.line, wires)
    image = remainder + image_of_centre(middle, precondition) - by_parameters
    return upper_bounds(image)


def _by_parameters(precondition: Any, change: Any, wires: list[_WireInBox]) -> Any:
    """(d, 1) what all parameters change beside the linear answer, which the poses change by (d, q)."""
    for wire in wires:
        change += (precondition * wire.wrench) * row(wire.by_parameter)
    return change * column(balls(np.ones(change.ncols())))


def _wire_in_box(middle: Balance, wide: Balance, i: int, box: _Box, G: Floats, H: Floats) -> _WireInBox:
    """Wire `i` over the box, G (q,) and H (q,) its own rows of the generators."""
    strand = wide.strand(i, box.whole)
    strain = _strain(middle, wide, i, strand, box, H)
    by_k1, by_zero = wide.by_wire(i, strand.length, strain)
    by_parameter = []
    for g, h in zip(G, H, strict=True):
        by_parameter.append(by_k1 * wide.arb(float(g)) + by_zero * wide.arb(float(h)))
    return _WireInBox(wide.pull(i, strain, strand.length), column(strand.wrench), by_parameter)


def _strain(middle: Balance, wide: Balance, i: int, strand: Strand, box: _Box, H: Floats) -> Any:
    """Strain of wire `i`, by the mean value theorem in pose and parameters at once, so that what cancels does."""
    arb = wide.arb
    by_strain = wide.law.by_stretched(strand.length, wide.zero[i])
    by_own = wide.law.by_zero(strand.length, wide.zero[i])
    still = [arb(0)] * len(box.whole)
    strain = middle.strain(i, middle.strand(i, still).length)
    rows = range(len(strand.slope))
    for j, h in enumerate(H):
        along = [box.line[k, j] for k in rows]
        stretch = _sum_of_products(strand.slope, along, arb)
        change = by_strain * stretch + by_own * arb(float(h))
        strain += change * arb(0, 1)
    beside = _sum_of_products(strand.slope, box.beside, arb)
    return strain + by_strain * beside


def _sum_of_products(a: list[Any], b: list[Any], arb: Any) -> Any:
    total = arb(0)
    for x, y in zip(a, b, strict=True):
        total = total + x * y
    return total
