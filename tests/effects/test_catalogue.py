"""Every effect: neutral to the last bit, its formula re-derived in a few lines, differentiable; and a user's own."""

import re
from dataclasses import replace

import numpy as np
import pytest

from tests.wire.protocols import PLAIN, columns, protocol
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.effects.rivals import RIVALS
from wirebayes.errors import InputError
from wirebayes.wire.effect import Amplitude, Effect
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import linearise, simulate

TIMES = np.array([0.0, 30.0, 60.0, 120.0])
PATH = [1.0, 3.0, 5.0, 2.0, 4.0]
WARMING = np.linspace(0.0, 5.0, 20).reshape(5, 4)
KEYS = [f"{name}@3" if name in ("grip_slip", "unrecorded_hold") else name for name in CATALOGUE]
KEYS = [f"{name}@k1" if name == "length_dependence" else name for name in KEYS]
REFERENCE, LENGTH_REF = 2.0, 1300.0


def bench(unrecorded=()):
    return protocol(PATH, [TIMES] * 5, unrecorded=unrecorded, warming=WARMING)


def model_of(*keys, history="saturating"):
    effects = tuple(effect_named(key) if isinstance(key, str) else key for key in keys)
    return Model("hooke", history, effects, REFERENCE, LENGTH_REF)


def readings(amplitudes, *keys, p=None, setting=None, history="saturating", **changed):
    theta = columns(**(PLAIN | changed | amplitudes))
    return simulate(p or bench(), theta, model_of(*keys, history=history), setting)[..., 0]


def plain(**changed):
    return readings({}, **changed)


@pytest.mark.parametrize("key", KEYS)
@pytest.mark.parametrize("unrecorded", [(), (1,)])
def test_the_neutral_value_is_the_plain_model_to_the_last_bit(key, unrecorded):
    effect = effect_named(key)
    neutral = {c: a.neutral for c, a in zip(effect.columns(), effect.amplitudes, strict=True)}
    p = bench(unrecorded)
    assert readings(neutral, key, p=p).tobytes() == readings({}, p=p).tobytes()


def test_all_effects_together_at_their_neutral_values_are_the_plain_model_to_the_last_bit():
    effects = [effect_named(key) for key in KEYS]
    neutral = {c: a.neutral for e in effects for c, a in zip(e.columns(), e.amplitudes, strict=True)}
    assert readings(neutral, *KEYS).tobytes() == plain().tobytes()


STRENGTH = {
    "strain_stiffening": {"c": 30.0}, "toe": {"w": 1.5}, "power_strain": {"p": 0.4}, "fixture_compliance": {"c": 0.1},
    "thermal_expansion": {"alpha": 1e-4}, "length_dependence": {"p": 0.5}, "permanent_creep": {"psi": 0.6},
    "superposition": {"omega": 0.7}, "prior_creep": {"T_0": 500.0}, "late_clock": {"t_d": 8.0},
    "screw_error": {"a": 0.1, "P": 2.5, "phi": 0.4}, "second_relaxation": {"A": 0.05, "T2": 40.0},
    "steady_creep": {"a": 5e-4},
    "tension_dependent_rate": {"m": 0.8}, "ageing": {"a": 0.5}, "creep_threshold": {"tau_c": 1.0},
    "grip_slip": {"w": 0.4}, "unrecorded_hold": {"T": 200.0}, "reading_delay": {"t_d": 8.0},
    "sensor_drift": {"a": 1e-3},
    "sensor_nonlinearity": {"a": 0.02}, "clamp_transient": {"a": 0.05, "T": 20.0}, "lost_motion": {"w": 0.2},
    "guide_friction": {"mu": 0.05},
}  # fmt: skip


def strong(key):
    name = key.partition("@")[0]
    assert name in STRENGTH, f"{name} needs amplitudes in STRENGTH"
    return {f"{name}.{k}": v for k, v in STRENGTH[name].items()}


