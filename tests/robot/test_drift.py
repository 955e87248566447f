from dataclasses import replace

import numpy as np
import pytest

import wirebayes as wb
from tests.robot import cases
from tests.robot.lines import CORE, line_about
from tests.wire.test_fresh import Shrinking, Waking
from wirebayes.commands.wire_draws import wire_draws
from wirebayes.effects import effect_named
from wirebayes.effects.rivals import Logarithmic, PowerLaw, TwoModes
from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.mechanics.wire_doubts import wire_warnings
from wirebayes.robot.mechanics.wires import Wires, tension
from wirebayes.robot.motion import creeping_hold, drift, forward, inverse
from wirebayes.robot.motion.course import Course
from wirebayes.robot.motion.creep import HoldCreep, fresh
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import simulate


def _line(n=1, law="hooke", history="saturating", effects=(), sd=0.0, seed=0, **more):
    line = line_about(CORE | more, sd, n, seed, law)
    return replace(line, history=history, effects=tuple(effects), tension_ref_N=3.0)


def _bench_with_the_robots_wire(line, displacement_mm, duration_s, follow):
    """One wire held at given stretched lengths: the robot's creep, the bench's protocol."""
    wires = Wires(
        line.law,
        line.history,
        {k: v[None] for k, v in line.parameters.items()},
        np.array([[1000.0]]),
        line.material(),
        line.tension_ref_N,
    )
    state = fresh(1, line.count)
    readings = []
    for x in displacement_mm:
        stretched = np.full((1, line.count), 1.0 + 1e-3 * x)
        first = tension(wires, stretched, 1.0 + state.strain(wires))[0]
        creep = HoldCreep(wires, state, first, follow)
        row = [first]
        for t in (0.4 * duration_s, duration_s):
            state = creep.advance(t, row[-1])
            row.append(tension(wires, stretched, 1.0 + state.strain(wires))[0])
        readings.append(row)
    return np.array(readings)[:, :, 0]


@pytest.mark.parametrize("history", ["saturating", "additive"])
@pytest.mark.parametrize("law", ["hooke", "modified"])
@pytest.mark.parametrize(
    "effect",
    [
        None,
        ("strain_stiffening", {"strain_stiffening.c": 8.0}),
        ("toe", {"toe.w": 0.4}),
        ("toe@strain", {"toe.w": 0.4}),
        ("power_strain", {"power_strain.p": 0.3}),
        ("permanent_creep", {"permanent_creep.psi": 0.3}),
        ("second_relaxation", {"second_relaxation.A": 0.02, "second_relaxation.T2": 25.0}),
        ("steady_creep", {"steady_creep.a": 1e-4}),
        ("tension_dependent_rate", {"tension_dependent_rate.m": 0.4}),
        ("creep_threshold", None),
        ("superposition", {"superposition.omega": 0.5}),
        ("ageing", {"ageing.a": 0.6}),
        ("steady_creep@carried", {"steady_creep.a": 1e-4}),
        (Logarithmic(), {"logarithmic.t0": 7.0}),
        (PowerLaw(), {"power_law.n": 0.3}),
        (TwoModes(), {"two_modes.slow_share": 0.3, "two_modes.slower": 12.0}),
        (Waking(), {"waking.p": 0.3}),
        (Shrinking(), {"shrinking.w": 0.2}),
    ],
)
def test_a_wire_in_the_robot_creeps_as_on_the_bench(law, history, effect):
    name, amplitudes = effect or (None, {})
    effects = () if name is None else (effect_named(name) if isinstance(name, str) else name,)
    if amplitudes is None:
        amplitudes = dict.fromkeys(effects[0].columns(), 0.5)
    line = _line(law=law, history=history, effects=effects, **amplitudes)
    x, duration = np.array([2.0, 4.0, 7.0, 5.0]), 120.0
    ours = _bench_with_the_robots_wire(line, x, duration, "start")[..., 0]
    h = len(x)
    protocol = Protocol(
        1000.0,
        x,
        np.tile([0.0, 0.4 * duration, duration], (h, 1)),
        np.ones((h, 3), bool),
        np.full(h, duration),
        np.arange(1, h + 1),
    )
    theta = dict(line.parameters) | {"preload": np.zeros(1)}
    bench = simulate(protocol, theta, Model(law, history, effects, tension_ref_N=3.0))[..., 0]
    np.testing.assert_allclose(ours, bench, rtol=1e-12)


def test_creep_under_a_steady_tension_does_not_depend_on_how_a_hold_is_stepped():
    line = _line()
    wires = draws.for_robot(schema.read_robot_file("linear-6"), line)
    load = np.full((6, 1), 3.0)
    ends = []
    for steps in ([100.0], [1.0, 7.0, 30.0, 100.0]):
        creep = HoldCreep(wires, fresh(6, 1), load, "current")
        for t in steps:
            state = creep.advance(t, load)
        ends.append(state.creep_mm)
    np.testing.assert_allclose(ends[0], ends[1], rtol=1e-13)
    eq5 = CORE["B"] * 3.0 ** CORE["U"] * (1 - np.exp(-CORE["k2"] * 100.0 ** CORE["N"]))
    np.testing.assert_allclose(ends[0], eq5, rtol=1e-12)


