"""The posterior by emcee: independent ensembles, a learned move, a written stop rule, exact resumption.

Policy. The modes found from many starts give the first proposal. Burn-in runs in rounds; after each the proposal
mixture is fitted anew to the draws of this round and the one before, and the walkers whose log density lies hopelessly
below the others' (stuck in a far mode of no weight) are set back to draws of the proposal, which is allowed only here.
Rounds grow longer while the proposal leaves out a tail that walkers have found. Then the proposal is frozen and draws
are kept, block by block, until for every parameter

- the effective sample size from the autocorrelation time is at least `Policy.ess`,
- the kept steps span the five autocorrelation times that its estimate sums over (about 1,000 walkers are averaged in
  it, so that its error is then below a tenth), and
- the nested R-hat with the ensembles as super-chains is at most `Policy.r_hat`,

or until `Policy.most_steps`: then the result says *not converged*, and why.
"""

import pickle
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import emcee
import numpy as np
from numpy.typing import NDArray

from wirebayes.bayes import mixture as mixtures
from wirebayes.bayes.coordinates import Target
from wirebayes.bayes.moves import IndependenceMove
from wirebayes.bayes.optimum import Optimum, modes

Array = NDArray[Any]


@dataclass(frozen=True)
class Policy:
    """What is asked of a chain before its draws are believed.

    Attributes
    ----------
    ensembles, walkers : int
        Independent ensembles, and walkers in each.
    ess : float
        Effective draws wanted of every parameter, all ensembles together.
    r_hat : float
        Largest nested R-hat allowed.
    rounds, round_steps : int
        Burn-in: rounds of steps between two fits of the proposal, at least this many rounds.
    most_rounds : int
        More rounds, each longer, are run while too few moves are taken or the proposal leaves out a tail; this many
        at most.
    tail : float
        A proposal leaves out a tail when the log of posterior over proposal, at its 99.9 % quantile over the walkers,
        lies this far above its median: walkers that reach such places stay there for very long.
    components : int
        The most components of the proposal.
    acceptance : float
        Below this share after burn-in, the learned move gives way to differential evolution alone.
    block, most_steps : int
        Kept steps between two looks at the stop rule; the most of them.
    """

    ensembles: int = 4
    walkers: int = 256
    ess: float = 4000.0
    r_hat: float = 1.01
    rounds: int = 3
    round_steps: int = 16
    most_rounds: int = 6
    tail: float = 4.0
    acceptance: float = 0.05
    components: int = 8
    block: int = 40
    most_steps: int = 4000


DEFAULT = Policy()


@dataclass(frozen=True)
class Chains:
    """Kept draws and how they came about.

    Attributes
    ----------
    z : (ensembles, steps, walkers, d) array
        Sampled coordinates.
    log_density : (ensembles, steps, walkers) array
    autocorrelation_steps, ess, r_hat : (d,) arrays
        Of the natural parameters.
    converged : bool
    why : str
        The stop rule's words.
    evaluations, kept_evaluations : int
        Likelihood evaluations of everything, and of the kept steps alone.
    acceptance : float
        Share of accepted moves among kept steps.
    learned : bool
        False when the learned move was given up.
    modes : int
        Distinct modes found before sampling.
    stuck : int
        Walkers set back during burn-in.
    """

    z: Array
    log_density: Array
    autocorrelation_steps: Array
    ess: Array
    r_hat: Array
    converged: bool
    why: str
    evaluations: int
    kept_evaluations: int
    acceptance: float
    learned: bool
    modes: int
    stuck: int


