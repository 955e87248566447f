"""Do independent runs on the same posterior agree within the error that their effective draws promise?

The plain model on the paper's four wires with both likelihoods, or single effects with the chain likelihood:

    python -m analyses.posterior.sampler_agreement
    python -m analyses.posterior.sampler_agreement --effects clamp_transient second_relaxation --ess 20000

A line a posterior: how many runs converged; the spread of means over what is promised, root mean square over parameters
and largest; the same of the shares of draws in the 5 % tails; the largest difference of two means, in posterior
standard deviations. Parameters that are positive are compared as logarithms.
"""

from functools import partial

import numpy as np

from analyses.options import study_options
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.inference.sampler import ensemble
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.sample import Likelihood
from wirebayes.model.spec import ModelSpec
from wirebayes.processes.workers import workers

FIRST = 100
TAILS = (0.05, 0.95)


def run(seed: int, wire: int, effect: str | None, likelihood: Likelihood, ess: float):
    """Whether one run converged, its draws (n, d), positive parameters as logarithms, and effective draws (d,)."""
    problem = build(
        [experiments()[wire]], [effect_named(effect)] if effect else [], spec=ModelSpec(likelihood=likelihood)
    )
    target = LogPosterior(problem)
    chains = ensemble.sample_posterior(target, seed, Policy(ess=ess))
    theta = target.coordinates.to_natural(chains.z.reshape(-1, chains.z.shape[-1]))
    logs = [name in problem.prior.logarithmic for name in problem.names]
    theta[:, logs] = np.log(theta[:, logs])
    return chains.converged, theta, chains.ess


def agreement(runs):
    """Of several runs: how many converged, spreads (d,) of means and (2, d) of tails over promised, means apart."""
    converged, draws, ess = zip(*runs, strict=True)
    sd, promised = np.mean([d.std(axis=0) for d in draws], axis=0), np.mean(np.sqrt(ess), axis=0)
    means = np.array([d.mean(axis=0) for d in draws])
    low, high = np.mean([np.quantile(d, TAILS, axis=0) for d in draws], axis=0)
    tails = np.array([[(d < low).mean(axis=0), (d > high).mean(axis=0)] for d in draws])
    share = np.sqrt(TAILS[0] * TAILS[1])  # standard deviation of being in a tail
    apart = float((np.ptp(means, axis=0) / sd).max())
    spreads = means.std(axis=0, ddof=1) / sd, tails.std(axis=0, ddof=1) / share
    return sum(converged), *(spread * promised for spread in spreads), apart


def main() -> None:
    parser = study_options(__doc__)
    parser.add_argument("--effects", nargs="+", choices=[*CATALOGUE, "all"], default=[])
    parser.add_argument("--wires", nargs="+", type=int, choices=range(4), default=list(range(4)))
    parser.add_argument("--seeds", type=int, default=12)
    parser.add_argument("--ess", type=float, default=DEFAULT.ess)
    options = parser.parse_args()
    effects = list(CATALOGUE) if "all" in options.effects else options.effects or [None]
    likelihoods: tuple[Likelihood, ...] = ("chain",) if options.effects else ("chain", "hold")
    seeds = range(FIRST, FIRST + options.seeds)
    with workers() as parallel_map:
        for wire in options.wires:
            for effect, likelihood in ((e, k) for e in effects for k in likelihoods):
                of = partial(run, wire=wire, effect=effect, likelihood=likelihood, ess=options.ess)
                converged, means, tails, apart = agreement(list(parallel_map(of, seeds)))
                both = (f"{np.sqrt((r**2).mean()):.2f} {r.max():.2f}" for r in (means, tails))
                print(
                    f"{experiments()[wire].name:15s} {effect or 'plain':24s} {likelihood:5s}  "
                    f"{converged} of {len(seeds)} converged  means {next(both)}  tails {next(both)}  "
                    f"apart {apart:.3f}",
                    flush=True,
                )


if __name__ == "__main__":
    main()
