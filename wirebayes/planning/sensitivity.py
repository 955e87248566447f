"""Which missing effects a planned test would detect, how large they would have to be, and which it would confuse.

The centre of the guess stands for the fit. Tests simulated there, each refitted, give the distribution of the global
test of `wirebayes.discovery` under chance; an effect is detected where its evidence exceeds that level.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.optimize import least_squares

from wirebayes.discovery import power, screening
from wirebayes.discovery.linear_scan import expand
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.optimum import Optimum
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.plan import EffectPower
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.sample import NOISES
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.numeric.any_distribution import finite_spread
from wirebayes.numeric.typing import Array
from wirebayes.planning.guessed_test import Guess, central
from wirebayes.wire.effect import Effect, Kinds
from wirebayes.wire.model import PLAIN, Model
from wirebayes.wire.staircase import simulate

SIMULATIONS = 300  # refitted, behind the level of chance: an amplitude seen in 80 % of tests is then known to some 5 %


@dataclass(frozen=True)
class Sensitivity:
    """What a test would show of the catalogue.

    Attributes
    ----------
    effects : dict of name to EffectPower
    cosines : dict of (name, name) to float
        Between signatures, free of what the parameters absorb.
    hidden : tuple of str
        Sentences: what the test cannot show at all.
    """

    effects: dict[str, EffectPower] = field(default_factory=dict)
    cosines: dict[tuple[str, str], float] = field(default_factory=dict)
    hidden: tuple[str, ...] = ()

    def apart(self, one: str, other: str) -> float:
        """How far two effects of prior size lie apart: the smaller δ, less what the other effect explains of it."""
        if one not in self.effects or other not in self.effects:
            return 0.0
        smaller = min(self.effects[one]["delta_prior"], self.effects[other]["delta_prior"])
        unexplained = 1.0 - self.cosines[one, other] ** 2
        return smaller * float(np.sqrt(max(0.0, unexplained)))


def sensitivity(
    test: Experiment,
    guess: Guess,
    kinds: Kinds,
    rng: np.random.Generator,
    spec: ModelSpec = PLAIN_SPEC,
    guessed: Model = PLAIN,
) -> Sensitivity:
    """Find what a planned test would show of missing effects.

    Parameters
    ----------
    test : Experiment
        With the readings of `wirebayes.planning.guessed_test.at_centre`.
    guess : mapping of name to (n,) array
    kinds : mapping of name to effect class
    rng : numpy Generator
    spec : ModelSpec
        The plain model.
    guessed : Model
        Of the guess; its effects are known, others are looked for beside them.
    """
    block = _fit_at(test, central(guess), spec, guessed)
    trials, candidates = screening.candidate_probes([block], kinds)
    names = [candidate.name for candidate in candidates]
    known = [effect.name for effect in guessed.effects]
    hidden = tuple(power.not_identifiable(block, list(kinds.values()), names + known))
    if not candidates:
        return Sensitivity(hidden=hidden)
    null = screening.replicated(block, trials, SIMULATIONS, rng).scan
    level = screening.chance_level(candidates, [null])
    x = expand(block.target, block.z, trials)
    alike = power.similarity([x], trials, [float(x.ratio[0])])
    strength = np.median(null.norm, axis=0)
    effects = {}
    for name, (trial, amplitude) in power.detectable(null, trials, candidates, level).items():
        found = _power(block, trials[trial].effect, amplitude, float(strength[trial]))
        group = power.group_of([name], alike)
        found["confused_with"] = [other for other in group if other != name]
        effects[name] = found
    return Sensitivity(effects, alike, hidden)


def _power(block: LaplaceFit, effect: Effect, seen: float | None, strength: float) -> EffectPower:
    """What the smallest amplitude that is seen is worth, given standard deviations per unit of amplitude."""
    prior = effect.amplitudes[0].prior
    return {
        "amplitude_80": None if seen is None else block.natural_amplitude(effect, seen),
        "unit": block.unit(effect),
        "delta_80": None if seen is None else seen * strength,
        "delta_prior": strength * finite_spread(prior),
        "confused_with": [],
    }


def _fit_at(test: Experiment, centre: Mapping[str, float], spec: ModelSpec, guessed: Model) -> LaplaceFit:
    """The fit whose best parameters are the guess's centre."""
    effects = guessed.effects
    natural = build([test], effects, spec)
    target = LogPosterior(natural.in_units(natural.own_units))
    theta = np.array([[centre[name] for name in natural.names]])
    if effects:
        theta = _as_this_test_refers(natural, theta)
    own_theta = natural.theta_in(target.problem.units, theta)
    z = target.coordinates.to_sampled(own_theta)
    covariance = np.eye(z.shape[1])[None]
    best = Optimum(z, target(z), covariance, np.array([True]))
    return LaplaceFit((test,), effects, spec, target, best)


def _as_this_test_refers(problem: Problem, theta: Array) -> Array:
    """The parameters ``(1, d)`` that give the readings of `at_centre` where effects refer to this test's own tension.

    Parameters
    ----------
    theta : (1, d) array
        What gives them where effects refer to those of the guess.
    """
    (sample,) = problem.samples
    protocol = sample.protocol
    of_wire = [i for i, name in enumerate(problem.names) if name not in NOISES]
    start = theta[0, of_wire]
    size = np.where(start == 0.0, 1.0, np.abs(start))

    def missed(share: Array) -> Array:
        tried = theta.copy()
        tried[0, of_wire] = start + share * size
        own = problem.parameters(tried, sample)
        read = simulate(protocol, own, sample.model)
        return (read - sample.readings)[protocol.mask][:, 0]

    found = least_squares(missed, np.zeros(len(of_wire)), x_scale="jac")
    moved = theta.copy()
    moved[0, of_wire] = start + found.x * size
    return moved
