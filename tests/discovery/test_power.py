"""Similar effects and what to measure next: cosines by hand, and plans that are what their words say."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from wirebayes.discovery import power
from wirebayes.discovery.power import group_of, similarity
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.scans import Pieces, Scan, joined
from wirebayes.discovery.screening import Candidate
from wirebayes.effects import effect_named


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
def test_a_group_holds_what_is_at_least_so_alike() -> None:
    alike = {("a", "b"): 0.96, ("a", "c"): 0.94, ("c", "d"): 0.99, ("a", "a"): 1.0}
    assert group_of(["a"], alike) == ["a", "b"]
    assert group_of(["c", "a"], alike) == ["c", "a", "b", "d"]


def test_the_probe_that_shows_best_says_what_is_detectable(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of each name that the block can show, at one amplitude; thresholds are the name's own."""
    norms = np.array([[1.0, 3.0, 2.0, 9.0], [1.0, 3.0, 2.0, 9.0], [5.0, 3.0, 2.0, 9.0]])
    monkeypatch.setattr(power, "amplitude_80", lambda null, trial, k, threshold: 10.0 * k + threshold)
    trials: Any = [SimpleNamespace(step=1.0, effect=effect_named("ageing"))] * 4
    where = [("a", 0, (0,)), ("a", 1, (0, 1)), ("b", 2, (0,)), ("b", 3, (1,))]
    candidates = [Candidate(k, name, blocks, True) for name, k, blocks in where]
    level = SimpleNamespace(threshold=lambda name, alpha: {"a": 5.0, "b": 6.0}[name])
    null: Any = SimpleNamespace(norm=norms)
    found = power.detectable(null, trials, candidates, level)  # type: ignore[arg-type]
    assert found == {"a": (1, 15.0), "b": (2, 26.0)}
    there = power.detectable(null, trials, candidates, level, 1)  # type: ignore[arg-type]
    assert {name: k for name, (k, _) in there.items()} == {"a": 1, "b": 3}


def smallest_seen(rungs: Sequence[tuple[float, int, float | None]]) -> power.Detectable:
    return power.smallest_seen([power.Rung(*rung) for rung in rungs])


def test_an_effect_that_grows_with_the_square_of_its_amplitude_is_not_promised_by_its_largest_probe() -> None:
    """δ = (10 a)², seen from 4 on, so at 0.2: the probe at 0.9 alone would promise 4 / 90 = 0.044."""
    steps = (0.03, 0.1, 0.3, 0.9)
    rungs = [(step, k, 4.0 * step / (10.0 * step) ** 2) for k, step in enumerate(steps)]
    assert smallest_seen(rungs) == (2, pytest.approx(0.2))
    linear = [(step, k, 0.05) for k, step in enumerate(steps)]
    assert smallest_seen(linear) == (1, pytest.approx(0.05))
    assert smallest_seen([(0.1, 7, 0.02)]) == (7, 0.02)  # a form that is linear has one probe
    assert smallest_seen([(0.1, 7, 0.5)]) == (7, 0.5)
    assert smallest_seen([(0.1, 0, None), (0.3, 1, 0.2)]) == (1, 0.3)  # nothing is known in between
    assert smallest_seen([(0.1, 0, 0.9), (0.3, 1, None)]) == (1, None)


def test_an_effect_that_saturates_is_not_promised_to_be_seen_at_some_size() -> None:
    """Beyond the largest probe the share of what is needed grows as it did before; far beyond nothing is said."""
    root = [(step, k, 2.0 * step**0.5) for k, step in enumerate((1.0, 3.0))]  # half of what is needed at 1
    assert smallest_seen(root) == (1, pytest.approx(4.0))
    linear = [(step, k, 5.0) for k, step in enumerate((1.0, 3.0))]
    assert smallest_seen(linear) == (1, pytest.approx(5.0))
    for needed, found in ((8.9, pytest.approx(8.9)), (9.1, None)):
        assert smallest_seen([(1.0, 0, needed), (3.0, 1, needed)]) == (1, found)
    for needed in (6.0 - 1e-9, 6.1):  # it shows hardly more at three than at one, or less
        assert smallest_seen([(1.0, 0, 2.0), (3.0, 1, needed)]) == (1, None)
    assert smallest_seen([(1.0, 0, None), (3.0, 1, 4.0)]) == (1, None)


def test_no_amplitude_is_promised_that_the_effect_cannot_have(monkeypatch: pytest.MonkeyPatch) -> None:
    """A share of superposition of three does not exist, an ageing of three does; both would be seen."""
    monkeypatch.setattr(power, "amplitude_80", lambda null, trial, k, threshold: 3.0)
    trials: Any = [SimpleNamespace(step=0.9, effect=effect_named(name)) for name in ("superposition", "ageing")]
    candidates = [Candidate(k, trial.effect.name, (0,), True) for k, trial in enumerate(trials)]
    level: Any = SimpleNamespace(threshold=lambda name, alpha: 5.0)
    null: Any = SimpleNamespace(norm=np.ones((3, 2)))
    assert power.detectable(null, trials, candidates, level) == {"superposition": (0, None), "ageing": (1, 3.0)}


def test_what_does_not_show_is_not_detectable() -> None:
    null: Any = SimpleNamespace(norm=np.zeros((3, 1)))
    assert power.amplitude_80(null, probe("a"), 0, 1.0) is None


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
    assert isinstance(Probe(effect_named("superposition"), {}, 1.0, False), Probe)


