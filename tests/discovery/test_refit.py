"""A refit on evidence that is a known curve of the amplitude: its top is found wherever it lies, and its width."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from wirebayes.discovery import refit
from wirebayes.discovery.profile import Profile
from wirebayes.discovery.refit import occam
from wirebayes.effects import effect_named
from wirebayes.inference.optimum import Optimum

TWO_SIDED = effect_named("strain_stiffening")


class Flat:
    """A density of one over a width, wherever it is asked: δ of 40, on one side or on both."""

    def __init__(self, width: float) -> None:
        self.width = width

    def logpdf(self, amplitude: np.ndarray) -> np.ndarray:
        return np.full(len(amplitude), -np.log(self.width))

    def cdf(self, amplitude: float) -> float:
        return float(amplitude > 0)

    def std(self) -> float:
        return self.width


def ends_of(value: np.ndarray, z: np.ndarray, converged: np.ndarray) -> Optimum:
    """Where climbs of one coordinate ended: what the normal approximation adds to the log density is nothing."""
    return Optimum(z, value, np.full((len(z), 1, 1), 2.0 * np.pi), converged)


def shared(blocks: list[Any], added: float) -> refit._Amplitude:
    """An amplitude that blocks share, with a constant for its prior."""
    return refit._Amplitude(
        blocks, 0.0, -np.inf, np.inf, np.inf, 1.0, lambda amplitudes: np.full(len(amplitudes), added)
    )


def refitted(
    monkeypatch: pytest.MonkeyPatch,
    tops: list[float],
    effect: Any = TWO_SIDED,
    guess: float = 3.0,
    leap: float = np.inf,
    per_delta: float = 1e-3,
) -> Any:
    """Refitted on blocks whose evidence is normal in δ about these tops; δ = 1 is a thousandth of the amplitude.

    Climbs converge over no more than `leap`; the scan has its own opinion of what amounts to δ = 1.
    """

    class Curve:
        common = ()

        def __init__(self, block: Any, effect: Any) -> None:
            self.top = block.top
            main = effect.amplitudes[0]
            self.prior = Flat(0.04 if main.prior.support()[0] >= main.neutral else 0.08)

        def starts(self, shapes: Any) -> np.ndarray:
            return np.zeros((2, 1))

        def climb(self, start: np.ndarray, amplitude: np.ndarray) -> Optimum:
            """The second of two starts ends lower; a climb from afar does not converge."""
            value = -0.5 * (amplitude / 1e-3 - self.top) ** 2
            if len(start) > 1 and amplitude[0] == amplitude[1]:
                value[1::2] -= 5.0
            end = (amplitude / 1e-3)[:, None]
            near = np.abs(end - start[:, :1])[:, 0] <= leap
            return ends_of(value, end, near)

        def curved(self, ends: Optimum, amplitude: np.ndarray) -> Optimum:
            return ends

        def natural(self, z: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
            assert z[:, 0] == pytest.approx(amplitude / 1e-3)
            return np.column_stack([z, amplitude])

    monkeypatch.setattr(refit, "Pinned", Curve)
    blocks: Any = [SimpleNamespace(top=top, log_evidence=-0.5 * top**2) for top in tops]
    return refit.refit(blocks, range(len(tops)), effect, per_delta, guess * 1e-3)


@pytest.mark.parametrize("top", [0.4, -7.0, 30.0, 100.0, -400.0])
def test_the_top_is_found_within_and_far_beyond_the_first_amplitudes(
    top: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    found = refitted(monkeypatch, [top])
    assert found.amplitude / 1e-3 == pytest.approx(top, abs=max(0.15, 0.02 * abs(top)))
    assert found.log_bayes == pytest.approx(0.5 * top**2 + occam(False))
    assert found.sd == pytest.approx(1e-3, rel=1e-6)
    assert found.theta[0] == pytest.approx([found.amplitude / 1e-3, found.amplitude])


@pytest.mark.parametrize("per_delta", [1e-2, 1e300])
def test_an_effect_that_the_scan_does_not_see_is_tried_at_amplitudes_of_its_prior(
    per_delta: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Its unit has no end where the parameters bend themselves to the effect; climbs from afar end nowhere."""
    found = refitted(monkeypatch, [15.0], guess=0.0, per_delta=per_delta, leap=80.0)
    assert found.amplitude / 1e-3 == pytest.approx(15.0, abs=0.3)
    assert found.log_bayes == pytest.approx(0.5 * 15.0**2 + occam(False), abs=0.05)


