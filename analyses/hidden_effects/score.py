"""Scores of one answerer: rows of cases, rates with intervals, the table of targets."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np

from . import stated
from .cases import TOGETHER
from .optimal_sets import SEPARABLE
from .rates import Row, closed, comparable, pooled, rate
from .rows import accepted_of_group, case_row, false_names, visible_beside
from .targets import targets


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
        "remainder_calibration": stated.remainders(rows),
        "remainder_calibration_as_expected": stated.remainders(rows, stated.prior_weights(rows)),
        "inclusion_calibration": {
            of: says(rows, stated.prior_weights(rows))
            for of, says in (("names", stated.names), ("families", stated.families))
        },
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


def _seconds(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {"median": float(np.median(values)), "largest": float(max(values)), "total": float(sum(values))}
