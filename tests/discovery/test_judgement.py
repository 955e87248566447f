"""The verdict as a function of evidence: each threshold, and what holds for any evidence whatever."""

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wirebayes.discovery.judgement import Evidence, FamilyEvidence, verdict_on

ONE = FamilyEvidence({"a": 0.95}, 0.95, 10.0)
OPEN = FamilyEvidence({"b": 0.6, "c": 0.35}, 0.95, 10.0)
EVIDENCE = Evidence(0.01, 0.0, (ONE,), {"a": 0.95, "unknown": 0.05}, 10.0, 0.1, None)

probability = st.floats(0.0, 1.0)
gain = st.none() | st.floats(-30.0, 30.0)


@st.composite
def families(draw: st.DrawFn) -> tuple[FamilyEvidence, ...]:
    out = []
    for letter in draw(st.lists(st.sampled_from("abcd"), unique=True)):
        inclusion = draw(probability)
        shares = [draw(st.floats(0.01, 1.0)) for _ in range(draw(st.integers(1, 4)))]
        each = {f"{letter}{k}": inclusion * v / sum(shares) for k, v in enumerate(shares)}
        members = dict(sorted(each.items(), key=lambda item: -item[1]))
        out.append(FamilyEvidence(members, inclusion, draw(gain)))
    return tuple(out)


@st.composite
def any_evidence(draw: st.DrawFn) -> Evidence:
    named = draw(families())
    names = [name for family in named for name in family.members]
    raw = {name: draw(st.floats(0.0, 1.0)) for name in [*names, "unknown"]}
    total = sum(raw.values()) or 1.0
    return Evidence(
        draw(probability),
        draw(probability),
        named,
        {n: v / total for n, v in raw.items()},
        draw(gain),
        draw(probability),
        draw(gain),
    )


@settings(max_examples=500, deadline=None)
@given(any_evidence())
def test_whatever_the_evidence_the_order_of_verdicts_holds(found: Evidence) -> None:
    """Above all: *unknown* is never said where a family is established, and nothing blocks it that earns nothing."""
    judged = verdict_on(found)
    sure = [f for f in found.families if f.inclusion >= 0.9 and f.gain is not None and f.gain > 4.0]
    counts = found.remainder > 0.5 and found.remainder_gain is not None and found.remainder_gain > 4.0
    assert (judged.verdict == "nothing-missing") == (found.p > 0.04 or (found.nothing > 0.5 and not sure))
    if judged.verdict == "nothing-missing":
        assert not judged.undecided
        return
    one_name = [max(f.members.values()) >= 0.9 * f.inclusion for f in sure]
    if sure:
        assert judged.verdict == ("partial" if counts else "named" if all(one_name) else "ambiguous")
        first = next((tuple(f.members) for f, one in zip(sure, one_name, strict=True) if not one), ())
        assert judged.undecided == first
    elif judged.verdict == "ambiguous":
        assert found.shares["unknown"] <= 0.1 and found.best_gain is not None and found.best_gain > 4.0
        assert judged.undecided and "unknown" not in judged.undecided
        named = sum(found.shares.values()) - found.shares["unknown"]
        assert sum(found.shares[name] for name in judged.undecided) >= min(0.9, named) - 1e-9
    else:
        assert judged.verdict == "unknown"


@pytest.mark.parametrize(
    ("changes", "verdict"),
    [
        ({}, "named"),
        ({"p": 0.0400001}, "nothing-missing"),
        ({"p": 0.04}, "named"),
        ({"families": (replace(ONE, inclusion=0.9),)}, "named"),
        ({"families": (replace(ONE, gain=4.0),), "best_gain": 4.0}, "unknown"),
        ({"families": (replace(ONE, gain=4.0),)}, "ambiguous"),  # the mixture does not predict, the best name does
        ({"families": (replace(ONE, gain=None),), "best_gain": None}, "unknown"),  # too few holds to ask
        ({"families": (replace(ONE, inclusion=0.8999),), "shares": {"a": 0.89, "unknown": 0.11}}, "unknown"),
        ({"families": (replace(ONE, inclusion=0.8999),), "shares": {"a": 0.91, "unknown": 0.09}}, "ambiguous"),
        ({"remainder": 0.51, "remainder_gain": 4.1}, "partial"),
        ({"remainder": 0.5, "remainder_gain": 4.1}, "named"),
        ({"remainder": 0.99, "remainder_gain": 4.0}, "named"),  # it earns nothing, so it blocks nothing
        ({"remainder": 0.99, "remainder_gain": None}, "named"),
        ({"families": (OPEN,)}, "ambiguous"),
        ({"families": (ONE, OPEN)}, "ambiguous"),
        ({"families": (OPEN,), "remainder": 0.9, "remainder_gain": 9.0}, "partial"),
        ({"nothing": 0.51, "families": (replace(ONE, inclusion=0.3),)}, "nothing-missing"),
    ],
)
def test_verdicts_turn_at_their_thresholds(changes: dict, verdict: str) -> None:
    assert verdict_on(replace(EVIDENCE, **changes)).verdict == verdict


def test_effects_alone_hold_nine_tenths_of_the_probability_where_none_is_established() -> None:
    """Whether something unknown is the second or the last of the probabilities."""
    shares = {"a": 0.86, "unknown": 0.08, "b": 0.05, "c": 0.01}
    assert verdict_on(replace(EVIDENCE, families=(), shares=shares)).undecided == ("a", "b")


def test_a_family_is_undecided_where_no_member_holds_nine_tenths_of_it() -> None:
    assert verdict_on(replace(EVIDENCE, families=(ONE, OPEN))).undecided == ("b", "c")
    nearly = FamilyEvidence({"b": 0.9 * 0.95, "c": 0.1 * 0.95}, 0.95, 10.0)
    assert nearly.name == "b" and verdict_on(replace(EVIDENCE, families=(nearly,))).verdict == "named"
    assert FamilyEvidence({"b": 0.899 * 0.95, "c": 0.101 * 0.95}, 0.95, 10.0).name is None
