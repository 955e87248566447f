"""Hidden effects at any scale: the independent law against the package's, sizes as asked for, names that look alike."""

from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from scipy import stats

from analyses.discovery.hidden_any_scale import is_right, is_wrong, kind_of, kinds_of, measured
from analyses.hidden_effects.scaled_cases import FOREIGN, KINDS, OF_LENGTHS, group
from analyses.hidden_effects.scaled_draws import DELTAS, draw_case, draw_case_and_hidden, draw_hidden, draw_lengths
from analyses.hidden_effects.scaled_law import Hidden, ScaledTest, readings
from analyses.hidden_effects.scaled_lengths import DEPENDENT
from analyses.hidden_effects.scaled_sizes import PLAIN
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.fit import seed_of
from wirebayes.wire.effect import Amplitude, Effect, Typical
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import simulate

TRUTH = {"k1": 500.0, "B": 0.3, "U": 0.7, "k2": 0.05, "N": 0.7, "preload": 0.3}
TIMES = np.array([0.0, 10.0, 30.0, 60.0, 100.0])
PATH = np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 4.0, 2.0])
HOLDS = len(PATH)
# an effect's key in the package, its size and its other constants there, and the latter here
CASES = [
    ("strain_stiffening", {"c": 20.0}, {}),
    ("toe", {"w": 1.0}, {}),
    ("power_strain", {"p": 0.2}, {}),
    ("permanent_creep", {"psi": 0.5}, {}),
    ("superposition", {"omega": 0.5}, {}),
    ("second_relaxation", {"A": 0.1, "T2": 40.0}, {"time_s": 40.0}),
    ("steady_creep", {"a": 1e-4}, {}),
    ("steady_creep@carried", {"a": 1e-4}, {"carried": 1.0}),
    ("tension_dependent_rate", {"m": 0.5}, {}),
    ("ageing", {"a": 0.4}, {}),
    ("creep_threshold", {"tau_c": 0.5}, {}),
    ("grip_slip@4", {"w": 0.2}, {"hold": 3.0}),
    ("unrecorded_hold@4", {"T": 300.0}, {"hold": 3.0}),
    ("reading_delay", {"t_d": 4.0}, {}),
    ("late_clock", {"t_d": 4.0}, {}),
    ("sensor_drift", {"a": 1e-4}, {}),
    ("sensor_nonlinearity", {"a": 0.05}, {}),
    ("clamp_transient", {"a": 0.05, "T": 20.0}, {"time_s": 20.0}),
    ("lost_motion", {"w": 0.1}, {}),
    ("guide_friction", {"mu": 0.05}, {}),
    ("thermal_expansion", {"alpha": 1e-4}, {}),
]
OF_STEPS = [
    ("prior_creep", {"T_0": 500.0}, {}),
    ("screw_error", {"a": 0.05, "P": 2.5, "phi": 0.5}, {"period": 2.5, "phase": 0.5}),
]


def both_programs(
    weights: bool,
    key: str,
    own: dict[str, float],
    shapes: dict[str, float],
    effect: Effect | None = None,
    truth: dict[str, float] = TRUTH,
) -> tuple[np.ndarray, ...]:
    """Readings with the effect by both, and without it; of one in no catalogue as a user would add it."""
    settings = 0.5 * PATH if weights else PATH
    warming = np.array([np.linspace(0.0, 1.0, len(TIMES)) + 0.5 * j for j in range(HOLDS)])
    lasting = np.full(HOLDS, 130.0)
    test = ScaledTest(weights, 1000.0, settings, (TIMES,) * HOLDS, lasting, tuple(warming), 1.0)
    none = np.zeros(HOLDS)
    hidden = Hidden(key.split("@")[0], next(iter(own.values())), shapes)
    here, plain = (readings(test, truth, effect, none) for effect in (hidden, Hidden()))
    effect = effect or effect_named(key)
    columns = {name: np.array([value]) for name, value in truth.items()}
    columns |= {f"{effect.name}.{name}": np.array([value]) for name, value in own.items()}
    times, read = np.tile(TIMES, (HOLDS, 1)), np.ones((HOLDS, len(TIMES)), bool)
    control = "force" if weights else "displacement"
    protocol = Protocol(
        1000.0,
        settings,
        times,
        read,
        lasting,
        np.arange(1, HOLDS + 1),
        warming,
        20.0,
        control,  # type: ignore[arg-type]
    )
    there = simulate(protocol, columns, Model(effects=(effect,), tension_ref_N=1.0))[..., 0]
    return here, there[protocol.mask], plain


