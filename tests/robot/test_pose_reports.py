"""What a pose report says of falls, margins, claims and controllers, from results that are written down."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from tests.robot.lines import STRONGER, line_about
from wirebayes.report.pages import pose as pose_page
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics import draws, schema
from wirebayes.robot.mechanics.description import GivenWire
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import claim, control, drift, forward, outcome
from wirebayes.robot.motion.claim import DISTANCE_M, TILT_RAD, TIME_S
from wirebayes.robot.motion.course import Course, Falls
from wirebayes.robot.pose import answer, controllers, round_trip, stability
from wirebayes.robot.pose.request import PoseRequest, band_over_draws

NEVER, NAN = np.inf, np.nan
TIMES = np.array([0.0, 10.0, 30.0, 60.0])


def course(falls: Falls | None, legs: int = 3) -> Course:
    n = 0 if falls is None else len(falls.time_s)
    at = np.zeros((n, 4, 3)), np.zeros((n, 4, 3, 3)), np.ones((n, 4, legs))
    return Course(TIMES, *at, None, None, falls)  # type: ignore[arg-type]


# Five draws: two fall (one is caught), two hold, one never began.
FIVE = Falls(
    time_s=np.array([5.0, 30.0, NEVER, NEVER, NEVER]),
    wire=np.array([1, 1, -1, -1, -1]),
    drop_m=np.array([0.02, NEVER, 0.0, 0.0, 0.0]),
    slack_s=np.array([[NEVER, 4.0, NEVER], [NEVER, NEVER, NEVER], [20.0, NEVER, NEVER], [NEVER] * 3, [NEVER] * 3]),
    tension_share=np.array([[0.9, 0.0, 0.9], [0.8, 0.1, 0.9], [0.0, 0.5, NAN], [0.7, 0.6, NAN], [NAN, NAN, NAN]]),
    stiffness_share=np.array([0.0, 0.1, 0.4, 0.6, NAN]),
)


def test_falls_are_shares_of_the_draws_that_began() -> None:
    found = stability.summary(course(FIVE))
    assert found["began"] == pytest.approx(0.8)
    assert found["fall_probability"] == 0.5
    assert found["fall_probability_at"].tolist() == [0.0, 0.25, 0.5, 0.5]  # a fall at the time itself has happened
    assert found["fall_time_s"] == {"first": 5.0, "median": 17.5, "last": 30.0}
    assert found["fall_wires"].tolist() == [0.0, 0.5, 0.0]
    assert found["fall_distance_mm"] == {"first": 20.0, "median": 20.0, "last": 20.0}
    assert found["caught_probability"] == 0.5
    assert found["slack_probability"].tolist() == [0.25, 0.25, 0.0]
    assert found["slack_time_s"] == [
        {"first": 20.0, "median": 20.0, "last": 20.0},
        {"first": 4.0, "median": 4.0, "last": 4.0},
        None,
    ]
    assert found["least_tension_wire"] == 2  # of four draws three come nearest to slackness there
    # margins are those of the two draws that hold to the end
    assert found["least_tension_share"]["mean"] == pytest.approx(0.3)
    assert found["stiffness_share"]["mean"] == pytest.approx(0.5)


def test_warnings_say_who_falls_when_and_what_catches_it() -> None:
    found = stability.stability_warnings({0.05: course(FIVE)})[:3]
    assert [notice.kind for notice in found] == ["fall", "fall", "slack"]
    began, fall, slack = (notice.text for notice in found)
    assert began.startswith("draws cannot begin at the pose, no stable equilibrium is found there: 20 % of them (spec")
    assert "not stable" in stability.stability_warnings({0.0: course(FIVE)}, stable=False)[0].text
    assert "falls within 1 min: in 50 % of the draws, first after 5 s, in the median after 17.5 s" in fall
    assert fall.endswith("wire 2 giving way, dropping 20 mm (specimens differing by 5 %)")
    assert "wire 1 in 25 % of the draws, first after 20 s, wire 2 in 25 % of the draws, first after 4 s (" in slack


def holding(tension: float, stiffness: float) -> Course:
    n = 4
    return course(
        Falls(
            np.full(n, NEVER),
            np.full(n, -1),
            np.zeros(n),
            np.full((n, 3), NEVER),
            np.tile([0.9, 0.95, tension], (n, 1)),
            np.full(n, stiffness),
        )
    )


@pytest.mark.parametrize(
    ("tension", "stiffness", "words"),
    [
        (0.21, 0.31, []),
        (0.2, 0.3, []),
        (0.19, 0.31, ["a wire may keep little of its tension within 1 min: wire 3 19 % (specimens alike)"]),
        (0.21, 0.29, ["the stiffness against the softest motion may fall within 1 min: to 29 % (specimens alike)"]),
        (0.21, -0.1, ["the stiffness against the softest motion may fall within 1 min: to 0 % (specimens alike)"]),
    ],
)
def test_a_platform_that_holds_is_warned_of_when_it_comes_near_to_a_fall(
    tension: float, stiffness: float, words: list[str]
) -> None:
    """Below a fifth of a wire's tension, or three tenths of the stiffness."""
    assert [notice.text for notice in stability.stability_warnings({0.0: holding(tension, stiffness)})] == words
    found = stability.summary(holding(tension, stiffness))
    assert found["caught_probability"] is None and found["fall_time_s"] is None and found["fall_probability"] == 0.0