def test_a_group_takes_no_one_who_is_exactly_at_its_bound() -> None:
    assert group_of(["a"], {("a", "b"): 0.95, ("a", "c"): 0.9501}) == ["a", "c"]


@pytest.mark.parametrize("one_sided", [True, False])
def test_a_detectable_amplitude_is_a_bisection_of_the_largest(one_sided: bool) -> None:
    """Of all that are smaller than δ = 40 by the median norm; four simulations of five, exactly, are enough."""
    asked: list[Any] = []

    def of(i: int) -> Any:
        asked.append(i)
        return SimpleNamespace(log_bayes=lambda amplitude: np.where(np.arange(5) < 4, amplitude, 0.0) / 0.7)

    null: Any = SimpleNamespace(norm=np.array([[9.0, 2.0], [9.0, 4.0], [9.0, 80.0]]), pieces=SimpleNamespace(of=of))
    trial: Any = SimpleNamespace(one_sided=one_sided)
    found = power.amplitude_80(null, trial, 1, power.occam(one_sided) + 2.0)
    assert asked == [1]
    assert found == pytest.approx(1.4 + 0.5 * 10.0 / 2**12, abs=0.51 * 10.0 / 2**12) and found > 1.4
    steps = found * 2**12 / 10.0  # of the largest, 40 over the median of the norms
    assert steps == round(steps)
    assert power.amplitude_80(null, trial, 1, power.occam(one_sided) + 10.0 / 0.7) is None  # it must be passed
    assert power.amplitude_80(null, trial, 1, power.occam(one_sided) + 9.99 / 0.7) == pytest.approx(10.0, abs=0.02)


def test_what_the_plain_model_takes_up_and_what_a_protocol_cannot_show_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    """From nine tenths on; a fixture's compliance is left to the catalogue where that can show it."""
    asked: list[Any] = []

    def expand(target: Any, z: np.ndarray, trials: Any) -> Any:
        asked.append((target, z.tolist(), [(type(t.effect).__name__, t.own, t.step, t.one_sided) for t in trials]))
        whole = np.tile([[6.0], [8.0]], len(trials))  # each of length ten
        return SimpleNamespace(signatures=[whole, None], left=np.array([[1.0, 0.96, 0.0, 4.0], [0.1, 0.0, 0.5, 0.0]]))

    monkeypatch.setattr(power, "expand", expand)
    monkeypatch.setattr(power, "projected", lambda x, ratio: x.left[:, : x.signatures[0].shape[1]] + ratio)
    block: Any = SimpleNamespace(
        experiments=[SimpleNamespace(control="displacement")],
        target="target",
        z=np.array([[1.0]]),
    )
    kinds: Any = [SimpleNamespace(name=n, shows=f"shows {n}") for n in ("superposition", "toe")]
    found = power.not_identifiable(block, kinds, ["superposition"])
    assert found == [
        "constant force offset: 90.4 % of it is absorbed by the model's own parameters",
        "scale of the displacement: 95.0 % of it is absorbed by the model's own parameters",
        "toe: this protocol cannot show it (shows toe)",
    ]
    ((target, z, trials),) = asked
    assert target == "target" and z == [[1.0]]
    names = [
        ("_SensorGain", "gain of the force sensor.a"),
        ("_ForceOffset", "constant force offset.a"),
        ("_DisplacementScale", "scale of the displacement.a"),
        ("_Compliance", "compliance of the fixture.c"),
    ]
    assert trials == [(kind, {column: 1e-3}, 1e-3, False) for kind, column in names]
    with_compliance: Any = [*kinds, SimpleNamespace(name="fixture_compliance", shows="needs two lengths")]
    found = power.not_identifiable(block, with_compliance, ["superposition"])
    assert sum("compliance" in sentence for sentence in found) == 1
    assert [t[0] for t in asked[1][2]] == ["_SensorGain", "_ForceOffset", "_DisplacementScale"]
    block.experiments[0].control = "force"
    hung = power.not_identifiable(block, kinds, ["superposition"])
    assert [t[0] for t in asked[2][2]] == ["_SensorGain", "_ForceOffset", "_Compliance"]
    assert hung[0].startswith("constant displacement offset: 90.4 %")
    for kind in power._ABSORBABLE:
        assert kind.amplitudes[0].neutral == 0.0


def test_pieces_are_those_of_the_first_simulations() -> None:
    rng = np.random.default_rng(0)

    def made(n: int) -> Scan:
        shared, rss, along, square = rng.normal(size=(2, n)), rng.normal(size=(2, n)), *rng.normal(size=(2, 2, n, 3))
        pieces = Pieces(shared, rss, along, square, square > 0.0, 5, rng.normal(size=n), np.zeros(3, bool))
        ones = np.ones((n, 3))
        return Scan(rng.normal(size=(n, 3)), rng.normal(size=n), rng.normal(size=n), ones, ones, pieces)

    parts = [made(n) for n in (200, 150, 150)]
    first = joined(parts[:2])
    both = joined([first, parts[2]])
    for name, axis in (("shared", 1), ("rss", 1), ("along", 1), ("square", 1), ("is_left", 1), ("least", 0)):
        whole = np.concatenate([getattr(p.pieces, name) for p in parts], axis=axis)
        expected = whole[:, :300] if axis else whole[:300]
        np.testing.assert_array_equal(getattr(first.pieces, name), expected)
        np.testing.assert_array_equal(getattr(both.pieces, name), expected)
    np.testing.assert_array_equal(both.effects, np.concatenate([p.effects for p in parts]))
