"""Calibration from places that were measured, where the robot has no wire to spare or joint values are rough.

The logs are those of wires that meet in a point, in a vertical plane: springs between points, in plain numpy.
"""

import numpy as np
import pytest
from scipy.optimize import root

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from wirebayes.cli import main
from wirebayes.io.run_folder import read_json
from wirebayes.robot.mechanics import schema
from wirebayes.robot.self_calibration.mistaken import column_notices

STIFF_N, MASS_KG, GRAVITY = 3000.0, 1.0, 9.80665
PLOTTER = np.array([[-0.6, 0.0, 1.2], [0.6, 0.0, 1.2]])
OPPOSED = np.array([[-1.0, 0.0, 1.5], [1.0, 0.0, 1.5], [0.0, 0.0, -0.5]])
PLACES = [(x, 0.0, z) for z in (0.25, 0.4, 0.6, 0.75) for x in (-0.35, -0.2, -0.1, 0.1, 0.2, 0.35)]
TENSION_N, PLACE_MM = 0.3, 0.5


def _robot(anchors, lowest_N):
    legs = "".join(
        f'[[leg]]\nwire = "steel"\nexit_point_m = {a}\nplatform_point_m = [0.0, 0.0, 0.0]\n' for a in anchors.tolist()
    )
    return f"""version = 1
name = "flat"
description = "wires in a vertical plane"
source = "ours"
freedom = "position"
[platform]
mass_kg = {MASS_KG}
centre_of_mass_m = [0.0, 0.0, 0.0]
[tension]
choice = "minimum_norm"
lowest_N = {lowest_N}
highest_N = 500.0
[pose]
position_m = [0.0, 0.0, 0.5]
rotation_vector_rad = [0.0, 0.0, 0.0]
[workspace]
lower_m = [-0.4, 0.0, 0.2]
upper_m = [0.4, 0.0, 0.8]
[wires.steel]
k1_N = {STIFF_N}
B_mm = 1e-9
U = 1.0
k2 = 0.01
N = 0.5
length_mm = 1000.0
{legs}"""


def _ways(anchors, place):
    way = anchors - place
    length = np.linalg.norm(way, axis=1)
    return length, way / length[:, None]


def _rests(anchors, zero_m, near):
    """Where springs of these lengths hold the mass, and their tensions."""

    def pulled(place):
        length, along = _ways(anchors, place)
        return STIFF_N * np.maximum(length / zero_m - 1.0, 0.0), along

    def unbalanced(flat):
        tension, along = pulled(np.array([flat[0], 0.0, flat[1]]))
        return (tension @ along - [0.0, 0.0, MASS_KG * GRAVITY])[[0, 2]]

    found = root(unbalanced, np.asarray(near)[[0, 2]], tol=1e-12)
    assert found.success
    place = np.array([found.x[0], 0.0, found.x[1]])
    return place, pulled(place)[0]


def _log(anchors, rng, lowest_N, joint_mm, place_mm, marks):
    """A log of stops at places, the first of which were measured, and the true anchors and places."""
    true = anchors + 5e-3 * rng.normal(size=anchors.shape) * [1, 0, 1]
    reference = 5e-3 * rng.normal(size=len(anchors))
    rows, places = [], []
    for number, place in enumerate(np.array(PLACES), 1):
        length, along = _ways(anchors, place)
        pull = np.linalg.lstsq(along[:, [0, 2]].T, [0.0, MASS_KG * GRAVITY] - lowest_N * along[:, [0, 2]].sum(0))[0]
        joint = length / (1.0 + (lowest_N + pull) / STIFF_N)
        there, tension = _rests(true, joint + reference + 1e-3 * joint_mm * rng.normal(size=len(joint)), place)
        seen = there + 1e-3 * place_mm * rng.normal(size=3) * [1, 0, 1]
        told = [*(f"{v:.7f}" for v in seen), 0, 0, 0] if number <= marks else [""] * 6
        read = tension + TENSION_N * rng.normal(size=len(tension))
        rows.append([number, *told, 30, *(f"{v:.7f}" for v in joint), *(f"{v:.4f}" for v in read)])
        places.append(there)
    turn = ["rx_rad", "ry_rad", "rz_rad"]
    head = ["hold", "x_m", "y_m", "z_m", *turn, "duration_s"]
    for name in ("joint_{}_m", "tension_{}_N"):
        head += [name.format(i + 1) for i in range(len(anchors))]
    return "\n".join(",".join(map(str, row)) for row in [head, *rows]) + "\n", true, np.array(places)


