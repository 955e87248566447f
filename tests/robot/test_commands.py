import json
from pathlib import Path

import numpy as np
import pytest

from tests.robot.cases import session_header
from wirebayes.cli import main
from wirebayes.io.run_folder import read_json
from wirebayes.model.sample import Sample
from wirebayes.results.read_back import Stored
from wirebayes.robot.mechanics import schema
from wirebayes.wire.model import Model
from wirebayes.wire.protocol import Protocol

DOCS = Path(__file__).parents[2] / "docs" / "example"
# mm: a tolerance that is left at once, where it is not asked for how long a pose is within it, which is a large part of
# the work.
AT_ONCE = 1e-6
BRIEFLY = ["--times", "0,60", "--tolerance", str(AT_ONCE)]
PROTOCOL = Protocol(
    length_mm=1000.0,
    setting=np.array([1.0, 13.0]),
    time_s=np.tile([0.0, 120.0], (2, 1)),
    mask=np.ones((2, 2), bool),
    duration_s=np.full(2, 120.0),
    number=np.arange(1, 3),
)


@pytest.fixture
def fitted(tmp_path, monkeypatch):
    """A folder whose posterior is made up: the commands see what a fit would have stored."""
    rng = np.random.default_rng(3)
    means = {"k1": 803, "B": 0.31, "U": 1.0, "k2": 0.03, "N": 0.64, "preload": -0.1, "sensor_sd": 0.01}
    stored = Stored(
        {k: m * np.exp(0.03 * rng.standard_normal(80)) for k, m in means.items()},
        Sample("made-up", "made up", PROTOCOL, np.array([[0.85, 0.8], [7.65, 7.3]])[..., None], 0.01, Model()),
        "chain",
    )
    monkeypatch.setattr(
        "wirebayes.results.read_back.load_posterior", lambda folder, experiment=None, own_effects=None: stored
    )
    folder = tmp_path / "fit"
    folder.mkdir()
    (folder / "posterior.nc").write_bytes(b"made up")
    return folder


def test_pose_answers_and_repeats_to_the_byte(fitted, tmp_path, capsys):
    out = [tmp_path / "a", tmp_path / "b"]
    for folder in out:
        arguments = ["pose", "linear-6", "--wires", str(fitted), "--output", str(folder), *BRIEFLY]
        assert main([*arguments, "--seed", "4"]) == 0
    assert "60" not in capsys.readouterr().err  # within the tested time: no warning about it
    first, second = ((folder / "pose.json").read_bytes() for folder in out)
    assert first == second
    pose = json.loads(first)
    assert pose["feasible"]
    assert pose["forward"]["solved"] == 1.0
    assert pose["forward"]["largest_round_trip_error_m"] < 1e-9
    assert [d["specimen_spread"] for d in pose["drift"]] == [0.0, 0.05]
    for entry in pose["drift"]:
        low, mid, high = (entry["distance_mm"][q][-1] for q in ("q05", "q50", "q95"))
        assert 0 < low < mid < high
    assert sum(pose["variance_shares"]["shared_draw"].values()) == pytest.approx(1.0)
    hooke, aware = (
        next(e for e in pose["pose_error"] if e["controller"] == c and e["specimen_spread"] == 0)["distance_mm"]["q50"]
        for c in ("hooke_only", "creep_aware")
    )
    assert aware[-1] < 0.6 * hooke[-1]
    assert {(r["loaded_before_s"], r["controller"]) for r in pose["between_calibrations"]} == {
        (loaded, controller) for loaded in (0.0, 3600.0) for controller in ("held_still", "creep_aware")
    }
    assert 0 < pose["workspace"]["q05_drift_mm"] < pose["workspace"]["q95_drift_mm"]
    assert {path.stem for path in out[0].glob("*.svg")} == {
        "robot",
        "drift",
        "rotation",
        "pose-error",
        "error-budget",
        "workspace-drift",
        "workspace-tilt",
    }
    if pose["certificate"]["proved"] is not None:
        band = pose["certificate"]["band"]
        drifted = pose["drift"][0]["displacement_mm"]["q50"][-1]
        assert 0 < band["share"] <= 1
        assert all(a < b < c for a, b, c in zip(band["low_mm"], drifted, band["high_mm"], strict=True))
    assert main(["report", str(out[0])]) == 0
    page = (out[0] / "report.html").read_text()
    assert "Between calibrations" in page
    assert pose["pose_error"][0]["times_s"] == [0.0, 60.0]  # each table has times of its own
    assert "is the last of the requested times (0 s, 1 min) that is within tolerance" in page
    assert "is the last such time on a grid of eight per decade, from 1 s on" in page
    assert (out[0] / "robot.svg").stat().st_size > 1000
    scene = read_json(out[0] / "scene.json")
    assert np.shape(scene["drifted"]) == (len(scene["times"]), len(scene["exits"]), 3)
    assert np.shape(scene["tensions_N"]) == (len(scene["times"]), len(scene["exits"]))
    moved = 1e3 * np.abs(np.subtract(scene["drifted"], scene["platform"])).max(axis=(1, 2))
    assert moved[0] < moved[-1]
    assert 'class="view"' in page


