"""Coordinates of k1 and B for holds at one displacement, which determine tensions, not the stiffness nor the preload.

The first hold, at displacement x, begins at the tension ``k1 (x + preload) / L0`` and has lost some of it at its first
reading, which is known: where creep follows a power of the time, much of it is over by then. So k1 lies on a curved
surface over the preload and that loss, as narrow as the setting error is small: a bent funnel, which walkers enter and
do not leave. A setting error changes the creep, too, by the power U of the tension.

Beside preload and loss, the logarithm of ``k1 (x + preload) / (L0 (first reading + loss until then))`` is straight: the
setting error with which the wire would be read as it was, as a share of its stretch. So is the log of the tension lost
at the stretch with that error.
"""

from dataclasses import dataclass

import numpy as np

from wirebayes.inference.coordinates.one_setting import is_one_displacement
from wirebayes.inference.coordinates.slack_edge import SlackEdge
from wirebayes.model.problem import Problem
from wirebayes.numeric.typing import Array


@dataclass(frozen=True)
class TensionLevel:
    """The holds of a test, all at one displacement.

    Attributes
    ----------
    k1 : int
        Its column.
    preload : int or float
        Its column, or the number at which it is fixed, mm.
    at, length : float
        Displacement of the first hold, and length of the wire, mm.
    first, begin_s, end_s : float
        The first tension that was read, N; when it was, and how long the first hold lasted, s.
    """

    k1: int
    preload: int | float
    at: float
    length: float
    first: float
    begin_s: float
    end_s: float

    def log_tension(self, theta: Array, log_k1: Array) -> Array:
        """(n,) log of the tension at the beginning, of natural parameters (n, d) but for log k1 (n,)."""
        preload = theta[:, self.preload] if isinstance(self.preload, int) else self.preload
        stretch = np.maximum(1.0 + preload / self.at, _LEAST)
        return log_k1 + np.log(self.at / self.length) + np.log(stretch)

    def log_beyond(self, theta: Array, U: Array | float) -> Array:
        """(n,) log creep by which the tension at the beginning drives more than the first one that was read.

        Parameters
        ----------
        theta : (n, d) array
            Natural parameters.
        U : (n,) array or float
            Exponent of the tension.
        """
        with np.errstate(all="ignore"):
            driving = self.log_tension(theta, np.log(theta[:, self.k1]))
        return U * (driving - np.log(self.first))

    def log_expected(self, log_lost: Array, k2: Array | float, N: Array | float) -> Array | float:
        """(n,) log of the first reading and what was lost before it, which is the tension at the beginning.

        Parameters
        ----------
        log_lost : (n,) array
            Log of the tension lost in the first hold.
        k2, N : (n,) arrays or floats
            Rate of the creep and exponent of time.
        """
        if self.begin_s == 0.0:
            return float(np.log(self.first))
        before, all_of_it = (-np.expm1(-k2 * time_s**N) for time_s in (self.begin_s, self.end_s))
        return np.logaddexp(np.log(self.first), log_lost + np.log(before / all_of_it))


def tension_level(problem: Problem, slack_edges: list[SlackEdge]) -> TensionLevel | None:
    """The coordinates for the test of a problem.

    Parameters
    ----------
    problem : Problem
        Of samples whose k1 is open, and whose preloads are open or fixed.
    slack_edges : list of SlackEdge
        Coordinates of preloads; one that depends on k1 leaves no place for these.

    Returns
    -------
    TensionLevel or None
        None unless there is one sample, all its holds at one displacement, but for rests at zero or below, and taut.
    """
    if len(problem.samples) != 1 or any(edge.threshold != 0.0 for edge in slack_edges):
        return None
    (sample,) = problem.samples
    if not is_one_displacement(sample):
        return None
    protocol = sample.protocol
    return TensionLevel(
        problem.names.index(problem.column("k1", sample)),
        problem.place("preload", sample),
        float(protocol.setting[0]),
        protocol.length_mm,
        float(sample.readings[0, 0, 0]),
        float(protocol.time_s[0, 0]),
        float(protocol.duration_s[0]),
    )


_LEAST = 1e-3  # of the stretch without a preload: with less the wire is slack, and k1 is what it is