def _calibrated(fitted, tmp_path, anchors, lowest_N, log, *options):  # noqa: F811
    robot, session, out = (tmp_path / name for name in ("flat.toml", "log.csv", "out"))
    robot.write_text(_robot(anchors, lowest_N))
    session.write_text(log)
    stated = ["--tension-sd", f"{TENSION_N}", "--anchor-sd", "5", "--next-poses", "1", "--draws", "10", *options]
    given = ["calibrate", robot, session, "--wires", fitted, "--output", out, *stated]
    assert main(list(map(str, given))) == 0
    return read_json(out / "calibration.json")


def test_measured_places_of_a_plotter_are_not_taken_for_requests(fitted, tmp_path):  # noqa: F811
    """Its two wires meet anywhere: that loops close exactly without the places does not speak against them."""
    log, true, _ = _log(PLOTTER, np.random.default_rng(1), 0.0, 0.1, 0.0, marks=len(PLACES))
    found = _calibrated(fitted, tmp_path, PLOTTER, 0.1, log)
    assert found["usable"] and not found["warnings"]
    anchors = found["exit_points_m"]
    off = np.abs(np.array(anchors["mean"]) - true)[:, [0, 2]]
    assert (off < 4 * np.array(anchors["sd"])[:, [0, 2]]).all()
    assert np.max(np.array(anchors["sd"])[:, [0, 2]]) < 2e-3  # of 5 mm


@pytest.mark.parametrize("seed", range(5))
def test_joint_values_that_err_by_a_third_of_a_millimetre_are_found_to(fitted, tmp_path, seed):  # noqa: F811
    log, _, places = _log(OPPOSED, np.random.default_rng(seed), 40.0, 0.3, PLACE_MM, marks=6)
    found = _calibrated(fitted, tmp_path, OPPOSED, 40.0, log, "--pose-sd", f"{PLACE_MM}")
    assert found["usable"] and 0.1 < found["joint_sd_mm"] < 0.6
    low, high = (np.array(found["poses"][end])[:, [0, 2]] for end in ("q05", "q95"))
    assert ((low < places[:, [0, 2]]) & (places[:, [0, 2]] < high)).mean() > 0.7


def _swapped(log):
    """A log whose last and third last columns are in the place of each other."""
    head, *rows = (line.split(",") for line in log.splitlines())
    rows = [[*row[:-3], row[-1], row[-2], row[-3]] for row in rows]
    return "\n".join(",".join(row) for row in [head, *rows]) + "\n"


@pytest.mark.parametrize("mixed", [True, False])
def test_columns_of_tensions_in_each_others_place_are_named_where_no_pose_is_known(fitted, tmp_path, mixed):  # noqa: F811
    """Joint values lead to the poses; there the tensions of sound logs carry the weight."""
    log, _, _ = _log(OPPOSED, np.random.default_rng(2), 40.0, 0.1, 0.0, marks=0)
    found = _calibrated(fitted, tmp_path, OPPOSED, 40.0, _swapped(log) if mixed else log)
    said = "columns tension_1_N and tension_3_N: found tensions that leave"
    assert any(one["text"].startswith(said) for one in found["warnings"]) is mixed
    assert found["usable"] is not mixed


@pytest.mark.parametrize(("times", "holds", "said"), [(0.1, 3, True), (0.1, 2, False), (1.0, 3, False)])
def test_another_unit_is_named_by_estimated_poses(tmp_path, times, holds, said):
    file = tmp_path / "flat.toml"
    file.write_text(_robot(PLOTTER, 0.1))
    places, tension = [], []
    for place in PLACES[:holds]:
        there, pull = _rests(PLOTTER, _ways(PLOTTER, np.array(place))[0] / 1.002, place)
        places.append(there)
        tension.append(times * pull)
    turn = np.tile(np.eye(3), (holds, 1, 1))
    found = column_notices(schema.read_robot_file(file), np.array(places), turn, np.array(tension))
    assert bool(found) is said
    assert all("tension_1_N to tension_2_N: found tensions that are, all together, 0.1" in one.text for one in found)
