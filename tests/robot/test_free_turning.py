"""Platforms whose turn nothing decides are refused with what to write instead, before any pose is looked for."""

import re

import pytest

from wirebayes.cli import main
from wirebayes.errors import InputError
from wirebayes.robot.mechanics import schema

CORNERS = [(-2.0, -2.0, 3.0), (2.0, -2.0, 3.0), (2.0, 2.0, 3.0), (-2.0, 2.0, 3.0), (-1.0, 0.0, 0.0), (1.0, 0.0, 0.0)]
PLACE = "lower_m = [-0.3, -0.3, 0.9]\nupper_m = [0.3, 0.3, 1.5]\n"
AT_JOINT = "lower_m = [0.0, 0.0, 1.2]\nupper_m = [0.0, 0.0, 1.2]\n"
TABLE = "[plane]\nnormal = [0.0, 0.0, 1.0]\n"


def _text(points, centre=(0.0, 0.0, 0.0), freedom='freedom = "pose"\n', place=PLACE, plane=""):
    legs = [
        f"[[leg]]\nexit_point_m = {list(exit_m)}\nplatform_point_m = {list(point)}\n"
        for exit_m, point in zip(CORNERS, points, strict=True)
    ]
    return (
        f'version = 1\nname = "a"\ndescription = "b"\nsource = "c"\n{freedom}'
        f"[platform]\nmass_kg = 5.0\ncentre_of_mass_m = {list(centre)}\n"
        '[tension]\nchoice = "minimum_norm"\nlowest_N = 2.0\nhighest_N = 400.0\n'
        f"[pose]\nposition_m = [0.0, 0.0, 1.2]\n[workspace]\n{place}{plane}{''.join(legs)}"
    )


ONE = [(0.1, 0.2, 0.0)] * 6
LINE = [(0.1 * k, 0.2 * k, -0.3 * k) for k in (-2, 1, 3, 2, -1, -2)]
UPRIGHT = [(0.1, 0.0, 0.05 * k) for k in range(6)]
APART = [(0.1, 0.0, 0.0), (-0.1, 0.0, 0.0)] * 2 + [(0.0, 0.1, 0.0)] * 2
JOINT = 'freedom = "orientation"\n'
FREE = {
    "one point": (_text(ONE), "the one point"),
    "unsaid": (_text(ONE, freedom=""), "the one point"),
    "mass below": (_text(ONE, centre=(0.1, 0.2, -0.3)), "the one point"),
    "a line": (_text(LINE), "the line on which"),
    "a table": (_text(ONE, plane=TABLE), "the one point"),
    "upright on a table": (_text(UPRIGHT, plane=TABLE), "the one point"),
    "one point about a joint": (_text(ONE, freedom=JOINT, place=AT_JOINT), ".*through the ball joint"),
}
HELD = {
    "apart": _text(APART),
    "position": _text(ONE, freedom='freedom = "position"\n'),
    "a line with the mass beside it": _text(LINE, centre=(0.0, 0.0, -0.1)),
    "a line on a table": _text([(0.1 * k, 0.0, 0.0) for k in range(6)], plane=TABLE),
    "apart about a joint": _text(APART, freedom=JOINT, place=AT_JOINT),
}


@pytest.mark.parametrize("case", FREE)
def test_a_platform_that_turns_freely_is_refused(case):
    text, about = FREE[case]
    with pytest.raises(InputError, match=f"^a.toml.*key freedom: .* turns freely about {about}.*expected points"):
        schema.parse(text, "a.toml")


@pytest.mark.parametrize("case", HELD)
def test_a_platform_that_is_held_is_read(case):
    assert schema.parse(HELD[case], "a.toml").legs == 6


def test_what_is_advised_is_solved(tmp_path, capsys):
    """With the word that the line names, the same robot has a pose that holds."""
    file = tmp_path / "a.toml"
    wire = "[wires.line]\nk1_N = 8000.0\nB_mm = 0.3\nU = 0.9\nk2 = 0.03\nN = 0.6\nlength_mm = 1000.0\n"
    legs = re.sub(r"(\[\[leg\]\]\n)", r'\1wire = "line"\n', _text(ONE))
    text = legs.replace("[[leg]]", f"{wire}[[leg]]", 1)
    file.write_text(text, encoding="utf-8")
    out = ["--draws", "4", "--times", "0,60", "--output", str(tmp_path / "out")]
    assert main(["pose", str(file), *out]) == 2
    assert 'freedom = "position"' in capsys.readouterr().err
    file.write_text(text.replace('freedom = "pose"', 'freedom = "position"'), encoding="utf-8")
    assert main(["pose", str(file), *out]) == 0
    assert "the platform has drifted by" in capsys.readouterr().out
