"""The stop rule on draws whose memory and agreement are known: what must be refused is, and says why."""

from dataclasses import replace
from unittest.mock import Mock

import numpy as np
import pytest
from scipy.stats import norm

from tests.statistical.targets import gaussian
from wirebayes.inference.convergence import (
    ENOUGH,
    autocorrelation_steps,
    farthest_apart,
    nested_r_hat,
    slowest_autocorrelation_steps,
)
from wirebayes.inference.policy import Policy, describe
from wirebayes.inference.sampler import burn_in, ensemble, kept, stop_rule
from wirebayes.inference.sampler import state as sampler_state
from wirebayes.inference.sampler.mixture import Mixture
from wirebayes.inference.sampler.settings import OUTWEIGHS, POOL
from wirebayes.inference.sampler.state import BurnIn, Diagnostics, Kept, Learned, Sampling, Walkers

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


def looked(
    z: np.ndarray, overlooked: float = 0.0, again: int = 0, lost: float = 0.0, **policy: float
) -> tuple[Sampling, Diagnostics]:
    """What the rule says of draws."""
    blocks = z[: len(z) // 2], z[len(z) // 2 :]
    learned = Learned(None, None, 1, trusted=overlooked + lost > 0, again=again)  # type: ignore[arg-type]
    state = Sampling(Walkers(z[-1], np.zeros(len(z[-1])), None), learned, None, 0)  # type: ignore[arg-type]
    state = replace(state, kept=Kept(blocks, tuple(np.zeros(block.shape[:2]) for block in blocks)))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(stop_rule, "overlooked_nats", lambda *given: (overlooked, lost))
        found = stop_rule.apply(gaussian(D), state, Policy(**(EASY | policy)))  # type: ignore[arg-type]
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


def test_a_tail_that_is_known_worse_than_the_mean_counts() -> None:
    """Signs come anew at every step, sizes are remembered: the mean does not know of it, both tails do."""
    z = draws(2000)
    size = np.abs(draws(2000, 0.95, seed=1))
    values = by_ensemble(np.sign(z) * size)
    assert autocorrelation_steps(values) == pytest.approx(np.ones(D), rel=0.5)
    tail = autocorrelation_steps(values > np.quantile(values, 0.95, axis=(0, 1, 2)))
    assert (tail > 4.0).all() and (slowest_autocorrelation_steps(values) >= tail).all()
    low = np.where(values < 0, values, z.reshape(values.shape))  # each of the two tails alone
    for each in (low, -low):
        assert (slowest_autocorrelation_steps(each) > 3.0).all()


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


def test_only_what_is_missing_is_named() -> None:
    apart = draws(400)
    apart[:, :WALKERS] += 1.0
    assert looked(draws(400), ess=1e6, most_steps=400)[0].why.count("(") == 1
    assert "R-hat" in looked(apart, r_hat=1.01, most_steps=400)[0].why
    slow, about = looked(draws(64, 0.97), most_steps=64)
    assert slow.why.endswith(f"asks for {ENOUGH * about.autocorrelation.max():.0f} steps")
    assert "ESS" not in slow.why and "R-hat" not in slow.why


@pytest.mark.parametrize(
    ("nats", "again", "finished", "converged"),
    [
        (OUTWEIGHS - 0.1, 0, True, True),
        (OUTWEIGHS + 0.1, 0, False, False),
        (OUTWEIGHS + 0.1, 7, False, False),
        (OUTWEIGHS + 0.1, 8, True, False),
    ],
)
def test_places_that_the_proposal_overlooks(nats: float, again: int, finished: bool, converged: bool) -> None:
    assert np.exp(OUTWEIGHS) == pytest.approx(POOL / 2) == 32.0  # half a pool of typical places
    state, _ = looked(draws(64), overlooked=nats, again=again)
    assert (state.finished, state.converged) == (finished, converged)
    assert ("makes too little of some places" in state.why) is (finished and not converged)


def test_places_that_are_overlooked_at_the_last_step_end_the_run() -> None:
    """No step is left with which a better proposal could go on: a block of none has no walkers."""
    state, _ = looked(draws(64), overlooked=OUTWEIGHS + 0.1, most_steps=64)
    assert state.finished and not state.converged
    assert state.why.startswith("not converged after 64 steps: the proposal makes too little of some places")


def after(steps: int, ess: float, memory: float = 1.0, evaluations: int = 0, **learned: float) -> Sampling:
    """A run that was looked at after so many steps."""
    about = Diagnostics(np.full(D, memory), np.array([ess, 2.0 * ess, 3.0 * ess]), np.ones(D))
    rows = np.empty((steps, ENSEMBLES * WALKERS, D))
    blocks = Kept((rows,), (rows[..., 0],), evaluations)
    known = Learned(None, None, 1, **learned)  # type: ignore[arg-type]
    return Sampling(None, known, None, 0, blocks, about)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("steps", "ess", "memory", "most_steps", "more"),
    [
        (128, 2000.0, 1.0, 4000, 64),  # effective draws grow with the steps: half as many again are missing
        (128, 1900.0, 1.0, 4000, 96),  # 74 steps are missing; whole blocks
        (128, 2900.0, 1.0, 4000, 32),  # five steps would do; a block is the least
        (256, 2900.0, 1.0, 4000, 32),  # or an eighth
        (264, 2900.0, 1.0, 4000, 64),  # 33 steps are an eighth of these
        (128, 500.0, 1.0, 4000, 128),  # no further than it has looked
        (128, 2900.0, 31.0, 4000, 32),  # five autocorrelation times are 155 steps
        (128, 2900.0, 33.0, 4000, 64),  # 165
        (128, 2000.0, 1.0, 140, 12),  # the last step is the last
    ],
)
def test_a_block_has_the_steps_that_are_missing(
    steps: int, ess: float, memory: float, most_steps: int, more: int
) -> None:
    policy = Policy(ess=3000.0, block=32, most_steps=most_steps)
    assert kept.block_steps(after(steps, ess, memory), policy) == more


