"""Where loops stay open: in one hold, or in one wire or two, rather than everywhere."""

import numpy as np
from scipy.special import betainc

from wirebayes.notice import Notice
from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Floats
from wirebayes.robot.self_calibration.posterior import Whole
from wirebayes.robot.self_calibration.residuals import USUAL, leverage
from wirebayes.robot.self_calibration.session import Session
from wirebayes.sentences import listed, number

# Shares of the sum of squares of all loops. A wrong column left 70 to 96 % in its wire, two columns in the place of
# each other 81 % in their two of eight wires; scatter in all lengths left at most 28 % in one of four, 41 % in two of
# eight.
_ONE, _TWO, _HOLD = 0.6, 0.75, 0.5
_WIRES, _MORE_WIRES, _HOLDS = 4, 6, 4  # with fewer, such shares mean nothing
_CHANCE = 1e-4  # that some hold of a sound session stands out as much


def most_open(found: Whole, session: Session) -> str:
    """Which hold, or which wires, have most of what is open; empty where it is everywhere.

    Parameters
    ----------
    found : Whole
        Of a search that found no robot with these joint values.
    session : Session
    """
    share = _shares(found)
    if not np.isfinite(share).all():
        return ""
    holds, wires = share.sum(1), share.sum(0)
    order = np.argsort(wires)[::-1]
    said = []
    if len(wires) >= _WIRES and wires[order[0]] > _ONE:
        said.append(f"joint value {order[0] + 1} ({100 * wires[order[0]]:.0f} % of the sum of squares)")
    elif len(wires) >= _MORE_WIRES and wires[order[:2]].sum() > _TWO:
        two = listed([str(leg + 1) for leg in sorted(order[:2])])
        said.append(f"joint values {two} ({100 * wires[order[:2]].sum():.0f} % of the sum of squares)")
    worst = int(holds.argmax())
    if len(holds) >= _HOLDS and holds[worst] > _HOLD:
        said.append(f"hold {session.numbers[worst]:g} ({100 * holds[worst]:.0f} %)")
    return f", mostly in {' and in '.join(said)}" if said else ""


def odd_hold(found: Whole, session: Session) -> list[Notice]:
    """That one hold's lengths contradict the others, whose error was estimated with it, by far more than these do.

    Parameters
    ----------
    found : Whole
        Of a search that converged.
    session : Session
    """
    if found.unknowns.errors.joint_m is not None:
        return []  # then the joint test knows
    rows = found.equations.rows["loop"]
    free = np.maximum(1.0 - leverage(found, rows), 0.0).sum(1)
    holds = _shares(found).sum(1)
    others = free.sum() - free
    with np.errstate(invalid="ignore"):
        p = np.where((free > 0) & (others > 0), betainc(0.5 * others, 0.5 * free, 1.0 - holds), 1.0)
    worst = int(p.argmin())
    open_m = found.equations.residual[worst, rows] * found.noise.joint_m / found.unknowns.robot.lines
    rms = root_mean_square(open_m)
    if not (len(p) * p[worst] < _CHANCE and rms > USUAL * found.unknowns.robot.span_m):
        return []
    leg = int(np.abs(open_m).argmax())
    text = (
        f"hold {session.numbers[worst]:g} contradicts the others: {100 * holds[worst]:.0f} % of the sum of squares of "
        f"all lengths is its own, most of it joint value {leg + 1}; correct that row or leave it out, for the error of "
        f"all joint values, {number(1e3 * found.noise.joint_m, 2)} mm, was estimated with it"
    )
    return [Notice("data", text)]


def _shares(found: Whole) -> Floats:
    """(p, w) of the sum of squares of all loops, a line each."""
    e = found.equations
    squares = (e.residual[:, e.rows["loop"]] / found.unknowns.robot.lines) ** 2
    return np.asarray(squares / squares.sum())
