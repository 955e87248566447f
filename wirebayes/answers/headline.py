"""The answer of every result in a sentence, which its page says first."""

from collections.abc import Sequence

import numpy as np

from wirebayes.answers.creep import creep_as_long_as_held, lengths_in_words
from wirebayes.answers.robot import stays_in_words
from wirebayes.answers.terminal import MOST_OUTLIERS, missing_in
from wirebayes.answers.verdict import (
    better_beside,
    control_judged,
    is_more_than_chance,
    median_between,
    models_ranked,
    verdict_in_words,
    what_it_is,
)
from wirebayes.json_files.batch import BatchJson, Row
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.check import CheckedExperiment
from wirebayes.json_files.comparison import ComparedModels, Difference
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.json_files.plan import PlanJson
from wirebayes.json_files.pose import PoseJson, known_at_the_end, stays
from wirebayes.json_files.read_units import error_grows, read_value, unit_read
from wirebayes.json_files.summary import SummaryJson
from wirebayes.json_files.values import Band, Statistics
from wirebayes.sentences import (
    counted,
    from_to,
    lasting,
    likely,
    listed,
    number,
    p_in_words,
    quantity,
    short,
    some_of,
    span,
    specimens_are,
    spoken,
    undecided,
)

UNUSABLE = "settle the warnings above, then fit again; these numbers are not to be used"
PREDICT = "Next: wirebayes predict for holds not measured yet."
USE = "Next: wirebayes predict for holds not measured yet, or wirebayes pose for a robot on this wire."


def check_in_a_sentence(name: str, test: CheckedExperiment) -> str:
    """The stiffness as a quick look has it, what only the prior says, and how many effects the test would show.

    Parameters
    ----------
    name : str
        Of the experiment.
    test : dict
    """
    effects = test["effects"]
    said = _determined(test)
    shown = sum(effect["shows"] == "yes" for effect in effects.values())
    every = counted(len(effects), "effect")
    said.append(f"it would show {shown} of {every}")
    holds = counted(test["recorded_holds"], "hold")
    readings = counted(test["readings"], "reading")
    answer = ", ".join(said)
    return f"{name}, {holds} with {readings}: {answer}; 90 % intervals in brackets."


def _determined(test: CheckedExperiment) -> list[str]:
    """The stiffness where it is known, and the parameters that are not."""
    parameters = test["parameters"]
    alone = [parameter for parameter, known in parameters.items() if known["determined_by"] == "prior"]
    said = []
    k1 = parameters.get("k1")
    if k1 and "k1" not in alone:
        stiffness = quantity(k1["q50"], k1["q05"], k1["q95"], k1["unit"])
        said.append(f"k1 is about {stiffness}")
    if alone:
        said.append(f"it does not determine {listed(alone)}")
    else:
        said.append("every parameter is determined by the readings")
    return said


def fit_in_a_sentence(summary: SummaryJson) -> str:
    """How much the wire creeps and how stiff it is, with intervals.

    Parameters
    ----------
    summary : dict
    """
    name = summary["experiment"]
    check = summary.get("model_check", {})
    trusted = summary["converged"] and check.get("passed") is not False
    doubt = "" if trusted else "If the model were right: "
    k1 = summary["parameters"].get("k1")
    time, creep = creep_as_long_as_held(summary)
    if creep is None:
        return f"{doubt}{name}: the readings do not say how much this wire creeps."
    stretched = quantity(creep["q50"], creep["q05"], creep["q95"], "mm")
    tension = short(summary["derived"]["tension_N"])
    of_creep, _ = lengths_in_words(summary)
    creeps = f"{doubt}{name} creeps by {stretched} within {time} under {tension} N{of_creep}"
    if k1 is None:  # weights hold by hold say nothing of it
        return f"{creeps}; 90 % interval in brackets."
    stiff = quantity(k1["q50"], k1["q05"], k1["q95"], "N")
    return f"{creeps}, and its stiffness is {stiff} per unit of strain; 90 % intervals in brackets."


