"""Scores on made-up answers whose rates are known by hand."""

import json

import pytest
from scipy.stats import binom, norm

from analyses.hidden_effects import page
from analyses.hidden_effects import pooled as program
from analyses.hidden_effects import several as names_and_remainders
from analyses.hidden_effects.catalogue import EFFECTS
from analyses.hidden_effects.pooled import stated_lines
from analyses.hidden_effects.rates import (
    closed,
    closed_of_oracle,
    lower_bound,
    pooled,
    rate,
    rmse_ratio,
    upper_bound,
    weighted_rate,
)
from analyses.hidden_effects.score import confusion, score
from analyses.hidden_effects.stated import apart, families, names, prior_weights, remainders
from analyses.hidden_effects.targets import targets

HOLDS = {"sample-1": [9, 10]}


def truth(key, kind="single", name="toe", delta=10.0):
    effects = [] if kind == "clean" else [{"name": name, "hold": None, "experiments": ["sample-1"]}]
    return {
        "key": key,
        "kind": kind,
        "protocol": "paper",
        "delta": delta if effects else 0.0,
        "law": "gaussian",
        "effects": effects,
        "benches": {"sample-1": {}},
    }


def judged(group=("toe",)):
    return {
        "bench": "sample-1",
        "groups": [list(group)],
        "separable": True,
        "delta_after_refit": 10.0,
        "optimal": {"top1": 0.8, "set_size": 1.5},
        "held_out_holds": HOLDS,
        "held_out": {"plain": 3.0, "oracle": 1.0, "floor": 1.0},
    }


def answer(best, members=(), final=2.0):
    verdict = "nothing-missing" if best is None else "unknown" if best == "unknown" else "named"
    spoken = {
        "verdict": verdict,
        "best": best,
        "set": list(members),
        "group": list(members),
        "accepted": [best],
        "held_out": {"holds": [9, 10], "plain": {"rmse_N": 3.0}, "final": {"rmse_N": final}},
    }
    return {"answer": {"experiments": {"sample-1": spoken}}, "error": None, "seconds": 1.0}


def found(result, start, which="targets"):
    return next(row for row in result[which] if row["target"].startswith(start))


def test_bounds_are_clopper_pearson():
    assert binom.cdf(3, 100, upper_bound(3, 100)) == pytest.approx(0.05, abs=1e-6)
    assert binom.sf(2, 100, lower_bound(3, 100)) == pytest.approx(0.05, abs=1e-6)
    assert upper_bound(5, 5) == 1.0 and lower_bound(0, 5) == 0.0
    assert rate([]) is None


def test_rates_of_named_missed_and_wrong():
    truths = {k: truth(k) for k in "abcd"}
    answers = {
        "a": answer("toe", ["toe", "superposition"]),
        "b": answer("superposition", ["superposition"]),
        "c": answer(None),
        "d": answer("ageing", ["ageing", "toe"]),
    }
    result = score(truths, dict.fromkeys("abcd", judged(("toe", "ageing"))), answers)
    assert found(result, "detected at delta 10")["found"]["value"] == 0.75
    assert found(result, "top-ranked effect in the true group, delta 10")["found"]["value"] == pytest.approx(2 / 3)
    assert found(result, "90 % set contains the true effect, delta 10")["found"]["value"] == pytest.approx(2 / 3)
    assert found(result, "top-ranked effect correct, separable")["found"]["value"] == pytest.approx(1 / 3)
    assert found(result, "top-ranked effect correct, relative to Bayes")["found"]["value"] == pytest.approx(1 / 2.4)
    assert found(result, "size of the 90 % set")["found"]["value"] == pytest.approx(5 / 3 - 1.5)
    assert result["confusion"]["toe"] == {"toe": 1, "superposition": 1, "nothing-missing": 1, "ageing": 1}
    assert not found(result, "detected at delta 10")["passed"]


def test_runs_pooled_count_together_and_what_is_missed_is_bold(tmp_path, capsys, monkeypatch):
    for name, best in (("one", "toe"), ("other", None)):
        part = score({name: truth(name)}, {name: judged()}, {name: answer(best, ["toe"])})
        (tmp_path / name).write_text(json.dumps({"api": part}), encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["pooled", str(tmp_path / "one"), str(tmp_path / "other")])
    program.main()
    cells = capsys.readouterr().out.split("\n   * - ")
    (detected,) = (c for c in cells if c.startswith("detected at δ = 10"))
    assert "≥ 99 %" in detected and "**50 %**" in detected and "of 2" in detected
    (named,) = (c for c in cells if c.startswith("top-ranked effect in the true group, δ = 10"))
    assert "100 %" in named and "**" not in named and "of 1" in named
    assert not any("delta" in c or "clean" in c for c in cells)  # nothing was asked of clean files


