"""wirebayes itself, plain emcee and dynesty: samplers that want values alone."""

import time
from contextlib import ExitStack
from unittest.mock import patch

import emcee
import numpy as np

from analyses.benchmarks.measure import Costs, judged, looked_at
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import modes
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import ensemble, kept, stop_rule


def ours(problem, seed, seconds, wanted=20_000):
    """A fit as a user gets it, asked for `wanted` effective draws."""
    costs, target = Costs(), LogPosterior(problem)

    def watched(function):
        def timed(*given):
            with costs.part("sample"):
                return function(*given)

        return timed

    # kept draws and the stop rule apart from search and burn-in, in the one run that counts
    parts = ((kept, "more"), (stop_rule, "apply"))
    with ExitStack() as patches, costs.part("burn"):
        for module, name in parts:
            patches.enter_context(patch.object(module, name, watched(getattr(module, name))))
        chains = ensemble.sample_posterior(target, seed, Policy(ess=wanted))
    for book in (costs.cpu, costs.wall):
        book["burn"] -= book["sample"]
    z = chains.z
    theta = target.coordinates.to_natural(z.reshape(-1, z.shape[-1])).reshape(z.shape)
    values = looked_at(problem, theta)
    return judged(costs, values, evaluations=chains.evaluations, kept_evaluations=chains.kept_evaluations), values


def stretch(problem, seed, seconds, natural=True, walkers=128):
    """Plain emcee, four ensembles about the best point (which it is given), vectorised over its walkers."""
    costs, target = Costs(), LogPosterior(problem)
    rng = np.random.default_rng(seed)
    log_prior = problem.prior.log_density()

    def density(theta):
        with np.errstate(all="ignore"):
            prior = log_prior(theta)
        good = np.isfinite(prior)
        value = np.full(len(theta), -np.inf)
        if good.any():
            value[good] = prior[good] + problem.log_likelihood(theta[good])
        return value

    with costs.part("start"):
        found = modes(target, rng)
        start = (
            found.z[0]
            + 0.1 * rng.normal(size=(4, walkers, len(found.z[0]))) @ np.linalg.cholesky(found.covariance[0]).T
        )
    use = density if natural else target
    samplers, states = [], []
    for i in range(4):
        x = target.coordinates.to_natural(start[i].copy()) if natural else start[i]
        samplers.append(emcee.EnsembleSampler(walkers, x.shape[1], use, vectorize=True))
        samplers[-1].random_state = np.random.RandomState(seed + i).get_state()
        states.append(x)
    began = time.process_time()
    with costs.part("sample"):
        while time.process_time() - began < seconds:
            for i, sampler in enumerate(samplers):
                states[i] = sampler.run_mcmc(states[i], 200)
    steps = samplers[0].iteration
    discard = steps // 4  # a quarter of the run, its cost counted as burn-in
    for book in (costs.cpu, costs.wall):
        book["burn"], book["sample"] = 0.25 * book["sample"], 0.75 * book["sample"]
    x = np.stack([s.get_chain(discard=discard) for s in samplers])
    theta = x if natural else target.coordinates.to_natural(x.reshape(-1, x.shape[-1])).reshape(x.shape)
    values = looked_at(problem, theta)
    evaluations = 4 * walkers * steps
    return judged(costs, values, evaluations=evaluations, kept_evaluations=evaluations - 4 * walkers * discard), values


def dynesty_run(problem, seed, seconds, sample="auto"):
    """dynesty's nested sampler in the prior's unit cube, with the compiled likelihood, to its default end.

    Its default way to new points in so few dimensions is to draw them evenly within bounds; "rwalk" walks to them.
    """
    import dynesty
    import jax
    import jax.numpy as jnp
    from scipy.special import ndtri

    from analyses.benchmarks.model import log_likelihood, prior_terms, value_of

    costs, names, terms = Costs(), problem.names, prior_terms(problem)
    function = jax.jit(lambda theta: log_likelihood(jnp, problem)(dict(zip(names, theta, strict=True))))
    centre, scale = np.array([t[2] for t in terms]), np.array([t[3] for t in terms])

    def transform(cube):
        coordinates = centre + scale * ndtri(cube)
        kinds = (kind for _, kind, *_ in terms)
        return np.array([value_of(np, one, kind) for one, kind in zip(coordinates, kinds, strict=True)])

    def value(theta):
        x = float(function(theta))
        return x if np.isfinite(x) else -1e300

    with costs.part("compile"):
        value(transform(np.full(len(terms), 0.5)))
    sampler = dynesty.NestedSampler(
        value, transform, len(terms), nlive=500, sample=sample, rstate=np.random.default_rng(seed)
    )
    began, done = time.process_time(), True
    with costs.part("sample"):
        for it, _ in enumerate(sampler.sample(dlogz=0.01)):
            if it % 100 == 0 and time.process_time() - began > seconds:
                done = False
                break
        if done:
            list(sampler.add_live_points())
    results = sampler.results
    weights = np.exp(results.logwt - results.logwt.max())
    weights /= weights.sum()
    rng = np.random.default_rng(seed)
    theta = results.samples[rng.choice(len(weights), 20_000, p=weights)]
    values = looked_at(problem, theta)[None, :, None, :]
    out = judged(costs, values, weights_ess=1.0 / (weights**2).sum())
    out["converged"] = done
    return out, values