@pytest.mark.parametrize(("key", "own", "shapes"), CASES, ids=lambda value: value if isinstance(value, str) else "")
@pytest.mark.parametrize("weights", [False, True], ids=["steps", "weights"])
def test_the_independent_law_reads_as_the_package_does(weights, key, own, shapes):
    here, there, plain = both_programs(weights, key, own, shapes)
    assert np.abs(here - plain).max() > 1e-3
    assert here == pytest.approx(there, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize(("key", "own", "shapes"), OF_STEPS, ids=lambda value: value if isinstance(value, str) else "")
def test_so_it_does_of_what_only_steps_show(key, own, shapes):
    here, there, plain = both_programs(False, key, own, shapes)
    assert np.abs(here - plain).max() > 1e-3
    assert here == pytest.approx(there, rel=1e-9, abs=1e-11)


def foreign(name, place, formula):
    """An effect of the user's own, of one amplitude."""

    class Own(Effect):
        amplitudes = (Amplitude("a", "-", 0.0, stats.norm(0.0, 1.0)),)
        scope, sentence = "environment", "Of the user's own."

        def apply(self, value, own, hold):
            return formula(value, own["a"], hold)

    Own.name, Own.place = name, place
    return Own()


def bump(at, centre, width):
    return np.exp(-0.5 * ((at - centre) / width) ** 2)


def clock_s(hold):
    return hold.start_s + hold.time_s


IN_NO_CATALOGUE = {
    "yield": (0.4, {"strain": 0.003}, "strain", lambda s, a, hold: s - a * np.maximum(s - 0.003, 0.0)),
    "hold_softening": (0.03, {}, "strain", lambda s, a, hold: s * (1.0 - a * hold.index)),
    "log_creep": (
        0.5,
        {"onset_s": 10.0, "long_s": 300.0},
        "fraction",
        lambda phi, a, hold: (1.0 - a) * phi + a * np.log1p(hold.time_s / 10.0) / np.log1p(30.0),
    ),
    "exponent_by_tension": (
        0.2,
        {},
        "clock",
        lambda t, a, hold: t ** (1.0 + a * np.log(hold.initial_tension / hold.tension_ref_N)),
    ),
    "worn_thread": (
        0.2,
        {"centre": 3.2, "width": 0.7},
        "position",
        lambda x, a, hold: x + a * bump(hold.displacement_mm, 3.2, 0.7),
    ),
    "gain_step": (0.05, {"hold": 3.0}, "reading", lambda y, a, hold: y * (1.0 + a * (hold.index >= 3))),
    "zero_step": (0.05, {"hold": 3.0}, "reading", lambda y, a, hold: y + a * (hold.index >= 3)),
    "wave": (
        0.05,
        {"period_s": 400.0, "phase": 0.4},
        "reading",
        lambda y, a, hold: y + a * np.sin(2.0 * np.pi * clock_s(hold) / 400.0 + 0.4),
    ),
    "passing_draught": (
        0.05,
        {"centre": 500.0, "width": 90.0},
        "reading",
        lambda y, a, hold: y + a * bump(clock_s(hold), 500.0, 90.0),
    ),
}


# there is no screw under weights
OF_NO_CATALOGUE = [*product([False], IN_NO_CATALOGUE), *product([True], set(IN_NO_CATALOGUE) - {"worn_thread"})]


@pytest.mark.parametrize(("weights", "name"), sorted(OF_NO_CATALOGUE))
def test_an_effect_in_no_catalogue_is_what_a_user_would_write(weights, name):
    size, shapes, place, formula = IN_NO_CATALOGUE[name]
    here, there, plain = both_programs(weights, name, {"a": size}, shapes, foreign(name, place, formula))
    assert np.abs(here - plain).max() > 1e-3
    assert here == pytest.approx(there, rel=1e-9, abs=1e-11)


@pytest.mark.parametrize("weights", [False, True], ids=["steps", "weights"])
def test_a_bench_that_gives_way_does_so_in_proportion_to_the_tension(weights):
    """The package divides by the sample's length, the law by the wire's: they differ by the strain of its creep."""
    own = ("fixture_compliance", {"c": 0.2}, {})
    here, there, plain = both_programs(weights, *own, truth=TRUTH | {"B": 0.0})
    assert np.abs(here - plain).max() > 1e-2
    assert here == pytest.approx(there, rel=1e-9, abs=1e-11)
    here, there, plain = both_programs(weights, *own)
    assert np.abs(here - there).max() < 2e-3 * np.abs(here - plain).max()


@pytest.mark.parametrize("which", range(len(DEPENDENT)))
@pytest.mark.parametrize("weights", [False, True], ids=["steps", "weights"])
def test_a_parameter_depends_on_the_length_as_in_the_package(weights, which):
    pair = draw_lengths(np.random.default_rng(5), weights)
    hidden = Hidden("length_dependence", 0.4, {"which": float(which)})
    (first, second) = measured(pair, hidden, np.random.default_rng(1))
    reference = np.sqrt(first.length_mm * second.length_mm)
    effect = effect_named(f"length_dependence@{DEPENDENT[which]}")
    read = []
    for part, test in zip(pair.parts, (first, second), strict=True):
        columns = {name: np.array([value]) for name, value in part.truth.items()}
        columns |= {"length_dependence.p": np.array([0.4])}
        protocol = test.protocol()
        typical = Typical(pair.typical_tension_N, pair.typical_hold_s)
        model = Model(effects=(effect,), length_ref_mm=float(reference), typical=typical)
        read.append(simulate(protocol, columns, model)[..., 0][protocol.mask])
    assert np.concatenate(read) == pytest.approx(pair.noise_free(hidden), rel=1e-9, abs=1e-11)
    assert pair.delta(hidden) > 0.0


def test_creep_of_the_longer_specimen_is_in_proportion_and_what_is_of_one_test_is_in_that_one():
    pair = draw_lengths(np.random.default_rng(5), weights=True)
    one, other = pair.parts
    assert other.truth["B"] / one.truth["B"] == pytest.approx(other.test.length_mm / one.test.length_mm)
    slip = pair.noise_free(Hidden("grip_slip", 1.0, {"hold": 2.0, "test": 1.0})) - pair.plain
    assert not slip[: len(one.plain)].any() and slip[len(one.plain) :].any()
    # a preload of each test, and what they have in common, can be absorbed
    for name in ("k1", "preload"):
        parts = (replace(one, truth=one.truth | {name: 1.001 * one.truth[name]}), other)
        moved = np.append(parts[0].plain, parts[1].plain) - pair.plain
        left = np.linalg.norm(pair.projected(moved)) / np.linalg.norm(pair.whitened(moved))
        assert (left < 0.02) == (name == "preload")


def test_all_effects_are_compared():
    assert {key.split("@")[0] for key, _, _ in CASES + OF_STEPS} == set(KINDS)
    assert set(IN_NO_CATALOGUE) == set(FOREIGN)
    assert set(OF_LENGTHS) == {"fixture_compliance", "length_dependence"}


def test_every_effect_of_the_catalogue_can_be_hidden_at_any_scale():
    assert set(KINDS | OF_LENGTHS) == set(CATALOGUE), "an effect needs a row in KINDS of scaled_cases.py"


@pytest.mark.parametrize("kind", ["foreign", "lengths"])
@pytest.mark.parametrize("weights", [False, True], ids=["steps", "weights"])
def test_what_is_hidden_is_of_its_kind_and_of_the_size_asked_for(weights, kind):
    case, drawn = draw_case_and_hidden(np.random.default_rng(7), weights, kind)
    hidden, delta = drawn
    assert hidden.name in {"foreign": FOREIGN, "lengths": OF_LENGTHS}[kind]
    assert case.left(hidden) == pytest.approx(delta, rel=0.06)
    alike = group(case, hidden, case.delta(hidden))
    assert ("unknown" in alike) == (kind == "foreign") and (hidden.name in alike) == (kind == "lengths")


def test_what_has_no_name_is_answered_rightly_where_none_is_given():
    row = {"group": ["unknown", "grip_slip"], "verdict": "unknown", "effects": [], "best": "unknown", "p_global": 0.01}
    assert is_right(row) and not is_wrong(row)
    assert is_right(row | {"verdict": "named", "effects": ["grip_slip"]})
    assert is_wrong(row | {"verdict": "named", "effects": ["toe"]})
    known = row | {"group": ["toe"]}
    assert not is_right(known) and not is_wrong(known)


def test_three_of_five_tests_hide_what_one_test_shows_and_each_kind_is_under_both_controls():
    kinds = [kind_of(index) for index in range(20)]
    assert [kinds.count(kind) for kind in ("catalogue", "foreign", "lengths")] == [12, 4, 4]
    assert all(kinds[2 * i] == kinds[2 * i + 1] for i in range(10))
    about = {"weights": True, "rests": False, "readings": "few"}
    counted = kinds_of([about | {"kind": kind} for kind in kinds])
    assert len(counted["two lengths"]) == 4 and len(counted["weights"]) == 20


@pytest.mark.parametrize("seed", range(6))
def test_an_effect_has_the_size_that_was_asked_for(seed):
    rng = np.random.default_rng(seed)
    case = draw_case(rng, weights=seed % 2 == 0)
    hidden, delta = draw_hidden(case, rng)
    assert delta in DELTAS and hidden.name in case.shown()
    assert case.left(hidden) == pytest.approx(delta, rel=0.06)
    assert abs(hidden.amplitude) <= case.largest(hidden.name)
    # what the parameters can absorb is not counted
    moved = replace(case, truth=case.truth | {"k1": 1.001 * case.truth["k1"]}).plain - case.plain
    whole, left = np.linalg.norm(case.whitened(moved)), np.linalg.norm(case.projected(moved))
    assert left < 0.02 * whole


def test_of_a_large_effect_that_parameters_can_hide_little_is_left():
    """A second mode of creep as large as the first: its signature has a δ of 8, and other parameters read the same."""
    case = draw_case(np.random.default_rng(seed_of(0, "hidden at any scale", "11")), weights=False)
    hidden = case.of_delta(Hidden("second_relaxation", 1.0, {"time_s": 540.2}), 8.0)
    assert case.delta(hidden) == pytest.approx(8.0, rel=0.03)
    assert case.left(hidden) < 3.0
    # what no parameter does is left as it is
    slip = case.of_delta(Hidden("grip_slip", 1.0, {"hold": 3.0}), 8.0)
    assert case.left(slip) == pytest.approx(8.0, rel=0.05)
    # and what one parameter does is not left at all, but for its distance from the truth
    moved = case.with_parameters({**dict.fromkeys(PLAIN, 0.0), "k2": 0.3})
    assert case.moved(np.array([0.0, 0.0, 0.0, 0.3, 0.0, 0.0])) == pytest.approx(moved.plain, rel=1e-12)
    assert moved.truth["B"] == case.truth["B"] and moved.truth["k2"] == pytest.approx(case.truth["k2"] * np.exp(0.45))


def test_what_looks_alike_is_of_the_group():
    rng = np.random.default_rng(19)
    case = draw_case(rng, weights=False)
    alike = group(case, Hidden("strain_stiffening", 0.24 * case.largest("strain_stiffening"), {}), 8.0)
    assert {"strain_stiffening", "power_strain"} <= set(alike) and "grip_slip" not in alike
