"""From screened candidates to effects: refit the promising ones and sum the evidence of their forms."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy.special import logsumexp

from wirebayes.discovery.linear_scan import Probe, Scan
from wirebayes.discovery.refit import Refit, refit
from wirebayes.discovery.screening import Candidate, log_bayes
from wirebayes.discovery.subsets import over_subsets
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.typing import Array
from wirebayes.wire.effect import Effect
from wirebayes.workers import ParallelMap

_Place = tuple[str, tuple[int, ...]]  # key of the effect, blocks that share its amplitude
Correction = Callable[[Refit], float]
_MARGIN, _SHARE = 5.0, 0.5  # linear screening errs, and errs more for a large effect
_HOPELESS = -2.0  # nats: a block whose scan speaks against an effect is not refitted with it


@dataclass(frozen=True)
class _Form:
    """One variant of an effect: its places, a linear log Bayes factor each, and the probe that has it."""

    effect: Effect
    places: tuple[_Place, ...]
    linear: tuple[float, ...]
    probes: tuple[int, ...]
    promise: float


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
    """

    log_bayes: dict[str, float]
    winners: dict[str, list[Refit]]
    presence: dict[str, Array]

    def amplitudes(self, name: str) -> dict[int, Refit]:
        """Refit of a name by block."""
        return {b: r for r in self.winners[name] for b in r.blocks}


def weigh_names(
    blocks: Sequence[LaplaceFit],
    trials: Sequence[Probe],
    candidates: Sequence[Candidate],
    scans: Sequence[Scan],
    further: Mapping[Candidate, float] = {},
    parallel_map: ParallelMap = map,
    correction: Correction = lambda found: 0.0,
    most: int = 16,
    forms_a_name: int = 3,
) -> NameEvidence:
    """Evidence of every name, refitted where the scan, or the test from larger effects, gives it a chance.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
    trials, candidates
        See `wirebayes.discovery.screening.candidate_probes`.
    scans : sequence of Scan
        Of the readings, a block each.
    further : mapping of Candidate to float
        Log Bayes factors of the effects that were tried from larger amplitudes.
    parallel_map : function, optional
        The built-in `map`, or one over processes: refits are independent of each other.
    correction : function of Refit
        Added to the log Bayes factor of every refit (see `wirebayes.discovery.stepwise`).
    most, forms_a_name : int
        Forms that are refitted at the most, and of one name.
    """
    forms = _forms(trials, candidates, scans, further)
    ranked = sorted(forms, key=lambda f: -f.promise)
    top = ranked[0].promise
    names = {f.effect.name for f in ranked[:most] if f.promise >= top - _MARGIN - _SHARE * max(top, 0.0)}
    tasks: dict[_Place, tuple[Effect, float, float]] = {}
    tried: list[str] = []
    for form in ranked:
        name = form.effect.name
        # A name that stands a chance is refitted in its other forms too: the scan may have taken the wrong one.
        if name not in names or tried.count(name) >= forms_a_name:
            continue
        tried.append(name)
        best = max(form.linear)
        for place, value, probe in zip(form.places, form.linear, form.probes, strict=True):
            if value in (best,) or value > _HOPELESS or form.promise > sum(form.linear) + 1e-9:
                _, guess, per_delta = log_bayes(Candidate(probe, name, place[1], True), scans)
                tasks[place] = form.effect, float(per_delta[0]), float(guess[0])
    done = parallel_map(partial(refit, blocks), [on for _, on in tasks], *zip(*tasks.values(), strict=True))
    found = dict(zip(tasks, done, strict=True))
    return _summed(forms, found, len(blocks), correction)


def _forms(
    trials: Sequence[Probe], candidates: Sequence[Candidate], scans: Sequence[Scan], further: Mapping[Candidate, float]
) -> list[_Form]:
    """The variants of every effect, each place with the probe that the linear scan likes best there."""
    best: dict[_Place, tuple[float, int]] = {}
    effects: dict[str, Effect] = {}
    promise: dict[str, float] = {}
    for c in candidates:
        effect = trials[c.probe].effect
        effects[effect.key] = effect
        value = float(log_bayes(c, scans)[0][0])
        promise[effect.key] = max(promise.get(effect.key, -np.inf), value, further.get(c, -np.inf))
        if c.shared:
            place = effect.key, c.blocks
            best[place] = max(best.get(place, (-np.inf, 0)), (value, c.probe), key=lambda item: item[0])
    out = []
    for key, effect in effects.items():
        places = [place for place in best if place[0] == key]
        values, which = zip(*(best[place] for place in places), strict=True)
        out.append(_Form(effect, tuple(places), values, which, promise[key]))
    return out


def _corrected(found: Refit, correction: Correction) -> float:
    """The log Bayes factor of a refit; where no climb of it ended there are no parameters to correct it at."""
    return found.log_bayes + correction(found) if np.isfinite(found.log_bayes) else -np.inf


def _summed(forms: Sequence[_Form], found: Mapping[_Place, Refit], blocks: int, correction: Correction) -> NameEvidence:
    """Add up the forms of every name: its variants equally, its blocks by `over_subsets`."""
    parts: dict[str, list[tuple[float, Array, list[Refit]]]] = {}
    for form in forms:
        refits = [found.get(place) for place in form.places]
        pairs = zip(refits, form.linear, strict=True)
        values = np.array([linear if r is None else _corrected(r, correction) for r, linear in pairs])
        total, each, chosen = over_subsets(values)
        presence = np.zeros(blocks)
        for share, (_, on) in zip(each, form.places, strict=True):
            presence[list(on)] = share
        winners = [refits[i] for i in chosen]
        kept = [r for r in winners if r is not None] if all(r is not None for r in winners) else []
        parts.setdefault(form.effect.name, []).append((total, presence, kept))
    log_bayes, winners_, presence_ = {}, {}, {}
    for name, options in parts.items():
        totals = np.array([total for total, _, _ in options])
        log_bayes[name] = float(logsumexp(totals) - np.log(len(totals)))
        # no form is possible where no climb of any ended
        share = np.exp(totals - logsumexp(totals)) if np.isfinite(totals).any() else np.zeros(len(totals))
        presence = np.sum([s * presence for s, (_, presence, _) in zip(share, options, strict=True)], axis=0)
        presence_[name] = np.minimum(presence, 1.0)
        refitted = [option for option in options if option[2]]
        if refitted:
            winners_[name] = max(refitted, key=lambda option: option[0])[2]
    return NameEvidence(log_bayes, winners_, presence_)