def test_where_no_draw_begins_there_is_nothing_more_to_say() -> None:
    none = Falls(*(getattr(FIVE, name)[4:] for name in Falls.__dataclass_fields__))
    for lost in (course(none), course(None)):
        assert stability.summary(lost) == {"began": 0.0}
        assert len(stability.stability_warnings({0.0: lost})) == 1


@pytest.mark.parametrize(
    ("share", "words"),
    [(1.0, "100 %"), (0.996, "nearly all"), (0.99, "99 %"), (0.995, "nearly all"), (0.123, "12.3 %")],
)
def test_nearly_all_is_not_all(share: float, words: str) -> None:
    assert stability._percent(share) == words


def test_a_time_within_tolerance_is_the_last_one_where_it_holds_the_probability() -> None:
    """Distances grow by a millimetre a time in every draw; the angle leaves its tolerance earlier."""
    times = np.array([0.0, 1.0, 10.0, 100.0])
    error = control.PoseError(
        times, np.tile([0.0, 1e-3, 2e-3, 3e-3], (20, 1)), np.zeros((20, 4)), np.ones((20, 4), bool)
    )
    request = PoseRequest(np.zeros(3), np.eye(3), times, 2.5e-3, 0.01)
    assert controllers._lasts(error, request) == {"longest_time_within_s": 10.0, "still_within_at_the_end": False}
    always = PoseRequest(np.zeros(3), np.eye(3), times, 3.5e-3, 0.01)
    assert controllers._lasts(error, always) == {"longest_time_within_s": 100.0, "still_within_at_the_end": True}
    error.angle_rad[:2, 1] = 0.02  # a tenth of the draws
    assert controllers._lasts(error, request)["longest_time_within_s"] == 0.0
    error.angle_rad[1, 1] = 0.0  # one draw of twenty: 95 % are left
    assert controllers._lasts(error, request)["longest_time_within_s"] == 10.0
    tolerances = controllers._tolerances(PoseRequest(np.zeros(3), np.eye(3), times, 2e-3, np.radians(0.5)))
    assert tolerances == {"tolerance_mm": 2.0, "tolerance_deg": pytest.approx(0.5)}


HERE, TURNED = np.array([0.7, -1.2, 2.5]), matrix(np.array([0.2, -0.3, 0.9]))  # what is commanded


def at(distance_m: Any, tilt_rad: Any, times_s: Any = (0.0, 60.0)) -> Any:
    """A hold of as many draws as there are distances, at the last of the times; before, as it is commanded."""
    n, away = len(distance_m), np.zeros((len(distance_m), len(times_s), 3))
    away[:, -1, 0] = distance_m
    turn = np.tile(np.eye(3), (n, len(times_s), 1, 1))
    c, s = np.cos(tilt_rad), np.sin(tilt_rad)
    turn[:, -1] = np.moveaxis(np.array([[c, 0 * c, s], [0 * c, 0 * c + 1, 0 * c], [-s, 0 * c, c]]), -1, 0)
    return SimpleNamespace(position_m=HERE + away, rotation=TURNED @ turn, times_s=np.array(times_s))


