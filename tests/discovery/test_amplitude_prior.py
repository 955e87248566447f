"""The prior of amplitudes in a chain of refits, against the determinants of a regression."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy import stats

from tests.simulated import simulated_tests
from wirebayes.discovery import amplitude_prior
from wirebayes.discovery.amplitude_prior import corrections, information
from wirebayes.effects import named
from wirebayes.inference.laplace_fit import fitted
from wirebayes.simulation.synthetic import Bench, Truth
from wirebayes.wire.staircase import simulate

WIRE = {"k1": 900.0, "B": 0.25, "U": 0.5, "k2": 0.02, "N": 0.8, "preload": 0.5, "sensor_sd": 0.006, "setting_sd": 0.008}


def corrected(
    monkeypatch: pytest.MonkeyPatch, before: np.ndarray, after: np.ndarray, theta: float = 3.0, known: bool = False
) -> float:
    """A refit of b beside a, whose amplitude moved from 1 to `theta` and has a normal prior."""
    a, b = (SimpleNamespace(columns=lambda n=n: (n,)) for n in "ab")
    priors = SimpleNamespace(distributions={"a": stats.norm(0.0, 2.0)})
    coordinates = SimpleNamespace(to_natural=lambda z: z)
    old, new = (
        SimpleNamespace(problem=SimpleNamespace(names=names, prior=priors), coordinates=coordinates)
        for names in (("k1", "a"), ("k1", "b", "a"))
    )
    block = SimpleNamespace(target=old, modes=SimpleNamespace(z=np.array([[900.0, 1.0], [0.0, 9.0]])), effects=(a,),
                            experiments=[SimpleNamespace(priors={"a": None} if known else {})])  # fmt: skip
    monkeypatch.setattr(amplitude_prior, "_with", lambda block, found: new)

    def seen(target: Any, theta: np.ndarray, effects: Any) -> np.ndarray:
        return before[: len(effects)] if target is old else after[-len(effects) :, -len(effects) :]

    monkeypatch.setattr(amplitude_prior, "information", seen)
    found: Any = SimpleNamespace(effect=b, blocks=(0,), theta=(np.array([900.0, 0.1, theta]),))
    return corrections([block])(found)  # type: ignore[list-item]


def test_priors_of_a_chain_are_those_of_single_effects(monkeypatch: pytest.MonkeyPatch) -> None:
    """b overlaps with a by .6, so it may be as large beside a as alone; a's noise halves; its density fell by a nat."""
    before, after = np.array([[25.0]]), np.array([[100.0, 30.0], [30.0, 25.0]])
    overlap, smaller, density = -0.5 * np.log(1.0 - 0.6**2), np.log(2.0), 1.0
    assert corrected(monkeypatch, before, after) == pytest.approx(overlap + smaller + density)
    assert corrected(monkeypatch, before, after, theta=1.0) == pytest.approx(overlap + smaller)
    # what other materials know of a shared amplitude is no prior of this kind
    assert corrected(monkeypatch, before, after, known=True) == pytest.approx(0.0)
    # an amplitude that the readings do not show says nothing
    assert corrected(monkeypatch, before, np.diag([25.0, 0.0]), theta=1.0) == pytest.approx(0.0)


def test_information_on_amplitudes_is_that_of_a_regression_beside_everything_else() -> None:
    """Against the dense covariance of the readings; other parameters eliminated with their priors."""
    effects = [named("toe"), named("sensor_nonlinearity")]
    truth = Truth(WIRE | {"toe.w": 1.0, "sensor_nonlinearity.a": 0.004}, effects)
    block = fitted(simulated_tests([Bench()], truth, seed=3), effects, "hooke", "saturating", np.random.default_rng(0))
    target, problem, sample = block.target, block.target.problem, block.target.problem.samples[0]
    z, names = block.modes.z[:1], block.target.problem.names
    unit = np.eye(z.shape[1])

    def readings(z: np.ndarray, displaced: float | np.ndarray = 0.0) -> np.ndarray:
        protocol = replace(sample.protocol, setting=sample.protocol.setting + displaced)
        own = problem.parameters(target.coordinates.to_natural(z), sample)
        return np.asarray(simulate(protocol, own, sample.model)[sample.protocol.mask][:, 0])

    def prior(z: np.ndarray) -> float:
        theta = target.coordinates.to_natural(z)
        return float((target.log_prior(theta) + target.coordinates.log_jacobian(theta, z))[0])

    moving = [i for i, name in enumerate(names) if name not in ("sensor_sd", "setting_sd")]
    h = 1e-5
    slopes = np.stack([readings(z + h * unit[i]) - readings(z - h * unit[i]) for i in moving], axis=1) / (2 * h)
    steps = h * np.eye(len(sample.protocol.setting))
    shifts = np.stack([readings(z, step) - readings(z, -step) for step in steps], axis=1) / (2 * h)
    own = {name: float(v[0]) for name, v in problem.parameters(target.coordinates.to_natural(z), sample).items()}
    variance = own["sensor_sd"] ** 2 + sample.resolution**2 / 12.0
    covariance = variance * np.eye(len(slopes)) + own["setting_sd"] ** 2 * shifts @ shifts.T
    every = slopes.T @ np.linalg.solve(covariance, slopes)
    wide = 1e-3
    bend = [(2 * prior(z) - prior(z + wide * unit[i]) - prior(z - wide * unit[i])) / wide**2 for i in moving]
    of = [moving.index(names.index(e.columns()[0])) for e in effects]
    rest = [i for i in range(len(moving)) if i not in of]
    inner = every[np.ix_(rest, rest)] + np.diag(np.array(bend)[rest])
    across = every[np.ix_(of, rest)]
    scale = [(target.coordinates.to_natural(z + h * unit[moving[i]]) - target.coordinates.to_natural(z))[0, moving[i]]
             / h for i in of]  # fmt: skip
    wanted = (every[np.ix_(of, of)] - across @ np.linalg.solve(inner, across.T)) / np.outer(scale, scale)
    found = information(target, target.coordinates.to_natural(z)[0], effects)
    np.testing.assert_allclose(found, wanted, rtol=1e-3)
    absurd = target.coordinates.to_natural(z)[0]
    absurd[names.index("B")] = np.inf
    with np.errstate(all="ignore"):
        assert (information(target, absurd, effects) == 0.0).all()
