"""Draws of a fitted line in the form that the robot takes: of a posterior, of models undecided, of specimens."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError
from wirebayes.inference.between_specimens import between_specimens
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.means import geometric_mean
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.results import read_back
from wirebayes.results.mixture import load_models, members_of
from wirebayes.results.read_back import Stored
from wirebayes.robot.mechanics.draws import CORE, LENGTH_EXPONENT, WireDraws, material
from wirebayes.robot.mechanics.undecided_models import draws_of_each, models_together, that_go_together
from wirebayes.views.posterior import POSTERIOR
from wirebayes.wire.effect import Typical


def read_wires(folder: Path, count: int, experiment: str | None = None, own_effects: Path | None = None) -> WireDraws:
    """Draws of a fitted line, read from a folder and evenly thinned.

    Parameters
    ----------
    folder : Path
        Holds a ``posterior.nc``.
    count : int
        Largest number of draws.
    experiment : str, optional
        May be left out where the posterior has one.
    own_effects : Path, optional
        File of a user's own effects.

    Raises
    ------
    InputError
        If there is no posterior, or its model cannot be used on a robot.
    """
    below = sorted(str(path.parent) for path in folder.glob("*/**/posterior.nc"))
    if below and not (folder / POSTERIOR).is_file():
        raise InputError(f"{folder}: found no posterior.nc in it, expected one of {', '.join(below)}")
    return draws_of_models(load_models(folder, experiment, own_effects), str(folder), count)


def draws_of_models(models: Sequence[tuple[float, Stored]], where: str, count: int) -> WireDraws:
    """Draws of a line, of each model that its readings leave possible as many as it is probable.

    Parameters
    ----------
    models : sequence of (probability, Stored)
        The final model first, as `wirebayes.results.mixture.members_of` lists them.
    where : str
        For the message, if a posterior cannot be used.
    count : int
        Largest number of draws, of all together.

    Raises
    ------
    InputError
        If the fit took every hold by itself.
    """
    every = [usable_draws(stored, where, len(stored.draws["k1"])) for _, stored in models]
    kept = that_go_together(every)
    probabilities = np.array([models[place][0] for place in kept])
    available = [every[place].count for place in kept]
    few = []
    for place, share in zip(kept, draws_of_each(probabilities, available, count), strict=True):
        if share > 0:
            few.append(every[place].part(evenly(every[place].count, share)))
    return models_together(few)


def usable_draws(stored: Stored, where: str, count: int) -> WireDraws:
    """Draws of a posterior that knows the stiffness.

    Parameters
    ----------
    stored : Stored
    where : str
        For the message, if the posterior cannot be used.
    count : int
        Largest number of draws.

    Raises
    ------
    InputError
        If the fit took every hold by itself.
    """
    if stored.likelihood == "hold":
        raise InputError(
            f"{where}: found a fit with --likelihood hold, which does not determine the stiffness k1, expected one "
            "with --likelihood chain, for a robot needs k1"
        )
    return wire_draws(stored, count)


def wire_draws(stored: Stored, count: int) -> WireDraws:
    """Material parameters of a stored posterior with what was tested; bench quantities stay behind."""
    sample = stored.sample
    effects = tuple(sample.model.effects)
    names = list(CORE)
    for effect in material(effects):
        names += effect.columns()
    pick = evenly(len(stored.draws["k1"]), count)
    parameters = {name: stored.draws[name][pick] for name in names}
    if stored.length_exponent is not None:
        parameters[LENGTH_EXPONENT] = stored.length_exponent[pick]
    tensions = sample.tensions_N
    longest_s = float(sample.protocol.duration_s.max())
    return WireDraws(
        parameters,
        sample.protocol.length_mm,
        sample.model.law,
        sample.model.history,
        effects,
        tension_range_N=(float(tensions.min()), float(tensions.max())),
        time_range_s=(0.0, longest_s),
        tension_ref_N=sample.model.tension_ref_N,
        typical=sample.model.typical,
        doubts=stored.doubts,
    )


def draws_of_specimens(
    folders: Sequence[Path], count: int, experiment: str | None, own_effects: Path | None
) -> WireDraws:
    """A line known from several specimens: what they have in common, and how they differ.

    Parameters
    ----------
    folders : sequence of Path
        Each with the posterior of one specimen.
    count, experiment, own_effects
        As for `read_wires`.
    """
    if len(folders) < 2:
        raise InputError(f"--wires: found {len(folders)} specimen, expected two or more")
    tests = [read_back.load_posterior(folder, experiment, own_effects) for folder in folders]
    each = [usable_draws(stored, str(folder), count) for folder, stored in zip(folders, tests, strict=True)]
    _check_plain_and_alike(folders, each)
    first = each[0]
    typical_N = geometric_mean(one.typical.tension_N for one in each)
    typical = Typical(typical_N, geometric_mean(one.typical.hold_s for one in each))
    logarithms = [_at_typical(_log_core_of_length(stored, first.length_mm), typical) for stored in tests]
    log_prior = _at_typical(_log_core(read_back.prior_draws(folders[0], experiment)), typical)
    prior = log_prior.mean(0), np.cov(log_prior.T)
    found = between_specimens(logarithms, prior, count, np.random.default_rng(0))
    means = np.exp(_at_typical(found.mean, typical, back=True))
    return replace(
        first,
        parameters=dict(zip(CORE, means.T, strict=True)),
        effects=(),
        typical=typical,
        tension_range_N=_widest([one.tension_range_N for one in each]),
        time_range_s=_widest([one.time_range_s for one in each]),
        spread=dict(zip(CORE, found.spread.T, strict=True)),
        specimens=len(each),
        doubts=tuple(_doubts_of_specimens(folders, each)),
    )


def _doubts_of_specimens(folders: Sequence[Path], each: Sequence[WireDraws]) -> Iterator[Notice]:
    """What is to be said of the specimens' tests, and that of undecided models only the most probable counts."""
    for folder, one in zip(folders, each, strict=True):
        yield from one.doubts
        most_probable, *others = members_of(folder)
        if others:
            text = f"{folder}: of the models that the test leaves undecided only the most probable is used here"
            yield Notice("left-out", f"{text}, {100 * most_probable[0]:.0f} %")


