"""Cells of the tables on a page: shares, units, and figures with their intervals."""

from wirebayes.json_files.values import INTERVAL, Band, Quantiles
from wirebayes.report.blocks import unit_text
from wirebayes.sentences import middle_and_span

NONE = "–"


def percent(share: float | None) -> str:
    """A share in whole percent, a dash where there is none."""
    return NONE if share is None else f"{100 * share:.0f} %"


def unit_or_dash(unit: str) -> str:
    """A unit as a page writes it, a dash for a pure number."""
    return unit_text(unit) or NONE


def with_unit(name: str, unit: str) -> str:
    """A name and, where there is one, its unit behind a comma."""
    text = unit_text(unit)
    return f"{name}, {text}" if text else name


def median_and_interval(figures: Quantiles | None) -> list[str]:
    """Median and 90 % interval of a quantity, two cells; dashes where there is none."""
    if figures is None:
        return [NONE, NONE]
    return middle_and_span(figures["q50"], figures["q05"], figures["q95"])


def at_row(band: Band, row: int) -> tuple[float, float, float]:
    """Lower end, median and upper end of a band at one row."""
    low, middle, high = (band[quantile][row] for quantile in INTERVAL)
    return low, middle, high
