"""Sets of effects: their evidence does not depend on the order in which they were found."""

import numpy as np
import pytest

from tests.simulated import WIRE, simulated_tests
from wirebayes.discovery import screening, stepwise
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.model_space import EffectSet
from wirebayes.discovery.name_evidence import reaches, weigh_names
from wirebayes.discovery.remainder_evidence import reference_of
from wirebayes.discovery.settings import SAME_EVIDENCE, Settings
from wirebayes.discovery.smooth_credit import beside_smooth
from wirebayes.effects import CATALOGUE, effect_named
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.simulation.synthetic import Bench, Truth

UP_AND_DOWN = (*range(1, 11), *range(9, 0, -1))


def plain_fit(bench: Bench, truth: dict[str, float], names: tuple[str, ...]) -> list[LaplaceFit]:
    experiments = simulated_tests([bench], Truth(WIRE | truth, [effect_named(n) for n in names]), seed=3)
    return [fitted(experiments, (), PLAIN_SPEC, np.random.default_rng(0))]


@pytest.mark.parametrize(
    ("truth", "bench"),
    [
        ({"strain_stiffening.c": 6.0, "superposition.omega": 0.5}, Bench(displacements_mm=UP_AND_DOWN)),
        ({"toe.w": 1.0, "sensor_nonlinearity.a": 0.004}, Bench()),
    ],
)
def test_two_effects_have_one_evidence_in_either_order(truth: dict[str, float], bench: Bench) -> None:
    first, second = (name.split(".")[0] for name in truth)
    plain = plain_fit(bench, truth, (first, second))
    settings = Settings(kinds={n: CATALOGUE[n] for n in (first, second)})
    trials, candidates = screening.candidate_probes(plain, settings.kinds)
    data = [scan(expand(plain[0].target, plain[0].z, trials))]
    found = weigh_names(plain, trials, candidates, data, reach=reaches(plain, trials, candidates))
    references = [reference_of(block) for block in plain]
    root = stepwise.FittedSet(EffectSet((), 0.0, {}, None), plain, (), found, ([], []))
    values = []
    for one, other in ((first, second), (second, first)):
        rng = np.random.default_rng(1)
        added = stepwise._fit(root, one, rng, families=(), references=references, settings=settings)
        blocks, (probes, further) = added.blocks, added.probed
        scans = [scan(expand(b.target, b.z, probes)) for b in blocks]
        beside = weigh_names(blocks, probes, further, scans, reach=found.reach)
        values.append(found.log_bayes[one] + beside.log_bayes[other])
    assert values[0] == pytest.approx(values[1], abs=SAME_EVIDENCE)


def test_the_credit_beside_a_smooth_remainder_is_a_ratio_of_two_regressions() -> None:
    """Against the dense covariance of readings that hold the remainder as noise, its size and the noise's known."""
    from wirebayes.discovery import noise_integral, smooth_credit

    block = plain_fit(Bench(), {"toe.w": 1.0}, ("toe",))[0]
    trials, _ = screening.candidate_probes([block], {"toe": CATALOGUE["toe"]})
    x = expand(block.target, block.z, trials)
    ratio, size = 10.0, 8.0
    found = {}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(noise_integral, "RATIOS", np.array([ratio]))
        patch.setattr(smooth_credit, "SIZES", np.array([size]))
        found = beside_smooth(x)
    k = x.left[0] * x.singular[0]
    noise = np.eye(len(k)) + ratio * k @ k.T
    whiten = np.linalg.inv(np.linalg.cholesky(noise))
    # the prior of the parameters as further rows of a regression
    root = np.linalg.cholesky(x.prior_precision[0]).T
    parameters = np.vstack([whiten @ x.parameters[0], root])
    aside = np.linalg.solve(root.T, x.prior_gradient[0])
    basis, _ = np.linalg.qr(parameters)

    def free(columns: np.ndarray, below: np.ndarray) -> np.ndarray:
        whole = np.vstack([whiten @ columns, below])
        return np.asarray(whole - basis @ (basis.T @ whole))

    functions = free(x.flexible[0], np.zeros((len(root), x.flexible.shape[2])))
    signature = free(x.signatures[0], np.zeros((len(root), x.signatures.shape[2])))
    residual = free(x.residual[0][:, None], aside[:, None])[:, 0]
    s2 = size**2 / (functions**2).sum()
    inverse = np.linalg.inv(np.eye(len(functions)) + s2 * functions @ functions.T)
    rss = residual @ inverse @ residual
    for m in range(signature.shape[1]):
        s = signature[:, m]
        b, c = s @ inverse @ residual, s @ inverse @ s
        b = max(b, 0.0) if x.one_sided[m] else b
        absorbed = c <= noise_integral.ABSORBED * (x.signatures[0][:, m] ** 2).sum()
        b = 0.0 if absorbed else b
        assert found[m] == pytest.approx(-0.5 * x.degrees * np.log((rss - b**2 / c) / rss), rel=1e-6, abs=1e-8)