def sample(
    target: Target,
    seed: int,
    policy: Policy = DEFAULT,
    *,
    checkpoint: Path | None = None,
    progress: Callable[[float], None] = lambda share: None,
    found: Optimum | None = None,
    near: Array | None = None,
) -> Chains:
    """Sample a posterior (see the module's policy).

    Parameters
    ----------
    target : Target
    seed : int
    policy : Policy
    checkpoint : Path, optional
        A file that is rewritten whole after each block; a later call with the same arguments goes on from it and
        ends with the same bytes. It is the caller's business that the configuration is the same.
    progress : function of a share between 0 and 1
    found : Optimum, optional
        Modes already known, instead of a search.
    near : (m, d) array, optional
        Sampled coordinates that the search should climb from, too.

    Returns
    -------
    Chains
    """
    state = _State.load(checkpoint) or _begin(target, seed, policy, found, near)
    state.save(checkpoint)
    while not state.finished:
        if not state.frozen:
            _burn_in_round(target, state, policy)
            progress(0.2 * state.round / policy.rounds if state.round < policy.rounds else 0.2)
        else:
            _kept_block(target, state, policy)
            _look(target, state, policy)
            progress(min(1.0, 0.2 + 0.8 * float(state.ess.min()) / policy.ess))
        state.save(checkpoint)
    z = np.stack([np.concatenate(blocks) for blocks in state.kept_z])
    log_density = np.stack([np.concatenate(blocks) for blocks in state.kept_log_density])
    return Chains(
        z, log_density, state.autocorrelation, state.ess, state.r_hat, state.converged, state.why, state.evaluations,
        state.kept_evaluations, state.accepted / max(state.proposed, 1), state.learned, state.modes, state.stuck,
    )  # fmt: skip


@dataclass
class _State:
    """Everything a resumed run needs, in one pickled file of our own making."""

    positions: list[Array]
    values: list[Array]
    randoms: list[Any]
    proposal: mixtures.Mixture
    safety: mixtures.Mixture
    generator: np.random.Generator
    modes: int
    evaluations: int
    round: int = 0
    frozen: bool = False
    learned: bool = True
    stuck: int = 0
    seen: Any = None
    kept_z: Any = None
    kept_log_density: Any = None
    kept_evaluations: int = 0
    accepted: int = 0
    proposed: int = 0
    autocorrelation: Any = None
    ess: Any = None
    r_hat: Any = None
    finished: bool = False
    converged: bool = False
    why: str = ""

    @staticmethod
    def load(path: Path | None) -> "_State | None":
        if path is None or not path.exists():
            return None
        with path.open("rb") as stream:
            state: _State = pickle.load(stream)
        return state

    def save(self, path: Path | None) -> None:
        if path is not None:
            part = path.with_name(path.name + ".part")
            part.write_bytes(pickle.dumps(self))
            part.replace(path)


def _begin(target: Target, seed: int, policy: Policy, found: Optimum | None, near: Array | None) -> _State:
    spawned = np.random.SeedSequence(seed).spawn(policy.ensembles + 1)
    rng = np.random.default_rng(spawned[0])
    before = target.evaluations
    found = found or modes(target, rng, extra=near)
    proposal = mixtures.from_modes(found.z, found.covariance * _OVERDISPERSED, found.log_evidence)
    positions, values, randoms = [], [], []
    for sequence in spawned[1:]:
        random = np.random.RandomState(np.random.MT19937(sequence))
        drawn, value = _finite_draws(target, proposal, policy.walkers, random)
        positions.append(drawn)
        values.append(value)
        randoms.append(random.get_state())
    return _State(positions, values, randoms, proposal, proposal, rng, len(found.z), target.evaluations - before)


def _finite_draws(target: Target, proposal: mixtures.Mixture, n: int, random: Any) -> tuple[Array, Array]:
    """Draws of the proposal where the density is above zero, and its logarithm there."""
    drawn, values = np.empty((0, proposal.centres.shape[1])), np.empty(0)
    while len(drawn) < n:
        z = proposal.rvs(n, random)
        value = target(z)
        good = np.isfinite(value)
        drawn, values = np.vstack([drawn, z[good]]), np.concatenate([values, value[good]])
    return drawn[:n], values[:n]


def _moves(state: _State) -> list[tuple[Any, float]]:
    evolution = [(emcee.moves.DEMove(), 0.8), (emcee.moves.DEMove(gamma0=1.0), 0.2)]
    if not state.learned:
        return evolution
    share = _EVOLUTION if state.frozen else _EXPLORATION
    return [(IndependenceMove(state.proposal), 1.0 - share), (evolution[0][0], share)]


