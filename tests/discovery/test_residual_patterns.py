"""The sentences of residual patterns, whose size is an amplitude of the logarithm of a parameter."""

import numpy as np
import pytest

from wirebayes.discovery.residual_patterns import Pattern, _sentence


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
    assert words in _sentence(pattern, amplitude, 0.01, "wire")
    assert "no dependence on displacement" in _sentence(pattern, amplitude, 0.2, "wire")
