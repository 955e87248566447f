"""What the readings say about each published value: inside the posterior's interval, outside, or not determined.

A parameter counts as determined by the readings when they took away nine tenths of its prior variance, on a
logarithmic scale: its interval has then less than a third of the width it had before the test.
"""

from collections.abc import Mapping
from typing import Any, Literal

import numpy as np

from wirebayes.json_files.summary import CREEP_TIMES_S
from wirebayes.model.prior import PowerScaled
from wirebayes.model.sample import MATERIAL
from wirebayes.numeric.typing import Array
from wirebayes.paper.least_squares import at
from wirebayes.results.contraction import MOST, contraction, interval
from wirebayes.results.parameters import unit_of
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import Model

Verdict = Literal["inside", "outside", "not determined"]
PRODUCT = "k1*B"  # the only combination that one hold alone determines


def verdict(published: float, low: float, high: float, shrunk: float) -> Verdict:
    """The word for a published value.

    Parameters
    ----------
    low, high : float
        Ends of the posterior's 90 % interval.
    shrunk : float
        The contraction (`wirebayes.results.contraction.contraction`).

    Returns
    -------
    {"inside", "outside", "not determined"}
    """
    if shrunk < MOST:
        return "not determined"
    return "inside" if low <= published <= high else "outside"


def verdict_rows(
    experiment: str,
    likelihood: str,
    draws: Mapping[str, Array],
    prior: Mapping[str, Array],
    powers: Mapping[str, PowerScaled],
    published: Mapping[str, float],
) -> list[dict[str, Any]]:
    """One row a parameter: posterior and prior interval, contraction, published value and verdict.

    Values and intervals are in the paper's units, of creep at 1 N and its rate after 1 s. The contraction is, as on the
    page of a fit, that of creep at the test's typical tension and of its rate over a typical hold: at 1 N creep is
    known as badly as 1 N is far from what was tested.

    Parameters
    ----------
    experiment, likelihood : str
    draws, prior : mapping of name to (n,) array
        Of the posterior and of the prior.
    powers : mapping of name to PowerScaled
        What parameters are multiplied by to be those of the test (`wirebayes.model.prior.Prior`).
    published : mapping of name to float
    """
    of_test, of_test_before = (_of_test(values, powers) for values in (draws, prior))
    out = []
    for name in (*MATERIAL, PRODUCT):
        after = _quantity(name, draws)
        before = _quantity(name, prior)
        value = float(_quantity(name, published))
        low, middle, high = interval(after)
        prior_low, _, prior_high = interval(before)
        shrunk = contraction(_quantity(name, of_test), _quantity(name, of_test_before))
        out.append(
            {
                "experiment": experiment,
                "likelihood": likelihood,
                "parameter": name,
                "unit": "N mm N^-U" if name == PRODUCT else unit_of(name),
                "published": value,
                "q05": low,
                "q50": middle,
                "q95": high,
                "prior_q05": prior_low,
                "prior_q95": prior_high,
                "contraction": shrunk,
                "verdict": verdict(value, low, high, shrunk),
            }
        )
    return out


def creep_rows(
    experiment: str,
    likelihood: str,
    draws: Mapping[str, Array],
    published: Mapping[str, float],
    tension_N: float,
    length_mm: float,
) -> list[dict[str, Any]]:
    """Creep elongation at a tension after 2 min, 1 h and 1 day: published parameters beside the posterior.

    Parameters
    ----------
    experiment, likelihood : str
        Written into every row.
    draws : mapping of name to (n,) array
        Of the posterior.
    published : mapping of name to float
        The wire's row of Table 4.
    tension_N : float
        The constant tension of a fresh sample.
    length_mm : float
        Its length.

    Returns
    -------
    list of dict
        One a time, with the median and the ends of the 90 % interval.
    """
    times = np.array(list(CREEP_TIMES_S.values()))
    table = at(published)
    ours = FreshSample(draws, Model(), length_mm).creep_mm(tension_N, times)
    (theirs,) = FreshSample(table, Model(), length_mm).creep_mm(tension_N, times).T
    out = []
    for time_s, mine, published_mm in zip(times.tolist(), ours, theirs, strict=True):
        low, middle, high = interval(mine)
        out.append(
            {
                "experiment": experiment,
                "likelihood": likelihood,
                "tension_N": tension_N,
                "time_s": time_s,
                "published_mm": float(published_mm),
                "q05_mm": low,
                "q50_mm": middle,
                "q95_mm": high,
            }
        )
    return out


def _of_test(values: Mapping[str, Array], powers: Mapping[str, PowerScaled]) -> dict[str, Array]:
    """Draws, with those of parameters whose unit depends on an exponent in the units of the test."""
    out = dict(values)
    for name, (exponent, log_base) in powers.items():
        power = values[exponent] if isinstance(exponent, str) else exponent
        out[name] = values[name] * np.exp(log_base * power)
    return out


def _quantity(name: str, values: Mapping[str, Any]) -> Any:
    return values["k1"] * values["B"] if name == PRODUCT else values[name]