def _advance(target: Target, state: _State, policy: Policy, i: int, steps: int, moves: Any) -> Any:
    """Run one ensemble on; its position and random state are left in `state`."""
    sampler = emcee.EnsembleSampler(policy.walkers, state.positions[i].shape[1], target, moves=moves, vectorize=True)
    before = target.evaluations
    start = emcee.State(state.positions[i], log_prob=state.values[i], random_state=state.randoms[i])
    end = sampler.run_mcmc(start, steps, skip_initial_state_check=True)
    state.positions[i], state.values[i], state.randoms[i] = end.coords, end.log_prob, sampler.random_state
    used = target.evaluations - before
    state.evaluations += used
    return sampler, used


def _burn_in_round(target: Target, state: _State, policy: Policy) -> None:
    tails, acceptance, weights = [], [], []
    moves = _moves(state)
    steps = policy.round_steps * 2 ** int(np.clip(state.round - policy.rounds + 1, 0, 2))
    forgotten = steps // 2 if state.round == 0 else 0
    for i in range(policy.ensembles):
        sampler, _ = _advance(target, state, policy, i, steps, moves)
        tail = sampler.get_chain(discard=forgotten, flat=True)
        weights.append(sampler.get_log_prob(discard=forgotten, flat=True) - state.proposal.log_density(tail))
        tails.append(tail)
        acceptance.append(sampler.acceptance_fraction.mean())
    state.round += 1
    _free_stuck_walkers(target, state)
    middle, high = np.quantile(np.concatenate(weights), [0.5, 0.999])
    good = float(np.mean(acceptance)) > _GOOD_ACCEPTANCE and high - middle < policy.tail
    if state.round >= policy.rounds and (good or state.round >= policy.most_rounds):
        state.frozen = True
        state.learned = float(np.mean(acceptance)) > policy.acceptance
        state.kept_z = [[] for _ in range(policy.ensembles)]
        state.kept_log_density = [[] for _ in range(policy.ensembles)]
    points = np.concatenate(tails)
    before, state.seen = state.seen, points
    if before is not None and state.round > 2:
        points = np.concatenate([before, points])
    try:
        fitted = mixtures.fit(points, state.generator, most=policy.components)
        # What the start knew stays in reach: small modes, and tails that the burn-in has not walked.
        safety = mixtures.blend(state.safety, mixtures.wider(fitted, 2.0), 0.5)
        state.proposal = mixtures.blend(fitted, safety, _SAFETY)
    except np.linalg.LinAlgError:
        pass  # too few distinct points yet: keep the proposal that made them


def _free_stuck_walkers(target: Target, state: _State) -> None:
    """Set walkers far below the others back to the proposal's draws; a step outside the chain, so burn-in only."""
    d = state.positions[0].shape[1]
    floor = np.median(np.concatenate(state.values)) - 0.5 * d - 15.0
    for i, value in enumerate(state.values):
        low = np.flatnonzero(value < floor)
        if not len(low):
            continue
        random = np.random.RandomState()
        random.set_state(state.randoms[i])
        good = np.flatnonzero(value >= floor)
        if len(good) > 2 * d:
            taken = random.choice(good, len(low))
            state.positions[i][low], state.values[i][low] = state.positions[i][taken], value[taken]
        else:
            before = target.evaluations
            state.positions[i][low], state.values[i][low] = _finite_draws(target, state.proposal, len(low), random)
            state.evaluations += target.evaluations - before
        state.randoms[i] = random.get_state()
        state.stuck += len(low)


def _kept_block(target: Target, state: _State, policy: Policy) -> None:
    moves = _moves(state)
    for i in range(policy.ensembles):
        sampler, used = _advance(target, state, policy, i, policy.block, moves)
        state.kept_z[i].append(sampler.get_chain())
        state.kept_log_density[i].append(sampler.get_log_prob())
        state.kept_evaluations += used
        state.accepted += int(sampler.backend.accepted.sum())
        state.proposed += policy.block * policy.walkers


