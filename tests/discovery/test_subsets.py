"""Something that may act on any of several materials, against a sum over every choice of them."""

from itertools import combinations
from math import comb

import numpy as np
import pytest

from wirebayes.discovery.subsets import over_subsets


@pytest.mark.parametrize("blocks", [1, 2, 5])
def test_every_number_of_materials_is_as_likely_and_every_choice_of_them(blocks: int) -> None:
    values = np.random.default_rng(blocks).normal(0.0, 4.0, blocks)
    total, acts, most, best = 0.0, np.zeros(blocks), -np.inf, ()
    for n in range(1, blocks + 1):
        for chosen in combinations(range(blocks), n):
            weight = np.exp(values[list(chosen)].sum()) / blocks / comb(blocks, n)
            total += weight
            acts[list(chosen)] += weight
            if weight > most:
                most, best = weight, chosen
    found, each, subset = over_subsets(values)
    assert found == pytest.approx(np.log(total)) and each == pytest.approx(acts / total) and tuple(subset) == best


def test_one_material_is_as_it_would_be_alone() -> None:
    assert over_subsets(np.array([3.7]))[0] == pytest.approx(3.7)


def test_materials_that_show_it_make_it_likelier_in_the_next() -> None:
    """A material that says nothing by itself is believed to have what its four neighbours have."""
    with_neighbours = over_subsets(np.array([8.0, 8.0, 8.0, 8.0, 0.0]))[1][-1]
    without = over_subsets(np.array([8.0, -8.0, -8.0, -8.0, 0.0]))[1][-1]
    assert with_neighbours == pytest.approx(5 / 6, abs=0.01)  # Laplace's rule of succession: (4 + 1) / (4 + 2)
    assert without < 0.4


def test_what_is_impossible_in_every_material_acts_in_none() -> None:
    total, each, _ = over_subsets(np.full(3, -np.inf))
    assert total == -np.inf and each.tolist() == [0.0, 0.0, 0.0]
