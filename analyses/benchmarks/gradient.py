"""NumPyro, blackjax and nutpie: samplers that want gradients, on the model of `model`."""

import time

import jax
import jax.numpy as jnp
import numpy as np

from analyses.benchmarks import model
from analyses.benchmarks.measure import Costs, judged, looked_at
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.inference.modes import modes

jax.config.update("jax_enable_x64", True)
CHAINS, PILOT = 4, 100
_COMPILING = {f"/jax/core/compile/{part}_duration" for part in ("jaxpr_to_mlir_module", "backend_compile")}
_compiled = []
jax.monitoring.register_event_duration_secs_listener(
    lambda event, seconds, **_: _compiled.append(seconds) if event in _COMPILING else None
)


def _settled(costs, source):
    """Move what JAX spent on compiling since the last call out of a part."""
    costs.move(sum(_compiled), source, "compile")
    _compiled.clear()


def _log_density(problem, target):
    """log posterior in our coordinates (an array), and the parameters there."""
    convert, likelihood = model.natural(jnp, problem, target.coordinates), model.log_likelihood(jnp, problem)

    def density(z):
        theta, prior = convert(z)
        return prior + likelihood(theta)

    return density


def _log_parameters(problem):
    """log posterior where every prior is normal: what a library's own transformation of natural parameters makes."""
    terms, likelihood = model.prior_terms(problem), model.log_likelihood(jnp, problem)

    def density(v):
        theta = {name: model.value_of(jnp, v[i], kind) for i, (name, kind, *_) in enumerate(terms)}
        log_prior = sum(-0.5 * ((v[i] - m) / s) ** 2 for i, (_, _, m, s) in enumerate(terms))
        return log_prior + likelihood(theta)

    return density


def _values(problem, target, x, natural):
    """What is judged, from (..., d) draws in the coordinates that were sampled."""
    if natural:
        kinds = [kind for _, kind, *_ in model.prior_terms(problem)]
        theta = np.stack([model.value_of(np, x[..., i], kind) for i, kind in enumerate(kinds)], axis=-1)
    else:
        theta = target.coordinates.to_natural(x.reshape(-1, x.shape[-1]).copy()).reshape(x.shape)
    return looked_at(problem, theta)


def numpyro_nuts(problem, seed, seconds, natural=True):
    """NumPyro's NUTS with a dense mass matrix, four chains side by side, 500 steps of warm-up."""
    import numpyro
    import numpyro.distributions as dist
    from numpyro.infer import MCMC, NUTS

    costs, target, terms = Costs(), LogPosterior(problem), model.prior_terms(problem)
    if natural:
        likelihood = model.log_likelihood(jnp, problem)

        def wire():
            theta = {
                name: model.value_of(jnp, numpyro.sample(name, dist.Normal(m, s)), kind) for name, kind, m, s in terms
            }
            numpyro.factor("readings", likelihood(theta))

        kernel = NUTS(wire, dense_mass=True)
    else:
        density = _log_density(problem, target)
        kernel = NUTS(potential_fn=lambda z: -density(z), dense_mass=True)
    _compiled.clear()
    mcmc = MCMC(
        kernel, num_warmup=500, num_samples=PILOT, num_chains=CHAINS, chain_method="vectorized", progress_bar=False
    )
    start = None
    if not natural:
        with costs.part("start"):
            start = _starts(target, seed, CHAINS)
    with costs.part("burn"):
        mcmc.warmup(jax.random.PRNGKey(seed), init_params=start)
    _settled(costs, "burn")
    # a run compiles anew: a first one, which is not counted, tells how many draws a single one can make in the time
    pilot = Costs()
    _sampled(mcmc, pilot, PILOT)
    steps = max(int(PILOT * seconds / pilot.cpu["sample"]), PILOT)
    draws = _sampled(mcmc, costs, steps)
    x = np.stack([draws[name] for name in problem.names], -1) if natural else draws
    divergences = int(np.asarray(mcmc.get_extra_fields()["diverging"]).sum())
    values = _values(problem, target, x[:, :, None], natural)
    return judged(costs, values, divergences=divergences), values


def _sampled(mcmc, costs, steps):
    """So many draws of each chain after the last of them."""
    mcmc.num_samples, mcmc.post_warmup_state = steps, mcmc.last_state
    with costs.part("sample"):
        mcmc.run(mcmc.post_warmup_state.rng_key)
        draws = jax.tree.map(np.asarray, mcmc.get_samples(group_by_chain=True))
    _settled(costs, "sample")
    return draws


def _starts(target, seed, n):
    """(n, d) points about our best mode; the cost is charged."""
    rng = np.random.default_rng(seed)
    found = modes(target, rng)
    return found.z[0] + rng.normal(size=(n, len(found.z[0]))) @ np.linalg.cholesky(found.covariance[0]).T


def _begin(problem, target, costs, seed, n, natural):
    with costs.part("start"):
        z = _starts(target, seed, n)
    if not natural:
        return z
    theta = target.coordinates.to_natural(z)
    kinds = [kind for _, kind, *_ in model.prior_terms(problem)]
    return np.column_stack([model.coordinate_of(theta[:, i], kind) for i, kind in enumerate(kinds)])


