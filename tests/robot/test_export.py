"""Stiffness that firmware and simulator are given: the tangent at the tensions the robot works at."""

import xml.etree.ElementTree as ElementTree
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.robot import cases
from tests.robot.lines import CORE
from wirebayes.commands import export
from wirebayes.effects import effect_named
from wirebayes.errors import InputError
from wirebayes.robot.export import files
from wirebayes.robot.export.working_spring import working_spring
from wirebayes.robot.mechanics import draws, rotation, schema
from wirebayes.robot.mechanics.description import GivenWire
from wirebayes.robot.mechanics.wires import tension
from wirebayes.robot.motion import inverse

BENT = [
    ("hooke", "strain_stiffening", {"strain_stiffening.c": 15.0}),
    ("hooke", "toe", {"toe.w": 4.0}),
    ("modified", "toe", {"toe.w": 4.0}),
    ("hooke", "power_strain", {"power_strain.p": 0.3}),
    ("modified", None, {}),
    ("modified", "strain_stiffening", {"strain_stiffening.c": 15.0}),
]


def _line(law, effect, amplitudes, count=40):
    spread = np.exp(0.05 * np.random.default_rng(2).standard_normal((len(CORE) + len(amplitudes), count)))
    values = {k: v * f for (k, v), f in zip((CORE | amplitudes).items(), spread, strict=True)}
    return draws.WireDraws(values, 1000.0, law, effects=(effect_named(effect),) if effect else (), tension_ref_N=3.0)


def _home(robot):
    x, R = robot.home_m[None], rotation.matrix(robot.home_rotation_rad)[None]
    return x, R, inverse.tensions(robot, x, R)


@pytest.mark.parametrize(("law", "effect", "amplitudes"), BENT)
def test_the_spring_constant_is_the_slope_of_the_whole_law_at_the_working_tension(law, effect, amplitudes):
    robot, line = schema.read_robot_file("hangprinter-4"), _line(law, effect, amplitudes)
    wires = draws.for_robot(robot, line)
    load = _home(robot)[2].mean()
    low, high = np.ones((1, line.count)), np.full((1, line.count), 1.5)
    for _ in range(60):  # the stretched length of a wire of 1 m under that tension
        middle = 0.5 * (low + high)
        below = tension(wires, middle, np.ones_like(middle))[0] < load
        low, high = np.where(below, middle, low), np.where(below, high, middle)
    step = 1e-7
    up, down = (tension(wires, high + move, np.ones_like(high))[0] for move in (step, -step))
    slope = (up - down) / (2 * step)
    spring = working_spring(robot, line)
    np.testing.assert_allclose(spring.stiffness_N, slope[0], rtol=1e-6)
    assert np.abs(slope[0] / line.parameters["k1"] - 1).min() > 1e-3  # k1 would be wrong
    for text, setting in (
        (files.reprapfirmware(robot, line), f"M666 S{slope.mean():.0f} "),
        (files.klipper(robot, line), f"winch_spring_constant: {slope.mean():.0f} "),
    ):
        assert setting in text
        assert f"it is the tangent at {load:.4g} N, the mean tension of the lines at the home pose" in text


@pytest.mark.parametrize("name", ["hangprinter-4", "linear-6"])
@pytest.mark.parametrize(("law", "effect", "amplitudes"), BENT)
def test_a_tendon_pulls_like_the_wire_about_the_home_pose(name, law, effect, amplitudes):
    robot, line = schema.read_robot_file(name), _line(law, effect, amplitudes)
    wires = draws.for_robot(robot, line.centre())
    x, R, tau = _home(robot)
    commands = inverse.commands(robot, wires, x, R, tau)
    text = files.mujoco(robot, line)
    assert "tangent stiffness of the home pose, where the wires carry " + f"{tau[0, 0]:.4g}, " in text
    springs = ElementTree.fromstring(text).findall("./tendon/spatial")
    stiffness = np.array([float(s.get("stiffness")) for s in springs])
    rest = np.array([float(s.get("springlength").split()[1]) for s in springs])
    points = x[0] + robot.platform_m @ R[0].T
    distance = np.linalg.norm(points - robot.exit_m, axis=1)

    def pull(move):
        """Force of all lines of each wire on the platform, its point moved away by `move`."""
        stretched = robot.lines * (distance + move) + commands.offset_m[0]
        return robot.lines * tension(wires, stretched[:, None], commands.zero_m.T)[0][:, 0]

    step = 1e-7
    np.testing.assert_allclose(stiffness * (distance - rest), robot.lines * tau[0], rtol=1e-8)
    np.testing.assert_allclose(stiffness, (pull(step) - pull(-step)) / (2 * step), rtol=1e-5)


