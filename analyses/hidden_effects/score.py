"""Scores of one answerer: rows of cases, rates with intervals, the table of targets."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from wirebayes.discovery.settings import MORE, UNKNOWN_WEIGHT

from .cases import TOGETHER
from .catalogue import EFFECTS
from .optimal_sets import SEPARABLE
from .rates import Row, closed, comparable, pooled, rate, weighted_rate

NOTHING = "nothing-missing"
CONDITIONAL = 8.0  # delta beside the other effects from which one is expected to be named
BIN_LEVEL = 0.95  # of the intervals of a calibration
VISIBLE = 0.8  # share of delta that must survive a refit of the plain model for a case to count as visible


def case_row(truth: dict[str, Any], judged: dict[str, Any], record: dict[str, Any]) -> Row:
    """What the scores need of one case; the experiment that shows the effect most speaks for the file."""
    answers = record["answer"]["experiments"]
    spoken = answers[judged["bench"]]
    names = [e["name"] for e in truth["effects"]]
    groups = judged.get("groups", [])
    best = spoken.get("best")
    detected = spoken["verdict"] != NOTHING
    unknown = detected and (spoken["verdict"] == "unknown" or best == "unknown")
    chosen = "unknown" if unknown else best if detected else NOTHING
    amplitudes = spoken.get("amplitudes") or {}
    hold = truth["effects"][0]["hold"] if truth["effects"] else None
    found_hold = (amplitudes.get(names[0]) or {}).get("hold") if names else None
    return {
        "key": truth["key"],
        "kind": truth["kind"],
        "protocol": truth["protocol"],
        "delta": truth["delta"],
        "names": names,
        "effect": names[0] if names else None,
        "law": truth["law"],
        "detected": detected,
        "any_alarm": any(a["verdict"] != NOTHING for a in answers.values()),
        "innocent": [a["verdict"] != NOTHING for n, a in answers.items() if n not in _touched(truth)],
        "chosen": chosen,
        "right": bool(names) and chosen == names[0],
        "right_group": any(chosen in group for group in groups[:1]),
        "claimed_group": bool(names) and names[0] in (spoken.get("group") or []),
        "in_set": bool(names) and names[0] in (spoken.get("set") or []),
        "set_size": len(spoken.get("set") or []),
        "accepted": list(spoken.get("accepted") or []),
        "wires": _wires(truth, groups, answers),
        "groups": groups,
        "conditional": [e.get("conditional_delta") for e in truth["effects"]],
        "remains": spoken["verdict"] in ("partial", "unknown"),
        "verdict": spoken["verdict"],
        "remainder": (spoken.get("remainder") or {}).get("probability"),
        "optimal_two": judged.get("optimal_two") or {},
        "optimal_three": judged.get("optimal_three") or {},
        "optimal_mixed": judged.get("optimal_mixed") or {},
        "left_over": judged.get("left_over") or {},
        "blind": judged.get("blind") or {},
        "right_hold": None if hold is None or found_hold is None else found_hold == hold,
        "separable": judged.get("separable"),
        "visible": not names or judged["delta_after_refit"] >= VISIBLE * truth["delta"],
        "left": judged["delta_after_refit"] if names else None,
        "optimal": judged.get("optimal") or {},
        "held_out": _held_out(judged, spoken),
        "seconds": record["seconds"],
    }


def _wires(truth: dict[str, Any], groups: list[list[str]], answers: dict[str, Any]) -> list[dict[str, bool]]:
    """What was said of each experiment of a file: whether it carries an effect, and was given one's name or another."""
    out = []
    for name, answer in answers.items():
        own = [g for e, g in zip(truth["effects"], groups, strict=False) if name in e["experiments"]]
        accepted = list(answer.get("accepted") or [])
        out.append(
            {
                "carries": bool(own),
                "detected": answer["verdict"] != NOTHING,
                "named": any(a in g for a in accepted for g in own),
                "false_name": any(not any(a in g for g in own) for a in accepted),
            }
        )
    return out


def _touched(truth: dict[str, Any]) -> set[str]:
    return {name for e in truth["effects"] for name in e["experiments"]} if truth["effects"] else set(truth["benches"])


def _held_out(judged: dict[str, Any], spoken: dict[str, Any]) -> dict[str, float] | None:
    """Held-out squared errors in units of the case's noise floor, so that no case with large tensions rules."""
    reference, given = judged.get("held_out"), spoken.get("held_out")
    if not reference or not given or not given.get("plain") or not given.get("final"):
        return None
    floor = reference["floor"] ** 2
    return {
        "plain": given["plain"]["rmse_N"] ** 2 / floor,
        "final": given["final"]["rmse_N"] ** 2 / floor,
        "judge_plain": reference["plain"] ** 2 / floor,
        "oracle": reference["oracle"] ** 2 / floor,
        "same_holds": float(list(given.get("holds", [])) == list(judged["held_out_holds"].get(judged["bench"], []))),
    }


