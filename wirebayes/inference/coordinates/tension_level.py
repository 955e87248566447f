"""Coordinates of k1 and B for a test of one hold, which determines tensions and neither the stiffness nor the preload.

A hold at displacement x begins at the tension ``k1 (x + preload) / L0`` and has lost some of it at its last reading,
which is known. So k1 lies on a curved surface over the preload and the loss, as narrow as the setting error is small:
a bent funnel, which walkers enter and do not leave. The loss is that of the tension at the beginning, before the first
reading: where creep follows a power of the time, much of it is over by then.

Beside preload and loss, the logarithm of ``k1 (x + preload) / (last reading + loss)`` is straight.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.inference.coordinates.slack_edge import SlackEdge
from wirebayes.model.problem import Problem
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class TensionLevel:
    """The only hold of a test.

    Attributes
    ----------
    k1, preload : int
        Columns.
    at, length : float
        Displacement of the hold, and length of the wire, mm.
    log_first, log_last : float
        Logarithms of the first and the last tension that was read, N.
    """

    k1: int
    preload: int
    at: float
    length: float
    log_first: float
    log_last: float

    def stretch(self, theta: Array) -> Array:
        """(n,) log of the stretch over that without a preload, of natural parameters (n, d)."""
        return np.asarray(np.log(np.maximum(1.0 + theta[:, self.preload] / self.at, _LEAST)))

    def driven(self, theta: Array) -> Array:
        """(n,) log of the tension at the beginning over the first one that was read."""
        with np.errstate(all="ignore"):
            tension = np.log(theta[:, self.k1]) + np.log(self.at / self.length) + self.stretch(theta)
        return np.asarray(tension - self.log_first)


def tension_level(problem: Problem, slack_edges: list[SlackEdge]) -> TensionLevel | None:
    """The coordinates for the test of a problem.

    Parameters
    ----------
    problem : Problem
    slack_edges : list of SlackEdge
        Coordinates of preloads; one that depends on k1 leaves no place for these.

    Returns
    -------
    TensionLevel or None
        None unless there is one test, of one hold that ends taut, in which k1 and the preload are both open.
    """
    if len(problem.samples) != 1 or problem.likelihood != "chain" or any(s.threshold != 0.0 for s in slack_edges):
        return None
    (sample,) = problem.samples
    protocol = sample.protocol
    if protocol.control == "force" or len(protocol.setting) != 1 or protocol.setting[0] <= 0.0:
        return None
    k1, preload = problem.column("k1", sample), problem.column("preload", sample)
    read = sample.readings[..., 0][protocol.mask]
    if k1 not in problem.names or preload not in problem.names or read[0] <= 0.0 or read[-1] <= 0.0:
        return None
    columns = problem.names.index(k1), problem.names.index(preload)
    first, last = np.log(read[[0, -1]])
    return TensionLevel(*columns, float(protocol.setting[0]), protocol.length_mm, float(first), float(last))


_LEAST = 1e-3  # of the stretch without a preload: with less the wire is slack, and k1 is what it is
