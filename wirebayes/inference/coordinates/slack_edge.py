"""A coordinate of the preload that is wide where the first hold hardly creeps.

A power of the tension below one rises ever more steeply as the tension falls to where creep begins: to no tension, or
to a threshold of creep. A setting error there changes the creep without bounds, and beyond there is none, so the
posterior may lie against this edge, over several decades of the distance to it. From afar the coordinate is the
preload; nearer than a width it is the distance's logarithm, on either side.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class SlackEdge:
    """``preload = edge + width (log(1 + e^(u - K)) - log(1 + e^(-u - K)))``, with ``u = K + (score - at) / width``.

    K is `DECADES`, in natural logarithms; scores are in mm.

    Attributes
    ----------
    preload : int
        The column of the preload.
    at : float
        The preload with which the first hold is slack, mm; the edge, where creep has no threshold.
    width : float
        Where the coordinate bends, mm.
    stretch_mm : float
        By so much the wire is longer at a strain of one: its length.
    modified : bool
        Whether strain is relative to the stretched length (`wirebayes.wire.laws.Modified`).
    k1, threshold : int or float
        Columns, or the numbers at which stiffness and threshold tension are fixed; 0.0 without a threshold.
    """

    preload: int
    at: float
    width: float
    stretch_mm: float
    modified: bool
    k1: int | float
    threshold: int | float

    def value(self, score: Array, theta: Array) -> Array:
        """(n,) preloads, mm, of scores beside the other natural parameters (n, d)."""
        u = (score - self.at) / self.width + DECADES
        return self._edge(theta) + self.width * (np.logaddexp(0.0, u - DECADES) - np.logaddexp(0.0, -u - DECADES))

    def score(self, theta: Array) -> Array:
        """(n,) scores of natural parameters (n, d)."""
        return self.at + self.width * (self._bent(theta) - DECADES)

    def log_slope(self, theta: Array) -> Array:
        """(n,) log of the derivative of the preload by its score."""
        u = self._bent(theta)
        return np.logaddexp(-np.logaddexp(0.0, DECADES - u), -np.logaddexp(0.0, DECADES + u))

    def _edge(self, theta: Array) -> Array | float:
        if self.threshold == 0.0:
            return self.at
        k1, tension = (theta[:, x] if isinstance(x, int) else x for x in (self.k1, self.threshold))
        with np.errstate(all="ignore"):  # a wire without stiffness is of no posterior
            strain = tension / k1
            return self.at + self.stretch_mm * (strain / (1.0 - strain) if self.modified else strain)

    def _bent(self, theta: Array) -> Array:
        """u of natural parameters: e^u solves a quadratic equation, here in terms that keep their digits."""
        distance = theta[:, self.preload] - self._edge(theta)
        far = np.abs(distance) / self.width
        root = np.sqrt(np.expm1(-far) ** 2 + 4.0 * np.exp(-far - 2.0 * DECADES))
        return np.sign(distance) * (far + np.log(0.5 * (root - np.expm1(-far))) + DECADES)


def slack_edge(problem: Problem, sample: Sample) -> SlackEdge | None:
    """The coordinate for a sample's preload.

    Parameters
    ----------
    problem : Problem
    sample : Sample

    Returns
    -------
    SlackEdge or None
        None where the tension is set, where the preload is known, where there are no setting errors, and where the
        first hold is not clearly seen to be taut and to creep: then it may be slack, and the edge lies amid the
        posterior.
    """
    prior = problem.prior
    protocol = sample.protocol
    readings = sample.readings[..., 0]
    if protocol.control == "force" or problem.likelihood != "chain":
        return None
    preload = problem.place("preload", sample)
    if not isinstance(preload, int) or protocol.mask[0].sum() < 2:
        return None
    first = readings[0, protocol.mask[0]]
    largest = readings[protocol.mask].max()
    fallen = first[0] - first[-1]
    if first[0] < _CLEARLY * largest or fallen < _CLEARLY * first[0]:
        return None
    setting = problem.column("setting_sd", sample)
    is_fixed = setting in prior.fixed
    typical = float(prior.fixed[setting] if is_fixed else prior.distributions[setting].median())
    if not typical > 0.0:
        return None
    below = [column for e in sample.model.effects if (column := e.no_creep_below)]
    return SlackEdge(
        preload,
        -float(protocol.setting[0]),
        _WIDTH * typical,
        protocol.length_mm,
        sample.model.law == "modified",
        problem.place("k1", sample),
        problem.place(below[0], sample) if below else 0.0,
    )


DECADES = 7.0 * np.log(10.0)  # of widths that are told apart: with a threshold of creep the posterior spans six
_WIDTH = 4.0  # setting errors: within it their effect is far from linear
_CLEARLY = 0.05  # of the largest reading, and of the first: a slack wire shows neither tension nor creep