def chain(goal=None, share=None, strain=None, zero=None, drive=None, offset=None, extra=None, read=None):
    """The saturating chain with each of its formulas open to change; (5, 4) tensions."""
    t, carried, out = PLAIN, 0.0, []
    for j, x in enumerate(PATH):
        s0 = 1000.0 + t["preload"] + x + (offset(j) if offset else 0.0)

        def tension(e, i, j=j, s0=s0):
            ell = (1000.0 + e) if zero is None else zero(1000.0 + e, j, i)
            s = s0 / ell - 1.0
            return t["k1"] * max(s if strain is None else strain(s, ell), 0.0)

        first = tension(carried, 0)
        driving = first if drive is None else drive(first)
        amount = t["B"] * max(driving, 0.0) ** t["U"] - carried
        if goal is not None:
            amount = goal(amount, carried, j)
        fraction = (lambda time, j, first: 1 - np.exp(-t["k2"] * time ** t["N"])) if share is None else share
        row = []
        for i, time in enumerate(TIMES):
            e = carried + amount * fraction(time, j, first)
            y = tension(e + (extra(first, time) if extra else 0.0), i)
            row.append(y if read is None else read(y, j, time))
        carried = carried + amount * fraction(TIMES[-1], j, first)
        out.append(row)
    return np.array(out)


k2, N = PLAIN["k2"], PLAIN["N"]
DIRECTION = [1, 1, 1, -1, 1]
FORMULAS = {
    "strain_stiffening": lambda: chain(strain=lambda s, ell: s * (1 + 30 * s)),
    "toe": lambda: chain(strain=lambda s, ell: (s * ell - 1.5 * (1 - np.exp(-max(s, 0) * ell / 1.5))) / ell),
    # k1 is the stiffness at the reference tension
    "power_strain": lambda: chain(
        strain=lambda s, ell: REFERENCE / PLAIN["k1"] * (max(s, 0) * PLAIN["k1"] / REFERENCE) ** 1.4
    ),
    # a spring of 0.1 mm/N in series: τ = k1 (S - 0.1 τ - ℓ) / L0, solved for τ
    "fixture_compliance": lambda: chain(strain=lambda s, ell: s / (1 + 0.1 * PLAIN["k1"] / 1000.0)),
    "thermal_expansion": lambda: chain(zero=lambda ell, j, i: ell * (1 + 1e-4 * WARMING[j, i])),
    "length_dependence": lambda: plain(k1=PLAIN["k1"] * (1000.0 / LENGTH_REF) ** 0.5),
    "permanent_creep": lambda: chain(goal=lambda a, e, j: a + 0.6 * e),
    "ageing": lambda: chain(goal=lambda a, e, j: a * (1 + j) ** -0.5),
    "tension_dependent_rate": lambda: chain(
        share=lambda t, j, first: 1 - np.exp(-k2 * (first / REFERENCE) ** 0.8 * t**N)
    ),
    "creep_threshold": lambda: chain(drive=lambda tau: tau - 1.0),
    "grip_slip": lambda: chain(zero=lambda ell, j, i: ell + (0.4 if j + 1 >= 3 else 0.0)),
    "reading_delay": lambda: chain(share=lambda t, j, first: 1 - np.exp(-k2 * (t + 8.0 * (t == 0)) ** N)),
    "sensor_drift": lambda: chain(read=lambda y, j, t: y + 1e-3 * (120.0 * j + t)),
    "sensor_nonlinearity": lambda: chain(read=lambda y, j, t: y + 0.02 * y * y),
    "clamp_transient": lambda: chain(read=lambda y, j, t: y * (1 + 0.05 * np.exp(-t / 20.0))),
    "late_clock": lambda: readings({}, p=protocol(PATH, [[0.0, *(TIMES + 8.0)]] * 5))[:, 1:],
    "prior_creep": lambda: superposing(0.0, before_s=500.0),
    "screw_error": lambda: chain(offset=lambda j: 0.1 * np.cos(2 * np.pi * PATH[j] / 2.5 + 0.4)),
    "lost_motion": lambda: chain(offset=lambda j: 0.2 if DIRECTION[j] < 0 else 0.0),
    "guide_friction": lambda: chain(read=lambda y, j, t: y * (1 + 0.05 * DIRECTION[j])),
}


