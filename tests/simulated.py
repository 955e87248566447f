"""Simulated tests as experiments, without files."""

from collections.abc import Sequence
from dataclasses import replace

from wirebayes.io.experiment import Experiment
from wirebayes.numeric.frozen import frozen
from wirebayes.simulation.synthetic import Bench, Truth, draw

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.5, "k2": 0.02, "N": 0.8, "preload": 0.5, "sensor_sd": 0.006, "setting_sd": 0.008}
SOFTER = {"k1": 700.0, "B": 0.2, "U": 0.4, "k2": 0.02, "N": 0.9, "preload": 0.5, "sensor_sd": 0.006, "setting_sd": 0.02}


def simulated_tests(benches: Sequence[Bench], truth: Truth, seed: int) -> list[Experiment]:
    """What `simulate` would write, rounded as the benches say."""
    out = []
    samples = draw(benches, truth, seed).problem.samples
    for bench, sample in zip(benches, samples, strict=True):
        test = bench.experiment()
        rows = zip(test.holds, sample.readings[..., 0], sample.protocol.mask, strict=True)
        out.append(replace(test, holds=tuple(replace(h, readings=frozen(y[kept].tolist())) for h, y, kept in rows)))
    return out
