"""The judge's generator against closed forms, neutral values and physical meaning."""

import dataclasses

import numpy as np
import pytest

from analyses.hidden_effects.catalogue import EFFECTS, FOREIGN, draw, effect, fits, largest, members
from analyses.hidden_effects.generator import simulate
from analyses.hidden_effects.rig import Bench, Hold, Rig, Wire
from analyses.hidden_effects.truth import PROTOCOLS, draw_rig

ROC = Wire(699.0, 0.2, 0.4, 0.0214, 0.8)


def one_wire(path=(1, 2, 3, 4, 3, 2), times=(0.0, 30.0, 60.0, 90.0, 120.0), wire=ROC, preload=0.3, length=1000.0):
    holds = tuple(Hold(i + 1, float(x), tuple(times), times[-1]) for i, x in enumerate(path))
    bench = Bench("a", "m", length, holds, preload, 0.005, 0.01, 0.01)
    return Rig("test", (bench,), {"m": wire}, {"m": 1.0})


def closed_form(rig, b=0, permanent=0.0):
    """Eqs (5) and (6) with the amount B tau^U - (1 - permanent) e of the chain."""
    bench = rig.benches[b]
    w, scale = rig.wires[bench.material], bench.length_mm / rig.reference_length(bench.material)
    carried, out = 0.0, []
    for hold in bench.holds:
        stretched = bench.length_mm + bench.preload_mm + hold.displacement_mm
        tau0 = max(w.k1 * (stretched / (bench.length_mm + carried) - 1), 0.0)
        amount = w.B * scale * tau0**w.U - (1 - permanent) * carried
        t = np.array([*hold.times_s, hold.duration_s])
        e = carried + amount * (1 - np.exp(-w.k2 * t**w.N))
        out.append(np.maximum(w.k1 * (stretched / (bench.length_mm + e[:-1]) - 1), 0.0))
        carried = e[-1]
    return np.concatenate(out)


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_plain_model_is_equations_5_and_6(protocol):
    rig = draw_rig(np.random.default_rng(4), protocol)
    expected = np.concatenate([closed_form(rig, b) for b in range(len(rig.benches))])
    assert simulate(rig)[0] == pytest.approx(expected, rel=0, abs=2e-6 * expected.max())


def test_integration_is_a_real_one():
    """Coarser steps must be worse: otherwise the test above compares a formula with itself."""
    from analyses.hidden_effects.creep import remaining

    exact = np.exp(-0.02 * 120.0)
    errors = [
        abs(remaining(np.linspace(0, 120, n + 1), np.array([0.02]), np.array([1.0]))[0, -1] - exact) for n in (1, 2, 4)
    ]
    assert errors[0] > 10 * errors[1] > 100 * errors[2] > 0


def test_full_permanence_is_the_additive_chain():
    rig = one_wire()
    candidate = draw(EFFECTS["permanent_creep"], rig, np.random.default_rng(0))
    y = simulate(rig, members=members(rig, [[(candidate, 1.0)], [(candidate, 0.4)]]))
    assert y[0] == pytest.approx(closed_form(rig, permanent=1.0), abs=1e-5)
    assert y[1] == pytest.approx(closed_form(rig, permanent=0.4), abs=1e-5)


def test_unrecorded_time_is_a_hold_without_readings():
    rig = one_wire(path=(1, 2, 3, 4))
    bench = rig.benches[0]
    hidden = Hold(9, 3.0, (), 77.0)
    longer = dataclasses.replace(bench, holds=(*bench.holds[:2], hidden, *bench.holds[2:]))
    expected = simulate(dataclasses.replace(rig, benches=(longer,)))[0]
    candidate = dataclasses.replace(
        draw(EFFECTS["unrecorded_hold"], rig, np.random.default_rng(0)), shapes=(("hold", 2.0),)
    )
    y = simulate(rig, members=members(rig, [[(candidate, 77.0)]]))[0]
    assert y == pytest.approx(expected, abs=1e-4)
    assert np.abs(y - simulate(rig)[0]).max() > 0.01


def test_late_first_reading_is_the_later_tension():
    late, times = 10.0, (0.0, 30.0, 60.0)
    rig = one_wire(path=(1, 2, 3), times=times)
    with_it = one_wire(path=(1, 2, 3), times=(0.0, late, 30.0, 60.0))
    candidate = draw(EFFECTS["reading_delay"], rig, np.random.default_rng(0))
    y = simulate(rig, members=members(rig, [[(candidate, late)]]))[0].reshape(3, 3)
    expected = simulate(with_it)[0].reshape(3, 4)
    assert y == pytest.approx(expected[:, 1:], abs=1e-5)


