"""Numbers that a live estimator is given, checked: what is wrong is refused, with what was expected."""

import numpy as np
from numpy.typing import ArrayLike

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.motion import plausible


def checked_number(name: str, value: float) -> float:
    """A number."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise InputError(f"{name}: found {value!r:.60}, expected a number") from None


def checked_vector(name: str, values: ArrayLike, count: int) -> Floats:
    """So many numbers: one alone is not meant for all.

    Parameters
    ----------
    name : str
        Of what is given, for the message.
    values : array
    count : int
    """
    try:
        given = np.asarray(values, float)
    except (TypeError, ValueError):
        raise InputError(f"{name}: found what is not numbers, expected {count} numbers") from None
    if given.shape != (count,):
        found = {0: "a single number", 1: f"{given.size} in a list"}.get(given.ndim, f"an array {given.shape}")
        raise InputError(f"{name}: found {found}, expected {count} numbers")
    return given


def checked_reading(name: str, values: ArrayLike | None, count: int) -> Floats:
    """What sensors read, NaN where one was not read.

    Parameters
    ----------
    name : str
        Of what is given, for the message.
    values : array
    count : int
    """
    given = np.full(count, np.nan) if values is None else checked_vector(name, values, count)
    refuse_bad(name, given, ~np.isinf(given), "a finite number, or NaN where nothing was read")
    return given


def refuse_bad(name: str, given: Floats, good: Bools, expected: str) -> None:
    """Refuse the first number that is not good.

    Parameters
    ----------
    name : str
    given : array
    good : array of bool
    expected : str
    """
    if not good.all():
        i = int(np.argmin(good))
        raise InputError(f"{name}[{i}]: found {given[i]:g}, expected {expected}")


def refuse_unlikely(robot: Robot, name: str, joint_m: Floats) -> None:
    """Refuse joint values that cannot be meant.

    Parameters
    ----------
    robot : Robot
    name : str
        Of what is given, for the message.
    joint_m : (w,) array
        Of each leg.
    """
    unlikely = plausible.wrong(robot, joint_m[None])
    if unlikely is None:
        return
    (_, leg), expected = unlikely
    joint = leg if robot.winch is None else robot.winch[leg]
    raise InputError(f"{name}[{joint}]: found {joint_m[leg]:g}, expected {expected}; wire_m() turns straight ones")
