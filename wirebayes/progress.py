"""How far a long computation has come, for whoever watches it."""

from collections.abc import Callable

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
