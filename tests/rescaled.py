"""Drawn tests of every kind, and the same tests written in other units."""

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from analyses.posterior.any_scale import REST, SHARES, Line, line, measured, under_steps, under_weights
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.fit import seed_of
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import build
from wirebayes.model.problem import Problem
from wirebayes.model.sample import Likelihood
from wirebayes.model.scales import NATURAL, Units
from wirebayes.model.spec import ModelSpec
from wirebayes.wire.effect import Effect

KINDS = ("steps", "weights", "two lengths", "two under weights", "steps and weights")
FACTORS = {"tension": (-6.0, 6.0), "length": (-2.0, 3.0), "time": (-3.0, 4.0)}  # powers of ten


@dataclass(frozen=True)
class Drawn:
    """Tests that are fitted together, and the model they are fitted with."""

    kind: str
    experiments: tuple[Experiment, ...]
    effects: tuple[Effect, ...]
    likelihood: Likelihood
    rests: bool

    def problem(self, by: Units = NATURAL) -> Problem:
        """The problem of these tests, written in other units."""
        return build(self.rewritten(by), list(self.effects), spec=ModelSpec(likelihood=self.likelihood))

    def rewritten(self, by: Units) -> list[Experiment]:
        """These tests in other units."""
        return [rewritten(experiment, by) for experiment in self.experiments]


def kind_of(index: int) -> str:
    """What the tests of a number are."""
    return KINDS[index % len(KINDS)]


def likelihood_of(index: int) -> Likelihood:
    """What the tests of a number are fitted with."""
    return "hold" if index % 8 == 3 else "chain"


@cache
def drawn(index: int) -> Drawn:
    """Tests of some scale: the number decides their kind, whether they rest, and whether they have effects."""
    rng = np.random.default_rng(seed_of(0, "in other units", str(index)))
    kind, likelihood = kind_of(index), likelihood_of(index)
    rests = index % 2 == 0
    made = line(rng)
    controls = {"steps": "s", "weights": "w", "two lengths": "ss", "two under weights": "ww", "steps and weights": "sw"}
    tests = []
    for number, control in enumerate(controls[kind]):
        of_this_length = replace(made, length_mm=made.length_mm * (1.0 + 0.6 * number))
        tests.append(test_of(of_this_length, control, f"test-{number}", rng, rests=rests))
    count = 0 if likelihood == "hold" or index % 3 == 0 else 1 + index % 2
    return Drawn(kind, tuple(tests), some_effects(tests, count, rng), likelihood, rests)


def test_of(made: Line, control: str, name: str, rng: np.random.Generator, *, rests: bool) -> Experiment:
    """A test of a line under steps or weights, with a resolution that is no round number."""
    shares = [*SHARES, REST] if rests else SHARES.tolist()
    bench, own = (under_weights if control == "w" else under_steps)(made, shares, rng)
    bench = replace(bench, name=name)
    test = measured(bench, made.truth | own, int(rng.integers(2**31)), rests=rests)
    return replace(test, resolution=own["sensor_sd"] * rng.uniform(0.1, 2.0))


def some_effects(tests: list[Experiment], count: int, rng: np.random.Generator) -> tuple[Effect, ...]:
    """Effects that these tests could show; those of the wire alone where steps and weights meet."""
    protocols = [test.protocol() for test in tests]
    kinds = list(CATALOGUE.values())
    if len({test.control for test in tests}) > 1:
        kinds = [kind for kind in kinds if kind.scope == "material"]
    possible = [forms for forms in (kind.variants(protocols) for kind in kinds) if forms]
    chosen = rng.permutation(len(possible))[:count]
    return tuple(effect_named(possible[i][rng.integers(len(possible[i]))].key) for i in chosen)


def factors(index: int, *, powers_of_two: bool) -> Units:
    """Units between the ends of `FACTORS`."""
    rng = np.random.default_rng(seed_of(0, "factors", str(index)))
    ten = {name: rng.uniform(*ends) for name, ends in FACTORS.items()}
    by = {name: 2.0 ** np.round(power / np.log10(2.0)) if powers_of_two else 10.0**power for name, power in ten.items()}
    return Units(by["length"], by["tension"], by["time"])


def rewritten(experiment: Experiment, by: Units) -> Experiment:
    """The same test with lengths, tensions and times multiplied."""
    setting, reading = by.length_mm, by.tension_N
    if experiment.control == "force":
        setting, reading = reading, setting
    holds = [
        replace(
            hold,
            setting=hold.setting * setting,
            readings=hold.readings * reading,
            duration_s=hold.duration_s * by.time_s,
            time_s=hold.time_s * by.time_s,
            start_s=hold.start_s * by.time_s,
        )
        for hold in experiment.holds
    ]
    length = experiment.length_mm * by.length_mm
    return replace(experiment, length_mm=length, resolution=experiment.resolution * reading, holds=tuple(holds))
