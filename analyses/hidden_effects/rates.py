"""Rates with intervals, and figures pooled over cases."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np
from scipy.stats import beta

Row = dict[str, Any]


def upper_bound(k: float, n: float, level: float = 0.95) -> float:
    """One-sided upper Clopper-Pearson bound of a rate."""
    return 1.0 if k >= n else float(beta.ppf(level, k + 1, n - k))


def lower_bound(k: float, n: float, level: float = 0.95) -> float:
    """One-sided lower Clopper-Pearson bound of a rate."""
    return 0.0 if k <= 0 else float(beta.ppf(1 - level, k, n - k + 1))


def rate(hits: Iterable[bool], level: float = 0.9) -> dict[str, Any] | None:
    """Share of true values, their number and a two-sided interval of the given level; None when there are none."""
    values = [bool(h) for h in hits]
    k, n, side = sum(values), len(values), 0.5 * (1.0 + level)
    return (
        {"value": k / n, "k": k, "n": n, "low": lower_bound(k, n, side), "high": upper_bound(k, n, side)} if n else None
    )


def weighted_rate(hits: Iterable[bool], weights: Iterable[float], level: float = 0.9) -> dict[str, Any] | None:
    """The same where cases count differently; the interval is that of as many equal cases as would be as precise.

    These are (sum w)^2 / (sum w^2) cases (Kish's effective number).
    """
    values, w = np.array([bool(h) for h in hits], dtype=float), np.array(list(weights), dtype=float)
    if not w.sum() > 0:
        return None
    value, n, side = float(values @ w / w.sum()), float(w.sum() ** 2 / (w @ w)), 0.5 * (1.0 + level)
    k = value * n
    return {"value": value, "n": round(n, 1), "low": lower_bound(k, n, side), "high": upper_bound(k, n, side)}


_DRAWS = 400  # of a bootstrap


def pooled(rows: list[Row], statistic: Callable[[Any, int], float]) -> dict[str, Any] | None:
    """A statistic of held-out sums over cases with a 90 % bootstrap interval over cases."""
    table = np.array(
        [[r["held_out"][k] for k in ("plain", "final", "judge_plain", "oracle")] for r in rows if comparable(r)]
    )
    if len(table) < 3:
        return None
    rng = np.random.default_rng(0)
    n = len(table)
    spread = [statistic(table[rng.integers(n, size=n)].sum(axis=0), n) for _ in range(_DRAWS)]
    low, high = np.nanquantile(spread, [0.05, 0.95])
    value = statistic(table.sum(axis=0), n)
    return {"value": float(value), "n": n, "low": float(low), "high": float(high)}


def comparable(row: Row) -> bool:
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


def against_optimal(rows: list[Row]) -> dict[str, Any] | None:
    """Rate of right names over the ideal judge's on the same detected cases."""
    seen = [r for r in rows if "top1" in r["optimal"]]
    return share_of([r["right"] for r in seen], [r["optimal"]["top1"] for r in seen])


def share_of(hits: Sequence[bool], possible: Sequence[float]) -> dict[str, Any] | None:
    """How often something is right over how often it could be, with a 90 % bootstrap interval over the cases.

    Parameters
    ----------
    hits, possible : whether each case is right, and the probability with which a judge is.
    """
    pairs = np.array([hits, possible], dtype=float).T
    if not len(pairs) or pairs[:, 1].sum() == 0:
        return None
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(_DRAWS):
        right, could_be = pairs[rng.integers(len(pairs), size=len(pairs))].sum(axis=0)
        ratios.append(right / max(could_be, 1e-9))
    low, high = np.quantile(ratios, [0.05, 0.95])
    right, could_be = pairs.sum(axis=0)
    return {"value": float(right / could_be), "n": len(pairs), "low": float(low), "high": float(high)}
