"""Pieces that the texts of several studies share."""

from typing import Any


def version_of(kept: dict[str, Any]) -> str:
    """Which commit found a result, and when."""
    return f"Commit {kept['commit']}, {kept['date']}"


def run_of(kept: dict[str, Any]) -> str:
    """The command behind a result, with commit and date, as a sentence begins with it."""
    return f"``{kept['command']}`` (commit {kept['commit']}, {kept['date']})"


def table_head(*names: str) -> list[str]:
    """The lines that a table begins with."""
    return [".. list-table::", "   :header-rows: 1", "", *table_row(*names)]


def table_row(first: Any, *others: Any) -> list[str]:
    """The lines of a table's row."""
    return [f"   * - {first}", *(f"     - {cell}" for cell in others)]


def percent(share: float) -> str:
    return f"{100 * share:.0f} %"


def three_digits(value: float) -> str:
    """Three digits, without an exponent where there are few zeros."""
    return f"{float(f'{value:.3g}'):,g}"