def test_superposed_creep_is_the_sum_of_two_clocks():
    """With N = 1: E1 (1 - e^-kt) of the first load and (E2 - E1) (1 - e^-k(t - 100)) of what the second adds."""
    wire = dataclasses.replace(ROC, N=1.0, k2=0.01)
    rig = one_wire(path=(2, 2.5), times=(0.0, 50.0, 100.0), wire=wire)
    candidate = draw(EFFECTS["superposition"], rig, np.random.default_rng(0))
    y = simulate(rig, members=members(rig, [[(candidate, 1.0)]]))[0]
    assert y[:3] == pytest.approx(simulate(rig)[0][:3], abs=1e-9)
    t, first, second = np.array([0.0, 50.0, 100.0]), wire.B * y[0] ** wire.U, wire.B * y[3] ** wire.U
    creep = first * -np.expm1(-0.01 * (t + 100.0)) + (second - first) * -np.expm1(-0.01 * t)
    assert y[3:] == pytest.approx(wire.k1 * (1002.8 / (1000.0 + creep) - 1), abs=1e-6)


def test_creep_before_the_test_is_a_hold_at_zero_and_a_late_clock_a_later_reading():
    rig = one_wire(path=(1, 2, 3))
    bench = rig.benches[0]
    before = dataclasses.replace(bench, holds=(Hold(0, 0.0, (), 400.0), *bench.holds))
    rng = np.random.default_rng(0)
    prior, late = (draw(EFFECTS[name], rig, rng) for name in ("prior_creep", "late_clock"))
    y = simulate(rig, members=members(rig, [[(prior, 400.0)], [(late, 7.0)], []]))
    assert y[0] == pytest.approx(simulate(dataclasses.replace(rig, benches=(before,)))[0], abs=1e-5)
    times = (0.0, 30.0, 60.0, 90.0, 120.0)
    later = one_wire(path=(1, 2, 3), times=(0.0, *(7.0 + t for t in times)))
    assert y[1] == pytest.approx(simulate(later)[0].reshape(3, 6)[:, 1:].ravel(), abs=1e-5)
    assert np.abs(y[:2] - y[2]).max(axis=1).min() > 0.01


def test_a_period_of_two_steps_alternates():
    rig = one_wire(path=(1, 2, 3, 4, 5, 6))
    period = dataclasses.replace(
        draw(EFFECTS["screw_error"], rig, np.random.default_rng(0)), shapes=(("phase", np.pi / 2), ("period", 2.0))
    )
    off = one_wire(path=tuple(x + 0.05 * (-1) ** x for x in (1, 2, 3, 4, 5, 6)))
    y = simulate(rig, members=members(rig, [[(period, 0.05)]]))[0]
    assert y == pytest.approx(simulate(off)[0], abs=1e-12)


def test_a_toe_is_as_long_on_a_long_sample():
    """What pulls of a stretch x is x - w (1 - e^(-x / w)), on 1 m as on 3 m, where nothing creeps."""
    stretch = np.repeat(np.array([1, 2, 3, 4]) + 0.3, 2)
    pulls = stretch - 0.8 * (1 - np.exp(-stretch / 0.8))
    for length in (1000.0, 3000.0):
        rig = one_wire((1, 2, 3, 4), (0.0, 30.0), dataclasses.replace(ROC, B=1e-12), length=length)
        candidate = draw(EFFECTS["toe"], rig, np.random.default_rng(0))
        y = simulate(rig, members=members(rig, [[(candidate, 0.8)]]))[0]
        assert y == pytest.approx(ROC.k1 * pulls / length, rel=1e-9)


def test_a_power_of_the_strain_is_one_beside_the_stiffness():
    rig = one_wire((1, 2, 3, 4), (0.0, 30.0), dataclasses.replace(ROC, B=1e-12))
    candidate = draw(EFFECTS["power_strain"], rig, np.random.default_rng(0))
    y = simulate(rig, members=members(rig, [[(candidate, 0.3)]]))[0]
    power = 1 + candidate.sign * 0.3
    assert y / y[0] == pytest.approx(((np.repeat([1, 2, 3, 4], 2) + 0.3) / 1.3) ** power, rel=1e-9)


