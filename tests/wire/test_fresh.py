"""A fresh sample under a constant tension: every figure against formulas written here, and against the bench."""

import numpy as np
import pytest
from scipy.optimize import brentq

from tests.effects.test_catalogue import HenckyStrain, strong
from tests.wire.protocols import PLAIN, columns, protocol
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.effects.rivals import AtOnce, Logarithmic, NotInTime, PowerLaw, TwoModes
from wirebayes.robot.export import files
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.mechanics.wire_doubts import wire_warnings
from wirebayes.robot.motion.creep import HoldCreep, fresh
from wirebayes.wire.effect import Amplitude, Effect, Typical
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import simulate

LONG_S = PowerLaw().long_s
LOAD, REFERENCE, LENGTH_REF = 3.5, 2.0, 1300.0
TYPICAL = Typical(2.5, 90.0)
TIMES = np.array([0.0, 120.0, 3600.0, 86400.0])
k1, B, U, k2, N = (PLAIN[name] for name in ("k1", "B", "U", "k2", "N"))


class Waking(Effect):
    """A user's own clock: the wire creeps slower and slower."""

    name, place, scope = "waking", "clock", "material"
    amplitudes = (Amplitude("p", "-", 0.0, None),)
    sentence = "The clock of the creep slows down."

    def apply(self, value, own, hold):
        return value ** (1.0 - own["p"])


class Shrinking(Effect):
    """A user's own zero-tension length: a new wire shrinks by itself."""

    name, place, scope = "shrinking", "zero_length", "material"
    amplitudes = (Amplitude("w", "mm", 0.0, None),)
    sentence = "The wire shrinks by itself once it hangs."

    def apply(self, value, own, hold):
        return value - own["w"] * -np.expm1(-(hold.start_s + hold.time_s) / 500.0)


def rival(kind, **amplitudes):
    return (kind(),), {f"{kind.name}.{name}": value for name, value in amplitudes.items()}


def eq5(t, amount=B * LOAD**U, rate=k2, power=N):
    return amount * (1.0 - np.exp(-rate * t**power))


long, ratio = (1000.0 / LENGTH_REF) ** 0.5, LOAD / REFERENCE
# Effects that change the creep of a fresh sample; all others leave eq (5) as it is.
CREEP = {
    "creep_threshold": lambda t: eq5(t, B * (LOAD - 1.0) ** U),
    "tension_dependent_rate": lambda t: eq5(t, rate=k2 * ratio**0.8),
    "second_relaxation": lambda t: eq5(t) + 0.05 * LOAD * (1.0 - np.exp(-t / 40.0)),
    "steady_creep": lambda t: eq5(t) + 5e-4 * LOAD * t,
    "steady_creep@carried": lambda t: eq5(t) + 5e-4 * LOAD * t,
    "length_dependence@B": lambda t: eq5(t, B * long * LOAD**U),
    # creep at 2.5 N and after 90 s is that of the length that the parameters are of
    "length_dependence@U": lambda t: eq5(t, B * 2.5**U * (LOAD / 2.5) ** (U * long)),
    "length_dependence@N": lambda t: eq5(t, rate=k2 * 90.0 ** (N - N * long), power=N * long),
    "logarithmic": lambda t: B * LOAD**U * np.log1p(t / 7.0) / np.log1p(LONG_S / 7.0),
    "power_law": lambda t: B * LOAD**U * (t / LONG_S) ** 0.3,
    "two_modes": lambda t: B * LOAD**U * (0.7 * (1 - np.exp(-k2 * t)) + 0.3 * (1 - np.exp(-k2 * t / 12.0))),
    "not_in_time": lambda t: 0.0 * t,
    "waking": lambda t: eq5(t**0.6),
    "shrinking": lambda t: eq5(t) - 0.2 * (1.0 - np.exp(-t / 500.0)),
}
ENDLESS = {"steady_creep", "steady_creep@carried", "logarithmic", "power_law"}


def at_once(s):
    """The elastic part e of a strain with s = e + B (k1 e)^U / L0."""
    return brentq(lambda e: e + B * (k1 * e) ** U / 1000.0 - s, 0.0, s, xtol=1e-18, rtol=1e-15) if s > 0 else s


# Effects that bend the strain, of a wire of a stretched length where that matters.
STRAIN = {
    "strain_stiffening": lambda s: s * (1 + 30 * s),
    "toe@strain": lambda s: s - 0.0015 * (1 - np.exp(-s / 0.0015)),
    "power_strain": lambda s: REFERENCE / k1 * (s * k1 / REFERENCE) ** 1.4,
    "hencky": np.log1p,
    "at_once": at_once,
}


def toe(s, stretched, law):
    """1.5 mm straighten first; the strain of eq (1) is of the zero-tension length, that of eq (3) of the stretched."""
    zero = stretched / (1.0 + s) if law == "hooke" else stretched * (1.0 - s)
    pulls = stretched - zero - 1.5 * (1 - np.exp(-(stretched - zero) / 1.5))
    return pulls / (zero if law == "hooke" else stretched)


