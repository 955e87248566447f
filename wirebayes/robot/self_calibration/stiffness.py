"""Another stiffness of all wires, which may explain what contradicts together with another cause."""

from dataclasses import replace

import numpy as np

from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import GivenWire
from wirebayes.robot.mechanics.draws import WireDraws
from wirebayes.robot.self_calibration.equations import Holds, State
from wirebayes.robot.self_calibration.posterior import RobotPosterior
from wirebayes.robot.self_calibration.unknowns import Unknowns
from wirebayes.robot.self_calibration.unlike_wires import logarithms_of_legs


class Stiffness:
    """The stiffness k1 of all wires; its value is the change of the logarithm."""

    usual = 0.5  # of a line that was taken for another one

    def slopes(self, found: RobotPosterior) -> Floats:
        """Those by deviations of the specimens that change k1 of all wires alike, and nothing else."""
        legs = found.unknowns.robot.legs
        follows = logarithms_of_legs(found)
        alike = np.concatenate([np.full(legs, float(name == "k1")) for name in follows])
        white = np.linalg.pinv(np.vstack(list(follows.values()))) @ alike
        slope = found.equations.by_robot[:, :, found.unknowns.of_lines] @ white
        return np.asarray(slope[:, :, None])

    def changed(self, found: RobotPosterior, holds: Holds, by: Floats) -> tuple[Unknowns, Holds, State]:
        """What is fitted with another value, and from where: `one_cause.Cause.changed`.

        Parameters
        ----------
        found : RobotPosterior
        holds : Holds
        by : (1,) array
            Change of the logarithm of k1.
        """
        unknowns = found.unknowns
        prior, robot = unknowns.prior, unknowns.robot
        times = float(np.exp(by[0]))
        others = {name: _stiffer(line, times) for name, line in prior.line.others.items()}
        line = replace(_stiffer(prior.line, times), others=others)
        given = {name: _stiffer_given(wire, times) for name, wire in robot.given.items()}
        stiffer = replace(unknowns, robot=replace(robot, given=given), prior=replace(prior, line=line))
        return stiffer, holds, found.state


def _stiffer(line: WireDraws, times: float) -> WireDraws:
    return replace(line, parameters={**line.parameters, "k1": times * line.parameters["k1"]})


def _stiffer_given(wire: GivenWire, times: float) -> GivenWire:
    return replace(wire, parameters={**wire.parameters, "k1": times * wire.parameters["k1"]})
