"""Where evidence turns into a verdict: each threshold against the law it stands for."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import integrate, stats

from tests.simulated import simulated_tests
from wirebayes.discovery import name_evidence, refit, screening
from wirebayes.discovery.power import amplitude_80
from wirebayes.discovery.probes import Probe, probes
from wirebayes.discovery.scans import Pieces, Scan
from wirebayes.discovery.screening import Candidate
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import Settings
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.optimum import Optimum
from wirebayes.simulation.synthetic import Bench, Truth

NORM = 25.0  # δ per unit of amplitude in these scans


def log_evidence(best: float, one_sided: bool) -> float:
    """Log of the mean likelihood ratio over δ uniform up to 40, the ratio a normal curve with its top at `best`."""
    low = 0.0 if one_sided else -40.0
    mean, _ = integrate.quad(lambda d: np.exp(0.5 * best**2 - 0.5 * (d - best) ** 2), low, 40.0, points=[best])
    return float(np.log(mean / (40.0 - low)))


def scan_of(delta: np.ndarray, one_sided: bool, flexible: float = 0.0) -> Scan:
    """Scans of one probe on data whose signature has these lengths (n,), in sensor errors; the noise is known."""
    n, degrees = len(delta), 10**8  # so many readings that the integral over the noise is a normal
    pieces = Pieces(
        shared=np.zeros((1, n)),
        rss=np.full((1, n), float(degrees)),
        along=NORM * delta[None, :, None],
        square=np.full((1, n, 1), NORM**2),
        is_left=np.ones((1, n, 1), bool),
        degrees=degrees,
        least=np.zeros(n),
        one_sided=np.array([one_sided]),
    )
    two = np.full(n, -np.inf)  # there is one effect
    norm = np.full((n, 1), NORM)
    return Scan(0.5 * delta[:, None] ** 2, np.full(n, flexible), two, delta[:, None] / NORM, norm, pieces)


def test_an_alarm_is_raised_below_four_per_cent_and_not_above(monkeypatch: pytest.MonkeyPatch) -> None:
    """Four false alarms in a hundred clean files are promised, so p = .05 is none and p = .035 is one."""
    bench = Bench(displacements_mm=(1, 2, 3))  # too few holds to hold some out, which would take longer
    experiments = simulated_tests([bench], Truth({"k1": 900.0, "B": 0.25, "setting_sd": 0.01}), seed=1)
    kinds = {"strain_stiffening": CATALOGUE["strain_stiffening"]}
    for exceeding, alarm in ((9, False), (6, True)):  # of 199 simulations
        monkeypatch.setattr(screening.GlobalTest, "p", (1 + exceeding) / 200)
        found = investigate(experiments, Settings(kinds=kinds, simulations=19)).report["experiments"]["simulated"]
        assert (found["verdict"] != "nothing-missing") == alarm, found["p_global"]


@pytest.mark.parametrize("one_sided", [True, False])
def test_evidence_is_the_likelihood_averaged_over_the_prior(one_sided: bool) -> None:
    for best in (6.0, 15.0, 30.0):
        found = screening.scanned(Candidate(0, "toe", (0,), True), [scan_of(np.array([best]), one_sided)]).log_bayes
        assert found[0] == pytest.approx(log_evidence(best, one_sided), abs=1e-6)
    # on two samples with an amplitude each, the prior is paid for twice
    both = [scan_of(np.array([best]), one_sided) for best in (6.0, 15.0)]
    found = screening.scanned(Candidate(0, "toe", (0, 1), False), both).log_bayes
    assert found[0] == pytest.approx(log_evidence(6.0, one_sided) + log_evidence(15.0, one_sided), abs=1e-6)


@pytest.mark.parametrize("name", ["toe", "strain_stiffening"])
def test_a_refit_adds_the_same_prior(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The likelihood by amplitude is replaced by a normal curve, whose average is known."""
    effect = effect_named(name)
    per_delta = 0.1 * float(effect.amplitudes[0].prior.std())
    top = 9.0 * per_delta

    one_sided = effect.amplitudes[0].prior.support()[0] >= effect.amplitudes[0].neutral
    low = 0.0 if one_sided else -40.0 * per_delta

    class Curve:
        prior = stats.uniform(low, 40.0 * per_delta - low)  # of δ up to 40
        common = ()

        def __init__(self, block: Any, effect: Any) -> None:
            pass

        def starts(self, shapes: Any) -> np.ndarray:
            return np.zeros((1, 1))

        def climb(self, start: np.ndarray, amplitude: np.ndarray) -> Optimum:
            ratio = 0.5 * 9.0**2 - 0.5 * ((amplitude - top) / per_delta) ** 2
            curvature = np.ones((len(start), 1, 1))
            return Optimum(start, ratio - 0.5 * np.log(2.0 * np.pi), curvature, np.ones(len(start), dtype=bool))

        def curved(self, ends: Optimum, amplitude: np.ndarray) -> Optimum:
            return ends

        def natural(self, z: np.ndarray, amplitude: np.ndarray) -> np.ndarray:
            return z

    monkeypatch.setattr(refit, "Pinned", Curve)
    found = refit.refit([SimpleNamespace(log_evidence=0.0)], (0,), effect, per_delta, 8.0 * per_delta)  # type: ignore[list-item]
    assert found.amplitude == pytest.approx(top, rel=0.02) and found.sd == pytest.approx(per_delta, rel=1e-3)
    assert one_sided == (name == "toe")
    assert found.log_bayes == pytest.approx(log_evidence(9.0, one_sided), abs=0.02)


