"""A joint fit of two lengths, stored and read back at each sample's own length."""

import numpy as np
import pytest

from wirebayes.bayes import result
from wirebayes.bayes.ensemble import Policy
from wirebayes.bayes.fit import fit
from wirebayes.effects.creep import SecondRelaxation, SteadyCreep
from wirebayes.simulate import Bench, Truth, draw
from wirebayes.wire.staircase import simulate

HASTY = Policy(walkers=64, rounds=1, round_steps=2, most_rounds=1, block=2, most_steps=2)
BENCHES = [Bench("short", "line", 800.0), Bench("long", "line", 1700.0)]


@pytest.mark.parametrize("sample", [0, 1])
def test_what_is_read_back_predicts_as_the_joint_fit_does(sample, tmp_path):
    joint = draw(BENCHES, Truth(effects=[SecondRelaxation(), SteadyCreep()]), seed=3).problem
    fitted = fit(joint, 1, policy=HASTY)
    result.save(fitted, tmp_path, {})
    here = joint.samples[sample]
    stored = result.load(tmp_path, here.name)
    theta = np.concatenate(list(fitted.theta))[:20]
    read = {name: values[:20] for name, values in stored.draws.items()}
    expected = simulate(here.protocol, joint.parameters(theta, here), here.model)
    assert simulate(stored.sample.protocol, read, stored.sample.model) == pytest.approx(expected, rel=1e-9)
