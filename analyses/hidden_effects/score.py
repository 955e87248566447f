"""Scores of one answerer: rows of cases, rates with intervals, the table of targets."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
from scipy.stats import beta

Row = dict[str, Any]
NOTHING = "nothing-missing"
VISIBLE = 0.8  # share of delta that must survive a refit of the plain model for a case to count as visible


def upper_bound(k: int, n: int, level: float = 0.95) -> float:
    """One-sided upper Clopper-Pearson bound of a rate."""
    return 1.0 if k >= n else float(beta.ppf(level, k + 1, n - k))


def lower_bound(k: int, n: int, level: float = 0.95) -> float:
    """One-sided lower Clopper-Pearson bound of a rate."""
    return 0.0 if k <= 0 else float(beta.ppf(1 - level, k, n - k + 1))


def rate(hits: Iterable[bool]) -> dict[str, Any] | None:
    """Share of true values, their number and a two-sided 90 % interval; None when there are none."""
    values = [bool(h) for h in hits]
    k, n = sum(values), len(values)
    return {"value": k / n, "k": k, "n": n, "low": lower_bound(k, n), "high": upper_bound(k, n)} if n else None


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
        "right_hold": None if hold is None or found_hold is None else found_hold == hold,
        "separable": judged.get("separable"),
        "visible": not names or judged["delta_after_refit"] >= VISIBLE * truth["delta"],
        "optimal": judged.get("optimal") or {},
        "held_out": _held_out(judged, spoken),
        "seconds": record["seconds"],
    }


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


def pooled(rows: list[Row], statistic: Any, draws: int = 400) -> dict[str, Any] | None:
    """A statistic of held-out sums over cases with a 90 % bootstrap interval over cases."""
    table = np.array(
        [[r["held_out"][k] for k in ("plain", "final", "judge_plain", "oracle")] for r in rows if _comparable(r)]
    )
    if len(table) < 3:
        return None
    rng = np.random.default_rng(0)
    spread = [statistic(table[rng.integers(len(table), size=len(table))].sum(axis=0), len(table)) for _ in range(draws)]
    low, high = np.nanquantile(spread, [0.05, 0.95])
    value = statistic(table.sum(axis=0), len(table))
    return {"value": float(value), "n": len(table), "low": float(low), "high": float(high)}


def _comparable(row: Row) -> bool:
    """Whether the answer held out the same holds as the oracle."""
    return bool(row["held_out"] and row["held_out"]["same_holds"])


def rmse_ratio(sums: Any, n: int) -> float:
    """Pooled rmse of final over plain."""
    return float(np.sqrt(sums[1] / sums[0]))


def closed(sums: Any, n: int) -> float:
    """Pooled share of the gap between plain and noise floor that `final` closes."""
    return float((sums[0] - sums[1]) / (sums[0] - n)) if sums[0] > n else float("nan")


def closed_of_oracle(sums: Any, n: int) -> float:
    """What `final` closes, over what the true form closes."""
    of_oracle = (sums[2] - sums[3]) / (sums[2] - n)
    return closed(sums, n) / float(of_oracle) if of_oracle > 0 else float("nan")


def against_optimal(rows: list[Row], draws: int = 400) -> dict[str, Any] | None:
    """Rate of right names over the ideal judge's on the same detected cases, with a bootstrap interval."""
    pairs = np.array([[r["right"], r["optimal"]["top1"]] for r in rows if "top1" in r["optimal"]], dtype=float)
    if not len(pairs) or pairs[:, 1].sum() == 0:
        return None
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(draws):
        sums = pairs[rng.integers(len(pairs), size=len(pairs))].sum(axis=0)
        ratios.append(sums[0] / max(sums[1], 1e-9))
    low, high = np.quantile(ratios, [0.05, 0.95])
    value = pairs[:, 0].sum() / pairs[:, 1].sum()
    return {"value": float(value), "n": len(pairs), "low": float(low), "high": float(high)}


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
        "clean_by_protocol": {
            p: rate(r["any_alarm"] for r in rows if r["kind"] == "clean" and r["protocol"] == p)
            for p in dict.fromkeys(r["protocol"] for r in rows if r["kind"] == "clean")
        },
        "gross_error_alarms": rate(r["any_alarm"] for r in rows if r["kind"] == "gross"),
        "innocent_alarms": rate(v for r in single for v in r["innocent"]),
        "event_hold_right": rate(r["right_hold"] for r in single if r["right"] and r["right_hold"] is not None),
        "gap_closed": {
            f"{d:g}": pooled([r for r in single if r["delta"] == d], closed)
            for d in sorted({r["delta"] for r in single})
        },
        "seconds": _seconds([r["seconds"] for r in rows]),
        "other_holds_held_out": sum(bool(r["held_out"]) and not _comparable(r) for r in rows),
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


def _seconds(values: list[float]) -> dict[str, float] | None:
    if not values:
        return None
    return {"median": float(np.median(values)), "largest": float(max(values)), "total": float(sum(values))}
