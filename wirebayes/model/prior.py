"""What a person knows of a thin line before the test: one object for sampling, calibration and prediction.

The ranges (5 % to 95 %) and their reasons:

=============  ====================  ==========================================================================
k1             170 to 24,000 N       nylon monofilament of 0.2 mm to braided polyethylene of 1 mm (modulus x area)
B              5.1e-5 to 2.7e-3 L0   creep strain at 1 N; 1e-4 to 1e-3 measured on light polymer lines
U              0.16 to 1.6           linear viscoelasticity is 1; polymers under small loads lie below
k2             0.0042 to 0.22 s^-N   half the creep within seconds up to hours, together with N
N              0.31 to 1.4           1 is an exponential, below it a stretched one
preload        -1.1 to 2.1 mm        the test begins at a small tension, at a step of about 1 mm
sensor_sd      0.0014 to 0.1 N       a load cell of 10 to 100 N range
setting_sd     0.004 to 0.2 mm       a milling machine's screw up to a hand-set vernier
=============  ====================  ==========================================================================
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy import stats
from scipy.special import log_ndtr

from wirebayes.errors import InputError
from wirebayes.io.readings import shown
from wirebayes.typing import Array

ABOVE_ZERO, NOT_BELOW_ZERO = ("k1", "N"), ("B", "k2", "sensor_sd", "setting_sd")  # as stiffness, creep and errors are
_HALF_LOG_2PI = 0.5 * float(np.log(2.0 * np.pi))


@dataclass(frozen=True)
class Prior:
    """Independent distributions of ordered parameters, some of them fixed.

    Attributes
    ----------
    distributions : dict of name to scipy frozen distribution
        In the order of the columns of every ``(n, d)`` array of parameters.
    fixed : dict of name to float
        Parameters that are known and not sampled.
    logarithmic : frozenset of str
        Positive parameters, sampled as logarithms.
    """

    distributions: dict[str, Any]
    fixed: dict[str, float]
    logarithmic: frozenset[str]

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.distributions)

    def rvs(self, n: int, rng: np.random.Generator) -> Array:
        """(n, d) draws."""
        return np.column_stack([d.rvs(size=n, random_state=rng) for d in self.distributions.values()])

    def ppf(self, cube: Array) -> Array:
        """(n, d) parameters of points ``(n, d)`` in the unit cube."""
        return np.column_stack([d.ppf(cube[:, i]) for i, d in enumerate(self.distributions.values())])

    def log_density(self) -> Callable[[Array], Array]:
        """A function of (n, d) parameters that returns the (n,) log density."""
        forms = [_parsed(d) for d in self.distributions.values()]
        # most columns are of this form, and a call for each would take longer than the arithmetic
        is_positive = np.array([d.name == "lognorm" and d.loc == 0.0 for d in forms])
        positive = np.flatnonzero(is_positive)
        together = _lognormal(*(np.array([getattr(forms[i], k) for i in positive]) for k in ("shape", "scale")))
        others = [(i, fast_logpdf(d)) for i, d in enumerate(self.distributions.values()) if not is_positive[i]]

        def evaluate(theta: Array) -> Array:
            total = together(theta[:, positive]).sum(axis=1)
            for i, log_pdf in others:
                total = total + log_pdf(theta[:, i])
            return total

        return evaluate


def fast_logpdf(dist: Any) -> Callable[[Array], Array]:
    """The log density of a frozen distribution; closed forms of the common ones avoid scipy's overhead per call."""
    name, shape, loc, scale = _parsed(dist)
    if name == "norm":
        constant = float(np.log(scale)) + _HALF_LOG_2PI
        return lambda x: -0.5 * ((x - loc) / scale) ** 2 - constant
    if name == "halfnorm":
        constant = 0.5 * float(np.log(2.0 / np.pi)) - float(np.log(scale))
        return lambda x: np.where(x >= loc, constant - 0.5 * ((x - loc) / scale) ** 2, -np.inf)
    if name == "lognorm" and loc == 0.0:
        return _lognormal(shape, scale)
    if name == "truncnorm" and dist.support()[1] == np.inf:
        least, whole = loc + shape * scale, float(np.log(scale)) + _HALF_LOG_2PI + float(log_ndtr(-shape))
        return lambda x: np.where(x >= least, -0.5 * ((x - loc) / scale) ** 2 - whole, -np.inf)
    if name == "uniform":
        return lambda x: np.where((x >= loc) & (x <= loc + scale), -np.log(scale), -np.inf)
    return lambda x: np.asarray(dist.logpdf(x))


class _Parsed(NamedTuple):
    """Name, first shape parameter (0 where there is none), location and scale of a distribution."""

    name: str
    shape: float
    loc: float
    scale: float


def _parsed(dist: Any) -> _Parsed:
    """What a frozen distribution of scipy was made with."""
    shapes, loc, scale = dist.dist._parse_args(*dist.args, **dist.kwds)
    return _Parsed(dist.dist.name, float(shapes[0]) if shapes else 0.0, float(loc), float(scale))


def _lognormal(spread: Any, median: Any) -> Callable[[Array], Array]:
    """The log density of a log-normal distribution, or of several, a column each."""
    middle, constant = np.log(median), np.log(spread) + _HALF_LOG_2PI

    def evaluate(x: Array) -> Array:
        inside = x > 0
        log_x = np.log(np.where(inside, x, 1.0))
        return np.where(inside, -0.5 * ((log_x - middle) / spread) ** 2 - log_x - constant, -np.inf)

    return evaluate


