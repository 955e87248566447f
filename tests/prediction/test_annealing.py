"""Ratios of integrals by steps, against normals whose integrals are known."""

import numpy as np
import pytest

from wirebayes.prediction import annealing
from wirebayes.prediction.annealing import log_ratio_of_integrals

D = 4


def normal(z: np.ndarray, centre: float, width: float, log_integral: float) -> np.ndarray:
    away = (z - centre) / width
    return log_integral - 0.5 * (away**2).sum(axis=1) - D * np.log(width * np.sqrt(2.0 * np.pi))


def ratio(seed: int, centre: float = 8.0, width: float = 0.3) -> tuple[float, np.ndarray]:
    """From a standard normal to a narrow one whose integral is e^-7, where no draw of the first has ever been."""
    rng = np.random.default_rng(seed)
    return log_ratio_of_integrals(
        lambda z: (normal(z, 0.0, 1.0, 0.0), normal(z, centre, width, -7.0)), rng.normal(size=(3000, D)), rng
    )


def test_a_far_density_has_its_integral_and_its_draws() -> None:
    found = [ratio(seed) for seed in range(4)]
    assert np.mean([value for value, _ in found]) == pytest.approx(-7.0, abs=0.25)
    z = found[0][1]
    np.testing.assert_allclose(z.mean(axis=0), 8.0, atol=0.05)
    np.testing.assert_allclose(z.std(axis=0), 0.3, rtol=0.15)


def test_without_moves_it_would_be_far_off(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(annealing, "_MOVES", 0)
    monkeypatch.setattr(annealing, "_STEPS", 400)
    assert not abs(ratio(0)[0] + 7.0) < 5.0


def test_places_where_the_second_density_is_zero_are_left_out() -> None:
    """Half of a standard normal: half the integral."""
    rng = np.random.default_rng(1)
    value, z = log_ratio_of_integrals(
        lambda z: (normal(z, 0.0, 1.0, 0.0), np.where(z[:, 0] > 0, normal(z, 0.0, 1.0, 0.0), -np.inf)),
        rng.normal(size=(4000, D)),
        rng,
    )
    assert value == pytest.approx(np.log(0.5), abs=0.05) and (z[:, 0] > 0).all()


def test_too_many_steps_give_no_number(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(annealing, "_STEPS", 2)
    assert np.isnan(ratio(0)[0])
