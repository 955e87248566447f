"""The evidence of a smooth remainder, with the parameters refitted beside it.

A remainder takes from the parameters what they had bent themselves to explain, so that they move; by the fit without
it its evidence is off by some nats. Names are refitted, and compete with it.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wirebayes.discovery import smooth_reference
from wirebayes.discovery.linear_scan import expand
from wirebayes.discovery.noise_integral import RATIOS, SIZES, Expansion, evidences
from wirebayes.discovery.tangent import moving_columns, residuals, whitened
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.log_sum import log_sum, or_impossible
from wirebayes.numeric.typing import Array

_MODES = 2  # of the fit without a remainder, from which the parameters move: as many as names begin from
_STEPS = 5  # Gauss-Newton steps: three are usually enough
_LENGTHS = np.array([0.0, 0.05, 0.2, 0.5, 1.0])  # of a step: along a whole one the model may bend away
_SETTLED = 0.02  # nats: a step that gains less is the last, where the noise does not change more either


Reference = Sequence[Sequence[Array]]  # functions (H, R, q) of each process, a list a sample


def reference_of(block: LaplaceFit) -> Reference:
    """The processes that a remainder of the block may follow; they depend on its protocols alone."""
    return [smooth_reference.family(sample.protocol) for sample in block.target.problem.samples]


def remainder_evidence(block: LaplaceFit, reference: Reference) -> float:
    """Log Bayes factor of a smooth remainder against the block without it.

    Parameters
    ----------
    block : LaplaceFit
    reference : sequence of lists of arrays
        See `reference_of`.

    Returns
    -------
    float
        The mean over processes and over their sizes.
    """
    fit = expand(block.target, block.z, [], reference=reference)
    plain, beside = evidences(fit)
    without = float(log_sum(plain, axis=1)[0])
    if not np.isfinite(without):
        return 0.0
    at_best_mode = _Start(block.z, fit, beside)
    starts = [at_best_mode, *_at_other_modes(block, reference)]
    refitted = [_refitted_evidence(block.target, start, at_best_mode, reference) for start in starts]
    values = np.array([_mean(beside), *refitted])
    finite = values[np.isfinite(values)]
    return float(finite.max(initial=-np.inf)) - without


class _Start(NamedTuple):
    """A mode (1, d) of the fit without a remainder, the expansion there, and the evidence of remainders by it."""

    z: Array
    expansion: Expansion
    beside: Array


def _refitted_evidence(target: LogPosterior, start: _Start, best: _Start, reference: Reference) -> float:
    """Log evidence of a remainder with the parameters refitted from a mode, on the scale of that at the best mode."""
    which = _most_probable(start.beside)
    z, moved = _refitted(target, start.z, start.expansion, which, reference)
    _, beside = evidences(moved)
    at_z, with_noise_of_fit = _priors(target, z, best.z)
    tops = _top_of_prior(moved) - at_z + with_noise_of_fit - _top_of_prior(best.expansion)
    units = _log_units(target, z) - _log_units(target, best.z)
    return float(_mean(beside) + tops - units)


def _at_other_modes(block: LaplaceFit, reference: Reference) -> list[_Start]:
    """Further modes of the fit."""
    out = []
    for mode in block.modes.z[1:_MODES]:
        z = mode[None]
        there = expand(block.target, z, [], reference=reference)
        _, beside = evidences(there)
        out.append(_Start(z, there, beside))
    return out


def _priors(target: LogPosterior, z: Array, best: Array) -> Array:
    """Log prior at a point, and at the same point with the noise of the best fit.

    The scale of the noise is integrated out: only the prior of the other parameters counts.
    """
    noise = _noise_columns(target)
    with_noise_of_fit = z.copy()
    with_noise_of_fit[:, noise] = best[:, noise]
    return residuals(target, np.concatenate([z, with_noise_of_fit]))[1]


def _noise_columns(target: LogPosterior) -> list[int]:
    moving = moving_columns(target.problem)
    return [i for i in range(len(target.problem.names)) if i not in moving]


def _log_units(target: LogPosterior, z: Array) -> float:
    """Logarithm of the volume of all readings' errors, in which an expansion measures residuals."""
    problem = target.problem
    theta = target.coordinates.to_natural(z)
    total = 0.0
    for sample in problem.samples:
        variance = sample.variance(problem.parameters(theta, sample))
        total += 0.5 * float(np.log(variance[0])) * int(sample.protocol.mask.sum())
    return total


def _mean(beside: Array) -> float:
    """Over processes and sizes, noise ratios summed, of the only row."""
    return float(log_sum(beside[0].ravel())) - float(np.log(beside.shape[2]))


def _top_of_prior(x: Expansion) -> float:
    """Log density of the prior at its own best, as a parabola sees it from the expansion's point."""
    return float(x.prior[0] + 0.5 * x.prior_square[0])