def wire_defaults(length_mm: float) -> dict[str, Any]:
    """Distributions of the plain model's parameters for a sample of this length (see the module's table)."""
    return dict(_wire_defaults(length_mm))


@cache  # scipy takes as long to make eight distributions as a hundred points take to be evaluated
def _wire_defaults(length_mm: float) -> dict[str, Any]:
    return {
        "k1": stats.lognorm(1.5, scale=2000.0),
        "B": stats.lognorm(1.2, scale=3.7e-4 * length_mm),
        "U": stats.lognorm(0.7, scale=0.5),
        "k2": stats.lognorm(1.2, scale=0.03),
        "N": stats.lognorm(0.45, scale=0.65),
        "preload": stats.norm(0.5, 1.0),
        "sensor_sd": stats.lognorm(1.3, scale=0.012),
        "setting_sd": stats.lognorm(1.2, scale=0.03),
    }


# for each form its keys in a TOML table, and how scipy makes it of them
_FORMS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "normal": (("mean", "sd"), lambda mean, sd: stats.norm(mean, sd)),
    "half-normal": (("sd",), lambda sd: stats.halfnorm(0.0, sd)),
    "log-normal": (("median", "sd_log"), lambda median, sd_log: stats.lognorm(sd_log, scale=median)),
    "uniform": (("low", "high"), lambda low, high: stats.uniform(low, high - low)),
}


def from_table(key: str, table: Any) -> Any:
    """A distribution, or a float for a fixed value, from a TOML table.

    ``{ distribution = "log-normal", median = 700.0, sd_log = 0.3 }``, likewise ``normal`` (mean, sd),
    ``half-normal`` (sd), ``uniform`` (low, high); ``{ fixed = 1.0 }`` keeps a parameter at a value.

    Raises
    ------
    InputError
        Naming the key, what was found and what was expected.
    """
    if not isinstance(table, Mapping):
        raise InputError(
            f'{key}: found {shown(table)}, expected a table such as {{ distribution = "normal", mean = 0.0, sd = 1.0 }}'
        )
    if set(table) == {"fixed"}:
        return _number(f"{key}.fixed", table["fixed"])
    form = table.get("distribution")
    if not isinstance(form, str) or form not in _FORMS:
        found = shown(form) if "distribution" in table else "no such key"
        raise InputError(f"{key}.distribution: found {found}, expected one of {', '.join(_FORMS)} (or fixed = VALUE)")
    wanted, build = _FORMS[form]
    extra, missing = set(table) - {"distribution", *wanted}, set(wanted) - set(table)
    if extra or missing:
        raise InputError(
            f"{key}: found {shown(', '.join(sorted(set(table) - {'distribution'})) or 'nothing')}, "
            f"expected {', '.join(wanted)} of a {form} distribution"
        )
    values = {name: _number(f"{key}.{name}", table[name]) for name in wanted}
    for name in ("sd", "sd_log", "median"):
        if values.get(name, 1.0) <= 0:
            raise InputError(f"{key}.{name}: found {values[name]}, expected a number above zero")
    if form == "uniform" and values["high"] <= values["low"]:
        raise InputError(f"{key}.high: found {values['high']}, expected a number above low = {values['low']}")
    return build(**values)


def possible(key: str, name: str, wanted: Any) -> Any:
    """A prior without values that its parameter cannot have: where those are below zero, a normal one is cut off there.

    Parameters
    ----------
    key : str
        Where it was written, for messages.
    name : str
        Of the parameter.
    wanted : float or scipy frozen distribution
        As `from_table` returned it.

    Returns
    -------
    float or scipy frozen distribution

    Raises
    ------
    InputError
        A fixed value that the parameter cannot have, a uniform prior that begins below zero, or a normal one with most
        of its mass there.
    """
    if name not in (*ABOVE_ZERO, *NOT_BELOW_ZERO):
        return wanted
    if isinstance(wanted, float):
        if wanted < 0 or (wanted == 0 and name in ABOVE_ZERO):
            least = "a number above 0" if name in ABOVE_ZERO else "0 or more"
            raise InputError(f"{key}.fixed: found {wanted:g}, expected {least}")
        return wanted
    low = float(wanted.support()[0])
    if low >= 0:
        return wanted
    if np.isfinite(low):
        raise InputError(f"{key}.low: found {low:g}, expected 0 or more: {name} is never negative")
    mean, sd = float(wanted.mean()), float(wanted.std())
    if mean < 0:
        raise InputError(f"{key}.mean: found {mean:g}, expected 0 or more: {name} is never negative")
    return wanted if mean > _NEVER_BELOW * sd else stats.truncnorm(-mean / sd, np.inf, loc=mean, scale=sd)


def _number(key: str, value: Any) -> float:
    expected = f"a finite number of at most {_LARGEST:.0e} in size"
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
        raise InputError(f"{key}: found {shown(value)}, expected {expected}")
    return float(value)


_NEVER_BELOW = 8.0  # standard deviations: a normal prior so far above zero has 1e-15 below it
_LARGEST = 1e100  # squares and exponentials of what is larger overflow
