"""Values that several files hold."""

from typing import Any, Literal, TypedDict

from wirebayes.numeric.typing import Floats, Ints

# an array where it is computed, a list where it is read
Numbers = Floats | list[float]
Integers = Ints | list[int]

# of the plain model's parameters; errors of what is set and read have the unit of either
UNITS = {"k1": "N", "B": "mm N^-U", "U": "1", "k2": "s^-N", "N": "1", "preload": "mm"}

Quantile = Literal["q05", "q50", "q95"]
Statistic = Literal["mean", "sd", Quantile]
INTERVAL: tuple[Quantile, ...] = ("q05", "q50", "q95")  # the ends of a 90 % interval and the median between them


class Quantiles(TypedDict):
    """Three quantiles of draws."""

    q05: float
    q50: float
    q95: float


class Statistics(Quantiles):
    """Mean, standard deviation and quantiles of draws."""

    mean: float
    sd: float


class Band(TypedDict):
    """Mean, sd and quantiles over the draws, each a number or array like one draw; None where no draw has a value."""

    mean: Any
    sd: Any
    q05: Any
    q50: Any
    q95: Any


class MeanAndSd(TypedDict):
    """Mean and standard deviation of a quantity, a number for each wire."""

    mean: Numbers
    sd: Numbers