BY_A_TEST_OF_THEIR_OWN = {"superposition", "second_relaxation", "steady_creep", "unrecorded_hold"}


def test_every_effect_is_compared_with_a_formula_of_its_own():
    known = set(FORMULAS) | BY_A_TEST_OF_THEIR_OWN
    assert set(CATALOGUE) == known, "an effect needs a row in FORMULAS, or a test of its own"
    assert set(CATALOGUE) == set(STRENGTH), "an effect needs amplitudes in STRENGTH"


@pytest.mark.parametrize("key", [k for k in KEYS if k.partition("@")[0] in FORMULAS])
def test_an_effect_does_what_its_formula_says(key):
    expected = FORMULAS[key.partition("@")[0]]()
    found = readings(strong(key), key)
    assert found == pytest.approx(expected, rel=1e-12, abs=1e-12)
    assert np.abs(found - plain()).max() > 1e-3  # and that is not nothing


def superposing(omega, before_s=0.0, late_s=0.0, path=PATH, times=TIMES):
    """Creep by the explicit sum over all changes of its goal, mixed with the chain; (H, R) tensions."""
    t = PLAIN

    def tension(x, creep):
        return max(t["k1"] * ((1000.0 + t["preload"] + x) / (1000.0 + creep) - 1.0), 0.0)

    def share(seconds):
        return 1.0 - np.exp(-t["k2"] * seconds ** t["N"])

    changes, now, chained, out = [], -before_s, 0.0, []  # (when, by how much) the goal changed

    def summed(when):
        return sum(by * share(when - start) for start, by in changes)

    for x, lasts, read in [(0.0, before_s, []), *((x, times[-1] + late_s, times + late_s) for x in path)]:
        mixed = (1.0 - omega) * chained + omega * summed(now)
        goal = t["B"] * tension(x, mixed) ** t["U"] if lasts else 0.0
        changes.append((now, goal - sum(by for _, by in changes)))
        if len(read):
            course = [(1 - omega) * (chained + (goal - chained) * share(s)) + omega * summed(now + s) for s in read]
            out.append([tension(x, creep) for creep in course])
        chained, now = chained + (goal - chained) * share(lasts), now + lasts
    return np.array(out)


def test_superposition_is_the_sum_over_all_changes_of_the_load():
    for omega in (0.0, 0.3, 1.0):
        found = readings({"superposition.omega": omega}, "superposition")
        assert found == pytest.approx(superposing(omega), rel=1e-12)
    assert np.abs(superposing(1.0) - plain()).max() > 1e-2
    # B τ^U of the largest tension is never passed
    whole = PLAIN["B"] * found.max() ** PLAIN["U"]
    up = readings({"superposition.omega": 1.0}, "superposition", p=protocol([5.0] * 9, [TIMES] * 9))
    creep = 1005.4 / (up / PLAIN["k1"] + 1.0) - 1000.0
    assert creep.max() < whole


def test_effects_of_time_go_with_superposition():
    """The clocks of all changes, of the time before the first hold and of a late start, are those of one time."""
    amplitudes = {"superposition.omega": 0.6, "prior_creep.T_0": 500.0, "late_clock.t_d": 8.0}
    keys = ("superposition", "prior_creep", "late_clock")
    expected = superposing(0.6, 500.0, 8.0)
    assert readings(amplitudes, *keys) == pytest.approx(expected, rel=1e-12)
    for left_out, value in (("prior_creep", superposing(0.6, 0.0, 8.0)), ("late_clock", superposing(0.6, 500.0))):
        own = {name: v for name, v in amplitudes.items() if not name.startswith(left_out)}
        assert readings(own, *(k for k in keys if k != left_out)) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("key", ["superposition", "second_relaxation", "steady_creep"])