def findings_in_a_sentence(name: str, report: ExperimentFindings) -> str:
    """What is missing, how large it is, and what it takes away of the error on holds that were not used.

    Parameters
    ----------
    name : str
        Of the experiment.
    report : dict
        Its part of ``discovery.json``.
    """
    verdict = report["verdict"]
    effects = [spoken(effect) for effect in report["effects"]]
    several = len(effects) > 1
    sizes = {}
    for effect, size in report["amplitudes"].items():
        sizes[spoken(effect)] = quantity(*median_between(size), size["unit"])
    what = _missing(report, effects)
    with_it = "with them" if several else "with it"
    if verdict == "ambiguous":  # then the model has the most likely of several
        of_sizes = [f"{effect} of {size}" for effect, size in sizes.items()]
        with_it = f"with {listed(of_sizes)}"
    elif sizes:
        every_size = listed(list(sizes.values()))
        what += f", of size {every_size}"
    if verdict == "partial":
        what += "; and so is something that no effect in the catalogue explains"
        with_it = "with all of them" if several else "with both"
    what += _gain_in_words(report, with_it)
    p = report["p_global"]
    if p is not None:
        sure = p_in_words(p, report["p_simulations"])
        what += f" ({sure})"
    return f"{name}: {what}."


def _missing(report: ExperimentFindings, effects: Sequence[str]) -> str:
    """What is missing, given the effects by their spoken names."""
    verdict = report["verdict"]
    if verdict == "nothing-missing":
        return f"{verdict_in_words(report)}: the plain model and its noise explain them"
    if verdict == "unknown":
        candidates = likely(report)
        largest = f"; its largest part may be {candidates}" if candidates else ""
        return f"{verdict_in_words(report)}{largest}"
    if verdict == "ambiguous":
        return undecided(report)
    if len(effects) > 1:
        return f"{listed(effects)} are missing"
    known = what_it_is(report["effects"][0], control_judged(report)) if effects else ""
    meaning = f" ({known})" if known else ""
    return f"{listed(effects)} is missing{meaning}"


def _gain_in_words(report: ExperimentFindings, with_it: str) -> str:
    """What the effects take away of the error on holds that were not used; empty where none was kept."""
    held = report["held_out"]
    before = read_value(held["plain"], "rmse")
    after = read_value(held["final"], "rmse")
    if not report["effects"] or before is None or after is None:
        return ""
    but, goes = ("but ", "grows") if error_grows(held) else ("", "falls")
    change = f"{number(before)} to {number(after)} {unit_read(held['plain'])}"
    return f"; {but}{with_it} the error on held-out holds {goes} from {change}"


def comparison_in_words(name: str, table: ComparedModels) -> str:
    """The ranking of the models.

    Parameters
    ----------
    name : str
        Of the experiment.
    table : dict
        Its part of ``comparison.json``.
    """
    scored = models_ranked(table)
    if not scored:
        return f"{name}: no model could be judged."
    best, *others = scored
    model = best["name"]
    base = table["base"]
    text = f"{name}: {spoken(model)} predicts left-out holds best"
    gain = best["difference"]
    against = base
    loss = others[0]["difference"] if others else None
    if model == base and loss is not None:  # all others are compared with it: what it is ahead of is the next
        second, *others = others
        gain = {**loss, "elpd": -loss["elpd"]}
        against = spoken(second["name"])
    if gain is not None and against != model:
        text += f", {_ahead(gain)} against {against}"
        text += "" if is_more_than_chance(gain) else ", which may be chance"
    if others:
        come = "come" if len(others) > 1 else "comes"
        names = [spoken(row["name"]) for row in others]
        behind = some_of(names, 3)
        text += f"; then {come} {behind}"
    for sentence in better_beside(table):
        text += f". {sentence[0].upper()}{sentence[1:]}"
    return f"{text}."


def _ahead(gain: Difference) -> str:
    """How much better a model predicts."""
    elpd = number(gain["elpd"], 2)
    error = number(gain["se"], 2)
    return f"by {elpd} ± {error} elpd (log probability of their readings)"


def _how_many(rows: Sequence[Row]) -> str:
    """Tests, materials and fits that converged, and how stiff the wires are."""
    materials = {row["material"] for row in rows if row["material"]}
    kinds = "one material"
    if len(materials) > 1:
        kinds = f"{len(materials)} materials"
    many = "One test" if len(rows) == 1 else f"{len(rows)} tests"
    converged = sum(bool(row["converged"]) for row in rows)
    stiffnesses = _stiffnesses(rows)
    return f"{many} of {kinds}, {converged} converged{stiffnesses}."


