"""The smooth remainder: its processes against their covariances, and what they find that one process does not."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.special import logsumexp

from wirebayes.discovery import smooth_reference
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.remainder_evidence import reference_of, remainder_evidence
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io import paper
from wirebayes.io.experiment_file import read_experiments
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth, write_tests

WIRE = paper.experiments()[2]
QUIET = {"k1": 800.0, "B": 0.1, "U": 1.2, "k2": 0.02, "N": 0.8, "sensor_sd": 0.01, "setting_sd": 0.003, "preload": 0.5}


def covariance(functions: np.ndarray, mask: np.ndarray) -> np.ndarray:
    rows = functions[mask]
    return np.asarray(rows @ rows.T)


def test_the_processes_are_products_of_one_over_holds_and_one_over_time() -> None:
    protocol = WIRE.train(4).protocol()  # few enough readings that no function is left out
    mask = protocol.mask
    assert mask.sum() <= smooth_reference.SHORT_FUNCTIONS
    hold, reading = np.nonzero(mask)
    time = np.log1p(
        protocol.time_s[hold, reading] / (0.2 * np.median(protocol.time_s[mask][protocol.time_s[mask] > 0]))
    )
    lengths = [(a, b) for a in (1.5, 4.0, 10.0) for b in (0.7, 2.0, 50.0)]
    for (a, b), functions in zip(lengths, smooth_reference.family(protocol)[1:], strict=True):
        expected = np.exp(
            -0.5 * (np.subtract.outer(hold, hold) / a) ** 2 - 0.5 * (np.subtract.outer(time, time) / b) ** 2
        )
        assert covariance(functions, mask) == pytest.approx(expected, abs=1e-9)


def test_displacements_count_by_the_range_of_all_holds_read_or_not(tmp_path: Path) -> None:
    """Few enough readings that no function is left out; the largest displacement belongs to a hold without one."""
    write_tests(tmp_path, [Bench(displacements_mm=(1, 2, 9, 3), times_s=(0, 60), unrecorded={3})], Truth(QUIET), seed=3)
    protocol = read_experiments(tmp_path / "experiments.toml")[0].protocol()
    mask = protocol.mask
    assert mask.sum() <= smooth_reference.FUNCTIONS and protocol.setting.max() == 9.0
    hold, reading = np.nonzero(mask)
    order, place = hold / 3.0, (protocol.setting[hold] - 1.0) / 8.0
    time = np.log1p(protocol.time_s[hold, reading] / (0.2 * 60.0))

    def smooth(x: np.ndarray, length: float) -> np.ndarray:
        return np.asarray(np.exp(-0.5 * (np.subtract.outer(x, x) / length) ** 2))

    over_holds = 0.5 * smooth(order, 0.3) + 0.5 * np.minimum.outer(order, order) + 0.5 * smooth(place, 0.3)
    expected = over_holds * (0.5 + 0.5 * smooth(time, 0.7))
    assert covariance(smooth_reference.basis(protocol), mask) == pytest.approx(expected, abs=1e-9)


def test_of_many_readings_the_covariance_of_some_gives_nearly_the_best_functions(tmp_path: Path) -> None:
    """Twice as many readings as are decomposed: no functions at all hold more of the variance, these nearly as much."""
    displacements, times = [0.2 * k for k in range(1, 41)], [4.0 * k for k in range(30)]
    write_tests(tmp_path, [Bench(displacements_mm=displacements, times_s=times)], Truth(QUIET), seed=3)
    protocol = read_experiments(tmp_path / "experiments.toml")[0].protocol()
    mask = protocol.mask
    hold, reading = np.nonzero(mask)
    assert len(hold) == 2 * smooth_reference._DECOMPOSED
    time = np.log1p(protocol.time_s[mask] / (0.2 * np.median(protocol.time_s[mask][protocol.time_s[mask] > 0])))
    found = covariance(smooth_reference.family(protocol)[1], mask)
    apart = (np.subtract.outer(hold, hold) / 1.5) ** 2 + (np.subtract.outer(time, time) / 0.7) ** 2
    whole = np.exp(-0.5 * apart)
    values = np.linalg.eigvalsh(whole)
    assert 0.99 * values[-40:].sum() < np.trace(found) < values[-40:].sum() + 1e-6
    assert np.linalg.eigvalsh(whole - found)[0] > -1e-6 * values[-1]


def test_the_evidence_of_several_processes_is_the_mean_of_theirs() -> None:
    block = fitted([WIRE], (), PLAIN_SPEC, np.random.default_rng(0))
    z, family = block.z, smooth_reference.family(WIRE.protocol())
    each = [scan(expand(block.target, z, [], reference=[[f]])).flexible[0] for f in family]
    together = scan(expand(block.target, z, [], reference=[family])).flexible[0]
    assert np.ptp(each) > 1.0
    assert together == pytest.approx(logsumexp(each) - np.log(len(each)))


def disturbed(folder: Path, size_N: float) -> LaplaceFit:
    """The fit of a simulated test in which three holds began with a tension that was off."""
    folder.mkdir()
    write_tests(folder, [Bench(resolution_N=0.01)], Truth(QUIET), seed=3)
    (clean,) = read_experiments(folder / "experiments.toml")
    holds = list(clean.holds)
    for j, share in ((5, 0.6), (6, 1.0), (7, 0.6)):
        off = size_N * share * np.exp(-np.asarray(holds[j].time_s) / 40.0)
        holds[j] = replace(holds[j], readings=np.asarray(holds[j].tension_N) + off)
    return fitted([replace(clean, holds=tuple(holds))], (), PLAIN_SPEC, np.random.default_rng(0))


def test_a_local_deviation_is_a_remainder_that_one_global_process_does_not_see(tmp_path: Path) -> None:
    block = disturbed(tmp_path / "off", 0.12)
    alone = scan(expand(block.target, block.z, [])).flexible[0]
    assert alone < 1.0 < 8.0 < remainder_evidence(block, reference_of(block))
    clean = disturbed(tmp_path / "clean", 0.0)
    assert remainder_evidence(clean, reference_of(clean)) < 0.0
