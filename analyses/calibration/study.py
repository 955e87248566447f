"""The studies: three protocols, one of them under weights, two likelihoods, and a likelihood broken on purpose."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from analyses.calibration.simulation_based_calibration import one
from wirebayes.inference.fit import seed_of
from wirebayes.inference.policy import Policy
from wirebayes.model.build import build
from wirebayes.model.problem import Problem, with_readings
from wirebayes.model.replicate import readings
from wirebayes.model.sample import Likelihood
from wirebayes.model.scales import planned_scales
from wirebayes.model.spec import ModelSpec
from wirebayes.simulation.synthetic import PAPER_TIMES_S, Bench

POLICY = Policy(walkers=64, round_draws=2048, ess=400.0)
BENCHES = {
    "paper": Bench("paper", displacements_mm=tuple(range(1, 13)), times_s=PAPER_TIMES_S),
    "unloading": Bench(
        "unloading",
        displacements_mm=(1, 2, 4, 6, 8, 10, 7, 4, 2, 5, 9),
        times_s=(0.0, 10.0, 30.0, 100.0, 300.0, 600.0),
    ),
    "weights": Bench(
        "weights",
        weights_N=(1, 2, 3, 4, 5, 6, 8, 5, 2, 4),
        times_s=(0.0, 10.0, 30.0, 100.0, 300.0, 600.0),
    ),
}


@dataclass(frozen=True)
class Study:
    """One protocol, one likelihood; `broken` drops the setting error from the fit, not from the simulation."""

    protocol: str
    likelihood: Likelihood
    broken: bool = False
    policy: Policy = POLICY

    @property
    def name(self) -> str:
        return f"{self.protocol}-{self.likelihood}" + ("-broken" if self.broken else "")

    def data_set(self, seed: int, index: int) -> dict[str, Any]:
        """Simulate and fit the data set of a number; the same whatever else is run."""
        own = seed_of(seed, "calibration", self.protocol, self.likelihood, str(index))
        test = BENCHES[self.protocol].experiment()
        problem = build([test], spec=ModelSpec(likelihood=self.likelihood), scales=planned_scales([test]))
        if self.likelihood == "hold":
            problem = _with_first_readings(problem, self.protocol, own)
        fitted = _without_setting_error if self.broken else _as_it_is
        ranked = one(problem, own, self.policy, fitted=fitted, accepted=stays_taut)
        chains = ranked.fit.chains
        return {
            "study": self.name,
            "index": index,
            "share_below": ranked.share_below,
            "truth": ranked.truth,
            "converged": chains.converged,
            "why": chains.why,
            "steps": int(chains.z.shape[1]),
            "acceptance": chains.acceptance,
            "learned": chains.learned,
            "modes": chains.modes,
            "redrawn": ranked.redrawn,
        }


STUDIES = [Study(protocol, likelihood) for likelihood in ("chain", "hold") for protocol in BENCHES]
BROKEN = Study("paper", "chain", broken=True)


class _NoSettingError(Problem):
    """A likelihood that believes every position is exact."""

    def parameters(self, theta: Any, sample: Any) -> Any:
        return super().parameters(theta, sample) | {"setting_sd": np.zeros(len(theta))}


def _without_setting_error(problem: Problem) -> Problem:
    return _NoSettingError(problem.samples, problem.prior, problem.likelihood)


def stays_taut(problem: Problem) -> bool:
    """Whether no hold that began with more than a newton ended with less than a twentieth of it.

    The prior's corner of soft, fast creepers gives wires that fall slack in every hold: nobody would go on with such a
    test, and its posterior has a kink wherever a reading falls to zero. Under weights the wire is always taut.
    """
    for sample in problem.samples:
        if sample.protocol.control == "force":
            continue
        for tension, mask in zip(sample.readings[..., 0], sample.protocol.mask, strict=True):
            kept = tension[mask]
            if len(kept) and kept[0] > 1.0 and kept[-1] < 0.05 * kept[0]:
                return False
    return True


def _as_it_is(problem: Problem) -> Problem:
    return problem


def _with_first_readings(problem: Problem, protocol: str, seed: int) -> Problem:
    """First readings from a wire of its own, drawn anew until every hold pulls: they are given, so they may not know
    the truth that is to be found from the later ones. Under weights every hold pulls."""
    test = BENCHES[protocol].experiment()
    chain = build([test], scales=planned_scales([test]))
    rng = np.random.default_rng(seed_of(seed, "first readings"))
    while True:
        made = [readings(chain, chain.prior.rvs(1, rng), sample, rng) for sample in chain.samples]
        if test.control == "force" or all((y[:, 0] > 0).all() for y in made):
            return with_readings(problem, made)