def test_time_before_the_first_hold_is_an_entry_in_the_protocol(key):
    stated = protocol([0.0, *PATH], [[0.0, 500.0], *[TIMES] * 5], unrecorded={0})
    expected = readings(strong(key), key, p=stated)[1:]
    found = readings(strong(key) | strong("prior_creep"), key, "prior_creep")
    assert found == pytest.approx(expected, rel=1e-12)
    assert np.abs(found[0] - readings(strong(key), key)[0]).max() > 1e-3


def test_a_late_clock_is_a_later_reading():
    late = protocol(PATH, [[0.0, *(TIMES + 8.0)]] * 5)
    for key in ("second_relaxation", "steady_creep", "superposition", "clamp_transient"):
        expected = readings(strong(key), key, p=late)[:, 1:]
        assert readings(strong(key) | strong("late_clock"), key, "late_clock") == pytest.approx(expected, rel=1e-12)


def test_second_relaxation_and_steady_creep_run_beside_the_creep():
    for key, course in (
        ("second_relaxation", lambda first, t: 0.05 * first * (1 - np.exp(-t / 40.0))),
        ("steady_creep", lambda first, t: 5e-4 * first * t),
    ):
        found = readings(strong(key), key)
        expected = chain(extra=course)
        assert found[0] == pytest.approx(expected[0], rel=1e-12)
        # what the first hold left of both is there when the second begins
        first = expected[0, 0]
        left = PLAIN["B"] * first ** PLAIN["U"] * (1 - np.exp(-k2 * 120.0**N)) + course(first, 120.0)
        assert found[1, 0] == pytest.approx(PLAIN["k1"] * (1003.4 / (1000.0 + left) - 1.0), rel=1e-12)


BESIDE_A_WAIT = {
    "": {}, **{key: strong(key) for key in ("superposition", "second_relaxation", "steady_creep")},
    "steady_creep@carried": strong("steady_creep"), "tension_dependent_rate": strong("tension_dependent_rate"),
    "logarithmic": {"logarithmic.t0": 5.0},
}  # fmt: skip


@pytest.mark.parametrize("beside", BESIDE_A_WAIT)
def test_an_unrecorded_hold_is_the_same_as_an_entry_in_the_protocol(beside):
    """T seconds before hold 3 at its displacement, its own clock running."""
    stated = protocol([1.0, 3.0, 5.0, 5.0, 2.0, 4.0], [TIMES, TIMES, [0.0, 200.0], TIMES, TIMES, TIMES], unrecorded={2})
    effects, own = [RIVALS[beside]() if beside in RIVALS else beside] if beside else [], BESIDE_A_WAIT[beside]
    expected = readings(own, *effects, p=stated)[[0, 1, 3, 4, 5]]
    found = readings(own | strong("unrecorded_hold@3"), *effects, "unrecorded_hold@3")
    assert found == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("beside", BESIDE_A_WAIT)
def test_creep_before_a_test_is_the_same_as_a_hold_at_displacement_zero(beside):
    stated = protocol([0.0, *PATH], [[0.0, 500.0], *([TIMES] * 5)], unrecorded={0})
    effects, own = [RIVALS[beside]() if beside in RIVALS else beside] if beside else [], BESIDE_A_WAIT[beside]
    expected = readings(own, *effects, p=stated)[1:]
    found = readings(own | strong("prior_creep"), *effects, "prior_creep")
    assert found == pytest.approx(expected, rel=1e-12)


def test_permanent_creep_at_one_is_the_additive_chain():
    assert readings({"permanent_creep.psi": 1.0}, "permanent_creep") == pytest.approx(
        plain(history="additive"), rel=1e-12
    )


def test_a_standard_linear_solid_held_at_displacements_looks_as_if_what_it_relaxes_were_permanent():
    """A spring of K in series with a spring beside a dashpot, which relaxes a share of K x and gives all of it back."""
    K, share, rate = 2.0, 0.3, 0.02
    p = replace(bench(), length_mm=1e7)
    expected, crept = [], 0.0
    for x in PATH:
        end = share * x
        course = end + (crept - end) * np.exp(-rate * TIMES)
        expected.append(K * (x - course))
        crept = course[-1]
    own = {"k1": K * p.length_mm, "B": share / K, "U": 1.0, "k2": rate, "N": 1.0, "preload": 0.0}
    found = readings(own | {"permanent_creep.psi": share}, "permanent_creep", p=p)
    assert found == pytest.approx(np.array(expected), rel=1e-6)
    assert np.abs(readings(own, p=p) - expected).max() > 0.3


