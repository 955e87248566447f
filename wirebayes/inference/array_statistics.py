"""ArviZ's statistics of plain arrays, loaded when first used: that takes a second, and most processes never need it."""

from typing import Any


def array_statistics() -> Any:
    """The object whose methods are ArviZ's functions of arrays, such as ``psislw``."""
    from arviz_stats.base import array_stats

    return array_stats
