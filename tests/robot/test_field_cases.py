"""Robots, logs and mistakes of builders, from the command line: ``field/`` holds what they gave.

Expected numbers are those of least squares, energy minimisers and laboratories that are not part of this project.
"""

from pathlib import Path

import numpy as np
import pytest

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from wirebayes.cli import main
from wirebayes.io.run_folder import read_json
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.rotation import matrix, vector
from wirebayes.robot.motion import hanging, inverse
from wirebayes.robot.pose.orientation import balanced_orientation

FIELD = Path(__file__).parent / "field"
ANCHORS = FIELD / "calibrate-wrong-anchors"


@pytest.fixture
def run(fitted, tmp_path, capsys):  # noqa: F811
    """Run a command; its exit code, what it printed, and the content of its JSON if it wrote one."""

    def command(*arguments):
        out = tmp_path / "out"
        code = main([*map(str, arguments), "--wires", str(fitted), "--output", str(out)])
        said = capsys.readouterr()
        found = {
            name: read_json(out / f"{name}.json")
            for name in ("pose", "calibration")
            if (out / f"{name}.json").is_file()
        }
        return code, said.out + said.err, next(iter(found.values()), None), out

    return command


def _calibrate(run, robot, session, *options):
    return run("calibrate", robot, session, "--next-poses", "1", *options)


@pytest.mark.slow
def test_exact_anchors_give_the_lengths(run):
    code, said, found, _ = _calibrate(run, ANCHORS / "hp4.toml", ANCHORS / "t1-0.csv", "--tension-sd", "0.5")
    assert code == 0 and found["usable"] and not found["warnings"]
    off = 1e3 * np.array(found["references_m"]["mean"]) - [-1.41, -3.34, -5.28, -1.95]
    assert (np.abs(off) < 4 * 1e3 * np.array(found["references_m"]["sd"])).all()
    assert "set the lengths" in said


@pytest.mark.parametrize("session", ["t1-0.002.csv", pytest.param("t1-0.010.csv", marks=pytest.mark.slow)])
def test_anchors_that_are_off_and_held_exact_are_not_usable(run, session):
    code, said, found, _ = _calibrate(run, ANCHORS / "hp4.toml", ANCHORS / session, "--tension-sd", "0.5")
    assert code == 0 and not found["usable"]
    assert "misfit" in {one["kind"] for one in found["warnings"]}
    assert "warning:" in said and "set the lengths" not in said


@pytest.mark.parametrize(
    ("session", "off"), [("t1-0.002.csv", "2"), pytest.param("t1-0.010.csv", "10", marks=pytest.mark.slow)]
)
def test_anchors_with_their_error_stated_give_lengths_that_hold_the_truth(run, session, off):
    options = ("--tension-sd", "0.5", "--anchor-sd", off)
    _, _, found, _ = _calibrate(run, ANCHORS / "hp4.toml", ANCHORS / session, *options)
    assert found["usable"]
    wrong = 1e3 * np.array(found["references_m"]["mean"]) - [-1.41, -3.34, -5.28, -1.95]
    assert (np.abs(wrong) < 3 * 1e3 * np.array(found["references_m"]["sd"])).all()


@pytest.mark.slow
def test_no_sensor_is_blamed_for_anchors_that_are_off_by_more_than_is_stated(run):
    """Errors of sensors would restore the balance, and leave joint values that contradict it."""
    options = ("--tension-sd", "0.5", "--anchor-sd", "3")  # off by 10 mm
    _, said, found, _ = _calibrate(run, ANCHORS / "hp4.toml", ANCHORS / "t1-0.010.csv", *options)
    assert not found["usable"] and found["sensors_at_fault"] is None
    assert "tension sensor" not in said


@pytest.mark.slow
def test_a_real_printers_anchors_agree_with_an_independent_least_squares(run):
    options = ("--tension-sd", "5", "--reference-sd", "50", "--anchor-sd", "50")
    _, _, found, _ = _calibrate(run, ANCHORS / "hp4-rough.toml", ANCHORS / "hp-session.csv", *options)
    theirs = [[16.8, -1570.6, -108.6], [1298.2, 1238.1, -161.8], [-1404.1, 738.8, -150.8], [21.3, -0.5, 2354.0]]
    exits = found["exit_points_m"]
    off = np.abs(1e3 * np.array(exits["mean"]) - theirs) / (1e3 * np.array(exits["sd"]))
    assert off.max() < 5  # their references were exact: part of the difference
    assert found["length_rms_mm"] < 0.64
    # tensions that motors report contradict the balance: those of the wire from above, by some 16 N
    assert not found["usable"]
    assert found["sensors_at_fault"]["wires"] == [4]
    assert found["sensors_at_fault"]["bias_N"]["mean"][0] == pytest.approx(16, abs=3)


