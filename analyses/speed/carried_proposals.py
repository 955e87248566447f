"""Would proposals learned on one test fit the next test of a batch?

Tests of one protocol on simulated wires are sampled. Each one's frozen proposal is then moved and stretched, by mode
and covariance there, to every other test, and its draws are weighted by that posterior. A line a test: the share of
effective draws of its own proposal before each round of learning and when it is frozen, and of the others' proposals.

    python -m analyses.speed.carried_proposals
"""

from typing import Any

import numpy as np

import wirebayes as wb
from analyses.options import study_options
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.policy import DEFAULT
from wirebayes.inference.sampler import burn_in, proposal
from wirebayes.inference.sampler.state import Sampling, State
from wirebayes.model.build import build
from wirebayes.numeric.resampling import effective_number
from wirebayes.processes.workers import workers

_DRAWS = 4000


def drawn(of: Any) -> tuple[np.ndarray, np.ndarray]:
    """Draws (n, d) of a proposal and their log densities (n,)."""
    rng = np.random.default_rng(1)
    points = rng.uniform(size=(_DRAWS, len(of.start.centres[0]) + 1))
    z = proposal.components(of).from_cube(points, rng)
    return z, of.log_density(z)


def share(log_weight: np.ndarray) -> float:
    """Effective draws a draw."""
    return effective_number(np.exp(log_weight - log_weight.max())) / len(log_weight)


def learned(experiment: Any) -> tuple[list[float], Any, np.ndarray, np.ndarray]:
    """Shares before each round and at the end, the frozen proposal, the best mode (d,) and its covariance's factor."""
    target = LogPosterior(build([experiment]))
    state: State = burn_in.init(target, 0, DEFAULT, None, None, None)
    shares = []
    while True:
        z, log_density = drawn(state.learned.proposal)
        shares.append(share(target(z) - log_density))
        if isinstance(state, Sampling):
            break
        state = burn_in.burn_in_round(target, state, DEFAULT)
    start = state.learned.start  # as wide as the modes, but for a factor that all tests have in common
    best = int(np.argmax(target(start.centres)))
    return shares, state.learned.proposal, start.centres[best], start.factors[best]


def main() -> None:
    """Print a line a test, then medians."""
    options = study_options(__doc__, tests=14).parse_args()
    experiments = wb.simulate_tests(tests=options.tests, seed=3).experiments
    with workers() as parallel_map:
        found = list(parallel_map(learned, experiments))
    first, frozen, carried = [], [], []
    for j, (own, _, middle, factor) in enumerate(found):
        target, others = LogPosterior(build([experiments[j]])), []
        for i, (_, other, its_middle, its_factor) in enumerate(found):
            if i != j:
                z, log_density = drawn(other)
                z = middle + np.linalg.solve(its_factor, (z - its_middle).T).T @ factor.T
                others.append(share(target(z) - log_density))  # the map's determinant is a constant
        print(
            f"{experiments[j].name:8s} own {' '.join(f'{s:.2f}' for s in own)}   others' "
            f"{min(others):.2f} to {max(others):.2f}, median {np.median(others):.2f}",
            flush=True,
        )
        first.append(own[0])
        frozen.append(own[-1])
        carried += others
    print(f"median: own first {np.median(first):.2f}, frozen {np.median(frozen):.2f}, others' {np.median(carried):.2f}")


if __name__ == "__main__":
    main()
