"""Detectable amplitudes, similar effects, and what this protocol cannot show."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wirebayes.discovery.linear_scan import expand
from wirebayes.discovery.noise_integral import Expansion, projected
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.refit import LARGEST, occam
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import Candidate, GlobalTest
from wirebayes.discovery.settings import ALPHA
from wirebayes.inference.laplace_fit import LaplaceFit
from wirebayes.numeric.distributions import Normal
from wirebayes.numeric.typing import Array
from wirebayes.wire.effect import Amplitude, Effect, HoldContext
from wirebayes.wire.protocol import Control

Cosines = dict[tuple[str, str], float]  # of the angles between the signatures of two effects, without sign
FARTHEST = 3.0  # times the largest probe, which is three standard deviations of the prior: nobody expects so much
ALIKE = 0.95  # |cos| from which names form a group: an effect of δ = 10 then differs from its twin by δ = 3 only


class Rung(NamedTuple):
    """A probe of an effect, one of several at rising amplitudes.

    Attributes
    ----------
    amplitude : float
        At which the probe's signature was taken.
    trial : int
        The probe's number.
    seen : float or None
        The amplitude that would be seen if the signature stayed as it is.
    """

    amplitude: float
    trial: int
    seen: float | None


class Detectable(NamedTuple):
    """Number of the probe by which an effect is seen, and from which amplitude on; None where it is not."""

    trial: int
    amplitude: float | None


def amplitude_80(null: Scan, probe: Probe, i: int, threshold: float) -> float | None:
    """Amplitude of a probe that passes the global test in 80 % of simulations.

    Parameters
    ----------
    null : Scan
        Of data sets simulated without any effect.
    probe : Probe
    i : int
        The probe's number in the scan.
    threshold : float
        Log Bayes factor, prior included, that the test needs.

    Returns
    -------
    float or None
        Distance from neutral; None where even δ of `LARGEST` would not pass, or the probe does not show at all.
    """
    norm = float(np.median(null.norm[:, i]))
    if norm <= 0:
        return None
    prior = occam(probe.one_sided)
    low = 0.0
    high = LARGEST / norm
    pieces = null.pieces.of(i)

    def seen(amplitude: float) -> bool:
        return bool(np.mean(pieces.log_bayes(amplitude) + prior > threshold) >= 0.8)

    if not seen(high):
        return None
    for _ in range(12):
        middle = 0.5 * (low + high)
        low, high = (low, middle) if seen(middle) else (middle, high)
    return high


def detectable(
    null: Scan, trials: Sequence[Probe], candidates: Sequence[Candidate], level: GlobalTest, block: int = 0
) -> dict[str, Detectable]:
    """For each effect that a block can show, a probe and the amplitude that is detected in 80 % of tests, if any is.

    The parameters bend themselves to some effects as long as these are small. A signature holds about the amplitude at
    which it was taken, so the probes of an effect are followed from the smallest amplitude up.

    Parameters
    ----------
    null : Scan
        Of simulated data sets of the block, refitted.
    trials, candidates
        See `wirebayes.discovery.screening.candidate_probes`.
    level : GlobalTest
        What chance reaches over all blocks.
    block : int
    """
    here = [c for c in candidates if block in c.blocks]
    found = {}
    for name, ladder in _strongest(null, trials, here).items():
        threshold = level.threshold(name, ALPHA)
        rungs = []
        for amplitude, k in sorted(ladder.items()):
            seen = amplitude_80(null, trials[k], k, threshold)
            rungs.append(Rung(amplitude, k, seen))
        smallest = smallest_seen(rungs)
        main = trials[smallest.trial].effect.amplitudes[0]
        found[name] = Detectable(smallest.trial, _possible(main, smallest.amplitude))
    return found


def _possible(main: Amplitude, seen: float | None) -> float | None:
    """A distance from neutral where an amplitude can be so far from it, else None: a share is never more than one."""
    low, high = main.prior.support()
    farthest = max(high - main.neutral, main.neutral - low)
    return seen if seen is not None and seen <= farthest else None


def _strongest(null: Scan, trials: Sequence[Probe], candidates: Sequence[Candidate]) -> dict[str, dict[float, int]]:
    """For each name, the number of the strongest probe at each amplitude."""
    strength = np.median(null.norm, axis=0)
    best: dict[str, dict[float, int]] = {}
    for c in candidates:
        ladder = best.setdefault(c.name, {})
        step = trials[c.probe].step
        known = ladder.get(step)
        if known is None or strength[c.probe] > strength[known]:
            ladder[step] = c.probe
    return best


def smallest_seen(rungs: Sequence[Rung]) -> Detectable:
    """The probe and the amplitude at which an effect begins to be seen, by probes at rising amplitudes.

    It lies below the first probe whose own amplitude would be seen and above the one before; between the two, how
    strongly it shows is taken to follow a power of the amplitude. Beyond the last probe that power goes on, up to
    `FARTHEST`: a delay of the first reading can take no more than what relaxes in a hold.
    """
    below = None
    for rung in rungs:
        if rung.seen is not None and rung.seen <= rung.amplitude:
            return Detectable(rung.trial, _between(below, rung.amplitude, rung.seen))
        below = rung
    return Detectable(rungs[-1].trial, _beyond(rungs))


def _between(below: Rung | None, amplitude: float, seen: float) -> float:
    """The smallest amplitude that is seen, by the first probe whose own amplitude is, and the one below it."""
    if below is None:
        return seen
    if below.seen is None:
        return amplitude
    return _by_power((below.amplitude, below.seen), (amplitude, seen))


def _beyond(rungs: Sequence[Rung]) -> float | None:
    """Where the share of what is needed to be seen passes one beyond the last probe; None where it does not, or far."""
    last, _, seen = rungs[-1]
    if seen is None or len(rungs) == 1:  # a form that is linear has one probe
        return seen
    before, _, seen_before = rungs[-2]
    if seen_before is None:
        return None
    missing = np.log(seen / last)
    gained = np.log(last / before) - np.log(seen / seen_before)
    if missing * np.log(last / before) > gained * np.log(FARTHEST):
        return None
    return _by_power((before, seen_before), (last, seen))


def _by_power(first: tuple[float, float], second: tuple[float, float]) -> float:
    """Where the share of what is needed to be seen passes one, if it follows a power of the amplitude.

    Parameters
    ----------
    first, second : (float, float)
        Of two probes the amplitude, and the amplitude that would be seen; that share is one over the other.
    """
    low, needed_at_low = first
    high, needed_at_high = second
    missing = np.log(needed_at_low / low)
    gained = missing + np.log(high / needed_at_high)
    return float(low * (high / low) ** (missing / gained))


def similarity(expansions: Sequence[Expansion], trials: Sequence[Probe], ratios: Sequence[float]) -> Cosines:
    """Largest |cos| between the projected signatures of any two effects, over their forms, at a noise ratio a block.

    An effect with one amplitude a block may put any size on each, so it is as alike as the best sizes make it.

    Parameters
    ----------
    expansions : sequence of Expansion
        One a block.
    trials : sequence of Probe
    ratios : sequence of float
        Size of the setting errors against the sensor's, ρ, of each block.

    Returns
    -------
    dict of (name, name) to float
        From 0 (orthogonal) to 1 (one signature).
    """
    cosines = _cosines(expansions, trials, ratios)
    names = [t.effect.name for t in trials]
    out: Cosines = {}
    for i, one in enumerate(names):
        for j, other in enumerate(names):
            largest = out.get((one, other), 0.0)
            out[one, other] = max(largest, float(cosines[i, j]))
    return out


def _cosines(expansions: Sequence[Expansion], trials: Sequence[Probe], ratios: Sequence[float]) -> Array:
    """(m, m) |cos| of the projected signatures, zero for one that does not show."""
    parts = [projected(x, r) for x, r in zip(expansions, ratios, strict=True)]
    is_material = np.array([t.effect.scope == "material" for t in trials], bool)
    return cosines(parts, is_material & (len(expansions) > 1))


def cosines(parts: Sequence[Array], has_own: Array) -> Array:
    """(m, m) |cos| of signatures over several blocks, zero for one that does not show.

    Parameters
    ----------
    parts : sequence of (N, m) arrays
        Projected signatures, one array a block.
    has_own : (m,) array of bool
        Signatures that may have any size on each block.
    """
    products = np.array([p.T @ p for p in parts])
    squares = np.array([(p**2).sum(axis=0) for p in parts])
    total = squares.sum(axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        same_size = products.sum(axis=0) ** 2 / (total[:, None] * total[None])
        explained = np.nan_to_num(products**2 / squares[:, None, :])
        own_sizes = explained.sum(axis=0) / total[:, None]
    square = np.nan_to_num(np.where(has_own[None, :], own_sizes, same_size))
    either_way = np.maximum(square, square.T)
    return np.sqrt(np.minimum(either_way, 1.0))


def group_of(members: Sequence[str], alike: Cosines) -> list[str]:
    """The members and every effect whose signature is as good as one of theirs."""
    others = [other for (one, other), cosine in alike.items() if one in members and cosine > ALIKE]
    return list(dict.fromkeys([*members, *others]))


_ANY = Normal(0.0, 0.1)  # the prior of a probe, of which only the signature is used


class _SensorGain(Effect):
    name, place, scope = "gain of the force sensor", "reading", "instrument"
    amplitudes = (Amplitude("a", "-", 0.0, _ANY),)
    sentence = "The force sensor's gain is off."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value * (1.0 + own["a"])


class _ForceOffset(Effect):
    name, place, scope = "constant force offset", "reading", "instrument"
    amplitudes = (Amplitude("a", "N", 0.0, _ANY),)
    sentence = "The force sensor's zero is off."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value + own["a"]


class _DisplacementScale(Effect):
    name, place, scope = "scale of the displacement", "position", "instrument"
    amplitudes = (Amplitude("a", "-", 0.0, _ANY),)
    sentence = "The displacement's scale is off."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value + own["a"] * hold.displacement_mm


class _Compliance(Effect):
    name, place, scope = "compliance of the fixture", "strain", "instrument"
    amplitudes = (Amplitude("c", "mm/N", 0.0, _ANY),)
    sentence = "The bench gives way."

    def apply(self, value: Array, own: dict[str, Array], hold: HoldContext) -> Array:
        return value / (1.0 + own["c"] * hold.theta["k1"] / hold.length_mm)


_ABSORBABLE: tuple[type[Effect], ...] = (_SensorGain, _ForceOffset, _DisplacementScale, _Compliance)


WORD: dict[Control, str] = {"displacement": "steps", "force": "weights"}


def _of_sensor(name: str, control: Control) -> str:
    """What is read under weights are displacements."""
    return name.replace("force", "displacement") if control == "force" else name


def not_identifiable(block: LaplaceFit, kinds: Sequence[type[Effect]], possible: Sequence[str]) -> list[str]:
    """Sentences: what the plain model's own parameters take up on this protocol, and what it cannot show.

    Parameters
    ----------
    block : LaplaceFit
    kinds : sequence of effect class
        The catalogue.
    possible : sequence of str
        Names of effects that this protocol can show.

    Returns
    -------
    list of str
    """
    controls: list[Control] = sorted({e.control for e in block.experiments})
    out = []
    for control in controls:
        of_catalogue = any(kind.name == "fixture_compliance" for kind in kinds)  # which then says it by that name
        known: list[type[Effect]] = [_Compliance] if of_catalogue else []
        if control == "force":
            known.append(_DisplacementScale)  # there it is the gain of the sensor
        of_which = f" ({WORD[control]})" if len(controls) > 1 else ""
        for name, share in _absorbed(block, control, known).items():
            what = f"{_of_sensor(name, control)}{of_which}"
            out.append(f"{what}: {100 * share:.1f} % of it is absorbed by the model's own parameters")
    for kind in kinds:
        if kind.name not in possible:
            out.append(f"{kind.name}: this protocol cannot show it ({kind.shows})")
    return out


def _absorbed(block: LaplaceFit, control: Control, known: Sequence[type[Effect]]) -> dict[str, float]:
    """The share that the parameters take up of effects of the bench, of those of which they take most."""
    trials = []
    for kind in _ABSORBABLE:
        if kind not in known:
            effect = kind().under(control)
            trials.append(Probe(effect, {effect.amplitude_column: 1e-3}, 1e-3, False))
    x = expand(block.target, block.z, trials)
    wholes = _lengths(x.signatures[0])
    rests = _lengths(projected(x, 0.0))
    absorbed = {}
    for trial, whole, rest in zip(trials, wholes, rests, strict=True):
        if rest < 0.1 * whole:
            absorbed[trial.effect.name] = 1 - rest / whole
    return absorbed


def _lengths(signatures: Array) -> Array:
    """(m,) lengths of signatures (N, m)."""
    return np.sqrt((signatures**2).sum(axis=0))
