"""Where holds are read late, or under weights, coordinates are what the readings show."""

import numpy as np
import pytest

from wirebayes.inference.coordinates.transform import Transformation
from wirebayes.inference.log_posterior import LogPosterior
from wirebayes.model.problem import Problem
from wirebayes.numeric.typing import Array
from wirebayes.simulation.synthetic import Bench, Truth, draw
from wirebayes.wire.staircase import simulate

WEIGHTS_N = (4.0, 8.0, 12.0, 16.0)
EXACT = {"sensor_sd": 1e-4, "setting_sd": 1e-4}


def problem(*times_s: float) -> Problem:
    return draw([Bench(weights_N=WEIGHTS_N, times_s=times_s, resolution_mm=0.0)], Truth(EXACT), seed=2).problem


def parameters(of: Problem, **values: float | Array) -> Array:
    """(n, d) parameters, those that are not named alike."""
    usual = {"k1": 900.0, "B": 0.2, "U": 0.8, "k2": 0.03, "N": 0.8, "preload": -3.0, **EXACT}
    return np.column_stack(np.broadcast_arrays(*((usual | values)[name] for name in of.names))).astype(float)


def readings(of: Problem, theta: Array) -> Array:
    """(H, R, n) displacements without errors, mm."""
    (sample,) = of.samples
    return simulate(sample.protocol, of.parameters(theta, sample), sample.model)


def shown(of: Problem, theta: Array) -> Array:
    """(n,) root mean square of what displacements gain from the first to the last reading of a hold, mm."""
    every = readings(of, theta)
    return np.sqrt(((every[:, -1] - every[:, 0]) ** 2).mean(axis=0))


@pytest.mark.parametrize(("times_s", "uncounted"), [((0.0, 50.0, 100.0), 0.0), ((20.0, 50.0, 100.0), 0.05)])
def test_the_coordinate_of_the_creep_is_what_the_readings_show_of_it(
    times_s: tuple[float, ...], uncounted: float
) -> None:
    of = problem(*times_s)
    stiff = 1e9  # creep is stretched, too, by a share of its own that hardly changes
    theta = parameters(of, k1=stiff, k2=np.geomspace(0.003, 0.1, 9), N=np.linspace(0.5, 1.1, 9))
    z = Transformation(of).to_sampled(theta)[:, of.names.index("B")]
    beyond = np.exp(z) / shown(of, theta) - 1.0
    from_the_start = shown(problem(0.0, 100.0), theta) / shown(of, theta) - 1.0
    assert beyond == pytest.approx(uncounted * from_the_start, rel=0.02, abs=1e-7)


def test_creep_that_is_over_before_a_first_reading_has_a_coordinate() -> None:
    """It is its twentieth part: a coordinate of nothing would send B beyond all numbers."""
    of = problem(20.0, 50.0, 100.0)
    theta = parameters(of, k2=10.0, N=1.0, U=1.0)
    z = Transformation(of).to_sampled(theta)[0, of.names.index("B")]
    assert np.exp(z) == pytest.approx(0.05 * 0.2 * 4.0, rel=1e-6)


def test_before_a_first_reading_creep_in_place_of_elastic_stretch_leaves_the_coordinate_of_k1() -> None:
    of = problem(20.0, 50.0, 100.0)
    (sample,) = of.samples
    length = sample.protocol.length_mm
    B = np.array([0.0, 0.3, 0.6])
    k1 = length / (length / 900.0 - B)
    theta = parameters(of, k1=k1, B=np.maximum(B, 1e-12), U=1.0, k2=10.0, N=1.0)
    assert np.ptp(readings(of, theta), axis=-1).max() < 0.02 * WEIGHTS_N[-1] * B[-1]  # but for the stretch of the creep
    column = of.names.index("k1")
    assert np.exp(Transformation(of).to_sampled(theta)[:, column]) == pytest.approx(900.0, rel=1e-9)


def test_the_coordinate_of_a_preload_is_the_mean_of_last_readings() -> None:
    of = problem(5.0, 50.0, 100.0)
    theta = parameters(of, k1=np.geomspace(500.0, 2000.0, 5), k2=np.geomspace(0.003, 0.1, 5), preload=np.arange(5.0))
    coordinates = Transformation(of)
    column = of.names.index("preload")
    z = coordinates.to_sampled(theta)[:, column]
    assert -z * coordinates.scale[column] == pytest.approx(readings(of, theta)[:, -1].mean(axis=0), rel=1e-9)


@pytest.mark.parametrize("weights", [False, True])
def test_creep_in_place_of_stretch_and_preload_leaves_their_coordinates(weights: bool) -> None:
    """All creep over before it is read: a straight line through it adds to compliance and preload, whatever U is."""
    made = draw([Bench(displacements_mm=(4.0, 8.0, 12.0, 16.0), times_s=(20.0, 50.0), resolution_N=0.0)], Truth(EXACT))
    of = problem(20.0, 50.0) if weights else made.problem
    (sample,) = of.samples
    length, tension = sample.protocol.length_mm, np.array(WEIGHTS_N)
    if not weights:
        sample.readings[..., 0] = tension[:, None]
    B = np.array([0.0, 0.3, 0.6])
    slope, beside = np.polyfit(tension, tension**0.7, 1)
    theta = parameters(of, k1=length / (length / 900.0 - slope * B), B=np.maximum(B, 1e-12), U=0.7, k2=10.0, N=1.0)
    theta[:, of.names.index("preload")] += beside * B
    coordinates, preload, k1 = Transformation(of), of.names.index("preload"), of.names.index("k1")
    z = coordinates.to_sampled(theta)
    assert np.ptp(theta[:, k1]) > 200.0
    assert np.exp(z[:, k1]) == pytest.approx(900.0, rel=1e-9)
    # but for the stretch of the creep itself, of a hundredth
    assert np.ptp(z[:, preload]) * coordinates.scale[preload] < 0.05 * np.ptp(theta[:, preload])


def test_a_creep_beyond_the_whole_compliance_is_of_no_wire() -> None:
    of = problem(20.0, 50.0, 100.0)
    target, column = LogPosterior(of), of.names.index("k1")
    z = target.coordinates.to_sampled(parameters(of))
    softer = np.repeat(z, 2, axis=0)
    softer[1, column] += 10.0
    assert np.isfinite(target(softer)).tolist() == [True, False]
