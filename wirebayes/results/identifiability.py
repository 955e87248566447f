"""What the data determine, in words: prior against posterior, sensitivity to the prior, and correlated parameters.

Power scaling raises the prior (or the likelihood) to a power slightly above and below one and measures how far the
posterior moves (Kallioinen et al., Detecting and diagnosing prior and likelihood sensitivity with power-scaling): a
distance of `SENSITIVE` for each doubling of the power matters. Positive parameters are measured by their logarithms, so
that a weakened prior keeps its median.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from wirebayes.inference.chain_statistics import pareto_smoothed, power_scaled, power_sensitivity
from wirebayes.inference.fit import Fit
from wirebayes.json_files.summary import CreepBand, ExtrapolatedCreep, Identifiability, IdentifiabilityFigures
from wirebayes.model.column_units import unit_of_column
from wirebayes.model.prior import Prior
from wirebayes.model.problem import Problem
from wirebayes.numeric.any_distribution import log_density_of
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Array
from wirebayes.results.contraction import contraction, source
from wirebayes.sentences import lasting, number, short, unit_text
from wirebayes.wire.fresh import FreshSample

SENSITIVE = 0.05  # the threshold that the authors of the method propose
RIDGE = 0.9  # correlation above which two parameters are known in combination only
_POWERS = (1.0 / 1.1, 1.1)  # so small that weights stay even, so large that the change exceeds the chance of 4000 draws
_NOTHING = 1e-6  # nats by which a component varies: it moves nothing, and its weights differ by rounding alone
_ENDS = (0.05, 0.95)  # of the interval that is reported
_DRAWS = 4000  # a 5 % quantile is then one between 4.3 % and 5.7 %


def identifiability(fitted: Fit) -> dict[str, Identifiability]:
    """How far the data determine each parameter.

    B and k2 in the units of the test, as `Prior.known` has them: at 1 N and after 1 s they are known as badly as these
    are far from what was tested, and that would depend on what is called a newton.

    Parameters
    ----------
    fitted : Fit

    Returns
    -------
    dict of name to Identifiability
        In the order of the problem's parameters.
    """
    problem = fitted.problem
    prior = problem.prior
    theta = _thinned(fitted.flat)
    known = prior.known(theta)
    positive = np.array([name in prior.logarithmic for name in problem.names])
    logs = np.log(np.where(positive, known, 1.0))
    z = np.where(positive, logs, known)
    own_prior = log_priors(fitted, theta)
    correlation = np.atleast_2d(np.corrcoef(z.T))
    drawn = prior.known_draws(20000, np.random.default_rng(0))
    by_likelihood = distances_per_doubling(z, problem.log_likelihood(theta))
    out: dict[str, Identifiability] = {}
    for i, name in enumerate(problem.names):
        is_factor = bool(positive[i])
        before = drawn[:, i]
        after = known[:, i]
        (by_prior,) = distances_per_doubling(z[:, [i]], own_prior[:, i])
        figures: IdentifiabilityFigures = {
            "contraction": contraction(after, before),
            "prior_range_90": _range(prior.distributions[name].ppf(_ENDS), is_factor),
            "posterior_range_90": _range(np.quantile(after, _ENDS), is_factor),
            "range_is_factor": is_factor,
            "prior_sensitivity": by_prior,
            "likelihood_sensitivity": by_likelihood[i],
            "ridges": _ridges(problem.names, correlation, i),
        }
        out[name] = {**figures, "sentence": _judged_in_words(problem, name, figures)}
    return out


def _judged_in_words(problem: Problem, name: str, figures: IdentifiabilityFigures) -> str:
    """A sentence about one parameter of a problem."""
    called = name + _measured_at(problem.prior, name)
    return parameter_in_words(called, figures, unit_of_column(name, problem.samples))


def _measured_at(prior: Prior, name: str) -> str:
    """In which unit a parameter is judged whose unit depends on an exponent, in words; empty for others."""
    if name not in prior.powers:
        return ""
    return " at the test's typical tension" if name.startswith("B") else " over a typical hold"


def _range(ends: Array, is_factor: bool) -> float:
    """How far the ends of an interval are apart."""
    low, high = ends
    return float(high / low if is_factor else high - low)


def _ridges(names: Sequence[str], correlation: Array, i: int) -> dict[str, float]:
    """The parameters that are known only together with one of them, and their correlation."""
    ridges = {}
    for j, name in enumerate(names):
        if j != i and abs(correlation[i, j]) > RIDGE:
            ridges[name] = float(correlation[i, j])
    return ridges


def _thinned(flat: Array) -> Array:
    """At most `_DRAWS` rows, evenly spread."""
    return flat[evenly(len(flat), _DRAWS)]


def parameter_in_words(name: str, figures: IdentifiabilityFigures, unit: str) -> str:
    """A sentence about one parameter.

    Parameters
    ----------
    name : str
    figures : dict
    unit : str
        Of the parameter, as in files; 1 and - are none.
    """
    determined_by = source(figures["contraction"])
    sensitivity = figures["prior_sensitivity"]
    if determined_by == "prior":
        verdict = "the data say next to nothing about it, the interval is the prior's"
    elif sensitivity > SENSITIVE or determined_by != "data":
        verdict = f"data and prior both determine it (sensitivity to the prior {sensitivity:.2f})"
    else:
        verdict = "the data determine it"
    after = number(figures["posterior_range_90"])
    before = number(figures["prior_range_90"])
    wide = f"spans a factor of {after}"
    if not figures["range_is_factor"]:
        shown = f" {unit_text(unit)}".rstrip()
        wide = f"is {after}{shown} wide"
        before += shown
    text = f"{name}: {verdict}; its 90 % interval {wide}, the prior's {before}"
    with_whom = [f"{other} (r = {number(r, 2)})" for other, r in figures["ridges"].items()]
    if with_whom:
        text += f"; it is correlated with {' and '.join(with_whom)}, and their combination is known better"
    return f"{text}."


def distances_per_doubling(values: Array, log_component: Array) -> list[float]:
    """How far the distribution of each column of (n, d) `values` moves for each doubling of a component's power."""
    if np.ptp(log_component) < _NOTHING:
        return [0.0] * values.shape[1]
    below, above = (np.exp(power_scaled(log_component, power)) for power in _POWERS)
    return [power_sensitivity(column, below, above, _POWERS) for column in values.T]


