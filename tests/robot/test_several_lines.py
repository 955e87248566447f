"""Legs cut from different lines, each with its own posterior; what their own weight does."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.robot.test_commands import fitted  # noqa: F401 - a fixture
from tests.robot.test_drift import _line
from wirebayes.cli import main
from wirebayes.commands.wires import draws_of, named_lines
from wirebayes.effects import effect_named
from wirebayes.errors import InputError
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.plain import plain
from wirebayes.model.prior import wire_defaults
from wirebayes.model.scales import Scales
from wirebayes.result_warnings import Notice
from wirebayes.robot.history.unknowns import Uncertain, unknowns
from wirebayes.robot.mechanics import draws, sag, schema
from wirebayes.robot.mechanics.description import GivenWire
from wirebayes.robot.mechanics.wire_doubts import wire_warnings
from wirebayes.robot.mechanics.wires import tension
from wirebayes.robot.motion import drift
from wirebayes.robot.self_calibration.session import LengthPrior

THIN, THICK = ("default", "thick")


def _mixed(robot, thick_legs):
    wire = tuple(THICK if i in thick_legs else THIN for i in range(robot.legs))
    return replace(robot, wire=wire)


def test_each_leg_has_the_draws_of_its_line():
    robot = _mixed(schema.read_robot_file("linear-6"), (1, 4))
    stiff = replace(_line(5, sd=0.1, seed=2, k1=3000.0), name=THICK, length_mm=2000.0)
    line = replace(_line(5, sd=0.1, seed=1), others={THICK: stiff})
    wires = draws.for_robot(robot, line)
    for i in range(6):
        own = stiff if i in (1, 4) else line
        for name in draws.CORE:
            np.testing.assert_array_equal(wires.theta[name][i], own.parameters[name])
        assert wires.length_mm[i, 0] == own.length_mm
    few = line.part(slice(0, 2))
    np.testing.assert_array_equal(draws.for_robot(robot, few).theta["k1"], wires.theta["k1"][:, :2])


def test_an_effect_of_one_line_is_neutral_in_the_others_and_tensions_are_by_each_ones_reference():
    robot = _mixed(schema.read_robot_file("linear-6"), (0,))
    effects = (effect_named("strain_stiffening"), effect_named("tension_dependent_rate"))
    amplitudes = {"strain_stiffening.c": 8.0, "tension_dependent_rate.m": 0.4}
    bent = replace(_line(3, effects=effects, **amplitudes), name=THICK, tension_ref_N=6.0)
    line = replace(_line(3), others={THICK: bent}, tension_ref_N=3.0)
    wires = draws.for_robot(robot, line)
    stretched, zero = np.full((6, 3), 1.01), np.ones((6, 3))
    tau = tension(wires, stretched, zero)[0]
    alone = tension(
        draws.for_robot(schema.read_robot_file("linear-6"), replace(bent, name="default")), stretched, zero
    )[0]
    plain_tau = tension(
        draws.for_robot(robot, replace(_line(3), others={THICK: replace(_line(3), name=THICK)})), stretched, zero
    )[0]
    np.testing.assert_allclose(tau[0], alone[0])
    np.testing.assert_allclose(tau[1:], plain_tau[1:])
    assert tau[0, 0] > 1.05 * tau[1, 0]
    course = drift.from_command(robot, wires, robot.home_m, np.eye(3), np.array([60.0]))
    assert course.found.all()
    np.testing.assert_array_equal(np.ravel(wires.tension_ref_N), [6.0, 3.0, 3.0, 3.0, 3.0, 3.0])


def test_a_leg_without_a_posterior_is_refused_in_one_line():
    robot = _mixed(schema.read_robot_file("linear-6"), (3,))
    with pytest.raises(InputError, match="linear-6: leg 4, key wire: found 'thick' and posteriors of default"):
        draws.for_robot(robot, _line(2))
    with pytest.raises(InputError, match="linear-6: leg 1, key wire: found 'default' and posteriors of thick"):
        draws.for_robot(robot, replace(_line(2), name=THICK))
    draws.for_robot(schema.read_robot_file("linear-6"), replace(_line(2), name=THICK))  # the only line, by any name


def test_unknowns_hold_the_parameters_of_every_line():
    robot = _mixed(schema.read_robot_file("linear-6"), (1, 4))
    stiff = replace(_line(50, sd=0.1, seed=2, k1=3000.0), name=THICK)
    line = replace(_line(50, sd=0.1, seed=1), others={THICK: stiff})
    prior = LengthPrior(line, 1e-3)
    assert prior.names == [*draws.CORE, *(f"thick {name}" for name in draws.CORE)]
    mean, cov = prior.moments(6)
    assert mean.shape == (6 + 10 + 18,)
    assert np.linalg.eigvalsh(cov).min() > 0
    known = unknowns(robot, line, Uncertain(1e-3, 1e-9), np.random.default_rng(0))
    wires, _ = known.columns(known.draws)
    np.testing.assert_allclose(wires.theta["k1"], draws.for_robot(robot, line).theta["k1"], rtol=1e-4)


def test_the_tested_ranges_are_each_lines_own():
    robot = _mixed(schema.read_robot_file("linear-6"), (1, 4))
    stiff = replace(_line(2), name=THICK, tension_range_N=(0.0, 1.0))
    line = replace(_line(2), others={THICK: stiff}, tension_range_N=(0.0, 9.0))
    message = wire_warnings(robot, line, np.full((1, 6), 5.0), 60.0, np.ones((1, 6)))
    assert message == [Notice("extrapolation", "wire thick: tensions 5 N leave the tested range 0 to 1 N")]


@pytest.mark.parametrize(("least", "said"), [(0.0149, "0 to 15"), (0.0151, "0.0151 to 15")])
def test_a_tension_that_vanishes_beside_the_largest_is_none(least, said):
    robot = schema.read_robot_file("linear-6")
    line = replace(_line(2), tension_range_N=(1.0, 9.0))
    (message,) = wire_warnings(robot, line, np.array([[least, *[15.0] * 5]]), 60.0, np.ones((1, 6)))
    assert message.text == f"tensions {said} N leave the tested range 1 to 9 N"


def test_only_lines_that_legs_hang_on_warn():
    one = GivenWire({"k1": 800.0, "B": 0.3, "U": 1.0, "k2": 0.03, "N": 0.6}, 1000.0)
    robot = replace(_mixed(schema.read_robot_file("linear-6"), range(6)), given={THICK: one})
    line = replace(_line(2), tension_range_N=(0.0, 9.0), time_range_s=(0.0, 30.0))
    tau = np.array([[20.0, 5.0, 5.0, 5.0, 5.0, 5.0]])
    assert wire_warnings(robot, line, tau, 60.0, np.ones((1, 6))) == []
    robot = replace(robot, wire=(THICK, *robot.wire[1:-1], "default"))
    assert wire_warnings(robot, line, tau, 60.0, np.ones((1, 6))) == [
        Notice("extrapolation", "1 min is longer than the longest tested hold, 30 s")
    ]


DECLARED = "[wires.thick]\nfitted = true\nmass_kg_m = 0.02\n[wires.default]\nmass_kg_m = 0.0001\n"
FIRST = '[[leg]]\nwire = "thick"\n'


def _file(tmp_path):
    """The shipped robot with a thick, heavy first wire."""
    text = (Path(schema.__file__).parents[2] / "data" / "robots" / "linear-6.toml").read_text()
    path = tmp_path / "mixed.toml"
    path.write_text(text.replace("[[leg]]\n", DECLARED + FIRST, 1))
    return path


def test_commands_take_a_posterior_for_each_name(fitted, tmp_path, capsys):  # noqa: F811
    robot, out = _file(tmp_path), tmp_path / "out"
    way = tmp_path / "way.csv"
    way.write_text("time_s,x_m,y_m,z_m\n0,0,0,.6\n60,0,0,.6\n")
    arguments = ["pose", str(robot), "--trajectory", str(way), "--draws", "10", "--output", str(out)]
    assert main([*arguments, "--wires", str(fitted)]) == 2
    line = capsys.readouterr().err.strip()
    assert "leg 1, key wire: found 'thick' and posteriors of default" in line
    assert "\n" not in line
    assert not out.exists()
    assert main([*arguments, "--wires", f"default={fitted}", "--wires", f"thick={fitted}"]) == 0
    message = read_json(out / "pose.json")
    assert message["wires"]["lines"] == ["default", "thick"]
    assert any(notice["kind"] == "sag" and "wire 1 weighs" in notice["text"] for notice in message["warnings"])
    assert main([*arguments, *(f"--wires={name}={fitted}" for name in ("default", "thick", "thin"))]) == 2
    assert "--wires: found thin, expected one of the legs' wires: default, thick" in capsys.readouterr().err
    assert main([*arguments, "--wires", f"thick={fitted}", "--wires", str(fitted)]) == 2
    assert "expected NAME=FOLDER for each" in capsys.readouterr().err


def test_the_exported_creep_is_by_line_on_the_page_and_in_the_summary(fitted, tmp_path):  # noqa: F811
    import wirebayes as wb

    out = tmp_path / "out"
    exported = wb.export(_file(tmp_path), {"default": fitted, "thick": fitted}, draws=10, output=out)
    table = exported.summary()["creep_table"]
    assert [row["wire"] for row in table] == ["thick"] * 16 + ["default"] * 16
    assert table[0]["tension_N"] == 1.0
    assert "thick" in exported._repr_html_()
    wb.write_report(out)
    page = (out / "report.html").read_text()
    assert "Growth of new wire thick" in page and "Growth of new wire default" in page


def test_names_and_folders_are_read(tmp_path):
    odd = tmp_path / "a=b"
    odd.mkdir()
    assert named_lines([str(odd)]) == odd
    assert plain(named_lines(["A=x", "B=y"])) == {"A": "x", "B": "y"}
    with pytest.raises(InputError, match="expected each name once"):
        named_lines(["A=x", "A=y"])


def test_lines_of_two_laws_are_refused(fitted, monkeypatch):  # noqa: F811
    from wirebayes.results import read_back

    hooke = read_back.load_posterior(fitted)
    other = replace(hooke, sample=replace(hooke.sample, model=replace(hooke.sample.model, law="modified")))
    laws = {"a": hooke, "b": other}
    monkeypatch.setattr(
        "wirebayes.results.read_back.load_posterior",
        lambda folder, experiment=None, own_effects=None: laws[folder.name],
    )
    with pytest.raises(InputError, match="found a fitted with --elastic-law hooke and b with modified"):
        draws_of({"a": "a", "b": "b"}, 10)
    laws["b"] = hooke
    both = draws_of({"a": "a", "b": "b"}, 10)
    assert both.name == "a"
    assert sorted(both.others["b"].parameters["k1"]) == sorted(both.parameters["k1"])
    assert (both.others["b"].parameters["k1"] != both.parameters["k1"]).any()


def test_legs_are_new_specimens_where_several_were_tested():
    robot = _mixed(schema.read_robot_file("linear-6"), (1, 4))
    rng, n = np.random.default_rng(0), 4000
    spread = {name: np.full(n, 0.02 * (i + 1)) for i, name in enumerate(draws.CORE)}
    line = replace(_line(n, sd=0.0), spread=spread, specimens=3, others={THICK: replace(_line(n, sd=0.0), name=THICK)})
    wires = draws.for_robot(robot, line, 0.3, rng)
    for i, name in enumerate(draws.CORE):
        sd = np.log(np.broadcast_to(wires.theta[name], (6, n))).std(1)
        np.testing.assert_allclose(sd[[0, 2, 3, 5]], 0.02 * (i + 1), rtol=0.06)
        np.testing.assert_allclose(sd[[1, 4]], 0.3 if name in draws.DIFFER else 0.0, rtol=0.06, atol=1e-12)
    assert draws.typical_spread(line, 0.3) == pytest.approx(np.sqrt(np.mean(np.square([0.02, 0.04, 0.08]))), abs=1e-4)
    known = unknowns(robot, line, Uncertain(1e-3, 0.05), rng)
    theta = known.columns(known.draws)[0].theta
    np.testing.assert_allclose(np.log(theta["U"]).std(1), [0.06, 0, 0.06, 0.06, 0, 0.06], rtol=0.06, atol=1e-4)


def test_commands_take_several_tests_of_one_line(fitted, tmp_path, capsys, monkeypatch):  # noqa: F811
    known = wire_defaults(1000.0, Scales(step_mm=1.0, range_mm=12.0, tension_N=4.0, hold_s=120.0, step_N=0.35))
    before = {name: known[name].rvs(500, random_state=i) for i, name in enumerate(draws.CORE)}
    monkeypatch.setattr("wirebayes.results.read_back.prior_draws", lambda folder, experiment=None: before)
    way = tmp_path / "way.csv"
    way.write_text("time_s,x_m,y_m,z_m\n0,0,0,.6\n60,0,0,.6\n")
    arguments = ["pose", "linear-6", "--trajectory", str(way), "--draws", "10", "--output", str(tmp_path / "out")]
    assert main([*arguments, "--wires", f"{fitted},{fitted}"]) == 0
    message = read_json(tmp_path / "out" / "pose.json")["wires"]["specimens"]["default"]
    assert message["tests"] == 2
    assert 0 < message["spread"]["B"]["q05"] < message["spread"]["B"]["q95"]
    assert "Specimens of default differ as estimated from 2 tests: k1 by" in capsys.readouterr().err
    assert "differ as estimated from 2 tests" in (tmp_path / "out" / "report.html").read_text()
    assert main([*arguments[:-1], str(tmp_path / "no"), "--wires", f"{fitted},"]) == 2
    assert "found 1 specimen, expected two or more" in capsys.readouterr().err


def test_sag_is_that_of_a_level_cable():
    robot = replace(
        schema.read_robot_file("linear-6"),
        mass_kg_m=np.full(6, 0.05),
        exit_m=np.tile([0.0, 0.0, 1.0], (6, 1)),
        platform_m=np.zeros((6, 3)),
        pulleys=None,
    )
    share, depth, extra = sag.sag(robot, np.array([4.0, 0.0, 1.0]), np.eye(3), np.full(6, 20.0))
    weight = 0.05 * 9.80665
    a = 20.0 / weight  # catenary, horizontal tension 20 N
    np.testing.assert_allclose(share, weight * 4 / 20)
    np.testing.assert_allclose(depth, a * (np.cosh(2.0 / a) - 1), rtol=1e-3)
    np.testing.assert_allclose(extra, 2 * a * np.sinh(2.0 / a) - 4.0, rtol=1e-3)
    hung = sag.sag(robot, np.array([0.0, 0.0, -3.0]), np.eye(3), np.full(6, 20.0))
    np.testing.assert_allclose(hung[2], 0.0)
    assert len(sag.sag_warnings(robot, np.array([4.0, 0.0, 1.0]), np.eye(3), np.full(6, 20.0))) == 1
    assert (
        sag.sag_warnings(replace(robot, mass_kg_m=None), np.array([4.0, 0.0, 1.0]), np.eye(3), np.full(6, 20.0)) == []
    )


def test_the_next_command_names_every_posterior(fitted, tmp_path, capsys):  # noqa: F811
    robot, out = _file(tmp_path), tmp_path / "out"
    both = [f"default={fitted}", f"thick={fitted}"]
    wires = ["--wires", both[0], "--wires", both[1]]
    briefly = ["--draws", "5", "--times", "0,60", "--tolerance", "1e-6"]  # a tolerance that is left at once
    assert main(["pose", str(robot), *wires, *briefly, "--output", str(out)]) == 0
    assert f"READINGS.csv {' '.join(wires)}  (when" in capsys.readouterr().out


def test_the_stiffness_of_wires_without_a_name_is_refused_with_what_to_write(tmp_path):
    path = _file(tmp_path)
    path.write_text(path.read_text().replace("[wires.default]\n", "[wires.default]\nk1_N = 3e4\n"))
    with pytest.raises(
        InputError, match=r"wires\.default\.k1_N: found .* expected a name of its own, as \[wires\.belt\]"
    ):
        schema.read_robot_file(path)
