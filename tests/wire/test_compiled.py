"""The compiled staircase and filter against the ones in numpy, which other tests compare with independent truth."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from tests.wire.protocols import PLAIN, parameters, protocol, protocols
from wirebayes.effects import CATALOGUE
from wirebayes.effects.creep import SteadyCreepCarried, Superposition, TensionDependentRate
from wirebayes.effects.elastic import LengthDependence, StrainStiffening, ToeOfStrain
from wirebayes.effects.event import UnrecordedHold
from wirebayes.effects.instrument import ReadingDelay
from wirebayes.effects.rivals import RIVALS
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.io.paper import experiments
from wirebayes.model import likelihoods, single_holds
from wirebayes.model.build import build
from wirebayes.model.hold_filter import Measured
from wirebayes.model.spec import ModelSpec
from wirebayes.wire import compiled
from wirebayes.wire.effect import Effect, EventEffect, Typical
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import Linearised, linearise, simulate, streamed

NEEDS_KERNEL = pytest.mark.skipif(compiled.kernel is None, reason="the package was installed without a C compiler")
pytestmark = NEEDS_KERNEL

TIMES = [0.0, 30.0, 60.0, 90.0, 120.0]
ONE_WAY = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]


def forms() -> list[Effect]:
    """Every form of every effect of the catalogue, events at two holds."""
    out: list[Effect] = [
        SteadyCreepCarried(),
        ToeOfStrain(),
        *(LengthDependence(which) for which in ("k1", "B", "U", "N")),
    ]
    for kind in CATALOGUE.values():
        if issubclass(kind, EventEffect):
            out += [kind(hold=1), kind(hold=3)]
        elif kind is not LengthDependence:
            out.append(kind())
    return out


FORMS = forms()
LAWS_OF_CREEP = [rival() for rival in RIVALS.values()]  # nothing is their neutral value
models = st.builds(
    Model,
    st.sampled_from(["hooke", "modified"]),
    st.sampled_from(["saturating", "additive"]),
    st.lists(st.sampled_from(FORMS + LAWS_OF_CREEP), max_size=4, unique_by=lambda e: e.name).map(tuple),
    st.just(3.0),
    st.sampled_from([0.0, 800.0]),
    st.just(Typical(2.5, 90.0)),
)


def by_numpy(compute: Callable[[], Any]) -> Any:
    """What a function returns where nothing was compiled; creep that feeds on itself may leave all numbers."""
    with pytest.MonkeyPatch.context() as patch, np.errstate(over="ignore", invalid="ignore"):
        patch.setattr(compiled, "kernel", None)
        return compute()


def drawn(model: Model, rows: list[dict[str, float]], seed: int) -> dict[str, np.ndarray]:
    """The rows as columns, with amplitudes from their priors."""
    rng = np.random.default_rng(seed)
    out = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    for effect in model.effects:
        priors = zip(effect.columns(), effect.amplitudes, strict=True)
        out |= {column: a.prior.rvs(len(rows), random_state=rng) for column, a in priors}
    return out


def same(found: Any, expected: Any, scale: float) -> None:
    np.testing.assert_allclose(found, expected, rtol=1e-8, atol=1e-9 * scale)


@settings(deadline=None)
@given(protocols(), models, st.lists(parameters(), min_size=1, max_size=3), st.integers(0, 2**32 - 1))
def test_readings_and_derivatives_are_those_of_numpy(p, model, rows, seed):
    theta = drawn(model, rows, seed)
    assert compiled.call(p, theta, model) is not None
    line, expected = linearise(p, theta, model), by_numpy(lambda: linearise(p, theta, model))
    fields = {name: value for name, value in vars(expected).items() if name != "edges"}
    assume(all(np.isfinite(value).all() for value in fields.values()))
    # of a wire that is just slack, or pulls by rounding alone, the derivatives are anything
    stretched = theta["preload"] + p.setting[:, None] - expected.creep[:-1]
    assume((np.abs(stretched) > 1e-3).all())
    assume(not any(((t > 0) & (t < 1e-6 * theta["k1"])).any() for t in (line.reading, expected.reading)))
    for name, value in fields.items():
        same(getattr(line, name), value, theta["k1"].max())
    setting = np.random.default_rng(seed).normal(0.0, 0.1, (len(p.setting), len(rows)))
    same(simulate(p, theta, model, setting), by_numpy(lambda: simulate(p, theta, model, setting)), theta["k1"].max())


@settings(deadline=None)
@given(protocols(), models, st.lists(parameters(), min_size=1, max_size=3), st.integers(0, 2**32 - 1))
def test_single_holds_are_those_of_numpy(p, model, rows, seed):
    theta = drawn(model, rows, seed)
    first = np.random.default_rng(seed).uniform(-0.5, 8.0, (len(p.setting), 1))
    found = single_holds.hold_courses(p, theta, model, first)
    expected = by_numpy(lambda: single_holds.hold_courses(p, theta, model, first))
    for one, other, recorded in zip(found, expected, p.recorded, strict=True):
        assert (one is not None) == (other is not None) == recorded
        if one is not None:
            assert (one[2] == other[2]).all()
            for a, b in zip(one[:2], other[:2], strict=True):
                same(a[:, one[2]], b[:, one[2]], theta["k1"].max())


@settings(deadline=None)
@given(protocols(), parameters(), st.floats(1e-3, 0.3), st.floats(1e-3, 1.0), st.integers(0, 2**32 - 1))
def test_filters_are_those_of_numpy(p, row, sensor_sd, setting_sd, seed):
    theta = drawn(Model(), [row, row], seed)
    line = linearise(p, theta)
    readings = line.reading[..., :1] + np.random.default_rng(seed).normal(0.0, sensor_sd, (*p.time_s.shape, 1))
    seen = Measured(readings, p.mask, np.array([sensor_sd**2, 0.01]), np.array([setting_sd, 0.0]))
    found, expected = likelihoods.chain(line, seen), by_numpy(lambda: likelihoods.chain(line, seen))
    for name, value in vars(expected).items():
        np.testing.assert_allclose(getattr(found, name), value, rtol=1e-7, atol=1e-9)
    for one, other in zip(
        likelihoods.standardised(line, seen), by_numpy(lambda: likelihoods.standardised(line, seen)), strict=True
    ):
        np.testing.assert_allclose(one, other, rtol=1e-7, atol=1e-9)


@settings(deadline=None)
@given(protocols(), models, st.lists(parameters(), min_size=1, max_size=3), st.integers(0, 2**32 - 1))
def test_filtering_a_staircase_as_it_is_computed_gives_the_same_bits_as_one_after_the_other(p, model, rows, seed):
    theta, rng = drawn(model, rows, seed), np.random.default_rng(seed)
    line = linearise(p, theta, model)
    readings = rng.normal(3.0, 1.0, (*p.time_s.shape, len(rows)))
    readings[rng.integers(len(readings)), :, 0] = np.nan  # of the first column one hold is not seen
    noise = rng.uniform(0.01, 0.1, len(rows)), rng.uniform(0.0, 1.0, len(rows))
    seen = Measured(readings, p.mask, *noise)
    assert not isinstance(streamed(p, theta, model), Linearised)
    at_once = likelihoods.chain(streamed(p, theta, model), seen)
    for name, value in vars(likelihoods.chain(line, seen)).items():
        np.testing.assert_array_equal(getattr(at_once, name), value)
    found = likelihoods.standardised(streamed(p, theta, model), seen)
    for one, other in zip(found, likelihoods.standardised(line, seen), strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("effect", FORMS, ids=lambda e: e.key)
def test_each_effect_moves_the_compiled_readings(effect):
    p = protocol([*ONE_WAY, 3.0, 1.0], [TIMES] * 8, warming=np.linspace(0.0, 5.0, 40).reshape(8, 5))
    model = Model(effects=(effect,), tension_ref_N=3.0, length_ref_mm=800.0, typical=Typical(2.0, 100.0))
    theta = {name: np.array([value]) for name, value in PLAIN.items()}
    typical = {c: np.array([a.prior.ppf(0.8)]) for c, a in zip(effect.columns(), effect.amplitudes, strict=True)}
    neutral = {
        c: np.array([a.prior.ppf(0.8) if a.is_shape else a.neutral])
        for c, a in zip(effect.columns(), effect.amplitudes, strict=True)
    }
    plain = simulate(p, theta, Model())
    same(simulate(p, theta | neutral, model), plain, 1.0)
    moved = simulate(p, theta | typical, model)
    assert np.abs(moved - plain).max() > 1e-3
    same(moved, by_numpy(lambda: simulate(p, theta | typical, model)), 1.0)


@pytest.mark.parametrize("law", LAWS_OF_CREEP, ids=lambda e: e.name)
@pytest.mark.parametrize("beside", [(), (Superposition(),), (ReadingDelay(),)], ids=["alone", "superposition", "delay"])
def test_each_law_of_creep_moves_the_compiled_readings(law, beside):
    p = protocol([*ONE_WAY, 3.0, 1.0], [TIMES] * 8)
    model = Model(effects=(law, *beside), tension_ref_N=3.0)
    theta = {name: np.array([value]) for name, value in PLAIN.items()}
    theta |= {
        c: np.array([a.prior.ppf(0.8)]) for e in model.effects for c, a in zip(e.columns(), e.amplitudes, strict=True)
    }
    found = simulate(p, theta, model)
    assert np.abs(found - simulate(p, theta, Model(effects=beside, tension_ref_N=3.0))).max() > 1e-3
    same(found, by_numpy(lambda: simulate(p, theta, model)), 1.0)


@pytest.mark.parametrize("during", [TensionDependentRate(), SteadyCreepCarried(), *LAWS_OF_CREEP], ids=lambda e: e.key)
def test_a_wait_creeps_in_both_twins_as_a_hold_does(during):
    p = protocol(ONE_WAY, [TIMES] * 6)
    model = Model(effects=(during, UnrecordedHold(3)), tension_ref_N=3.0)
    theta = {name: np.array([value]) for name, value in PLAIN.items()}
    theta |= {
        c: np.array([a.prior.ppf(0.8)]) for e in model.effects for c, a in zip(e.columns(), e.amplitudes, strict=True)
    }
    line = linearise(p, theta, model)
    expected = by_numpy(lambda: linearise(p, theta, model))
    for name, value in vars(expected).items():
        if isinstance(value, np.ndarray):
            same(getattr(line, name), value, PLAIN["k1"])


def test_two_wires_of_the_same_strain_share_no_elastic_part():
    """The compiled twin keeps the elastic part of the last strain, which all readings of a hold have."""
    p = protocol([5.0], [TIMES])
    theta = {name: np.array([value, value]) for name, value in PLAIN.items()} | {"B": np.array([0.1, 0.4])}
    model = Model(effects=(RIVALS["at_once"](), RIVALS["not_in_time"]()))
    found = simulate(p, theta, model)
    assert found[0, 0, 0] - found[0, 0, 1] > 0.1
    same(found, by_numpy(lambda: simulate(p, theta, model)), 1.0)


class Own(StrainStiffening):
    """A user's effect that is derived from one of the catalogue and computes something else."""

    def apply(self, value, own, hold):
        return value * (1.0 - own["c"] * value)


