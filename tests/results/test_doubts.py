"""What a stored posterior has against it: what its fit said, and what a search found that it lacks."""

import json

import pytest

from wirebayes.results.read_back import _failed_in_words, _found_missing


@pytest.mark.parametrize(
    ("verdict", "model", "name", "doubted"),
    [
        ("named", "plain", "wire", True),
        ("unknown", "plain", "wire", True),
        ("nothing-missing", "plain", "wire", False),
        ("named", "final", "wire", False),
        ("named", "plain", "another", False),
    ],
)
def test_a_plain_model_is_doubted_where_a_search_found_something_missing(verdict, model, name, doubted, tmp_path):
    report = {"verdict": verdict, "p_global": 0.003, "p_simulations": 999, "warnings": []}
    (tmp_path / "discovery.json").write_text(json.dumps({"experiments": {"wire": report}}))
    folder = tmp_path / "wire" / model
    folder.mkdir(parents=True)
    found = _found_missing(name, folder)
    assert [notice.kind for notice in found] == ["model-check"] * doubted
    assert all("the plain model of wire lacks what discover found missing (p = 0.003)" in n.text for n in found)


@pytest.mark.parametrize(
    ("model", "verdict", "kinds"),
    [
        ("final", "named", ["incomplete"]),
        ("plain", "named", ["model-check"]),
        ("final", "nothing-missing", ["incomplete"]),  # of samples that differ
        ("plain", "nothing-missing", ["incomplete"]),
    ],
)
def test_a_final_model_is_doubted_where_something_more_is_likely(model, verdict, kinds, tmp_path):
    likely = {"kind": "incomplete", "text": "likely missing too: the readings drift"}
    warnings = [likely, {"kind": "data", "text": "of the readings"}]
    report = {"verdict": verdict, "p_global": 0.003, "p_simulations": 999, "warnings": warnings}
    (tmp_path / "discovery.json").write_text(json.dumps({"experiments": {"wire": report}}))
    folder = tmp_path / "wire" / model
    folder.mkdir(parents=True)
    assert [notice.kind for notice in _found_missing("wire", folder)] == kinds


def test_a_fit_that_no_search_is_part_of_is_not_doubted(tmp_path):
    assert _found_missing("wire", tmp_path / "wire" / "plain") == []


@pytest.mark.parametrize(
    ("p", "said"), [(0.01, "the model fitted to wire does not"), (0.5, "wire was fitted at once with")]
)
def test_a_failed_check_says_whether_samples_differ_or_the_model_fails(p, said):
    check = {"passed": False, "p": p, "alpha": 0.04, "p_alike": 0.002, "simulations": 999}
    assert _failed_in_words(check, "wire").startswith(said)
