"""Robots of CASPR and WireX: files as those programs write them become the same robot; the rest is refused."""

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.robot import cases
from tests.robot.cases import ball_joint
from wirebayes.cli import main
from wirebayes.commands.import_robot import import_robot
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import rotation, schema
from wirebayes.robot.motion import inverse

BODIES = """<?xml version="1.0" encoding="utf-8"?>
<!DOCTYPE bodies_system SYSTEM "../../../../templates/bodies.dtd">
<bodies_system>
  <links display_range="-8 8 -6 6 0 6" view_angle="-37 32">
    <link_rigid num="1" name="{name}">
      <joint type="{joint}" q_initial="{home}"/>
      <physical>
        <mass>{mass}</mass>
        <com_location>{centre}</com_location>
        <end_location>0.0 0.0 0.0</end_location>
        <inertia ref="com"><Ixx>1</Ixx><Iyy>1</Iyy><Izz>1</Izz><Ixy>0</Ixy><Ixz>0</Ixz><Iyz>0</Iyz></inertia>
      </physical>
      <parent>
        <num>0</num>
        <location>{base}</location>
      </parent>
    </link_rigid>
  </links>
</bodies_system>
"""
CABLE = """    <cable_ideal name="cable {i}" attachment_reference="{reference}">
      <properties><force_min>{low}</force_min><force_max>{high}</force_max></properties>
      <attachments>
        {base}
        <attachment><link>1</link><location>{point}</location></attachment>
      </attachments>
    </cable_ideal>
"""
CHAIN = """<chain id="{i}" winchtype="IPAnema-Winch"><base {exit} a11="1" a21="0" a31="0" a12="0" a22="1" a32="0"
a13="{axis[0]!r}" a23="{axis[1]!r}" a33="{axis[2]!r}" radius="{radius!r}"/><platform {point}/></chain>
"""


def _row(values):
    return " ".join(repr(float(v)) for v in values)


def _caspr(folder, robot, reference="joint", base=(0.0, 0.0, 0.0), angles=(0.0, 0.0, 0.0), extra=""):
    """Both files of a robot as CASPR has them; two sets of cables."""
    point = robot.platform_m - (robot.centre_of_mass_m if reference == "com" else 0.0)
    free = robot.degrees == 6
    home = [*(robot.home_m - base), *(angles if free else ())]
    (folder / "toy_bodies.xml").write_text(
        BODIES.format(
            name=robot.name,
            joint="SPATIAL_EULER_XYZ" if free else "T_XYZ",
            home=_row(home),
            mass=robot.mass_kg,
            centre=_row(robot.centre_of_mass_m),
            base=_row(base),
        )
    )
    cables = ""
    for i in range(robot.legs):
        start = f"<attachment><link>0</link><location>{_row(robot.exit_m[i])}</location></attachment>"
        if robot.pulleys is not None and robot.pulleys.radius_m[i]:
            start = (
                f"<base_rotating_pulley><fixed_location>{_row(robot.exit_m[i])}</fixed_location>"
                f"<pulley_radius>{float(robot.pulleys.radius_m[i])!r}</pulley_radius>"
                f"<cable_entry_vector>{_row(2 * robot.pulleys.axis[i])}</cable_entry_vector></base_rotating_pulley>"
            )
        cables += CABLE.format(
            i=i + 1, reference=reference, low=0.5 + 0.1 * i, high=90 - i, base=start, point=_row(point[i])
        )
    other = CABLE.format(i=1, reference="joint", low=1, high=2, base=start, point="0 0 0")
    (folder / "toy_cables.xml").write_text(
        f'<?xml version="1.0"?>\n<!DOCTYPE cables [\n<!ATTLIST cable_set id ID #REQUIRED>\n]>\n'
        f'<cables default_cable_set="original">\n  <cable_set id="few">\n{other}  </cable_set>\n'
        f'  <cable_set id="original">\n{cables}{extra}  </cable_set>\n</cables>\n'
    )
    return folder / "toy_bodies.xml"


