"""The answer of every result in a sentence, which its page says first."""

from collections.abc import Sequence

import numpy as np

from wirebayes.answers.creep import creep_as_long_as_held
from wirebayes.answers.terminal import MOST_OUTLIERS, missing_in
from wirebayes.answers.verdict import verdict_in_words, what_it_is
from wirebayes.json_files.batch import BatchJson, Row
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.check import CheckedExperiment
from wirebayes.json_files.comparison import ComparedModels
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.json_files.plan import PlanJson
from wirebayes.json_files.pose import PoseJson, known_at_the_end
from wirebayes.json_files.read_units import error_grows, read_value, unit_read
from wirebayes.json_files.summary import SummaryJson
from wirebayes.json_files.values import Statistics
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

USE = "Next: wirebayes predict for holds not measured yet, or wirebayes pose for a robot on this wire."


def check_in_a_sentence(name: str, test: CheckedExperiment) -> str:
    """The stiffness as a quick look has it, what only the prior says, and how many effects the test would show.

    Parameters
    ----------
    name : str
        Of the experiment.
    test : dict
    """
    alone = [parameter for parameter, p in test["parameters"].items() if p["determined_by"] == "prior"]
    known = "k1" not in alone
    k1 = test["parameters"].get("k1")
    said = [f"k1 is about {quantity(k1['q50'], k1['q05'], k1['q95'], k1['unit'])}"] if k1 and known else []
    said += [f"it does not determine {listed(alone)}"] if alone else ["every parameter is determined by the readings"]
    shown = sum(effect["shows"] == "yes" for effect in test["effects"].values())
    said.append(f"it would show {shown} of {counted(len(test['effects']), 'effect')}")
    many = f"{counted(test['recorded_holds'], 'hold')} with {counted(test['readings'], 'reading')}"
    return f"{name}, {many}: {', '.join(said)}; 90 % intervals in brackets."


def fit_in_a_sentence(summary: SummaryJson) -> str:
    """How much the wire creeps and how stiff it is, with intervals.

    Parameters
    ----------
    summary : dict
    """
    derived, k1 = summary["derived"], summary["parameters"].get("k1")
    trusted = summary["converged"] and summary.get("model_check", {}).get("passed") is not False
    doubt = "" if trusted else "If the model were right: "
    time, creep = creep_as_long_as_held(summary)
    if creep is None or k1 is None:
        return f"{doubt}{summary['experiment']}: the readings do not say how much this wire creeps."
    stretched = quantity(creep["q50"], creep["q05"], creep["q95"], "mm")
    stiff = quantity(k1["q50"], k1["q05"], k1["q95"], "N")
    tension = f"{short(derived['tension_N'])} N"
    return (
        f"{doubt}{summary['experiment']} creeps by {stretched} within {time} under {tension}, and its "
        f"stiffness is {stiff} per unit of strain; 90 % intervals in brackets."
    )


def findings_in_a_sentence(name: str, report: ExperimentFindings) -> str:
    """What is missing, how large it is, and what it takes away of the error on holds that were not used.

    Parameters
    ----------
    name : str
        Of the experiment.
    report : dict
        Its part of ``discovery.json``.
    """
    effects = [spoken(effect) for effect in report["effects"]]
    are = "are" if effects[1:] else "is"
    candidates = likely(report)
    known = what_it_is(report["effects"][0]) if len(effects) == 1 else ""
    meaning = f" ({known})" if known else ""
    what = {
        "nothing-missing": f"{verdict_in_words(report)}: the plain model and its noise explain them",
        "unknown": f"{verdict_in_words(report)}"
        + (f"; its largest part may be {candidates}, and nothing is established" if candidates else ""),
        "ambiguous": undecided(report),
        "named": f"{listed(effects)} {are} missing{meaning}",
        "partial": f"{listed(effects)} {are} missing{meaning}",
    }[report["verdict"]]
    sizes = {e: quantity(a["mean"], a["q05"], a["q95"], a["unit"]) for e, a in report["amplitudes"].items()}
    undecided_yet = report["verdict"] == "ambiguous"  # then the model has the most likely of several
    size = f", of size {listed(list(sizes.values()))}" if sizes and not undecided_yet else ""
    with_it = "with them" if effects[1:] else "with it"
    if undecided_yet:
        with_it = f"with {listed([f'{spoken(effect)} of {has}' for effect, has in sizes.items()])}"
    if report["verdict"] == "partial":
        size += "; and so is something that no effect in the catalogue explains"
        with_it = "with all of them" if effects[1:] else "with both"
    gain = _gain_in_words(report, with_it)
    sure = f" ({p_in_words(report['p_global'], report['p_simulations'])})" if report["p_global"] is not None else ""
    return f"{name}: {what}{size}{gain}{sure}."


def _gain_in_words(report: ExperimentFindings, with_it: str) -> str:
    """What the effects take away of the error on holds that were not used; empty where none was kept."""
    held = report["held_out"]
    before, after = (read_value(held[model], "rmse") for model in ("plain", "final"))
    if not report["effects"] or before is None or after is None:
        return ""
    grows = error_grows(held)
    goes = f"; {'but ' if grows else ''}{with_it} the error on held-out holds {'grows' if grows else 'falls'}"
    return f"{goes} from {number(before)} to {number(after)} {unit_read(held['plain'])}"


