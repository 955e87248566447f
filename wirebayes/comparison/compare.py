"""Models side by side: each hold left out in turn, and the last holds predicted from the first."""

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

from wirebayes.comparison.candidates import ModelToCompare, effects_of, problem_of
from wirebayes.effects import catalogue
from wirebayes.inference.fit import fit_problem, seed_of
from wirebayes.inference.policy import Policy
from wirebayes.inference.weighted_posterior import Posterior, weighted_posterior
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import write_json
from wirebayes.json_files.comparison import (
    ComparedModel,
    ComparedModels,
    Difference,
    Differences,
    HeldOutHolds,
    JudgementJson,
    LeaveOneHoldOut,
    ModelJson,
    PredictionScores,
)
from wirebayes.json_files.read_units import in_unit
from wirebayes.numeric.typing import Floats
from wirebayes.prediction.held_out import HeldOutPrediction, Scores, held_out, two_thirds
from wirebayes.prediction.leave_one_hold_out import LeftOutHolds, smoothed_leave_one_hold_out, standard_error
from wirebayes.processes.workers import workers
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice, from_json, notices_by_part, to_json
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.effect import Effect

# half the draws of a fit: dozens of models are sampled, and elpd differences count from 4, known to a tenth here
POLICY = Policy(walkers=64, round_draws=2048, ess=2000.0, most_steps=600)
_WEIGHTED = 0.5  # of those draws where they are weighted: all are kept, and an integral is then known to .03
_PerHold = LeaveOneHoldOut | PredictionScores
MEANINGFUL_ELPD, MEANINGFUL_SE = 4.0, 2.0  # below either, the difference may be chance (Sivula et al. 2020)


@dataclass(frozen=True)
class Task:
    """One model to be judged on one experiment.

    Attributes
    ----------
    experiment : Experiment
        All its holds.
    candidate : ModelToCompare
    train_holds : int or None
        Learn from the first so many recorded holds only, for both judgements. None: leave one out among all holds,
        and predict the last third from the rest.
    own_effects : Path or None
    """

    experiment: Experiment
    candidate: ModelToCompare
    train_holds: int | None = None
    own_effects: Path | None = None

    @property
    def file(self) -> Path:
        """Where its result goes, below the run's folder."""
        return Path(self.experiment.name) / "models" / f"{self.candidate.name.replace('@', '-')}.json"


def judge(task: Task, seed: int, policy: Policy = POLICY) -> ModelJson:
    """Fit one model and score it; a failure is a result too.

    Parameters
    ----------
    policy : Policy
        When a fit counts as converged; lower than that of `fit`, as a comparison samples dozens of posteriors.

    Returns
    -------
    dict
        Plain values; ``failed`` holds the reason, or None.
    """
    candidate = task.candidate
    spec = candidate.spec
    scored = "all readings" if spec.likelihood == "chain" else "later readings given each hold's first"
    content: ModelJson = {
        "name": candidate.name,
        "question": candidate.question,
        "sentence": candidate.sentence,
        "elastic_law": spec.law,
        "history": spec.history,
        "likelihood": spec.likelihood,
        "scored": scored,
        "failed": None,
        "warnings": [],
    }
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RuntimeWarning)  # of proposals where the model cannot be computed
            scores = _scores(task, seed, policy)
        unsure = [] if scores["converged"] else [Notice("not-converged", scores["convergence"])]
        return {**content, **scores, "warnings": to_json(unsure)}
    except Exception as error:  # a model that cannot be fitted stays in the table, with its reason
        reason = f"{type(error).__name__}: {error}"
        content["failed"] = reason
        content["warnings"] = to_json([Notice("failed", reason)])
    return content