def _catalogue():
    path = [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 5.0]
    bench = protocol(path, [[0.0, 60.0]] * 7, warming=np.array([[0.0, 1.0]] * 7))
    longer = protocol([1.0, 2.0], [[0.0, 60.0]] * 2, length=1700.0)
    for kind in CATALOGUE.values():
        found = kind.variants([bench]) or kind.variants([bench, longer])
        assert found, kind.name
        for effect in found:
            yield effect.key, (effect,), strong(effect.key)


CASES = {key: (effects, amplitudes) for key, effects, amplitudes in _catalogue()} | {
    "plain": ((), {}),
    "logarithmic": rival(Logarithmic, t0=7.0),
    "power_law": rival(PowerLaw, n=0.3),
    "two_modes": rival(TwoModes, slow_share=0.3, slower=12.0),
    "at_once": rival(AtOnce),
    "not_in_time": rival(NotInTime),
    "waking": rival(Waking, p=0.4),
    "shrinking": rival(Shrinking, w=0.2),
    "hencky": rival(HenckyStrain, on=1.0),
}


def sample(key, law="hooke", history="saturating", length=1000.0):
    effects, amplitudes = CASES[key]
    model = Model(law, history, effects, REFERENCE, LENGTH_REF, TYPICAL)
    return FreshSample(columns(**PLAIN, **amplitudes), model, length)


def formula(key):
    return CREEP.get(key, eq5)


def strain_at(key, tension, law, stretched):
    """Strain, by the law's own formula, at which the wire of a stretched length pulls with a tension."""
    curve = (lambda s: toe(s, stretched, law)) if key == "toe" else STRAIN.get(key, lambda s: s)
    return brentq(lambda s: k1 * curve(s) - tension, 0.0, 0.5, xtol=1e-17, rtol=1e-15)


@pytest.mark.parametrize("history", ["saturating", "additive"])
@pytest.mark.parametrize("law", ["hooke", "modified"])
@pytest.mark.parametrize("key", CASES)
def test_creep_at_a_constant_tension_is_the_formula_of_each_effect(key, law, history):
    found = sample(key, law, history).creep_mm(LOAD, TIMES)[:, 0]
    assert found == pytest.approx(formula(key)(TIMES), rel=1e-12, abs=1e-12)
    if key in CREEP and key != "length_dependence@N":
        assert np.abs(found - eq5(TIMES)).max() > 1e-2  # and that is not nothing


@pytest.mark.parametrize("key", CASES)
def test_final_creep_and_the_time_to_half_of_it(key):
    wire, course = sample(key), formula(key)
    final, half = wire.final_creep_mm(LOAD)[0], wire.median_creep_time_s(LOAD)[0]
    if key in ENDLESS:
        assert final == np.inf and np.isnan(half)
        return
    assert final == pytest.approx(course(1e12), rel=1e-12, abs=1e-15)
    if key == "not_in_time":
        assert np.isnan(half)
        return
    expected = brentq(lambda x: course(np.exp(x)) - 0.5 * final, -20.0, 20.0, xtol=1e-14)
    assert half == pytest.approx(np.exp(expected), rel=1e-10)


OF_THE_WIRE = {key for key, (effects, _) in CASES.items() if all(e.scope == "material" for e in effects)}


@pytest.mark.parametrize("law", ["hooke", "modified"])
@pytest.mark.parametrize("key", CASES)
def test_a_bench_that_begins_at_the_tension_shows_the_same_creep_and_stiffness(key, law):
    """The bench's creep is driven by a hold's first tension: what its readings say of the zero-tension length."""
    wire = sample(key, law)
    amplitudes, model = wire.theta, wire.model
    if key not in OF_THE_WIRE:  # what the bench adds is not in the figures
        model = Model(law, "saturating", (), REFERENCE, LENGTH_REF)
    times = TIMES[:3] if key.startswith("steady") else TIMES  # a day of that flow leaves nothing taut
    held = protocol([0.0], [times / (20.0 if key.startswith("steady") else 1.0)])
    stiffness = k1 * long if key == "length_dependence@k1" else k1

    def readings(preload, setting=None):
        return simulate(held, amplitudes | columns(preload=preload), model, setting)[0, :, 0]

    preload = brentq(lambda d: readings(d)[0] - LOAD, 0.0, 60.0, xtol=1e-13, rtol=1e-15)
    measured = readings(preload)
    assert measured.min() > 0
    stretched = 1000.0 + preload
    strains = np.array([strain_at(key, reading * k1 / stiffness, law, stretched) for reading in measured])
    zero = stretched / (1.0 + strains) if law == "hooke" else stretched * (1.0 - strains)
    crept = wire.creep_mm(LOAD, held.time_s[0])[:, 0]
    assert zero - 1000.0 == pytest.approx(crept, rel=1e-9, abs=1e-9)
    step = 1e-3
    up, down = (readings(preload, np.full((1, 1), move))[0] for move in (step, -step))
    assert wire.stiffness_N(LOAD)[0] == pytest.approx(1000.0 * (up - down) / (2 * step), rel=1e-6)


