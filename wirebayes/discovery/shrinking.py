"""Does the gap shrink on unseen holds? Plain model, each accepted effect in turn, smooth discrepancy, final model."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import Any

import numpy as np

from wirebayes.discovery import gap
from wirebayes.discovery.settings import KEEP_ELPD
from wirebayes.effects.unknown import Discrepancy
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.io.experiment import Experiment
from wirebayes.wire.effect import Effect
from wirebayes.workers import ParallelMap

_NOTHING: dict[str, Any] = {"rmse_N": None, "elpd": None, "coverage_90": None}


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

    held_out: dict[str, Any]
    steps: list[dict[str, Any]]


def shrinking(
    plain: LaplaceFit,
    stages: Sequence[LaplaceFit],
    names: Sequence[str],
    remains: bool,
    rng: np.random.Generator,
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
    rng : numpy Generator
    parallel_map : function
        The built-in `map`, or one over processes.

    Returns
    -------
    list of Shrinking
        One for each experiment of the block.
    """
    members, train = plain.experiments, [gap.last_third(e) for e in plain.experiments]
    models = ["plain", *names]
    if not all(train):
        no_score = _NOTHING | {"elpd_difference_se": None}
        nothing: dict[str, Any] = {
            "holds": [],
            "plain": _NOTHING,
            "final": no_score,
            "gap_closed": None,
            "shrinks": False,
        }
        return [Shrinking(nothing, [{"model": m} | _NOTHING for m in models]) for _ in members]
    # whole blocks first, then each experiment alone with a discrepancy beside the plain model, and beside the effects
    asked: list[tuple[Any, ...]] = [(members, train, b.effects, b) for b in (plain, *stages)]
    whole = [plain, *stages[-1:]]
    beside = [plain] * (remains or bool(stages)) + [*stages[-1:]] * remains
    for base in beside:
        first = [e.train(k) for e, k in zip(members, train, strict=True)]
        blocks = repeat(base)
        added = list(parallel_map(with_discrepancy, blocks, [*members, *first], rng.spawn(2 * len(members))))
        n = len(members)
        alone = [(e,) for e in members]
        laws = repeat(base.law), repeat(base.history)
        whole += parallel_map(fitted, alone, added[:n], *laws, rng.spawn(n))
        asked += zip(alone, [(k,) for k in train], added[n:], repeat(base), strict=False)
    predicted: list[list[gap.HeldOut]] = list(
        parallel_map(gap.held_out, *zip(*asked, strict=True), rng.spawn(len(asked)))
    )
    left_out = list(parallel_map(gap.leave_one_hold_out, whole, rng.spawn(len(whole)))) if len(whole) > 1 else []
    by_step, alone_ = predicted[: 1 + len(stages)], [part[0] for part in predicted[1 + len(stages) :]]
    n = len(members)
    flexible = alone_[:n]
    final = alone_[-n:] if remains else by_step[-1]
    summary: dict[str, float] | None = None
    shrinks = False
    if left_out:
        bare, loose = left_out[0], np.concatenate(left_out[1 + bool(stages) : 1 + bool(stages) + n])
        last = np.concatenate(left_out[-n:]) if remains else left_out[1]
        difference = last - bare
        gain, se = float(difference.sum()), float(difference.std(ddof=1) * np.sqrt(len(difference)))
        smooth = float((loose - bare).sum())
        summary = {"elpd_difference": gain, "elpd_difference_se": se, "flexible_elpd_difference": smooth}
        shrinks = gain > max(KEEP_ELPD, 2.0 * se) and gain >= smooth
    out = []
    for i, (a, b) in enumerate(zip(by_step[0], final, strict=True)):
        d = b.elpd - a.elpd
        spread = float(d.std(ddof=1) * np.sqrt(len(d))) if len(d) > 1 else None
        held = {
            "holds": a.holds,
            "plain": _score(a),
            "final": _score(b) | {"elpd_difference_se": spread},
            "flexible": _score(flexible[i]) if flexible else None,
            "floor_N": float(np.sqrt(b.floor)),
            "gap_closed": gap.gap_closed(a, b) if left_out else None,
            "leave_one_hold_out": summary,
            "shrinks": shrinks,
        }
        steps = [{"model": m} | _score(part[i]) for m, part in zip(models, by_step, strict=True)]
        out.append(Shrinking(held, steps))
    return out


def with_discrepancy(block: LaplaceFit, experiment: Experiment, rng: np.random.Generator) -> tuple[Effect, ...]:
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
    own = alone(block.effects, experiment)
    fit = fitted([experiment], own, block.law, block.history, rng)
    return (*own, discrepancy(experiment, left_over(fit, experiment.name)))


def alone(effects: Sequence[Effect], experiment: Experiment) -> tuple[Effect, ...]:
    """The effects that act on an experiment and need no other one to show."""
    return tuple(e for e in effects if not e.compares_lengths and getattr(e, "test", "") in ("", experiment.name))


def discrepancy(experiment: Experiment, size_N: float) -> Discrepancy:
    """What stands for something unknown in an experiment, where it leaves over `size_N`."""
    durations = [h.duration_s for h in experiment.recorded_holds]
    return Discrepancy(len(experiment.holds), size_N, float(np.median(durations)) or 1.0)


def left_over(block: LaplaceFit, name: str) -> float:
    """Root mean square of what the best parameters leave over in an experiment's readings, N."""
    sample = block.target.problem.samples[block.names.index(name)]
    line, _, _ = block.target.problem.linearised(block.target.coordinates.to_natural(block.modes.z[:1]), sample)
    return float(np.sqrt((((sample.readings - line.tension)[sample.protocol.mask]) ** 2).mean()))


def _score(held: gap.HeldOut) -> dict[str, Any]:
    return {"rmse_N": held.rmse_N, "elpd": float(held.elpd.sum()), "coverage_90": held.inside}
