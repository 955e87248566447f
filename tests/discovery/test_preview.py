"""What a test can tell before it is fitted: compared with what a test of known strengths and gaps must show."""

import numpy as np
import pytest

from wirebayes.commands.check import check
from wirebayes.discovery.preview import preview
from wirebayes.effects import CATALOGUE
from wirebayes.simulation.synthetic import Bench, Truth, draw

WIRE = {"k1": 700.0, "B": 0.5, "U": 0.8, "k2": 0.03, "N": 0.8, "preload": 0.5, "sensor_sd": 0.006, "setting_sd": 0.02}


def previewed(bench):
    """The preview of a simulated test."""
    sample = draw([bench], Truth(WIRE), seed=3)
    experiment = bench.experiment()
    holds = tuple(
        type(hold)(**vars(hold) | {"readings": row[: hold.time_s.size]})
        for hold, row in zip(experiment.holds, sample.problem.samples[0].readings[..., 0], strict=True)
    )
    measured = type(experiment)(**vars(experiment) | {"holds": holds})
    return measured, preview(measured, CATALOGUE, np.random.default_rng(0))


@pytest.fixture(scope="module")
def loading():
    """Six holds upwards."""
    return previewed(Bench(displacements_mm=(1, 2, 3, 4, 5, 6)))


@pytest.fixture(scope="module")
def unloading():
    """Six holds upwards and five back."""
    return previewed(Bench(displacements_mm=(1, 2, 3, 4, 5, 6, 5, 4, 3, 2, 1)))


def test_what_a_protocol_cannot_show_is_said(loading, unloading):
    up, back = loading[1].effects, unloading[1].effects
    for effect in ("lost_motion", "guide_friction"):
        assert up[effect]["shows"] == "no"
        assert up[effect]["amplitude_80"] is None
        assert back[effect]["shows"] == "yes"
    assert set(up) == set(CATALOGUE)
    assert up["thermal_expansion"]["reason"] == "follows the logged temperature"


def test_more_holds_show_smaller_effects(loading, unloading):
    up, back = loading[1].effects, unloading[1].effects
    seen = [name for name in up if up[name]["amplitude_80"] is not None]
    assert len(seen) > 10
    assert np.median([back[name]["amplitude_80"] / up[name]["amplitude_80"] for name in seen]) < 0.8


def test_parameters_lie_where_the_truth_is_and_the_prior_is_named_where_it_answers(loading):
    parameters = loading[1].parameters
    for name, value in WIRE.items():
        determined_by, low, high = (parameters[name][key] for key in ("determined_by", "q05", "q95"))
        width = np.log(high / low) if name != "preload" else high - low
        away = (
            abs(np.log(parameters[name]["q50"] / value)) if name != "preload" else abs(parameters[name]["q50"] - value)
        )
        assert away < 1.5 * width, name
        assert determined_by in ("data", "data and prior", "prior")
    assert parameters["k1"]["determined_by"] == "data"
    short = previewed(Bench(displacements_mm=(1, 2), times_s=(0.0, 1.0, 2.0)))[1]
    assert short.parameters["setting_sd"]["determined_by"] == "prior"
    for name in ("U", "N"):  # within chance of the border between the other two words
        assert short.parameters[name]["determined_by"] != "data"
    assert {found["reason"] for found in short.effects.values()} == {"fewer readings than parameters"}


def test_what_is_suspicious_is_said_with_the_fits_own_checks(loading):
    experiment = loading[0]
    stuck = tuple(type(h)(**vars(h) | {"readings": 0.0 * h.readings + 2.0}) for h in experiment.holds)
    checked = check(type(experiment)(**vars(experiment) | {"holds": stuck}))
    assert any("stays at 2 N while the displacement changes" in line for line in checked.messages)
    assert check(experiment).messages == ()
