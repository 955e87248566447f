"""The power of tension that suits measured losses: its limits for slow and for fast creep, and the ridge it follows."""

import numpy as np
import pytest

from wirebayes.inference.coordinates.power_of_tension import suiting_powers
from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.simulation.synthetic import Bench, Truth, draw
from wirebayes.wire.staircase import simulate

FORCE = np.array([1.0, 2.0, 3.5, 5.0, 8.0, 12.0])
MIDDLE, SPREAD = np.log(0.7), 0.5


def powers(lost, N=0.5):
    return suiting_powers(lost, np.log(FORCE), np.full(len(FORCE), 2.0), N, MIDDLE, SPREAD)


@pytest.mark.parametrize("U", [0.4, 0.9])
def test_slow_creep_loses_in_proportion_to_the_power_and_fast_creep_to_its_step(U):
    _, slow = powers(3.0 * FORCE**U)
    _, fast = powers(3.0 * np.diff(FORCE**U, prepend=0.0))
    assert np.exp([slow[0], fast[-1]]) == pytest.approx(U, rel=0.01)


@pytest.mark.parametrize("unknown", [[], [2]])
def test_losses_of_the_creep_law_give_its_power_at_its_hazard(unknown):
    hazard, U, N, carried, lost = -1.0, 0.6, 0.5, 0.0, []
    share = 1.0 - np.exp(-np.exp(hazard) * 2.0**N)
    for force in FORCE:
        lost.append((force**U - carried) * share)
        carried += lost[-1]
    lost = np.array(lost)
    lost[unknown] = np.nan
    log_hazards, found = powers(lost, N)
    assert np.exp(np.interp(hazard, log_hazards, found)) == pytest.approx(U, rel=0.01)
    assert (np.diff(found) > -1e-9).all() and np.ptp(np.exp(found)) > 0.4  # the faster, the larger


@pytest.mark.parametrize(
    "lost", [np.zeros(6), np.array([1.0, np.nan, np.nan, 2.0, np.nan, np.nan]), np.full(6, np.nan)]
)
def test_where_losses_say_nothing_it_is_the_middle_of_the_prior(lost):
    assert powers(lost)[1] == pytest.approx(MIDDLE)


def test_along_the_coordinate_of_the_rate_losses_keep_their_proportions():
    truth = {"k1": 800.0, "B": 0.1, "U": 0.6, "k2": 0.03, "N": 0.7, "preload": 0.5, "sensor_sd": 1e-4}
    made = draw([Bench(resolution_N=0.0)], Truth(truth | {"setting_sd": 1e-3}), 1)
    coordinates, names, sample = Transformation(made.problem), made.problem.names, made.problem.samples[0]
    theta, z = (np.repeat(a, 9, axis=0) for a in (made.theta, coordinates.to_sampled(made.theta)))
    steps = np.linspace(-2.0, 2.0, 9)
    z[:, names.index("k2")] += steps
    theta[:, names.index("k2")] *= np.exp(steps)

    def proportions(rows):
        tension = simulate(sample.protocol, made.problem.parameters(rows, sample), sample.model)
        lost = np.log(tension[:, 0] - tension[:, -1])
        return lost - lost.mean(axis=0)

    assert proportions(coordinates.to_natural(z)).std(axis=1).max() < 0.3 * proportions(theta).std(axis=1).max()
