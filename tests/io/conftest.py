"""What tests of several files begin with."""

import pytest

from tests.simulated import SOFTER
from wirebayes.simulation.synthetic import Bench, Truth, draw


@pytest.fixture(scope="module")
def sound():
    """Protocol and (H, R) tensions of a sound test of 12 holds, resolution 0.01 N."""
    sample = draw([Bench()], Truth(SOFTER), seed=1).problem.samples[0]
    return sample.protocol, sample.readings[..., 0]