@pytest.mark.parametrize("key", sorted(set(CASES) - OF_THE_WIRE))
def test_what_belongs_to_the_bench_never_enters(key):
    wire, plain = sample(key), sample("plain")
    assert wire.creep_mm(LOAD, TIMES).tobytes() == plain.creep_mm(LOAD, TIMES).tobytes()
    assert wire.stiffness_N(LOAD) == plain.stiffness_N(LOAD) == k1


def test_a_tension_that_the_wire_cannot_carry_has_no_stiffness():
    softening = FreshSample(
        columns(**PLAIN, **{"strain_stiffening.c": -80.0}), Model(effects=(effect_named("strain_stiffening"),)), 1000.0
    )
    assert np.isnan(softening.stiffness_N(5.0)[0])  # at most k1 / (4 * 80) = 2.8 N
    assert softening.stiffness_N(2.0)[0] == pytest.approx(k1 * np.sqrt(1 - 4 * 80 * 2.0 / k1), rel=1e-12)


LINEAR = schema.read_robot_file("linear-6")
ROBOT = {key for key in OF_THE_WIRE if not key.startswith("length_dependence")}


def line(key, law="hooke", draws=3):
    effects, amplitudes = CASES[key]
    values = {name: value * np.linspace(0.9, 1.1, draws) for name, value in (PLAIN | amplitudes).items()}
    return WireDraws(values, 1000.0, law, "saturating", effects, tension_ref_N=REFERENCE)


def alone(given):
    """The fresh sample of a line, away from any robot."""
    return FreshSample(given.parameters, Model(given.law, given.history, given.effects, REFERENCE), given.length_mm)


@pytest.mark.parametrize("follow", ["current", "start"])
@pytest.mark.parametrize("key", sorted(ROBOT))
def test_a_robots_wire_under_a_constant_tension_is_a_fresh_sample(key, follow):
    given = line(key)
    wires = for_robot(schema.read_robot_file("linear-6"), given)
    load = np.full((6, 3), LOAD)
    creep = HoldCreep(wires, fresh(6, 3), load, follow)
    expected = alone(given).creep_mm(LOAD, TIMES[1:])
    for time, values in zip(TIMES[1:], expected, strict=True):
        strain = np.broadcast_to(creep.advance(time, load).strain(wires), (6, 3))
        np.testing.assert_allclose(strain, np.tile(values / 1000.0, (6, 1)), rtol=1e-12, atol=1e-15)
    found = wire_warnings(LINEAR, given, load, 60.0, np.ones((3, 6)))
    assert not [notice for notice in found if "left out" in notice.text]


@pytest.mark.parametrize("key", sorted(ROBOT))
def test_the_exported_creep_table_is_the_fresh_sample(key):
    given = line(key)
    rows = files.creep_table(schema.read_robot_file("hangprinter-4"), given, [2.0, LOAD], TIMES[1:])
    expected = np.concatenate([alone(given).creep_mm(load, TIMES[1:]) for load in (2.0, LOAD)])
    assert [row[2] for row in rows] == pytest.approx(expected.mean(1), rel=1e-12, abs=1e-15)


def test_a_parameter_that_depends_on_the_length_is_that_of_the_robots_wires():
    robot = schema.read_robot_file("linear-6")
    for which in ("k1", "B"):
        given = line(f"length_dependence@{which}")
        wires, plain = for_robot(robot, given), for_robot(robot, line("plain"))
        longer = robot.wire_m[:, None] ** given.parameters["length_dependence.p"]  # tested at 1 m
        np.testing.assert_allclose(wires.theta[which], plain.theta[which] * longer, rtol=1e-12)
        assert not wire_warnings(LINEAR, given, np.ones((1, 6)), 60.0, np.ones((3, 6)))


def test_a_material_effect_of_the_bench_alone_is_said_to_be_left_out():
    class Settling(Effect):
        name, place, scope = "settling", "reading", "material"
        amplitudes = ()
        sentence = "An effect that only a bench could show."

    given = WireDraws(
        {name: np.array([PLAIN[name]]) for name in ("k1", "B", "U", "k2", "N")},
        1000.0,
        effects=(Settling(), effect_named("thermal_expansion")),
    )
    found = wire_warnings(LINEAR, given, np.ones((1, 6)), 60.0, np.ones((1, 6)))
    lines = [notice.text for notice in found if notice.kind == "left-out"]
    assert any("settling has no place in the robot" in text for text in lines)
    assert any("knows no temperature: the effect thermal_expansion" in text for text in lines)
