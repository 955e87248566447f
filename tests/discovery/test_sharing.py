"""An instrument's amplitude over several materials, against one fit of everything at once."""

from pathlib import Path

import numpy as np
import pytest

from wirebayes.discovery.sharing import _known, _table, informed
from wirebayes.effects import named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment, read_experiments
from wirebayes.simulation.synthetic import Bench, Truth, write

WIRE = {"U": 0.6, "B": 0.08, "k2": 0.02, "N": 0.7, "preload": 0.5, "sensor_sd": 0.01, "setting_sd": 0.01}


def fit(experiments: list[Experiment], effect: str) -> LaplaceFit:
    return fitted(experiments, [named(effect)], "hooke", "saturating", np.random.default_rng(0))


@pytest.mark.parametrize(
    ("name", "size"), [("sensor_nonlinearity", -0.006), ("lost_motion", 0.05)], ids=["either sign", "one-sided"]
)
def test_each_material_knows_what_a_fit_of_all_at_once_knows(tmp_path: Path, name: str, size: float) -> None:
    steps = (1, 2, 3, 4, 5, 6, 5, 4, 3, 4, 5, 6)
    benches = [Bench(name=f"on-{m}", material=m, displacements_mm=steps) for m in ("soft", "stiff")]
    amplitude = named(name).columns()[0]
    write(tmp_path, benches, Truth(WIRE | {"k1[soft]": 700.0, "k1[stiff]": 2500.0, amplitude: size}, [named(name)]), 0)
    experiments = read_experiments(tmp_path / "experiments.toml")
    alone = [fit([e], name) for e in experiments]
    mean, sd = _known(fit(experiments, name), named(name))
    shared = informed(alone, dict.fromkeys((0, 1), named(name)), np.random.default_rng(1))
    after = [_known(b, named(name)) for b in shared]
    assert max(_known(b, named(name))[1] for b in alone) > 1.15 * sd  # there is something to be told
    for own_mean, own_sd in after:
        assert own_mean == pytest.approx(mean, abs=0.2 * sd)
        assert own_sd == pytest.approx(sd, rel=0.1)


def test_what_is_hardly_known_of_a_one_sided_amplitude_is_not_handed_on() -> None:
    assert _table(named("lost_motion"), 0.01, 0.01) is None
    known = _table(named("lost_motion"), 0.5, 0.125)
    assert known == {"distribution": "log-normal", "median": 0.5, "sd_log": 0.25}
    assert _table(named("sensor_drift"), 0.01, 0.01) == {"distribution": "normal", "mean": 0.01, "sd": 0.01}