def test_where_climbs_from_afar_end_nowhere_nearer_ones_lead_on(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without the effect the other parameters are so different that only the least amplitude is reached from there."""
    found = refitted(monkeypatch, [15.0], leap=5.0)
    assert found.amplitude / 1e-3 == pytest.approx(15.0, abs=0.3) and found.sd == pytest.approx(1e-3, rel=1e-6)


def test_an_amplitude_out_of_reach_from_neutral_is_reached_from_the_next_one() -> None:
    """From there the climbs of one sign end nowhere but at the least, and those of the other lead to a lesser top."""
    profile = Profiles(reached=[-0.5, 0.5, 1.0, 2.0, 3.0]).tried()
    assert profile.amplitude[np.isfinite(profile.value)].tolist() == [-3.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0]
    assert profile.value[np.isfinite(profile.value)] == pytest.approx([9.0, 4.0, 1.0, 0.25, 0.5, 1.0, 2.0, 3.0])


class Profiles:
    """Climbs that reach one amplitude more each time, and from neutral some alone; a mode for each sign."""

    def __init__(self, reached: list[float]) -> None:
        self.reached = reached
        self.rounds = 0

    neutral = 0.0

    def climbed(self, amplitudes: np.ndarray, begin: Any) -> Any:
        near = np.isin(amplitudes, self.reached) if self.rounds == 0 else np.ones(len(amplitudes), bool)
        self.rounds += 1
        value = np.where(amplitudes < 0, amplitudes**2, amplitudes)
        value = np.where(near, value, -np.inf)
        return Profile(amplitudes, value, [ends_of(value, amplitudes[:, None], near)])

    def tried(self) -> Any:
        grid = np.array([-20.0, -10.0, -5.0, -3.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0])
        return refit._followed(self, self.climbed(grid, []))  # type: ignore[arg-type]


def test_blocks_that_share_an_amplitude_add_their_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    """Tops at 4 and 6: the shared amplitude is 5, known √2 times as well, and half a nat a block is lost."""
    found = refitted(monkeypatch, [4.0, 6.0])
    assert found.amplitude == pytest.approx(5e-3, rel=0.02) and found.sd == pytest.approx(1e-3 / np.sqrt(2), rel=1e-6)
    assert found.log_bayes == pytest.approx(0.5 * (4.0**2 + 6.0**2) - 1.0 + occam(False) - 0.5 * np.log(2), abs=0.02)
    assert found.blocks == (0, 1) and len(found.theta) == 2


def test_an_amplitude_that_cannot_be_negative_ends_at_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    found = refitted(monkeypatch, [-3.0], effect_named("toe"))
    assert 0.0 <= found.amplitude < 0.2e-3
    tail = 0.5 * 3.0**2 + 0.5 * np.log(2 * np.pi) + stats.norm.logcdf(-3.0) - np.log(40.0)  # what lies above zero
    assert found.log_bayes == pytest.approx(tail, abs=0.1)
    assert refitted(monkeypatch, [9.0], effect_named("toe")).log_bayes == pytest.approx(40.5 + occam(True), abs=0.05)


@pytest.mark.parametrize("sd", [0.5, 5.0, 500.0])
def test_the_prior_is_the_catalogue_s_as_far_as_it_reaches_and_integrates_to_one(sd: float) -> None:
    """A wide one is uniform over the reach, a narrow one is itself, and an amplitude beyond both is impossible."""
    grid = np.linspace(-3.0, 3.0, 60001)
    density = np.exp(refit.within(stats.norm(0.0, sd), 0.0, 2.0)(grid))
    assert np.trapezoid(density, grid) == pytest.approx(1.0, abs=1e-4)
    assert (density[np.abs(grid) > 2.0001] == 0.0).all()
    expected = stats.norm(0.0, sd).pdf(grid) / (2 * stats.norm(0.0, sd).cdf(2.0) - 1.0)
    inside = np.abs(grid) < 2.0
    assert density[inside] == pytest.approx(expected[inside])
    one = refit.within(stats.halfnorm(0.0, sd), 0.0, np.inf)(np.array([0.3, 99.0]))
    assert one == pytest.approx(stats.halfnorm(0.0, sd).logpdf([0.3, 99.0]))


def test_an_amplitude_that_is_hardly_possible_pays_for_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """A normal likelihood about 9 in units of δ, a normal prior of sd 2 about none: the two integrated by hand."""
    monkeypatch.setattr(Flat, "logpdf", lambda self, a: stats.norm(0.0, 2e-3).logpdf(a))
    found = refitted(monkeypatch, [9.0])
    assert found.amplitude / 1e-3 == pytest.approx(9.0 * 4.0 / 5.0, abs=0.2)
    expected = 0.5 * 9.0**2 + np.log(np.sqrt(2 * np.pi)) + stats.norm(0.0, np.sqrt(5.0)).logpdf(9.0)
    assert found.log_bayes == pytest.approx(expected, abs=0.05)


def test_climbs_begin_on_the_line_between_what_is_known() -> None:
    """Ends 0, 10 and 40 at amplitudes 0, 1 and 2, the best in the middle; beyond the grid nothing is extrapolated."""
    grid, ends = np.array([0.0, 1.0, 2.0]), np.array([[0.0], [10.0], [40.0]])
    found = refit._between(grid, ends, 1, np.array([0.5, 1.0, 1.5, 2.0, 2.5]))
    assert found[:, 0].tolist() == [5.0, 10.0, 25.0, 40.0, 10.0]
    ends[2] = np.nan
    assert refit._between(grid, ends, 1, np.array([1.5]))[:, 0].tolist() == [10.0]
    assert refit._between(grid, ends, 0, np.array([-1.0, 0.5]))[:, 0].tolist() == [0.0, 5.0]


def tried(monkeypatch: pytest.MonkeyPatch, top: float, effect: Any = TWO_SIDED, guess: float = 3.0) -> list[Any]:
    """The amplitudes of each round of climbs, in units of δ."""
    rounds: list[Any] = []
    climbed = refit._Amplitude.climbed

    def watched(self: Any, amplitudes: np.ndarray, begin: Any) -> Any:
        rounds.append(amplitudes / 1e-3)
        return climbed(self, amplitudes, begin)

    monkeypatch.setattr(refit._Amplitude, "climbed", watched)
    refitted(monkeypatch, [top], effect, guess)
    monkeypatch.setattr(refit._Amplitude, "climbed", climbed)
    return rounds


def test_amplitudes_from_a_half_to_forty_and_the_scan_s_guess_are_tried_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """On both sides, or on the one that the prior allows; a guess next to nothing counts as three tenths."""
    steps = [0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 20.0, 40.0]
    assert tried(monkeypatch, 9.0)[0] == pytest.approx([-s for s in reversed(steps)] + steps)
    assert tried(monkeypatch, 9.0, guess=-3.0)[0] == pytest.approx([-s for s in reversed(steps)] + steps)
    assert tried(monkeypatch, 9.0, effect_named("toe"))[0] == pytest.approx(steps)
    small = [0.3, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 40.0]
    assert tried(monkeypatch, 9.0, effect_named("toe"), guess=0.1)[0] == pytest.approx(small)
    # no farther than the prior reaches
    bounded = SimpleNamespace(amplitudes=[SimpleNamespace(prior=stats.uniform(-0.004, 0.016), neutral=0.0)])
    assert tried(monkeypatch, 9.0, bounded)[0] == pytest.approx(
        [-4.0, -3.0, -2.0, -1.0, -0.5, 0.5, 1.0, 2.0, 3.0, 5.0, 10.0, 12.0]
    )
    # of a share near its end, too
    share = SimpleNamespace(amplitudes=[SimpleNamespace(prior=stats.uniform(0.0, 0.06), neutral=0.0)])
    assert tried(monkeypatch, 9.0, share)[0] == pytest.approx([*steps, 45.0, 54.0, 58.2])


def test_a_top_within_is_tried_where_a_parabola_has_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Through what is known at 5, 10 and 20; a standard deviation apart, they need not be looked at more closely.

    What is known already is not climbed again, also where it comes out with another last digit.
    """
    first, _, second = tried(monkeypatch, 9.0, effect_named("toe"))
    assert 5.0 in first and 10.0 in first and 20.0 in first
    assert second == pytest.approx([7.0, 8.0, 9.0, 11.0])
    # what would lie beyond the neighbours is left out
    *_, second = tried(monkeypatch, 9.0, effect_named("toe"), guess=8.0)
    assert second == pytest.approx([7.0, 9.0])


def test_curvatures_are_exact_where_they_count(monkeypatch: pytest.MonkeyPatch) -> None:
    """Climbs know their expectation alone, here e² times too small: a nat too much of each value, exactly."""
    grid = np.array([0.0, 1.0, 2.0, 3.0])
    value = np.array([-0.5, 0.0, -5.9, -6.1])
    rough = ends_of(value, grid[:, None], np.ones(4, bool))

    class Block:
        common = ()

        def curved(self, ends: Optimum, amplitude: np.ndarray) -> Optimum:
            assert ends.z[:, 0].tolist() == amplitude.tolist()
            return replace(ends, curvature=np.exp(2.0) * ends.curvature)

    found = refit._exact(shared([Block()], 0.0), Profile(grid, value, [rough]))
    assert found.value == pytest.approx([-1.5, -1.0, -6.9, -6.1])


def outwards(rounds: list[Any]) -> list[Any]:
    """The rounds that go on from an end: three amplitudes each."""
    return [amplitudes for amplitudes in rounds[1:] if len(amplitudes) == 3]


def test_a_top_outside_is_followed_outwards_six_times_at_most(monkeypatch: pytest.MonkeyPatch) -> None:
    """By 1.3, 1.7 and 2.3 from the end where it lies; within the bounds of the prior."""
    for side in (1.0, -1.0):
        rounds = outwards(tried(monkeypatch, side * 1e9))
        assert len(rounds) == 6
        for n, amplitudes in enumerate(rounds):
            assert amplitudes == pytest.approx(side * 40.0 * 2.3**n * np.array([1.3, 1.7, 2.3]))
    few = tried(monkeypatch, 150.0)
    assert len(outwards(few)) == 2 and few[-1] == pytest.approx(np.arange(148.0, 153.0))  # 92, 211.6, then back
    bounded = SimpleNamespace(amplitudes=[SimpleNamespace(prior=stats.uniform(-0.1, 0.2), neutral=0.0)])
    rounds = outwards(tried(monkeypatch, 1e9, bounded))
    assert rounds[0] == pytest.approx([52.0, 68.0, 92.0]) and rounds[1] == pytest.approx([100.0] * 3)
    at_end = SimpleNamespace(amplitudes=[SimpleNamespace(prior=stats.uniform(-0.04, 0.08), neutral=0.0)])
    assert outwards(tried(monkeypatch, 1e9, at_end)) == []  # the end of the prior is the end


def test_climbs_that_bring_no_news_are_not_made_again(monkeypatch: pytest.MonkeyPatch) -> None:
    """Outwards of the least amplitude lies what has just been tried; beyond an end, climbs that converge nowhere."""
    assert len(outwards(tried(monkeypatch, 0.1, effect_named("toe")))) == 1
    grid, rounds = np.array([1.0, 2.0, 3.0]), []

    def climbed(amplitudes: np.ndarray, begin: Any) -> Profile:
        rounds.append(amplitudes.tolist())
        return Profile(amplitudes, np.full(len(amplitudes), -np.inf), [])

    nowhere: Any = SimpleNamespace(
        low=-np.inf, high=np.inf, neutral=0.0, per_delta=1.0, one_sided=True, outwards=lambda at: 2.0 * at + grid
    )
    nowhere.climbed = climbed
    profile = Profile(grid, 9.0 * grid, [])
    assert refit._looked_closer(nowhere, profile) is profile
    assert rounds == [[7.0, 8.0, 9.0], pytest.approx(np.linspace(2.0, 3.0, 8)[1:-1])]


def test_around_the_best_lie_six_between_its_neighbours_or_beyond_an_end() -> None:
    grid = np.array([1.0, 3.0, 4.0])

    def around(best: int, end: float | None) -> np.ndarray:
        value = np.zeros(3)
        value[best] = 1e-3  # a parabola through these is so wide that hardly any of its amplitudes lie between
        return refit._around(Profile(grid, value, []), end, 0.1)

    for end in (None, 0.5):
        assert around(1, end) == pytest.approx(np.linspace(1.0, 4.0, 8)[1:-1])
        assert around(2, end) == pytest.approx(np.linspace(3.0, 4.0, 8)[1:-1])
    assert around(0, None) == pytest.approx(np.linspace(-1.0, 3.0, 8)[1:-1])  # as far beyond as within
    assert around(0, 0.5) == pytest.approx(np.linspace(0.5, 3.0, 8)[1:-1])


def test_around_the_only_amplitude_known_lie_six_within_a_unit_on_either_side() -> None:
    alone = Profile(np.array([2.0]), np.zeros(1), [])
    assert refit._around(alone, None, 0.7) == pytest.approx(np.linspace(1.3, 2.7, 8)[1:-1])
    assert refit._around(alone, 0.5, 0.7) == pytest.approx(np.linspace(0.5, 2.7, 8)[1:-1])


def profile_of(amplitude: list[float], value: list[float], ends: list[float]) -> Profile:
    place = ends_of(np.array(value), np.array(ends)[:, None], np.ones(len(ends), bool))
    return Profile(np.array(amplitude), np.array(value), [place])


def test_a_profile_keeps_what_it_had_and_is_sorted() -> None:
    one = profile_of([1.0, 3.0], [10.0, 30.0], [1.0, 3.0])
    both = one.joined(profile_of([3.0, 2.0, 0.0], [-1.0, 20.0, 0.0], [9.0, 2.0, 0.0]))
    assert both.amplitude.tolist() == [0.0, 1.0, 2.0, 3.0] and both.value.tolist() == [0.0, 10.0, 20.0, 30.0]
    assert both.ends[0].z[:, 0].tolist() == [0.0, 1.0, 2.0, 3.0] and both.best == 3
    mixed = both.with_rows(np.array([1, 3]), profile_of([1.0, 3.0], [11.0, 31.0], [-1.0, -3.0]))
    assert mixed.amplitude.tolist() == [0.0, 1.0, 2.0, 3.0] and mixed.value.tolist() == [0.0, 11.0, 20.0, 31.0]
    assert mixed.ends[0].z[:, 0].tolist() == [0.0, -1.0, 2.0, -3.0]


def test_a_climb_that_did_not_converge_has_no_evidence() -> None:
    """Of several starts the best one counts, in each block for itself; evidence adds up over the blocks."""

    def block(value: list[float], converged: list[bool]) -> Any:
        ends = np.arange(float(len(value)))[:, None]
        found = ends_of(np.array(value), ends, np.array(converged))

        def climb(start: np.ndarray, amplitude: np.ndarray) -> Any:
            assert amplitude.tolist() == list(np.repeat([5.0, 6.0], len(value) // 2))
            return found

        return SimpleNamespace(climb=climb, common=())

    blocks = [block([1.0, 9.0, 4.0, 3.0], [True, False, True, True]), block([10.0, 20.0], [True, False])]
    starts = [np.zeros((4, 1)), np.zeros((2, 1))]
    found = shared(blocks, -100.0).climbed(np.array([5.0, 6.0]), starts)
    assert found.value.tolist() == [1.0 + 10.0 - 100.0, -np.inf]
    assert [ends.z[:, 0].tolist() for ends in found.ends] == [[0.0, 2.0], [0.0, 1.0]]