@pytest.mark.slow
def test_a_file_that_knows_its_anchors_better_than_is_stated_is_told_from_a_search_without_an_end(run):
    session = FIELD / "lengths-only" / "hp-session-unknown.csv"
    options = ("--tension-sd", "5", "--reference-sd", "50", "--anchor-sd", "50")
    _, _, found, _ = _calibrate(run, ANCHORS / "hp4.toml", session, *options)
    assert found["with_creep_model"]["converged"] and not found["usable"]
    assert found["sensors_at_fault"]["wires"] == [4]
    said = " ".join(one["text"] for one in found["warnings"])
    assert "nearer to the robot's file than their stated errors allow" in said
    sd = 1e3 * np.array(found["exit_points_m"]["sd"])
    theirs = [[16.8, -1570.6, -108.6], [1298.2, 1238.1, -161.8], [-1404.1, 738.8, -150.8], [21.3, -0.5, 2354.0]]
    assert (np.abs(1e3 * np.array(found["exit_points_m"]["mean"]) - theirs) < 5 * sd).all()


def test_lengths_alone_are_an_answer_that_says_what_it_does_not_know(run):
    session = FIELD / "lengths-only" / "t1-notension.csv"
    code, _, found, _ = _calibrate(run, ANCHORS / "hp4.toml", session, "--anchor-sd", "2")
    assert code == 0
    assert found["identified"]["not_determined"]
    sd = 1e3 * np.array(found["references_m"]["sd"])
    assert (np.abs(1e3 * np.array(found["references_m"]["mean"]) - [-1.41, -3.34, -5.28, -1.95]) < 3 * sd).all()


def test_millimetres_are_refused(run):
    code, said, found, _ = run("calibrate", ANCHORS / "hp4.toml", FIELD / "calibrate-mm" / "t1-inmm.csv")
    assert code == 2 and found is None
    assert "(joint_1_m): found '3164.85', expected metres" in said


def test_a_home_pose_that_nothing_holds_has_no_joint_values(run):
    code, _, found, out = _calibrate(
        run, FIELD / "home-not-held" / "hp4-high.toml", ANCHORS / "t1-0.csv", "--tension-sd", "0.5"
    )
    assert code == 0
    np.testing.assert_allclose(found["zero_tension_lengths_m"]["mean"], [3.08433, 4.68322, 4.17467, 6.02385], atol=2e-5)
    assert found["joint_values_for_home_m"] is None
    assert "No tensions" in (out / "report.html").read_text()


def test_a_home_that_balance_turns_is_said_and_a_trajectory_goes_on_from_its_calibrated_robot(run, tmp_path):
    folder = FIELD / "balanced-home"
    options = ("--tension-sd", "0.05", "--anchor-sd", "5", "--draws", "10")
    _, said, found, out = _calibrate(run, folder / "cube4.toml", folder / "session.csv", *options)
    assert found["usable"] and "write [0.1578, -0.2825, " in said
    assert sum("hangs 18.5 degrees away" in one["text"] for one in found["warnings"]) == 1
    path, calibrated = tmp_path / "path.csv", out.rename(tmp_path / "calibrated")
    path.write_text("time_s,x_m,y_m,z_m\n0,0.5,0.3,2.0\n60,0.3,0.3,2.0\n")
    options = ("--trajectory", path, "--calibration", calibrated, "--draws", "4")
    code, said, _, _ = run("pose", calibrated / "robot.toml", *options)
    assert code == 0, said


def test_straight_lengths_in_place_of_whole_wires_are_refused(run):
    code, said, _, _ = run(
        "pose", "hangprinter-4", "--joints", FIELD / "firmware-lengths-absurd" / "firmware-lengths.csv"
    )
    assert code == 2 and "lines x straight + beyond_exit_m" in said