def test_a_line_of_one_stiffness_is_exported_as_it_is():
    amplitudes = {"second_relaxation.A": 0.05, "second_relaxation.T2": 30.0}
    robot, line = schema.read_robot_file("hangprinter-4"), _line("hooke", "second_relaxation", amplitudes)
    assert f"M666 S{line.parameters['k1'].mean():.0f} " in files.reprapfirmware(robot, line)
    assert "tangent" not in files.reprapfirmware(robot, line) + files.mujoco(robot, line)


def test_a_line_that_cannot_carry_the_platform_has_no_spring_constant():
    robot = schema.read_robot_file("hangprinter-4")
    with pytest.raises(InputError, match="cannot carry"):
        files.reprapfirmware(robot, _line("hooke", "strain_stiffening", {"strain_stiffening.c": -2000.0}))


@pytest.mark.parametrize("name", ["linear-7", "hangprinter-4", "cogiro-desk"])
def test_urdf_and_sdf_put_every_frame_in_its_place(name):
    mujoco = pytest.importorskip("mujoco")
    robot = schema.read_robot_file(name)
    robot = replace(
        cases.with_pulleys(robot, np.random.default_rng(0)),
        name='a "name" & more',
        home_rotation_rad=np.array([0.02, -0.03, 0.05]) * (robot.degrees == 6),
    )
    written = files.simulators(robot, _line("hooke", None, {}))
    assert set(written) == {"robot.xml", "robot.urdf", "robot.sdf"}
    R = rotation.matrix(robot.home_rotation_rad)
    points = robot.home_m + robot.platform_m @ R.T
    # MuJoCo reads URDF; without this extension it would fuse the frames into one body
    keep = '<mujoco><compiler fusestatic="false"/></mujoco>'
    mujoco.MjModel.from_xml_string(written["robot.urdf"])
    text = written["robot.urdf"].replace('  <link name="world"/>', keep + '<link name="world"/>')
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for i in range(robot.legs):
        np.testing.assert_allclose(data.body(f"exit_{i + 1}").xpos, robot.exit_m[i], atol=1e-12)
        np.testing.assert_allclose(data.body(f"point_{i + 1}").xpos, points[i], atol=1e-12)
    assert model.body("platform").mass[0] == robot.mass_kg
    np.testing.assert_allclose(data.body("platform").xipos, robot.home_m + R @ robot.centre_of_mass_m, atol=1e-12)
    assert model.nv == 6
    assert ElementTree.fromstring(written["robot.xml"]).get("model") == robot.name
    tree = ElementTree.fromstring(written["robot.sdf"])
    assert tree.find("model").get("name") == robot.name
    pose = np.array(tree.find("model/link/pose").text.split(), float)
    turn = Rotation.from_euler("xyz", pose[3:]).as_matrix()
    np.testing.assert_allclose(turn, R, atol=1e-12)
    for frame in tree.findall("model/frame"):
        place = np.array(frame.find("pose").text.split(), float)[:3]
        kind, i = frame.get("name").split("_")
        if frame.get("attached_to") == "platform":
            place = pose[:3] + turn @ place
        np.testing.assert_allclose(place, (robot.exit_m if kind == "exit" else points)[int(i) - 1], atol=1e-12)
    for text in (written["robot.urdf"], written["robot.sdf"]):
        assert "The wires are left out" in text and "wire 1: " in text and "Left out: swivelling pulleys" in text
        assert ("keep the orientation" in text) == (robot.degrees == 3)


def test_firmware_says_that_it_leaves_out_pulleys():
    line = _line("hooke", None, {})
    robot = cases.with_pulleys(schema.read_robot_file("hangprinter-4"), np.random.default_rng(0))
    for text in (files.reprapfirmware(robot, line), files.klipper(robot, line)):
        assert "Left out: the pulleys at the anchors (radii 0, " in text
    assert "Left out" not in files.klipper(schema.read_robot_file("hangprinter-4"), line)
    assert "pulleys do not swivel" in files.mujoco(robot, line)


