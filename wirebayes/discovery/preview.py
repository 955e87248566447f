"""What a test can and cannot determine, before a long fit or search: parameters by a short run, effects by their size.

An effect counts as detectable where the global test of `discover` would detect it in 80 % of tests like this one,
simulated at the rough fit and refitted (`wirebayes.discovery.power`).
"""

from dataclasses import dataclass

import numpy as np
from numpy.random import Generator

from wirebayes.discovery import power, screening
from wirebayes.discovery.linear_scan import expand
from wirebayes.inference import rough_draws
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.check import EffectSize, ParameterRange
from wirebayes.json_files.hold_ends import HoldEnds
from wirebayes.model.problem import Problem
from wirebayes.model.scales import NATURAL
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.numeric.any_distribution import finite_spread
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice
from wirebayes.results import hold_ends
from wirebayes.results.contraction import Source, contraction, source
from wirebayes.results.parameters import unit_of
from wirebayes.results.posterior_checks import of_posterior
from wirebayes.wire.effect import Effect, Kinds
from wirebayes.wire.protocol import Control

SIMULATIONS = 199  # the level that one in twenty-five passes by chance is then the eighth largest
UNUSUAL = 2.0  # standard deviations of an effect's prior: few wires show it as large


@dataclass(frozen=True)
class Preview:
    """What a test can determine.

    Attributes
    ----------
    parameters : dict
        Of each: ``q05``, ``q50``, ``q95``, ``prior_q05``, ``prior_q95``, and ``determined_by``:
        data, data and prior, or prior.
    effects : dict
        Of each: ``amplitude_80``, the smallest that would be detected in four tests of five, its ``unit``, and
        whether the test ``shows`` it: yes (at usual sizes), if unusually large, or no, and the ``reason``.
    warnings : list of Notice
        What is suspicious about what was fitted.
    hold_ends : dict or None
        What it may cost that the ends of holds were not recorded.
    """

    parameters: dict[str, ParameterRange]
    effects: dict[str, EffectSize]
    warnings: list[Notice]
    hold_ends: HoldEnds | None


def preview(experiment: Experiment, kinds: Kinds, rng: Generator) -> Preview:
    """Fit the plain model roughly and see what the test would determine.

    Parameters
    ----------
    experiment : Experiment
    kinds : mapping of name to effect class
    rng : Generator
    """
    block = fitted((experiment,), (), PLAIN_SPEC, rng)
    target = block.target
    problem = target.problem
    draws = rough_draws.draws(target, block.modes, rng)
    theta = problem.theta_in(NATURAL, draws)
    prior_draws = problem.prior.rvs(4000, rng)
    before = problem.theta_in(NATURAL, prior_draws)
    problem = problem.in_units(NATURAL)
    at_best = list(block.best.values())
    best = np.array(at_best)
    ends = hold_ends.cost(problem, best, theta)
    parameters = _parameters(problem, theta, before)
    effects = _effects(block, kinds, rng)
    warnings = _warnings(problem, theta, before)
    return Preview(parameters, effects, warnings, ends)


def _parameters(problem: Problem, theta: Array, before: Array) -> dict[str, ParameterRange]:
    """Each parameter's range by draws (n, d) after and before the test."""
    control = problem.samples[0].protocol.control
    known_after = problem.prior.known(theta)
    known_before = problem.prior.known(before)
    out = {}
    for i, name in enumerate(problem.names):
        unit = unit_of(name, (), [control])
        determined_by = source(contraction(known_after[:, i], known_before[:, i]))
        out[name] = _range(theta[:, i], before[:, i], unit, determined_by)
    return out


def _warnings(problem: Problem, theta: Array, before: Array) -> list[Notice]:
    """What is suspicious about draws (n, d) after the test, beside those before it."""
    sample = problem.samples[0]
    own = problem.parameters(theta, sample)
    prior = problem.parameters(before, sample)
    return of_posterior(own, prior, sample)


def _range(draws: Array, before: Array, unit: str, determined_by: Source) -> ParameterRange:
    """One parameter: its range after and before the test, and what determines it."""
    low, middle, high = np.quantile(draws, [0.05, 0.5, 0.95])
    prior_low, prior_high = np.quantile(before, [0.05, 0.95])
    return {
        "unit": unit,
        "q05": float(low),
        "q50": float(middle),
        "q95": float(high),
        "prior_q05": float(prior_low),
        "prior_q95": float(prior_high),
        "determined_by": determined_by,
    }


def _effects(block: LaplaceFit, kinds: Kinds, rng: Generator) -> dict[str, EffectSize]:
    """Each effect at the size at which it would be seen, in the form and at the hold where it is seen best."""
    control = block.experiments[0].control
    degrees = expand(block.target, block.z, []).degrees
    if degrees < 1:
        why = "fewer readings than parameters"
        return {name: _hidden(kind, why, control) for name, kind in kinds.items()}
    trials, candidates = screening.candidate_probes([block], kinds)
    effects = {name: _hidden(kind, kind.shows, control) for name, kind in kinds.items()}
    if not candidates:
        return effects
    simulated = screening.replicated(block, trials, SIMULATIONS, rng)
    null = simulated.scan
    level = screening.chance_level(candidates, [null])
    found = power.detectable(null, trials, candidates, level)
    for name, (number, amplitude) in found.items():
        effect = trials[number].effect
        effects[name] = _shown(block, effect, amplitude)
    return effects


def _shown(block: LaplaceFit, effect: Effect, amplitude: float | None) -> EffectSize:
    if amplitude is None:
        return _hidden(type(effect), "taken up by the model's own parameters", block.experiments[0].control)
    main = effect.amplitudes[0]
    shows = "yes" if amplitude <= UNUSUAL * finite_spread(main.prior) else "if unusually large"
    seen = block.natural_amplitude(effect, amplitude)
    return {"shows": shows, "amplitude_80": seen, "unit": block.unit(effect), "reason": None}


def _hidden(kind: type[Effect], reason: str, control: Control) -> EffectSize:
    return {"shows": "no", "amplitude_80": None, "unit": kind.unit_under(kind.amplitudes[0], control), "reason": reason}