def confusion(rows: list[Row]) -> dict[str, dict[str, int]]:
    """Counts of what was answered for each true effect."""
    table: dict[str, dict[str, int]] = {}
    for r in rows:
        line = table.setdefault(r["effect"], {})
        line[r["chosen"]] = line.get(r["chosen"], 0) + 1
    return table


def breakdown(rows: list[Row], key: str) -> dict[str, Any]:
    """Detection, names and groups by delta within each value of `key` (`effect` or `protocol`)."""
    result: dict[str, Any] = {}
    for value in dict.fromkeys(r[key] for r in rows):
        part = [r for r in rows if r[key] == value]
        result[value] = {
            f"{delta:g}": {
                "detected": rate(r["detected"] for r in part if r["delta"] == delta),
                "right": rate(r["right"] for r in part if r["delta"] == delta and r["detected"]),
                "right_group": rate(r["right_group"] for r in part if r["delta"] == delta and r["detected"]),
                "optimal": _mean(r["optimal"].get("top1") for r in part if r["delta"] == delta),
            }
            for delta in sorted({r["delta"] for r in part})
        }
    return result


def _mean(values: Iterable[float | None]) -> float | None:
    kept = [v for v in values if v is not None]
    return float(np.mean(kept)) if kept else None


def score(truths: dict[str, Any], judged: dict[str, Any], answers: dict[str, Any]) -> dict[str, Any]:
    """All scores of one answerer.

    Parameters
    ----------
    truths, judged, answers : records of the cases by key: sealed truth, the judge's groups and ideal, what was said.
    """
    from .targets import targets

    rows, failed = [], []
    for key, truth in truths.items():
        record = answers.get(key)
        if record is None or record["answer"] is None:
            failed.append({"key": key, "error": None if record is None else record["error"]})
        else:
            rows.append(case_row(truth, judged[key], record))
    single = [r for r in rows if r["kind"] == "single"]
    return {
        "targets": targets(rows),
        "targets_visible": targets([r for r in rows if r["visible"]]),
        "confusion": confusion(single),
        "by_effect": breakdown(single, "effect"),
        "by_protocol": breakdown(single, "protocol"),
        "pairs": _pairs([r for r in rows if r["kind"] == "pair"]),
        "together": {kind: _together([r for r in rows if r["kind"] == kind]) for kind in TOGETHER},
        "alone": {kind: left_over([r for r in rows if r["kind"] == kind]) for kind in ("without", "foreign")},
        "false_names": rate(bool(false_names(r)) for r in rows if r["kind"] != "without"),
        "partial_on_single": rate(r["verdict"] == "partial" for r in single),
        "remainder_calibration": calibration(rows),
        "remainder_calibration_as_expected": calibration(rows, prior_weights(rows)),
        "clean_by_protocol": {
            p: rate(r["any_alarm"] for r in rows if r["kind"] == "clean" and r["protocol"] == p)
            for p in dict.fromkeys(r["protocol"] for r in rows if r["kind"] == "clean")
        },
        "gross_error_alarms": rate(r["any_alarm"] for r in rows if r["kind"] == "gross"),
        "several_wires": {
            kind: by_wire([r for r in rows if r["kind"] == kind and r["protocol"] == "several_wires"])
            for kind in ("single", "pair", "some")
        },
        "innocent_alarms": rate(v for r in single for v in r["innocent"]),
        "event_hold_right": rate(r["right_hold"] for r in single if r["right"] and r["right_hold"] is not None),
        "gap_closed": {
            f"{d:g}": pooled([r for r in single if r["delta"] == d], closed)
            for d in sorted({r["delta"] for r in single})
        },
        "seconds": _seconds([r["seconds"] for r in rows]),
        "other_holds_held_out": sum(bool(r["held_out"]) and not comparable(r) for r in rows),
        "failed": failed,
        "rows": rows,
    }


def _pairs(rows: list[Row]) -> dict[str, Any]:
    return {
        "detected": rate(r["detected"] for r in rows),
        "first_is_one_of_them": rate(r["chosen"] in r["names"] for r in rows if r["detected"]),
        "both_accepted": rate(set(r["names"]) <= set(r["accepted"]) for r in rows if r["detected"]),
        "something_else_accepted": rate(bool(set(r["accepted"]) - set(r["names"])) for r in rows if r["detected"]),
    }


def false_names(row: Row) -> list[str]:
    """Accepted names outside the group of everything that is hidden."""
    return [name for name in row["accepted"] if not any(name in group for group in row["groups"])]


def accepted_of_group(row: Row) -> list[bool]:
    """For each hidden effect whether it, or one whose signature is nearly the same, was accepted."""
    return [any(name in group for name in row["accepted"]) for group in row["groups"]]


def visible_beside(row: Row) -> list[bool]:
    """For each hidden effect whether enough of it is left beside the others for it to be named."""
    return [d is not None and d >= CONDITIONAL for d in row["conditional"]]