def blackjax_nuts(problem, seed, seconds, natural=False):
    """blackjax's NUTS on the jitted density: window adaptation with a dense mass matrix, four chains mapped at once."""
    import blackjax

    costs, target = Costs(), LogPosterior(problem)
    density = _log_parameters(problem) if natural else _log_density(problem, target)
    start = jnp.asarray(_begin(problem, target, costs, seed, CHAINS, natural))
    _compiled.clear()
    warm = blackjax.window_adaptation(blackjax.nuts, density, is_mass_matrix_diagonal=False)

    @jax.jit
    def adapt(keys, x):
        return jax.vmap(lambda key, one: warm.run(key, one, num_steps=500)[0])(keys, x)

    @jax.jit
    def block(key, state, step_size, mass):
        def one(key, state, step_size, mass):
            kernel = blackjax.nuts(density, step_size, mass).step

            def step(state, key):
                state, info = kernel(key, state)
                return state, (state.position, info.is_divergent)

            return jax.lax.scan(step, state, jax.random.split(key, 200))

        return jax.vmap(one)(jax.random.split(key, CHAINS), state, step_size, mass)

    key = jax.random.PRNGKey(seed)
    with costs.part("burn"):
        state, tuned = jax.block_until_ready(adapt(jax.random.split(key, CHAINS), start))
    _settled(costs, "burn")
    blocks, divergences, began = [], 0, time.process_time()
    while time.process_time() - began < seconds or not blocks:
        key, now = jax.random.split(key)
        with costs.part("sample"):
            state, (x, bad) = jax.block_until_ready(block(now, state, tuned["step_size"], tuned["inverse_mass_matrix"]))
        _settled(costs, "sample")
        blocks.append(np.asarray(x))
        divergences += int(np.asarray(bad).sum())
    values = _values(problem, target, np.concatenate(blocks, axis=1)[:, :, None], natural)
    return judged(costs, values, divergences=divergences), values


def chees(problem, seed, seconds, natural=False, chains=256):
    """ChEES-HMC (blackjax) with many chains, in units of our mode's covariance so that one step size suits all."""
    import blackjax
    import optax

    costs, target = Costs(), LogPosterior(problem)
    plain = _log_parameters(problem) if natural else _log_density(problem, target)
    start = _begin(problem, target, costs, seed, chains, natural)
    centre, root = start.mean(0), np.linalg.cholesky(np.cov(start.T))

    def density(u):
        return plain(jnp.asarray(centre) + jnp.asarray(root) @ u)

    u = jnp.asarray(np.linalg.solve(root, (start - centre).T).T)
    _compiled.clear()
    warm = blackjax.chees_adaptation(density, chains, max_leapfrog_steps=64)
    key = jax.random.PRNGKey(seed)
    with costs.part("burn"):
        (state, tuned), _ = jax.block_until_ready(warm.run(key, u, 0.3, optax.adam(0.02), 150))
    _settled(costs, "burn")
    kernel = blackjax.dynamic_hmc(density, **tuned).step

    @jax.jit
    def block(key, state):
        def step(state, key):
            state, info = jax.vmap(kernel)(jax.random.split(key, chains), state)
            return state, (state.position, info.is_divergent)

        return jax.lax.scan(step, state, jax.random.split(key, 50))

    blocks, divergences, began = [], 0, time.process_time()
    while time.process_time() - began < seconds or not blocks:
        key, now = jax.random.split(key)
        with costs.part("sample"):
            state, (x, bad) = jax.block_until_ready(block(now, state))
        _settled(costs, "sample")
        blocks.append(np.asarray(x))
        divergences += int(np.asarray(bad).sum())
    x = np.concatenate(blocks) @ root.T + centre
    x = np.stack(np.split(x, 4, axis=1))  # groups of chains stand in for ensembles
    values = _values(problem, target, x, natural)
    return judged(costs, values, divergences=divergences), values


def nutpie_run(problem, seed, seconds, natural=True):
    """nutpie on a PyMC model, compiled by numba, four chains one after the other."""
    import nutpie
    import pymc as pm
    import pytensor.tensor as pt

    costs, target, terms = Costs(), LogPosterior(problem), model.prior_terms(problem)
    likelihood = model.log_likelihood(pt, problem)
    with costs.part("compile"):
        with pm.Model() as wire:
            if natural:
                theta = {name: model.value_of(pt, pm.Normal(name, m, s), kind) for name, kind, m, s in terms}
                pm.Potential("readings", likelihood(theta))
            else:
                z = pm.Flat("z", shape=len(terms), initval=_starts(target, seed, 1)[0])
                theta, prior = model.natural(pt, problem, target.coordinates)(z)
                pm.Potential("posterior", prior + likelihood(theta))
        compiled = nutpie.compile_pymc_model(wire)
    draws, tree, values = 250, None, None
    while True:
        fresh = Costs()
        with fresh.part("sample"):
            running = nutpie.sample(
                compiled, draws=draws, tune=400, chains=CHAINS, cores=1, seed=seed, progress_bar=False, blocking=False
            )
            try:
                tree = running.wait(timeout=2.0 * seconds)
            except TimeoutError:
                running.cancel()
                raise TimeoutError(f"650 steps of four chains were not done in {2.0 * seconds:.0f} s") from None
        if fresh.cpu["sample"] > 0.4 * seconds or draws > 50_000:
            break
        draws *= 4
    stats = tree.warmup_sample_stats.n_steps.values.sum(), tree.sample_stats.n_steps.values.sum()
    share = stats[0] / (stats[0] + stats[1])  # one call does both: its time goes by leapfrog steps
    for book, spent in ((costs.cpu, fresh.cpu), (costs.wall, fresh.wall)):
        book["burn"], book["sample"] = share * spent["sample"], (1.0 - share) * spent["sample"]
    posterior = tree.posterior
    x = np.stack([posterior[name].values for name in problem.names], -1) if natural else posterior["z"].values
    values = _values(problem, target, x[:, :, None], natural)
    return judged(costs, values, divergences=int(tree.sample_stats.diverging.values.sum())), values
