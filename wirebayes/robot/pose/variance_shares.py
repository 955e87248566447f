"""Which parameter's uncertainty makes the pose error: shares of the variance when parameters are correlated.

Every parameter gets its average gain in explained variance over all orders in which the parameters can be learnt
(Lindeman, Merenda and Gold's shares; the Shapley value of a regression). Shares of the parameters and of what no
regression explains add up to one.
"""

from collections.abc import Mapping
from itertools import combinations
from math import comb

import numpy as np

from wirebayes.numeric.typing import Floats


def shares(parameters: Mapping[str, Floats], output: Floats) -> dict[str, float]:
    """Shares of an output's variance, each parameter entering by its logarithm (or itself) and that squared.

    Parameters
    ----------
    parameters : mapping of name to (n,) array
    output : (n,) array

    Returns
    -------
    dict
        One share a parameter, and "unexplained".
    """
    names = [name for name, value in parameters.items() if np.std(value) > 0]
    if not names or np.var(output) == 0:
        return dict.fromkeys(parameters, 0.0) | {"unexplained": 0.0}
    explained = _explained({name: _columns(parameters[name]) for name in names}, output)
    out = dict.fromkeys(parameters, 0.0)
    for name in names:
        out[name] = _mean_gain(explained, names, name)
    return out | {"unexplained": 1.0 - explained[tuple(names)]}


def _mean_gain(explained: dict[tuple[str, ...], float], names: list[str], name: str) -> float:
    """What a parameter adds to the explained share, over all orders in which the parameters can be learnt."""
    rest = [other for other in names if other != name]
    gain = 0.0
    for size in range(len(names)):
        orders = len(names) * comb(len(rest), size)
        for subset in combinations(rest, size):
            with_it = tuple(other for other in names if other in subset or other == name)
            gain += (explained[with_it] - explained[subset]) / orders
    return gain


def _explained(columns: dict[str, Floats], output: Floats) -> dict[tuple[str, ...], float]:
    """Share of an output's variance that the regression on every subset of parameters explains."""
    y = (output - output.mean()) / output.std()
    explained: dict[tuple[str, ...], float] = {(): 0.0}
    for size in range(1, len(columns) + 1):
        for subset in combinations(columns, size):
            X = np.column_stack([columns[name] for name in subset])
            fit = X @ np.linalg.lstsq(X, y, rcond=None)[0]
            explained[subset] = float(1.0 - np.mean((y - fit) ** 2))
    return explained


def _columns(value: Floats) -> Floats:
    z = np.log(value) if np.all(value > 0) else value
    z = (z - z.mean()) / z.std()
    square = z * z
    return np.column_stack([z, square - square.mean()])
