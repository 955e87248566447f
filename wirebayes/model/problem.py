"""From parameters to a log posterior: which column belongs to which sample, and the batched density.

Columns are named ``k1``, ``preload`` …, effect amplitudes ``effect.parameter``. If several samples are fitted jointly,
a column of one sample is ``preload[sample]`` and one of a material ``k1[material]``; the most specific name is used.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from wirebayes.model import likelihoods, single_holds
from wirebayes.model.column_units import parameter_of, sample_in, unit_of_column, units_ratio
from wirebayes.model.hold_filter import Measured
from wirebayes.model.prior import PowerScaled, Prior
from wirebayes.model.sample import LENGTH_EXPONENT, Likelihood, Sample, at_length
from wirebayes.model.scales import NATURAL, Scales, Units
from wirebayes.numeric.any_distribution import scaled
from wirebayes.numeric.log_sum import or_impossible
from wirebayes.numeric.typing import Array
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.protocol import Protocol
from wirebayes.wire.staircase import Linearised, linearise, streamed


@dataclass(frozen=True)
class Problem:
    """A posterior: samples, prior and likelihood.

    Attributes
    ----------
    samples : tuple of Sample
    prior : Prior
        Its names are the columns of every ``(n, d)`` parameter array.
    likelihood : {"chain", "hold"}
    scales : Scales or None
        Of the test, which default priors refer to; None where there is nothing to scale, as for a stored posterior.
    units : Units
        In which parameters, protocols and readings are written.
    stated : frozenset of str
        Parameters whose prior a person stated, in natural units.
    told : frozenset of str
        Those of them whose prior is what readings of other materials say.
    """

    samples: tuple[Sample, ...]
    prior: Prior
    likelihood: Likelihood = "chain"
    scales: Scales | None = None
    units: Units = NATURAL
    stated: frozenset[str] = frozenset()
    told: frozenset[str] = frozenset()

    @property
    def names(self) -> tuple[str, ...]:
        return self.prior.names

    def column(self, name: str, sample: Sample) -> str:
        """The column, or fixed parameter, that holds a parameter of one sample: the most specific one.

        Raises
        ------
        KeyError
            If there is none.
        """
        marks = sample.name, sample.material, sample.protocol.control
        for candidate in (*(f"{name}[{mark}]" for mark in marks), name):
            if candidate in self.prior.distributions or candidate in self.prior.fixed:
                return candidate
        raise KeyError(name)

    def place(self, name: str, sample: Sample) -> int | float:
        """Where a parameter of one sample stands: the number of its column, or the number at which it is fixed."""
        column = self.column(name, sample)
        return self.names.index(column) if column in self.names else float(self.prior.fixed[column])

    def length_exponent(self, sample: Sample) -> int | float:
        """The place of the exponent by which B grows with the length; 0.0 for a sample of the length that B is of."""
        return 0.0 if sample.length_ratio == 1.0 else self.place(LENGTH_EXPONENT, sample)

    def parameters(self, theta: Array, sample: Sample) -> dict[str, Array]:
        """The parameters of one sample, each (n,), from an (n, d) array of all columns."""
        columns = np.ascontiguousarray(theta.T)
        n = len(theta)

        def find(place: int | float) -> Array:
            return columns[place] if isinstance(place, int) else np.full(n, place)

        out = {name: find(place) for name, place in self._places(sample).items()}
        ratio = sample.length_ratio
        if ratio == 1.0:
            return out
        return at_length(out, sample.model.effects, ratio, find(self.place(LENGTH_EXPONENT, sample)))

    def _places(self, sample: Sample) -> Mapping[str, int | float]:
        """Where each parameter of a sample stands (see `place`), found once: every evaluation asks for it."""
        known = self._known_places.get(id(sample))
        if known is None or known[0] is not sample:  # a number may be that of another sample that is gone
            columns = [column for effect in sample.model.effects for column in effect.columns()]
            names = (*sample.parameters(self.likelihood), *columns)
            known = sample, {name: self.place(name, sample) for name in names}
            self._known_places[id(sample)] = known
        return known[1]

    @cached_property
    def _known_places(self) -> dict[int, tuple[Sample, Mapping[str, int | float]]]:
        return {}

    def hold_log_likelihood(self, theta: Array, readings: Sequence[Array] | None = None) -> list[Array]:
        """Per sample the (H, n) log-likelihood of each hold, given those before (chain) or its first reading (hold).

        `readings` replaces the measured ones, per sample (H, R, n), row by row of `theta` (simulated replicates).
        """
        out = []
        for sample, y in self.observed(readings):
            own = self.parameters(theta, sample)
            if self.likelihood == "hold":
                variance = sample.variance(own)
                out.append(single_holds.hold_by_hold(sample.protocol, own, sample.model, y, variance))
            else:
                measured = sample.measured(own, y)
                line = streamed(sample.protocol, own, sample.model, measured.first_readings)
                out.append(likelihoods.chain(line, measured).log_likelihood)
        return out

    def observed(self, readings: Sequence[Array] | None) -> Iterator[tuple[Sample, Array]]:
        """Each sample with its readings, or with those that stand in for them."""
        measured = [sample.readings for sample in self.samples]
        return zip(self.samples, measured if readings is None else readings, strict=True)

    def log_likelihood(self, theta: Array, readings: Sequence[Array] | None = None) -> Array:
        """(n,) log-likelihood; -inf where the model cannot be computed."""
        with np.errstate(all="ignore"):
            total: Array = sum(holds.sum(axis=0) for holds in self.hold_log_likelihood(theta, readings))
        return or_impossible(total)

    def standardised(self, theta: Array, readings: Sequence[Array] | None = None) -> tuple[Array, Array]:
        """(n,) log-likelihood, and (m, n) residuals whose derivatives J give its curvature nearly, as JᵀJ.

        See `wirebayes.model.likelihoods.standardised`; `readings` as for `hold_log_likelihood`.
        """
        values = []
        residuals = []
        with np.errstate(all="ignore"):
            for sample, y in self.observed(readings):
                own = self.parameters(theta, sample)
                if self.likelihood == "hold":
                    variance = sample.variance(own)
                    found = single_holds.standardised_hold_by_hold(sample.protocol, own, sample.model, y, variance)
                else:
                    measured = sample.measured(own, y)
                    line = streamed(sample.protocol, own, sample.model, measured.first_readings)
                    found = likelihoods.standardised(line, measured)
                value, left = found
                values.append(value)
                residuals.append(left)
            total: Any = sum(values)
        return or_impossible(total), np.concatenate(residuals)

    def without_each_hold(self, theta: Array) -> tuple[Array, list[Array]]:
        """(n,) log-likelihood, and per sample the (H, n) of the readings of all holds, of all samples, but one."""
        with np.errstate(all="ignore"):
            if self.likelihood == "hold":
                own = self.hold_log_likelihood(theta)
                whole = np.sum([holds.sum(axis=0) for holds in own], axis=0)
                return whole, [whole - holds for holds in own]
            pairs = [self._sample_without_each_hold(theta, sample) for sample in self.samples]
            whole = np.sum([own for own, _ in pairs], axis=0)
            return whole, [rest + (whole - own) for own, rest in pairs]

    def _sample_without_each_hold(self, theta: Array, sample: Sample) -> tuple[Array, Array]:
        """(n,) log-likelihood of a sample under the chain, and (H, n) of its readings of all holds but one."""
        line, measured = self.linearised(theta, sample)
        by_side = likelihoods.on_sides(line, measured)
        beside = by_side.beside.sum(axis=0)
        whole = by_side.filtered.log_likelihood.sum(axis=0) + beside
        rest = likelihoods.without_each_hold(by_side.line, by_side.filtered, measured)
        return whole, rest + (beside - by_side.beside)

    def leave_one_hold_out(self, theta: Array) -> list[Array]:
        """Per sample the (H, n) log p(readings of a hold | all other readings, parameters); 0 for an unrecorded hold.

        -inf where the model cannot be computed.
        """
        whole, without = self.without_each_hold(theta)
        out = []
        for sample, rest in zip(self.samples, without, strict=True):
            with np.errstate(all="ignore"):
                value = np.where(sample.protocol.recorded[:, None], whole - rest, 0.0)
            out.append(or_impossible(value))
        return out

    def read_unit(self, sample: Sample) -> float:
        """How many N, or mm where the tension is set, the readings of a sample count as one."""
        return self.units.of(READ_UNIT[sample.protocol.control])

    def log_units(self, other: "Problem") -> list[Array]:
        """Per sample (H,) by how much log densities of holds are larger than in the units of the other problem.

        Parameters
        ----------
        other : Problem
            As `in_units` returns it.
        """
        out = []
        for sample in self.samples:
            ratio = self.read_unit(sample) / other.read_unit(sample)
            out.append(sample.scored_readings(self.likelihood) * np.log(ratio))
        return out

    @property
    def own_units(self) -> Units:
        """Units made of the test's scales; mm, N and s where it has none.

        A stated or fixed B or k2, whose unit depends on U or N, keeps the tension or the time as it is: its prior stays
        simple.
        """
        if self.scales is None:
            return NATURAL
        own = self.scales.units
        known = {column for column, value in self.prior.fixed.items() if value != 0.0}
        named = {parameter_of(column) for column in self.stated | known}
        return Units(own.length_mm, 1.0 if "B" in named else own.tension_N, 1.0 if "k2" in named else own.time_s)

    def in_units(self, units: Units) -> "Problem":
        """The same posterior written in other units."""
        if units == self.units:
            return self
        samples = tuple(sample_in(sample, self.units, units) for sample in self.samples)
        return replace(self, samples=samples, prior=self._prior_in(units), units=units)

    def theta_in(self, units: Units, theta: Array) -> Array:
        """(n, d) parameters of this problem in other units."""
        names = self.names
        out = theta.copy()
        for i, name in enumerate(names):
            out[:, i] *= self._ratio(name, units)
        for name, (exponent, log_ratio) in self._exponents(units).items():
            if name not in names:
                continue
            value = theta[:, names.index(exponent)] if isinstance(exponent, str) else exponent
            out[:, names.index(name)] *= np.exp(-log_ratio * value)
        return out

    def _ratio(self, name: str, units: Units) -> float:
        """What a parameter's value is multiplied by in other units, but for the power of an exponent."""
        return units_ratio(unit_of_column(name, self.samples), self.units, units)

    def _exponents(self, units: Units) -> dict[str, PowerScaled]:
        """For B and k2 of every material the exponent, and the logarithm of the ratio of the units raised to it."""
        # a difference of logarithms, so that what was added in one unit goes to the last bit in the other
        logs = {
            "B": ("U", np.log(self.units.tension_N) - np.log(units.tension_N)),
            "k2": ("N", np.log(self.units.time_s) - np.log(units.time_s)),
        }
        out = {}
        for name in (*self.names, *self.prior.fixed):
            base, bracket, mark = name.partition("[")
            if base in logs:
                exponent, log_ratio = logs[base]
                column = f"{exponent}{bracket}{mark}"
                out[name] = PowerScaled(self.prior.fixed.get(column, column), float(log_ratio))
        return out

    def _prior_in(self, units: Units) -> Prior:
        prior = self.prior
        distributions = {}
        for name, distribution in prior.distributions.items():
            distributions[name] = scaled(distribution, self._ratio(name, units))
        fixed = {name: value * self._ratio(name, units) for name, value in prior.fixed.items()}
        exponents = self._exponents(units)
        for name, (exponent, log_ratio) in exponents.items():
            if name in fixed and isinstance(exponent, float):
                fixed[name] *= float(np.exp(-log_ratio * exponent))
        powers = self._powers_with(exponents)
        return replace(prior, distributions=distributions, fixed=fixed, powers=powers)

    def _powers_with(self, more: Mapping[str, PowerScaled]) -> dict[str, PowerScaled]:
        """The prior's powers with those of a change of units; what has become a factor of one is left out."""
        out = {}
        for name, (exponent, log_base) in more.items():
            if name in self.prior.powers:
                log_base += self.prior.powers[name].log_base
            if log_base != 0.0:
                out[name] = PowerScaled(exponent, log_base)
        return out

    def linearised(self, theta: Array, sample: Sample, readings: Array | None = None) -> tuple[Linearised, Measured]:
        """A sample's staircase, and its readings or those that stand in for them.

        Parameters
        ----------
        theta : (n, d) array
        sample : Sample
        readings : (H, R, n) array, optional
        """
        own = self.parameters(theta, sample)
        measured = sample.measured(own, readings)
        return linearise(sample.protocol, own, sample.model, measured.first_readings), measured


def with_readings(problem: Problem, readings: Sequence[Array]) -> Problem:
    """The same problem with other readings, per sample (H, R, 1)."""
    return replace(
        problem, samples=tuple(replace(s, readings=y) for s, y in zip(problem.samples, readings, strict=True))
    )


def with_protocols(problem: Problem, protocols: Sequence[Protocol], readings: Sequence[Array]) -> Problem:
    """The same parameters on other holds, per sample.

    Parameters
    ----------
    protocols : sequence of Protocol
        One a sample, in the problem's order.
    readings : sequence of (H, R, 1) arrays
        One a sample, padded as its protocol is, N.
    """
    return replace(
        problem,
        samples=tuple(
            replace(s, protocol=p, readings=y) for s, p, y in zip(problem.samples, protocols, readings, strict=True)
        ),
    )
