"""Poses that are written with five decimals, taken as exact, beside joint values with six, and no tensions."""

import numpy as np
import pytest

import wirebayes as wb

EXIT_M = np.array([[1.4, 0.0, 2.2], [-0.7, 1.2, 2.2], [-0.7, -1.2, 2.2], [0.05, -0.02, 0.0]])
STIFFNESS_N, MASS_KG, GRAVITY = 2500.0, 2.0, 9.80665
REFERENCE_M = np.array([0.1, 4.1, 3.7, -1.5]) * 1e-3
ROUNDED_MM = 0.01 / np.sqrt(12.0)
HEAD = """version = 1
name = "four"
description = "three wires from above, one from below"
source = "made up"
freedom = "position"
[platform]
mass_kg = 2.0
centre_of_mass_m = [0.0, 0.0, 0.0]
[tension]
choice = "minimum_norm"
lowest_N = 1.0
highest_N = 80.0
[pose]
position_m = [0.0, 0.0, 0.9]
[workspace]
lower_m = [-0.3, -0.3, 0.7]
upper_m = [0.3, 0.3, 1.2]
[wires.steel]
k1_N = 2500.0
"""


@pytest.fixture(scope="module")
def robot(tmp_path_factory):
    legs = [
        f'[[leg]]\nexit_point_m = {exit_m.tolist()}\nplatform_point_m = [0.0, 0.0, 0.0]\nwire = "steel"\n'
        for exit_m in EXIT_M
    ]
    file = tmp_path_factory.mktemp("robot") / "four.toml"
    file.write_text(HEAD + "".join(legs), encoding="utf-8")
    return file


@pytest.fixture(scope="module")
def session():
    """Fourteen poses in balance by hand, the fourth wire's tension drawn: columns as a session has them."""
    rng = np.random.default_rng(11)
    rows = []
    for _ in range(14):
        position_m = rng.uniform([-0.3, -0.3, 0.7], [0.3, 0.3, 1.2])
        away = EXIT_M - position_m
        distance_m = np.linalg.norm(away, axis=1)
        fourth_N = rng.uniform(2.0, 8.0)
        unit = (away / distance_m[:, None]).T
        carried = np.array([0.0, 0.0, MASS_KG * GRAVITY]) - unit[:, 3] * fourth_N
        tension_N = np.append(np.linalg.solve(unit[:, :3], carried), fourth_N)
        joint_m = distance_m / (1.0 + tension_N / STIFFNESS_N) - REFERENCE_M
        rows.append([*position_m.round(5), 30.0, *joint_m.round(6)])
    names = ["x_m", "y_m", "z_m", "duration_s", *(f"joint_{i}_m" for i in range(1, 5))]
    return {"hold": range(1, 15), **dict(zip(names, np.transpose(rows), strict=True))}


def test_how_far_exact_poses_and_joint_values_disagree_is_what_the_readings_show(robot, session):
    """What is usual of joint values, .25 mm, had made .1 mm of three thousandths."""
    found = wb.calibrate(robot, session, next_poses=0).summary()
    (text,) = [warning["text"] for warning in found["warnings"] if warning["kind"] == "misfit"]
    start, rest = text.split("joint values agree to ")
    assert start == "geometry and stated poses, taken as exact, and "
    assert float(rest.split()[0]) == pytest.approx(ROUNDED_MM, rel=0.5)
    assert "--pose-sd" in text


def test_with_their_rounding_stated_lengths_are_found(robot, session):
    found = wb.calibrate(robot, session, next_poses=0, pose_sd=0.01).summary()
    assert found["usable"]
    off = np.array(found["references_m"]["mean"]) - REFERENCE_M
    assert (np.abs(off) < 3.0 * np.array(found["references_m"]["sd"])).all()
