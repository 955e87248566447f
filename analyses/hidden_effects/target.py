"""A row of the table of targets: what is wanted, what was found, and whether it is enough."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

Target = dict[str, Any]


def row(name: str, wanted: str, found: dict[str, Any] | None, passed: bool | None) -> Target:
    """A row; what was not found is neither passed nor missed."""
    return {"target": name, "wanted": wanted, "found": found, "passed": passed if found else None}


def at_least(name: str, found: dict[str, Any] | None, wanted: float) -> Target:
    """A share that is to be reached."""
    return row(name, f">= {100 * wanted:.0f} %", found, found is not None and found["value"] >= wanted)


def at_most(name: str, found: dict[str, Any] | None, wanted: float) -> Target:
    """A share that is not to be exceeded."""
    return row(name, f"<= {100 * wanted:.0f} %", found, found is not None and found["value"] <= wanted)


def number(name: str, values: Sequence[float]) -> Target:
    """A mean that is printed, with its 90 % interval."""
    return row(name, "printed", mean(values) if len(values) else None, None)


def mean(values: Sequence[float]) -> dict[str, Any]:
    """The mean of some values with its 90 % interval."""
    n, middle = len(values), sum(values) / len(values)
    error = (sum((x - middle) ** 2 for x in values) / max(n - 1, 1) / n) ** 0.5
    return {"value": middle, "n": n, "low": middle - 1.645 * error, "high": middle + 1.645 * error}
