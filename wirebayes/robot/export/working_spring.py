"""A line as the spring that firmware takes it for: tangent to it at the tension at which the robot works."""

from dataclasses import dataclass

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import inverse
from wirebayes.sentences import short
from wirebayes.wire.fresh import FreshSample


@dataclass(frozen=True)
class WorkingSpring:
    """A line as a spring about the tension it works at.

    Attributes
    ----------
    stiffness_N : (n,) array
        Tangent stiffness, N per unit strain.
    remark : str
        At which tension, in words; empty where the stiffness is the same at all.
    fitted : bool
        False where the robot's file gives the wire's parameters, which then have no interval.
    of : str
        The wire's name, where the legs have several.
    """

    stiffness_N: Floats
    remark: str
    fitted: bool = True
    of: str = ""

    @property
    def mean_N(self) -> float:
        """Posterior mean."""
        return float(self.stiffness_N.mean())

    @property
    def band(self) -> str:
        """Its 90 % interval in words, or where it comes from."""
        if not self.fitted:
            return "as the robot's file gives it"
        low, high = np.quantile(self.stiffness_N, [0.05, 0.95])
        return f"90 % interval {low:.0f} to {high:.0f}"

    @property
    def described(self) -> str:
        """The same, with the wire's name where there are several."""
        return f"of wire {self.of}, {self.band}" if self.of else self.band


def working_spring(robot: Robot, line: WireDraws, wire: str | None = None) -> WorkingSpring:
    """Stiffness of a line at its mean tension at the home pose; a middle tested tension where none holds that pose.

    Draws that cannot carry the tension are left out, and the remark says how many.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
    wire : str, optional
        Which of the legs' wires; default: the first that is fitted.

    Raises
    ------
    InputError
        No draw of the line can carry that tension.
    """
    wire = wire or first_fitted(robot)
    wires = for_robot(robot, line)
    home = _mean_tension_at_home(robot, wire)
    if home is None:
        at_N = line.each.get(wire, line).tension_ref_N
        point = "a middle tension of the test"
    else:
        at_N = home
        point = "the mean tension of the lines at the home pose"
    stiffness = fresh_sample_of(robot, wires, wire).stiffness_N(at_N)
    good = np.isfinite(stiffness)
    fitted = wire not in robot.given
    several = len(set(robot.wire)) > 1
    of = wire if several else ""
    if not good.any():
        which = "the fitted line" if fitted and not of else f"the wire {wire}"
        raise InputError(f"{robot.name}: {which} cannot carry {short(at_N, 3)} N, so no spring constant is known")
    if wires.law == "hooke" and not wires.at("strain"):
        return WorkingSpring(stiffness, "", fitted, of)
    remark = f"The spring constant depends on the tension: it is the tangent at {short(at_N, 4)} N, {point}."
    if not good.all():
        lost = 100 * float(np.mean(~good))
        remark += f" {short(lost, 2)} % of the draws cannot carry that tension and are left out."
    return WorkingSpring(stiffness[good], remark, fitted, of)


def _mean_tension_at_home(robot: Robot, wire: str) -> float | None:
    """The mean tension of the legs that hang on a wire; None where no tensions hold the home pose."""
    x, R = robot.home_m[None], matrix(robot.home_rotation_rad)[None]
    tau = inverse.tensions(robot, x, R)[0]
    if not np.isfinite(tau).all():
        return None
    return float(tau[[name == wire for name in robot.wire]].mean())


def first_fitted(robot: Robot) -> str:
    """The first leg's wire that is fitted; the first leg's where the robot's file gives them all."""
    return next((name for name in robot.wire if name not in robot.given), robot.wire[0])


def fresh_sample_of(robot: Robot, wires: Wires, wire: str) -> FreshSample:
    """A fresh sample of a line, as long as the first leg that hangs on it.

    Parameters
    ----------
    robot : Robot
    wires : Wires
    wire : str
        The line's name.
    """
    return wires.sample(robot.wire.index(wire))