def test_the_paper_s_figures_hold_in_the_draws_that_keep_both() -> None:
    d, t = DISTANCE_M, TILT_RAD
    alike = at(d * np.array([0.9, 0.5, 0.9, 1.1, NAN]), t * np.array([0.9, 0.5, 1.1, 0.5, NAN]))
    other = at(np.array([0.1 * d] * 4), np.zeros(4), (0.0, 30.0))
    found = answer._claim({0.0: alike, 0.05: other}, HERE, TURNED)
    assert found["holds"] == [
        {"specimen_spread": 0.0, "probability": 0.4},
        {"specimen_spread": 0.05, "probability": None},
    ]
    # section 4 of the paper: 0.3 mm and 0.055° within a minute
    assert (found["time_s"], found["distance_mm"]) == (60.0, pytest.approx(0.3)) and TIME_S == 60.0
    assert found["tilt_deg"] == pytest.approx(0.055)


def test_the_claim_over_a_workspace_counts_points_and_draws() -> None:
    d = np.array([[0.5, 0.5, 2.0], [0.5, 2.0, 0.5], [0.5, 0.5, NAN]]) * DISTANCE_M
    space = claim.WorkspaceDrift(
        np.zeros((3, 3)), d, 0.5 * TILT_RAD * np.ones((3, 3)), np.array([[2.0, 7.0]] * 3), 0.8, 0.9
    )
    found = claim.claim_summary(space)
    assert space.holds() == pytest.approx([2 / 3] * 3)
    assert found["probability"] == pytest.approx(2 / 3) and found["probability_everywhere"] == pytest.approx(1 / 3)
    assert found["q50_drift_mm"] == pytest.approx(0.15) and found["q95_drift_mm"] == pytest.approx(0.6, rel=0.01)
    assert (found["lowest_tension_N"], found["highest_tension_N"]) == (2.0, 7.0)
    assert space.median_distance_m == pytest.approx([0.15e-3] * 3)
    kept = space.part(np.array([True, False, True]), 0.5)
    assert (kept.found, kept.feasible, len(kept.position_m)) == (0.5, 0.5, 2)
    assert space.part(np.zeros(3, bool), 0.5).found == 0.0


def test_a_band_is_the_mean_the_spread_and_nine_in_ten_of_the_draws() -> None:
    found = band_over_draws(np.append(np.arange(101.0), NAN))
    assert (found["mean"], found["q05"], found["q50"], found["q95"]) == (50.0, 5.0, 50.0, 95.0)
    assert found["sd"] == pytest.approx(np.sqrt((101**2 - 1) / 12))


@pytest.fixture(scope="module")
def hung() -> Any:
    """A small robot, ten draws of a wire that creeps, and a request with no spread between specimens but a tenth."""
    robot = schema.read_robot_file("hangprinter-4")
    return (
        robot,
        line_about(STRONGER, 0.02, 10),
        PoseRequest(robot.home_m, np.eye(3), np.array([0.0, 60.0]), specimen_spread=0.1),
    )


def test_a_calibration_lasts_longer_on_wires_that_crept_before_or_are_compensated(hung: Any) -> None:
    robot, line, request = hung
    rows = controllers.between_calibrations(robot, line, request, np.random.default_rng(1))
    lasts = {(r["specimen_spread"], r["loaded_before_s"], r["controller"]): r["longest_time_within_s"] for r in rows}
    ways = ("held_still", "creep_aware")
    assert set(lasts) == {(s, h, c) for s in (0.0, 0.1) for h in (0.0, 3600.0) for c in ways}
    assert all(r["solved"] == 1.0 and r["tolerance_mm"] == pytest.approx(0.3) for r in rows)
    for spread in (0.0, 0.1):
        assert lasts[spread, 0.0, "held_still"] < lasts[spread, 3600.0, "held_still"]
        assert lasts[spread, 0.0, "held_still"] < lasts[spread, 0.0, "creep_aware"]
    # held still from the first moment on, the platform drifts as a command's does
    times = np.geomspace(1.0, 1e5, 41)[:20]
    course = drift.from_command(robot, draws.for_robot(robot, line), request.position_m, request.rotation, times)
    away = np.linalg.norm(course.position_m - request.position_m, axis=-1)
    within = (away < 0.3e-3).mean(axis=0) >= 0.95
    assert lasts[0.0, 0.0, "held_still"] == pytest.approx(times[np.argmin(within) - 1])