def _scores(task: Task, seed: int, policy: Policy) -> JudgementJson:
    candidate = task.candidate
    name = task.experiment.name
    known = catalogue(task.own_effects)
    whole = task.experiment if candidate.unrecorded else task.experiment.without_unrecorded()
    recorded = len(whole.recorded_holds)
    first = task.train_holds or two_thirds(recorded)

    def sampled(holds: int) -> Posterior:
        training = whole.train(holds)
        own = seed_of(seed, name, candidate.name, str(holds))
        problem = problem_of(candidate, training, effects_of(candidate, training, known, seed))
        found = weighted_posterior(problem, own, policy.ess * _WEIGHTED)
        return found if found.converged else fit_problem(problem, own, policy=policy)

    full = sampled(task.train_holds or recorded)
    left = smoothed_leave_one_hold_out(full, seed_of(seed, name, candidate.name, "without"))
    early = full if task.train_holds else sampled(first)
    later = None
    if first < recorded:
        rng = np.random.default_rng(seed_of(seed, name, "held out"))
        later = _held_out(held_out(early, whole, rng), early)
    return {
        "effects": [effect.key for effect in _effects(full) if effect.name in known],
        "parameters": len(full.problem.names),
        "converged": full.converged and early.converged and left.converged,
        "convergence": full.why,
        "leave_one_hold_out": _left_out(left),
        "held_out": later,
    }


def _effects(fitted: Posterior) -> tuple[Effect, ...]:
    return tuple(fitted.problem.samples[0].model.effects)


def _left_out(left: LeftOutHolds) -> LeaveOneHoldOut:
    return {
        "holds": left.hold,
        "elpd": left.total,
        "se": left.se,
        "per_hold": left.elpd,
        "pareto_k": left.pareto_k,
        "refitted": left.hold[left.refitted],
    }


def _held_out(result: HeldOutPrediction, trained: Posterior) -> HeldOutHolds:
    return {
        "trained_on": result.trained,
        "holds": np.unique(result.given.hold),
        "free": None if result.free is None else scores_dict(result.free),
        "given_first": scores_dict(result.given),
        "effects": [effect.key for effect in _effects(trained)],
    }


def scores_dict(scores: Scores) -> PredictionScores:
    """Scores as plain values, with what the pictures need."""
    coverage = {f"{100 * level:g}": share for level, share in scores.coverage().items()}
    return {
        "rmse_N": scores.rmse_N,
        "elpd": float(scores.elpd.sum()),
        "per_hold": scores.elpd,
        "elpd_together": scores.elpd_together,
        "coverage": coverage,
        "pit_p": scores.pit_p,
        "readings": {
            "hold": scores.hold,
            "time_s": scores.time_s,
            "observed_N": scores.observed_N,
            "mean_N": scores.mean_N,
            "sd_N": scores.sd_N,
            "quantiles_N": scores.quantiles_N,
            "pit": scores.pit,
        },
        "pit_band": scores.pit_band,
    }


def judge_all(
    tasks: Sequence[Task],
    directory: Path,
    seed: int,
    policy: Policy = POLICY,
    report: Progress = silent,
) -> None:
    """Judge all models whose file is not there yet, on all cores; the results do not depend on how many there are.

    Parameters
    ----------
    tasks : sequence of Task
    directory : Path
        Of the run; each task names its file within it.
    report : callable
        Called with a name, the number of models judged and the number of all that were missing.
    """
    todo = [task for task in tasks if not (directory / task.file).exists()]
    for task in todo:
        (directory / task.file).parent.mkdir(parents=True, exist_ok=True)
    work = partial(_store, directory=directory, seed=seed, policy=policy)
    with workers(len(todo)) as parallel_map:
        for done, _ in enumerate(parallel_map(work, todo), 1):
            report("models", done, len(todo))


def _store(task: Task, directory: Path, seed: int, policy: Policy) -> None:
    unit = READ_UNIT[task.experiment.control]
    write_json(directory / task.file, in_unit(judge(task, seed, policy), unit))


def side_by_side(models: Sequence[ModelJson], base: str, about: Sequence[Notice] = ()) -> ComparedModels:
    """The table of one experiment: differences, weights and what they mean.

    Parameters
    ----------
    models : sequence of dict
        What `judge` returned, read back from JSON.
    base : str
        Name of the model that the others are compared with.
    about : sequence of Notice
        What is suspicious about the readings themselves.

    Returns
    -------
    dict
        ``models``, best first among those scored alike, failures last.
    """
    known = {model["name"]: model for model in models}
    reference = known[base]
    weights = _weights(models, reference)
    rows: list[ComparedModel] = []
    for model in models:
        weight = weights.get(model["name"])
        row: ComparedModel = {**model, "weight": weight, **_differences(model, reference), "meaning": ""}
        if model["failed"] is None:
            row["held_out"] = _without_readings(model["held_out"])
        row["meaning"] = _meaning(row, base)
        rows.append(row)
    rows.sort(key=_order)
    of_models = from_json(notices_by_part(known))
    warnings = to_json([*about, *of_models])
    return {"base": base, "models": rows, "warnings": warnings}


