"""Robots drawn at random against a solver of their own: statics, drift, falls and proved boxes."""

from dataclasses import replace

import numpy as np
import pytest

from wirebayes.robot.mechanics import draws
from wirebayes.robot.motion import creeping_hold, drift, equilibria, inverse, outcome, path
from wirebayes.robot.pose import stability
from wirebayes.robot.pose.answer import pose_report
from wirebayes.robot.pose.request import PoseRequest
from wirebayes.robot.proof import proofs

from . import drawn, independent

TIMES = np.array([1.0, 10.0, 60.0, 600.0, 3600.0])
TOP_HEAVY = [("body-7", 2), ("body-8", 2), ("body-9", 2), ("body-9", 20)]  # these fall


def _rig(d):
    k1 = d.line.parameters["k1"][0]
    rig = independent.Rig(d.robot, d.line.law, k1, d.rotation)
    tau = inverse.tensions(d.robot, d.position_m[None], d.rotation[None])
    q = rig.start(d.position_m)
    return rig, q, tau, rig.zero_for(q, tau)


def _statics(d, rng):
    """Largest relative disagreement in tensions, lengths and poses."""
    robot, (rig, q, tau, zero) = d.robot, _rig(d)
    theirs = independent.least_tensions(robot, d.position_m, d.rotation)
    weight = robot.mass_kg * 9.80665
    if theirs is not None:  # what a general minimiser finds is not better than ours
        assert tau[0] @ tau[0] <= (theirs @ theirs) * (1 + 1e-5)
    assert tau.min() >= robot.rule.lowest_N * (1 - 1e-8)
    assert tau.max() <= robot.rule.highest_N * (1 + 1e-8)
    assert np.abs(rig.wrench(q, zero)).max() < 1e-8  # in weights
    wires = draws.for_robot(robot, d.line)
    commands = inverse.commands(robot, wires, d.position_m[None], d.rotation[None], tau)
    errors = [np.abs(commands.zero_m - zero).max() / robot.span_m]
    stable = rig.softest(q, zero)[0] > 0
    here = d.position_m, d.rotation
    every = equilibria.equilibria(robot, wires, commands.zero_m[0], commands.offset_m[0], rng, 16, known=here)
    own = np.abs(every.position_m - d.position_m).max(1).min(initial=np.inf) < 1e-6 * robot.span_m
    assert own == stable
    for x, R in zip(every.position_m, every.rotation, strict=True):
        at = independent.Rig(robot, d.line.law, rig.k1, R)
        there = at.start(x + 1e-4 * robot.span_m * rng.normal(size=3))
        found, ok = at.newton(there, zero)
        if ok[0] and at.softest(at.start(x), zero)[0] > 1e-3:
            errors.append(np.abs(at.place(found)[0][0] + at.middle - x).max() / robot.span_m)
            errors.append(np.abs(at.tension(found, zero) - at.tension(at.start(x), zero)).max() / weight * 1e-3)
    return max(errors)


@pytest.mark.parametrize("kind", drawn.KINDS)
def test_tensions_lengths_and_equilibria_agree_with_another_solver(kind):
    for seed in range(3):
        rng = np.random.default_rng(seed)
        assert _statics(drawn.draw(kind, rng), rng) < 1e-9


def _top_heavy(kind, seed, count=1, sd=0.0):
    """The same robots with the centre of mass far above the platform: lower wires hold it up until they creep."""
    rng = np.random.default_rng(seed)
    d = drawn.draw(kind, rng)
    if count > 1:
        d.line = _widened(d.line, np.random.default_rng(seed), count, sd)
    if d.robot.degrees == 3:
        return d
    height = rng.uniform(0.1, 0.6) * 0.3 * np.ptp(d.robot.exit_m)
    d.robot = replace(d.robot, centre_of_mass_m=d.robot.platform_m.mean(0) + [0.0, 0.0, height])
    tau = inverse.tensions(d.robot, d.position_m[None], d.rotation[None])
    return d if np.isfinite(tau).all() else None


