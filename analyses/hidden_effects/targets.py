"""The table of targets: each row with its value, interval and whether it was met."""

from __future__ import annotations

from statistics import NormalDist
from typing import Any

from .cases import TOGETHER
from .of_the_judge import alarms_on_clean, families, shares
from .rates import Row, against_optimal, closed_of_oracle, pooled, rate, rmse_ratio
from .rows import accepted_of_group, false_names, unknown_or_its_group, visible_beside
from .target import Target, at_least, at_most, mean, number, row

ALPHA = 0.04
BLIND = "an ideal judge who has to estimate the noise"


def targets(rows: list[Row]) -> list[Target]:
    """All rows that simulated cases can decide.

    Parameters
    ----------
    rows : cases as `score.case_row` gives them.
    """
    clean = [r for r in rows if r["kind"] == "clean"]
    single = [r for r in rows if r["kind"] == "single"]
    seen = [r for r in single if r["detected"]]
    foreign = [r for r in rows if r["kind"] in ("without", "foreign") and r["delta"] >= 8 and r["detected"]]
    table = [_false_alarms(clean), *_clean_held_out(clean)]
    table.append(number("clean data: that ratio, files that raise an alarm", alarms_on_clean(clean)))
    for delta, detected, group in ((5.0, 0.90, 0.85), (10.0, 0.99, 0.95)):
        at = [r for r in single if r["delta"] == delta]
        table.append(at_least(f"detected at delta {delta:g}", rate(r["detected"] for r in at), detected))
        table.append(_most(f"a test that knew the effect would detect, delta {delta:g}", at))
        right = rate(r["right_group"] for r in at if r["detected"])
        table.append(at_least(f"top-ranked effect in the true group, delta {delta:g}", right, group))
        table.append(_no_more(f"{BLIND}, delta {delta:g}", [r["blind"].get("named") for r in at if r["detected"]]))
        claimed = rate(r["claimed_group"] for r in at if r["detected"])
        table.append(at_least(f"true effect in the reported group, delta {delta:g}", claimed, group))
    table.append(
        at_least("top-ranked effect correct, separable cases", rate(r["right"] for r in seen if r["separable"]), 0.85)
    )
    table.append(at_least("top-ranked effect correct, relative to Bayes-optimal", against_optimal(seen), 0.90))
    for delta in sorted({r["delta"] for r in seen}):
        at = [r for r in seen if r["delta"] == delta]
        table.append(
            at_least(f"90 % set contains the true effect, delta {delta:g}", rate(r["in_set"] for r in at), 0.90)
        )
    table.append(_set_size(seen))
    for kind, label in (("without", "removed from the catalogue"), ("foreign", "in no catalogue")):
        part = [r for r in foreign if r["kind"] == kind]
        found = rate(map(unknown_or_its_group, part))
        table.append(at_least(f"effect {label}: unknown or its group", found, 0.90))
        table.append(_no_more(f"its group, or seen beside the best name ({kind})", [_seen_alone(r) for r in part]))
        table.append(_no_more(f"{BLIND} ({kind})", [r["blind"].get("right") for r in part]))
    for delta, wanted in ((10.0, 0.70), (20.0, 0.90)):
        found = pooled([r for r in single if r["delta"] == delta], closed_of_oracle)
        table.append(at_least(f"gap closed, relative to the oracle, delta {delta:g}", found, wanted))
    return [*table, *_several(rows), *shares(rows), *families(rows)]


def _seen_alone(row: Row) -> float | None:
    """How often an effect without a name could be answered right: where none is like it, by seeing the rest."""
    if not row["left_over"]:
        return None
    return 1.0 if len(row["groups"][0]) > 1 else float(row["left_over"]["1"]["power"])


