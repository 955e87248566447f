"""The coordinate of the preload near a slack first hold: where its edge is, how it bends, and where it is left out."""

from dataclasses import replace

import numpy as np
import pytest

from wirebayes.effects import effect_named
from wirebayes.inference.coordinates.slack_edge import slack_edge
from wirebayes.inference.coordinates.steps import Preload
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.simulation.synthetic import Bench, Truth, draw
from wirebayes.wire.staircase import simulate

BENCH = Bench(displacements_mm=(1.0, 2.0, 3.0, 4.0, 5.0))
TRUTH = {"k1": 4000.0, "B": 0.4, "U": 0.9, "k2": 0.04, "N": 0.4, "preload": 0.3}


def made(law="hooke", effects=(), **truth):
    return draw([BENCH], Truth(TRUTH | truth, law=law, effects=tuple(effect_named(e) for e in effects)), 1)


def knowing(**fixed):
    """The problem with some parameters known."""
    problem = made().problem
    left = {name: d for name, d in problem.prior.distributions.items() if name not in fixed}
    return replace(problem, prior=replace(problem.prior, distributions=left, fixed=fixed))


def found(of):
    return slack_edge(of.problem, of.problem.samples[0])


def preloads(coordinates):
    """How many preloads have a coordinate of their own."""
    return sum(isinstance(step, Preload) for step in coordinates.steps)


@pytest.mark.parametrize("law", ["hooke", "modified"])
@pytest.mark.parametrize("threshold", [None, 2.0])
def test_the_edge_is_where_the_first_hold_begins_to_creep(law, threshold):
    """By the simulated wire: a hair to the slack side it does not lose tension, a hair to the other side it does."""
    of = made(law) if threshold is None else made(law, ["creep_threshold"], **{"creep_threshold.tau_c": threshold})
    edge, sample, names = found(of), of.problem.samples[0], of.problem.names
    at = edge.value(np.array([edge.at + edge.width * -7.0 * np.log(10.0)]), of.theta)  # the middle of the coordinate
    theta = np.repeat(of.theta, 2, axis=0)
    theta[:, names.index("preload")] = at + [-1e-6, 1e-6]
    tension = simulate(sample.protocol, of.problem.parameters(theta, sample), sample.model)[0]
    assert tension[0] == pytest.approx(0.0 if threshold is None else threshold, abs=1e-5)
    assert tension[0, 0] == tension[-1, 0] and tension[0, 1] > tension[-1, 1]


def test_from_afar_it_is_the_preload_and_near_it_the_logarithm_of_the_distance():
    edge = found(made())
    theta = np.ones((200, len(TRUTH) + 2))
    distance = np.concatenate([np.geomspace(10.0, 100.0, 100), np.geomspace(1e-5, 1e-2, 100)]) * edge.width
    theta[:, edge.preload] = edge.at + distance
    score = edge.score(theta)
    assert score[:100] == pytest.approx(theta[:100, edge.preload], rel=1e-4)
    assert np.diff(score[100:]) == pytest.approx(edge.width * np.diff(np.log(distance[100:])), rel=0.01)
    theta[:, edge.preload] = edge.at - distance  # on the slack side, mirrored
    middle = edge.at - edge.width * 7.0 * np.log(10.0)
    assert edge.score(theta) - middle == pytest.approx(middle - score, rel=1e-9)


def test_back_and_forth_and_the_slope_at_the_edge_and_on_either_side():
    edge = found(made())
    distance = np.array([-3.0, -1e-3, -1e-9, 0.0, 1e-12, 1e-9, 1e-6, 1e-3, 0.1, 3.0])
    theta = np.ones((len(distance), len(TRUTH) + 2))
    theta[:, edge.preload] = edge.at + distance
    score, step = edge.score(theta), 1e-5
    assert edge.value(score, theta) - edge.at == pytest.approx(distance, rel=1e-6, abs=1e-15)
    slope = (edge.value(score + step, theta) - edge.value(score - step, theta)) / (2.0 * step)
    assert np.exp(edge.log_slope(theta)) == pytest.approx(slope, rel=1e-4)
    assert (np.diff(score) > 0.0).all()


@pytest.mark.parametrize(("share", "lost", "edge"), [(0.06, 0.06, True), (0.04, 0.06, False), (0.06, 0.04, False)])
def test_only_where_the_first_hold_is_seen_to_be_taut_and_to_creep(share, lost, edge):
    """It bears at least a twentieth of the largest tension and loses at least a twentieth of that."""
    of = made()
    sample = of.problem.samples[0]
    readings = sample.readings.copy()
    first = share * readings.max()
    readings[0, :, 0] = np.linspace(first, first * (1.0 - lost), readings.shape[1])
    changed = replace(of.problem, samples=(replace(sample, readings=readings),))
    assert (slack_edge(changed, changed.samples[0]) is not None) is edge
    assert preloads(Transformation(changed)) == int(edge)


@pytest.mark.parametrize(("known", "edge"), [({"setting_sd": 0.0}, None), ({"setting_sd": 0.01}, 0.04)])
def test_without_setting_errors_the_density_does_not_jump(known, edge):
    """A posterior with exact positions is sampled all the same."""
    of = knowing(**known)
    found = slack_edge(of, of.samples[0])
    assert (found and found.width) == edge
    z = Transformation(of).to_sampled(of.prior.rvs(20, np.random.default_rng(0)))
    assert np.isfinite(z).all()


def test_a_known_preload_has_no_coordinate():
    of = knowing(preload=0.3)
    assert slack_edge(of, of.samples[0]) is None


def test_holds_by_themselves_do_without():
    of = made()
    assert slack_edge(replace(of.problem, likelihood="hold"), of.problem.samples[0]) is None
    assert preloads(Transformation(of.problem)) == 1