def test_a_controller_that_knows_creep_is_nearer_after_a_minute(hung: Any) -> None:
    robot, line, request = hung
    less = draws.WireDraws(line.parameters | {"B": 0.5 * line.parameters["B"]}, 1000.0)
    found = controllers.errors(robot, line, request, np.random.default_rng(1), less)
    error = {(r["specimen_spread"], r["controller"]): r["distance_mm"]["q50"] for r in found}
    names = ("hooke_only", "creep_aware_other_fit", "creep_aware")
    assert set(error) == {(s, c) for s in (0.0, 0.1) for c in names}
    worst, half, best = (error[0.0, name] for name in names)
    assert worst[0] == pytest.approx(half[0]) == pytest.approx(best[0])  # no wire has crept yet
    assert worst[1] > half[1] > best[1]
    assert len(controllers.errors(robot, line, request, np.random.default_rng(1))) == 4


def test_a_controller_without_creep_is_off_by_the_drift_of_its_command(hung: Any) -> None:
    """One wire, known to the controller: its command is that of the drift, in millimetres from the pose."""
    robot, line, request = hung
    one = line.part(np.array([3]))
    found = controllers.errors(robot, one, request, np.random.default_rng(1))[0]
    course = drift.from_command(robot, draws.for_robot(robot, one), request.position_m, request.rotation, TIMES)
    away_mm = 1e3 * np.linalg.norm(course.position_m[0] - request.position_m, axis=-1)
    assert (found["specimen_spread"], found["controller"], found["solved"]) == (0.0, "hooke_only", 1.0)
    assert found["distance_mm"]["mean"] == pytest.approx(away_mm[[0, 3]], rel=1e-4, abs=1e-6) and away_mm[3] > 0.1
    # one draw is enough for the time between calibrations too
    rows = controllers.between_calibrations(robot, one, request, np.random.default_rng(1))
    assert [row["solved"] for row in rows] == [1.0] * 8


def test_draws_too_weak_for_the_pose_are_a_warning() -> None:
    commands: Any = SimpleNamespace(feasible=np.array([True, True, True, False]))
    (weak,) = answer._weak(commands)
    assert weak.text == "25 % of the draws cannot pull as hard as the pose requires, however far stretched"
    assert weak.kind == "unheld"
    assert answer._weak(SimpleNamespace(feasible=np.ones(4, bool))) == []  # type: ignore[arg-type]


def test_a_leg_without_a_drum_leaves_no_gap_in_the_others() -> None:
    found = answer._by_leg(np.array([[1.0, NAN], [3.0, NAN]]))
    assert found["mean"] == [2.0, None] and found["sd"] == [1.0, None]


@pytest.mark.parametrize(("held", "shared"), [(29, False), (30, True)])
def test_shares_need_thirty_draws_that_hold_and_leave_the_others_out(held: int, shared: bool) -> None:
    """The drift is ten times the logarithm of one parameter, in millimetres, of the draws that hold."""
    rng, robot = np.random.default_rng(0), schema.read_robot_file("linear-7")
    line = draws.WireDraws({k: np.exp(rng.standard_normal(40)) for k in draws.CORE}, 1000.0)
    size = 1e-2 * (10.0 + np.log(line.parameters["B"]))
    size[held:] = NAN
    courses = {s: at(size * (1.0 + s), np.zeros(40), (0.0, 30.0, 60.0)) for s in (0.0, 0.1)}
    found = answer._shares(robot, line, courses, HERE, TURNED)
    assert (found["time_s"], found["output"]) == (60.0, "distance")
    if not shared:
        assert "Fewer than 30 draws" in found["sentence"] and "shared_draw" not in found
        return
    assert found["shared_draw"]["B"] > 0.7 and sum(found["shared_draw"].values()) == pytest.approx(1.0)
    sd = 1e3 * np.std(size[:held])
    assert [row["sd_mm"] for row in found["sd_mm"]] == pytest.approx([sd, 1.1 * sd])
    lost = {0.0: courses[0.0], 0.1: at(np.full(40, NAN), np.zeros(40))}
    assert answer._shares(robot, line, lost, HERE, TURNED)["sd_mm"][1]["sd_mm"] is None
    given = replace(robot, given=dict.fromkeys(robot.wire, GivenWire({}, 1000.0)))
    said = answer._shares(given, line, courses, HERE, TURNED)
    assert "parameters of all wires" in said["sentence"] and "shared_draw" not in said