def _drift(d):
    """Relative error of displacement, turn error in rad over the largest turn, both fall times; None if not held."""
    rig, q, _, zero = _rig(d)
    course = drift.from_command(d.robot, draws.for_robot(d.robot, d.line), d.position_m, d.rotation, TIMES)
    stable = rig.softest(q, zero)[0] > 0
    assert stable == (course.status[0, 0] != outcome.NOT_HELD)
    if not stable:
        return None
    theta = {k: v[0] for k, v in d.line.parameters.items()}
    there, fall = independent.drift(rig, theta, d.line.length_mm, zero, q, TIMES)
    held = min(len(there), int((course.falls.time_s[0] > TIMES).sum()))
    x, R = (v.real[:held] for v in rig.place(there))
    x = x + rig.middle
    moved = np.linalg.norm(x - d.position_m, axis=1)
    off = np.linalg.norm(course.position_m[0, :held] - x, axis=1) / moved
    turned = np.abs(R - d.rotation).max((1, 2), initial=0.0)
    spun = np.abs(course.rotation[0, :held] - R).max((1, 2), initial=0.0) / np.maximum(turned, 1e-9)
    return off, spun, course.falls.time_s[0], fall


@pytest.mark.parametrize("kind", [k for k in drawn.KINDS if k not in ("body-6", "body-8")])
def test_drift_agrees_with_a_stiff_integrator_at_every_time(kind):
    off, spun, ours, theirs = _drift(drawn.draw(kind, np.random.default_rng(0)))
    assert np.isinf(ours) and np.isinf(theirs)
    assert off.max() < 2e-3
    assert spun.max() < 1e-2


@pytest.mark.parametrize(
    ("kind", "seed"), [TOP_HEAVY[0], *(pytest.param(*other, marks=pytest.mark.slow) for other in TOP_HEAVY[1:])]
)
def test_falls_are_found_at_their_time_and_reported(kind, seed):
    d = _top_heavy(kind, seed)
    off, spun, ours, theirs = _drift(d)
    assert ours == pytest.approx(theirs, rel=2e-3)
    assert off.max(initial=0) < 2e-3
    assert spun.max(initial=0) < 1e-2
    course = drift.from_command(d.robot, draws.for_robot(d.robot, d.line), d.position_m, d.rotation, TIMES)
    assert not course.found[0]
    assert np.isnan(course.position_m[0, -1]).all()
    report = stability.summary(course)
    assert report["fall_probability"] == 1.0
    assert report["fall_time_s"]["first"] == ours
    warnings = stability.stability_warnings({0.0: course})
    assert "in 100 % of the draws" in warnings[0].text


def test_where_a_fall_is_within_a_step_is_looked_for_once_the_step_is_short(monkeypatch):
    d = _top_heavy("body-7", 2, 2, 0.05)
    taken, step = [], path._step
    monkeypatch.setattr(path, "_step", lambda *given: taken.append(1) or step(*given))

    def fallen():
        taken.clear()
        course = drift.from_command(d.robot, draws.for_robot(d.robot, d.line), d.position_m, d.rotation, TIMES)
        return course.falls.time_s, len(taken)

    times, steps = fallen()
    monkeypatch.setattr(creeping_hold, "_GLANCE", path.SMALLEST)
    exact, more = fallen()
    assert np.isfinite(exact).all()
    np.testing.assert_allclose(times, exact, rtol=1e-3)
    assert steps < 0.75 * more


def test_early_times_do_not_depend_on_later_ones():
    for kind in ("planar-4", "point-4", "body-7"):
        d = drawn.draw(kind, np.random.default_rng(1))
        wires = draws.for_robot(d.robot, d.line)
        long, short = (drift.from_command(d.robot, wires, d.position_m, d.rotation, TIMES[:k]) for k in (5, 2))
        np.testing.assert_array_equal(long.position_m[:, :2], short.position_m)


