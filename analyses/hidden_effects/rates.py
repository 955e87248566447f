"""Rates with intervals, and figures pooled over cases."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Any

import numpy as np
from scipy.stats import beta

Row = dict[str, Any]


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


def pooled(rows: list[Row], statistic: Callable[[Any, int], float], draws: int = 400) -> dict[str, Any] | None:
    """A statistic of held-out sums over cases with a 90 % bootstrap interval over cases."""
    table = np.array(
        [[r["held_out"][k] for k in ("plain", "final", "judge_plain", "oracle")] for r in rows if comparable(r)]
    )
    if len(table) < 3:
        return None
    rng = np.random.default_rng(0)
    spread = [statistic(table[rng.integers(len(table), size=len(table))].sum(axis=0), len(table)) for _ in range(draws)]
    low, high = np.nanquantile(spread, [0.05, 0.95])
    value = statistic(table.sum(axis=0), len(table))
    return {"value": float(value), "n": len(table), "low": float(low), "high": float(high)}


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