def test_false_alarms_need_numbers_to_pass():
    few = {f"c{i}": truth(f"c{i}", "clean") for i in range(50)}
    many = {f"c{i}": truth(f"c{i}", "clean") for i in range(700)}
    quiet = answer(None, final=3.0)
    for truths, loud, passed in ((few, 0, False), (many, 20, True), (many, 60, False)):
        answers = {k: answer("toe") if i < loud else quiet for i, k in enumerate(truths)}
        row = found(score(truths, dict.fromkeys(truths, judged()), answers), "false alarms")
        assert row["found"]["k"] == loud
        assert row["passed"] is passed


def test_a_column_that_no_row_fills_is_not_printed():
    lines = [["", "wanted", "found", "again"], ["a", "1", "2", ""]]
    assert program._without_empty_column("4 3 2 1", lines) == ("4 3 2", [["", "wanted", "found"], ["a", "1", "2"]])
    seen = [*lines, ["b", "1", "2", "3"]]
    assert program._without_empty_column("4 3 2 1", seen) == ("4 3 2 1", seen)


def test_gap_is_pooled_in_noise_floors():
    sums = [90.0, 40.0, 90.0, 10.0]  # ten cases: plain 9, final 4, judge's plain 9, oracle 1, floor 1
    assert closed(sums, 10) == pytest.approx(50 / 80)
    assert closed_of_oracle(sums, 10) == pytest.approx(50 / 80)
    assert rmse_ratio(sums, 10) == pytest.approx(2 / 3)
    rows = [{"held_out": {"plain": 9.0, "final": 4.0, "judge_plain": 9.0, "oracle": 1.0, "same_holds": 1.0}}] * 10
    assert pooled(rows, closed)["value"] == pytest.approx(50 / 80)
    assert pooled(rows[:2], closed) is None


def test_unknown_counts_where_the_form_is_in_no_catalogue():
    truths = {k: truth(k, "foreign", "worn_thread") for k in "abc"}
    answers = {"a": answer("unknown"), "b": answer("superposition", ["superposition"]), "c": answer("toe", ["toe"])}
    result = score(truths, dict.fromkeys("abc", judged(("worn_thread", "toe"))), answers)
    assert found(result, "effect in no catalogue")["found"]["value"] == pytest.approx(2 / 3)


def test_cases_the_refitted_plain_model_swallows_are_also_shown_apart():
    truths = {k: truth(k) for k in "ab"}
    swallowed = judged() | {"delta_after_refit": 2.0}
    answers = {"a": answer("toe", ["toe"]), "b": answer(None)}
    result = score(truths, {"a": judged(), "b": swallowed}, answers)
    assert found(result, "detected at delta 10")["found"]["value"] == 0.5
    assert found(result, "detected at delta 10", "targets_visible")["found"]["value"] == 1.0
    words = "a test that knew the effect would detect, delta 10"
    power = norm.sf(norm.isf(0.02) - 2.0)
    assert found(result, words)["found"]["value"] == pytest.approx(0.5 * (1.0 + power), abs=1e-4)


def test_a_case_that_failed_is_counted_as_failed():
    result = score({"a": truth("a")}, {"a": judged()}, {"a": {"answer": None, "error": "boom", "seconds": 0.1}})
    assert result["failed"] == [{"key": "a", "error": "boom"}]
    assert confusion(result["rows"]) == {}


def several(kind, accepted, ideal, remains=False, groups=(("toe",), ("yield",))):
    """A row of a file in which several effects hide, all visible beside the others."""
    return {
        "kind": kind,
        "names": ["toe", "yield"],
        "groups": [list(g) for g in groups],
        "accepted": accepted,
        "conditional": [10.0] * len(groups),
        "remains": remains,
        "verdict": "partial" if remains else "named",
        "delta": 10.0,
        "detected": True,
        "optimal": {},
        "held_out": None,
        "visible": True,
        "right": False,
        "optimal_two": {"group": ideal} if kind == "two" else {},
        "optimal_three": {},
        "blind": {"all": 0.5, "known": 0.7, "named": 0.6, "remains": 0.2, "right": 0.8, "other": 0.1},
        "remainder": 0.8 if remains else 0.2,
        "families": [],
        "optimal_mixed": {"known": ideal, "remains": 0.5} if kind == "mixed" else {},
        "left_over": {"2": {"delta": 2.0, "power": 0.1}} if kind == "mixed" else {},
    }


