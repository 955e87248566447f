"""Which tension sensor is at fault: tests at their thresholds, rates on drawn estimates, and a drawn robot."""

import contextlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from wirebayes.robot.self_calibration import sensors
from wirebayes.robot.self_calibration.sensors import sensor_notices, sensors_json, weighed
from wirebayes.robot.self_calibration.trust import SIGNIFICANT

PRIOR_N = 100.0


def _estimate(true_N, information, rng=None):
    """Posterior mean and covariance of sensors' errors from readings with this information."""
    covariance = np.linalg.inv(information + np.eye(len(true_N)) / PRIOR_N**2)
    score = information @ true_N
    if rng is not None:
        score = score + np.linalg.cholesky(information) @ rng.standard_normal(len(true_N))
    return covariance @ score, covariance


def _drawn(rng, w=4):
    root = rng.standard_normal((w, w + 2))
    return root @ root.T


@pytest.mark.parametrize(("times", "wires"), [(0.99, []), (1.01, [2])])
def test_a_sensor_is_named_from_the_level_of_the_test_on(times, wires):
    size = np.sqrt(times * chi2.isf(SIGNIFICANT, 4))
    bias, covariance = _estimate(size * np.eye(4)[2], np.eye(4))
    assert weighed(bias, covariance, PRIOR_N).wires == wires


@pytest.mark.parametrize(("times", "wires"), [(0.99, [0, 1]), (1.01, [0])])
def test_another_is_named_beside_it_until_it_no_longer_explains_the_rest(times, wires):
    """Wire 2 alone leaves wire 1's error, which is at the threshold of what three other sensors may show."""
    left = np.sqrt(times * chi2.isf(SIGNIFICANT, 3))
    overlap = 0.9  # of the two wires' signatures
    information = np.eye(4)
    information[0, 1] = information[1, 0] = overlap
    size = left / np.sqrt(1 - overlap**2)
    bias, covariance = _estimate(size * np.eye(4)[0], information)
    assert [i for i in weighed(bias, covariance, PRIOR_N).wires if i < 2] == wires


def test_nothing_is_named_wrongly_more_often_than_the_level_says():
    rng = np.random.default_rng(1)
    clean = [weighed(*_estimate(np.zeros(4), _drawn(rng), rng), PRIOR_N).wires for _ in range(1000)]
    assert 0 < sum(map(bool, clean)) < 10 + 3 * np.sqrt(10)  # the level, and three standard errors of a count
    bad = []
    for _ in range(300):
        information, at = _drawn(rng), int(rng.integers(4))
        size = 8 / np.sqrt(1 / np.linalg.inv(information)[at, at])  # beyond what the three others could explain
        found = weighed(*_estimate(size * np.eye(4)[at], information, rng), PRIOR_N)
        bad.append((at in found.wires, found.wires == [at]))
    assert np.mean(bad, 0)[0] > 0.97 and np.mean(bad, 0)[1] > 0.9


@pytest.mark.parametrize(("other_N", "wires"), [(20.0, []), (10.1, []), (9.9, [0])])
def test_one_of_two_bad_sensors_is_named_where_it_explains_four_fifths(other_N, wires):
    bias, covariance = _estimate(np.array([20.0, other_N, 0, 0]), np.eye(4))
    found = weighed(bias, covariance, PRIOR_N)
    assert found.p_none < 1e-9 and found.p_alone.max() < 1e-9
    assert found.wires == wires


def test_the_answer_says_which_and_by_how_much():
    found = weighed(*_estimate(np.array([0, 0, 0, 15.0]), np.diag([1.0, 1, 1, 4])), PRIOR_N)
    (notice,) = sensor_notices(found)
    assert "wire 4 (reads 15 +- 0.5 N too much)" in notice.text
    said = sensors_json(found)
    assert said["wires"] == [4]
    np.testing.assert_allclose(said["bias_N"]["mean"], [15.0])
    assert sensor_notices(None) == [] and sensors_json(None) is None


def test_several_bad_sensors_are_said_without_a_name():
    found = weighed(*_estimate(np.array([20.0, 20.0, 0, 0]), np.eye(4)), PRIOR_N)
    assert [notice.text[:24] for notice in sensor_notices(found)] == ["several tension sensors "]
    assert sensors_json(found)["wires"] == []
    unknown = replace(found, p_none=np.nan)  # of a search that ended nowhere
    assert sensor_notices(unknown) == [] and unknown.wires == []


@pytest.mark.parametrize(("read", "looked_at"), [(1, 0), (2, 1)])
def test_at_a_single_hold_no_sensor_is_looked_at(read, looked_at, monkeypatch):
    """An error of a sensor and one of a length look the same there."""
    began = []

    def begun(*given, **changed):
        began.append(changed)
        raise StopIteration

    monkeypatch.setattr(sensors, "replace", begun)  # the first step of a search
    found = SimpleNamespace(
        unknowns=SimpleNamespace(prior=SimpleNamespace(bias_sd_N=0.0), errors=None), noise=SimpleNamespace(joint_m=0.0)
    )
    tension = np.where(np.arange(3)[:, None] < read, 5.0, np.nan) * np.ones((3, 4))
    with pytest.raises(StopIteration) if looked_at else contextlib.nullcontext():
        sensors.suspects(found, SimpleNamespace(tension_N=tension))
    assert len(began) == looked_at


@pytest.mark.parametrize("joint_m", [0.0, 1e-3, None])
@pytest.mark.parametrize(("p", "left", "little"), [(0.0099, 0.201, True), (0.0099, 0.199, False), (0.0101, 0.9, False)])
def test_sensors_that_explain_less_than_four_fifths_are_not_blamed(p, left, little, joint_m, monkeypatch):
    """Where the error of the joint values is estimated it takes up what contradicts, and a ratio says nothing."""
    monkeypatch.setattr(sensors, "trust", lambda found: found.p)
    monkeypatch.setattr(sensors, "misfit", lambda found: found.misfit)
    errors = SimpleNamespace(joint_m=joint_m)
    found = SimpleNamespace(misfit=100.0, unknowns=SimpleNamespace(errors=errors))
    other = SimpleNamespace(p=p, misfit=100.0 * left)
    assert sensors._explain_little(found, other) is (little and joint_m is not None)