def test_a_robot_that_may_fall_says_who_is_to_blame_in_every_way() -> None:
    """Nothing catches it; no wire is slack but one may be; and it has begun in every draw."""
    n = 4
    fallen = Falls(
        np.array([20.0, 40.0, 40.0, NEVER]),
        np.array([2, 2, 0, -1]),
        np.full(n, NEVER),
        np.full((n, 3), NEVER),
        np.tile([0.9, 0.8, 0.1], (n, 1)),
        np.array([0.1, 0.1, 0.1, 0.5]),
    )
    found = stability.summary(course(fallen))
    assert found["began"] == 1.0 and found["fall_probability"] == 0.75 and found["caught_probability"] == 0.0
    assert found["fall_wires"].tolist() == [0.25, 0.0, 0.5] and found["fall_distance_mm"] is None
    assert found["least_tension_wire"] == 3 and found["slack_time_s"] == [None] * 3
    assert found["stiffness_share"]["mean"] == 0.5 and found["least_tension_share"]["mean"] == pytest.approx(0.1)
    falls = (
        "the platform falls within 1 min: in 75 % of the draws, first after 20 s, in the median after 40 s, "
        "wire 3 giving way, nothing catching it nearby (specimens alike)"
    )
    assert stability.stability_warnings({0.0: course(fallen)}) == [
        Notice("fall", falls),
        Notice("slack", "a wire may keep little of its tension within 1 min: wire 3 10 % (specimens alike)"),
    ]


def test_wires_that_only_slacken_are_named_and_the_nearest_is_not_named_again() -> None:
    n = 4
    slack = np.full((n, 3), NEVER)
    slack[0, 1] = 7.5
    loose = Falls(
        np.full(n, NEVER), np.full(n, -1), np.zeros(n), slack, np.tile([0.9, 0.1, 0.8], (n, 1)), np.full(n, 0.2)
    )
    who = "(specimens differing by 5 %)"
    assert stability.stability_warnings({0.05: course(loose)}) == [
        Notice("slack", f"wires go slack within 1 min: wire 2 in 25 % of the draws, first after 7.5 s {who}"),
        Notice("fall", f"the stiffness against the softest motion may fall within 1 min: to 20 % {who}"),
    ]


def test_what_holds_of_wires_alike_and_of_different_ones_is_one_warning() -> None:
    alike = course(FIVE)
    later = course(replace(FIVE, slack_s=2 * FIVE.slack_s))
    kinds = ["fall", "fall", "slack"]
    assert [one.kind for one in stability.stability_warnings({0.0: alike})] == kinds
    both = stability.stability_warnings({0.0: alike, 0.05: later})
    assert [one.kind for one in both] == kinds
    assert both[1].text.endswith("dropping 20 mm (specimens alike or specimens differing by 5 %)")
    assert "first after 4 s (specimens alike); wire 1 in" in both[2].text
    assert both[2].text.endswith("first after 8 s (specimens differing by 5 %)")


def test_a_wire_that_goes_slack_among_some_specimens_is_not_near_slack_among_others() -> None:
    near = holding(0.1, 0.5)
    slack = course(replace(FIVE, stiffness_share=np.full(5, 0.5), time_s=np.full(5, NEVER)))
    found = stability.stability_warnings({0.0: near, 0.05: slack})
    assert [one.text.split(":")[0] for one in found] == ["wires go slack within 1 min"]
    assert "specimens alike" not in found[0].text


def test_a_platform_that_always_falls_has_no_margin_left() -> None:
    n = 2
    gone = Falls(
        np.full(n, 5.0), np.zeros(n, int), np.full(n, 0.1), np.full((n, 3), NEVER), np.ones((n, 3)), np.ones(n)
    )
    found = stability.summary(course(gone))
    assert found["fall_probability"] == 1.0 and found["least_tension_share"]["mean"] is None
    assert found["stiffness_share"]["mean"] is None and len(stability.stability_warnings({0.0: course(gone)})) == 1


