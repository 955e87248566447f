"""From screened candidates to effects: refit the promising ones and sum the evidence of their forms."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import NamedTuple

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery.linear_scan import expand
from wirebayes.discovery.noise_integral import projected
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.refit import LARGEST, Refit, is_share, refit
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import Candidate, best_probes, scanned
from wirebayes.discovery.subsets import over_subsets
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap
from wirebayes.wire.effect import Effect

_Place = tuple[str, tuple[int, ...]]  # key of the effect, blocks that share its amplitude
_MARGIN, _SHARE = 5.0, 0.5  # linear screening errs, and errs more for a large effect
_WAVE = 4  # names refitted at once, whatever the number of cores
_HOPELESS = -2.0  # nats: a block whose scan speaks against an effect is not refitted with it


class _Task(NamedTuple):
    """What `refit` is given after the blocks, in its order."""

    effect: Effect
    per_delta: float
    guess: float
    reach: float
    shapes: list[Mapping[str, float]]


@dataclass(frozen=True)
class _Form:
    """One variant of an effect: its places, a linear log Bayes factor each, and the candidate that has it."""

    effect: Effect
    places: tuple[_Place, ...]
    linear: tuple[float, ...]
    candidates: tuple[Candidate, ...]


@dataclass(frozen=True)
class NameEvidence:
    """Names and their evidence.

    Attributes
    ----------
    log_bayes : dict
        Of each name against no effect, summed over its forms.
    winners : dict of name to list of Refit
        Of its best form: one refit, or one for each block that has an amplitude of its own. Only names that were
        refitted.
    presence : dict of name to (b,) array
        Probability that the effect is present in each block, given that it is missing at all.
    reach : mapping of (effect key, blocks) to float
        Where priors of amplitudes end, in every set the same.
    tried : mapping of name to float
        Log Bayes factor of each name where it was refitted last: here, or beside fewer effects.
    """

    log_bayes: dict[str, float]
    winners: dict[str, list[Refit]]
    presence: dict[str, Array]
    reach: Mapping[_Place, float] = field(default_factory=dict)
    tried: Mapping[str, float] = field(default_factory=dict)

    @property
    def largest(self) -> float:
        """The largest log Bayes factor of a name that was refitted."""
        return max((self.log_bayes[name] for name in self.winners), default=-np.inf)

    def amplitudes(self, name: str) -> dict[int, Refit]:
        """Refit of a name by block."""
        return {b: r for r in self.winners[name] for b in r.blocks}


def weigh_names(
    blocks: Sequence[LaplaceFit],
    trials: Sequence[Probe],
    candidates: Sequence[Candidate],
    scans: Sequence[Scan],
    parallel_map: ParallelMap = map,
    reach: Mapping[_Place, float] = {},
    before: Mapping[str, float] = {},
    most: int | None = None,
    forms_a_name: int = 3,
) -> NameEvidence:
    """Evidence of every name, refitted where the scan, or what it was beside fewer effects, gives it a chance.

    The scan sees small amplitudes: it never takes a name off the list that has not been refitted.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
    trials, candidates
        See `wirebayes.discovery.screening.candidate_probes`.
    scans : sequence of Scan
        Of the readings, a block each.
    parallel_map : function, optional
        The built-in `map`, or one over processes: refits are independent of each other.
    reach : mapping of (effect key, blocks) to float
        Where the prior of its amplitude ends (see `reaches`).
    before : mapping of name to float
        Log Bayes factors of the names as refitted beside fewer effects, if they were.
    most, forms_a_name : int
        Names that are refitted at the most (all, if None), those not counted that came out hopeless, and forms of one
        name.
    """
    forms = _forms(trials, candidates, scans)
    by_name = _by_name(forms)
    promise = {}
    for name, own in by_name.items():
        reached_before = before.get(name, np.inf)
        promise[name] = max(*own[0].linear, reached_before)
    waiting = sorted(by_name, key=lambda name: -promise[name])  # of names never refitted the scan's first
    room = len(waiting) if most is None else most
    found: dict[_Place, Refit] = {}
    refitted: dict[str, float] = {}
    while wave := _next_wave(waiting, promise, list(refitted.values()), room):
        waiting = waiting[len(wave) :]
        promising = [form for name in wave for form in by_name[name][:forms_a_name]]
        tasks = _tasks(promising, trials, scans, reach)
        found |= _refits(blocks, tasks, parallel_map)
        every_form = [form for name in wave for form in by_name[name]]
        summed = _summed(every_form, found, len(blocks))
        refitted |= {name: summed.log_bayes[name] for name in wave}
    result = _summed(forms, found, len(blocks))
    return replace(result, reach=reach, tried={**before, **refitted})


def _refits(
    blocks: Sequence[LaplaceFit], tasks: Mapping[_Place, _Task], parallel_map: ParallelMap
) -> dict[_Place, Refit]:
    """Each task done: an effect refitted on the blocks of its place."""
    on_blocks = [on for _, on in tasks]
    arguments = zip(*tasks.values(), strict=True)
    done = parallel_map(partial(refit, blocks), on_blocks, *arguments)
    return dict(zip(tasks, done, strict=True))


def _by_name(forms: Sequence[_Form]) -> dict[str, list[_Form]]:
    """The forms of each name, those first that the scan likes best."""
    out: dict[str, list[_Form]] = {}
    for form in sorted(forms, key=lambda form: -max(form.linear)):
        out.setdefault(form.effect.name, []).append(form)
    return out


def _next_wave(
    waiting: Sequence[str], promise: Mapping[str, float], refitted: Sequence[float], room: int
) -> Sequence[str]:
    """Names to be refitted next: those that promise enough beside the best, as long as not too many have stood.

    Refitted values alone set the cut: one that the scan has wrong would take every other name off the list.
    """
    top = max(refitted, default=-np.inf)
    least = top - _MARGIN - _SHARE * max(top, 0.0)
    stood = sum(value >= least for value in refitted)
    return [name for name in waiting[:_WAVE] if promise[name] >= least][: max(room - stood, 0)]


def _tasks(
    forms: Sequence[_Form], trials: Sequence[Probe], scans: Sequence[Scan], reach: Mapping[_Place, float]
) -> dict[_Place, _Task]:
    """What is refitted of some forms, by place."""
    tasks: dict[_Place, _Task] = {}
    for form in forms:
        best = max(form.linear)
        for place, value, candidate in zip(form.places, form.linear, form.candidates, strict=True):
            if not _has_a_chance(value, best):
                continue
            linear = scanned(candidate, scans)
            chosen = best_probes(candidate, scans)
            tasks[place] = _Task(
                form.effect,
                per_delta=float(linear.per_delta[0]),
                guess=float(linear.amplitude[0]),
                reach=reach.get(place, np.inf),
                shapes=[trials[int(number[0])].own for number in chosen],
            )
    return tasks


def _has_a_chance(value: float, best: float) -> bool:
    """Whether a form is refitted at a place, by its linear log Bayes factor there and at the best of its places."""
    scan_may_be_blind = best <= _HOPELESS
    return value == best or value > _HOPELESS or scan_may_be_blind


def _forms(trials: Sequence[Probe], candidates: Sequence[Candidate], scans: Sequence[Scan]) -> list[_Form]:
    """The variants of every effect, each place with the probe that the linear scan likes best there."""
    best = _best_at_each_place(trials, candidates, scans)
    effects: dict[str, Effect] = {}
    for c in candidates:
        effect = trials[c.probe].effect
        effects[effect.key] = effect
    out = []
    for key, effect in effects.items():
        own = {place: found for place, found in best.items() if place[0] == key}
        values, which = zip(*own.values(), strict=True)
        out.append(_Form(effect, tuple(own), values, which))
    return out


def _best_at_each_place(
    trials: Sequence[Probe], candidates: Sequence[Candidate], scans: Sequence[Scan]
) -> dict[_Place, tuple[float, Candidate]]:
    """The candidate that the scan likes best, and how much."""
    best: dict[_Place, tuple[float, Candidate]] = {}
    for c in candidates:
        if not c.shared:
            continue
        place = trials[c.probe].effect.key, c.blocks
        value = float(scanned(c, scans).log_bayes[0])
        best.setdefault(place, (-np.inf, c))
        if value > best[place][0]:
            best[place] = value, c
    return best


def reaches(
    blocks: Sequence[LaplaceFit], trials: Sequence[Probe], candidates: Sequence[Candidate]
) -> dict[_Place, float]:
    """Distance from neutral at which each form has δ = `LARGEST` in the noise of fits without effects.

    A share reaches to its own end: where the parameters of a fit without it differ most from those of a fit with nearly
    all of it, δ says nothing of how it looks there.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
        Plain.
    trials, candidates
        See `wirebayes.discovery.screening.candidate_probes`.
    """
    squares = [_squared_lengths(block, trials) for block in blocks]
    out: dict[_Place, float] = {}
    for c in candidates:
        square = sum(squares[b][c.probe] for b in c.blocks)
        per_unit = float(np.sqrt(square))
        effect = trials[c.probe].effect
        own = LARGEST / per_unit if per_unit > 0.0 and not is_share(effect) else np.inf
        place = effect.key, c.blocks
        # of the ladder of a nonlinear form, and of its shapes, the one that reaches farthest
        out[place] = max(out.get(place, 0.0), own)
    return out


def _squared_lengths(block: LaplaceFit, trials: Sequence[Probe]) -> Array:
    """(m,) of the probes' signatures, free of what the parameters absorb, in the noise of the fit."""
    x = expand(block.target, block.z, trials)
    signatures = projected(x, float(x.ratio[0]))
    return (signatures**2).sum(axis=0)