def test_several_effects_are_measured_against_the_ideal_judge():
    rows = [several("two", ["toe", "yield"], 0.9), several("two", ["superposition"], 0.7)]
    rows += [several("mixed", ["toe"], 0.9, remains=True), several("mixed", ["ageing", "toe"], 0.7)]
    found = {row["target"]: row for row in targets(rows)}
    assert found["two effects: both accepted, relative to optimal"]["found"]["value"] == pytest.approx(0.5 / 0.8)
    assert found["two effects: the first accepted is one of them"]["found"]["value"] == 0.5
    assert found["beside a foreign effect: the known one accepted"]["found"]["value"] == 1.0
    assert found["beside a foreign effect: a remainder reported"]["found"]["value"] == 0.5
    assert found["an ideal judge would accept it"]["found"]["value"] == pytest.approx(0.8)
    assert found["two effects: both accepted"]["found"]["value"] == 0.5
    blind = "an ideal judge who has to estimate the noise"
    for what, value in (
        (": both", 0.5),
        (" would accept it", 0.7),
        (" would report it", 0.2),
        (": a name of no group", 0.1),
    ):
        assert found[blind + what]["found"]["value"] == pytest.approx(value)
    assert found["of the judge's rate: two effects: both accepted"]["found"]["value"] == pytest.approx(0.5 / 0.5)
    assert found["of the judge's rate: beside a foreign effect: the known one accepted"]["found"][
        "value"
    ] == pytest.approx(1.0 / 0.7)
    likely = found["of the judge's rate: beside a foreign effect: a remainder is likely"]
    assert likely["found"]["value"] == pytest.approx(0.5 / 0.2)
    assert found["a test of what two names leave would see it"]["found"]["value"] == pytest.approx(0.1)
    assert found["an accepted name that is of no hidden effect's group"]["found"]["k"] == 2
    hidden = [several("mixed", [], 0.9) | {"conditional": [7.9, 10.0]}]
    assert not {r["target"]: r for r in targets(hidden)}["beside a foreign effect: the known one accepted"]["found"]


def test_what_is_more_likely_than_not_is_compared_with_the_judges_most_probable_set():
    """He need not be sure of his set: nor does it count here which of the families are established."""

    def row(*inclusion):
        members = (["toe", "ageing"], ["yield"])
        stated = [{"members": m, "inclusion": p, "established": False} for m, p in zip(members, inclusion, strict=True)]
        return several("two", [], 0.9) | {"families": stated}

    rows = [row(0.51, 0.51), row(0.49, 0.99), row(0.99, 0.5), row(0.6, 0.6)]
    found = {r["target"]: r for r in targets(rows)}
    likely = found["of the judge's rate: two effects: both more likely than not"]
    assert likely["found"]["value"] == pytest.approx(0.5 / 0.5)


def said(kind, probability, accepted=("toe",)):
    return {
        "kind": kind,
        "detected": True,
        "names": ["toe"],
        "groups": [["toe"]],
        "remainder": probability,
        "accepted": list(accepted),
    }


def test_bins_of_a_stated_probability_with_their_95_percent_intervals():
    rows = [said("single", 0.05)] * 9 + [said("single", 0.15, ())] + [said("single", 1.0, ())]
    first, *_, last = remainders(rows)
    assert first["said"] == pytest.approx(0.06)
    assert (first["found"]["k"], first["found"]["n"]) == (1, 10)
    assert binom.cdf(1, 10, first["found"]["high"]) == pytest.approx(0.025, abs=1e-6)
    assert last["found"]["n"] == 1


def test_kinds_can_count_as_the_prior_expects_them():
    """As many single names as there are, half as many beside a remainder, and one remainder alone."""
    n = len(EFFECTS)
    rows = [said("single", 0.05)] * 6 + [said("mixed", 0.05, ())] * 3 + [said("foreign", 0.05, ())] * 3
    weights = prior_weights(rows)
    assert weights == pytest.approx({"single": n / 6, "mixed": n / 6, "without": 1 / 3, "foreign": 1 / 3})
    (bin_, *_) = remainders(rows, weights)
    assert bin_["found"]["value"] == pytest.approx((n / 2 + 1) / (n + n / 2 + 1))
    assert remainders([said("pair", 0.05)], {"single": 1.0})[0]["found"] is None