@pytest.mark.parametrize("name", ["cogiro-desk", "linear-7", "hangprinter-4"])
def test_drift_is_the_forward_solution_of_the_crept_lengths(name):
    robot = schema.read_robot_file(name)
    wires = draws.for_robot(robot, _line(3, sd=0.05))
    course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([0.0, 60.0]))
    assert course.found.all()
    np.testing.assert_allclose(course.position_m[:, 0], np.tile(robot.home_m, (3, 1)), atol=1e-11)
    tau = cases.tensions_at_home(robot)
    commands = inverse.commands(robot, wires, robot.home_m[None], np.eye(3)[None], tau)
    bare, offset = inverse.lengths(robot, commands.joint_m)
    crept = bare * (1 + course.end.strain(wires).T)
    again = forward.solve_equilibrium(robot, wires, crept, offset, robot.home_m + 0.01, np.eye(3))
    np.testing.assert_allclose(again.position_m, course.position_m[:, 1], atol=1e-11)
    assert (course.position_m[:, 1, 2] < robot.home_m[2]).all()


def test_a_hanging_platform_sinks_by_the_creep_of_its_wires():
    # Six wires of one tension and one strain: every length grows by the same factor, so does the figure they span.
    robot = schema.read_robot_file("robocrane")
    around = np.sqrt(12.0) * robot.exit_m[:, :2] / np.linalg.norm(robot.exit_m[:, :2], axis=1, keepdims=True)
    exits = np.column_stack([around, np.full(6, 3.0)])
    robot = replace(robot, beyond_m=np.zeros(6), platform_m=np.zeros((6, 3)), mass_kg=4.0, exit_m=exits)
    wires = draws.for_robot(robot, _line())
    centre = np.array([0.0, 0.0, 1.0])
    tau = 4.0 * 9.80665 / 6 / (2.0 / np.sqrt(4.0 + 12.0))
    commands = inverse.commands(robot, wires, centre[None], np.eye(3)[None], np.full((1, 6), tau))
    strain = 1e-3 * CORE["B"] * tau ** CORE["U"] * (1 - np.exp(-CORE["k2"] * 60.0 ** CORE["N"]))
    point = replace(robot, freedom="position")
    course = drift.hold(point, wires, commands.joint_m, np.array([60.0]), centre, np.eye(3), follow="start")
    S = np.sqrt(16.0) * (1 + strain)
    # the elastic stretch changes a little as the wires turn
    depth = np.sqrt(S**2 - 12.0)
    for _ in range(20):
        t = 4.0 * 9.80665 / 6 * np.sqrt(12.0 + depth**2) / depth
        S = commands.zero_m[0, 0] * (1 + strain) * (1 + t / CORE["k1"])
        depth = np.sqrt(S**2 - 12.0)
    np.testing.assert_allclose(3.0 - course.position_m[0, 0, 2], depth, atol=1e-9)


def test_smaller_errors_allowed_a_step_change_little():
    robot = schema.read_robot_file("segesta-8")
    wires = draws.for_robot(robot, _line())
    ends = []
    for allowed in (2e-4, 1e-8):
        tau = cases.tensions_at_home(robot)
        joint = inverse.commands(robot, wires, robot.home_m[None], np.eye(3)[None], tau).joint_m
        course = drift.hold(robot, wires, joint, np.array([600.0]), robot.home_m, np.eye(3), tolerance=allowed)
        ends.append(course)
    relaxed = ends[1].tension_N[0, 0]
    assert (relaxed < 0.97 * tau[0]).all()  # the pretension relaxes, so following it matters at all
    np.testing.assert_allclose(ends[0].tension_N[0, 0], relaxed, rtol=1e-3)


@pytest.fixture
def tries(monkeypatch):
    """Steps that a walk tries; it is ended after a thousand."""
    tried, once = [], creeping_hold.CreepingHold._try

    def counted(walk, time, least):
        assert len(tried) < 1000
        tried.append((time, least))
        return once(walk, time, least)

    monkeypatch.setattr(creeping_hold.CreepingHold, "_try", counted)
    return tried


@pytest.mark.parametrize("name", ["linear-7", "hangprinter-4"])
def test_a_hold_after_one_in_which_all_creep_was_over_ends_where_it_began(name, tries):
    # What is left to creep is rounding in the tensions: no step makes its error small against it.
    robot = schema.read_robot_file(name)
    wires = draws.for_robot(robot, _line(40, sd=0.05, k2=0.5))
    tau = cases.tensions_at_home(robot)
    joint = inverse.commands(robot, wires, robot.home_m[None], np.eye(3)[None], tau).joint_m
    first = drift.hold(robot, wires, joint, np.array([3600.0]), robot.home_m, np.eye(3))
    pose = first.position_m[:, 0], first.rotation[:, 0]
    again = drift.hold(robot, wires, joint, np.array([3600.0]), *pose, carried=first.end)
    assert again.found.all()
    np.testing.assert_allclose(again.position_m[:, 0], pose[0], atol=1e-8)


