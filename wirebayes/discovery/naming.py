"""The sets of effects that may be missing, past the global test, and what they say together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.discovery.families import Family, block_ratio, families_of, noise_ratio, refitted_probe
from wirebayes.discovery.fitted_sets import Explored, Fits
from wirebayes.discovery.global_test import Gate
from wirebayes.discovery.held_out import LeftOut
from wirebayes.discovery.name_evidence import NameEvidence, reaches, weigh_names
from wirebayes.discovery.noise_integral import Expansion
from wirebayes.discovery.settings import Settings
from wirebayes.discovery.stepwise import explore
from wirebayes.discovery.verdict import Decision, decide
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.processes.workers import ParallelMap


@dataclass(frozen=True)
class Named:
    """What was found past the global test: the sets of effects, what they say, and blocks with any of them."""

    explored: Explored
    decision: Decision
    fits: Fits


def name_effects(
    gate: Gate,
    expansions: Sequence[Expansion],
    settings: Settings,
    left_out: LeftOut,
    rng: np.random.Generator,
    parallel_map: ParallelMap,
) -> Named:
    """The sets of effects that were looked at, past the global test, and what they say.

    Parameters
    ----------
    gate : Gate
        What the global test has found.
    expansions : sequence of Expansion
        Of the plain blocks, by the probes of the test.
    settings : Settings
    left_out : LeftOut
        Scores them.
    rng : numpy.random.Generator
    parallel_map : function
        The built-in `map`, or one over processes.
    """
    reach = reaches(gate.blocks, gate.trials, gate.candidates)
    found = weigh_names(gate.blocks, gate.trials, gate.candidates, gate.data, parallel_map, reach)
    alike = _families_of_singles(gate.blocks, found)
    explored = explore(gate.blocks, found, expansions, gate.trials, alike, settings, rng, parallel_map)
    families = _families(gate.blocks, explored)
    decision = decide(gate.blocks, explored, families, settings, left_out, rng, parallel_map)
    return Named(explored, decision, Fits(gate.blocks, explored, settings, rng))


def _families_of_singles(plain: list[LaplaceFit], found: NameEvidence) -> list[Family]:
    """Families of effects refitted one at a time, in the noise that the best of them leaves."""
    ranked = sorted(found.winners, key=lambda name: -found.log_bayes[name])
    if not ranked:
        return []
    probed = {}
    for name in ranked:
        refits = found.amplitudes(name)
        probed[name] = {b: refitted_probe(plain[b], refitted, b) for b, refitted in refits.items()}
    best = found.amplitudes(ranked[0])
    ratios = []
    for b, block in enumerate(plain):
        ratio = noise_ratio(block, best[b], b) if b in best else block_ratio(block)
        ratios.append(ratio)
    return families_of(plain, probed, ratios)


def _families(plain: list[LaplaceFit], explored: Explored) -> list[Family]:
    """Families of all effects that were refitted, each where it had the most evidence, in the noise of the best set."""
    refits = explored.refits()
    probed = {
        name: {b: refitted_probe(parent.blocks[b], r, b) for b, r in found.items()}
        for name, (parent, found) in refits.items()
    }
    if not probed:
        return []
    best = max(explored.fitted.values(), key=lambda s: s.effects.log_bayes) if explored.fitted else explored.root
    return families_of(plain, probed, [block_ratio(block) for block in best.blocks])