def in_family(members, inclusion, name="toe", established=False):
    family = {"members": list(members), "inclusion": inclusion, "established": established}
    return said("single", 0.05) | {
        "names": [name],
        "effect": name,
        "families": [family],
        "inclusion": {member: inclusion / len(members) for member in members},
    }


def test_what_is_stated_beside_an_effect_of_no_catalogue_is_counted_apart():
    known = in_family(["toe"], 1.0)
    resembles = in_family(["ageing"], 1.0, name="yield") | {"kind": "foreign"}
    beside = in_family(["toe"], 1.0) | {"kind": "mixed", "names": ["toe", "yield"]}
    top = {of: bins[-1]["found"] for of, bins in apart([known, resembles, beside]).items()}
    for of, right, among in (("all effects in the catalogue", 1, 1), ("an effect in no catalogue", 1, 2)):
        assert (top[f"family, {of}"]["k"], top[f"family, {of}"]["n"]) == (right, among)
    _, lines = stated_lines([known, resembles])
    assert lines[0][-1] == "0.8 to 1.0" and lines[3][0] == "family, all effects in the catalogue"
    assert lines[3][1:5] == [""] * 4 and lines[3][5].startswith("1.00: 1.00 [")


def test_inclusions_of_names_and_families_are_counted_by_themselves():
    rows = [in_family(["toe", "ageing"], 1.0), in_family(["toe", "ageing"], 1.0, name="superposition")]
    *_, last = families(rows)
    assert (last["said"], last["found"]["k"], last["found"]["n"]) == (1.0, 1, 2)
    _, _, middle, *_ = names(rows)
    assert (middle["said"], middle["found"]["k"], middle["found"]["n"]) == (0.5, 1, 4)


def test_families_and_what_is_said_beside_them_have_their_rows():
    def row(**changes):
        base = several("single", ["toe"], 0.9) | {"effect": "toe", "separable": True, "right_group": True}
        family = {"members": ["toe", "ageing", "yield"], "inclusion": 0.95, "established": True}
        return (
            base | {"families": [family], "in_set": True, "claimed_group": True, "set_size": 1, "left": 10.0} | changes
        )

    rows = [row(), row(effect="superposition", verdict="unknown"), row(effect="superposition", right=True)]
    rows += [row(accepted=["screw_error"])]
    by_name = {r["target"]: r for r in targets(rows)}
    assert by_name["the first family holds the true effect, delta 10"]["found"]["k"] == 2
    assert by_name["members of the first family, delta 10"]["found"]["value"] == 3.0
    unknown = by_name["unknown, although a family is established"]
    assert unknown["found"]["k"] == 1 and not unknown["passed"]
    assert by_name["superposition told apart from the name nearest to it"]["found"]["value"] == 0.5
    screw = by_name["a screw error named where there is none"]
    assert screw["found"]["value"] == 0.25 and not screw["passed"]
    first = by_name["of the judge's rate: one of the true group first, delta 10"]
    assert first["found"]["value"] == pytest.approx(1.0 / 0.6) and first["passed"]


def test_clean_files_with_an_alarm_are_also_shown_apart():
    truths = {k: truth(k, "clean") for k in "abc"}
    answers = {"a": answer("toe", final=1.5), "b": answer("toe", final=6.0), "c": answer(None, final=3.0)}
    apart = found(score(truths, dict.fromkeys("abc", judged()), answers), "clean data: that ratio")
    assert (apart["found"]["value"], apart["found"]["n"]) == (pytest.approx((0.5 + 2.0) / 2), 2)


def test_unequal_weights_are_worth_fewer_cases():
    equal = weighted_rate([True, False] * 10, [2.0] * 20)
    plain = rate([True, False] * 10)
    assert (equal["value"], equal["low"], equal["high"]) == pytest.approx((0.5, plain["low"], plain["high"]))
    unequal = weighted_rate([True, False] * 10, [1.0, 9.0] * 10)
    assert unequal["value"] == pytest.approx(0.1)
    assert unequal["n"] == pytest.approx(100.0**2 / 820.0, abs=0.05)
    assert weighted_rate([], []) is None