def _at_typical(logarithms: Floats, typical: Typical, *, back: bool = False) -> Floats:
    """(n, p) logarithms of the parameters with the creep at the typical tension and the hazard after a typical hold.

    These stand in the places of B and k2, or, on the way back, B and k2 in theirs: how much specimens differ in the
    creep at one newton depends on what is called a newton.
    """
    out = logarithms.copy()
    for name, exponent, scale in (("B", "U", typical.tension_N), ("k2", "N", typical.hold_s)):
        moved = np.exp(logarithms[:, CORE.index(exponent)]) * np.log(scale)
        out[:, CORE.index(name)] += -moved if back else moved
    return out


def _log_core_of_length(stored: Stored, length_mm: float) -> Floats:
    """Logarithms (n, p) of the parameters that a specimen of some length would have: creep is a strain."""
    values = _log_core(stored.draws)
    values[:, CORE.index("B")] += np.log(length_mm / stored.sample.protocol.length_mm)
    return values


def _check_plain_and_alike(folders: Sequence[Path], ones: Sequence[WireDraws]) -> None:
    """Refuse fits that cannot be compared: with effects, or with other laws than the first."""
    first = ones[0]
    for folder, one in zip(folders, ones, strict=True):
        if one.material() or LENGTH_EXPONENT in one.parameters:
            raise InputError(f"{folder}: found a fit with effects, expected plain fits where specimens are compared")
        if (one.law, one.history) != (first.law, first.history):
            raise InputError(
                f"{folder}: found a fit with {one.law} and {one.history}, expected {first.law} and {first.history} as "
                f"in {folders[0]}"
            )


def _log_core(draws: Mapping[str, Floats]) -> Floats:
    """Logarithms (n, p) of the material's parameters."""
    return np.log(np.column_stack([draws[name] for name in CORE]))


def _widest(ranges: Sequence[tuple[float, float] | None]) -> tuple[float, float]:
    """The range that covers all; of one that is not known, zero."""
    ends = np.array([known or (0.0, 0.0) for known in ranges])
    return float(ends.min()), float(ends.max())