def test_a_pose_that_cannot_be_held_is_an_answer(fitted, tmp_path, capsys):
    out = tmp_path / "far"
    arguments = ["pose", "linear-6", "--wires", str(fitted), "--output", str(out), "--position", "5,0,0.6"]
    assert main(arguments) == 0
    pose = read_json(out / "pose.json")
    assert not pose["feasible"]
    (warning,) = pose["warnings"]
    assert warning["kind"] == "unheld" and warning["text"] in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["no-such-robot"], "no-such-robot"),
        (["linear-6", "--position", "1,2"], "--position"),
        (["linear-6", "--position", "1,2,nan"], "--position"),
        (["linear-6", "--times", "60,0"], "--times"),
        (["linear-6", "--times", "a"], "--times"),
        (["linear-6", "--tolerance", "0"], "--tolerance"),
        (["linear-6", "--tolerance-tilt", "nan"], "--tolerance-tilt"),
        (["linear-6", "--specimen-spread", "0"], "found 0, expected a number above 0 and below 1, 0.05 for 5 %"),
        (["linear-6", "--specimen-spread", "1"], "found 1, expected a number above 0 and below 1, 0.05 for 5 %"),
        (["linear-6", "--specimen-spread", "nan"], "found nan"),
    ],
)
def test_bad_input_is_one_plain_line_and_writes_nothing(fitted, tmp_path, capsys, arguments, message):
    out = tmp_path / "out"
    assert main(["pose", *arguments, "--wires", str(fitted), "--output", str(out)]) == 2
    line = capsys.readouterr().err.strip()
    assert message in line
    assert "\n" not in line
    assert not out.exists()


@pytest.mark.parametrize("leg", [0, 3])
def test_a_platform_point_on_an_exit_point_is_no_pose(leg, fitted, tmp_path, capsys):
    robot = schema.read_robot_file("linear-6")
    there = ",".join(map(str, robot.exit_m[leg] - robot.platform_m[leg]))
    assert (
        main(["pose", "linear-6", f"--position={there}", "--wires", str(fitted), "--output", str(tmp_path / "out")])
        == 0
    )
    shown = capsys.readouterr()
    assert "A platform point lies on an exit point" in shown.out
    assert "Next: another pose or payload" in shown.out and "calibrate" not in shown.out
    assert read_json(tmp_path / "out" / "pose.json")["feasible"] is False


