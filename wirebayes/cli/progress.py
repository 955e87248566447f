"""Progress bars on a terminal, silence in a pipe."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

from wirebayes.progress import Progress, silent


@contextmanager
def progress() -> Iterator[Progress]:
    """Show progress on stderr while the block runs.

    Yields
    ------
    report : callable
        ``report(name, done, total)``: a bar for each name, drawn only when stderr is a terminal.

    Examples
    --------
    >>> with progress() as report:
    ...     for step in range(10):
    ...         report("sampling", step + 1, 10)
    """
    if not sys.stderr.isatty():
        yield silent  # somebody else reads stderr
        return
    from rich.console import Console  # rich is loaded only where there is someone to look at it
    from rich.progress import Progress as Bars
    from rich.progress import TaskID, TimeElapsedColumn

    bars = Bars(*Bars.get_default_columns(), TimeElapsedColumn(), console=Console(stderr=True))
    known: dict[str, TaskID] = {}

    def report(name: str, done: float, total: float) -> None:
        if not known:
            bars.start()  # not before there is something to show: a command may end without
        if name not in known:
            known[name] = bars.add_task(name, total=total)
        bars.update(known[name], completed=done, total=total)

    try:
        yield report
    finally:
        if known:
            bars.stop()