def log_priors(fitted: Fit, theta: Array) -> Array:
    """(n, d) log prior density of each parameter, of the logarithm of positive ones."""
    prior = fitted.problem.prior
    known = prior.known(theta)
    columns = []
    for (name, distribution), values in zip(prior.distributions.items(), known.T, strict=True):
        log_density = log_density_of(distribution)(values)
        if name in prior.logarithmic:
            log_density = log_density + np.log(values)
        columns.append(log_density)
    return np.stack(columns, axis=1)


@dataclass(frozen=True)
class Extrapolation:
    """Creep elongation of a fresh sample under a constant tension, against time.

    Attributes
    ----------
    time_s : (t,) array
    tension_N : float
    posterior_mm, weaker_prior_mm, prior_mm : (3, t) arrays
        5 %, 50 % and 95 %: as fitted; with the prior's logarithm halved; without any data.
    pareto_k : float
        Of the weights that make the prior weaker; above 0.7 that band is a guess.
    longest_hold_s : float
        The longest that a position was held in the test.
    """

    time_s: Array
    tension_N: float
    posterior_mm: Array
    weaker_prior_mm: Array
    prior_mm: Array
    pareto_k: float
    longest_hold_s: float

    @property
    def warning(self) -> str:
        """How far the longest time lies beyond the longest hold; empty where it does not."""
        factor = float(self.time_s[-1] / self.longest_hold_s) if self.longest_hold_s else np.inf
        if factor <= 1.0:
            return ""
        held = lasting(self.longest_hold_s)
        return (
            f"{self.time_s[-1] / 3600.0:g} h is {short(factor, 3)} times the longest hold ({held}): "
            "this far out the answer rests on the model's form alone, and no reading checks it."
        )

    @property
    def prior_share(self) -> Array:
        """(t,) how much the 90 % band widens (in logarithms) when the prior is made weaker: 0 is not at all."""

        def width(band: Array) -> Array:
            with np.errstate(divide="ignore", invalid="ignore"):  # draws without creep have no logarithm
                return np.log(band[2] / band[0])

        with np.errstate(invalid="ignore"):
            return width(self.weaker_prior_mm) / width(self.posterior_mm) - 1.0

    def to_dict(self) -> ExtrapolatedCreep:
        """The same as plain values, for JSON, with a sentence for the longest time."""
        hours = self.time_s[-1] / 3600.0
        return {
            "tension_N": self.tension_N,
            "time_s": self.time_s,
            "posterior_mm": _quantiles(self.posterior_mm),
            "weaker_prior_mm": _quantiles(self.weaker_prior_mm),
            "prior_mm": _quantiles(self.prior_mm),
            "prior_share": self.prior_share,
            "pareto_k": self.pareto_k,
            "sentence": f"Creep after {hours:g} h at {self.tension_N:g} N: {self._verdict()}.",
            "warning": self.warning,
        }

    def _verdict(self) -> str:
        """How much the creep at the longest time depends on the prior."""
        share = float(self.prior_share[-1])
        if not np.isfinite(share):
            return "more than a twentieth of the draws do not creep at this tension"
        if self.pareto_k > TRUSTED_K:
            return "these draws cannot show how much it depends on the prior"
        how = "wider" if share >= 0.0 else "narrower"
        wider = f"with half the prior's weight the band is {100.0 * abs(share):.0f} % {how}"
        depends = "it depends on the prior" if share > 0.1 else "it hardly depends on the prior"
        return f"{depends}: {wider}"