@pytest.mark.parametrize("kind", drawn.KINDS)
def test_nothing_depends_on_where_the_origin_is_or_on_the_units_of_force(kind):
    d = drawn.draw(kind, np.random.default_rng(5))
    robot, wires = d.robot, draws.for_robot(d.robot, d.line)
    tau = inverse.tensions(robot, d.position_m[None], d.rotation[None])
    course = drift.from_command(robot, wires, d.position_m, d.rotation, TIMES)
    centre = robot.exit_m.mean(0)
    away = np.array([60.0, -1000.0, 300.0]) - centre
    moved = replace(robot, exit_m=robot.exit_m + away)
    there = drift.from_command(moved, wires, d.position_m + away, d.rotation, TIMES)
    assert (there.status == course.status).all()
    np.testing.assert_allclose(there.position_m - away, course.position_m, atol=1e-9 * robot.span_m + 1e-11)
    for force in (1e-3, 1e7):
        heavy = replace(
            robot,
            mass_kg=force * robot.mass_kg,
            rule=replace(robot.rule, lowest_N=force * robot.rule.lowest_N, highest_N=force * robot.rule.highest_N),
        )
        more = inverse.tensions(heavy, d.position_m[None], d.rotation[None])
        np.testing.assert_allclose(more / force, tau, rtol=1e-9)
        theta = dict(wires.theta) | {"k1": wires.theta["k1"] * force, "B": wires.theta["B"] / force ** wires.theta["U"]}
        there = drift.from_command(heavy, replace(wires, theta=theta), d.position_m, d.rotation, TIMES)
        np.testing.assert_allclose(there.position_m, course.position_m, atol=1e-8 * robot.span_m)


def _fallen_out(d, count, rng):
    """Whether a box is stated, and how many of two kinds of draws within its bands end outside it."""
    robot, x, R = d.robot, d.position_m, d.rotation
    wires = draws.for_robot(robot, d.line)
    times = np.array([0.0, 600.0])
    course = drift.from_command(robot, wires, x, R, times)
    band = proofs.enclosed(robot, wires, course, x, R).get("band")
    if not band or not band["share"]:
        return False, 0, 0
    low, high = (1e-3 * np.asarray(band[k]) for k in ("low_mm", "high_mm"))
    rig, q, tau, _ = _rig(replace(d, line=d.line.centre()))
    strain = np.broadcast_to(course.end.strain(wires), (robot.legs, d.line.count))
    edges = []
    for v in (np.broadcast_to(wires.theta["k1"], strain.shape), strain):
        a, b = np.quantile(v, 0.05, axis=1), np.quantile(v, 0.95, axis=1)
        edges.append((0.5 * (a + b) - 0.5 * band["share"] * (b - a), 0.5 * (a + b) + 0.5 * band["share"] * (b - a)))
    bare = rig.zero_for(q, tau)[0]
    # every wire anywhere in its band, corners among them, creep in step; followed by the other solver
    where = np.where(
        rng.random((2, count, 1)) < 0.5, rng.random((2, count, robot.legs)), rng.integers(0, 2, (2, count, robot.legs))
    )
    k1, grown = (a + s * (b - a) for s, (a, b) in zip(where, edges, strict=True))
    many = independent.Rig(robot, d.line.law, k1, R)
    q, ok = np.repeat(q, count, 0), np.ones(count, bool)
    for part in np.linspace(0.0, 1.0, 9):
        q, good = many.newton(q, bare * (1 + part * grown))
        ok &= good
    there = many.place(q)[0].real + many.middle - x
    out = int((~ok | (there < low).any(1) | (there > high).any(1)).sum())
    # wires as the posterior draws them, through time, commanded the mean wire's lengths; those within the bands count
    some = replace(d.line, parameters={k: rng.choice(v, count) for k, v in d.line.parameters.items()})
    real = draws.for_robot(robot, some)
    length_m = inverse.lengths(robot, bare)[0]
    held = drift.hold(robot, real, length_m, times, x, R)
    ends = np.broadcast_to(held.end.strain(real), (robot.legs, count))
    inside = np.ones(count, bool)
    for v, (a, b) in zip((np.broadcast_to(real.theta["k1"], ends.shape), ends), edges, strict=True):
        inside &= ((v >= a[:, None]) & (v <= b[:, None])).all(0)
    there = held.position_m[inside, -1] - x
    out += int((~((there >= low) & (there <= high)).all(1)).sum())
    return True, out, int(inside.sum())