def _weights(models: Sequence[ModelJson], reference: ModelJson) -> dict[str, float]:
    """Weights in the mixture, of the models that are scored on the same readings as the reference."""
    if reference["failed"] is not None:
        return {}
    alike = [model for model in models if model["failed"] is None and model["scored"] == reference["scored"]]
    per_hold = np.array([model["leave_one_hold_out"]["per_hold"] for model in alike], float).T
    names = [model["name"] for model in alike]
    return dict(zip(names, stacking(per_hold), strict=True))


def _order(row: ComparedModel) -> tuple[bool, bool, float]:
    """The best first among those scored alike, failures last."""
    failed = row["failed"] is not None
    elpd = 0.0 if failed else row["leave_one_hold_out"]["elpd"]
    return failed, row["weight"] is None, -elpd


def _without_readings(held: HeldOutHolds | None) -> HeldOutHolds | None:
    """The scores alone."""
    if held is None:
        return None
    short = held.copy()
    short["free"], short["given_first"] = _short(held["free"]), _short(held["given_first"])
    return short


def _short(scores: PredictionScores | None) -> PredictionScores | None:
    if scores is None:
        return None
    short = scores.copy()
    short.pop("readings", None)
    short.pop("pit_band", None)
    return short


def _differences(model: ModelJson, reference: ModelJson) -> Differences:
    out: Differences = {"difference": None, "held_out_difference": None, "given_first_difference": None}
    if model["failed"] is not None or reference["failed"] is not None:
        return out
    if model["scored"] == reference["scored"]:
        out["difference"] = _difference(model["leave_one_hold_out"], reference["leave_one_hold_out"])
    one = model["held_out"]
    other = reference["held_out"]
    if one and other:
        out["held_out_difference"] = _difference(one["free"], other["free"])
        out["given_first_difference"] = _difference(one["given_first"], other["given_first"])
    return out


def _difference(one: _PerHold | None, other: _PerHold | None) -> Difference | None:
    """How much better one model is than the other; None where either was not scored."""
    if not one or not other:
        return None
    gained = np.asarray(one["per_hold"], float) - np.asarray(other["per_hold"], float)
    return {"elpd": float(gained.sum()), "se": standard_error(gained)}


def meaningful(elpd: float, se: float) -> bool:
    """Whether a difference in elpd is more than chance may bring."""
    return abs(elpd) >= max(MEANINGFUL_ELPD, MEANINGFUL_SE * se)


def _meaning(row: ComparedModel, base: str) -> str:
    if row["failed"] is not None:
        return f"could not be judged ({row['failed']})"
    if row["name"] == base:
        return "the reference for the other models"
    gain = row["difference"]
    where = "leaving out each hold in turn"
    if gain is None:
        gain = row["given_first_difference"]
        where = "on held-out holds given their first reading"
    if gain is None:
        return "scored on other readings, so not comparable here"
    if np.isnan(gain["se"]):
        return f"elpd {gain['elpd']:+.1f} against {base}, {where}: one hold alone, which says nothing of its error"
    size = f"elpd {gain['elpd']:+.1f} ± {gain['se']:.1f} against {base}, {where}"
    if not row["converged"]:
        return f"{size}; its sampling did not converge, so this may be wrong"
    if not meaningful(gain["elpd"], gain["se"]):
        return f"{size}: no meaningful difference"
    return f"{size}: predicts {'better' if gain['elpd'] > 0 else 'worse'}"


def stacking(log_density: Floats, iterations: int = 2000) -> Floats:
    """Weights (models,) of the mixture that predicts best, from (holds, models) log densities of holds left out.

    Expectation-maximisation of the concave ``sum over holds of log sum over models of w p``.
    """
    density = np.exp(log_density - log_density.max(axis=1, keepdims=True))
    weights = np.full(density.shape[1], 1.0 / density.shape[1])
    for _ in range(iterations):
        share = density * weights
        weights = (share / share.sum(axis=1, keepdims=True)).mean(axis=0)
    return weights