def test_a_round_trip_counts_what_came_back_and_the_slack_wires(monkeypatch: pytest.MonkeyPatch) -> None:
    """From beside the pose, by a hundredth of the platform's size; stiffness is that of the draws that can hold it."""
    robot: Any = SimpleNamespace(size_m=0.5, plane=None, freedom="pose")
    x, R = np.array([1.0, 2.0, 3.0]), np.eye(3)
    commands: Any = SimpleNamespace(
        zero_m=np.ones((4, 3)),
        offset_m=np.zeros((4, 3)),
        feasible=np.array([True, True, False, True]),
        tension_N=np.array([[0.0, 5.0, -1.0], [9.0, 9.0, 9.0], [0.0, 0.0, 0.0], [9.0, 9.0, 9.0]]),
        rotation=np.tile(R, (4, 1, 1)),
    )
    status = np.array([outcome.FOUND, outcome.FOUND, outcome.NOT_CONVERGED, outcome.NOT_HELD])
    back: Any = SimpleNamespace(
        found=status == outcome.FOUND,
        status=status,
        position_m=x + np.array([[1e-9, 0.0, 0.0], [0.0, 0.0, -3e-9], [9.0] * 3, [9.0] * 3]),
    )

    def solve(used: Any, wires: Any, zero: Any, offset: Any, start: Any, turn: Any) -> Any:
        assert zero is commands.zero_m and offset is commands.offset_m and np.array_equal(turn, R)
        assert start == pytest.approx(x + 0.005)
        return back

    def stiffness(used: Any, wires: Any, pose: Any, lengths: Any) -> Any:
        assert np.array_equal(pose[0], np.tile(x, (4, 1))) and pose[1].shape == (4, 3, 3)
        assert lengths == (commands.zero_m, commands.offset_m)
        return np.array([10.0, 20.0, 99.0, 60.0])

    monkeypatch.setattr(round_trip.forward, "solve_equilibrium", solve)
    monkeypatch.setattr(round_trip.one_sided, "lowest_stiffness", stiffness)
    found = round_trip.round_trip(robot, None, commands, x, R)  # type: ignore[arg-type]
    assert found["solved"] == 0.5 and found["largest_round_trip_error_m"] == pytest.approx(3e-9)
    assert found["slack_wires"] == 2 and found["lowest_stiffness_N_m"]["mean"] == 30.0
    assert found["statuses"] == {
        "stable equilibrium": 2,
        "not converged": 1,
        outcome.STATUS[outcome.NO_EQUILIBRIUM]: 0,
        outcome.STATUS[outcome.NOT_HELD]: 1,
        outcome.STATUS[outcome.FELL]: 0,
    }
    back.found = np.zeros(4, bool)
    assert round_trip.round_trip(robot, None, commands, x, R)["largest_round_trip_error_m"] == 0.0  # type: ignore[arg-type]