def comparison_in_words(name: str, table: ComparedModels) -> str:
    """The ranking of the models.

    Parameters
    ----------
    name : str
        Of the experiment.
    table : dict
        Its part of ``comparison.json``.
    """
    good = [row for row in table["models"] if row["failed"] is None]
    if not good:
        return f"{name}: no model could be judged."
    best, *others = good
    gain = best["difference"]
    against = ""
    if gain is not None and best["name"] != table["base"]:
        from wirebayes.comparison.compare import meaningful  # loaded by now, and by no other command

        by = f"{number(gain['elpd'], 2)} ± {number(gain['se'], 2)} elpd (log probability of their readings)"
        chance = "" if meaningful(gain["elpd"], gain["se"]) else ", which may be chance"
        against = f", by {by} against {table['base']}{chance}"
    come = "come" if others[1:] else "comes"
    then = f"; then {come} {some_of([spoken(row['name']) for row in others], 3)}" if others else ""
    return f"{name}: {spoken(best['name'])} predicts left-out holds best{against}{then}."


def batch_in_sentences(found: BatchJson) -> list[str]:
    """A sentence a finding: how many were fitted, what is missing in which, which stand apart.

    Parameters
    ----------
    found : dict
    """
    rows = found["experiments"]
    materials = {row["material"] for row in rows if row["material"]}
    kinds = f"{len(materials)} materials" if len(materials) > 1 else "one material"
    failed = [row["name"] for row in rows if row["error"]]
    many = _count(len(rows), "test")
    converged = sum(bool(row["converged"]) for row in rows)
    out = [f"{many[:1].upper()}{many[1:]} of {kinds}, {converged} converged{_stiffnesses(rows)}."]
    out += [f"Not fitted: {some_of(failed)}."] if failed else []
    out += missing_in(rows)
    refused = [row["name"] for row in rows if row["check"] == "failed" and row["verdict"] is None]
    out += [f"The model does not describe the readings of {some_of(refused)}."] if refused else []
    out += [outlier["sentence"].rstrip(".") + "." for outlier in found["outliers"][:MOST_OUTLIERS]]
    return out


def _stiffnesses(rows: Sequence[Row]) -> str:
    """Of the materials with most specimens: k1, and how far specimens differ, or how well a single one is known."""
    each: dict[str, list[Statistics]] = {}
    for row in rows:
        if row["material"] and "k1" in row["parameters"]:
            each.setdefault(row["material"], []).append(row["parameters"]["k1"])
    largest = sorted(each, key=lambda material: -len(each[material]))[:_MOST_MATERIALS]
    said = [_stiffness(material, each[material]) for material in largest]
    return f"; {', '.join(said)}" if said else ""


def _stiffness(material: str, each: Sequence[Statistics]) -> str:
    """k1 of the specimens of one material."""
    medians = [k1["q50"] for k1 in each]
    if len(each) == 1:
        return f"k1 of {material} {number(medians[0])} N ({span(each[0]['q05'], each[0]['q95'])}, 90 % interval)"
    middle, among = number(float(np.median(medians))), "least to largest specimen"
    return f"median k1 of {material} {middle} N ({span(min(medians), max(medians))}, {among})"


_MOST_MATERIALS = 3  # whose stiffness a first sentence has room for


def _count(number_of: int, what: str) -> str:
    return f"one {what}" if number_of == 1 else f"{number_of} {what}s"


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
    drift = known[-1]
    far, tilt, time = drift["distance_mm"], drift["tilt_deg"], drift["times_s"][-1]
    moved, turned = (quantity(q["q50"][-1], q["q05"][-1], q["q95"][-1], unit) for q, unit in ((far, "mm"), (tilt, "")))
    tilts = f" and tilts by {turned} degrees" if tilt["q95"][-1] else ""
    return (
        f"The platform of {found['robot']} moves by {moved}{tilts} within {lasting(time)} of standing still, "
        f"if {specimens_are(drift['specimen_spread'])}; 90 % intervals in brackets."
    )


def plan_in_a_sentence(found: PlanJson) -> str:
    """The test to do, and what would be known after it.

    Parameters
    ----------
    found : dict
    """
    best = found["protocols"][0]
    creep = best["creep"]["creep_1h_mm"]
    what = f" ({best['words']})" if best["words"] else ""
    return (
        f"Do {best['name']}{what}: in {short(best['duration_min'])} min it would determine the creep after an "
        f"hour at {number(best['creep']['tension_N'])} N to ± {number(creep['sd'], 2)} mm (now ± "
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
    sd = [1e3 * value for value in known["length_m"]["sd"]]
    lengths = f"{from_to(min(sd), max(sd))} mm (standard errors), from {found['read']} of "
    lengths += f"{counted(found['holds'], 'hold')}."
    points = 1e3 * np.array(found["exit_points_m"]["sd"], float)
    if not np.any(points > 0):
        return f"The zero-tension lengths of {found['robot']}'s {len(sd)} wires are known to {lengths}"
    before = found["prior"].get("anchor_sd_mm", 0.0)
    return (
        f"The exit points of {found['robot']}'s {len(sd)} wires are known to {from_to(points.min(), points.max())} mm "
        f"(before: {number(before)} mm), their zero-tension lengths to {lengths}"
    )