def _wirex(folder, robot, pattern="3R3T"):
    xyz = lambda p: " ".join(f'{k}="{float(v)!r}"' for k, v in zip("xyz", p, strict=True))  # noqa: E731
    chains = "".join(
        CHAIN.format(
            i=i + 1,
            exit=xyz(robot.exit_m[i]),
            point=xyz(robot.platform_m[i]),
            axis=robot.pulleys.axis[i].tolist(),
            radius=float(robot.pulleys.radius_m[i]),
        )
        for i in range(robot.legs)
    )
    file = folder / "toy.xml"
    file.write_text(
        f'<models version="0.32">\n<robot generator="Wirelib" motionpattern="{pattern}">\n'
        f"<geometry>\n{chains}</geometry>\n"
        f'<platform name="p" description="" mass="{robot.mass_kg!r}" swing_angle="50">'
        f'<inertiatensor Ixx="1"/><centerofgravity {xyz(robot.centre_of_mass_m)}/></platform>\n'
        f'<controller ipo_clock="4"/>\n</robot>\n</models>\n'
    )
    return file


def _same(got, robot):
    for name in ("exit_m", "platform_m", "centre_of_mass_m", "home_m"):
        np.testing.assert_allclose(getattr(got, name), getattr(robot, name), atol=1e-12)
    assert (got.mass_kg, got.freedom, got.legs) == (robot.mass_kg, robot.freedom, robot.legs)
    if robot.pulleys is None:
        assert got.pulleys is None
    else:
        rolling = robot.pulleys.radius_m > 0
        np.testing.assert_array_equal(got.pulleys.radius_m, robot.pulleys.radius_m)
        np.testing.assert_allclose(got.pulleys.axis[rolling], robot.pulleys.axis[rolling])


@pytest.mark.parametrize("rolling", [False, True])
@pytest.mark.parametrize("name", ["cogiro", "segesta-8", "hangprinter-4"])
def test_a_robot_of_caspr_is_read(name, rolling, tmp_path):
    robot = schema.read_robot_file(name)
    if rolling:
        robot = cases.with_pulleys(robot, np.random.default_rng(0))
    for i, reference in enumerate(("joint", "com")):
        folder = tmp_path / reference
        folder.mkdir()
        angles = (0.1, -0.2, 0.3)
        bodies = _caspr(folder, robot, reference, (0.5, -0.25, 0.125), angles)
        given = [bodies, bodies.with_name("toy_cables.xml")] if i else bodies
        got = schema.read_robot_file(import_robot(given, folder / "new" / "toy.toml"))
        _same(got, robot)
        turn = Rotation.from_euler("XYZ", angles).as_matrix() if robot.degrees == 6 else np.eye(3)
        np.testing.assert_allclose(rotation.matrix(got.home_rotation_rad), turn, atol=1e-12)
        assert got.rule.lowest_N == pytest.approx(0.5 + 0.1 * (robot.legs - 1))
        assert got.rule.highest_N == 90 - (robot.legs - 1)
        assert "toy_bodies.xml and toy_cables.xml, cable set 'original'" in got.source
        assert "have bounds of their own" in got.source
        assert (got.lower_m <= got.home_m).all() and (got.home_m <= got.upper_m).all()


@pytest.mark.parametrize(("joint", "axes"), [("PLANAR_XY", "xyz"), ("PLANAR_XZ", "xzy"), ("PLANAR_YZ", "yzx")])
def test_a_planar_joint_of_caspr_is_a_rail(joint, axes, tmp_path):
    """Two coordinates along the plane, then the turn about its normal; wires of a square hold it at every height."""
    first, second, normal = ("xyz".index(axis) for axis in axes)
    corners = np.zeros((4, 3))
    corners[:, [first, second]] = [[2.0, 2.0], [-2.0, 2.0], [-2.0, -2.0], [2.0, -2.0]]
    plain = schema.read_robot_file("sled-4")
    robot = replace(plain, exit_m=corners, platform_m=0.1 * corners[[1, 0, 3, 2]], home_m=np.zeros(3), mass_kg=0.1)
    bodies = _caspr(tmp_path, robot)
    given = re.sub(
        'type="SPATIAL_EULER_XYZ" q_initial="[^"]*"', f'type="{joint}" q_initial="0.3 -0.2 0.1"', bodies.read_text()
    )
    bodies.write_text(given)
    got = schema.read_robot_file(import_robot(bodies, tmp_path / "toy.toml"))
    home = np.zeros(3)
    home[[first, second]] = 0.3, -0.2
    np.testing.assert_allclose(got.home_m, home)
    np.testing.assert_allclose(got.home_rotation_rad, 0.1 * np.eye(3)[normal])
    assert got.plane.contact == "rail" and got.freedoms == 3
    np.testing.assert_array_equal(got.plane.normal, np.eye(3)[normal])
    assert got.lower_m[normal] == got.upper_m[normal] == 0.0
    assert "a rail" in got.source
    tension = inverse.tensions(got, got.home_m[None], rotation.matrix(got.home_rotation_rad)[None])
    assert np.isfinite(tension).all()