def slips() -> tuple[list[Any], list[Candidate]]:
    """Trials and candidates of a grip that slipped at one of twelve holds."""
    trials = [p for hold in range(1, 13) for p in probes(effect_named(f"grip_slip@{hold}"))[:1]]
    return trials, [Candidate(k, "grip_slip", (0,), True) for k in range(12)]


def seen(effects: np.ndarray) -> Scan:
    """What a scan says of two-sided effects, one data set a row: these log Bayes factors, each at delta 8."""
    one = scan_of(np.array([8.0]), False)
    pieces = Pieces(**(vars(one.pieces) | {"one_sided": np.zeros(effects.shape[1], bool)}))
    norm = np.full(effects.shape, NORM)
    return Scan(effects, one.flexible, one.two, np.full(effects.shape, 8.0 / NORM), norm, pieces)


def test_forms_of_a_name_share_its_weight(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve holds at which a grip may have slipped are one name: its evidence is their mean, not their sum."""
    trials, candidates = slips()

    def refitted(
        blocks: Any, which: Any, effect: Any, per_delta: float, guess: float, reach: float, shapes: Any
    ) -> refit.Refit:
        return refit.Refit(effect, tuple(which), 9.0 if effect.hold == 7 else -30.0, 8.0, 1.0, ())

    monkeypatch.setattr(name_evidence, "refit", refitted)
    data = seen(np.where(np.arange(12) == 6, 32.0, 0.0)[None])
    found = name_evidence.weigh_names([SimpleNamespace()], trials, candidates, [data])  # type: ignore[list-item]
    assert found.log_bayes["grip_slip"] == pytest.approx(9.0 - np.log(12.0), abs=1e-3)
    assert found.winners["grip_slip"][0].effect.hold == 7 and found.presence["grip_slip"] == pytest.approx([1.0])


@pytest.mark.parametrize(
    ("before", "refitted"),
    [
        ({}, ["sensor_drift", "toe", "superposition"]),
        ({"sensor_drift": 9.0, "toe": 8.0, "superposition": -1.6}, ["sensor_drift", "toe"]),
        ({"sensor_drift": 9.0, "toe": 8.0, "superposition": -1.4}, ["sensor_drift", "toe", "superposition"]),
        ({"sensor_drift": -9.0, "toe": 8.0, "superposition": 9.0}, ["sensor_drift", "superposition", "toe"]),
    ],
)
def test_a_value_of_the_scan_takes_no_name_off_the_list(
    before: dict[str, float], refitted: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The scan gives drift 60 nats, its refit none, and superposition nothing, whose refit is the best.

    Refitted first are the names that promise most, by the scan or by what they were beside fewer effects; one that has
    been refitted before is not once more where it promises less than toe's 7 allows: 7 less 5 and half of it.
    """
    names = ("sensor_drift", "toe", "superposition")
    trials = [probes(effect_named(name))[0] for name in names]
    candidates = [Candidate(k, name, (0,), True) for k, name in enumerate(names)]
    own = {"sensor_drift": -3.0, "toe": 7.0, "superposition": 12.0}
    asked: list[str] = []

    def climbed(
        blocks: Any, which: Any, effect: Any, per_delta: float, guess: float, reach: float, shapes: Any
    ) -> refit.Refit:
        asked.append(effect.name)
        return refit.Refit(effect, tuple(which), own[effect.name], 8.0, 1.0, ())

    monkeypatch.setattr(name_evidence, "refit", climbed)
    monkeypatch.setattr(name_evidence, "_WAVE", 1)
    data = seen(np.array([[60.0, 12.0, -9.0]]))
    found = name_evidence.weigh_names([SimpleNamespace()], trials, candidates, [data], before=before)  # type: ignore[list-item]
    assert asked == refitted and set(found.winners) == set(refitted)
    assert dict(found.tried) == {**before, **{name: own[name] for name in refitted}}


def test_a_form_that_was_not_refitted_counts_for_no_more_than_one_that_was(monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve holds, each 30 nats by the scan; three are refitted and come to 2."""
    trials, candidates = slips()
    monkeypatch.setattr(
        name_evidence, "refit", lambda b, which, effect, *_: refit.Refit(effect, tuple(which), 2.0, 8.0, 1.0, ())
    )
    data = seen(np.full((1, 12), 34.0))
    found = name_evidence.weigh_names([SimpleNamespace()], trials, candidates, [data])  # type: ignore[list-item]
    assert found.log_bayes["grip_slip"] == pytest.approx(2.0)


def test_a_name_whose_climbs_all_failed_is_impossible_and_not_a_number(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its probability is zero; as something that is no number, it made every other probability none either."""
    monkeypatch.setattr(
        name_evidence, "refit", lambda b, which, effect, *_: refit.Refit(effect, tuple(which), -np.inf, 0.0, 1.0, ())
    )
    data, trials = scan_of(np.array([8.0]), True), probes(effect_named("toe"))[:1]
    candidates = [Candidate(0, "toe", (0,), True)]
    found = name_evidence.weigh_names([SimpleNamespace()], trials, candidates, [data])  # type: ignore[list-item]
    assert found.log_bayes["toe"] == -np.inf and found.presence["toe"] == pytest.approx([0.0])


@pytest.mark.parametrize("one_sided", [True, False])
def test_the_amplitude_that_four_tests_in_five_would_show(one_sided: bool) -> None:
    """Known noise: z is normal about δ with sd 1, and an effect passes where z²/2 and the prior beat the threshold."""
    z = stats.norm.ppf((np.arange(300) + 0.5) / 300)
    trial = Probe(effect_named("toe"), {}, 1.0, one_sided)
    for threshold in (0.5, 3.0):
        found = amplitude_80(scan_of(z, one_sided), trial, 0, threshold)
        assert found is not None
        prior = np.log(np.sqrt(2 * np.pi) / (40.0 if one_sided else 80.0))
        needed = np.sqrt(2 * (threshold - prior))
        passing = stats.norm.sf(needed - found * NORM) + (0 if one_sided else stats.norm.cdf(-needed - found * NORM))
        assert passing == pytest.approx(0.8, abs=0.01)


def test_an_effect_that_hardly_shows_has_no_such_amplitude() -> None:
    assert (
        amplitude_80(scan_of(np.zeros(10), True), Probe(effect_named("toe"), {}, 1.0, True), 0, threshold=900.0) is None
    )