def test_instrument_effects_act_on_the_reading():
    rig = one_wire()
    plain = simulate(rig)[0]
    bench = rig.benches[0]
    clock = bench.starts_s[bench.hold_of_reading] + bench.reading_times_s
    down = np.where(bench.hold_of_reading >= 4, -1.0, 1.0)
    expected = {
        "sensor_drift": plain + 1e-4 * clock,
        "sensor_nonlinearity": plain + 1e-4 * plain**2,
        "guide_friction": plain * (1 + 1e-4 * down),
    }
    for name, wanted in expected.items():
        candidate = dataclasses.replace(draw(EFFECTS[name], rig, np.random.default_rng(0)), sign=1)
        assert simulate(rig, members=members(rig, [[(candidate, 1e-4)]]))[0] == pytest.approx(wanted, abs=1e-12)


def test_lost_motion_delays_only_the_way_back():
    rig = one_wire()
    candidate = draw(EFFECTS["lost_motion"], rig, np.random.default_rng(0))
    y = simulate(rig, members=members(rig, [[(candidate, 0.2)]]))[0]
    lagging = one_wire(path=(1, 2, 3, 4, 3.2, 2.2))
    assert y == pytest.approx(simulate(lagging)[0], abs=1e-12)


@pytest.mark.parametrize("name", [*EFFECTS, *FOREIGN])
def test_neutral_is_plain_and_large_is_not(name):
    protocol = {"temperature": "temperature", "lengths": "two_lengths", "steps": "paper"}.get(
        effect(name).needs, "unloading"
    )
    rng = np.random.default_rng(2)
    rig = draw_rig(rng, protocol)
    assert fits(effect(name), rig)
    candidate = draw(effect(name), rig, rng)
    plain = simulate(rig)
    top = largest(rig, candidate, plain[0])
    y = simulate(rig, members=members(rig, [[(candidate, 0.0)], [(candidate, 1e-12 * top)], [(candidate, 0.5 * top)]]))
    assert y[0] == pytest.approx(plain[0], abs=1e-9)
    assert np.abs(y[1] - plain[0]).max() < 1e-4
    assert np.abs(y[2] - plain[0]).max() > 1e-3


def test_rows_of_a_batch_do_not_touch_each_other():
    rng = np.random.default_rng(5)
    rig = draw_rig(rng, "unloading")
    y = simulate(rig)[0]
    rows = [[(c, 0.3 * largest(rig, c, y))] for c in (draw(e, rig, rng) for e in EFFECTS.values() if fits(e, rig))]
    together = simulate(rig, members=members(rig, rows))
    for row, line in zip(rows, together, strict=True):
        assert simulate(rig, members=members(rig, [row]))[0] == pytest.approx(line, rel=1e-6, abs=1e-5)


def test_creep_is_a_strain_shared_by_two_lengths():
    rig = draw_rig(np.random.default_rng(3), "two_lengths")
    short, long = rig.benches
    stretched = dataclasses.replace(
        long,
        preload_mm=short.preload_mm * long.length_mm / short.length_mm,
        holds=tuple(
            dataclasses.replace(h, displacement_mm=h.displacement_mm * long.length_mm / short.length_mm)
            for h in short.holds
        ),
    )
    y = simulate(dataclasses.replace(rig, benches=(short, stretched)))[0]
    half = len(y) // 2
    assert y[:half] == pytest.approx(y[half:], abs=1e-9)


def test_a_wire_goes_slack_in_the_slack_protocol():
    for seed in range(5):
        rig = draw_rig(np.random.default_rng(seed), "slack")
        y = simulate(rig)[0]
        assert y.min() == 0.0 < y.max()


def test_superposition_runs_on_through_an_unrecorded_time():
    """Two effects at once: the waiting at hold 2's position is a hold, and hold 1's clock runs through it."""
    rig = one_wire(path=(1, 2, 3, 4))
    superposed = draw(EFFECTS["superposition"], rig, np.random.default_rng(0))
    wait = dataclasses.replace(draw(EFFECTS["unrecorded_hold"], rig, np.random.default_rng(0)), shapes=(("hold", 1.0),))
    y = simulate(rig, members=members(rig, [[(superposed, 0.7), (wait, 60.0)], [(superposed, 0.7)]]))
    bench = rig.benches[0]
    longer = dataclasses.replace(bench, holds=(bench.holds[0], Hold(9, 2.0, (), 60.0), *bench.holds[1:]))
    as_hold = dataclasses.replace(rig, benches=(longer,))
    assert y[0] == pytest.approx(simulate(as_hold, members=members(as_hold, [[(superposed, 0.7)]]))[0], abs=1e-4)
    assert y[1] == pytest.approx(simulate(rig, members=members(rig, [[(superposed, 0.7)]]))[0], abs=1e-12)