def test_a_folder_without_a_posterior_is_refused(tmp_path, capsys):
    assert main(["pose", "linear-6", "--wires", str(tmp_path), "--output", str(tmp_path / "o")]) == 2
    assert "posterior.nc" in capsys.readouterr().err
    deeper = [tmp_path / name / "final" for name in ("one", "two")]  # of two lines: one alone would be taken
    for folder in deeper:
        folder.mkdir(parents=True)
        (folder / "posterior.nc").write_text("")
    assert main(["pose", "linear-6", "--wires", str(tmp_path), "--output", str(tmp_path / "o")]) == 2
    assert f"expected one of {deeper[0]}, {deeper[1]}" in capsys.readouterr().err
    (tmp_path / "posterior.nc").write_text("not netcdf")
    assert main(["pose", "linear-6", "--wires", str(tmp_path), "--output", str(tmp_path / "o")]) == 2
    assert "posterior.nc" in capsys.readouterr().err


@pytest.mark.parametrize("command", [["pose", "linear-6"], ["export", "hangprinter-4"]])
def test_a_fit_hold_by_hold_is_refused_for_it_leaves_k1_open(fitted, tmp_path, monkeypatch, capsys, command):
    from dataclasses import replace

    from wirebayes.results import read_back

    stored = replace(read_back.load_posterior(fitted), likelihood="hold")
    monkeypatch.setattr(
        "wirebayes.results.read_back.load_posterior", lambda folder, experiment=None, own_effects=None: stored
    )
    assert main([*command, "--wires", str(fitted), "--output", str(tmp_path / "o")]) == 2
    line = capsys.readouterr().err.strip()
    assert "does not determine the stiffness k1" in line
    assert "\n" not in line
    assert not (tmp_path / "o").exists()


PLOTTER = """version = 1
name = "plotter"
description = "two wires in a vertical plane"
source = "made up"
freedom = "position"
[platform]
mass_kg = 0.4
[tension]
choice = "minimum_norm"
lowest_N = 0.1
highest_N = 60.0
[pose]
position_m = [0.0, 0.0, 0.6]
[workspace]
lower_m = [-0.4, 0.0, 0.3]
upper_m = [0.4, 0.0, 0.9]
"""
CORNERS = ((-0.6, 1.4), (0.6, 1.4), (-0.6, 0.0), (0.6, 0.0))


@pytest.mark.parametrize("legs", [2, 4])
def test_a_robot_in_a_vertical_plane_is_a_robot(fitted, tmp_path, legs):
    text = PLOTTER.replace("lowest_N = 0.1", "lowest_N = 1.0") if legs == 4 else PLOTTER
    for x, z in CORNERS[:legs]:
        text += f"[[leg]]\nexit_point_m = [{x}, 0.0, {z}]\nplatform_point_m = [0.0, 0.0, 0.0]\n"
    file, out = tmp_path / "plotter.toml", tmp_path / "out"
    file.write_text(text)
    assert main(["pose", str(file), "--wires", str(fitted), "--output", str(out), *BRIEFLY]) == 0
    content = read_json(out / "pose.json")
    assert content["forward"]["solved"] == 1.0
    assert [p["commanded"] for p in content["equilibria"]["poses"]] == [True]
    assert content["workspace"]["feasible"] == 1.0
    assert (out / "workspace-drift.svg").is_file()
    assert not (out / "rotation.svg").exists()  # parallel lines: nothing turns
    assert main(["report", str(out)]) == 0


@pytest.mark.parametrize(("apart_m", "code"), [(0.0, 2), (0.01, 0)])
def test_wires_that_all_leave_from_one_point_are_no_robot(fitted, tmp_path, capsys, apart_m, code):
    file, out = tmp_path / "plotter.toml", tmp_path / "out"
    legs = [f"[[leg]]\nexit_point_m = [{x}, 0.0, 1.4]\nplatform_point_m = [0.0, 0.0, 0.0]\n" for x in (0.0, apart_m)]
    file.write_text(PLOTTER + "".join(legs))
    assert main(["pose", str(file), "--wires", str(fitted), "--output", str(out), *BRIEFLY]) == code
    if code == 2:
        said = capsys.readouterr().err
        assert said.strip().endswith(
            "leg 2, key exit_point_m: found [0.0, 0.0, 1.4] in every leg, expected exit points that lie apart"
        )
        assert not out.exists()


