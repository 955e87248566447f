"""Which tension sensor is at fault: tests at their thresholds, rates on drawn estimates, and a drawn robot."""

import contextlib
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from wirebayes.robot.self_calibration import sensors
from wirebayes.robot.self_calibration.equations import Holds
from wirebayes.robot.self_calibration.sensors import sensor_notices, sensors_json, weighed
from wirebayes.robot.self_calibration.session import Session
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
    (notice,) = sensor_notices(found)
    assert "several tension sensors are off (p < 0.0001 if none were), or more than one value" in notice.text
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


@pytest.fixture
def posteriors(monkeypatch):
    """Stand-ins for posteriors, of which nothing but their trust, misfit and evidence is asked."""
    monkeypatch.setattr(sensors, "trust", lambda found: found.p)
    monkeypatch.setattr(sensors, "misfit", lambda found: found.misfit)

    def made(p, misfit=1.0, evidence=0.0):
        return SimpleNamespace(p=p, misfit=misfit, evidence=evidence)

    return made


BEFORE = 1e-15  # its fifth root is a thousandth


@pytest.mark.parametrize(
    ("p", "left", "little"), [(0.0009, 0.201, True), (0.0009, 0.199, False), (0.0011, 0.9, False), (0.0, 0.9, True)]
)
def test_sensors_that_explain_less_than_four_fifths_are_not_blamed(p, left, little, posteriors):
    assert sensors._explain_little(posteriors(BEFORE, 100.0), posteriors(p, 100.0 * left)) is little
    assert not sensors._explain_little(posteriors(SIGNIFICANT, 100.0), posteriors(p, 100.0 * left))
    assert sensors._explain_little(posteriors(0.0, 100.0), posteriors(0.0, 90.0))  # too small for a logarithm


def _alone(posterior, bias_N):
    return sensors._Errors(posterior, np.full(4, bias_N), np.eye(4))


@pytest.mark.parametrize(
    ("first", "second", "wires"),
    [
        ((0.0, 200.0), (0.0, 0.0), [0]),  # as likely as errors of all
        ((0.0, 200.0), (0.0, 199.0), [0, 1]),
        ((0.011, 140.0), (0.0, 0.0), [0]),  # nothing contradicts any more
        ((0.009, 140.0), (0.0, 0.0), []),
        ((0.011, 140.0), (0.011, 150.0), [1]),
        ((0.0, 161.0), (0.0, 0.0), [0]),  # four fifths
        ((0.0, 159.0), (0.0, 0.0), []),
    ],
)
def test_sensors_tried_alone_are_named_by_what_their_errors_gain(first, second, wires, posteriors):
    screened = weighed(*_estimate(np.array([9.0, 9.0, 9.0, 9.0]), np.eye(4)), PRIOR_N)
    each = {i: _alone(posteriors(p, evidence=0.5 * gain), 3.0 + i) for i, (p, gain) in enumerate([first, second])}
    found = sensors._compared(screened, posteriors(BEFORE), 200.0, each)
    assert found.wires == wires
    np.testing.assert_array_equal(found.bias_N, [3.0, 4.0, *screened.bias_N[2:]])


def test_where_little_contradicted_a_sensor_must_leave_much_less(posteriors):
    """A level that is just passed again shows nothing: the fifth root of the probability before is asked for."""
    screened = weighed(*_estimate(np.array([9.0, 9.0, 9.0, 9.0]), np.eye(4)), PRIOR_N)
    for p, wires in ((0.99, []), (1.01, [0])):
        each = {0: _alone(posteriors(p * 1e-3**0.2, evidence=70.0), 3.0)}
        assert sensors._compared(screened, posteriors(1e-3), 200.0, each).wires == wires


def test_sensors_that_may_be_the_one_are_tried():
    screened = replace(
        weighed(*_estimate(np.ones(4), np.eye(4)), PRIOR_N),
        explains=np.array([0.8, 0.41, 0.39, 0.1]),
        p_alone=np.array([0.0, 0.0, 0.0, 0.02]),
    )
    assert sensors._perhaps(screened) == [0, 1, 3]


def test_the_error_of_one_sensor_shows_in_its_readings_alone():
    session = replace(_session(), motion=np.array([[1.0, -1.0, 0.0], [-1.0, 1.0, 1.0]]))
    holds = Holds(session, np.ones((2, 3)))
    np.testing.assert_array_equal(sensors._holds_of_one(holds, 1).session.signs, [[0, -1, 0], [0, 1, 0]])


def _session():
    """Two holds of three wires."""
    return Session(np.zeros((2, 3)), np.tile(np.eye(3), (2, 1, 1)), np.ones((2, 3)), np.ones(2), np.ones(2, bool), 1.0)
