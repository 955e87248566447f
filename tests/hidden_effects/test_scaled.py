"""Hidden effects at any scale: the independent law against the package's, sizes as asked for, names that look alike."""

from dataclasses import replace

import numpy as np
import pytest

from analyses.hidden_effects.scaled_cases import KINDS, group
from analyses.hidden_effects.scaled_draws import DELTAS, draw_case, draw_hidden
from analyses.hidden_effects.scaled_law import Hidden, ScaledTest, readings
from wirebayes.effects import effect_named
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


def both_programs(weights: bool, key: str, own: dict[str, float], shapes: dict[str, float]) -> tuple[np.ndarray, ...]:
    """Readings with the effect by both, and without it."""
    settings = 0.5 * PATH if weights else PATH
    warming = np.array([np.linspace(0.0, 1.0, len(TIMES)) + 0.5 * j for j in range(HOLDS)])
    lasting = np.full(HOLDS, 130.0)
    test = ScaledTest(weights, 1000.0, settings, (TIMES,) * HOLDS, lasting, tuple(warming), 1.0)
    none = np.zeros(HOLDS)
    hidden = Hidden(key.split("@")[0], next(iter(own.values())), shapes)
    here, plain = (readings(test, TRUTH, effect, none) for effect in (hidden, Hidden()))
    effect = effect_named(key)
    columns = {name: np.array([value]) for name, value in TRUTH.items()}
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


def test_all_effects_are_compared():
    assert {key.split("@")[0] for key, _, _ in CASES + OF_STEPS} == set(KINDS)


@pytest.mark.parametrize("seed", range(6))
def test_an_effect_has_the_size_that_was_asked_for(seed):
    rng = np.random.default_rng(seed)
    case = draw_case(rng, weights=seed % 2 == 0)
    hidden, delta = draw_hidden(case, rng)
    assert delta in DELTAS and hidden.name in case.shown()
    assert case.delta(hidden) == pytest.approx(delta, rel=0.03)
    assert abs(hidden.amplitude) <= case.largest(hidden.name)
    # what the parameters can absorb is not counted
    moved = replace(case, truth=case.truth | {"k1": 1.001 * case.truth["k1"]}).plain - case.plain
    whole, left = np.linalg.norm(case.whitened(moved)), np.linalg.norm(case.projected(moved))
    assert left < 0.02 * whole


def test_what_looks_alike_is_of_the_group():
    rng = np.random.default_rng(19)
    case = draw_case(rng, weights=False)
    alike = group(case, Hidden("strain_stiffening", 0.24 * case.largest("strain_stiffening"), {}), 8.0)
    assert {"strain_stiffening", "power_strain"} <= set(alike) and "grip_slip" not in alike
