"""Work spread over processes: in order, for any amount of it, with effects that only a user's file has."""

from functools import partial
from pathlib import Path

import pytest

from wirebayes.effects import catalogue
from wirebayes.workers import workers

OWN = Path(__file__).parents[1] / "docs" / "own_effect.py"


@pytest.mark.parametrize("pieces", [0, 1, 5])
def test_answers_come_in_order_for_any_amount_of_work(pieces: int) -> None:
    with workers(pieces) as parallel_map:
        assert list(parallel_map(divmod, range(pieces), [2] * pieces)) == [divmod(i, 2) for i in range(pieces)]


def test_processes_know_a_users_own_effects() -> None:
    known = catalogue(OWN)
    [name] = known.keys() - catalogue().keys()
    with workers(prepare=partial(catalogue, OWN)) as parallel_map:
        [columns] = parallel_map(known[name].columns, [known[name]()])
    assert columns == known[name]().columns()


def test_an_error_in_a_process_arrives() -> None:
    with workers(2) as parallel_map, pytest.raises(ZeroDivisionError):
        list(parallel_map(divmod, [1, 1], [1, 0]))
