"""What is more likely missing than not beside what was named is said, and only where the final model lacks it."""

import pytest

from wirebayes.discovery.apart import APART
from wirebayes.discovery.doubts import lengths_or_samples, likely_beside, samples_differ
from wirebayes.discovery.settings import REMAINS
from wirebayes.effects import effect_named
from wirebayes.simulation.synthetic import Bench

ABOVE, BELOW = REMAINS + 0.01, REMAINS - 0.01


def _found(drift=BELOW, established=False, remains=BELOW, **changes):
    toe = {"members": ["toe"], "inclusion": 0.95, "established": True, "sentence": "there is toe, 95 %"}
    slow = {"members": ["sensor_drift"], "inclusion": drift, "established": established, "sentence": "readings drift"}
    found = {"verdict": "named", "accepted": ["toe"], "set": ["toe"], "families": [toe, slow]}
    return found | {"remainder": {"probability": remains}} | changes


def test_a_likely_family_and_a_likely_remainder_are_said_in_one_notice():
    (notice,) = likely_beside(_found(drift=ABOVE, remains=0.624))
    assert notice.kind == "incomplete"
    assert (
        "readings drift; something that no effect explains remains, 62 %; the final model does without" in notice.text
    )


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, False),
        ({"drift": ABOVE}, True),
        ({"remains": ABOVE}, True),
        ({"drift": ABOVE, "established": True}, False),
        ({"drift": ABOVE, "accepted": ["toe", "sensor_drift"]}, False),
        ({"drift": ABOVE, "verdict": "ambiguous"}, True),
        ({"drift": ABOVE, "verdict": "ambiguous", "set": ["toe", "sensor_drift"]}, False),
        ({"drift": ABOVE, "verdict": "partial"}, False),
        ({"drift": ABOVE, "verdict": "unknown"}, False),
        ({"drift": ABOVE, "verdict": "nothing-missing"}, False),
    ],
)
def test_it_is_said_where_the_final_model_lacks_it(changes, said):
    assert bool(likely_beside(_found(**changes))) is said


@pytest.mark.parametrize(("p", "said"), [(0.002, True), (APART, True), (APART + 0.002, False), (None, False)])
def test_that_samples_differ_is_said_where_they_do(p, said):
    """Four plain specimens whose k1 differed by 4 % were told that something unknown is missing."""
    notices = samples_differ(p, ["a", "b"])
    assert [notice.kind for notice in notices] == ["incomplete"] * said
    assert all("the 2 samples differ (p" in n.text and "(--experiment a)" in n.text for n in notices)


@pytest.mark.parametrize(
    ("lengths", "names", "said"),
    [
        ((1000.0, 1700.0), ["fixture_compliance"], "fixture compliance can show only"),
        ((1000.0, 1700.0), ["toe", "length_dependence@B"], "length dependence can show only"),
        ((1000.0, 1700.0), ["toe", "grip_slip@3", "sensor_drift"], ""),
        ((1000.0, 1700.0, 1700.0), ["fixture_compliance"], ""),  # two of one length show whether samples differ
        ((1000.0,), ["toe"], ""),
    ],
)
def test_one_sample_of_each_length_does_not_tell_an_effect_of_the_length_from_samples_that_differ(lengths, names, said):
    """Samples whose k1 differed by 10 % were told of a bench that deforms, 96 %, without a word."""
    experiments = []
    for length in lengths:
        bench = Bench(name=f"w{len(experiments)}", length_mm=length)
        experiments.append(bench.experiment())
    notices = lengths_or_samples([effect_named(name) for name in names], experiments)
    assert [notice.kind for notice in notices] == ["incomplete"] * bool(said)
    assert all(said in notice.text for notice in notices)