@pytest.fixture
def session_csv(tmp_path):
    """A session on linear-7 whose true reference errors are known, written as the command reads it."""
    from wirebayes.robot.mechanics import draws, rotation, schema
    from wirebayes.robot.motion import inverse
    from wirebayes.robot.self_calibration.predicted import predict_session
    from wirebayes.robot.self_calibration.session import LengthPrior, Session

    robot = schema.read_robot_file("linear-7")
    line = draws.WireDraws(
        {k: np.full(3, v) for k, v in {"k1": 803.0, "B": 0.31, "U": 1.0, "k2": 0.03, "N": 0.64}.items()}, 1000.0
    )
    x = robot.home_m + np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0.05], [-0.1, -0.1, -0.05], [0.05, -0.15, 0.1]])
    R = rotation.matrix(np.zeros((len(x), 3)))
    tau = inverse.tensions(robot, x, R)
    commanded = inverse.commands(robot, draws.for_robot(robot, line.centre()), x, R, tau)
    read = np.arange(len(x)) > 0
    session = Session(x, R, commanded.joint_m, np.full(len(x), 30.0), read, 0.02)
    prior = LengthPrior(line, 5e-3, 1e-6)
    truth = prior.moments(robot.legs)[0][None].copy()
    truth[0, : robot.legs] = 1e-3 * np.array([3, -2, 1, 4, -5, 0, 2])
    real = predict_session(robot, prior, session, truth)
    tension = iter(real.readings.reshape(-1, robot.legs) * 0.02)
    rows = [session_header(robot)]
    for k in range(len(x)):
        cells = [str(v) for v in (k + 1, *x[k], 0, 0, 0, 30.0, *commanded.joint_m[k])]
        rows.append([*cells, *([str(v) for v in next(tension)] if read[k] else [""] * robot.legs)])
    file = tmp_path / "session.csv"
    file.write_text("\n".join(",".join(row) for row in rows) + "\n")
    return file, real.length_m[0]


def test_calibrate_finds_the_lengths(fitted, session_csv, tmp_path):
    file, truth = session_csv
    out = tmp_path / "out"
    assert main(["calibrate", "linear-7", str(file), "--wires", str(fitted), "--output", str(out)]) == 0
    content = read_json(out / "calibration.json")
    found = content["with_creep_model"]
    assert found["converged"]
    assert found["misfit"] < 1
    low, high = np.array(found["length_m"]["q05"]), np.array(found["length_m"]["q95"])
    assert np.mean((low <= truth) & (truth <= high)) > 0.8
    assert np.abs(np.array(found["length_m"]["mean"]) - truth).mean() < 1.5e-3
    assert content["observability"]["of"] == 7
    assert len(content["next_positions_m"]) == 5
    assert main(["report", str(out)]) == 0
    page = (out / "report.html").read_text()
    assert f"{1e3 * found['length_m']['mean'][2]:.2f}" in page
    assert "combinations of lengths" in page


def test_a_calibration_that_does_not_converge_says_so_and_gives_no_joint_values(fitted, tmp_path, capsys, monkeypatch):
    """One hold read, its tensions five times too large: no lengths near their references make these."""
    monkeypatch.setattr("wirebayes.robot.self_calibration.estimate._ROUNDS", 8)  # sixty that lead nowhere take long
    header, unread, read = (DOCS / "linear-7-session.csv").read_text().splitlines()[:3]
    cells = read.split(",")
    wrong = [
        str(5 * float(cell)) if name.startswith("tension_") else cell
        for name, cell in zip(header.split(","), cells, strict=True)
    ]
    file, out = tmp_path / "session.csv", tmp_path / "out"
    file.write_text("\n".join([header, unread, ",".join(wrong)]) + "\n")
    arguments = ["calibrate", "linear-7", str(file), "--wires", str(fitted), "--output", str(out)]
    for _ in range(2):  # a finished folder says it again
        assert main(arguments) == 0
        (line,) = capsys.readouterr().err.splitlines()  # at one hold no sensor is blamed
        assert line.startswith("warning: not converged: do not use these values")
    content = read_json(out / "calibration.json")
    assert not content["with_creep_model"]["converged"]
    assert content["joint_values_for_home_m"] is None and content["pose_now"] is None
    assert main(["report", str(out)]) == 0
    page = (out / "report.html").read_text()
    assert "Not converged" in page and "Joint values that bring" not in page


