"""What could have been seen in a test, what cannot be, and what to measure next."""

from collections.abc import Mapping, Sequence

import numpy as np

from wirebayes.discovery import next_measurement, power
from wirebayes.discovery.global_test import Gate
from wirebayes.discovery.material_answer import MaterialAnswer
from wirebayes.discovery.power import Cosines, Detectable
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.settings import Settings
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.json_files.discovery import DetectableAmplitude, Outlook
from wirebayes.numeric.any_distribution import finite_spread
from wirebayes.wire.effect import Effect


def outlook(gate: Gate, i: int, settings: Settings, answer: MaterialAnswer, alike: Cosines) -> Outlook:
    """What could have been seen in block `i`, what cannot be, and what to measure next.

    Parameters
    ----------
    gate : Gate
    i : int
        Number of the block among the materials.
    settings : Settings
    answer : MaterialAnswer
        What is said of the block.
    alike : dict of (name, name) to float
        |cos| of the projected signatures of two names.
    """
    block = gate.blocks[i]
    trials = gate.trials
    found = power.detectable(gate.nulls[i], trials, gate.candidates, gate.test, i)
    seen: dict[str, DetectableAmplitude] = {}
    for name, smallest in found.items():
        seen[name] = _detectable(block, trials[smallest.trial].effect, smallest.amplitude)
    possible = [candidate.name for candidate in gate.candidates if i in candidate.blocks]
    hidden = power.not_identifiable(block, list(settings.kinds.values()), possible)
    rivals = [trials[found[name].trial] for name in _rivals(answer, alike) if name in found]
    proposal = _proposal(block, answer, rivals, found, trials)
    return {"power": seen, "not_identifiable": hidden, "next_measurement": proposal}


def _rivals(answer: MaterialAnswer, alike: Cosines) -> list[str]:
    """The names between which a verdict is undecided, or that the accepted one might be taken for; the best first."""
    if answer.verdict not in ("ambiguous", "named", "partial"):
        return []
    names = list(answer.judgement.undecided or answer.shares)
    return [n for n in names if n == names[0] or n in answer.set or alike.get((names[0], n), 0.0) > power.ALIKE]


def _proposal(
    block: LaplaceFit,
    answer: MaterialAnswer,
    rivals: Sequence[Probe],
    found: Mapping[str, Detectable],
    trials: Sequence[Probe],
) -> str:
    """What to measure next: what tells two rivals apart, shows the only one better, or the effect that hides best."""
    pair = (rivals[0], rivals[1]) if len(rivals) > 1 else None
    if answer.remains:
        final = answer.stages[-1] if answer.stages else block
        of_remainder = next_measurement.next_for_remainder(final)
        if answer.judgement.undecided and pair is not None:
            return f"{next_measurement.next_measurement(block, pair, None)} {of_remainder}"
        return of_remainder
    weakest = None
    if pair is None:
        weakest = rivals[0] if rivals else _best_hidden(found, trials)
    return next_measurement.next_measurement(block, pair, weakest)


def _best_hidden(found: Mapping[str, Detectable], trials: Sequence[Probe]) -> Probe | None:
    """The effect whose detectable amplitude is largest beside what a person expects before the test."""

    def hiddenness(smallest: Detectable) -> float:
        if smallest.amplitude is None:
            return np.inf
        prior = trials[smallest.trial].effect.amplitudes[0].prior
        return smallest.amplitude / finite_spread(prior)

    if not found:
        return None
    most_hidden = max(found.values(), key=hiddenness)
    return trials[most_hidden.trial]


def _detectable(block: LaplaceFit, effect: Effect, amplitude: float | None) -> DetectableAmplitude:
    """The smallest amplitude that is likely to be seen, in its natural unit."""
    seen = None if amplitude is None else block.natural_amplitude(effect, amplitude)
    return {"amplitude_80": seen, "unit": block.unit(effect)}
