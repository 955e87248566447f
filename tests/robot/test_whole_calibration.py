"""Calibration of whole robots from the command line: anchors unknown, poses unknown, lengths alone."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import norm, t

from tests.robot.lines import CORE, line_about
from tests.robot.test_commands import fitted, session_csv  # noqa: F401
from wirebayes.cli import main
from wirebayes.io.run_folder import read_json
from wirebayes.progress import silent
from wirebayes.robot.mechanics import schema
from wirebayes.robot.self_calibration import descent, estimate, search, summary
from wirebayes.robot.self_calibration.equations import Holds, State
from wirebayes.robot.self_calibration.unknowns import StatedErrors


def test_rows_without_a_pose_and_unknown_anchors_are_estimated(fitted, session_csv, tmp_path):  # noqa: F811
    file, truth = session_csv
    _without_poses(file)
    found = _calibrated(file, fitted, tmp_path / "out", "--next-poses", "2")
    assert _near(found["zero_tension_lengths_m"], truth)
    exits = found["exit_points_m"]
    assert _near(exits, schema.read_robot_file("linear-7").exit_m)
    assert len(found["next_positions_m"]) == 2
    np.testing.assert_allclose(schema.read_robot_file(tmp_path / "out/robot.toml").exit_m, exits["mean"], atol=1e-6)


@pytest.mark.parametrize(("wires", "holds"), [([3], [2]), ([3], [1, 2, 3, 4]), ([1, 6], [1, 3])])
def test_what_one_sensor_did_not_read_costs_no_other_reading(fitted, session_csv, tmp_path, wires, holds):  # noqa: F811
    """A dead sensor, or one that fails now and then: its wire is known less well, and better than without the holds."""
    file, truth = session_csv
    whole_sd = _lengths(file, fitted, tmp_path / "whole", truth)
    lines = [line.split(",") for line in file.read_text().splitlines()]
    first = lines[0].index("tension_1_N")

    def without(cells):
        rows = [list(line) for line in lines]
        for hold in holds:
            for cell in cells:
                rows[1 + hold][first + cell] = ""
        file.write_text("\n".join(",".join(row) for row in rows) + "\n")

    without([wire - 1 for wire in wires])
    sd = _lengths(file, fitted, tmp_path / "some", truth)
    missing = [wire - 1 for wire in wires]
    assert (sd[missing] > whole_sd[missing]).all()
    if len(holds) < 4:
        without(range(7))
        fewer = _lengths(file, fitted, tmp_path / "fewer", truth)
        assert (sd[:6] < fewer[:6]).all()  # the seventh wire, which hangs down, is not determined by any of them


def _lengths(session, wires, out, truth):
    """Standard errors of the lengths of linear-7, which are found and usable."""
    arguments = ["calibrate", "linear-7", str(session), "--wires", str(wires), "--draws", "40", "--next-poses", "0"]
    assert main([*arguments, "--output", str(out)]) == 0
    found = read_json(out / "calibration.json")
    assert found["usable"]
    length = found["with_creep_model"]["length_m"]
    assert _near(length, truth)
    return np.array(length["sd"])


def test_intervals_rest_on_as_many_degrees_of_freedom_as_follow_the_joint_error():
    sd = np.array([1.0, 1.0, 1.0, 0.0])
    wider = sd * summary._FACTOR ** np.array([1.0, 0.5, 0.0, 0.0])
    half = summary._half(sd, wider, 3.0)
    np.testing.assert_allclose(half, [t.ppf(0.95, 3), t.ppf(0.95, 12), norm.ppf(0.95), norm.ppf(0.95)], rtol=1e-5)


def test_no_quantity_follows_the_joint_error_more_than_in_proportion():
    """Where equations are nearly singular, rounding may say so: an interval was then longer than the Earth."""
    sd = np.ones(2)
    wider = summary._FACTOR ** np.array([-4.0, 3.0])
    np.testing.assert_allclose(summary._half(sd, wider, 1.0), [norm.ppf(0.95), t.ppf(0.95, 1)], rtol=1e-5)


def test_equations_that_are_singular_without_damping_are_damped(fitted, session_csv, tmp_path, monkeypatch):  # noqa: F811
    """The first step comes out as no numbers: the estimate is found a step later."""
    file, truth = session_csv
    _without_poses(file)
    made = descent.eliminated
    asked = []

    def singular(e, white, damping):
        normal = made(e, white, damping)
        asked.append(damping)
        return replace(normal, matrix=np.full_like(normal.matrix, np.nan)) if len(asked) == 1 else normal

    monkeypatch.setattr(descent, "eliminated", singular)
    found = _calibrated(file, fitted, tmp_path / "out")
    assert asked[:2] == pytest.approx([1e-6, 1e-5])
    assert _near(found["zero_tension_lengths_m"], truth)


def test_a_search_whose_last_descent_was_cut_short_goes_on(fitted, session_csv, tmp_path, monkeypatch):  # noqa: F811
    """Whatever lay still may only have had too few steps; another descent finds that it had come down."""
    file, truth = session_csv
    _without_poses(file)
    made, searches = estimate._Search._round, []

    def watched(search):
        if search not in searches:
            searches.append(search)
        return made(search)

    monkeypatch.setattr(estimate._Search, "_round", watched)
    _calibrated(file, fitted, tmp_path / "whole", "--next-poses", "0")
    last = len(searches[0].rounds)
    searches.clear()

    def cut_short(search):
        found = watched(search)
        if search is not searches[0] or len(search.rounds) != last:
            return found
        search.came_down = False
        return replace(found, converged=False)

    monkeypatch.setattr(estimate._Search, "_round", cut_short)
    found = _calibrated(file, fitted, tmp_path / "cut", "--next-poses", "0")
    assert len(searches[0].rounds) > last
    assert _near(found["zero_tension_lengths_m"], truth)


def _calibrated(session, wires, out, *options):
    """What is found of linear-7 with unknown anchors; it is usable."""
    arguments = ["calibrate", "linear-7", str(session), "--wires", str(wires), "--draws", "40", "--anchor-sd", "0.5"]
    assert main([*arguments, *options, "--output", str(out)]) == 0
    found = read_json(out / "calibration.json")
    assert found["usable"]
    return found


def _near(found, truth):
    return (np.abs(np.array(found["mean"]) - truth) < 4 * np.array(found["sd"])).all()


def _without_poses(session):
    """Take the poses out of a session's file."""
    lines = [line.split(",") for line in session.read_text().splitlines()]
    for cells in lines[1:]:
        cells[1:7] = [""] * 6
    session.write_text("\n".join(",".join(cells) for cells in lines) + "\n")


