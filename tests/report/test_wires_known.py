"""Sentences on pages about robots: where the wires are from, and numbers that people can read."""

import pytest

from wirebayes.report.pages.calibrate import _known, _milli
from wirebayes.report.pages.wires_known import wires_known
from wirebayes.sentences import from_to

POSTERIOR = "Wires known from 200 posterior draws of a sample of 2000 mm: the plain model"
GIVEN = "The parameters of"


@pytest.mark.parametrize(
    ("legs", "effects", "expected"),
    [
        (["line", "line"], [], f"{POSTERIOR}."),
        (["default", "default"], [], f"{POSTERIOR}."),
        (["line", "line"], ["soft_guide", "drift"], f"{POSTERIOR} with soft guide and drift."),
        (["line", "steel"], [], f"{POSTERIOR}. {GIVEN} wire 2 are those of the robot's file."),
        (
            ["steel", "line", "steel"],
            [],
            f"{POSTERIOR}. {GIVEN} wires 1 and 3 are those of the robot's file.",
        ),
        (["steel"] * 2, [], "The parameters of every wire are those of the robot's file, not of a posterior."),
    ],
)
def test_wires_of_the_robots_own_file_are_not_told_to_be_known_from_a_posterior(legs, effects, expected):
    wires = {"draws": 200, "tested_length_mm": 2000.0, "effects": effects, "legs": legs, "lines": ["line"]}
    assert wires_known(wires) == expected


@pytest.mark.parametrize(("models", "said"), [([["toe"], []], " with some of toe."), ([["toe"]], " with toe.")])
def test_effects_that_not_every_draw_has_are_some(models, said):
    """Models that differ on the bench alone are one in a robot, and every draw has its effects."""
    wires = {"draws": 200, "tested_length_mm": 2000.0, "effects": ["toe"], "legs": ["line"], "lines": ["line"]}
    shares = [{"effects": effects, "share": 1.0 / len(models)} for effects in models]
    assert wires_known({**wires, "undecided": {"line": shares}}) == f"{POSTERIOR}{said}"


@pytest.mark.parametrize(("low", "high", "said"), [(2.299, 2.301, "2.3"), (2.24, 2.26, "2.2 … 2.3")])
def test_errors_that_read_the_same_are_said_once(low, high, said):
    assert from_to(low, high) == said


def test_a_coordinate_across_a_plotters_plane_is_zero_in_the_answer_too():
    found = {
        "pose_now": {"position_m": [-0.034, 6.14e-69, 1.29]},
        "with_creep_model": {"length_m": {"sd": [2.3e-3, 2.3e-3]}},
        "observability": {"sentence": "All is seen."},
    }
    length, place, _ = _known(found).points
    assert place == "The platform is at (-0.034, 0, 1.29) m."
    assert length == "Every length is known to 2.3 mm (standard error)."
    assert _milli(-1e-9) == "0.00" and _milli(-6e-6) == "-0.01"
