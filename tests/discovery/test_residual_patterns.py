"""The sentences of residual patterns, whose size is an amplitude of the logarithm of a parameter."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.rescaled import drawn
from wirebayes.discovery.residual_patterns import COVARIATES, Pattern, _sentence, findings
from wirebayes.model.build import build


@pytest.mark.parametrize(
    ("amplitude", "words"),
    [
        (0.5 * np.log(1.15), "the stiffness k1 grows with displacement, by 15 % over two standard deviations of displ"),
        (-0.5 * np.log(1.25), "the stiffness k1 decreases with displacement, by 20 % over"),  # to 1 / 1.25 of it
        (0.5 * np.log(3.0), "grows with displacement, by a factor of 3 over"),
        (-0.5 * np.log(3.0), "decreases with displacement, by a factor of 3 over"),
    ],
)
def test_a_parameter_that_moves_is_said_to_by_how_much(amplitude: float, words: str) -> None:
    pattern = Pattern(covariate="displacement", moves="k1")
    assert words in _sentence(pattern, amplitude, 0.01)
    assert "no dependence on displacement" in _sentence(pattern, amplitude, 0.2)


@pytest.mark.parametrize(("counts_as", "unit", "size"), [(2e3, "N", "1000 N"), (0.25, "mm", "0.125 mm")])
def test_a_hold_that_lies_off_is_said_to_in_the_unit_of_what_is_read(counts_as: float, unit: str, size: str) -> None:
    pattern = Pattern("hold", hold=3, counts_as=counts_as, unit=unit)
    assert f"hold 3 lies {size} below what the others predict" in _sentence(pattern, -0.5, 0.01)


@pytest.mark.parametrize(("largest", "said"), [(9.0, "(p < 0.01)."), (4.5, "(p = 0.026).")])
def test_a_p_is_said_as_well_as_the_simulations_know_it(largest: float, said: str) -> None:
    """With 499 of them a p of 0.002 says only that none was as large."""
    data = SimpleNamespace(effects=np.array([[largest]]), amplitude=np.array([[0.1]]))
    simulated = np.where(np.arange(499) < 12, 5.0, 1.0)[:, None]
    (found,) = findings([Pattern("tension")], 0, data, SimpleNamespace(effects=simulated), "wire")
    assert found["sentence"] == f"wire: the residuals of the plain model depend on tension {said}"


@pytest.mark.parametrize("index", [0, 1])
def test_displacements_and_tensions_are_what_they_are_under_weights_too(index: int) -> None:
    sample = build([drawn(index).experiments[0]]).samples[0]
    set_, read = sample.protocol.setting[:, None], sample.readings[..., 0]
    displacement, tension = (read, set_) if sample.protocol.control == "force" else (set_, read)
    assert np.array_equal(COVARIATES["displacement"](sample), displacement)
    assert np.array_equal(COVARIATES["tension"](sample), tension)
