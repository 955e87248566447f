"""Whether an effect makes the gap smaller on readings it did not see: held-out holds, and leaving out one at a time."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.random import Generator
from scipy.special import logsumexp

from wirebayes.discovery.settings import LEAST_HOLDS
from wirebayes.inference import rough_draws
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.model import likelihoods
from wirebayes.model.build import build
from wirebayes.model.hold_filter import LinearHold, Measured
from wirebayes.model.linear_amplitudes import completed
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Sample
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap
from wirebayes.wire.effect import Effect
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import Linearised, linearise


@dataclass(frozen=True)
class HeldOut:
    """A model's prediction of the holds it was not trained on, one experiment.

    Attributes
    ----------
    holds : list of int
        Their numbers.
    squares : float
        Mean squared error of the predictive mean, N².
    readings : int
    floor : float
        Mean predictive variance if all parameters were known: sensor, rounding and setting error, N².
    elpd : (h,) array
        Log predictive density of each hold.
    inside : float
        Share of readings in their 90 % bands.
    readings_each : tuple of int
        Of each hold.
    """

    holds: list[int]
    squares: float
    readings: int
    floor: float
    elpd: Array
    inside: float
    readings_each: tuple[int, ...] = ()

    @property
    def rmse_N(self) -> float:
        return float(np.sqrt(self.squares))

    def times(self, unit: float) -> "HeldOut":
        """The same with readings written in a unit so many times smaller."""
        squares = self.squares * unit**2
        floor = self.floor * unit**2
        elpd = self.elpd - np.array(self.readings_each) * np.log(unit)
        return replace(self, squares=squares, floor=floor, elpd=elpd)


def last_third(experiment: Experiment) -> int:
    """Number of recorded holds to train on when the last third is held out (0: too few holds to hold any out)."""
    holds = len(experiment.recorded_holds)
    return holds - round(holds / 3) if holds >= LEAST_HOLDS else 0


def predicted(
    experiments: Sequence[Experiment],
    train: Sequence[int],
    effects: Sequence[Effect],
    block: LaplaceFit,
    rng: Generator,
) -> list[HeldOut]:
    """Train a block's samples on their first holds with some effects, predict their other holds freely.

    Parameters
    ----------
    experiments : sequence of Experiment
        Of one material, whole.
    train : sequence of int
        Recorded holds to train on, each.
    effects : sequence of Effect
    block : LaplaceFit
        Says which laws, and where to look first if it has these effects.
    rng : numpy Generator
    """
    first = [e.train(k) for e, k in zip(experiments, train, strict=True)]
    near = block.theta[0] if block.effects == tuple(effects) else None
    trained = fitted(first, effects, block.spec, rng, near, scales=block.scales)
    problem, theta = _draws(trained, rng, _REPORTED, _EFFECTIVE)
    whole = build(experiments, effects, block.spec, scales=block.scales)
    ahead = whole.in_units(problem.units).samples
    out = []
    for later, trained_on, k in zip(ahead, problem.samples, train, strict=True):
        # The training readings' reference tension belongs to the parameters.
        own = problem.parameters(theta, trained_on)
        scored = _scored(later, trained_on.model, own, k, rng)
        unit = problem.read_unit(later)
        out.append(scored.times(unit))
    return out


def _scored(sample: Sample, model: Model, own: dict[str, Array], train: int, rng: Generator) -> HeldOut:
    """The recorded holds of a sample after the first `train`, predicted with draws of its own parameters."""
    protocol = sample.protocol
    line = linearise(protocol, own, model)
    measured = sample.measured(own)
    last = np.flatnonzero(protocol.recorded)[train:]
    trained_on = protocol.mask.copy()
    trained_on[last] = False
    left_out = protocol.mask & ~trained_on
    carried = likelihoods.chain(line, replace(measured, mask=trained_on))
    log_p = likelihoods.held_out_density(line, carried, replace(measured, mask=left_out))
    draws = log_p.shape[1]
    elpd = logsumexp(or_impossible(log_p), axis=1) - np.log(draws)
    holds = [_scored_hold(measured, line, carried, j, rng) for j in last.tolist()]
    return _of_holds(holds, protocol.number[last].tolist(), elpd)


def _of_holds(holds: Sequence["_ScoredHold"], numbers: list[int], elpd: Array) -> HeldOut:
    """Scored holds with their numbers and log densities (h,) together."""
    error = np.concatenate([hold.error for hold in holds])
    floor = np.concatenate([hold.floor for hold in holds])
    inside = np.concatenate([hold.inside for hold in holds])
    return HeldOut(
        holds=numbers,
        squares=float((error**2).mean()),
        readings=len(error),
        floor=float(floor.mean()),
        elpd=elpd,
        inside=float(inside.mean()),
        readings_each=tuple(len(hold.error) for hold in holds),
    )


@dataclass(frozen=True)
class _ScoredHold:
    """For each reading: the error of the mean, the variance of noise alone, and whether the 90 % band holds it."""

    error: Array
    floor: Array
    inside: Array


def _scored_hold(
    measured: Measured, line: Linearised, carried: likelihoods.Filtered, j: int, rng: Generator
) -> _ScoredHold:
    """One hold predicted from the creep that is carried into it."""
    keep = measured.mask[j]
    hold = LinearHold.of(line, j, keep)
    mean = hold.reading + hold.by_creep * carried.carried_mean[j]
    by_noise = measured.variance + hold.by_setting**2 * measured.setting_sd**2
    variance = by_noise + hold.by_creep**2 * carried.carried_var[j]
    drawn = mean + rng.normal(size=mean.shape) * np.sqrt(variance)
    low, high = np.quantile(drawn, [0.05, 0.95], axis=1)
    y = measured.readings[j][keep][:, 0]
    return _ScoredHold(
        error=mean.mean(axis=1) - y,
        floor=by_noise.mean(axis=1),
        inside=(y >= low) & (y <= high),
    )


def gap_closed(plain: HeldOut, final: HeldOut) -> float | None:
    """1 - (rmse_final² - s²) / (rmse_plain² - s²), s the final model's noise floor; None when plain is below it."""
    excess = plain.squares - final.floor
    if excess <= 0:
        return None
    left = final.squares - final.floor
    return float(1.0 - left / excess)


