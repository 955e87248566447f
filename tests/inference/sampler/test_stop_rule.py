"""The stop rule on draws whose memory and agreement are known: what must be refused is, and says why."""

from dataclasses import replace

import numpy as np
import pytest

from tests.statistical.targets import gaussian
from wirebayes.inference.convergence import ENOUGH, autocorrelation_steps, nested_r_hat
from wirebayes.inference.policy import Policy
from wirebayes.inference.sampler import burn_in, kept
from wirebayes.inference.sampler.kept import OUTWEIGHS
from wirebayes.inference.sampler.state import Diagnostics, Kept, Learned, Sampling, Walkers

ENSEMBLES, WALKERS, D = 4, 32, 3
EASY = {"ensembles": ENSEMBLES, "walkers": WALKERS, "ess": 1.0, "r_hat": 10.0, "most_steps": 4000}


def draws(steps: int, memory: float = 0.0, seed: int = 0) -> np.ndarray:
    """(steps, walkers, d) standard normal draws that remember: x' = memory x + noise, from equilibrium."""
    rng = np.random.default_rng(seed)
    out = np.empty((steps, ENSEMBLES * WALKERS, D))
    out[0] = rng.normal(size=out[0].shape)
    for t in range(1, steps):
        out[t] = memory * out[t - 1] + np.sqrt(1 - memory**2) * rng.normal(size=out[0].shape)
    return out


def looked(z: np.ndarray, overlooked: float = 0.0, again: int = 0, **policy: float) -> tuple[Sampling, Diagnostics]:
    """What the rule says of draws."""
    blocks = z[: len(z) // 2], z[len(z) // 2 :]
    learned = Learned(None, None, 1, trusted=overlooked > 0, again=again)  # type: ignore[arg-type]
    state = Sampling(Walkers(z[-1], np.zeros(len(z[-1])), None), learned, None, 0)  # type: ignore[arg-type]
    state = replace(state, kept=Kept(blocks, tuple(np.zeros(block.shape[:2]) for block in blocks)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(burn_in, "overlooked", lambda *given: overlooked)
        found = kept.looked(gaussian(D), state, Policy(**(EASY | policy)))  # type: ignore[arg-type]
    assert found.diagnostics is not None
    return found, found.diagnostics


def by_ensemble(z: np.ndarray) -> np.ndarray:
    return np.moveaxis(z.reshape(len(z), ENSEMBLES, WALKERS, D), 1, 0)


def test_good_draws_converge_and_what_is_said_of_them_is_right() -> None:
    state, about = looked(draws(256), ess=4000.0, r_hat=1.01)
    assert state.finished and state.converged
    assert state.why.startswith("after 256 steps: smallest ESS ")
    assert 0.6 < about.ess.min() / (256 * ENSEMBLES * WALKERS) <= 1.0
    assert about.r_hat.max() < 1.002


@pytest.mark.parametrize("memory", [0.0, 0.5, 0.9])
def test_autocorrelation_is_that_of_the_process(memory: float) -> None:
    found = autocorrelation_steps(by_ensemble(draws(2000, memory)))
    assert found == pytest.approx((1 + memory) / (1 - memory), rel=0.5)  # sd sqrt(2 / 128) = 0.125


def test_what_does_not_move_has_no_end_of_its_memory() -> None:
    z = draws(64)
    z[..., 1] = 3.0
    assert np.isinf(autocorrelation_steps(by_ensemble(z))[1])
    with np.errstate(invalid="ignore"):
        assert not looked(z)[0].converged


@pytest.mark.parametrize(("shift", "agrees"), [(0.0, True), (0.8, False)])
def test_ensembles_must_agree(shift: float, agrees: bool) -> None:
    """Effective draws and length are enough; one ensemble of four lies elsewhere."""
    z = draws(256)
    z[:, :WALKERS, 0] += shift
    state, about = looked(z, r_hat=1.01)
    assert state.converged is agrees and state.finished is agrees
    # four ensemble means, one of them off: variance shift² / 4 beside the draws' own 1
    assert about.r_hat[0] == pytest.approx(np.sqrt(1 + shift**2 / 4), abs=0.01)


def test_nested_r_hat_by_hand() -> None:
    """Two ensembles of two walkers with two steps: between means 2, between walkers 0.5, within walkers 2."""
    walkers = np.array([[[0.0, 2.0], [1.0, 3.0]], [[2.0, 4.0], [3.0, 5.0]]])  # ensemble, walker, step
    values = np.moveaxis(walkers, 2, 1)[..., None]
    assert nested_r_hat(values) == pytest.approx(np.sqrt(1 + 2.0 / (0.5 + 2.0)))


@pytest.mark.parametrize(("steps", "enough"), [(40, False), (400, True)])
def test_a_chain_must_span_its_memory_five_times(steps: int, enough: bool) -> None:
    state, about = looked(draws(steps, 0.9))
    assert (steps >= ENOUGH * about.autocorrelation.max()) == enough
    assert state.converged is enough


@pytest.mark.parametrize(("wanted", "enough"), [(2000.0, True), (1e6, False)])
def test_effective_draws_of_every_parameter_are_wanted(wanted: float, enough: bool) -> None:
    z = draws(400)
    z[..., 2] = draws(400, 0.8, seed=1)[..., 2]
    state, about = looked(z, ess=wanted)
    assert state.converged is enough
    assert np.argmin(about.ess) == 2


def test_the_last_step_ends_it_and_names_what_is_missing() -> None:
    z = draws(400)
    z[..., 2] = draws(400, 0.8, seed=1)[..., 2]
    state, _ = looked(z, ess=1e6, most_steps=400)
    assert state.finished and not state.converged
    assert state.why.startswith("not converged after 400 steps: x2 has ESS ") and "(wanted 1000000)" in state.why
    assert not looked(z, ess=1e6, most_steps=401)[0].finished


@pytest.mark.parametrize(
    ("nats", "again", "finished", "converged"),
    [
        (OUTWEIGHS - 0.1, 0, True, True),
        (OUTWEIGHS + 0.1, 0, False, False),
        (OUTWEIGHS + 0.1, 4, False, False),
        (OUTWEIGHS + 0.1, 5, True, False),
    ],
)
def test_places_that_the_proposal_overlooks(nats: float, again: int, finished: bool, converged: bool) -> None:
    state, _ = looked(draws(64), overlooked=nats, again=again)
    assert (state.finished, state.converged) == (finished, converged)
    assert ("makes too little of some places" in state.why) is (finished and not converged)