def test_what_holds_the_commanded_pose_is_marked_among_all_poses(hung: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """By a millionth of the robot's size; where no stable pose is the commanded one, it is listed as unstable."""
    robot, line, _ = hung
    wires = draws.for_robot(robot, line)
    x, R, near = robot.home_m, np.eye(3), 1e-6 * robot.span_m
    rng = np.random.default_rng(0)
    found = round_trip.stable_poses(robot, wires, x, R, rng)
    assert found["commanded_stable"] and found["starts"] == 65 and found["stable_found"] == len(found["poses"]) >= 1
    assert [pose["commanded"] for pose in found["poses"]].count(True) == 1
    assert all(pose["stable"] and pose["slack_wires"] == 0 for pose in found["poses"] if pose["commanded"])

    def others(*given: Any, known: Any) -> forward.Equilibria:
        assert known[0] is x and known[1] is R
        away = np.array([[1.1 * near, 0.0, 0.0], [0.0, 0.9 * near, 0.0], [1.0, 0.0, 0.0]])[rows]
        n, tension = len(away), np.array([[1.0, 0.0, -0.5, 2.0]] * 3)[rows]
        return forward.Equilibria(
            x + away, np.tile(R, (n, 1, 1)), tension, np.zeros(n, int), np.zeros(n, int), np.zeros(n)
        )

    monkeypatch.setattr(round_trip.equilibria, "equilibria", others)
    rows = [0, 1, 2]
    found = round_trip.stable_poses(robot, wires, x, R, rng)
    assert [pose["commanded"] for pose in found["poses"]] == [False, True, False] and found["stable_found"] == 3
    assert [pose["slack_wires"] for pose in found["poses"]] == [2, 2, 2]
    rows = [0, 2]
    found = round_trip.stable_poses(robot, wires, x, R, rng)
    assert found["stable_found"] == 2 and len(found["poses"]) == 3
    last = found["poses"][2]
    assert last["position_m"] is x and last["commanded"] and not last["stable"] and last["slack_wires"] == 0
    assert np.array_equal(last["rotation_vector_rad"], np.zeros(3))
    for shift, stable in ((0.9, True), (1.1, False)):
        here = SimpleNamespace(found=np.array([True]), position_m=x[None] - [0.0, 0.0, shift * near])
        monkeypatch.setattr(round_trip.forward, "solve_equilibrium", lambda *given, here=here: here)
        assert round_trip.stable_poses(robot, wires, x, R, rng)["commanded_stable"] is stable
    here = SimpleNamespace(found=np.array([False]), position_m=x[None])
    monkeypatch.setattr(round_trip.forward, "solve_equilibrium", lambda *given: here)
    assert round_trip.stable_poses(robot, wires, x, R, rng)["commanded_stable"] is False
    with monkeypatch.context() as patch:
        held: Any = SimpleNamespace(feasible=np.array([True]), zero_m=[0], offset_m=[0])
        patch.setattr(round_trip.inverse, "commands", lambda *given: held)
        patch.setattr(round_trip.inverse, "tensions", lambda *given: np.array([[0.0, -1.0, 2.0, 3.0]]))
        assert round_trip.stable_poses(robot, wires, x, R, rng)["poses"][-1]["slack_wires"] == 2
    weak: Any = SimpleNamespace(feasible=np.array([False]), zero_m=[0], offset_m=[0])
    monkeypatch.setattr(round_trip.inverse, "commands", lambda *given: weak)
    assert round_trip.stable_poses(robot, wires, x, R, rng) == {
        "stable_found": 0,
        "starts": 0,
        "commanded_stable": False,
        "poses": [],
    }


def test_a_drift_is_told_in_millimetres_and_degrees_of_the_draws_that_are_found() -> None:
    """Two draws that move along x and turn about y; one that is lost has no place."""
    distance, turn = np.array([1e-3, 3e-3, 5.0]), np.array([0.01, 0.03, 1.0])
    one = at(distance, turn)
    one.rotation[2, 1] = NAN
    held: Any = Course(
        one.times_s, one.position_m, one.rotation, np.ones((3, 2, 4)) * 7.0, np.array([[0, 0], [0, 0], [0, 1]]), None
    )  # type: ignore[arg-type]
    found = answer._drift(held, HERE, TURNED)
    assert found["solved"] == pytest.approx(2 / 3) and found["times_s"].tolist() == [0.0, 60.0]
    np.testing.assert_allclose(found["displacement_mm"]["mean"], [[0.0] * 3, [2.0, 0.0, 0.0]], atol=1e-9)
    np.testing.assert_allclose(found["distance_mm"]["q50"], [0.0, 2.0], atol=1e-9)
    assert found["distance_mm"]["sd"][1] == pytest.approx(1.0)
    vertical = np.degrees(np.arccos(one.rotation[:2, 1, 2, 2]))
    turned = np.degrees(0.02)
    for name, degrees in (("tilt_deg", turned), ("rotation_deg", turned), ("from_vertical_deg", vertical.mean())):
        assert found[name]["mean"][1] == pytest.approx(degrees, rel=1e-6)
    assert found["tilt_deg"]["mean"][0] == pytest.approx(0.0, abs=1e-6)
    assert found["tension_N"]["mean"].tolist() == [[7.0] * 4] * 2


def test_a_pose_that_no_tensions_hold_is_answered_with_the_reason(hung: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, line, request = hung
    far = PoseRequest(np.array([50.0, 0.0, 1.0]), np.eye(3), request.times_s)
    found = answer.pose_report(robot, line, far)
    assert found.content["feasible"] is False and found.courses == {} and found.maps == ()
    assert found.content["sentence"] == "No tensions within the bounds hold the platform at this pose."
    assert found.content["pose"]["position_m"] is far.position_m and "inverse" not in found.content
    assert found.content["tension_distribution"]["lowest_N"] == robot.rule.lowest_N
    monkeypatch.setattr(answer.statics.Geometry, "clear", property(lambda shape: np.array([False])))
    inside = answer.pose_report(robot, line, far).content["sentence"]
    assert (
        inside == "A platform point lies on an exit point, inside a pulley or on its swivel axis: no wire runs there."
    )


def test_an_emptied_drum_is_named_with_its_wire(monkeypatch: pytest.MonkeyPatch) -> None:
    known: Any = SimpleNamespace(wire_m=np.array([5.0, 7.5, 9.0]))
    monkeypatch.setattr(answer.drums, "emptied", lambda drums, joint: [1])
    text = "wire 2 is longer here than its drum's wire_length_m, 7.5 m"
    assert answer._emptied(known, np.zeros((2, 3))) == [Notice("geometry", text)]


def test_what_leaves_the_tests_is_said_of_the_whole_request(monkeypatch: pytest.MonkeyPatch) -> None:
    """Of its longest time, of all draws' lengths, of what sags, and of drums in the draws that hold the pose."""
    asked: list[Any] = []

    def tested(robot: Any, line: Any, tension: Any, longest_s: float, zero: Any) -> list[str]:
        asked.append((tension.tolist(), longest_s, zero.tolist()))
        return ["line"]

    def sagging(robot: Any, position: Any, turn: Any, tension: Any) -> list[str]:
        asked.append((position, tension.tolist()))
        return ["sag"]

    def emptied(known: Any, joint: Any) -> list[int]:
        asked.append(joint.tolist())
        return [0]

    monkeypatch.setattr(answer.wire_doubts, "wire_warnings", tested)
    monkeypatch.setattr(answer.sag, "sag_warnings", sagging)
    monkeypatch.setattr(answer.plausible, "pose_notices", lambda robot, position_m, rotation: ["short"])
    monkeypatch.setattr(answer.drums, "emptied", emptied)
    request = PoseRequest(np.zeros(3), np.eye(3), np.array([0.0, 10.0, 90.0]))
    commands: Any = SimpleNamespace(
        zero_m=np.ones((2, 1)), joint_m=np.array([[1.0], [2.0]]), feasible=np.array([False, True])
    )
    tension = np.array([[5.0]])
    of_wires = ["line", "sag", "short"]
    for known, words in ((None, of_wires), (SimpleNamespace(wire_m=np.array([4.0])), [*of_wires, None])):
        asked.clear()
        robot: Any = SimpleNamespace(drums=known)
        held = answer._Held(robot, None, None, request, commands, tension)  # type: ignore[arg-type]
        found = answer._untested(held)
        assert found[:3] == of_wires and len(found) == len(words)
        assert asked[:2] == [([[5.0]], 90.0, [[1.0], [1.0]]), (request.position_m, [5.0])]
        assert asked[2:] == ([] if known is None else [[[2.0]]])


def test_a_report_says_how_far_its_parts_have_come(hung: Any) -> None:
    robot, line, request = hung
    said: dict[str, list[float]] = {}

    def note(name: str, done: float, total: float) -> None:
        said.setdefault(name, []).append(done / total)

    answer.pose_report(robot, line, request, progress=note)
    assert list(said) == ["drift", "pose error", "time between calibrations", "workspace"]
    for shares in said.values():
        assert shares == sorted(shares) and shares[-1] == pytest.approx(1.0)
    # a part for each spread and time; another for each controller; the workspace begins and ends
    assert (len(said["drift"]), len(said["pose error"]), len(said["workspace"])) == (4, 8, 2)
    assert len(said["time between calibrations"]) > 8


def test_times_on_a_page_are_in_the_unit_in_which_they_are_read() -> None:
    kept: Any = {"longest_time_within_s": 1e5, "still_within_at_the_end": True}
    lost: Any = {"longest_time_within_s": 177.8, "still_within_at_the_end": False}
    assert [pose_page._longest_time(kept), pose_page._longest_time(lost)] == ["more than 27.8 h", "2.96 min"]
    bands = {"q05": [0.0, 0.1], "q50": [0.0, 0.2], "q95": [0.0, 0.3]}
    drifted: Any = {"specimen_spread": 0.05, "times_s": [0.0, 3600.0], "distance_mm": bands}
    assert [row[:2] for row in pose_page._drifted(drifted, False)] == [["5 %", "1 h"]]


@pytest.mark.parametrize(
    ("low", "high", "text"),
    [
        (-1.18e-8, 1.18e-8, "−0.000001 to 0.000001"),  # across the plane of a plotter
        (-21.8766, -19.6341, "−21.88 to −19.63"),
        (0.12391, 0.21779, "0.1239 to 0.2178"),
    ],
)
def test_what_is_proved_is_rounded_outward_and_no_finer_than_a_nanometre(low, high, text):
    assert pose_page._outward(low, high) == text
