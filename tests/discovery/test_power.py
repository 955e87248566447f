"""Similar effects and what to measure next: cosines by hand, and plans that are what their words say."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import power
from wirebayes.discovery.linear_scan import Probe
from wirebayes.discovery.power import alternatives, copies, group_of, similarity
from wirebayes.discovery.screening import Candidate
from wirebayes.effects import named
from wirebayes.io.paper import experiments
from wirebayes.wire.protocol import Protocol


def probe(name: str, scope: str = "instrument") -> Any:
    return SimpleNamespace(effect=SimpleNamespace(name=name, scope=scope), one_sided=False)


@pytest.fixture
def signatures(monkeypatch: pytest.MonkeyPatch) -> None:
    """A block is its matrix of projected signatures, times the noise ratio that it is asked for."""
    monkeypatch.setattr(power, "projected", lambda matrix, ratio: ratio * matrix)


def block(*columns: tuple[float, ...]) -> Any:
    return np.array(columns, float).T


@pytest.mark.usefixtures("signatures")
def test_signatures_are_as_alike_as_the_angle_between_them_is_small() -> None:
    one = block((1.0, 0.0), (-3.0, 3.0), (0.0, 0.0))
    found = similarity([one], [probe("a"), probe("b"), probe("c")], [2.0])
    assert found["a", "a"] == pytest.approx(1.0)
    assert found["a", "b"] == found["b", "a"] == pytest.approx(np.cos(np.pi / 4))  # a sign makes no other signature
    assert found["a", "c"] == 0.0  # it does not show
    many = np.random.default_rng(0).normal(size=(40, 1)) * np.linspace(0.1, 3.3, 60)
    assert max(similarity([many], [probe(f"p{i}") for i in range(60)], [1.0]).values()) <= 1.0  # whatever is rounded


@pytest.mark.usefixtures("signatures")
def test_the_most_similar_forms_count() -> None:
    one = block((1.0, 0.0), (0.0, 1.0), (0.8, 0.6))
    found = similarity([one], [probe("a"), probe("a"), probe("b")], [1.0])
    assert found["a", "b"] == pytest.approx(0.8)


@pytest.mark.usefixtures("signatures")
@pytest.mark.parametrize(("scope", "alike"), [("instrument", 0.0), ("material", 1.0)])
def test_an_effect_with_an_amplitude_a_material_may_take_either_sign(scope: str, alike: float) -> None:
    """Alike in both materials, but of opposite sign in the second: one amplitude for both cannot follow."""
    blocks = [block((1.0, 0.0), (2.0, 0.0)), block((0.0, 1.0), (0.0, -2.0))]
    found = similarity(blocks, [probe("a"), probe("b", scope)], [1.0, 1.0])
    assert found["a", "b"] == pytest.approx(alike)
    single = similarity(blocks[:1], [probe("a"), probe("b", scope)], [1.0])
    assert single["a", "b"] == pytest.approx(1.0)


@pytest.mark.usefixtures("signatures")
def test_materials_count_as_strongly_as_they_show_an_effect() -> None:
    """Cosine 1 where b has three quarters of its length squared, 0 where it has the rest: cos² is 3/4 at best."""
    blocks = [block((1.0, 0.0), (np.sqrt(3.0), 0.0)), block((1.0, 0.0), (0.0, 1.0))]
    found = similarity(blocks, [probe("a", "material"), probe("b")], [1.0, 1.0])
    assert found["a", "b"] == pytest.approx(np.sqrt(0.75))


@pytest.mark.usefixtures("signatures")
def test_copies_are_names_with_one_signature_for_every_form() -> None:
    nearly = (1.0, 0.01)  # cos 0.99995
    one = block((1.0, 0.0), (2.0, 0.0), (0.0, 1.0), nearly, (0.0, 0.0), (1.0, 0.02))
    names = ["a", "twin", "b", "b", "none", "near"]
    found = copies([one], [probe(n) for n in names], [1.0])
    # b has a form like a's, but also another one; `near` has cos 0.9998 with a and 0.99995 with one form of b
    assert found == {"a": 2, "twin": 2, "b": 1, "near": 1}


def test_a_group_holds_what_is_at_least_so_alike() -> None:
    alike = {("a", "b"): 0.96, ("a", "c"): 0.94, ("c", "d"): 0.99, ("a", "a"): 1.0}
    assert group_of(["a"], alike) == ["a", "b"]
    assert group_of(["c", "a"], alike) == ["c", "a", "b", "d"]


def test_the_probe_that_shows_best_says_what_is_detectable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each name that the block can show; thresholds are the name's own."""
    norms = np.array([[1.0, 3.0, 2.0, 9.0], [1.0, 3.0, 2.0, 9.0], [5.0, 3.0, 2.0, 9.0]])
    monkeypatch.setattr(power, "amplitude_80", lambda null, trial, k, threshold: (trial, k, threshold))
    where = [("a", 0, (0,)), ("a", 1, (0, 1)), ("b", 2, (0,)), ("b", 3, (1,))]
    candidates = [Candidate(k, name, blocks, True) for name, k, blocks in where]
    level = SimpleNamespace(threshold=lambda name, alpha: {"a": 5.0, "b": 6.0}[name])
    null: Any = SimpleNamespace(norm=norms)
    found = power.detectable(null, ["p0", "p1", "p2", "p3"], candidates, level)  # type: ignore[list-item, arg-type]
    assert found == {"a": (1, ("p1", 1, 5.0)), "b": (2, ("p2", 2, 6.0))}
    there = power.detectable(null, ["p0", "p1", "p2", "p3"], candidates, level, 1)  # type: ignore[list-item, arg-type]
    assert {name: k for name, (k, _) in there.items()} == {"a": 1, "b": 3}


