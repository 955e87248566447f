"""The expected width of the posterior of a planned test: the test simulated many times, each fitted approximately.

A truth is drawn from the guess, readings from the truth with setting, sensor and rounding errors. The mode of the
posterior is found from the truth; draws of a Student t at the mode, weighted by the posterior, give its widths. These
include the curvature of the posterior and the priors of a fit; a second mode far from the truth is not found.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from wirebayes.inference.climb import climb
from wirebayes.inference.log_posterior import Density, LogPosterior
from wirebayes.inference.optimum import Optimum
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.plan import ExpectedWidth
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.replicate import readings
from wirebayes.model.sample import MATERIAL
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.numeric.typing import Array, Indices
from wirebayes.planning.guessed_test import Guess, as_guessed, middle_tension
from wirebayes.results.parameters import unit_of
from wirebayes.wire.effect import Effect
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import PLAIN, Model

HOUR_S = 3600.0
CREEP = ("creep_longest_hold_mm", "creep_1h_mm")
_DRAWS = (500, 500, 3000)  # of each posterior, round by round: the last give its width to some 5 %, tails included
_ROWS = 16  # simulated tests weighted at once
_KEPT = 400  # draws that are handed on of a posterior
_NUMBERS = 4_000_000  # draws times readings at once, so that a long protocol does not fill the memory
_WIDER = 1.4  # times as wide as the posterior is found to be: weights in its tails stay small
_LEAST = 1e-6  # of the covariance before, so that a round in which one draw has all the weight can be drawn from
_SHARE = 1e-9  # of the weight: no fit would draw what has less, and its creep may be infinite
_DEGREES = 4.0  # of the Student t: its tails cover those of a posterior near its mode


@dataclass(frozen=True)
class Expected:
    """What a test is expected to teach.

    Attributes
    ----------
    widths : dict of name to ExpectedWidth
        Parameters, then ``creep_longest_hold_mm`` and ``creep_1h_mm`` at `tension_N`.
    tension_N, length_mm : float
        For which creep is stated.
    longest_hold_s : float
    information_bits : float
        What the test says about the material: the logarithm, to base 2, of how often the volume that its parameters
        (as logarithms) may lie in is halved, from the model's prior to the posterior; median over the tests.
    tests : int
        Simulated tests that could be used.
    model : Model
        The wire's, which the parameters belong to.
    draws : tuple of dict of name to (k,) array
        Equally weighted posterior draws of the first few simulated tests.
    """

    widths: dict[str, ExpectedWidth]
    tension_N: float
    length_mm: float
    longest_hold_s: float
    information_bits: float
    tests: int
    model: Model
    draws: tuple[dict[str, Array], ...]


def expected_widths(
    test: Experiment,
    guess: Guess,
    rng: Generator,
    spec: ModelSpec = PLAIN_SPEC,
    *,
    guessed: Model = PLAIN,
    tension_N: float | None = None,
    length_mm: float | None = None,
    kept_draws: int = 0,
) -> Expected:
    """Simulate a planned test at each draw of a guess, and find how wide each posterior is.

    Parameters
    ----------
    test : Experiment
        What is planned, with the readings of `at_centre`; its priors are those of the later fit.
    guess : mapping of name to (n,) array
        Draws of the parameters; ``n`` tests are simulated.
    rng : numpy Generator
    guessed : Model
        Of the guess: tests are simulated and fitted with its effects.
    tension_N, length_mm : float, optional
        For which creep is stated, so that tests of several lengths can be compared (creep is a strain of the whole
        wire); this test's `middle_tension` and length when left out.
    kept_draws : int
        Of how many tests posterior draws are kept.

    Raises
    ------
    ValueError
        If no simulated test has a posterior that can be climbed.
    """
    natural = build([test], guessed.effects, spec)
    problem = natural.in_units(natural.own_units)  # so that nothing depends on what is called a newton
    of_guess = as_guessed(natural, guessed).in_units(natural.own_units)
    creep = _Creep(
        tension_N=middle_tension(test) if tension_N is None else tension_N,
        length_mm=test.length_mm if length_mm is None else length_mm,
        longest_s=float(natural.samples[0].protocol.duration_s.max()),
    )
    target = LogPosterior(problem)
    columns = np.column_stack([guess[name] for name in natural.names])
    truth, y = _simulated(of_guess, natural.theta_in(problem.units, columns), rng)
    found, good = _climbed(target, truth, y)
    widths = list[dict[str, Array]]()
    volumes = list[Array]()
    draws = list[dict[str, Array]]()
    for part in _posteriors(target, found, good, y, rng):
        values = part.of_tests(_quantities(natural, problem.theta_in(natural.units, part.theta), creep))
        own = {}
        for name, rows in values.items():
            own[name] = _row_widths(rows, part.weight)
        widths.append(own)
        volumes.append(_log_volume(part, problem))
        draws += _kept(part, values, kept_draws - len(draws), rng)
    before = _quantities(natural, problem.theta_in(natural.units, truth), creep)
    return Expected(
        _expected(widths, before, test, guessed.effects),
        creep.tension_N,
        creep.length_mm,
        creep.longest_s,
        _bits(problem, np.concatenate(volumes)),
        len(good),
        natural.samples[0].model,
        tuple(draws),
    )


@dataclass(frozen=True)
class _Creep:
    """For which tension, length and longest hold creep is stated."""

    tension_N: float
    length_mm: float
    longest_s: float


def _simulated(problem: Problem, truth: Array, rng: Generator) -> tuple[Array, Array]:
    """Parameters with readings of a test that they give, without those that the prior or the model excludes."""
    (sample,) = problem.samples
    y = readings(problem, truth, sample, rng)
    computable = np.isfinite(y[sample.protocol.mask]).all(axis=0)
    possible = np.isfinite(problem.prior.log_density()(truth))
    usable = computable & possible
    return truth[usable], y[..., usable]


@dataclass(frozen=True)
class _Posteriors:
    """Posteriors of some simulated tests: all draws after each other (tests * draws, d), and their weights.

    Parameters are in the problem's units.
    """

    theta: Array
    weight: Array

    def of_tests(self, quantities: Mapping[str, Array]) -> dict[str, Array]:
        """Quantities of all draws, each (tests, draws)."""
        return {name: values.reshape(self.weight.shape) for name, values in quantities.items()}


def _kept(part: _Posteriors, values: dict[str, Array], count: int, rng: Generator) -> list[dict[str, Array]]:
    """Draws of the first so many tests, each as likely as its weight says."""
    out = []
    for test, weight in enumerate(part.weight[: max(count, 0)]):
        pick = rng.choice(len(weight), _KEPT, p=weight)
        out.append({name: rows[test][pick] for name, rows in values.items()})
    return out


def _expected(
    widths: list[dict[str, Array]], before: dict[str, Array], test: Experiment, effects: tuple[Effect, ...]
) -> dict[str, ExpectedWidth]:
    """Each quantity's width over all simulated tests, and before them."""
    out = {}
    for name in widths[0]:
        after = np.concatenate([part[name] for part in widths])
        out[name] = _width(after, before[name], _unit(name, test, effects))
    return out