def _several(rows: list[Row]) -> list[Target]:
    """Several effects at once, one of them perhaps foreign, and what is said too much."""
    kinds = {kind: [r for r in rows if r["kind"] == kind] for kind in ("single", "two", "three", "mixed", "periodic")}
    more = [r for kind in ("foreign", *TOGETHER) for r in rows if r["kind"] == kind]
    apart = {kind: [r for r in kinds[kind] if all(visible_beside(r))] for kind in ("two", "three", "periodic")}
    first = [r for r in kinds["two"] if r["accepted"]]
    known = [r for r in kinds["mixed"] if visible_beside(r)[0]]
    table = [
        at_least("two effects: both accepted, relative to optimal", _relative(kinds["two"], "optimal_two"), 0.85),
        at_least("two effects: both accepted", rate(all(accepted_of_group(r)) for r in apart["two"]), 0.60),
        _no_more(f"{BLIND}: both", [r["blind"].get("all") for r in apart["two"]]),
        at_least(
            "two effects: the first accepted is one of them",
            rate(any(r["accepted"][0] in group for group in r["groups"]) for r in first),
            0.85,
        ),
        row(
            "three effects: all accepted, relative to optimal",
            "in %",
            _relative(kinds["three"], "optimal_three"),
            None,
        ),
        row("three effects: all accepted", "in %", rate(all(accepted_of_group(r)) for r in apart["three"]), None),
        _no_more(f"{BLIND}: all three", [r["blind"].get("all") for r in apart["three"]]),
        at_least(
            "a periodic error beside an elastic curve: both accepted, relative to optimal",
            _relative(kinds["periodic"], "optimal_two"),
            0.90,
        ),
        row(
            "a periodic error beside an elastic curve: both accepted",
            "in %",
            rate(all(accepted_of_group(r)) for r in apart["periodic"]),
            None,
        ),
        _no_more(f"{BLIND}: both of these", [r["blind"].get("all") for r in apart["periodic"]]),
        at_least("beside a foreign effect: the known one accepted", rate(accepted_of_group(r)[0] for r in known), 0.8),
        _no_more("an ideal judge would accept it", [r["optimal_mixed"].get("known") for r in known]),
        _no_more(f"{BLIND} would accept it", [r["blind"].get("known") for r in known]),
        at_least("beside a foreign effect: a remainder reported", rate(r["remains"] for r in kinds["mixed"]), 0.8),
        _no_more("an ideal judge would report it", [r["optimal_mixed"].get("remains") for r in kinds["mixed"]]),
        _no_more(f"{BLIND} would report it", [r["blind"].get("remains") for r in kinds["mixed"]]),
        _no_more(
            "a test of what two names leave would see it",
            [r["left_over"].get("2", {}).get("power") for r in kinds["mixed"]],
        ),
        at_most("single effects: partial", rate(r["verdict"] == "partial" for r in kinds["single"]), 0.05),
        at_most(
            "an accepted name that is of no hidden effect's group",
            rate(bool(false_names(r)) for r in rows if r["names"] and r["kind"] != "without"),
            0.10,
        ),
        row(
            "the same, of files with several effects or a foreign one",
            "in %",
            rate(bool(false_names(r)) for r in more),
            None,
        ),
        _no_more(f"{BLIND}: a name of no group", [r["blind"].get("other") for r in more]),
    ]
    return table


def _relative(rows: list[Row], ideal: str) -> dict[str, Any] | None:
    """Share of cases with all hidden effects accepted, and its interval, over the ideal judge's share."""
    part = [r for r in rows if all(visible_beside(r)) and "group" in r[ideal]]
    found, most = rate(all(accepted_of_group(r)) for r in part), sum(r[ideal]["group"] for r in part)
    if not found or not most:
        return None
    return found | {key: found[key] * len(part) / most for key in ("value", "low", "high")}


def _no_more(name: str, values: list[float | None]) -> Target:
    """The mean of what is possible; no more is asked than to print it."""
    kept = [v for v in values if v is not None]
    mean = sum(kept) / len(kept) if kept else 0.0
    found = {"value": mean, "n": len(kept), "low": mean, "high": mean} if kept else None
    return row(name, "no more, in %", found, None)


def _most(name: str, rows: list[Row]) -> Target:
    """The mean power of a test that knows the noise and the effect, and looks at what a refit of the model leaves."""
    if not rows:
        return row(name, "no more, in %", None, None)
    scores, edge = NormalDist(), NormalDist().inv_cdf(1.0 - ALPHA / 2.0)
    power = sum(scores.cdf(r["left"] - edge) + scores.cdf(-r["left"] - edge) for r in rows) / len(rows)
    return row(name, "no more, in %", {"value": power, "n": len(rows), "low": power, "high": power}, None)


def _false_alarms(clean: list[Row]) -> Target:
    found = rate(r["any_alarm"] for r in clean)
    passed = found is not None and found["high"] <= 0.08 and found["n"] >= 600
    return row("false alarms on clean files", "upper bound <= 8 %, n >= 600", found, passed)


def _clean_held_out(clean: list[Row]) -> list[Target]:
    found = pooled(clean, rmse_ratio)
    ratios = [(r["held_out"]["final"] / r["held_out"]["plain"]) ** 0.5 for r in clean if r["held_out"]]
    worst = {"value": max(ratios), "n": len(ratios), "low": max(ratios), "high": max(ratios)} if ratios else None
    return [
        row(
            "clean data: held-out rmse, final relative to plain",
            "<= 1.02",
            found,
            found is not None and found["value"] <= 1.02,
        ),
        row("clean data: worst case of that ratio", "printed", worst, None),
    ]


def _set_size(seen: list[Row]) -> Target:
    sizes = [(r["set_size"], r["optimal"]["set_size"]) for r in seen if "set_size" in r["optimal"]]
    if not sizes:
        return row("size of the 90 % set above the optimal", "<= 1", None, None)
    found = mean([a - b for a, b in sizes])
    return row("size of the 90 % set above the optimal", "<= 1", found, found["value"] <= 1)