def test_what_does_not_show_is_not_detectable() -> None:
    null: Any = SimpleNamespace(norm=np.zeros((3, 1)))
    assert power.amplitude_80(null, probe("a"), 0, 1.0) is None


TIMES = np.array([0.0, 10.0, 40.0])
PROTOCOL = Protocol(
    1500.0, np.array([1.0, 2.0, 4.0]), np.array([[0.0, 5.0, 0.0], TIMES, [0.0, 0.0, 0.0]]),
    np.array([[True, True, False], [True, True, True], [False, False, False]]), np.array([5.0, 40.0, 30.0]),
    np.arange(1, 4),
)  # fmt: skip
WHOLE = Protocol(
    1500.0, np.array([1.0, 2.0, 4.0]), np.tile(TIMES, (3, 1)), np.ones((3, 3), bool), np.full(3, 40.0), np.arange(1, 4)
)


def test_plans_are_what_their_words_say() -> None:
    unload, longer, both, finer = alternatives(WHOLE, True)
    assert unload.displacement_mm.tolist() == both.displacement_mm.tolist() == [1.0, 2.0, 4.0, 2.0, 1.0]
    assert longer.displacement_mm.tolist() == [1.0, 2.0, 4.0]
    assert finer.displacement_mm.tolist() == [1.0, 1.5, 2.0, 3.0, 4.0]
    assert unload.times_s.tolist() == finer.times_s.tolist() == TIMES.tolist()
    for plan in (longer, both):
        assert "600 s with 25 readings" in plan.words and len(plan.times_s) == 25
        assert plan.times_s[0] == 0.0 and plan.times_s[-1] == pytest.approx(600.0)
        assert np.ptp(np.diff(np.log(plan.times_s[1:]))) < 1e-9
    assert "from 4 to 1 mm, each held 40 s" in unload.words and "1 to 4 mm" in longer.words
    assert "of every sample" in alternatives(WHOLE, False)[0].words
    made = finer.protocol
    assert made.length_mm == 1500.0 and made.mask.all() and made.time_s.tolist() == [TIMES.tolist()] * 5
    assert made.number.tolist() == [1, 2, 3, 4, 5] and made.duration_s.tolist() == [40.0] * 5


def test_plans_hold_the_displacements_that_were_read_for_the_longest_series() -> None:
    unload = alternatives(PROTOCOL, True)[0]
    assert unload.displacement_mm.tolist() == [1.0, 2.0, 1.0]
    assert unload.times_s.tolist() == TIMES.tolist()
    one = PROTOCOL.__class__(1500.0, np.array([2.0]), TIMES[None], np.ones((1, 3), bool), np.array([40.0]), np.ones(1))
    assert alternatives(one, True)[0].displacement_mm.tolist() == [2.0, 2.0]


def test_another_length_is_twice_the_longest_with_steps_scaled_alike() -> None:
    from wirebayes.model.problem import build

    words, more = power._another_length(build([experiments()[1]]))
    first, second = more.samples
    assert "a second length, 3420 mm" in words or f"{2 * first.protocol.length_mm:g} mm" in words
    assert second.protocol.length_mm == 2.0 * first.protocol.length_mm
    recorded = first.protocol.displacement_mm[first.protocol.recorded]
    assert second.protocol.displacement_mm == pytest.approx(2.0 * recorded)
    assert more.prior.fixed == {"creep_length_exponent": 1.0}  # creep is a strain until readings say otherwise
    theta = more.prior.rvs(1, np.random.default_rng(0))
    own = [more.parameters(theta, s)["B"][0] for s in more.samples]
    assert own[1] == pytest.approx(2.0 * own[0])


