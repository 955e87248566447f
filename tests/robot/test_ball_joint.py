"""Platforms on a ball joint: three turns alone are free, the joint carries what the wires do not."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation

from tests.robot.cases import ball_joint, tensions_at_home
from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.io.run_folder import read_json
from wirebayes.robot.exchange.imported import ImportedRobot, robot_file
from wirebayes.robot.mechanics import rotation, schema, statics
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.robot.motion import forward, inverse

G, K1 = 9.80665, 4000.0


def _text(robot):
    """The robot's file."""
    none = np.zeros(robot.legs)
    made = ImportedRobot(
        "mast", "drawn", "orientation", robot.mass_kg, robot.centre_of_mass_m, robot.exit_m, robot.platform_m, none,
        np.zeros((robot.legs, 3)), None, robot.home_m, robot.home_rotation_rad, (),
    )  # fmt: skip
    return robot_file(made, (robot.rule.lowest_N, robot.rule.highest_N), robot.home_m)


def _energy(robot, zero, q):
    """Of wires and weight, at a rotation vector; by scipy's rotations."""
    R = Rotation.from_rotvec(q).as_matrix()
    stretch = np.maximum(np.linalg.norm(robot.home_m + robot.platform_m @ R.T - robot.exit_m, axis=1) - zero, 0.0)
    return float((0.5 * K1 * stretch**2 / zero).sum() + robot.mass_kg * G * (R @ robot.centre_of_mass_m)[2])


@pytest.mark.parametrize("seed", range(8))
def test_the_equilibrium_is_that_of_an_energy_in_three_angles(seed):
    rng = np.random.default_rng(seed)
    robot = ball_joint(rng)
    turn = rotation.matrix(rng.normal(0.0, 0.05, 3))
    tau = inverse.tensions(robot, robot.home_m[None], turn[None])
    assert np.isfinite(tau).all()
    wires = Wires("hooke", "saturating", {"k1": np.array([[K1]])}, np.full((robot.legs, 1), 1000.0))
    commands = inverse.commands(robot, wires, robot.home_m[None], turn[None], tau)
    back = forward.solve_equilibrium(robot, wires, commands.zero_m, commands.offset_m, robot.home_m, np.eye(3))
    assert back.found[0]
    np.testing.assert_array_equal(back.position_m[0], robot.home_m)
    np.testing.assert_allclose(back.rotation[0], turn, atol=1e-9)
    zero = commands.zero_m[0] - 2e-3 * rng.random(robot.legs)
    found = forward.solve_equilibrium(robot, wires, zero[None], commands.offset_m, robot.home_m, turn)
    best = minimize(
        lambda q: _energy(robot, zero, q),
        rotation.vector(turn[None])[0],
        method="Nelder-Mead",
        options={"xatol": 1e-10, "fatol": 1e-15, "maxiter": 4000},
    )
    np.testing.assert_allclose(rotation.vector(found.rotation)[0], best.x, atol=1e-6)


def test_tensions_balance_the_moments_about_the_joint_alone():
    robot = ball_joint(np.random.default_rng(2))
    tau = tensions_at_home(robot)[0]
    line = robot.exit_m - robot.home_m - robot.platform_m
    pull = tau[:, None] * line / np.linalg.norm(line, axis=1)[:, None]
    moment = np.cross(robot.platform_m, pull).sum(0)
    moment += np.cross(robot.centre_of_mass_m, [0, 0, -robot.mass_kg * G])
    np.testing.assert_allclose(moment, 0.0, atol=1e-8 * tau.max())
    assert np.linalg.norm(pull.sum(0) - [0, 0, robot.mass_kg * G]) > 1.0  # the rest is the joint's


def test_turns_are_as_stiff_as_the_energy_is_curved():
    robot = ball_joint(np.random.default_rng(3))
    tau = tensions_at_home(robot)
    wires = Wires("hooke", "saturating", {"k1": np.array([[K1]])}, np.full((robot.legs, 1), 1000.0))
    commands = inverse.commands(robot, wires, robot.home_m[None], np.eye(3)[None], tau)
    K = statics.stiffness(
        robot, wires, robot.home_m[:, None], np.eye(3)[..., None], commands.zero_m.T, commands.offset_m.T
    )[0]
    h, axes = 1e-4, np.eye(3)

    def curved(i, j):
        at = [_energy(robot, commands.zero_m[0], h * (a * axes[i] + b * axes[j])) for a in (1, -1) for b in (1, -1)]
        return (at[0] - at[1] - at[2] + at[3]) / (4 * h**2)

    np.testing.assert_allclose(K[3:, 3:], [[curved(i, j) for j in range(3)] for i in range(3)], rtol=1e-4, atol=1e-2)
    assert np.linalg.eigvalsh(K)[0] > 0


def test_a_mast_is_posed_and_drifts_about_its_joint(fitted, tmp_path, capsys):  # noqa: F811
    robot = ball_joint(np.random.default_rng(4))
    (tmp_path / "mast.toml").write_text(_text(robot))
    arguments = ["pose", str(tmp_path / "mast.toml"), "--wires", str(fitted), "--draws", "8", "--times", "0,60"]
    assert main([*arguments, "--rotation", "0.02,-0.03,0.01", "--output", str(tmp_path / "out")]) == 0
    found = read_json(tmp_path / "out" / "pose.json")
    assert found["feasible"] and found["forward"]["solved"] == 1.0 and found["workspace"] is None
    assert found["certificate"]["proved"] is None
    assert max(found["drift"][0]["distance_mm"]["q95"]) == 0.0  # the joint does not move
    assert (tmp_path / "out" / "report.html").is_file()
    for option, message in (("--position=0,0,9", "off the ball joint"), ("--rotation=free,0,0", "free components")):
        assert main([*arguments, option, "--output", str(tmp_path / "no")]) == 2
        assert message in capsys.readouterr().err
    assert main(["calibrate", str(tmp_path / "mast.toml"), "x.csv", "--wires", str(fitted), "--output", "no"]) == 2


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("upper_m = [", "upper_m = [9.0, 9.0, 9.0]  # ["), "workspace: found corners beside the ball joint"),
        (("[pose]", "[plane]\nnormal = [0, 0, 1]\n[pose]"), "plane: found one beside a ball joint"),
    ],
)
def test_what_a_ball_joint_does_not_allow_is_refused(change, message):
    with pytest.raises(InputError, match=message):
        schema.parse(_text(ball_joint(np.random.default_rng(4))).replace(*change), "mast.toml")


def test_two_wires_do_not_hold_a_platform_about_a_ball_joint():
    robot = ball_joint(np.random.default_rng(4))
    few = replace(robot, exit_m=robot.exit_m[:2], platform_m=robot.platform_m[:2])
    with pytest.raises(InputError, match="2 legs, expected at least 3"):
        schema.parse(_text(few), "mast.toml")
