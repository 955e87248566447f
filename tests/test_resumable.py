"""A study that goes on where it ended."""

import json

import pytest

from analyses.resumable import records


def squared(kind, number):
    return {"kind": kind, "number": number, "square": number**2}


def interrupted(kind, number):
    if number == 2:
        raise KeyboardInterrupt
    return squared(kind, number)


@pytest.mark.parametrize("workers", [1, 2])
def test_what_is_in_the_file_is_not_computed_again(tmp_path, workers):
    path, keys = tmp_path / "new" / "cases.jsonl", ("kind", "number")
    cases = [(kind, number) for number in range(4) for kind in "ab"]
    with pytest.raises(KeyboardInterrupt):
        records(path, interrupted, cases, keys)
    assert len(path.read_text().splitlines()) == 4
    path.write_text(path.read_text().replace('"square": 1', '"square": "read"'))
    found = records(path, squared, cases, keys, workers)
    assert [(r["kind"], r["number"]) for r in found] == cases
    assert [r["square"] for r in found] == [0, 0, "read", "read", 4, 4, 9, 9]
    assert [json.loads(line) for line in path.read_text().splitlines()] == found