@pytest.mark.parametrize(("joint", "axes"), [("S_EULER_XYZ", "XYZ"), ("S_FIXED_XYZ", "xyz")])
def test_a_spherical_joint_of_caspr_is_a_ball_joint(joint, axes, tmp_path):
    """Three angles about axes that turn along, or about those of the base; the joint is the home position."""
    robot = ball_joint(np.random.default_rng(0))
    bodies = _caspr(tmp_path, robot, "com", base=robot.home_m)
    given = re.sub(
        'type="SPATIAL_EULER_XYZ" q_initial="[^"]*"', f'type="{joint}" q_initial="0.1 -0.2 0.15"', bodies.read_text()
    )
    bodies.write_text(given)
    got = schema.read_robot_file(import_robot(bodies, tmp_path / "toy.toml"))
    _same(got, robot)
    assert got.freedoms == 3 and "a ball joint" in got.source
    turn = Rotation.from_euler(axes, (0.1, -0.2, 0.15)).as_matrix()
    np.testing.assert_allclose(rotation.matrix(got.home_rotation_rad), turn, atol=1e-12)
    assert got.lower_m.tolist() == got.upper_m.tolist() == got.home_m.tolist()
    with pytest.raises(InputError, match="--position: found one for a platform on a ball joint"):
        import_robot(bodies, tmp_path / "other.toml", position="0,0,1")


def test_what_is_given_beside_the_files_counts(tmp_path):
    robot = cases.with_pulleys(schema.read_robot_file("cogiro"), np.random.default_rng(0))
    bodies = _caspr(tmp_path, robot)
    given = {"tension": [1, 5000], "position": "0.1,0,2", "pulleys": False}
    got = schema.read_robot_file(import_robot(str(bodies), tmp_path / "a.toml", **given))
    assert (got.rule.lowest_N, got.rule.highest_N, got.pulleys) == (1.0, 5000.0, None)
    assert got.home_m.tolist() == [0.1, 0.0, 2.0]
    assert "Ours: the choice of tensions, the workspace, beyond_exit_m, the tension bounds, the position" in got.source
    assert "Its pulleys are left out." in got.source
    assert np.isfinite(inverse.tensions(got, got.home_m[None], np.eye(3)[None])).all()
    with pytest.raises(InputError, match="at least two"):
        import_robot(bodies, tmp_path / "b.toml", cable_set="few")
    with pytest.raises(InputError, match="no cable set 'none', expected one of few, original"):
        import_robot(bodies, tmp_path / "b.toml", cable_set="none")
    with pytest.raises(InputError, match="nothing is overwritten"):
        import_robot(bodies, tmp_path / "a.toml")