@pytest.mark.parametrize(("most_steps", "steps"), [(4000, 32), (20, 20)])
def test_the_first_look_comes_after_one_block(most_steps: int, steps: int) -> None:
    """However many draws are wanted: a poor proposal shows before they are drawn."""
    nothing = replace(after(0, 1.0), diagnostics=None)
    assert kept.block_steps(nothing, Policy(ess=1e9, most_steps=most_steps)) == steps


@pytest.mark.parametrize(("ess", "anew"), [(2100.0, False), (1900.0, True)])
def test_draws_of_a_poor_proposal_are_given_up(ess: float, anew: bool) -> None:
    """Fewer than one effective draw in five evaluations: a mode may be about to be found, though little is missing."""
    assert stop_rule.worth_a_new_start(after(100, ess, evaluations=10_000)) is anew
    both = after(50, ess, evaluations=4_000)
    assert stop_rule.worth_a_new_start(replace(both, earlier=after(50, 1.0, evaluations=6_000).kept)) is anew


@pytest.mark.parametrize(
    ("again", "steps", "wanted", "more"),
    [
        (0, 32, 10_000.0, False),
        (0, 32, 11_000.0, True),
        (0, 64, 6_700.0, False),
        (0, 64, 7_500.0, True),
        (1, 32, 6_700.0, False),
        (1, 32, 7_500.0, True),
        (3, 32, 7_500.0, False),
    ],
)
def test_what_is_left_to_do_is_weighed_against_a_better_proposal(
    again: int, steps: int, wanted: float, more: bool
) -> None:
    """At 0.25 effective draws an evaluation 6,700 wanted cost 6,800 more, 7,500 cost 10,000; with 0.6, and 4,096 to
    learn it, 6,929 and 8,262. All draws are wanted anew where only a first block is kept: 10,000 cost 20,000 or 20,763,
    11,000 cost 24,000 or 22,429."""
    policy, half = Policy(ess=wanted), steps // 2
    assert stop_rule.worth_refining(after(steps, 5000.0, evaluations=20_000, again=again), policy) is more
    both = after(half, 5000.0, evaluations=8_000, again=again)
    both = replace(both, earlier=after(steps - half, 1.0, evaluations=12_000).kept)
    assert stop_rule.worth_refining(both, policy) is more


