"""What is known of a line before its test: one object for sampling, calibration and prediction.

Default priors are numbers in the scales of the test (`wirebayes.model.scales`): its displacement step and range, its
typical tension, its typical hold. Their ranges (5 % to 95 %) and reasons:

=============  ==========================================  ===========================================================
parameter      range                                       reason
=============  ==========================================  ===========================================================
k1             0.13 to 18 tensions / (range / length)      a test spans tensions of its typical size: k1 times the
                                                           range of strain is 2 typical tensions where it begins at
                                                           none, less where the wire is preloaded or kept slack
B              0.013 to 1.8 of half the range              creep at the typical tension as a share of the elastic
                                                           stretch there: a per cent on stiff braids, most on kite line
U              0.16 to 1.6                                 linear viscoelasticity is 1; polymers under small loads lie
                                                           below
k2             0.059 to 8.3 hold^-N                        a hold shows between a twentieth and all of the creep
N              0.31 to 1.4                                 1 is an exponential, below it a stretched one
preload        -0.39 to 0.59 of the range                  the test begins at a small tension, or a little slack
sensor_sd      0.00025 to 0.035 tensions                   load cells resolve a ten-thousandth to a hundredth of what
                                                           they are used for
setting_sd     0.004 to 0.16 steps, at most 0.5            a screw up to a hand-set vernier; displacements that are
                                                           off by more than half a step do not order the holds
=============  ==========================================  ===========================================================

Where the tension is set, ``setting_sd`` is as many steps of the weight and ``sensor_sd`` the same share of the range of
displacements; the zero of the gauge is arbitrary, so that ``preload`` is as wide as that range, about what the weights
say of the wire without tension by proportion.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any, NamedTuple

import numpy as np
from scipy.special import logit

from wirebayes.errors import InputError, shown
from wirebayes.model.scales import Scales
from wirebayes.numeric.any_distribution import log_density_of, ours
from wirebayes.numeric.distributions import (
    HalfNormal,
    LogitNormal,
    LogNormal,
    Normal,
    TruncatedNormal,
    Uniform,
    log_normal,
)
from wirebayes.numeric.typing import Array, Function
from wirebayes.wire.protocol import Control

ABOVE_ZERO, NOT_BELOW_ZERO = ("k1", "N"), ("B", "k2", "sensor_sd", "setting_sd")  # as stiffness, creep and errors are


class PowerScaled(NamedTuple):
    """A parameter whose unit depends on another one: its distribution is that of ``value * exp(log_base * exponent)``.

    ``B`` in mm N^-U is the creep at 1 N. What is known is the creep at the test's typical tension, B times that tension
    to the power U.
    """

    exponent: str | float
    log_base: float


@dataclass(frozen=True)
class Prior:
    """Independent distributions of ordered parameters, some of them fixed.

    Attributes
    ----------
    distributions : dict of name to Distribution
        In the order of the columns of every ``(n, d)`` array of parameters.
    fixed : dict of name to float
        Parameters that are known and not sampled.
    logarithmic : frozenset of str
        Positive parameters, sampled as logarithms.
    powers : dict of name to PowerScaled
        Of parameters whose unit depends on an exponent, the other column or a number.
    """

    distributions: dict[str, Any]
    fixed: dict[str, float]
    logarithmic: frozenset[str]
    powers: dict[str, PowerScaled] = field(default_factory=dict)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(self.distributions)

    def rvs(self, n: int, rng: np.random.Generator) -> Array:
        """(n, d) draws."""
        return self._from_known(self.known_draws(n, rng))

    def known_draws(self, n: int, rng: np.random.Generator) -> Array:
        """(n, d) the same draws, of what the distributions are of."""
        known = np.empty((n, len(self.distributions)))
        for i, distribution in enumerate(self.distributions.values()):
            known[:, i] = distribution.rvs(size=n, random_state=rng)
        return known

    def named_draws(self, n: int, rng: np.random.Generator) -> dict[str, Array]:
        """(n,) draws of every parameter, fixed ones included."""
        drawn = dict(zip(self.names, self.rvs(n, rng).T, strict=True))
        return drawn | {name: np.full(n, value) for name, value in self.fixed.items()}

    def ppf(self, cube: Array) -> Array:
        """(n, d) parameters of points ``(n, d)`` in the unit cube."""
        known = [d.ppf(cube[:, i]) for i, d in enumerate(self.distributions.values())]
        return self._from_known(np.column_stack(known))

    def log_factor(self, name: str, theta: Array) -> Any:
        """(n,) logarithm of what a parameter of (n, d) is multiplied by for its distribution; 0.0 for most."""
        if name not in self.powers:
            return 0.0
        exponent, log_base = self.powers[name]
        if not isinstance(exponent, str):
            return log_base * exponent
        return log_base * (self.fixed[exponent] if exponent in self.fixed else theta[:, self.names.index(exponent)])

    def known(self, theta: Array) -> Array:
        """(n, d) what the distributions are of: parameters (n, d), those with powers times their factor."""
        if not self.powers:
            return theta
        out = theta.copy()
        for name in self.powers.keys() & self.distributions.keys():
            out[:, self.names.index(name)] *= np.exp(self.log_factor(name, theta))
        return out

    def _from_known(self, known: Array) -> Array:
        """Parameters of what their distributions are of, both (n, d)."""
        theta = known.copy()
        for name in self.powers.keys() & self.distributions.keys():
            theta[:, self.names.index(name)] *= np.exp(-self.log_factor(name, known))
        return theta

    def log_density(self) -> Function:
        """A function of (n, d) parameters that returns the (n,) log density."""
        forms = [ours(distribution) for distribution in self.distributions.values()]
        # most columns are of this form, and a call for each would take longer than the arithmetic
        log_normals = {i: form for i, form in enumerate(forms) if isinstance(form, LogNormal)}
        positive = list(log_normals)
        together = log_normal(
            np.array([form.sd_log for form in log_normals.values()]),
            np.array([form.middle for form in log_normals.values()]),
        )
        others = [(i, log_density_of(form)) for i, form in enumerate(forms) if i not in positive]
        powers = [name for name in self.distributions if name in self.powers]

        def evaluate(theta: Array) -> Array:
            known = self.known(theta)
            total = together(known[:, positive]).sum(axis=1)
            for name in powers:
                total = total + self.log_factor(name, theta)
            for i, log_pdf in others:
                total = total + log_pdf(known[:, i])
            return total

        return evaluate


K1_TENSIONS, K1_SD = 1.5, 1.5  # k1 times the range of strain, in typical tensions; sd of the logarithm
CREEP_SHARE, CREEP_SD = 0.15, 1.5  # of the elastic stretch at the typical tension, nearly half the range
HAZARD, HAZARD_SD = 0.7, 1.5  # k2 t^N after a typical hold, when half of the creep is over
PRELOAD_MEAN, PRELOAD_SD = 0.1, 0.3  # of the range
SENSOR, SENSOR_SD = 0.003, 1.5  # of the typical tension
SETTING, SETTING_LOG_SD, SETTING_MOST = 0.03, 1.2, 0.5  # of the typical step


def wire_defaults(
    length_mm: float, scales: Scales, control: Control = "displacement", zero_mm: float = 0.0
) -> dict[str, Any]:
    """Distributions of the plain model's parameters, in the test's own units (see the module's table).

    Parameters
    ----------
    length_mm : float
        Of the sample.
    control : {"displacement", "force"}
        What is set in the test: its setting error is one of that, its sensor error one of what is read.
    zero_mm : float
        What the gauge of a test under weights shows of the wire without tension.

    Returns
    -------
    dict of name to Distribution
        ``B`` is the creep at the typical tension in steps, ``k2`` the hazard after a typical hold.
    """
    lengths = length_mm / scales.range_mm
    steps = scales.range_mm / scales.step_mm
    if control == "displacement":
        return dict(_wire_defaults(lengths, steps))
    preload = Normal(-zero_mm / scales.step_mm, steps)
    return (
        _wire_defaults(lengths, steps) | _under_weights(steps, scales.step_N / scales.tension_N) | {"preload": preload}
    )


@cache  # a search asks for them thousands of times
def _wire_defaults(lengths: float, steps: float) -> dict[str, Any]:
    """`lengths` is the sample's length in ranges of displacement, `steps` the range in steps."""
    return {
        "k1": LogNormal(K1_SD, K1_TENSIONS * lengths),
        "B": LogNormal(CREEP_SD, CREEP_SHARE * 0.5 * steps),
        "U": LogNormal(0.7, 0.5),
        "k2": LogNormal(HAZARD_SD, HAZARD),
        "N": LogNormal(0.45, 0.65),
        "preload": Normal(PRELOAD_MEAN * steps, PRELOAD_SD * steps),
        "sensor_sd": LogNormal(SENSOR_SD, SENSOR),
        "setting_sd": LogitNormal(float(logit(SETTING / SETTING_MOST)), SETTING_LOG_SD, SETTING_MOST),
    }


@cache
def _under_weights(steps: float, weight_step: float) -> dict[str, Any]:
    """What is different of the errors where the tension is set.

    Parameters
    ----------
    steps : float
        The range of displacements in steps.
    weight_step : float
        The typical change of the weight in typical tensions.
    """
    most = SETTING_MOST * weight_step
    return {
        "sensor_sd": LogNormal(SENSOR_SD, SENSOR * steps),
        "setting_sd": LogitNormal(float(logit(SETTING / SETTING_MOST)), SETTING_LOG_SD, most),
    }


# for each form its keys in a TOML table, and how it is made of them
_FORMS: dict[str, tuple[tuple[str, ...], Callable[..., Any]]] = {
    "normal": (("mean", "sd"), Normal),
    "half-normal": (("sd",), HalfNormal),
    "log-normal": (("median", "sd_log"), lambda median, sd_log: LogNormal(sd_log, median)),
    "uniform": (("low", "high"), lambda low, high: Uniform(low, high - low)),
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
    extra = set(table) - {"distribution", *wanted}
    missing = set(wanted) - set(table)
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
    return build(*(values[name] for name in wanted))


def possible(key: str, name: str, wanted: Any) -> Any:
    """A prior without values that its parameter cannot have: where those are below zero, a normal one is cut off there.

    Parameters
    ----------
    key : str
        Where it was written, for messages.
    name : str
        Of the parameter.
    wanted : float or Distribution
        As `from_table` returned it.

    Returns
    -------
    float or Distribution

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
    mean = float(wanted.mean())
    sd = float(wanted.std())
    if mean < 0:
        raise InputError(f"{key}.mean: found {mean:g}, expected 0 or more: {name} is never negative")
    return wanted if mean > _NEVER_BELOW * sd else TruncatedNormal(-mean / sd, mean, sd)


def _number(key: str, value: Any) -> float:
    expected = f"a finite number of at most {_LARGEST:.0e} in size"
    if isinstance(value, bool) or not isinstance(value, int | float) or not abs(value) <= _LARGEST:
        raise InputError(f"{key}: found {shown(value)}, expected {expected}")
    return float(value)


_NEVER_BELOW = 8.0  # standard deviations: a normal prior so far above zero has 1e-15 below it
_LARGEST = 1e100  # squares and exponentials of what is larger overflow