def _posteriors(target: LogPosterior, found: Optimum, good: Indices, y: Array, rng: Generator) -> Iterator[_Posteriors]:
    """Weighted draws around the best parameters of each test, some tests at once."""
    covariance = found.covariance
    for begin in range(0, len(good), _ROWS):
        part = good[begin : begin + _ROWS]
        theta, weight = _weighted(target, found.z[part], covariance[part], y[..., part], rng)
        yield _Posteriors(theta, weight)


def _climbed(target: LogPosterior, truth: Array, y: Array) -> tuple[Optimum, Indices]:
    """The best parameters of each simulated test, and of which tests there is a posterior around them."""
    density, residuals = target.rowwise([y])
    start = target.coordinates.to_sampled(truth)
    found = climb(density, start, residuals, iterations=40, tolerance=1e-3)
    good = np.flatnonzero(np.isfinite(found.log_density))
    has_width = np.isfinite(found.covariance[good]).all(axis=(1, 2))
    good = good[has_width]
    if not len(good):
        raise ValueError("no simulated test could be fitted")
    return found, good


def _bits(problem: Problem, log_volumes: Array) -> float:
    """Information in a test: how many times the volume of the parameters is halved (median over tests)."""
    prior = problem.prior.rvs(4000, np.random.default_rng(0))
    equal = np.full((1, len(prior)), 1.0 / len(prior))
    known = _log_volume(_Posteriors(prior, equal), problem)
    return float((known[0] - np.median(log_volumes)) / np.log(2.0))


def _weighted(target: LogPosterior, z: Array, covariance: Array, y: Array, rng: Generator) -> tuple[Array, Array]:
    """(m * k, d) draws of the parameters at m modes, and their (m, k) weights, each row summing to one.

    The first draws are spread as the curvature at the mode says, those of each further round as the weighted draws
    before them lie.
    """
    density, _ = target.rowwise([y])
    to_natural = target.coordinates.to_natural
    centre = z
    for count in _DRAWS:
        wide = _WIDER**2 * covariance
        points, weight = _round(target, density, centre, wide, count, rng)
        centre, spread = _moments(points, weight)
        covariance = spread + _LEAST * covariance
    flat = points.reshape(-1, z.shape[1])
    with np.errstate(over="ignore"):
        theta = to_natural(flat)
    # a draw without weight stands for the mode: infinity times nothing would be no number
    modes = np.repeat(to_natural(z), _DRAWS[-1], axis=0)
    counts = weight > _SHARE
    counted = np.where(counts, weight, 0.0)
    return np.where(counts.reshape(-1, 1), theta, modes), counted / counted.sum(axis=1, keepdims=True)


def _moments(points: Array, weight: Array) -> tuple[Array, Array]:
    """(m, d) means and (m, d, d) covariances of points (m, k, d) by their weights (m, k)."""
    mean = np.einsum("mk,mkd->md", weight, points)
    away = points - mean[:, None]
    return mean, np.einsum("mk,mki,mkj->mij", weight, away, away)