def batch_in_sentences(found: BatchJson) -> list[str]:
    """A sentence a finding: how many were fitted, what is missing in which, which stand apart.

    Parameters
    ----------
    found : dict
    """
    rows = found["experiments"]
    out = [_how_many(rows)]
    failed = [row["name"] for row in rows if row["error"]]
    if failed:
        out.append(f"Not fitted: {some_of(failed)}.")
    out += missing_in(rows)
    unexplained = [row for row in rows if row["check"] == "failed" and row["verdict"] is None]
    if unexplained:
        names = [row["name"] for row in unexplained]
        out.append(f"The model does not describe the readings of {some_of(names)}.")
    for outlier in found["outliers"][:MOST_OUTLIERS]:
        sentence = outlier["sentence"].rstrip(".")
        out.append(f"{sentence}.")
    return out


def _stiffnesses(rows: Sequence[Row]) -> str:
    """The stiffness k1 of the materials with most specimens, and how far specimens differ or how well one is known."""
    each: dict[str, list[Statistics]] = {}
    for row in rows:
        if row["material"] and "k1" in row["parameters"]:
            each.setdefault(row["material"], []).append(row["parameters"]["k1"])
    largest = sorted(each, key=lambda material: -len(each[material]))[:_MOST_MATERIALS]
    said = [_stiffness(material, each[material]) for material in largest]
    return f"; {', '.join(said)}" if said else ""


def _stiffness(material: str, each: Sequence[Statistics]) -> str:
    """k1 of the specimens of one material."""
    if len(each) == 1:
        (k1,) = each
        return f"k1 of {material} {number(k1['q50'])} N ({span(k1['q05'], k1['q95'])}, 90 % interval)"
    medians = [k1["q50"] for k1 in each]
    middle = number(float(np.median(medians)))
    among = span(min(medians), max(medians))
    return f"median k1 of {material} {middle} N ({among}, least to largest specimen)"


_MOST_MATERIALS = 3  # whose stiffness a first sentence has room for


def pose_in_a_sentence(found: PoseJson) -> str:
    """How far the platform moves, with the conditions behind it.

    Parameters
    ----------
    found : dict
    """
    if not found["feasible"]:
        return found["sentence"]
    known = [drift for drift in found["drift"] if known_at_the_end(drift)]
    if not known:
        return f"No draw of the wires holds {found['robot']} to the end."
    if all(map(stays, found["drift"])):
        return f"{found['robot']}: {stays_in_words(found)}."
    drift = known[-1]
    moved = _at_the_end(drift["distance_mm"], "mm")
    tilt = drift["tilt_deg"]
    if tilt["q95"][-1]:
        moved += f" and tilts by {_at_the_end(tilt, '')} degrees"
    time = lasting(drift["times_s"][-1])
    return (
        f"The platform of {found['robot']} moves by {moved} within {time} of standing still, "
        f"if {specimens_are(drift['specimen_spread'])}; 90 % intervals in brackets."
    )


def _at_the_end(band: Band, unit: str) -> str:
    return quantity(band["q50"][-1], band["q05"][-1], band["q95"][-1], unit)


def plan_in_a_sentence(found: PlanJson) -> str:
    """The test to do, and what would be known after it.

    Parameters
    ----------
    found : dict
    """
    best = found["protocols"][0]
    creep = best["creep"]["creep_1h_mm"]
    what = f" ({best['words']})" if best["words"] else ""
    time = f"{short(best['duration_min'])} min"
    tension = f"{number(best['creep']['tension_N'])} N"
    return (
        f"Do {best['name']}{what}: in {time} it would determine the creep after an "
        f"hour at {tension} to ± {number(creep['sd'], 2)} mm (now ± "
        f"{number(creep['guess_sd'], 2)} mm; standard deviations)."
    )


def calibration_in_a_sentence(found: CalibrateJson) -> str:
    """How well the lengths are known.

    Parameters
    ----------
    found : dict
    """
    known = found["with_creep_model"]
    if not known["converged"]:
        return "Not converged: there are no lengths to use."
    sd_mm = [1e3 * sd_m for sd_m in known["length_m"]["sd"]]
    wires = f"{found['robot']}'s {len(sd_mm)} wires"
    holds = counted(found["holds"], "hold")
    errors = from_to(min(sd_mm), max(sd_mm))
    lengths = f"{errors} mm (standard errors), from {found['read']} of {holds}."
    points = 1e3 * np.array(found["exit_points_m"]["sd"], float)
    if not np.any(points > 0):
        return f"The zero-tension lengths of {wires} are known to {lengths}"
    before = number(found["prior"].get("anchor_sd_mm", 0.0))
    after = from_to(points.min(), points.max())
    return (
        f"The exit points of {wires} are known to {after} mm (before: {before} mm), "
        f"their zero-tension lengths to {lengths}"
    )