def _quantiles(values: Array) -> CreepBand:
    low, middle, high = values
    return {"q05": low, "q50": middle, "q95": high}


# from within a hold to the day that robots ask for; evenly spread on a logarithmic axis
TIMES_S = np.array([10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1200.0, 3600.0, 7200.0, 14400.0, 28800.0, 86400.0])
TRUSTED_K = 0.7  # of importance weights (Vehtari et al., Pareto smoothed importance sampling)


def extrapolation(fitted: Fit, tension_N: float, times_s: Array = TIMES_S, sample: int = 0) -> Extrapolation:
    """Creep to an hour and a day, with the prior's part in it made visible.

    Parameters
    ----------
    fitted : Fit
        Its own time law is extrapolated, with all effects of the wire.
    times_s : (t,) array
    sample : int
        Whose length B refers to.
    """
    problem = fitted.problem
    here = problem.samples[sample]
    theta = _thinned(fitted.flat)
    # the prior to the power of a half: weights are its inverse root
    log_weight, k = pareto_smoothed(-0.5 * log_priors(fitted, theta).sum(axis=1))
    weight = np.exp(log_weight - log_weight.max())

    def creep(rows: Array) -> Array:
        wire = FreshSample(problem.parameters(rows, here), here.model, here.protocol.length_mm)
        return wire.creep_mm(tension_N, times_s)

    courses = creep(theta)
    before = creep(problem.prior.rvs(_DRAWS, np.random.default_rng(0)))
    levels = [0.05, 0.5, 0.95]
    weaker = [_weighted_quantiles(course, weight, levels) for course in courses]
    longest = max(s.protocol.duration_s.max() for s in problem.samples)
    return Extrapolation(
        times_s,
        tension_N,
        posterior_mm=np.quantile(courses, levels, axis=1),
        weaker_prior_mm=np.stack(weaker, axis=1),
        prior_mm=np.quantile(before, levels, axis=1),
        pareto_k=float(k),
        longest_hold_s=float(longest),
    )


def _weighted_quantiles(values: Array, weight: Array, levels: Sequence[float]) -> Array:
    order = np.argsort(values)
    ranked = weight[order]
    share = (np.cumsum(ranked) - 0.5 * ranked) / weight.sum()
    return np.interp(levels, share, values[order])