def test_the_documented_session_is_one():
    from wirebayes.robot.mechanics import schema
    from wirebayes.robot.self_calibration import session_file

    session, readings = session_file.read_session(
        DOCS / "linear-7-session.csv", schema.read_robot_file("linear-7"), 0.02, 1e-3
    )
    assert session.read.tolist() == [False] + [True] * 8
    assert len(readings) == 8 * 7


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("hold,", "holds,", "line 1"),
        (",30.0,", ",-30.0,", "line 2, column 8 (duration_s)"),
        (",30.0,", ",nan,", "line 2, column 8 (duration_s)"),
        (",30.0,", ",", "line 2"),
        ("\n1,", "\n\nx,", "line 3, column 1 (hold)"),  # an empty line counts
        ("\n3,", "\n1,", "line 4, column 1 (hold): found 1 once more, expected a row for each hold"),
    ],
)
def test_a_wrong_session_names_line_and_column(fitted, session_csv, tmp_path, capsys, old, new, message):
    file, _ = session_csv
    text = file.read_text()
    assert old in text
    file.write_text(text.replace(old, new, 1))
    out = tmp_path / "out"
    assert main(["calibrate", "linear-7", str(file), "--wires", str(fitted), "--output", str(out)]) == 2
    line = capsys.readouterr().err.strip()
    assert "session.csv" in line
    assert message in line
    assert "\n" not in line
    assert not out.exists()


def test_a_requested_pose_far_from_where_the_joint_values_lead_causes_a_warning(fitted, session_csv, tmp_path, capsys):
    file, truth = session_csv
    arguments = ["calibrate", "linear-7", str(file), "--wires", str(fitted), "--draws", "20", "--output"]
    assert main([*arguments, str(tmp_path / "good")]) == 0
    capsys.readouterr()
    kinds = {warning["kind"] for warning in read_json(tmp_path / "good" / "calibration.json")["warnings"]}
    assert kinds == {"extrapolation"}  # the robot's wires are longer and pull harder than the one that was tested
    lines = [line.split(",") for line in file.read_text().splitlines()]
    for k, cells in enumerate(lines[1:]):
        cells[0] = str(10 * (k + 1))
    lines[2][1] = "20"  # metres, in x
    lines[4][6] = "2.5"  # radians, about z
    file.write_text("\n".join(",".join(cells) for cells in lines) + "\n")
    assert main([*arguments, str(tmp_path / "odd")]) == 0
    shown = capsys.readouterr().err.splitlines()
    warned = [line for line in shown if "requested pose" in line]
    assert [line.split(":")[1] for line in warned] == [" hold 20", " hold 40"]
    assert "the requested pose is 19.9 m and 0.0" in warned[0]
    assert " m and 2.5 rad from the one that its joint values lead to" in warned[1]
    found = read_json(tmp_path / "odd" / "calibration.json")
    assert found["with_creep_model"]["converged"]
    np.testing.assert_allclose(found["with_creep_model"]["length_m"]["mean"], truth, atol=1e-2)
    assert "Hold 20: the requested pose is 19.9 m" in (tmp_path / "odd" / "report.html").read_text()