@pytest.mark.parametrize("shown", [6.6, 2.5])
def test_a_noise_goes_at_most_twice_as_far_as_what_is_shown(shown):
    before = (np.log([0.3e-3, 1e-5]), np.log([1.0e-3, 1e-5]))
    last = (np.log([1.0e-3, 1e-5]), np.log([1e-3 * shown, 1e-5]))  # shown grows faster, or nearly as fast, than thought
    joint, balance = np.exp(estimate._ahead([before, last]))
    assert (1 - 1e-9) * shown <= 1e3 * joint <= 2 * shown * (1 + 1e-9)
    assert balance == pytest.approx(1e-5)


@pytest.mark.parametrize(
    ("found", "other", "requested"), [(True, False, False), (True, True, True), (False, False, True)]
)
def test_an_answer_is_not_given_up_for_a_search_without_one(monkeypatch, found, other, requested):
    state = State(np.zeros(2), np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 4)))
    session = SimpleNamespace(position_m=np.zeros((1, 3)), without_poses=lambda: "blind")
    holds = Holds(session, np.ones((1, 4)))
    given, blind = (SimpleNamespace(unknowns=None, state=state, converged=one) for one in (found, other))
    monkeypatch.setattr(search, "estimate", lambda *arguments: blind)
    for rule in ("_steadier", "_closer"):
        monkeypatch.setattr(search, rule, lambda *arguments: False)
    answer = search._rather_requests(given, holds, True, True, silent)
    assert answer[0] is (blind if requested else given)
    assert answer[2] is requested


def test_poses_that_are_kept_say_how_much_nearer_the_joint_values_are_without_them(monkeypatch):
    state = State(np.zeros(2), np.zeros((1, 3)), np.eye(3)[None], np.ones((1, 4)))
    session = SimpleNamespace(position_m=np.zeros((1, 3)), without_poses=lambda: "blind")
    holds = Holds(session, np.ones((1, 4)))
    unknowns = SimpleNamespace(errors=StatedErrors(joint_m=None))
    given, blind = (
        SimpleNamespace(unknowns=unknowns, state=state, converged=True, noise=SimpleNamespace(joint_m=joint_m))
        for joint_m in (0.7e-3, 0.2e-3)
    )
    monkeypatch.setattr(search, "estimate", lambda *arguments: blind)
    for rule in ("_steadier", "_closer"):
        monkeypatch.setattr(search, rule, lambda *arguments: False)
    answer = search._rather_requests(given, holds, False, True, silent)
    assert answer.found is given and not answer.requested
    assert answer.closer == pytest.approx(3.5)
    undoubted = search._rather_requests(given, holds, False, False, silent)
    assert undoubted.closer == 1.0


@pytest.mark.parametrize(
    ("usable", "longest_s", "said"), [(True, 120.0, []), (True, 600.0, ["extrapolation"]), (False, 600.0, [])]
)
def test_a_calibration_that_may_be_used_says_where_it_leaves_what_was_tested(usable, longest_s, said):
    robot = schema.read_robot_file("hangprinter-4")
    tested = replace(line_about(CORE, 0.05, 40), tension_range_N=(1.0, 4.0), time_range_s=(0.0, 120.0))
    ones = summary.Moment(np.ones(4), np.ones(4), np.ones(4))
    found = summary.Summary(*(ones for _ in range(9)), strain=np.zeros(4))
    notices = summary.wire_notices(robot, tested, np.array([60.0, longest_s]), found, usable)
    assert [notice.kind for notice in notices] == said