def _together(rows: list[Row]) -> dict[str, Any]:
    """Several effects at once: which of those that stay visible beside the others are accepted, by protocol."""
    out: dict[str, Any] = {}
    for label, part in (
        ("all", rows),
        ("paper", [r for r in rows if r["protocol"] == "paper"]),
        ("long", [r for r in rows if r["protocol"] != "paper"]),
    ):
        seen = [r for r in part if r["detected"]]
        out[label] = {
            "detected": rate(r["detected"] for r in part),
            "all_accepted": rate(all(accepted_of_group(r)) for r in part if all(visible_beside(r))),
            "known_accepted": rate(accepted_of_group(r)[0] for r in part if visible_beside(r)[0]),
            "first_is_one_of_them": rate(
                any(r["accepted"][0] in g for g in r["groups"]) for r in seen if r["accepted"]
            ),
            "remainder_reported": rate(r["remains"] for r in part),
            "remainder_or_twin": rate(r["remains"] or all(accepted_of_group(r)) for r in part),
            "false_name": rate(bool(false_names(r)) for r in part),
            "optimal_both": _mean(r["optimal_two"].get("group") for r in part),
            "optimal_three": _mean(r["optimal_three"].get("group") for r in part),
            "optimal_known": _mean(r["optimal_mixed"].get("known") for r in part),
            "optimal_remainder": _mean(r["optimal_mixed"].get("remains") for r in part),
            "left_over": left_over(part),
        }
    return out


def by_wire(rows: list[Row]) -> dict[str, Any]:
    """Files of several wires, wire by wire: those that carry the effect, and those that do not."""
    wires = [w for r in rows for w in r["wires"]]
    carriers, idle = [w for w in wires if w["carries"]], [w for w in wires if not w["carries"]]
    return {
        "carriers: detected": rate(w["detected"] for w in carriers),
        "carriers: the effect or one of its group accepted": rate(w["named"] for w in carriers),
        "carriers: another name accepted": rate(w["false_name"] for w in carriers),
        "others: alarm": rate(w["detected"] for w in idle),
        "others: a name accepted": rate(w["false_name"] for w in idle),
    }


def left_over(rows: list[Row]) -> dict[str, Any]:
    """What the best catalogue effects leave of what is hidden, by their number.

    For each the share of cases of which too little is left to be seen, and the mean power of a test of the residuals.
    """
    sizes = sorted({size for r in rows for size in r["left_over"]})
    return {
        size: {
            "too_little": rate(r["left_over"][size]["delta"] < SEPARABLE for r in rows if size in r["left_over"]),
            "power": _mean(r["left_over"][size]["power"] for r in rows if size in r["left_over"]),
        }
        for size in sizes
    }


def calibration(rows: list[Row], weights: Mapping[str, float] = {}) -> list[dict[str, Any]]:
    """How often something is left beside the names where its probability is said to lie in each of five bins.

    Something is left where an effect is foreign, was removed, or is hidden and neither it nor one like it was accepted.

    Parameters
    ----------
    weights : of the cases of each kind, where not all count the same; a kind that is missing counts nothing.

    Returns
    -------
    What was said on average, and what was found with its 95 % interval, for each bin.
    """
    out = []
    for low in (0.0, 0.2, 0.4, 0.6, 0.8):
        part = [r for r in rows if r["detected"] and r["remainder"] is not None and r["names"]]
        part = [r for r in part if low <= r["remainder"] < low + 0.2 or (low == 0.8 and r["remainder"] >= 1.0)]
        w = [weights.get(r["kind"], 0.0) if weights else 1.0 for r in part]
        left = [not all(accepted_of_group(r)) for r in part]
        stated = float(np.average([r["remainder"] for r in part], weights=w)) if sum(w) > 0 else None
        found = weighted_rate(left, w, BIN_LEVEL) if weights else rate(left, BIN_LEVEL)
        out.append({"from": low, "said": stated, "found": found})
    return out


def prior_weights(rows: list[Row]) -> dict[str, float]:
    """Weight of a case of each kind with which the kinds are as frequent as the prior of `discover` expects.

    A single name has weight 1, so all n of them have n; all pairs together have `MORE` of that, all threes as
    much of the pairs; a remainder beside one name has `MORE` of what the name has without, and a remainder
    alone has `UNKNOWN_WEIGHT`. What the benchmark has no cases of, such as a remainder beside two names, is left out.
    """
    n = len(EFFECTS)
    expected = {
        ("single",): 1.0 * n,
        ("pair", "two", "periodic"): MORE * n,
        ("three",): MORE**2 * n,
        ("mixed",): MORE * n,
        ("without", "foreign"): UNKNOWN_WEIGHT,
    }
    out: dict[str, float] = {}
    for kinds, share in expected.items():
        count = sum(r["kind"] in kinds for r in rows)
        out |= {kind: share / count for kind in kinds if count}
    return out


def _seconds(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {"median": float(np.median(values)), "largest": float(max(values)), "total": float(sum(values))}
