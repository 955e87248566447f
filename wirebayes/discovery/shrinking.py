"""Does the gap shrink on unseen holds? Plain model, each accepted effect in turn, smooth discrepancy, final model."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import repeat

import numpy as np
from numpy.random import Generator

from wirebayes.discovery import held_out
from wirebayes.discovery.settings import KEEP_ELPD, LEAST_HOLDS
from wirebayes.effects.unknown import Discrepancy
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.json_files.discovery import HeldOutJson, LeaveOneHoldOutGain, ScoresJson, StepJson
from wirebayes.numeric.typing import Array
from wirebayes.processes.workers import ParallelMap
from wirebayes.wire.effect import Effect

_NOTHING: ScoresJson = {"rmse_N": None, "elpd": None, "coverage_90": None}
_NOT_HELD_OUT: HeldOutJson = {
    "holds": [],
    "plain": _NOTHING,
    "final": {**_NOTHING, "elpd_difference_se": None},
    "gap_closed": None,
    "shrinks": False,
}


@dataclass(frozen=True)
class Shrinking:
    """What is said of one experiment.

    Attributes
    ----------
    held_out : dict
        Scores of plain, flexible and final model on the last third of the holds.
    steps : list of dict
        The same scores of the plain model and of each accepted effect in turn.
    """

    held_out: HeldOutJson
    steps: list[StepJson]


def shrinking(
    plain: LaplaceFit,
    stages: Sequence[LaplaceFit],
    names: Sequence[str],
    remains: bool,
    left_out: held_out.LeftOut,
    rng: Generator,
    parallel_map: ParallelMap,
) -> list[Shrinking]:
    """Score the models of one block on the last third of the holds, and by leaving out one hold at a time.

    A smooth discrepancy stands beside them: an effect that predicts worse than a smooth curve does not shrink the gap.

    Parameters
    ----------
    plain : LaplaceFit
    stages : sequence of LaplaceFit
        The block with the first accepted effect, the first two, and so on; empty where none was accepted.
    names : sequence of str
        The effects, in the same order.
    remains : bool
        Whether the final model has a smooth discrepancy beside the effects.
    left_out : LeftOut
        Scores the fits.
    rng : numpy Generator
    parallel_map : function
        The built-in `map`, or one over processes.

    Returns
    -------
    list of Shrinking
        One for each experiment of the block.
    """
    train = [held_out.last_third(e) for e in plain.experiments]
    models = ["plain", *names]
    if not all(train):
        return [_not_predicted(models) for _ in train]
    bases = _bases(plain, stages, remains)
    smooth = _beside_discrepancy(bases, train, rng, parallel_map)
    trained = _to_be_trained(plain, stages, train, smooth)
    predicted = parallel_map(_predicted, trained, rng.spawn(len(trained)))
    gain = None
    if smooth:
        elpd = left_out.of(_fits_compared(plain, stages[-1:], smooth))
        gain = _gain(elpd, len(stages[-1:]), len(train), remains)
    found = list(predicted)  # handed over before, so that no core idles
    by_step, beside_smooth = found[: len(models)], found[len(models) :]
    return _of_each_experiment(models, by_step, beside_smooth, gain, remains)


def _of_each_experiment(
    models: Sequence[str],
    by_step: Sequence[Sequence[held_out.HeldOut]],
    beside_smooth: Sequence[Sequence[held_out.HeldOut]],
    gain: "_Gain | None",
    remains: bool,
) -> list[Shrinking]:
    """What is said of each experiment of a block, by the predictions of models and of what has a discrepancy."""
    plain = by_step[0]
    alone = [predicted[0] for predicted in beside_smooth]
    flexible = alone[: len(plain)]
    final = alone[-len(plain) :] if remains else by_step[-1]
    out = []
    for i in range(len(plain)):
        own_flexible = flexible[i] if flexible else None
        report = _compared(plain[i], final[i], own_flexible, gain)
        out.append(Shrinking(report, _steps(models, by_step, i)))
    return out


def _bases(plain: LaplaceFit, stages: Sequence[LaplaceFit], remains: bool) -> list[LaplaceFit]:
    """The models beside which a smooth discrepancy stands: none where the plain model is the final one."""
    if remains:
        return [plain, *stages[-1:]]
    return [plain] if stages else []


def _not_predicted(models: Sequence[str]) -> Shrinking:
    """The report on an experiment that has no holds to hold out."""
    return Shrinking(_NOT_HELD_OUT.copy(), [{"model": model, **_NOTHING} for model in models])


def _steps(models: Sequence[str], predicted: Sequence[Sequence[held_out.HeldOut]], i: int) -> list[StepJson]:
    """How each model, from the plain one on, predicts the held-out holds of one experiment."""
    return [{"model": model, **_score(part[i])} for model, part in zip(models, predicted, strict=True)]


@dataclass(frozen=True)
class _Trained:
    """What `wirebayes.discovery.held_out.predicted` needs: experiments, holds to train on, effects, and a fit."""

    experiments: tuple[Experiment, ...]
    train: Sequence[int]
    effects: tuple[Effect, ...]
    block: LaplaceFit


def _predicted(trained: _Trained, rng: Generator) -> list[held_out.HeldOut]:
    return held_out.predicted(trained.experiments, trained.train, trained.effects, trained.block, rng)


@dataclass(frozen=True)
class _Smooth:
    """Each experiment of a block alone with a smooth discrepancy: fits of the whole, and trained to predict."""

    fits: list[LaplaceFit]
    trained: list[_Trained]


def _fits_compared(plain: LaplaceFit, last: Sequence[LaplaceFit], smooth: Sequence[_Smooth]) -> list[LaplaceFit]:
    """The plain model, the last stage, and what stands beside a smooth discrepancy."""
    fits = [plain, *last]
    for beside in smooth:
        fits += beside.fits
    return fits


def _to_be_trained(
    plain: LaplaceFit, stages: Sequence[LaplaceFit], train: Sequence[int], smooth: Sequence[_Smooth]
) -> list[_Trained]:
    """The models whose predictions are compared: by step, then what stands beside a smooth discrepancy."""
    out = [_Trained(plain.experiments, train, fit.effects, fit) for fit in (plain, *stages)]
    for beside in smooth:
        out += beside.trained
    return out


def _beside_discrepancy(
    bases: Sequence[LaplaceFit], train: Sequence[int], rng: Generator, parallel_map: ParallelMap
) -> list[_Smooth]:
    """A smooth discrepancy beside the effects of each base, its size what they leave over in the holds trained on."""
    # everything is handed over before anything is waited for
    added = []
    generators = []
    for base in bases:
        first = [e.train(k) for e, k in zip(base.experiments, train, strict=True)]
        experiments = [*base.experiments, *first]
        added.append(parallel_map(with_discrepancy, repeat(base), experiments, rng.spawn(len(experiments))))
        generators.append(rng.spawn(len(train)))
    fitting = []
    for base, of_base, own in zip(bases, added, generators, strict=True):
        effects = list(of_base)
        of_whole = effects[: len(train)]
        of_first = effects[len(train) :]
        fits = _each_fitted(base, of_whole, own, parallel_map)
        fitting.append((fits, _each_trained(base, train, of_first)))
    return [_Smooth(list(fits), trained) for fits, trained in fitting]


def _each_fitted(
    base: LaplaceFit, effects: Sequence[tuple[Effect, ...]], generators: Sequence[Generator], parallel_map: ParallelMap
) -> Iterable[LaplaceFit]:
    """Each experiment of a block fitted by itself, with effects of its own."""
    singly = [(e,) for e in base.experiments]
    one_scale = partial(fitted, scales=base.scales)
    return parallel_map(one_scale, singly, effects, repeat(base.spec), generators)


def _each_trained(base: LaplaceFit, train: Sequence[int], effects: Sequence[tuple[Effect, ...]]) -> list[_Trained]:
    """Each experiment of a block by itself, with effects of its own."""
    each = zip(base.experiments, train, effects, strict=True)
    return [_Trained((e,), (k,), own, base) for e, k, own in each]


@dataclass(frozen=True)
class _Gain:
    """How much better the final model, and the plain one with a smooth discrepancy, predict left-out holds."""

    final: float
    standard_error: float
    flexible: float

    @property
    def shrinks(self) -> bool:
        """Clearly better than plain, and no worse than the smooth discrepancy."""
        return self.final > max(KEEP_ELPD, 2.0 * self.standard_error) and self.final >= self.flexible

    def to_dict(self) -> LeaveOneHoldOutGain:
        return {
            "elpd_difference": self.final,
            "elpd_difference_se": self.standard_error,
            "flexible_elpd_difference": self.flexible,
        }


def _gain(elpd: Sequence[Array], named: int, n: int, remains: bool) -> _Gain:
    """The gain by densities (H,) of left-out holds: plain, with effects (`named` is 1 or 0), n of each smooth lot."""
    plain, others = elpd[0], elpd[1 + named :]
    smooth = np.concatenate(others[:n])
    final = np.concatenate(elpd[-n:]) if remains else elpd[1]
    difference = final - plain
    spread = _sd_of_sum(difference)
    by_smooth = float((smooth - plain).sum())
    return _Gain(float(difference.sum()), spread, by_smooth)


def _sd_of_sum(values: Array) -> float:
    """Standard error of a sum, by how values (m,) differ from each other."""
    return float(values.std(ddof=1) * np.sqrt(len(values)))


def discrepancy_gain(
    base: LaplaceFit, left_out: held_out.LeftOut, rng: Generator, parallel_map: ParallelMap
) -> float | None:
    """What a smooth discrepancy gains beside a block's effects by leaving out one hold at a time.

    Parameters
    ----------
    base : LaplaceFit
        With the effects that are established.
    left_out : LeftOut
        Scores the fits.
    rng : numpy Generator
    parallel_map : function
        The built-in `map`, or one over processes.

    Returns
    -------
    float or None
        None where a test has too few holds to say.
    """
    if any(len(e.recorded_holds) < LEAST_HOLDS for e in base.experiments):
        return None
    n = len(base.experiments)
    added = list(parallel_map(with_discrepancy, repeat(base), base.experiments, rng.spawn(n)))
    singly = [(e,) for e in base.experiments]
    beside = parallel_map(fitted, singly, added, repeat(base.spec), rng.spawn(n))
    before, *after = (float(v.sum()) for v in left_out.of([base, *beside]))
    return sum(after) - before


def _compared(
    plain: held_out.HeldOut, final: held_out.HeldOut, flexible: held_out.HeldOut | None, gain: _Gain | None
) -> HeldOutJson:
    """What the report says of the held-out holds of one experiment."""
    difference = final.elpd - plain.elpd
    spread = None
    if len(difference) > 1:
        spread = _sd_of_sum(difference)
    return {
        "holds": plain.holds,
        "plain": _score(plain),
        "final": {**_score(final), "elpd_difference_se": spread},
        "flexible": _score(flexible) if flexible else None,
        "floor_N": float(np.sqrt(final.floor)),
        "gap_closed": held_out.gap_closed(plain, final) if gain else None,
        "leave_one_hold_out": gain.to_dict() if gain else None,
        "shrinks": gain is not None and gain.shrinks,
    }


def with_discrepancy(block: LaplaceFit, experiment: Experiment, rng: Generator) -> tuple[Effect, ...]:
    """A block's effects that one of its experiments can show alone, and a discrepancy as large as what they leave.

    Parameters
    ----------
    block : LaplaceFit
    experiment : Experiment
        One of the block's.
    rng : numpy.random.Generator

    Returns
    -------
    tuple of Effect
    """
    own = acting_alone(block.effects, experiment)
    # two experiments of one name differ in how many of its holds they have
    same = block.names == (experiment.name,) and len(block.experiments[0].holds) == len(experiment.holds)
    fit = block
    if not same or own != block.effects:
        fit = fitted([experiment], own, block.spec, rng, scales=block.scales)
    size = residual_rms(fit, experiment.name)
    return (*own, discrepancy(experiment, size))


def acting_alone(effects: Sequence[Effect], experiment: Experiment) -> tuple[Effect, ...]:
    """The effects that act on an experiment and need no other one to show."""
    here = experiment.name, experiment.control
    return tuple(e for e in effects if not e.compares_lengths and e.acts_on(*here))


def discrepancy(experiment: Experiment, size: float) -> Discrepancy:
    """What stands for something unknown in an experiment, where it leaves over `size` of the readings, N or mm."""
    durations = [h.duration_s for h in experiment.recorded_holds]
    hold_s = float(np.median(durations)) or 1.0
    settings = [hold.setting for hold in experiment.holds]
    least = min(settings)
    return Discrepancy(len(settings), size, hold_s, least, max(settings) - least)


def residual_rms(block: LaplaceFit, name: str) -> float:
    """Root mean square of what the best parameters leave over in an experiment's readings, N."""
    problem = block.target.problem
    sample = problem.samples[block.names.index(name)]
    line, _ = problem.linearised(block.theta, sample)
    left = (sample.readings - line.reading)[sample.protocol.mask]
    rms = float(np.sqrt((left**2).mean()))
    return rms * problem.read_unit(sample)


def _score(held: held_out.HeldOut) -> ScoresJson:
    return {"rmse_N": held.rmse_N, "elpd": float(held.elpd.sum()), "coverage_90": held.inside}
