"""emcee without scipy.stats is still whole for whoever uses it otherwise."""

import subprocess
import sys


def test_the_move_that_needs_scipy_s_statistics_finds_them_when_it_runs():
    code = (
        "import sys, numpy as np\n"
        "import wirebayes.inference.sampler.emcee_core, emcee\n"
        "assert 'scipy.stats' not in sys.modules\n"
        "sampler = emcee.EnsembleSampler(8, 2, lambda x: -0.5 * x @ x, moves=emcee.moves.KDEMove())\n"
        "sampler.run_mcmc(np.random.default_rng(0).normal(size=(8, 2)), 20)\n"
        "assert 'scipy.stats' in sys.modules and sampler.acceptance_fraction.max() > 0\n"
    )
    subprocess.run([sys.executable, "-c", code], check=True)