@pytest.mark.parametrize("kind", ["planar-2", "planar-4", "point-4", "body-6", "body-8"])
def test_no_draw_within_the_bands_ends_outside_the_proved_box(kind):
    pytest.importorskip("flint")
    stated, out, _ = _fallen_out(drawn.draw(kind, np.random.default_rng(3), 40, 0.01), 100, np.random.default_rng(0))
    assert stated or kind.startswith("body")
    assert out == 0


@pytest.mark.parametrize(("kind", "seed"), TOP_HEAVY)
def test_no_box_is_stated_for_a_platform_that_falls(kind, seed):
    pytest.importorskip("flint")
    d = _top_heavy(kind, seed, 5, 1e-4)
    wires = draws.for_robot(d.robot, d.line)
    course = drift.from_command(d.robot, wires, d.position_m, d.rotation, TIMES)
    assert course.falls.fell.all()
    # not even when nobody looked at the way: the proof itself has to find it
    end = replace(course.end, elongation_mm=np.broadcast_to(_crept(d), course.end.creep_mm.shape))
    unseen = replace(course, falls=None, status=np.zeros_like(course.status), end=end)
    for seen in (course, unseen):
        assert proofs.enclosed(d.robot, wires, seen, d.position_m, d.rotation)["band"]["share"] == 0.0


def _crept(d):
    """Creep after an hour, had the first tensions stayed, (w, 1) mm."""
    p = {k: v[0] for k, v in d.line.parameters.items()}
    tau = inverse.tensions(d.robot, d.position_m[None], d.rotation[None])[0]
    return (p["B"] * tau ** p["U"] * -np.expm1(-p["k2"] * 3600.0 ** p["N"]))[:, None]


def test_a_pose_of_seven_wires_is_among_its_own_equilibria_and_named():
    d = drawn.draw("body-7", np.random.default_rng(0), 20, 0.02)
    request = PoseRequest(d.position_m, d.rotation, np.array([0.0, 1.0]), tolerance_m=1e-12)  # left at once
    content = pose_report(d.robot, d.line, request).content
    own = [p for p in content["equilibria"]["poses"] if p["commanded"]]
    assert len(own) == 1
    assert own[0]["stable"] == content["equilibria"]["commanded_stable"]
    np.testing.assert_allclose(own[0]["position_m"], d.position_m, atol=1e-6 * d.robot.span_m)


@pytest.mark.slow
@pytest.mark.parametrize("kind", drawn.KINDS)
def test_two_hundred_robots(kind):
    """Run with -s for the figures: nine kinds, 23 robots each, every second body top-heavy."""
    pytest.importorskip("flint")
    statics, off, spun, falls, boxes, outside, within, unheld = [], [], [], [], 0, 0, 0, 0
    for seed in range(23):
        rng = np.random.default_rng(1000 + seed)
        d = _top_heavy(kind, 1000 + seed) if seed % 2 else drawn.draw(kind, rng)
        if d is None:
            d = drawn.draw(kind, rng)
        statics.append(_statics(d, rng))
        found = _drift(d)
        if found is None:
            unheld += 1
            continue
        off.append(found[0].max(initial=0.0))
        spun.append(found[1].max(initial=0.0))
        if np.isfinite(found[2:]).any():
            falls.append((seed, *found[2:]))
        wider = replace(d, line=_widened(d.line, rng))
        stated, out, inside = _fallen_out(wider, 2000, rng)
        boxes, outside, within = boxes + stated, outside + out, within + inside
    print(
        f"\n{kind}: statics {max(statics):.1e}; drift off {100 * max(off):.3f} %, turn off {100 * max(spun):.3f} %; "
        f"{unheld} not stable at the pose; falls (seed, ours, theirs): {falls}; "
        f"boxes {boxes}, draws outside {outside} of {2000 * boxes + within}"
    )
    assert max(statics) < 1e-9
    assert max(off) < 2e-3
    assert max(spun) < 1e-2
    assert all(ours == pytest.approx(theirs, rel=0.03) for _, ours, theirs in falls)
    assert outside == 0


def _widened(line, rng, count=40, sd=0.01):
    """Draws about one wire."""
    values = {k: v * np.exp(sd * rng.standard_normal(count)) for k, v in line.parameters.items()}
    return replace(line, parameters=values)
