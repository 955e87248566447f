"""From screened candidates to names: refit those that stand a chance, add up their evidence, weigh against unknown."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from wirebayes.discovery.linear_scan import Probe, Scan
from wirebayes.discovery.refit import Refit, probabilities, refit, smallest_set
from wirebayes.discovery.screening import Candidate, flexible_log_bayes, log_bayes
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.wire.effect import Effect
from wirebayes.workers import Each

Array = NDArray[Any]
_Form = tuple[str, str, tuple[int, ...], bool]  # name, key of the effect, blocks, one amplitude for all
_Place = tuple[str, tuple[int, ...]]  # key of the effect, blocks that share its amplitude
UNKNOWN_WEIGHT = 1.0  # prior odds of *something unknown* to one named effect
_MARGIN, _SHARE = 5.0, 0.5  # linear screening errs, and errs more for a large effect
_MOST, _MOST_A_NAME = 16, 3


@dataclass(frozen=True)
class NameEvidence:
    """Names and their evidence.

    Attributes
    ----------
    log_bayes : dict
        Of each name against no effect.
    unknown : float
        The same of the flexible reference.
    winners : dict of name to list of Refit
        Of its best form: one refit, or one a block.
    shares : dict
        Probabilities over names and *unknown*.
    """

    log_bayes: dict[str, float]
    unknown: float
    winners: dict[str, list[Refit]]
    shares: dict[str, float]

    @property
    def best(self) -> str:
        return max(self.shares, key=lambda name: self.shares[name])

    @property
    def set(self) -> list[str]:
        return smallest_set(self.shares)

    def amplitudes(self, name: str) -> dict[int, Refit]:
        """Refit of a name by block."""
        return {b: r for r in self.winners[name] for b in r.blocks}


def choose(
    blocks: Sequence[LaplaceFit],
    trials: Sequence[Probe],
    candidates: Sequence[Candidate],
    scans: Sequence[Scan],
    further: Mapping[Candidate, float] = {},
    each: Each = map,
) -> NameEvidence:
    """Evidence of every name, refitted where the scan, or the test from larger effects, gives it a chance.

    Refits are independent of each other, and `each` may be a `map` over processes.
    """
    linear = [tuple(float(v[0]) for v in log_bayes(c, scans)) for c in candidates]
    forms: dict[_Form, int] = {}
    promise: dict[_Form, float] = {}
    for i, c in enumerate(candidates):
        effect = trials[c.probe].effect
        form = (c.name, effect.key, c.blocks, c.shared)
        promise[form] = max(promise.get(form, -np.inf), linear[i][0], further.get(c, -np.inf))
        if form not in forms or linear[i][0] > linear[forms[form]][0]:
            forms[form] = i
    ranked = sorted(forms.items(), key=lambda item: -promise[item[0]])
    top = promise[ranked[0][0]]
    near = [f for f, _ in ranked if promise[f] >= top - _MARGIN - _SHARE * max(top, 0.0)][:_MOST]
    names = {name for name, *_ in near}
    tried: dict[_Form, list[_Place]] = {}
    tasks: dict[_Place, tuple[Effect, float, float]] = {}
    for form, i in ranked:
        # A name that stands a chance is refitted in its other forms too: the scan may have taken the wrong one.
        if form[0] not in names or sum(f[0] == form[0] for f in tried) >= _MOST_A_NAME:
            continue
        c = candidates[i]
        effect = trials[c.probe].effect
        tried[form] = [(effect.key, on) for on in ([c.blocks] if c.shared else [(b,) for b in c.blocks])]
        for place in tried[form]:
            # Each block on its own is a form too, and need not be refitted twice.
            _, guess, per_delta = log_bayes(Candidate(c.probe, c.name, place[1], True), scans)
            tasks.setdefault(place, (effect, float(per_delta[0]), float(guess[0])))
    done = each(partial(refit, blocks), [on for _, on in tasks], *zip(*tasks.values(), strict=True))
    found = dict(zip(tasks, done, strict=True))
    refitted = {form: [found[place] for place in places] for form, places in tried.items()}
    values: dict[str, dict[tuple[str, tuple[int, ...], bool], float]] = {}
    for form, i in forms.items():
        value = sum(r.log_bayes for r in refitted[form]) if form in refitted else linear[i][0]
        values.setdefault(form[0], {})[form[1:]] = value
    evidence = {name: _average(v, len(blocks)) for name, v in values.items()}
    unknown = flexible_evidence(scans)
    winners = {}
    for name in evidence:
        own = {form: r for form, r in refitted.items() if form[0] == name}
        if own:
            winners[name] = max(own.values(), key=lambda r: sum(x.log_bayes for x in r))
    shares = probabilities({n: v for n, v in evidence.items() if n in winners}, unknown, UNKNOWN_WEIGHT)
    return NameEvidence(evidence, unknown, winners, shares)


def flexible_evidence(scans: Sequence[Scan]) -> float:
    """Log Bayes factor of the flexible reference: on all blocks as likely as on one of them."""
    loose = flexible_log_bayes(scans)[:, 0]
    if len(scans) == 1:
        return float(loose[-1])
    return float(logsumexp([loose[-1] + np.log(0.5), *(loose[:-1] - np.log(2.0 * len(scans)))]))


def _average(values: dict[tuple[str, tuple[int, ...], bool], float], blocks: int) -> float:
    """Log of the mean Bayes factor over an effect's forms: its variants equally, on all blocks as often as on one."""
    variants = {key[0] for key in values}
    logs = []
    for (_, on, _), value in values.items():
        weight = 1.0 if blocks == 1 or len(on) == blocks else 0.5 / blocks
        logs.append(value + np.log(weight))
    return float(logsumexp(logs) - np.log(len(variants)))