class WithoutFormula(Effect):
    """A user's effect."""

    name, place, scope, amplitudes = "own", "strain", "material", ()

    def apply(self, value, own, hold):
        return 0.9 * value


def test_an_effect_with_a_function_of_its_own_has_lost_its_parent_s_formula():
    theta = {name: np.array([value]) for name, value in PLAIN.items()} | {"strain_stiffening.c": np.array([5.0])}
    p = protocol(ONE_WAY, [TIMES] * 6)
    assert compiled.call(p, theta, Model(effects=(Own(),))) is None
    softer, stiffer = (simulate(p, theta, Model(effects=(e,))) for e in (Own(), StrainStiffening()))
    assert (softer < stiffer).all()


def test_an_effect_may_name_the_formula_of_a_function_that_it_inherits():
    class Named(StrainStiffening):
        name, formula = "named", StrainStiffening.formula

    class Inherited(StrainStiffening):
        name = "inherited"

    assert Named().has_formula and Inherited().has_formula


def test_numpy_computes_what_has_no_formula_and_what_is_complex():
    p = protocol(ONE_WAY, [TIMES] * 6)
    theta = {name: np.array([value]) for name, value in PLAIN.items()}
    assert compiled.call(p, theta, Model(effects=(WithoutFormula(),))) is None
    assert compiled.call(p, theta | {"k1": np.array([900.0 + 1e-30j])}, Model()) is None
    step = simulate(p, theta, Model(), np.full((6, 1), 1e-30j))
    assert np.iscomplexobj(step)


@pytest.mark.parametrize("known", [(), ("k2", "N"), ("U",), ("U", "k2", "N")])
@pytest.mark.parametrize("history", ["saturating", "additive"])
def test_the_coordinates_follow_the_same_creep(history: Any, known: tuple[str, ...]) -> None:
    """A posterior's coordinates from compiled code and from numpy; holds of different lengths, parameters known."""
    first, *rest = experiments()[0].holds
    longer = replace(first, duration_s=2.0 * first.duration_s)
    priors = {name: {"fixed": 0.7} for name in known}
    problem = build([replace(experiments()[0], holds=(longer, *rest), priors=priors)], spec=ModelSpec(history=history))
    theta, coordinates = problem.prior.rvs(50, np.random.default_rng(0)), LogPosterior(problem).coordinates
    z = coordinates.to_sampled(theta)
    np.testing.assert_allclose(z, by_numpy(lambda: coordinates.to_sampled(theta)), rtol=1e-12, atol=1e-12)
    np.testing.assert_allclose(coordinates.to_natural(z), theta, rtol=1e-9)