def _five(tmp_path):
    """A Hangprinter with a fifth anchor."""
    text = (Path(schema.__file__).parents[2] / "data" / "robots" / "hangprinter-4.toml").read_text()
    path = tmp_path / "five.toml"
    path.write_text(text + "\n[[leg]]\nexit_point_m = [1.5, -1.0, 2.0]\nplatform_point_m = [0, 0, 0]\n")
    return schema.read_robot_file(str(path))


def test_a_fifth_anchor_has_the_letter_and_the_number_that_the_firmware_reads(tmp_path):
    robot, line = _five(tmp_path), _line("hooke", None, {})
    anchors = next(row for row in files.reprapfirmware(robot, line).splitlines() if row.startswith("M669"))
    words = anchors.split(" ; ")[0].split()
    assert words[:3] == ["M669", "K6", "N5"]
    assert [word[0] for word in words[3:]] == ["A", "B", "C", "D", "I"]
    assert words[-1] == "I1500.00:-1000.00:2000.00"
    assert "[stepper_e]\nanchor_x: 1500.00\n" in files.klipper(robot, line)
    assert (
        " N" not in files.reprapfirmware(schema.read_robot_file("hangprinter-4"), line).split("M669")[1].split(";")[0]
    )


def _two_lines(given=None):
    """A Hangprinter whose third and fourth leg hang on a thick line, and both lines."""
    robot = schema.read_robot_file("hangprinter-4")
    robot = replace(robot, wire=("default", "default", "thick", "thick"), given=given or {})
    stiff = replace(_line("hooke", None, {}), name="thick", tension_range_N=(1.0, 9.0))
    stiff = replace(stiff, parameters=dict(stiff.parameters) | {"k1": 5.0 * stiff.parameters["k1"]}, length_mm=2000.0)
    thin = replace(_line("hooke", None, {}), tension_range_N=(0.0, 5.0))
    return robot, thin if given else replace(thin, others={"thick": stiff})


def test_firmware_and_simulators_say_to_which_line_each_number_belongs():
    robot, line = _two_lines()
    thin, thick = (one.parameters["k1"] for one in line.each.values())
    bands = [
        f"90 % interval {low:.0f} to {high:.0f}" for low, high in (np.quantile(k, [0.05, 0.95]) for k in (thin, thick))
    ]
    code, config = files.reprapfirmware(robot, line), files.klipper(robot, line)
    for text in (code, config):
        assert "wire default in legs 1, 2; wire thick in legs 3, 4." in text
        assert (
            f"default: fitted at 1000 mm, tested from 0 to 5 N; spring constant {thin.mean():.0f} N, {bands[0]}."
            in text
        )
        assert (
            f"thick: fitted at 2000 mm, tested from 1 to 9 N; spring constant {thick.mean():.0f} N, {bands[1]}." in text
        )
        assert "takes one spring constant for all wires: here that of wire default." in text
    assert f"M666 S{thin.mean():.0f} ; spring constant per unit length, N: of wire default, {bands[0]}\n" in code
    assert f"winch_spring_constant: {thin.mean():.0f}  # N per unit strain: of wire default, {bands[0]}\n" in config
    for text in files.simulators(robot, line).values():
        assert "<!-- wire default in legs 1, 2; wire thick in legs 3, 4 -->" in text
        ElementTree.fromstring(text)
    odd = replace(robot, wire=("a--b", "a--b", "thick", "thick"))
    for text in files.simulators(odd, replace(line, name="a--b")).values():
        ElementTree.fromstring(text)


def test_each_line_has_its_own_rows_of_creep():
    robot, line = _two_lines()
    header, rows = files.creep_tables(robot, line, [2.0], [60.0, 600.0])
    assert header == ("wire", *files.TABLE)
    for name, one in line.each.items():
        own = [row[1:] for row in rows if row[0] == name]
        assert own == files.creep_table(
            schema.read_robot_file("hangprinter-4"), replace(one, others={}), [2.0], [60.0, 600.0]
        )
    alone = schema.read_robot_file("hangprinter-4")
    header, rows = files.creep_tables(alone, _line("hooke", None, {}), [2.0], [60.0])
    assert header == files.TABLE
    assert len(rows) == 1 and len(rows[0]) == len(files.TABLE)


