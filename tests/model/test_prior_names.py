"""A prior that no model has a parameter for is refused: in silence it would count for nothing."""

from pathlib import Path
from typing import Any

import pytest

from tests.model.test_problem import short
from wirebayes.effects import CATALOGUE
from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment
from wirebayes.model.prior_names import check_prior_names
from wirebayes.wire.effect import Amplitude, Effect

KNOWN = {"fixed": 1.0}


class OwnEffect(Effect):
    name = "own_effect"
    amplitudes = (Amplitude("c", "-", 0.0, None),)


def stated(name: str, **fields: Any) -> Experiment:
    return short(priors={name: KNOWN}, source=Path("e.toml"), **fields)


@pytest.mark.parametrize("name", ["k1", "setting_sd", "creep_length_exponent", "toe.w", "grip_slip.w"])
def test_a_prior_of_what_some_model_has_is_no_error(name: str) -> None:
    check_prior_names([stated(name)], CATALOGUE)


def test_a_prior_of_an_own_effect_needs_its_file() -> None:
    check_prior_names([stated("own_effect.c")], CATALOGUE | {"own_effect": OwnEffect})
    with pytest.raises(InputError, match=r"prior\.own_effect\.c: found no such parameter"):
        check_prior_names([stated("own_effect.c")], CATALOGUE)


@pytest.mark.parametrize(("lines", "where"), [({}, "e.toml: prior.k3"), ({"k3": 7}, "e.toml, line 7: prior.k3")])
def test_a_prior_of_nothing_is_refused_with_its_place(lines: dict[str, int], where: str) -> None:
    with pytest.raises(InputError) as error:
        check_prior_names([stated("k3", prior_lines=lines)], CATALOGUE)
    assert str(error.value).startswith(f"{where}: found no such parameter")
    assert "expected one of B, N, U, creep_length_exponent, k1, k2, preload, sensor_sd" in str(error.value)


@pytest.mark.parametrize(
    ("name", "said"),
    [
        ("toes.w", r"found no such parameter \(did you mean toe\.w\?\)"),
        ("toe", r"found no such parameter \(did you mean toe\.w\?\)"),
        ("guide_fricton.mu", r"found no such parameter \(did you mean guide_friction\.mu\?\)"),
        ("toe@strain.w", r"found no such parameter \(did you mean toe\.w\?\)"),
        ("toe.c", r"found no amplitude c of toe, expected toe\.w"),
    ],
)
def test_a_misspelt_effect_is_refused_with_the_nearest_name(name: str, said: str) -> None:
    with pytest.raises(InputError, match=said):
        check_prior_names([stated("k1"), stated(name)], CATALOGUE)
