"""An independent sampler, nested sampling by dynesty, on one of the paper's wires."""

import numpy as np
import pytest

from wirebayes.inference.fit import fit_problem
from wirebayes.inference.policy import Policy
from wirebayes.io.paper import experiments
from wirebayes.model.build import build

dynesty = pytest.importorskip("dynesty")


@pytest.mark.slow
@pytest.mark.statistical
@pytest.mark.filterwarnings("ignore")  # dynesty's own
def test_nested_sampling_gives_the_same_posterior():
    """Means within 5 % of a standard deviation, standard deviations within 5 %; scale parameters as logarithms."""
    problem = build([experiments()[1]])
    names, logs = problem.names, problem.prior.logarithmic

    def scaled(theta):
        return np.column_stack([np.log(theta[:, i]) if n in logs else theta[:, i] for i, n in enumerate(names)])

    ours = scaled(fit_problem(problem, 1, policy=Policy(ess=20000.0)).flat)
    means, sds = [], []
    for seed in range(2):
        sampler = dynesty.NestedSampler(
            lambda theta: float(problem.log_likelihood(theta[None])[0]),
            lambda cube: problem.prior.ppf(cube[None])[0],
            len(names),
            nlive=400,
            sample="rwalk",
            walks=150,  # with 50, draws along the ridge of B, U and k2 spread 5 % too little
            rstate=np.random.default_rng(seed),
        )
        sampler.run_nested(print_progress=False, dlogz=0.05)
        drawn = scaled(sampler.results.samples_equal(np.random.default_rng(seed)))
        means.append(drawn.mean(axis=0))
        sds.append(drawn.std(axis=0))
    sd = ours.std(axis=0)
    off = (np.mean(means, axis=0) - ours.mean(axis=0)) / sd
    ratio = np.mean(sds, axis=0) / sd
    for name, o, r in zip(names, off, ratio, strict=True):
        print(f"{name}: mean differs by {o:+.3f} sd, sd ratio {r:.3f}")
    assert np.abs(off).max() < 0.05
    assert np.abs(ratio - 1.0).max() < 0.05