def test_nothing_is_followed_where_no_draw_hangs_in_balance(tries):
    robot = schema.read_robot_file("linear-7")
    wires = draws.for_robot(robot, _line(3))
    course = drift.hold(robot, wires, np.full((3, 7), np.nan), np.array([60.0]), robot.home_m, np.eye(3))
    assert not course.found.any() and len(tries) == 1


@pytest.mark.parametrize("off", [-1e-9, 1e-9])
def test_a_step_is_taken_whatever_its_error_where_creep_grows_by_a_ten_thousandth(off, monkeypatch):
    robot = schema.read_robot_file("linear-7")
    start = robot.home_m, np.eye(3)
    walk = creeping_hold.CreepingHold(robot, draws.for_robot(robot, _line()), np.full(7, np.nan), start)
    walk.live[:] = True
    seen = []

    class Seen(Exception):
        pass

    def noted(time, least):
        seen.append(least)
        raise Seen

    monkeypatch.setattr(walk, "_try", noted)
    walk.creep.time_s = 10.0
    walk.step = creeping_hold._LEAST_STEP * (10.0**walk.power + walk.first) * (1.0 + off)
    with pytest.raises(Seen):
        walk.to(1000.0)
    assert seen == [off < 0]


def test_shared_draws_sink_and_specimens_tilt():
    robot = schema.read_robot_file("cogiro-desk")
    line = _line(400, sd=0.05, seed=2)
    rng = np.random.default_rng(1)
    tilt, sd = {}, {}
    for spread in (0.0, 0.05):
        wires = draws.for_robot(robot, line, spread, rng)
        course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([60.0]))
        shift, _ = drift.distance_moved(course, robot.home_m, np.eye(3))
        tilt[spread], sd[spread] = np.median(rotation.tilt(course.rotation)), np.linalg.norm(shift, axis=-1).std()
    certain = replace(line, parameters={k: np.full(400, v.mean()) for k, v in line.parameters.items()})
    wires = draws.for_robot(robot, certain, 0.05, rng)
    alone = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([60.0]))
    only_specimens = np.linalg.norm(drift.distance_moved(alone, robot.home_m, np.eye(3))[0], axis=-1).std()
    assert tilt[0.05] > 3 * tilt[0.0]
    assert only_specimens < 0.6 * sd[0.0]


def test_rotation_angle_keeps_small_and_large_angles():
    from wirebayes.robot.mechanics.rotation import matrix

    angle = np.array([1e-9, 1e-3, 1.0, 3.0])
    R = matrix(angle[:, None] * np.array([0.6, 0.0, 0.8]))[:, None]
    course = Course(np.zeros(1), np.zeros((4, 1, 3)), R, np.zeros((4, 1, 6)), np.zeros((4, 1), int), fresh(6, 4))
    np.testing.assert_allclose(drift.distance_moved(course, np.zeros(3), np.eye(3))[1][:, 0], angle, rtol=1e-9)


def test_bench_quantities_never_enter():
    line = _line(5, sd=0.1)
    more = replace(line, parameters=dict(line.parameters) | {"preload": np.full(5, 9.0), "sensor_sd": np.ones(5)})
    slip = replace(more, effects=(effect_named("grip_slip@3"), effect_named("sensor_drift")))
    wires = draws.for_robot(schema.read_robot_file("linear-6"), slip)
    assert set(wires.theta) == set(CORE)
    assert wires.effects == ()


def test_the_tested_range_under_weights_is_that_of_the_weights(tmp_path):
    (test,) = wb.simulate_tests(weights=[10, 20, 40], times=[0, 30, 60], parameters={"k1": 900}, seed=1).experiments
    few = wb.Policy(walkers=32, ess=300, rounds=2, round_draws=1024, block=20, most_steps=60, r_hat=1.5)
    posterior = wb.fit(test, policy=few, check=False, output=tmp_path / "fit")
    assert wire_draws(posterior.stored(), 5).tension_range_N == (10.0, 40.0)  # not the displacements that were read


def test_uses_outside_the_tested_range_cause_warnings():
    line = replace(_line(), tension_range_N=(1.0, 5.0), time_range_s=(0.0, 120.0))
    message = wire_warnings(schema.read_robot_file("linear-6"), line, np.array([0.5, 3.0]), 3600.0, np.array([3.0]))
    assert len(message) == 3
    assert wire_warnings(schema.read_robot_file("linear-6"), line, np.array([1.5, 3.0]), 100.0, np.array([1.1])) == []