def test_a_bias_is_estimated_on_request_and_its_sign_may_follow_the_motion(fitted, session_csv, tmp_path, capsys):
    file, _ = session_csv
    lines = [line.split(",") for line in file.read_text().splitlines()]
    legs = 7
    for k, cells in enumerate(lines[1:]):
        sign = 1 if k % 2 else -1
        if cells[-1]:
            cells[-legs] = str(float(cells[-legs]) + 0.3 * sign)
        cells += [str(sign)] * legs
    lines[0] += [f"motion_{i}" for i in range(1, legs + 1)]
    file.write_text("\n".join(",".join(cells) for cells in lines) + "\n")
    arguments = ["calibrate", "linear-7", str(file), "--wires", str(fitted)]
    assert main([*arguments, "--output", str(tmp_path / "o")]) == 2
    assert "session.csv, line 1: found directions of motion, but the sensors have no bias" in capsys.readouterr().err
    assert main([*arguments, "--tension-bias", "-1", "--output", str(tmp_path / "o")]) == 2
    out = tmp_path / "out"
    assert main([*arguments, "--tension-bias", "0.2", "--output", str(out)]) == 0
    content = read_json(out / "calibration.json")
    assert content["prior"]["tension_bias_sd_N"] == 0.2 and content["prior"]["tension_bias_sign"] == "motion"
    bias = content["with_creep_model"]["tension_bias_N"]
    assert abs(bias["mean"][0] - 0.3) < 2 * bias["sd"][0] < 0.4
    assert main(["report", str(out)]) == 0
    assert "By how much each tension sensor reads too high." in (out / "report.html").read_text()
    assert np.shape(read_json(out / "scene.json")["platform"]) == (7, 3)
    lines[2][-1] = "2"
    file.write_text("\n".join(",".join(cells) for cells in lines) + "\n")
    assert main([*arguments, "--tension-bias", "0.2", "--output", str(tmp_path / "o")]) == 2
    assert "line 3, column 29 (motion_7): found '2', expected 1 (pulled in last)" in capsys.readouterr().err


def test_an_inclinometer_joins_in_and_is_checked(fitted, session_csv, tmp_path, capsys):
    file, truth = session_csv
    lines = file.read_text().splitlines()
    read = [cell != "" for cell in (line.rsplit(",", 1)[1] for line in lines[1:])]
    level = [lines[0] + ",normal_x,normal_y"]
    level += [line + (",0.0,0.0" if here else ",,") for line, here in zip(lines[1:], read, strict=True)]
    file.write_text("\n".join(level) + "\n")
    arguments = ["calibrate", "linear-7", str(file), "--wires", str(fitted), "--next-poses", "0", "--output"]
    assert main([*arguments, str(tmp_path / "out")]) == 0
    file.write_text("\n".join(level).replace(",0.0,0.0\n", ",0.0,1.5\n", 1) + "\n")
    capsys.readouterr()
    assert main([*arguments, str(tmp_path / "o")]) == 2
    assert "(normal_y): found '1.5', expected a component of a unit vector" in capsys.readouterr().err


def test_export_speaks_the_firmwares_units(fitted, tmp_path):
    out = tmp_path / "out"
    assert main(["export", "hangprinter-4", "--wires", str(fitted), "--output", str(out)]) == 0
    code = (out / "reprapfirmware.g").read_text()
    assert "M669 K6 A0.00:-1610.98:-131.53 B1314.22:1268.14:-121.28" in code
    assert "U2:2:2:4" in code
    spring = next(line for line in code.splitlines() if line.startswith("M666 S"))
    value = float(spring.split(" ")[1][1:])
    low, high = (float(word) for word in spring.split("interval ")[1].split(" to "))
    assert low < value < high
    assert 780 < value < 830  # k1 itself, in newtons
    config = (out / "klipper.cfg").read_text()
    assert "anchor_y: -1610.98" in config
    assert f"winch_spring_constant: {value:.0f} " in config
    rows = (out / "creep-table.csv").read_text().splitlines()
    assert rows[0].startswith("tension_N,time_s,mean_mm_per_m")
    assert len(rows) == 17
    first = dict(zip(rows[0].split(","), map(float, rows[1].split(",")), strict=True))
    # eq (5) at 1 N after a minute, made-up wire of 1 m
    assert first["mean_mm_per_m"] == pytest.approx(0.31 * (1 - np.exp(-0.03 * 60**0.64)), rel=0.05)
    assert first["q05_mm_per_m"] < first["q50_mm_per_m"] < first["q95_mm_per_m"]


