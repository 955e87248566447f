"""Draws of the wire's parameters guessed before a test: from a plan's tables, an earlier fit, or readings."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.random import Generator

from wirebayes.inference.laplace_fit import fitted
from wirebayes.inference.rough_draws import draws as rough_draws
from wirebayes.io.experiment import Experiment
from wirebayes.model.build import default_prior
from wirebayes.model.prior import from_table, possible
from wirebayes.model.sample import MATERIAL, SAMPLE
from wirebayes.model.scales import NATURAL, TYPICAL_K1_N, planned_scales
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Array
from wirebayes.result_warnings import Notice
from wirebayes.wire.model import PLAIN, Model
from wirebayes.wire.protocol import Control


@dataclass(frozen=True)
class GuessedWire:
    """Draws of a wire's parameters, for a sample of one length.

    Attributes
    ----------
    draws : dict of name to (n,) array
        Parameters of the model, those of the bench as in tests of `control`.
    length_mm : float
        What `B` refers to.
    source : str
        Where the guess comes from, in words.
    doubts : tuple of Notice
        What the fit that it comes from says against using it.
    control : {"displacement", "force"}
        Decides the units of `sensor_sd` and `setting_sd`.
    other_benches : dict of control to dict of name to (n,) array
        Preload and errors in tests of another control, whose bench reads and sets other quantities.
    model : Model
        Its effects, and what these refer to.
    """

    draws: dict[str, Array]
    length_mm: float
    source: str
    doubts: tuple[Notice, ...] = ()
    control: Control = "displacement"
    other_benches: dict[Control, dict[str, Array]] = field(default_factory=dict)
    model: Model = PLAIN

    def at(self, test: Experiment) -> dict[str, Array]:
        """The draws for the sample and the bench of a test: creep is a strain of the whole wire."""
        longer = test.length_mm / self.length_mm
        bench = {} if test.control == self.control else self.other_benches[test.control]
        return self.draws | {"B": self.draws["B"] * longer} | bench

    def on_benches_of(self, tests: Sequence[Experiment], rng: Generator) -> "GuessedWire":
        """The same wire where tests of both controls are planned: what is not known of a bench is as wide as its prior.

        Parameters
        ----------
        tests : sequence of Experiment
            All that is planned.
        """
        k1 = self.draws["k1"]
        scales = planned_scales(tests, float(np.median(k1)))
        benches: dict[Control, dict[str, Array]] = {}
        for control in {test.control for test in tests} - {self.control}:
            drawn = default_prior(self.length_mm, scales, {}, control).named_draws(len(k1), rng)
            benches[control] = {name: drawn[name] for name in SAMPLE}
        return replace(self, other_benches=benches)


def from_tables(
    tables: Mapping[str, Any],
    lines: Mapping[str, int],
    source: Path,
    tests: Sequence[Experiment],
    n: int,
    rng: Generator,
) -> GuessedWire:
    """A guess as a plan file writes it; what it leaves out is as wide as the model's prior.

    Raises
    ------
    InputError
        A table is no distribution.

    Parameters
    ----------
    tables : mapping of parameter to value
        A number fixes a parameter; a table names its distribution (see `wirebayes.model.prior.from_table`).
    lines : mapping of parameter to int
        Where each stands in the file, for messages.
    source : Path
        The plan file, for messages.
    tests : sequence of Experiment
        What is planned; the guess speaks of a sample as long as the first one's.
    n : int
        Number of draws.
    """
    stated = _stated(tables, lines, source)
    length_mm = tests[0].length_mm
    scales = planned_scales(tests, _middle(stated.get("k1", TYPICAL_K1_N)))
    prior = default_prior(length_mm, scales, stated, tests[0].control)
    values = prior.named_draws(n, rng)
    draws = {name: values[name] for name in (*MATERIAL, *SAMPLE)}
    given = ", ".join(tables) if tables else "nothing"
    words = f"the plan's guess ({given} given, the rest as wide as the model's prior)"
    guess = GuessedWire(draws, length_mm, words, control=tests[0].control).on_benches_of(tests, rng)
    if "preload" in stated:  # a stretch on either bench
        for bench in guess.other_benches.values():
            bench["preload"] = draws["preload"]
    return guess


def _stated(tables: Mapping[str, Any], lines: Mapping[str, int], source: Path) -> dict[str, Any]:
    """What a plan file says of parameters: numbers, or distributions."""
    stated = {}
    for name, value in tables.items():
        key = f"{source}, line {lines[name]}: guess.{name}"
        table = value if isinstance(value, dict) else {"fixed": value}
        stated[name] = possible(key, name, from_table(key, table))
    return stated


def _middle(value: Any) -> float:
    """A number, or the median of a distribution."""
    return value if isinstance(value, float) else float(value.median())


def from_posterior(
    draws: Mapping[str, Array], length_mm: float, source: str, n: int, model: Model = PLAIN
) -> GuessedWire:
    """Some of a posterior's draws, evenly spaced.

    Parameters
    ----------
    draws : mapping of name to (m,) array
        Of all parameters of the wire and the bench.
    length_mm : float
        Length of the sample that was fitted.
    source : str
        What the guess rests on, for people.
    n : int
        How many draws; all of them where there are fewer.
    model : Model
        Of the posterior; the parameters of its effects are kept.
    """
    pick = evenly(len(draws["k1"]), n)
    of_effects = [column for effect in model.effects for column in effect.columns()]
    kept = {name: draws[name][pick] for name in (*MATERIAL, *SAMPLE, *of_effects)}
    return GuessedWire(kept, length_mm, source, model=model)


def from_readings(experiment: Experiment, n: int, rng: Generator, spec: ModelSpec) -> GuessedWire:
    """The posterior of what was measured, by a short run of the sampler.

    Parameters
    ----------
    n : int
        Number of draws.
    """
    block = fitted([experiment], (), spec, rng)
    fitted_problem = block.target.problem
    theta = rough_draws(block.target, block.modes, rng, n)
    natural = fitted_problem.in_units(NATURAL)
    parameters = natural.parameters(fitted_problem.theta_in(NATURAL, theta), natural.samples[0])
    words = f"a quick fit of {experiment.name}"
    return GuessedWire(dict(parameters), experiment.length_mm, words, control=experiment.control)