@dataclass(frozen=True)
class _Summed:
    """A form's log Bayes factor, the probability (b,) that it acts in each block, and its refits if all are known."""

    log_bayes: float
    presence: Array
    refits: list[Refit]


def _summed(forms: Sequence[_Form], found: Mapping[_Place, Refit], blocks: int) -> NameEvidence:
    """Add up the forms of every name: its variants equally, its blocks by `over_subsets`."""
    most = _best_of_each_name(found.values())
    variants: dict[str, list[_Summed]] = {}
    for form in forms:
        name = form.effect.name
        ceiling = most.get(name, np.inf)
        summed = _over_blocks(form, found, ceiling, blocks)
        of_name = variants.setdefault(name, [])
        of_name.append(summed)
    log_bayes = {}
    presence = {}
    winners = {}
    for name, each in variants.items():
        log_bayes[name], presence[name] = _over_variants(each)
        refitted = [variant for variant in each if variant.refits]
        if refitted:
            best = max(refitted, key=lambda variant: variant.log_bayes)
            winners[name] = best.refits
    return NameEvidence(log_bayes, winners, presence)


def _best_of_each_name(refits: Iterable[Refit]) -> dict[str, float]:
    """The largest log Bayes factor with which each name was refitted."""
    most: dict[str, float] = {}
    for r in refits:
        known = most.get(r.effect.name, -np.inf)
        most[r.effect.name] = max(known, r.log_bayes)
    return most