def truncated_leave_one_hold_out(block: LaplaceFit, rng: Generator) -> Array:
    """(H,) log predictive density of each recorded hold of a block from all its others, by importance sampling.

    A search scores many fits by rough draws about their modes: there is no time for refits, and a tail fitted to such
    draws would say little. Weights are truncated at their mean times the square root of their number (Ionides 2008); a
    weight that would need more is a hold that the others do not predict, which its small density says already.
    Posteriors are scored by `wirebayes.prediction.leave_one_hold_out.smoothed_leave_one_hold_out`.
    """
    problem, theta = _draws(block, rng, 1500)
    of_samples = zip(problem.leave_one_hold_out(theta), problem.samples, strict=True)
    values = np.concatenate([of_holds[sample.protocol.recorded] for of_holds, sample in of_samples])
    values = np.where(np.isfinite(values), values, -1e6)
    log_weight = -values - logsumexp(-values, axis=1, keepdims=True)
    ceiling = -0.5 * np.log(values.shape[1])
    log_weight = np.minimum(log_weight, ceiling)
    log_weight -= logsumexp(log_weight, axis=1, keepdims=True)
    return logsumexp(log_weight + values, axis=1)


class LeftOut:
    """`truncated_leave_one_hold_out` of fits that are compared again and again: each is scored once.

    Parameters
    ----------
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.
    """

    def __init__(self, rng: Generator, parallel_map: ParallelMap) -> None:
        self._rng = rng
        self._map = parallel_map
        self._known: dict[int, tuple[LaplaceFit, Array]] = {}  # by id, which is taken as long as the fit is kept

    def of(self, fits: Sequence[LaplaceFit]) -> list[Array]:
        """(H,) densities of each fit; those of the same object are the same."""
        new = {id(fit): fit for fit in fits if id(fit) not in self._known}
        scores = self._map(truncated_leave_one_hold_out, list(new.values()), self._rng.spawn(len(new)))
        for key, score in zip(new, scores, strict=True):
            self._known[key] = new[key], score
        return [self._known[id(fit)][1] for fit in fits]


def _draws(block: LaplaceFit, rng: Generator, n: int, wanted: float | None = None) -> tuple[Problem, Array]:
    """The problem with all parameters of a block, and n rough draws of its posterior, so many of them effective."""
    drawn = rough_draws.draws(block.target, block.modes, rng, n, wanted)
    problem, theta, _ = completed(block.target.problem, drawn, rng)
    return problem, theta


# Draws behind the errors that are reported, and how many of those they come from are effective: with 500, where
# predictions have a long tail, the error of their mean came out half as large as by a long run of the sampler.
_REPORTED, _EFFECTIVE = 4000, 5000.0
