"""How far a long computation has come, for whoever watches it."""

from collections.abc import Callable, Iterator

Progress = Callable[[str, float, float], None]  # of the name of a part, what of it is done, and its total
ShareDone = Callable[[float], None]  # of what is done of one computation, from 0 to 1


def silent(name: str, done: float, total: float) -> None:
    """Nobody watches the progress.

    Parameters
    ----------
    name : str
    done, total : float
        What a progress function is called with.
    """


def unseen(share: float) -> None:
    """Nobody watches what is done of one computation.

    Parameters
    ----------
    share : float
    """


def part_of(progress: Progress, name: str) -> ShareDone:
    """Progress of one part by its share, as a percentage.

    Parameters
    ----------
    progress : function of name, done and total
    name : str
        Of the part.
    """
    return lambda share: progress(name, 100.0 * share, 100.0)


def shares_of(progress: ShareDone, count: int) -> Iterator[ShareDone]:
    """Progress of each of some computations that are alike and follow one another.

    Parameters
    ----------
    progress : function of a share between 0 and 1
        Of all together.
    count : int
        How many there are.

    Yields
    ------
    function of a share between 0 and 1
        Of the next one.
    """
    for begun in range(count):
        yield _after(begun, count, progress)


def _after(begun: int, count: int, progress: ShareDone) -> ShareDone:
    """Progress of one computation when some others are done."""
    return lambda share: progress((begun + share) / count)