@pytest.mark.parametrize("key", KEYS)
def test_derivatives_with_an_effect_are_those_of_finite_differences(key):
    p, amplitudes = bench(), strong(key)
    line = linearise(p, columns(**(PLAIN | amplitudes)), model_of(key))
    step = 1e-4
    for j in range(5):
        setting = np.zeros((5, 1))
        setting[j] = step
        up, down = (readings(amplitudes, key, setting=sign * setting)[j] for sign in (1, -1))
        assert line.by_setting[j, :, 0] == pytest.approx((up - down) / (2 * step), rel=1e-6, abs=1e-7)


def test_every_effect_says_what_it_is():
    for name, kind in CATALOGUE.items():
        assert kind.name == name
        assert kind.sentence.endswith(".")
        assert kind.amplitudes
        for amplitude in kind.amplitudes:
            assert np.isfinite(amplitude.prior.logpdf(amplitude.prior.median()))


def test_under_weights_no_effect_speaks_of_the_instruments_of_a_test_by_steps():
    hung = replace(bench(), control="force")
    shown = [kind for kind in CATALOGUE.values() if kind.variants([hung])]
    assert {"sensor_drift", "lost_motion"} <= {kind.name for kind in shown}
    for kind in shown:
        said = kind.sentence_under("force")
        assert said.endswith(".")
        assert not re.search("force sensor|screw|relaxes|at a displacement|each move|the move", said), kind.name
        assert kind.sentence_under("displacement") == kind.sentence


def test_unknown_names_are_refused_with_what_there_is():
    for key, message in (("slip", "no such effect"), ("grip_slip", "grip_slip@7"), ("toe@3", "takes no '@'")):
        with pytest.raises(InputError, match=message):
            effect_named(key)


class Softening(Effect):
    """A user's own effect: stiffness falls with every hold."""

    name = "softening"
    place = "strain"
    scope = "material"
    amplitudes = (Amplitude("d", "-", 0.0, None),)
    sentence = "The wire softens with every hold."

    def apply(self, value, own, hold):
        return value * (1.0 - own["d"] * hold.index)


class LogarithmicTime(Effect):
    """A user's own time law: ln(1 + k2 t) in place of eq (5)."""

    name = "logarithmic_time"
    place = "fraction"
    scope = "material"
    amplitudes = (Amplitude("on", "-", 0.0, None),)
    sentence = "The creep goes with the logarithm of time."

    def apply(self, value, own, hold):
        return (1.0 - own["on"]) * value + own["on"] * np.log1p(hold.theta["k2"] * hold.time_s)


class HenckyStrain(Effect):
    """A user's own elastic law: logarithmic strain ln(L / ℓ) in place of L / ℓ - 1."""

    name = "hencky"
    place = "strain"
    scope = "material"
    amplitudes = (Amplitude("on", "-", 0.0, None),)
    sentence = "The tension follows the logarithmic strain."

    def apply(self, value, own, hold):
        return np.where(own["on"] > 0, np.log1p(value), value)


def test_a_user_s_own_effect_elastic_law_and_time_law_need_no_change_here():
    assert readings({"softening.d": 0.1}, Softening())[0] == pytest.approx(plain()[0], rel=1e-14)
    assert readings({"softening.d": 0.1}, Softening())[2, 0] < 0.81 * plain()[2, 0]
    expected = chain(strain=lambda s, ell: np.log1p(s))
    assert readings({"hencky.on": 1.0}, HenckyStrain()) == pytest.approx(expected, rel=1e-12)
    expected = chain(share=lambda t, j, first: np.log1p(k2 * t))
    assert readings({"logarithmic_time.on": 1.0}, LogarithmicTime()) == pytest.approx(expected, rel=1e-12)