@pytest.mark.parametrize(("ess", "slow"), [(6990.0, True), (7010.0, False)])
def test_a_first_block_stays_where_enough_of_its_draws_are_effective(
    ess: float, slow: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """0.35 an evaluation; 12,000 wanted cost some 14,000 more, or 12,000 with a better proposal, 24,000 all anew."""
    policy, state = Policy(ess=12_000.0), after(32, ess, evaluations=20_000)
    assert stop_rule.slow_at_first(state, policy) is slow and stop_rule.worth_refining(state, policy) is not slow
    assert not stop_rule.slow_at_first(after(33, ess, evaluations=20_000), policy)
    assert not stop_rule.slow_at_first(after(32, ess, evaluations=20_000, again=1), policy)
    monkeypatch.setattr(kept, "more", lambda target, state, policy: state)
    monkeypatch.setattr(stop_rule, "apply", lambda target, state, policy: state)
    monkeypatch.setattr(burn_in, "refined", lambda target, state, policy, draws_stay: draws_stay)
    overlooking = replace(state, learned=replace(state.learned, overlooked=9.0))
    assert kept.keep_block(None, overlooking, policy) is not slow  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("ess", "finished", "again", "overlooked", "expected"),
    [(10.0, False, 0, 0.0, "anew"), (10.0, False, 2, 9.0, "anew"), (10.0, False, 3, 0.0, "on"),
     (10.0, False, 3, 9.0, "refined"), (10.0, False, 7, 9.0, "refined"), (10.0, False, 8, 9.0, "on"),
     (10.0, True, 0, 9.0, "on"), (2100.0, False, 0, 0.0, "on"), (2100.0, False, 1, 0.0, "refined"),
     (2100.0, False, 2, 9.0, "refined"),
     (2100.0, False, 3, 0.0, "on"), (2100.0, False, 3, 9.0, "refined"), (2100.0, False, 8, 9.0, "on"),
     (3990.0, False, 0, 0.0, "on"), (3990.0, False, 0, 9.0, "refined"), (3990.0, True, 0, 9.0, "on")],
)  # fmt: skip
def test_a_proposal_is_learned_again_three_times_and_five_more_for_what_it_overlooks(
    ess: float, finished: bool, again: int, overlooked: float, expected: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Draws are given up where the proposal is poor, the first three times, or walkers have lost a mode."""
    state = replace(after(32, ess, evaluations=10_000, again=again, overlooked=overlooked), finished=finished)
    monkeypatch.setattr(kept, "more", lambda target, state, policy: state)
    monkeypatch.setattr(stop_rule, "apply", lambda target, state, policy: state)
    monkeypatch.setattr(burn_in, "again", lambda target, state, policy: "anew")
    monkeypatch.setattr(burn_in, "refined", lambda target, state, policy, draws_stay: "refined")
    found = kept.keep_block(None, state, Policy())  # type: ignore[arg-type]
    lost = kept.keep_block(None, replace(state, learned=replace(state.learned, lost=True)), Policy())  # type: ignore[arg-type]
    assert (lost == "anew") is (again < 8 and not finished)
    assert (found if isinstance(found, str) else "on") == expected


@pytest.mark.parametrize(("apart", "stays"), [(3.7, True), (4.3, False)])
def test_draws_of_earlier_proposals_count_until_later_ones_disagree(apart: float, stays: bool) -> None:
    """Four standard errors of the walkers' means, here of 100 and 50 independent draws of each of 128."""
    z = draws(150)
    n = ENSEMBLES * WALKERS
    old, new = z[:100], z[100:]
    errors = [part[..., 1].mean(axis=0).std(ddof=1) / np.sqrt(n) for part in (old, new)]
    old[..., 1] += new[..., 1].mean() - old[..., 1].mean() + apart * np.hypot(*errors)
    blocks = [Kept((part,), (part.sum(axis=2),), 1000 * len(part), len(part), 2 * len(part)) for part in (old, new)]
    learned = Learned(None, None, 1, trusted=False)  # type: ignore[arg-type]
    state = Sampling(Walkers(z[-1], z[-1, :, 0], None), learned, None, 0, blocks[1], earlier=blocks[0])  # type: ignore[arg-type]
    found = stop_rule.apply(gaussian(D), state, Policy(**EASY))  # type: ignore[arg-type]
    counted = found.all_kept
    assert found.converged and f"after {150 if stays else 50} steps" in found.why
    assert counted.steps == (150 if stays else 50) and counted.evaluations == 1000 * counted.steps
    assert (counted.accepted, counted.proposed) == (counted.steps, 2 * counted.steps)
    assert np.array_equal(np.concatenate(counted.z), np.concatenate([old, new])[-counted.steps :])


def test_shares_in_the_tails_and_means_that_differ_are_told_in_standard_errors() -> None:
    z = by_ensemble(draws(200))
    assert farthest_apart(z[:, :150], z[:, 150:]) < 4.0
    wide = z.copy()
    wide[:, 150:, :, 2] *= 1.3  # the mean stays, 5 % tails hold twice as much
    assert farthest_apart(wide[:, :150], wide[:, 150:]) > 8.0
    means = [part.mean(axis=1)[..., 0].ravel() for part in (z[:, :150], z[:, 150:])]
    error = np.sqrt(sum(m.var(ddof=1) / len(m) for m in means))
    for shift in (8.0, 16.0):
        moved = z.copy()
        moved[:, 150:, :, 0] += means[0].mean() - means[1].mean() + shift * error
        assert farthest_apart(moved[:, :150, :, :1], moved[:, 150:, :, :1]) == pytest.approx(shift)


def test_a_block_is_kept_with_its_densities_and_what_it_cost(monkeypatch: pytest.MonkeyPatch) -> None:
    """By large pools, for the proposal is frozen."""
    move_of = Mock(wraps=kept.move_of)
    monkeypatch.setattr(kept, "move_of", move_of)
    target = gaussian(D)
    policy = Policy(ensembles=ENSEMBLES, walkers=WALKERS, ess=1000.0, block=16)
    rng = np.random.RandomState(0)
    z = rng.normal(size=(ENSEMBLES * WALKERS, D))
    wide = Mixture(np.ones(1), np.zeros((1, D)), np.eye(D)[None])
    state = Sampling(Walkers(z, target(z), rng.get_state()), Learned(wide, wide, 1), None, 1000)  # type: ignore[arg-type]
    for blocks in (1, 2):
        before = target.evaluations
        state = kept.more(target, state, policy)  # type: ignore[arg-type]
        found = state.kept
        assert found.steps == 16 * blocks == len(np.concatenate(found.log_density))
        assert np.concatenate(found.log_density)[-1] == pytest.approx(target(found.z[-1][-1]))
        assert found.proposed == 16 * blocks * ENSEMBLES * WALKERS
        whole = np.concatenate([z[None], *found.z])
        assert found.accepted == (np.diff(whole, axis=0) != 0).any(axis=2).sum()
        assert state.evaluations == 1000 + found.evaluations
        assert target.evaluations - before >= 16 * ENSEMBLES * WALKERS
    asked = [(*call.args[1:], call.kwargs["frozen"]) for call in move_of.call_args_list]
    assert asked == [(ENSEMBLES, 16, True)] * 2


def test_walkers_belong_to_the_ensemble_in_whose_row_they_stand() -> None:
    policy = Policy(ensembles=3, walkers=2)
    blocks = [np.arange(6.0)[None, :, None] + 10.0 * np.array([0.0, 1.0])[:, None, None], np.full((1, 6, 1), 20.0)]
    found = sampler_state.by_ensemble(blocks, policy)
    assert found.shape == (3, 3, 2, 1)
    assert found[1, :, :, 0].tolist() == [[2.0, 3.0], [12.0, 13.0], [20.0, 20.0]]


@pytest.mark.parametrize("unit", [1.0, 1e3])
def test_a_positive_parameter_is_judged_by_its_logarithm(unit: float) -> None:
    """Whatever its unit; by itself a tail of 12 decades would hide that one ensemble lies a factor of ten off."""
    z = draws(200)
    z[:, :WALKERS, 0] += np.log(10.0)
    target = gaussian(D)
    expected = looked(z)[1]
    target.coordinates.log_columns[:] = True
    target.coordinates.to_natural = lambda z: unit * np.exp(z)
    found = stop_rule._diagnosed(stop_rule._judged_by(target, by_ensemble(z)))  # type: ignore[arg-type]
    assert found.r_hat == pytest.approx(expected.r_hat) and found.ess == pytest.approx(expected.ess)


def test_progress_counts_burn_in_as_a_fifth_and_then_effective_draws() -> None:
    """From nothing to all, never beyond, however many rounds burn-in takes."""
    policy = Policy(rounds=4, ess=1000.0)
    rounds = [ensemble._share(BurnIn(None, Learned(None, None, 1), None, 0, n), policy) for n in (0, 1, 4, 9)]  # type: ignore[arg-type]
    assert rounds == pytest.approx([0.0, 0.05, 0.2, 0.2])
    kept_draws = [ensemble._share(after(100, ess), policy) for ess in (1.0, 500.0, 1000.0, 4000.0)]
    assert kept_draws == pytest.approx([0.2008, 0.6, 1.0, 1.0])
    assert ensemble._share(replace(after(100, 1.0), diagnostics=None), policy) == pytest.approx(0.2)


def test_the_last_look_decides_which_draws_are_weighed(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of them, those of earlier proposals too; the places and densities that were kept, and no others."""
    given: list[tuple[np.ndarray, np.ndarray]] = []

    def overlooked(learned: Learned, z: np.ndarray, value: np.ndarray) -> tuple[float, float]:
        given.append((z, value))
        return 0.0, 0.0

    monkeypatch.setattr(stop_rule, "overlooked_nats", overlooked)
    learned = Learned(None, None, 1, trusted=True)  # type: ignore[arg-type]
    for steps in (127, 256):
        z = draws(steps)
        blocks = z[40:50], z[50:]
        before = Kept((z[:40],), (z[:40].sum(axis=2),))
        state = Sampling(Walkers(z[-1], np.zeros(len(z[-1])), None), learned, None, 0)  # type: ignore[arg-type]
        state = replace(state, kept=Kept(blocks, tuple(block.sum(axis=2) for block in blocks)), earlier=before)
        found = stop_rule.apply(gaussian(D), state, Policy(**EASY))  # type: ignore[arg-type]
        assert found.converged and np.array_equal(given[-1][0], z.reshape(-1, D))
        assert np.array_equal(given[-1][1], given[-1][0].sum(axis=1))


def test_effective_draws_are_all_draws_over_their_memory_and_no_more_than_all() -> None:
    z = by_ensemble(draws(200, 0.5))
    found = stop_rule._diagnosed(z)
    memory = slowest_autocorrelation_steps(z)
    assert found.autocorrelation == pytest.approx(memory) and (memory > 1.5).all()
    assert found.ess == pytest.approx(200 * ENSEMBLES * WALKERS / memory)
    zigzag = z.copy()
    place = np.random.default_rng(1).permuted(np.broadcast_to(np.arange(200), (ENSEMBLES, WALKERS, D, 200)), axis=-1)
    zigzag[:] = np.moveaxis(norm.ppf((place + 0.5) / 200), -1, 1)  # every walker goes everywhere: no memory, and less
    assert (slowest_autocorrelation_steps(zigzag) < 0.1).all()  # a memory below one step is rounded up
    assert stop_rule._diagnosed(zigzag).ess == pytest.approx(200 * ENSEMBLES * WALKERS)


def test_autocorrelation_and_r_hat_are_ratios_of_variances_with_their_divisors() -> None:
    """By definition, on few small numbers: means of walkers over one less than all, draws over all."""
    values = np.random.default_rng(0).normal(size=(3, 4, 2, 1))
    means = [values[e, :, w, 0].mean() for e in range(3) for w in range(2)]
    expected = 4 * np.var(means, ddof=1) / np.var(values)
    assert autocorrelation_steps(values) == pytest.approx([expected])
    own = values.mean(axis=1)[..., 0]  # (ensembles, walkers)
    between = np.var(own.mean(axis=1), ddof=1)
    within = np.mean(
        [np.var(own[e], ddof=1) + np.mean([np.var(values[e, :, w, 0], ddof=1) for w in range(2)]) for e in range(3)]
    )
    assert nested_r_hat(values) == pytest.approx([np.sqrt(1.0 + between / within)])


@pytest.mark.parametrize("enough", [{}, {"ess": 1e6}, {"ess": 1e6, "most_steps": 64}])
def test_what_a_proposal_overlooks_is_known_at_every_look(enough: dict[str, float]) -> None:
    """Whether or not the draws are enough; from the bound on it counts."""
    for beyond, counts in ((OUTWEIGHS - 0.01, 0.0), (OUTWEIGHS + 0.01, OUTWEIGHS + 0.01)):
        known = looked(draws(64), overlooked=beyond, lost=1.0, **enough)[0].learned
        assert known.overlooked == counts and not known.lost
        known = looked(draws(64), overlooked=1.0, lost=beyond, **enough)[0].learned
        assert known.overlooked == counts and known.lost is (counts > 0.0)
    # a proposal that was given up overlooks nothing
    given_up, _ = looked(draws(64))
    assert given_up.converged and not given_up.learned.trusted and given_up.learned.overlooked == 0.0


def test_a_positive_parameter_that_rounds_to_zero_has_a_logarithm() -> None:
    """Far below all others, but a number: a draw in a thousand does not make all of them worthless."""
    z = by_ensemble(draws(200))
    z[0, 0, 0, 0] = -1e4
    target = gaussian(D)
    target.coordinates.log_columns[:] = True
    target.coordinates.to_natural = np.exp
    assert target.coordinates.to_natural(z)[0, 0, 0, 0] == 0.0
    found = stop_rule._diagnosed(stop_rule._judged_by(target, z))  # type: ignore[arg-type]
    assert np.isfinite(found.ess).all() and np.isfinite(found.r_hat).all()


@pytest.mark.parametrize("stored", [False, True])
def test_a_run_goes_from_burn_in_to_kept_draws_until_it_is_finished(
    stored: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Back to burn-in where the rule asks for it; every state is saved, and a stored one gone on from."""
    policy = Policy(ensembles=2, walkers=2, ess=1000.0, rounds=2)
    z = np.arange(24.0).reshape(3, 4, 2)
    about = Diagnostics(np.array([2.0, 3.0]), np.array([500.0, 700.0]), np.array([1.0, 1.1]))
    learned = Learned(None, None, 3, trusted=False)  # type: ignore[arg-type]
    begun = BurnIn(None, learned, None, 5, 0)  # type: ignore[arg-type]
    walking = Sampling(None, learned, None, 70, Kept((z,), (z[..., 0],), 40, 9, 12), about)  # type: ignore[arg-type]
    done = replace(walking, finished=True, converged=True, why="enough", evaluations=90)
    ways = {"burn": iter([replace(begun, round=1), walking, walking]), "keep": iter([replace(begun, round=2), done])}
    saved: list[tuple[object, object, object]] = []
    told: list[float] = []
    fits: list[object] = []

    def load(path: object, of_fit: object) -> object:
        fits.append(of_fit)
        return begun if stored else None

    def init(*given: object) -> BurnIn:
        assert not stored and given == (target, 7, policy, "found", "near", "rough")
        return begun

    monkeypatch.setattr(ensemble.resume, "load_state", load)
    monkeypatch.setattr(ensemble.resume, "save_state", lambda state, path, of_fit: saved.append((state, path, of_fit)))
    monkeypatch.setattr(burn_in, "init", init)
    monkeypatch.setattr(burn_in, "burn_in_round", lambda target, state, policy: next(ways["burn"]))
    monkeypatch.setattr(kept, "keep_block", lambda target, state, policy: next(ways["keep"]))
    target = gaussian(2)
    found = ensemble.sample_posterior(
        target,
        7,
        policy,
        checkpoint="file",
        progress=told.append,
        found="found",
        near="near",
        rough="rough",  # type: ignore[arg-type]
    )
    states = [begun, replace(begun, round=1), walking, replace(begun, round=2), walking, done]
    of_fit = {"seed": 7, "policy": describe(policy), "parameters": ("x0", "x1")}
    assert fits == [of_fit] and saved == [(state, "file", of_fit) for state in states]
    assert told == pytest.approx([0.1, 0.6, 0.2, 0.6, 0.6])
    assert (found.converged, found.why, found.evaluations, found.kept_evaluations) == (True, "enough", 90, 40)
    assert found.acceptance == 0.75 and found.learned is False and found.modes == 3
    assert np.array_equal(found.z, sampler_state.by_ensemble([z], policy)) and found.log_density.shape == (2, 3, 2)
    assert (found.autocorrelation_steps, found.ess, found.r_hat) == (about.autocorrelation, about.ess, about.r_hat)
    still = replace(done, kept=replace(done.kept, accepted=0, proposed=0))
    monkeypatch.setattr(ensemble.resume, "load_state", lambda path, of_fit: still)
    assert ensemble.sample_posterior(target, 7, policy).acceptance == 0.0