@pytest.mark.parametrize("robot", ["maslow-flat.toml", "slideprinter.toml"])
def test_belts_in_a_plane_are_told_how_to_say_so_and_held_when_it_is_said(run, tmp_path, robot):
    file = FIELD / "flat-robots" / robot
    _, said, found, _ = run("pose", file)
    assert not found["feasible"] and "Next: [plane]" in said
    assert "bounds of the tension" not in said
    flat = schema.parse(file.read_text() + "\n[plane]\nnormal = [0.0, 0.0, 1.0]\n", str(file))
    tau = inverse.tensions(flat, flat.home_m[None], np.eye(3)[None])[0]
    pull = (flat.exit_m - flat.home_m) / np.linalg.norm(flat.exit_m - flat.home_m, axis=1)[:, None] * tau[:, None]
    np.testing.assert_allclose(pull.sum(0)[:2], 0.0, atol=1e-9)
    assert tau.min() >= flat.rule.lowest_N - 1e-9


def test_klipper_counts_straight_millimetres_a_turn(run):
    code, _, _, out = run("export", FIELD / "klipper-rotation-distance" / "hp4-drum.toml")
    assert code == 0
    said = [
        line.split(":")[-1].split("=")[-1].split("#")[0].strip()
        for line in (out / "klipper.cfg").read_text().splitlines()
        if line.lstrip("# ").startswith("rotation_distance")
    ]
    assert [float(value) for value in said[:4]] == pytest.approx([233.735] * 3 + [113.412], rel=1e-5)
    assert "winch_buildup_factor" in (out / "klipper.cfg").read_text()


HUNG = [
    ("ua.toml", (0.4, 0.4, 1.2), (0.0838011713, -0.0907009208, 0.0008751281), (118.53, 170.71, 115.62, 82.84)),
    ("hw4.toml", (0.3, 0.2, 1.0), (0.20528, -0.33865, -0.00178), (0.547, 0.337, 0.268, 0.400)),
    ("cube4-off.toml", None, (0.16321, -0.28541, -0.00057), (2.804, 3.576, 5.089, 4.180)),
    ("mural2-off.toml", None, (0.0, 0.25961, 0.0), (5.267, 3.040)),
]


@pytest.mark.parametrize(("file", "position", "turn", "tension"), HUNG)
def test_robots_of_few_wires_hang_as_an_energy_minimiser_has_them(file, position, turn, tension):
    robot = schema.read_robot_file(FIELD / "under-actuated" / file)
    x = np.array(robot.home_m if position is None else position)
    asked = np.array([np.nan, np.nan, turn[2]]) if robot.legs == 4 else np.full(3, np.nan)
    found = balanced_orientation(robot, x, asked)
    R = found.rotation
    assert not found.sentence and not found.refused
    np.testing.assert_allclose(vector(R[None])[0], turn, atol=1e-4)  # theirs is rounded to five digits, the turn too
    near = np.where(np.isfinite(asked), asked, 0.0)
    held = hanging.hang(robot, x[None], matrix(near), asked).tension_N[0]
    np.testing.assert_allclose(held, tension, rtol=2e-3)


@pytest.mark.slow
def test_a_log_on_stiff_wires_is_where_another_solver_has_it(run):
    folder = FIELD / "stiff-log-hang"
    where = ("--position=0.367,0.365,1.165", "--rotation=0.085,-0.09,0", "--draws", "4")
    code, _, found, _ = run("pose", folder / "ua.toml", "--joints", folder / "ua-j2.csv", *where)
    assert code == 0
    np.testing.assert_allclose(found["position_m"]["mean"][0], [0.35547, 0.35857, 1.16768], atol=2e-5)


@pytest.mark.slow
def test_wires_at_exactly_no_tension_hold_a_stable_pose(run):
    robot = FIELD / "zero-tension-stable" / "IPAnema_2.toml"
    code, _, found, _ = run("pose", robot, "--draws", "4", "--times", "0,60")
    assert code == 0
    assert found["forward"]["solved"] == 1.0
    assert found["forward"]["statuses"]["stable equilibrium"] == 4
    assert found["equilibria"]["commanded_stable"]
    assert not {"unheld", "fall"} & {one["kind"] for one in found["warnings"]}