@pytest.mark.parametrize(
    ("ratio", "pair", "message"),
    [
        (1.05, True, "None of the tests considered"),
        (1.15, True, "would then differ 1.1 times as much as now"),
        (900.0, True, "would then differ 900.0 times as much as now"),
        (1100.0, True, "at present they do not"),
        (np.inf, True, "at present they do not"),
        (1.05, False, "reveal a smaller"),
        (2.04, False, "Its signature would be 2.0 times as large as now"),
    ],
)
def test_a_measurement_is_proposed_where_it_tells_more(
    ratio: float, pair: bool, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(power, "_best_plan", lambda block, value: ("load it twice", ratio))
    one, other = probe("toe"), probe("memory")
    found = power.next_measurement(None, (one, other) if pair else None, None if pair else one)  # type: ignore[arg-type]
    assert message in found
    assert ("load it twice" in found) == (ratio >= 1.1)
    assert ("toe from memory" in found) == pair
    remainder = power.next_for_remainder(None)  # type: ignore[arg-type]
    assert ("load it twice" in remainder) == (ratio >= 1.1)


def test_without_a_candidate_nothing_is_to_be_distinguished() -> None:
    assert power.next_measurement(None, None, None).startswith("No candidate remains")  # type: ignore[arg-type]


def test_the_plan_with_the_largest_value_wins_and_is_compared_with_the_present_test(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A plan's value is here the number of holds: unloading makes five of three, twice as many steps too."""
    problem = SimpleNamespace(samples=[SimpleNamespace(protocol=WHOLE)])
    monkeypatch.setattr(power, "_another_length", lambda problem: ("length", WHOLE))
    monkeypatch.setattr(power, "with_protocols", lambda problem, protocols, empty: protocols[0])
    monkeypatch.setattr(power, "replace_problem", lambda target, other: other)
    fit: Any = SimpleNamespace(target=SimpleNamespace(problem=problem, displacement_mm=WHOLE.displacement_mm))
    words, ratio = power._best_plan(fit, lambda x: float(x.displacement_mm.sum()))  # type: ignore[attr-defined]
    assert words == "take twice as many, half as large steps over 1 to 4 mm" and ratio == pytest.approx(11.5 / 7.0)
    problem.samples.append(problem.samples[0])
    assert power._best_plan(fit, lambda x: float(x.displacement_mm.sum()))[0].endswith("each sample's displacements")  # type: ignore[attr-defined]
    assert power._best_plan(fit, lambda x: 0.0 if x is fit.target else 1.0)[1] == np.inf


def test_what_a_second_effect_takes_up_does_not_distinguish_the_first(monkeypatch: pytest.MonkeyPatch) -> None:
    """A signature 3 long beside the other, 4 along it: what distinguishes is 3, whatever the other's size."""
    monkeypatch.setattr(power, "expand", lambda target, z, trials: SimpleNamespace(ratio=[2.0], trials=trials))
    sizes = np.array([[4.0, 10.0], [3.0, 0.0]])
    monkeypatch.setattr(power, "projected", lambda x, ratio: sizes[:, : len(x.trials)] if ratio == 2.0 else None)
    fit: Any = SimpleNamespace(modes=SimpleNamespace(z=np.zeros((1, 1))))
    assert power._separation(None, fit, ["a", "b"]) == pytest.approx(3.0)  # type: ignore[arg-type, list-item]
    assert power._separation(None, fit, ["a"]) == pytest.approx(5.0)  # type: ignore[arg-type, list-item]
    sizes[:, 1] = [1e-3, 0.0]
    assert power._separation(None, fit, ["a", "b"]) == pytest.approx(3.0)  # type: ignore[arg-type, list-item]
    sizes[:, 1] = 0.0
    assert power._separation(None, fit, ["a", "b"]) == pytest.approx(5.0)  # type: ignore[arg-type, list-item]


def test_probes_of_the_bench_do_what_they_say() -> None:
    """The four that a plain model may absorb, on tensions and positions."""
    own, hold = {"a": np.array([0.1]), "c": np.array([1e-3])}, SimpleNamespace()
    hold.displacement_mm, hold.length_mm, hold.theta = 2.0, 1000.0, {"k1": np.array([500.0])}
    value = np.array([4.0])
    expected = {"_SensorGain": 4.4, "_ForceOffset": 4.1, "_DisplacementScale": 4.2}
    for name, wanted in expected.items():
        assert getattr(power, name)().apply(value, own, hold) == pytest.approx(wanted)
    # a wire of 500 N / 1000 mm and a fixture of 1e-3 mm/N in series: half a thousandth of the strain is the bench's
    assert power._Compliance().apply(value, own, hold) == pytest.approx(4.0 / (1.0 + 0.5e-3))
    assert isinstance(Probe(named("memory"), {}, 1.0, False), Probe)