@pytest.mark.parametrize(
    ("loads_N", "longest_s", "said"),
    [
        ([1.0, 4.0], 120.0, []),
        ([0.99, 4.0], 120.0, ["tensions 0.99 to 4 N leave the tested range 1 to 4 N"]),
        ([1.0, 4.01], 120.0, ["tensions 1 to 4.01 N leave the tested range 1 to 4 N"]),
        ([1.0, 4.0], 121.0, ["2.02 min is longer than the longest tested hold, 2 min"]),
    ],
)
def test_a_creep_table_beyond_what_was_tested_is_said(loads_N, longest_s, said):
    robot = schema.read_robot_file("hangprinter-4")
    tested = replace(_line("hooke", None, {}), tension_range_N=(1.0, 4.0), time_range_s=(0.0, 120.0))
    notices = export._of_table(robot, tested, np.array(loads_N), np.array([60.0, longest_s]))
    assert [(notice.kind, notice.text) for notice in notices] == [("extrapolation", text) for text in said]


def test_what_is_known_of_a_fit_is_not_said_of_a_given_wire():
    given = {"thick": GivenWire(CORE | {"k1": 5000.0}, 1000.0)}
    robot, line = _two_lines(given)
    code = files.reprapfirmware(robot, line)
    assert "Wire thick: as the robot's file gives it; spring constant 5000 N, as the robot's file gives it.\n" in code
    robot = replace(robot, wire=("thick",) * 4)
    for text in (files.reprapfirmware(robot, line), files.klipper(robot, line)):
        assert "line as the robot's file gives it.\n" in text
        assert "N: as the robot's file gives it" in text or "strain: as the robot's file gives it" in text
        assert "fitted" not in text and "tested" not in text and "interval" not in text


@pytest.mark.parametrize("name", ["linear-7", "hangprinter-4", "cogiro-desk"])
@pytest.mark.parametrize("with_pulleys", [False, True])
def test_the_mujoco_model_starts_balanced_at_its_home_pose(name, with_pulleys):
    mujoco = pytest.importorskip("mujoco")
    robot, line = schema.read_robot_file(name), _line("hooke", None, {})
    turn = np.array([0.02, -0.03, 0.05]) * (robot.degrees == 6)
    # the first anchor at the world's origin, where an empty start would put the platform
    shift = robot.exit_m[0]
    robot = replace(robot, exit_m=robot.exit_m - shift, home_m=robot.home_m - shift, home_rotation_rad=turn)
    if with_pulleys:
        robot = cases.with_pulleys(robot, np.random.default_rng(0))
    model = mujoco.MjModel.from_xml_string(files.mujoco(robot, line))
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc).max() < 1e-6
    assert data.ten_length.min() > 0.1
    np.testing.assert_allclose(data.qpos[:3], robot.home_m, atol=1e-12)
    np.testing.assert_allclose(data.body(1).xpos, robot.home_m, atol=1e-12)
    np.testing.assert_allclose(data.body(1).xmat.reshape(3, 3), rotation.matrix(turn), atol=1e-12)
    data.qpos[0] += 0.01  # along the world's axis, whatever the platform's orientation
    mujoco.mj_forward(model, data)
    np.testing.assert_allclose(data.body(1).xpos, robot.home_m + [0.01, 0.0, 0.0], atol=1e-12)


def test_a_platform_settles_at_a_turned_home():
    pytest.importorskip("mujoco")

    turn = np.array([0.02, -0.03, 0.05])
    robot, line = replace(schema.read_robot_file("linear-7"), home_rotation_rad=turn), _line("hooke", None, {}).centre()
    x, R, tau = _home(robot)
    commands = inverse.commands(robot, draws.for_robot(robot, line), x, R, tau)
    lengths = np.full(robot.legs, line.parameters["k1"][0]), commands.zero_m[0], commands.offset_m[0]
    found, rotated, rested = cases.rest_in_mujoco(robot, *lengths, x[0] + 1e-3, np.eye(3), softest_N_m=10.0)
    assert rested
    np.testing.assert_allclose(found, x[0], atol=1e-6)
    np.testing.assert_allclose(rotated, R[0], atol=1e-6)