def test_a_folder_of_other_options_is_refused_by_their_names(fitted, tmp_path, capsys):
    out = str(tmp_path / "out")
    arguments = ["export", "hangprinter-4", "--wires", str(fitted), "--draws", "5", "--output", out]
    assert main(arguments) == 0
    assert main(arguments) == 0
    assert main([*arguments, "--tensions", "1,2"]) == 2
    assert "configuration: --tensions is 1,2,4,8 there, 1,2 here; expected" in capsys.readouterr().err
    pose = ["pose", "linear-7", "--wires", str(fitted), "--draws", "5", "--times", "0,60", "--output", f"{out}-pose"]
    way = tmp_path / "way.csv"
    way.write_text("time_s,x_m,y_m,z_m\n0,0,0,.6\n60,0,0,.6\n")
    assert main([*pose[:-4], "--trajectory", str(way), *pose[-2:]]) == 0
    assert main([*pose[:-4], "--trajectory", str(way), "--payload", "0.1", "--reference-sd", "2", *pose[-2:]]) == 2
    expected = "--payload is 0.0 there, 0.1 here; --reference-sd (m) is 0.0 there, 0.002 here; expected"
    assert expected in capsys.readouterr().err
    assert main(pose) == 2
    assert "configuration: --times is unset there, 0,60 here; --tolerance is unset" in capsys.readouterr().err


def test_the_exported_model_settles_at_home_in_mujoco(fitted, tmp_path):
    mujoco = pytest.importorskip("mujoco")
    out = tmp_path / "out"
    assert main(["export", "linear-7", "--wires", str(fitted), "--output", str(out)]) == 0
    assert not (out / "klipper.cfg").exists()
    model = mujoco.MjModel.from_xml_path(str(out / "robot.xml"))
    data = mujoco.MjData(model)
    data.qpos[:3] = [0.0, 0.0, 0.6]
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc).max() < 1e-6


def test_a_payload_of_the_table_beside_one_of_the_command_is_refused(fitted, tmp_path, capsys):
    way, out = tmp_path / "way.csv", tmp_path / "out"
    arguments = ["pose", "linear-7", "--wires", str(fitted), "--trajectory", str(way), "--output", str(out)]
    way.write_text("time_s,x_m,y_m,z_m,payload_kg\n0,0,0,.6,0\n60,0,0,.6,.2\n")
    assert main([*arguments, "--payload", "0.1"]) == 2
    said = capsys.readouterr().err
    assert "found payload_kg in the table of --trajectory beside --payload 0.1, expected one of them" in said
    assert not out.exists()


def test_the_command_maps_the_requested_slices(fitted, tmp_path):
    import csv

    import wirebayes as wb
    from wirebayes.errors import InputError

    out = tmp_path / "out"
    held = wb.pose(
        "linear-6",
        fitted,
        times=[0, 60],
        tolerance=AT_ONCE,
        draws=10,
        map_heights=[0.5],
        map_rotations=[[0, 0, 0], [0, 0.1, 0]],
        output=out,
    )
    slices = held.summary()["workspace"]["slices"]
    assert [(s["at_m"], s["rotation_vector_rad"]) for s in slices] == [(0.5, [0, 0, 0]), (0.5, [0, 0.1, 0])]
    with (out / "workspace.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 2 * 49
    assert {"workspace-drift.svg", "workspace-2-drift.svg", "workspace-2-tilt.svg"} <= {p.name for p in out.iterdir()}
    assert read_json(out / "pose.json")["workspace"]["slices"] == slices
    wb.write_report(out)
    page = (out / "report.html").read_text()
    assert "turned by the rotation vector that the title names" in page and "(0, 0.1, 0) rad" in page
    with pytest.raises(InputError, match="another configuration"):
        wb.pose("linear-6", fitted, times=[0, 60], tolerance=AT_ONCE, draws=10, map_heights=[0.6], output=out)