def _round(
    target: LogPosterior, density: Density, centre: Array, covariance: Array, k: int, rng: Generator
) -> tuple[Array, Array]:
    """(m, k, d) draws of Student t's, and their (m, k) weights in the posteriors."""
    points, log_drawn = _student_draws(centre, covariance, k, rng)
    with np.errstate(all="ignore"):
        log_density, possible = _at_draws(target, density, points)
        log_weight = log_density - log_drawn
    log_weight[~np.isfinite(log_weight) | ~possible] = -np.inf
    weight = np.exp(log_weight - log_weight.max(axis=1, keepdims=True))
    # truncated importance sampling: no draw may count for more than sqrt(k) average ones
    most = weight.mean(axis=1, keepdims=True) * np.sqrt(k)
    weight = np.minimum(weight, most)
    return points, weight / weight.sum(axis=1, keepdims=True)


def _student_draws(centre: Array, covariance: Array, k: int, rng: Generator) -> tuple[Array, Array]:
    """(m, k, d) draws of Student t's, and their (m, k) log densities but for a constant."""
    m, d = centre.shape
    normal = rng.normal(size=(m, k, d))
    stretch = np.sqrt(rng.chisquare(_DEGREES, size=(m, k)) / _DEGREES)
    correlated = np.einsum("mij,mkj->mki", np.linalg.cholesky(covariance), normal)
    points = centre[:, None] + correlated / stretch[..., None]
    square = (normal**2).sum(axis=-1) / stretch**2
    log_drawn = -0.5 * (_DEGREES + d) * np.log1p(square / _DEGREES)
    return points, log_drawn


def _at_draws(target: LogPosterior, density: Density, points: Array) -> tuple[Array, Array]:
    """(m, k) log posterior densities of the draws of each test, and whether they are numbers in natural units."""
    m, k, d = points.shape
    flat = points.reshape(-1, d)
    tests = np.repeat(np.arange(m), k)
    numbers = len(flat) * sum(int(sample.protocol.mask.size) for sample in target.problem.samples)
    pieces = max(1, numbers // _NUMBERS)
    values = []
    for some, their_tests in zip(np.array_split(flat, pieces), np.array_split(tests, pieces), strict=True):
        values.append(density(some, their_tests))
    finite = np.isfinite(target.coordinates.to_natural(flat)).all(axis=1)
    return np.concatenate(values).reshape(m, k), finite.reshape(m, k)


def _quantities(problem: Problem, theta: Array, creep: _Creep) -> dict[str, Array]:
    """Parameters and creep of (n, d) draws, each (n,)."""
    (sample,) = problem.samples
    tested_mm = sample.protocol.length_mm
    own = problem.parameters(theta, sample)
    wire = FreshSample(own, sample.model, tested_mm)
    times = np.array([creep.longest_s, HOUR_S])
    longest_hold, hour = wire.creep_mm(creep.tension_N, times) * (creep.length_mm / tested_mm)
    free = {name: theta[:, i] for i, name in enumerate(problem.names)}
    return free | dict(zip(CREEP, (longest_hold, hour), strict=True))


def _row_widths(values: Array, weight: Array) -> Array:
    """(m, 2) standard deviation and length of the 90 % interval of each row's weighted draws."""
    mean = (values * weight).sum(axis=1, keepdims=True)
    sd = np.sqrt((weight * (values - mean) ** 2).sum(axis=1))
    order = np.argsort(values, axis=1)
    ranked = np.take_along_axis(values, order, axis=1)
    share = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
    lengths = []
    for row_share, row in zip(share, ranked, strict=True):
        low, high = np.interp([0.05, 0.95], row_share, row)
        lengths.append(high - low)
    return np.column_stack([sd, lengths])


def _log_volume(part: _Posteriors, problem: Problem) -> Array:
    """(m,) half the log determinant of the covariance of the material's parameters, positive ones as logarithms."""
    columns = [i for i, name in enumerate(problem.names) if name in MATERIAL]
    positive = [problem.names[i] in problem.prior.logarithmic for i in columns]
    theta = part.theta.reshape(*part.weight.shape, -1)
    x = theta[..., columns]
    above_zero = np.where(positive, np.maximum(x, 1e-300), 1.0)
    _, covariance = _moments(np.where(positive, np.log(above_zero), x), part.weight)
    regular = covariance + 1e-24 * np.eye(len(columns))
    _, log_determinant = np.linalg.slogdet(regular)
    return 0.5 * log_determinant


def _unit(name: str, test: Experiment, effects: tuple[Effect, ...]) -> str:
    return "mm" if name in CREEP else unit_of(name, effects, (test.control,))


def _width(rows: Array, before: Array, unit: str) -> ExpectedWidth:
    sd, length = rows.T
    low, middle, high = np.quantile(length, [0.05, 0.5, 0.95])
    return {
        "sd": float(np.median(sd)),
        "width_90": float(middle),
        "width_90_low": float(low),
        "width_90_high": float(high),
        "guess_sd": float(before.std()),
        "unit": unit,
    }