def test_intervals_can_have_another_level():
    assert binom.sf(1, 10, rate([True] * 2 + [False] * 8, 0.95)["low"]) == pytest.approx(0.025, abs=1e-6)


def test_wires_of_a_file_are_counted_one_by_one():
    sealed = truth("a", "some") | {"benches": dict.fromkeys(("sample-1", "sample-2", "sample-3"), {})}
    sealed["effects"] = [{"name": "toe", "hold": None, "experiments": [s]} for s in ("sample-1", "sample-2")]
    sealed["protocol"] = "several_wires"
    spoken = answer("toe")["answer"]["experiments"]["sample-1"]
    others = {
        "sample-2": spoken | {"accepted": ["superposition"]},
        "sample-3": answer("toe")["answer"]["experiments"]["sample-1"],
    }
    record = {"answer": {"experiments": {"sample-1": spoken, **others}}, "error": None, "seconds": 1.0}
    result = score({"a": sealed}, {"a": judged() | {"groups": [["toe"], ["toe", "ageing"]]}}, {"a": record})
    found = {key: (value["k"], value["n"]) for key, value in result["several_wires"]["some"].items()}
    assert found == {
        "carriers: detected": (2, 2),
        "carriers: the effect or one of its group accepted": (1, 2),
        "carriers: another name accepted": (1, 2),
        "others: alarm": (1, 1),
        "others: a name accepted": (1, 1),
    }


def test_tables_for_the_docs_have_a_column_for_each_protocol(tmp_path, capsys, monkeypatch):
    truths = {k: truth(k, "two") for k in "ab"} | {"c": truth("c", "foreign", "yield") | {"protocol": "dense"}}
    for k in "ab":
        both = ("toe", "superposition")
        truths[k]["effects"] = [{"name": n, "hold": None, "experiments": ["sample-1"]} for n in both]
        truths[k]["effects"] = [e | {"conditional_delta": 10.0} for e in truths[k]["effects"]]
    answers = {"a": answer("toe", ["toe"]), "b": answer("toe", ["toe"]), "c": answer("ageing", ["ageing"])}
    spoken = [answers[k]["answer"]["experiments"]["sample-1"] for k in "abc"]
    spoken[0]["accepted"] = ["toe", "superposition"]
    for one, probability in zip(spoken, (0.1, 0.3, 0.9), strict=True):
        one["remainder"] = {"probability": probability}
    two = judged() | {"groups": [["toe"], ["superposition"]], "optimal_two": {"group": 1.0}}
    foreign = judged(("yield",)) | {"left_over": {"1": {"delta": 2.0, "power": 0.1}}}
    result = score(truths, {"a": two, "b": two, "c": foreign}, answers)
    (tmp_path / "scores.json").write_text(json.dumps({"api": result}), encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["several", str(tmp_path / "scores.json")])
    names_and_remainders.main()
    named, left, *included = capsys.readouterr().out.split(".. list-table::")[1:]
    both = next(c for c in named.split("\n   * - ") if c.startswith("two effects: both accepted"))
    assert both.splitlines()[1:] == ["     - ≥ 85 %", *(f"     - {c}" for c in ["**50 %** [3, 97] of 2"] * 2), "     -"]
    assert "seen beside the best name (foreign)\n     - no more, in %\n     - 10 %" in named
    assert "effect in no catalogue" in named and "false alarms" not in named
    bins = [c.splitlines() for c in left.split("\n   * - ")[2:]]
    assert bins[0][1:3] == ["     - 10 %", "     - 0.0 % [0.0, 97.5] of 1"]
    assert bins[1][1:3] == ["     - 30 %", "     - 100 % [3, 100] of 1"]
    assert bins[2][1:] == ["     -"] * 4
    assert ["the effect was there" in included[0], "one of the family was there" in included[1]] == [True, True]
    monkeypatch.setattr("sys.argv", ["several", "--left", str(tmp_path / "scores.json")])
    names_and_remainders.main()
    assert capsys.readouterr().out == "foreign, the best 1: less than 3.3 left in 100 % [5, 100] of 1, power 10 %\n"
    html = page._section("api", result)
    assert "<td>all_accepted</td><td>0.500 [0.025, 0.975] n=2</td>" in html
    assert "too little left in 1.000 [0.050, 1.000] n=1 of the cases, power 0.10" in html
    assert "<td>0.2 to 0.4</td><td>0.30</td><td>1.000 [0.025, 1.000] n=1</td>" in html
