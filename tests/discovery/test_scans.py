"""What a scan is made of: what it says of an effect that had been in the readings besides."""

from dataclasses import replace

import numpy as np
import pytest

from analyses.posterior.any_scale import measured
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.noise_integral import Expansion, projected
from wirebayes.discovery.probes import probes
from wirebayes.effects import effect_named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench

WEIGHTS = np.linspace(0.8, 3.2, 11).tolist()
TIMES = np.linspace(0.0, 120.0, 25).tolist()
TRUTH = {"k1": 500.0, "B": 0.3, "U": 0.8, "k2": 0.03, "N": 0.8, "preload": 0.5, "sensor_sd": 0.003, "setting_sd": 0.002}


def toe_under_weights() -> Expansion:
    """A fitted test with the signature of a toe of about a step."""
    hung = measured(Bench("hung", "line", 1000.0, weights_N=WEIGHTS, resolution_mm=0.0, times_s=TIMES), TRUTH, 1)
    block = fitted([hung], (), PLAIN_SPEC, np.random.default_rng(0))
    return expand(block.target, block.z, probes(effect_named("toe"))[2:3])


def test_an_effect_that_the_parameters_take_nearly_all_of_is_seen_where_it_is_large() -> None:
    """Toe under weights: a shift that the preload takes, and a bend. Added to the readings, the scan says the same."""
    x = toe_under_weights()
    found = scan(x)
    seen = []
    for delta in (5.0, 15.0, 40.0):
        added = delta / found.norm[0, 0]
        with_it = replace(x, residual=x.residual + added * x.signatures[..., 0])
        (of_pieces,) = found.pieces.of(0).log_bayes(added)
        assert of_pieces == pytest.approx(scan(with_it).effects[0, 0], abs=1e-6)
        seen.append(of_pieces)
    assert seen == sorted(seen) and seen[-1] > 10.0


def test_a_bend_beside_a_shift_that_the_preload_takes_is_no_less_visible_for_it() -> None:
    """Read often and finely, a toe of one step has a δ of 3, a thousandth of its shift."""
    x = toe_under_weights()
    (left,) = np.sqrt((projected(x, float(x.ratio[0])) ** 2).sum(axis=0))
    assert left < 2e-3 * np.sqrt((x.signatures[0] ** 2).sum())
    assert scan(x).norm[0, 0] == pytest.approx(left, rel=0.3)