def _look(target: Target, state: _State, policy: Policy) -> None:
    """Apply the stop rule to the draws kept so far."""
    z = np.stack([np.concatenate(blocks) for blocks in state.kept_z])
    steps, d = z.shape[1], z.shape[-1]
    theta = target.coordinates.to_natural(z.reshape(-1, d)).reshape(z.shape)
    # Logarithms of positive parameters: a heavy tail must not hide the walk.
    values = np.where(target.coordinates.log_columns, np.log(np.abs(theta) + 1e-300), theta)
    state.autocorrelation = autocorrelation_steps(values)
    state.ess = values.shape[0] * steps * values.shape[2] / state.autocorrelation
    state.r_hat = nested_r_hat(values)
    long_enough = steps >= _WINDOW * state.autocorrelation.max()
    if long_enough and (state.ess >= policy.ess).all() and (state.r_hat <= policy.r_hat).all():
        state.finished, state.converged = True, True
        least, most = float(state.ess.min()), float(state.r_hat.max())
        state.why = f"after {steps} steps: smallest ESS {least:.0f}, largest nested R-hat {most:.4f}"
    elif steps >= policy.most_steps:
        names = target.problem.names
        worst = names[int(np.argmin(state.ess))]
        state.finished = True
        state.why = (
            f"not converged after {steps} steps: {worst} has ESS {state.ess.min():.0f} (wanted {policy.ess:.0f}), "
            f"largest nested R-hat {state.r_hat.max():.4f} (allowed {policy.r_hat})"
        )


def autocorrelation_steps(values: Array) -> Array:
    """(d,) integrated autocorrelation time in steps, of (ensembles, steps, walkers, d) draws.

    The autocovariance about the mean of all ensembles is averaged over all walkers before the sum (the window is
    Sokal's, five times the time), so that walkers stuck apart lengthen it instead of vanishing into their own means.
    """
    m, steps, walkers, d = values.shape
    centred = values - values.mean(axis=(0, 1, 2))
    size = 1 << (2 * steps - 1).bit_length()
    out = np.empty(d)
    for k in range(d):
        series = np.moveaxis(centred[..., k], 1, -1).reshape(-1, steps)
        transform = np.fft.rfft(series, size, axis=-1)
        power = (transform.real**2 + transform.imag**2).sum(axis=0)
        covariance = np.fft.irfft(power, size)[:steps] / np.arange(steps, 0, -1)
        if covariance[0] <= 0:
            out[k] = np.inf
            continue
        times = 2.0 * np.cumsum(covariance / covariance[0]) - 1.0
        window = np.flatnonzero(np.arange(steps) >= _WINDOW * times)
        out[k] = max(times[window[0] if len(window) else -1], 1.0)
    return out


def nested_r_hat(values: Array) -> Array:
    """(d,) nested R-hat of (ensembles, steps, walkers, d) draws, each ensemble a super-chain of its walkers."""
    walker_means = values.mean(axis=1)
    between_walkers = walker_means.var(axis=1, ddof=1)
    within_walkers = values.var(axis=1, ddof=1).mean(axis=1)
    between = walker_means.mean(axis=1).var(axis=0, ddof=1)
    return np.sqrt(1.0 + between / (between_walkers + within_walkers).mean(axis=0))


def describe(policy: Policy) -> dict[str, Any]:
    """The policy as plain values, for provenance."""
    return asdict(policy)


_WINDOW = 5.0  # Sokal's: autocorrelations are summed over so many autocorrelation times
_OVERDISPERSED = 1.7
_GOOD_ACCEPTANCE = 0.25
_EVOLUTION = 0.1  # share of steps that do not trust the proposal
_EXPLORATION = 0.4  # the same in burn-in, whose draws should reach the tails for the proposal to learn them
_SAFETY = 0.1  # share of the proposal that does not trust its fit