@pytest.mark.parametrize(("name", "pattern"), [("cogiro-desk", "3R3T"), ("hangprinter-4", "3T")])
def test_a_robot_of_wirex_is_read(name, pattern, tmp_path):
    robot = cases.with_pulleys(schema.read_robot_file(name), np.random.default_rng(0))
    file = _wirex(tmp_path, robot, pattern)
    beside = {"tension": (0.5, 12.0), "position": robot.home_m}
    got = schema.read_robot_file(import_robot(file, tmp_path / "toy.toml", **beside))
    _same(got, robot)
    assert "WireX writes 0.1 m where none was set" in got.source
    bare = schema.read_robot_file(import_robot(file, tmp_path / "bare.toml", pulleys=False, **beside))
    assert bare.pulleys is None
    for missing, message in (("tension", "--tension LOWEST,HIGHEST"), ("position", "--position X,Y,Z")):
        with pytest.raises(InputError, match=message):
            import_robot(file, tmp_path / "no.toml", **{k: v for k, v in beside.items() if k != missing})
    with pytest.raises(InputError, match="expected 0 <= LOWEST < HIGHEST"):
        import_robot(file, tmp_path / "no.toml", tension="5,1", position="0,0,0")
    assert not (tmp_path / "no.toml").exists()


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("bodies", "<mass>", "<mass>x", "line 8: <mass>: found 'x"),
        ("bodies", "</mass>", "", "mismatched tag"),
        ("bodies", "SPATIAL_EULER_XYZ", "R_X", "line 6: <joint>: found the type 'R_X', expected a free platform"),
        ("bodies", "<num>0", "<num>1", "<num>: found '1', expected 0, the base"),
        ("bodies", "</links>", '<link_rigid num="2"/></links>', "found 2 links, expected one <link_rigid>"),
        ("bodies", "<com_location>", "<com_location>1 ", "expected 3 numbers with spaces"),
        ("bodies", 'q_initial="', 'q_initial="1 ', "expected 6 numbers"),
        ("bodies", "bodies_system>", "system>", "found this root"),
        (
            "bodies",
            '<!DOCTYPE bodies_system SYSTEM "../../../../templates/bodies.dtd">',
            '<!DOCTYPE b [<!ENTITY a "aaaa">]>',
            "found an entity",
        ),
        ("bodies", "utf-8", "no-such", "expected XML"),
        ("cables", "<link>0</link>", "<link>2</link>", "found link 2, expected link 0"),
        ("cables", "force_max>", "most>", "found 0 elements <force_max>, expected one"),
        ("cables", 'attachment_reference="joint"', "", "no attribute attachment_reference"),
        ("cables", "</attachments>", "<attachment/></attachments>", "found 3 attachments, expected two"),
        ("cables", "<location>", "<location>nan ", "<location>: found"),
        ("cables", "<attachment><link>0", "<screw_base_rotating_pulley/><attachment><link>0", "found 3 attachments"),
    ],
)
def test_mistakes_name_file_and_line(file, old, new, message, tmp_path, capsys):
    bodies = _caspr(tmp_path, schema.read_robot_file("cogiro"))
    broken = tmp_path / f"toy_{file}.xml"
    text = broken.read_text()
    at = text.index('"original">\n    <cable') if file == "cables" else 0
    assert old in text[at:]
    replaced = text[at:].replace(old, new) if old.endswith("force_max>") else text[at:].replace(old, new, 1)
    if old == "bodies_system>":
        replaced = text.replace(old, new)
    broken.write_text(text[:at] + replaced)
    assert main(["import-robot", str(bodies), "--output", str(tmp_path / "out.toml")]) == 2
    line = capsys.readouterr().err.strip()
    assert f"toy_{file}.xml" in line and message in line and "\n" not in line
    assert not (tmp_path / "out.toml").exists()


def test_files_that_do_not_belong_together_are_refused(tmp_path):
    bodies = _caspr(tmp_path, schema.read_robot_file("cogiro"))
    wirex = _wirex(tmp_path, cases.with_pulleys(schema.read_robot_file("cogiro"), np.random.default_rng(0)))
    out = tmp_path / "out.toml"
    (tmp_path / "old.xml").write_text("<models><wireRobot/></models>")
    (tmp_path / "deep.xml").write_text("<a>" * 500 + "</a>" * 500)
    (tmp_path / "alone_cables.xml").write_text((tmp_path / "toy_cables.xml").read_text())
    for files, message in (
        ([bodies, bodies], "a second file of this kind"),
        ([bodies, wirex], "the file of WireX alone"),
        ([tmp_path / "old.xml"], "the format before 0.32"),
        ([tmp_path / "deep.xml"], "nested too deeply"),
        ([tmp_path / "alone_cables.xml"], "expected a file with the bodies too"),
        ([tmp_path / "absent.xml"], "found no such file"),
    ):
        with pytest.raises(InputError, match=message):
            import_robot(files, out)
    assert not out.exists()


def test_the_command_says_what_it_took_and_what_is_ours(tmp_path, capsys):
    bodies = _caspr(tmp_path, schema.read_robot_file("cogiro"))
    out = tmp_path / "cogiro.toml"
    assert main(["import-robot", str(bodies), "--output", str(out)]) == 0
    message = capsys.readouterr().out
    assert f"Written: {out}: 8 wires, 91.058 kg" in message
    assert "Ours: the choice of tensions, the workspace, beyond_exit_m." in message
    assert f"Next: wirebayes pose {out}" in message


def test_a_pose_that_nothing_holds_is_said(tmp_path, capsys):
    bodies = _caspr(tmp_path, schema.read_robot_file("cogiro"))
    arguments = ["import-robot", str(bodies), "--position", "20,0,2", "--output", str(tmp_path / "far.toml")]
    assert main(arguments) == 0
    assert "no tensions within the bounds hold the platform at its home pose" in capsys.readouterr().err