def _refitted(
    target: LogPosterior, z: Array, x: Expansion, which: tuple[float, int, float], reference: Reference
) -> tuple[Array, Expansion]:
    """Parameters (1, d) at their best beside one remainder (see `_most_probable`), and the expansion there.

    The noise is what is left beside it: by the noise of the fit, the prior would count too much against the readings.
    """
    for _ in range(_STEPS):
        remainder = _Remainder.of(x, *which)
        along, noise = remainder.step(x)
        if not np.isfinite([*along, noise]).all():  # the model has no tangent here
            break
        tried = _along(target, z, along)
        height = remainder.height(x, *residuals(target, tried))
        if not np.isfinite(height[0]):
            break
        best = int(np.argmax(height))
        z = _with_noise(target, tried[best : best + 1], noise)
        x = expand(target, z, [], reference=reference)
        gain = float(height[best] - height[0])
        if gain < _SETTLED and abs(np.log(noise)) < _SETTLED:
            break
    return z, x


def _along(target: LogPosterior, z: Array, step: Array) -> Array:
    """Points at several shares of a step (p,) of the parameters that move the mean, the start (1, d) first."""
    tried = np.repeat(z, len(_LENGTHS), axis=0)
    tried[:, moving_columns(target.problem)] += _LENGTHS[:, None] * step
    return tried


def _with_noise(target: LogPosterior, z: Array, factor: float) -> Array:
    """Points (1, d) with all noise multiplied by a factor."""
    theta = target.coordinates.to_natural(z).copy()
    theta[:, _noise_columns(target)] *= factor
    return target.coordinates.to_sampled(theta)


def _most_probable(beside: Array) -> tuple[float, int, float]:
    """Noise ratio, process and size of the remainder that suits the readings best, by the evidence of each."""
    at, which = np.unravel_index(int(np.argmax(beside[0])), beside[0].shape)
    process, size = divmod(int(which), len(SIZES))
    return float(RATIOS[at]), process, float(SIZES[size])


@dataclass(frozen=True)
class _Remainder:
    """A process of one size at one noise ratio.

    Attributes
    ----------
    functions : (N, q) array
        In the metric of the noise; independent coefficients of unit variance.
    ratio : float
    """

    functions: Array
    ratio: float

    @staticmethod
    def of(x: Expansion, ratio: float, process: int, size: float) -> "_Remainder":
        """One process of one size.

        Parameters
        ----------
        x : Expansion
        ratio : float
            Of setting to sensor error, squared.
        process : int
        size : float
            δ of its part that the parameters leave.
        """
        first = sum(x.processes[:process])
        last = first + x.processes[process]
        functions = whitened(x, x.flexible[0][:, first:last], ratio)
        parameters = whitened(x, x.parameters[0], ratio)
        free = functions - _taken(parameters, functions, x.prior_precision[0])
        square = float((functions * free).sum())
        share = size**2 / max(square, 1e-300)
        return _Remainder(np.sqrt(share) * functions, ratio)

    def step(self, x: Expansion) -> tuple[Array, float]:
        """(p,) Gauss-Newton step of the parameters that move the mean, and the noise left, in units of the fit's."""
        parameters = whitened(x, x.parameters[0], self.ratio)
        residual = whitened(x, x.residual[0][:, None], self.ratio)
        left = self._left(np.concatenate([parameters, residual], axis=1))
        parameters_left = left[:, :-1]
        residual_left = left[:, -1]
        curvature = parameters.T @ parameters_left + x.prior_precision[0]
        slope = parameters.T @ residual_left + x.prior_gradient[0]
        along = solve(curvature[None], slope[None, :, None])[0, :, 0]
        before = float(residual[:, 0] @ residual_left) + float(x.prior_square[0])
        after = before - float(slope @ along)
        return along, _noise(after, x)

    def height(self, x: Expansion, residual: Array, prior: Array) -> Array:
        """(n,) log density of readings and parameters.

        Parameters
        ----------
        x : Expansion
        residual : (n, N) array
            In units of the reading error.
        prior : (n,) array
            Log density of the parameters.
        """
        white = whitened(x, residual.T, self.ratio)
        with np.errstate(invalid="ignore"):
            value = prior - 0.5 * (white * self._left(white)).sum(axis=0)
        return or_impossible(value)

    def _left(self, columns: Array) -> Array:
        """What the remainder leaves of columns (N, c)."""
        return columns - _taken(self.functions, columns, np.eye(self.functions.shape[1]))


def _noise(square: float, x: Expansion) -> float:
    """Standard deviation of what is left, where there are more readings than parameters; no less than rounding."""
    return float(np.sqrt(max(square, float(x.least[0])) / x.degrees)) if x.degrees > 0 else 1.0


def _taken(functions: Array, columns: Array, precision: Array) -> Array:
    """(N, c) the part of columns that functions (N, q) take whose coefficients have a prior's precision (q, q)."""
    inner = functions.T @ functions + precision
    return functions @ solve(inner[None], (functions.T @ columns)[None])[0]
