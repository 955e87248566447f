"""The paper's identification: least squares from many starts, in every interpretation of its model.

Least squares weights all readings equally and has neither priors nor setting errors; it is here to be compared with the
published parameters, and with the posterior.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.optimize import least_squares

from wirebayes.io.experiment import Experiment
from wirebayes.model.build import default_prior
from wirebayes.model.sample import MATERIAL
from wirebayes.model.scales import scales_of
from wirebayes.model.single_holds import hold_courses
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Array, Bools, Function
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import simulate

_WIDE = 100_000  # the search stays between the ends of so many prior draws: along a ridge it would never end
_LEAST_STIFFNESS = 10.0  # times the largest tension: a thin line does not stretch by a tenth
_DRAWS, _STARTS = 2000, 6
_STEP = 1e-5  # of coordinates of order one: central differences are then exact to some 1e-10


VARIANTS = (
    ModelSpec(likelihood="hold"),
    ModelSpec(likelihood="hold", law="modified"),
    ModelSpec(),
    ModelSpec(law="modified"),
    ModelSpec(history="additive"),
    ModelSpec(history="additive", law="modified"),
)  # readings of the paper's model


def adjusted(variant: ModelSpec) -> tuple[str, ...]:
    """Names of what is adjusted: hold by hold the first reading fixes the stretched length, a chain has a preload."""
    return MATERIAL if variant.likelihood == "hold" else (*MATERIAL, "preload")


@dataclass(frozen=True)
class LeastSquaresFit:
    """Parameters of least squares.

    Attributes
    ----------
    parameters : dict of name to float
    rms_N : float
        Over the readings they were adjusted to.
    not_held_back : tuple of str
        Parameters at the edge of the search, or with an edge within their standard error: the readings do not hold them
        back, and along such a ridge the search stops anywhere.
    """

    parameters: dict[str, float]
    rms_N: float
    not_held_back: tuple[str, ...] = ()


def tension_residuals(experiment: Experiment, theta: Mapping[str, Array], variant: ModelSpec) -> Array:
    """Measured minus predicted tension.

    Parameters
    ----------
    theta : mapping of name to (n,) array
        Without ``preload`` hold by hold.

    Returns
    -------
    (H, R, n) array, N
        NaN where nothing is predicted: padding, and hold by hold the first reading of each hold.
    """
    protocol = experiment.protocol()
    measured = experiment.tension()[..., None]
    model = Model(variant.law, variant.history)
    if variant.likelihood != "hold":
        predicted = simulate(protocol, theta, model)
    else:
        n = len(theta["k1"])
        predicted = np.full((*protocol.mask.shape, n), np.nan)
        courses = hold_courses(protocol, dict(theta), model, measured[:, 0])
        for j, course in enumerate(courses):
            if course is not None:
                tension, _, valid = course
                predicted[j, 1:] = np.where(valid, tension[1:], np.nan)
    read = protocol.mask[..., None]
    return np.where(read, measured - predicted, np.nan)


def rms(residuals_N: Array) -> float:
    """Root mean square of what was predicted, N; NaN when nothing was."""
    values = residuals_N[np.isfinite(residuals_N)]
    return root_mean_square(values) if values.size else float("nan")


def at(parameters: Mapping[str, float]) -> dict[str, Array]:
    """One parameter set as arrays of one row."""
    return {name: np.array([value]) for name, value in parameters.items()}


def identify(
    experiment: Experiment, variant: ModelSpec, rng: np.random.Generator, known: Mapping[str, float] | None = None
) -> LeastSquaresFit:
    """Least squares over all readings of an experiment.

    Parameters
    ----------
    rng : numpy Generator
        For the starts: the best of many draws of the prior.
    known : mapping of name to float, optional
        Parameters that are not adjusted, such as published ones of which only the preload is missing.
    """
    known = dict(known or {})
    names = [name for name in adjusted(variant) if name not in known]
    if not names:
        only = tension_residuals(experiment, at(known), variant)
        return LeastSquaresFit(known, rms(only))
    logarithmic = np.array([name != "preload" for name in names])
    search = _Search(experiment, variant, known, names, logarithmic)
    prior = default_prior(experiment.length_mm, scales_of([experiment]), {})
    columns = [prior.names.index(name) for name in names]

    def drawn(n: int) -> Array:
        return prior.rvs(n, rng)[:, columns]

    low, high = _bounds(search, drawn(_WIDE))
    points = _logged(drawn(_DRAWS), logarithmic)
    end, cost = _best_descent(search.misfit, points, low, high)
    found = search.natural(end[None])
    ordered = {}
    for name in adjusted(variant):
        ordered[name] = float(found[name][0])
    error = cost * _per_unit_misfit(search.misfit, end)
    at_an_edge = _at_an_edge(names, end, low, high, error)
    return LeastSquaresFit(ordered, cost, at_an_edge)


def _at_an_edge(names: Sequence[str], end: Array, low: Array, high: Array, error: Array) -> tuple[str, ...]:
    """The parameters with an edge of the search within their standard error, or next to them."""
    loose = np.maximum(0.01 * (high - low), error)
    distance = np.minimum(end - low, high - end)
    return tuple(name for name, is_at_edge in zip(names, distance < loose, strict=True) if is_at_edge)


@dataclass(frozen=True)
class _Search:
    """Coordinates in which least squares are sought: `names`, of which the `logarithmic` ones by their logarithm."""

    experiment: Experiment
    variant: ModelSpec
    known: Mapping[str, float]
    names: Sequence[str]
    logarithmic: Bools

    def natural(self, z: Array) -> dict[str, Array]:
        """(n, d) search coordinates as parameters, each (n,)."""
        logarithms = np.where(self.logarithmic, z, 0.0)
        columns = np.where(self.logarithmic, np.exp(logarithms), z).T
        rows = dict(zip(self.names, np.ascontiguousarray(columns), strict=True))
        return rows | {name: np.full(len(z), value) for name, value in self.known.items()}

    def misfit(self, z: Array) -> Array:
        """(m, n) residuals of (n, d) points; a reading that cannot be predicted counts in full."""
        predicted = _predicted(self.experiment, self.variant)
        values = tension_residuals(self.experiment, self.natural(z), self.variant)[predicted]
        measured = self.experiment.tension()[predicted]
        return np.where(np.isfinite(values), values, measured[:, None])


def _predicted(experiment: Experiment, variant: ModelSpec) -> Bools:
    """Which readings (H, R) are predicted: hold by hold all but the first of each."""
    predicted = experiment.protocol().mask.copy()
    if variant.likelihood == "hold":
        predicted[:, 0] = False
    return predicted


def _best_descent(misfit: Function, points: Array, low: Array, high: Array) -> tuple[Array, float]:
    """Where the best descent ends, of those from the best of many points, and its rms misfit."""
    with np.errstate(all="ignore"):
        starts = np.clip(points, low + 1e-9, high - 1e-9)
        squares = (misfit(starts) ** 2).sum(axis=0)
        best = starts[np.argsort(squares, kind="stable")[:_STARTS]]
        ends = [_descend(misfit, start, low, high) for start in best]
    costs = np.array([np.sqrt(np.mean(misfit(end[None]) ** 2)) for end in ends])
    return ends[int(np.argmin(costs))], float(costs.min())


def leading(experiment: Experiment, holds: int) -> int:
    """Number of holds, unrecorded ones included, up to the last of the first `holds` recorded ones."""
    return len(experiment.train(holds).holds)


def _logged(values: Array, logarithmic: Bools) -> Array:
    positive = np.where(logarithmic, values, 1.0)
    return np.where(logarithmic, np.log(positive), values)


def _bounds(search: _Search, wide: Array) -> tuple[Array, Array]:
    """(d,) least and largest search coordinates: where many draws (n, d) of the prior end, and a thin line's k1."""
    low = _logged(wide.min(axis=0), search.logarithmic)
    high = _logged(wide.max(axis=0), search.logarithmic)
    if "k1" in search.names:
        largest_N = search.experiment.tension().max()
        low[search.names.index("k1")] = np.log(_LEAST_STIFFNESS * largest_N)
    return low, high


def _jacobian(misfit: Function, z: Array) -> Array:
    """(m, d) derivatives of the residuals at a point (d,), by central differences in one batch."""
    moves = _STEP * np.concatenate([np.eye(len(z)), -np.eye(len(z))])
    values = misfit(z + moves)
    return (values[:, : len(z)] - values[:, len(z) :]) / (2.0 * _STEP)


def _per_unit_misfit(misfit: Function, z: Array) -> Array:
    """(d,) standard errors at a point (d,) if residuals had a standard deviation of one."""
    _, singular, directions = np.linalg.svd(_jacobian(misfit, z), full_matrices=False)
    scaled = directions / np.maximum(singular, 1e-12)[:, None]
    return np.sqrt((scaled**2).sum(axis=0))


def _descend(misfit: Function, start: Array, low: Array, high: Array) -> Array:
    """One least-squares descent."""

    def at_point(z: Array) -> Array:
        return misfit(z[None])[:, 0]

    jacobian = partial(_jacobian, misfit)
    found = least_squares(at_point, start, jac=jacobian, bounds=(low, high), x_scale="jac", max_nfev=300)
    return found.x