def _over_blocks(form: _Form, found: Mapping[_Place, Refit], most: float, blocks: int) -> _Summed:
    """One form at all its places; what was not refitted counts for no more than `most`, the best of its name."""
    refits = [found.get(place) for place in form.places]
    values = []
    for refitted, linear in zip(refits, form.linear, strict=True):
        value = min(linear, most) if refitted is None else refitted.log_bayes
        values.append(value)
    total, shares, chosen = over_subsets(np.array(values))
    presence = np.zeros(blocks)
    for share, (_, on) in zip(shares, form.places, strict=True):
        presence[list(on)] = share
    winners = [refits[i] for i in chosen]
    known = [refitted for refitted in winners if refitted is not None]
    all_are_known = len(known) == len(winners)
    return _Summed(total, presence, known if all_are_known else [])


def _over_variants(each: Sequence[_Summed]) -> tuple[float, Array]:
    """A name's log Bayes factor, and the probability (b,) that it acts in each block."""
    totals = np.array([variant.log_bayes for variant in each])
    # no form is possible where no climb of any ended
    shares = np.exp(totals - logsumexp(totals)) if np.isfinite(totals).any() else np.zeros(len(totals))
    presence = np.sum([s * variant.presence for s, variant in zip(shares, each, strict=True)], axis=0)
    return float(logsumexp(totals) - np.log(len(totals))), np.minimum(presence, 1.0)
