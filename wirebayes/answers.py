"""The answer of every result in a few lines, with units: on a terminal, and in Python with `print`."""

from collections import Counter
from collections.abc import Sequence
from textwrap import wrap
from typing import cast

import numpy as np

from wirebayes.json_files.batch import BatchJson, Row
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.check import CheckedExperiment, EffectSize, ParameterRange
from wirebayes.json_files.comparison import ComparedModels
from wirebayes.json_files.discovery import ExperimentFindings
from wirebayes.json_files.imported import ImportedExperiment
from wirebayes.json_files.plan import JudgedProtocol, PlanJson
from wirebayes.json_files.pose import Drift, PoseJson
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.json_files.read_units import read, unit_read
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.json_files.values import UNITS, Quantiles, Statistics
from wirebayes.sentences import (
    counted,
    families_said,
    likely,
    listed,
    number,
    p_in_words,
    quantity,
    said_beside,
    short,
    span,
    undecided,
    unit_text,
)

_NAMED = {
    "nothing-missing": "nothing is missing",
    "unknown": "something is missing that no effect in the catalogue explains",
}

# with fewer than three holds, where no effect of the catalogue can be established or ruled out
_FEW_HOLDS = {"nothing-missing": "nothing stands out", "unknown": "something is missing; so few holds do not say what"}


def _verdict_in_words(report: ExperimentFindings) -> str | None:
    """Of a verdict without names; None for the others."""
    few = any(warning["kind"] == "few-holds" for warning in report.get("warnings", []))
    return (_FEW_HOLDS if few else _NAMED).get(report["verdict"])


def of_fit(summary: SummaryJson) -> list[str]:
    """Of a fit: its state, the parameters and the creep, with units and 90 % intervals."""
    derived = summary["derived"]
    state = "converged" if summary["converged"] else "NOT CONVERGED"
    passed = summary["model_check"]["passed"] if "model_check" in summary else None
    checked = {True: "model check passed", False: "MODEL CHECK FAILED", None: "model not checked"}[passed]
    names = [n for n in summary["parameters"] if n.split("[")[0].split(".")[0] in (*_SHOWN, *_effects(summary))]
    parameters = ", ".join(f"{name} {_with_unit(summary['parameters'][name])}" for name in names)
    creep = f"creep after 2 min at {short(derived['tension_N'])} N: {_band(derived['creep_2min_mm'])} mm"
    return [f"{summary['experiment']}: {state}, {checked}", f"  {parameters}", f"  {creep} (medians, 90 % intervals)"]


_SHOWN = ("k1", "B", "U", "k2", "N")


def _effects(summary: SummaryJson) -> list[str]:
    return [key.split("@")[0] for key in summary["effects"]]


def of_findings(name: str, report: ExperimentFindings) -> list[str]:
    """Of one experiment that something may be missing in: what, how large, and what it is worth."""
    verdict, effects = report["verdict"], ", ".join(report["effects"])
    finding = _verdict_in_words(report) or f"{verdict}: {effects}"
    if verdict == "ambiguous":
        finding = f"ambiguous: {undecided(report) if families_said(report) else likely(report)}"
    if verdict == "partial":
        are = "are" if report["effects"][1:] else "is"
        finding = f"{effects} {are} missing, and something that is not in the catalogue"
    lines = [f"{name}: {finding} ({p_in_words(report['p_global'], report['p_simulations'])})"]
    if verdict == "unknown" and likely(report):
        lines.append(f"  beside it most likely {likely(report)}; none of these is established")
    lines += [f"  {sentence}" for sentence in said_beside(report)]
    for effect, size in report["amplitudes"].items():
        at = "" if size["hold"] is None else f" at hold {size['hold']}"
        unit = "" if size["unit"] == "-" else f" {size['unit']}"
        lines.append(f"  {effect}{at} {size['mean']:.3g} [{size['q05']:.3g}, {size['q95']:.3g}]{unit}")
    lines += [f"  {elsewhere}" for elsewhere in in_other_tests(report)]
    like = [other for other in report["group"] if other not in (*report["effects"], "unknown")]
    if like and verdict in ("named", "ambiguous"):
        lines.append(f"  hard to distinguish on this protocol: {', '.join(like)}")
    gain = report["held_out"]
    before, after = (read(gain[model], "rmse") for model in ("plain", "final"))
    if report["effects"] and None not in (before, after):
        lines.append(f"  held-out holds: rmse {before:.3g} -> {after:.3g} {unit_read(gain['plain'])}")
    return lines


def in_other_tests(report: ExperimentFindings) -> list[str]:
    """Which accepted effects are those of other tests: an event there, or an instrument that reads only those."""
    others = [effect for effect in report.get("accepted", []) if effect not in report["amplitudes"]]
    return [f"{effect}: in other tests of the same material, not in this one" for effect in others]


def of_import(name: str, test: ImportedExperiment) -> list[str]:
    """Of a raw file: what was found in it and what was done."""
    sample = f"{test['length_mm']:g} mm of {test['material']}"
    return [
        f"{name}: {counted(test['holds'], 'hold')}, {counted(test['readings'], 'reading')}, {sample}",
        *(f"  {note}" for note in test["notes"]),
    ]


def of_batch(found: BatchJson) -> list[str]:
    """Of many experiments: how many, what was found, and which stand apart."""
    rows, far = found["experiments"], found["outliers"]
    failed = sum(row["error"] is not None for row in rows)
    converged = sum(bool(row["converged"]) for row in rows)
    lines = [f"{counted(len(rows), 'experiment')}: {converged} converged, {failed} failed"]
    verdicts = Counter(row["verdict"] for row in rows if row["verdict"])
    if verdicts:
        lines.append("  " + ", ".join(f"{count} {verdict}" for verdict, count in verdicts.most_common()))
    lines += [f"  apart: {outlier['sentence']}" for outlier in far[:_MOST_LINES]]
    return lines + ([f"  and {len(far) - _MOST_LINES} more outliers"] if len(far) > _MOST_LINES else [])


def of_plan(row: JudgedProtocol) -> list[str]:
    """Of a planned test: its rank and length, and what would be known afterwards."""
    budget = "" if row["within_budget"] else ", longer than the available time"
    lines = [f"{row['rank']}. {row['name']}: {row['duration_min']:.3g} min{budget}, {row['information_bits']:.3g} bits"]
    known = [
        f"{name} {row['parameters'][name]['sd']:.2g} {unit_text(UNITS[name])}".rstrip()
        for name in _SHOWN
        if name in row["parameters"]
    ]
    creep = row["creep"]
    known.append(f"creep after 1 h at {creep['tension_N']:.3g} N {creep['creep_1h_mm']['sd']:.2g} mm")
    lines.append(f"  expected sd: {', '.join(known)}")
    if row["robot"] is not None and row["robot"]["drift_sd_mm"] is not None:
        lines.append(f"  drift of the robot after 1 h: sd {row['robot']['drift_sd_mm']:.2g} mm")
    return lines


_MOST_LINES = 10  # of outliers, on a terminal


def of_check(name: str, test: CheckedExperiment) -> list[str]:
    """Of a test that is not fitted yet: its holds, and what it can determine."""
    many = f"{counted(test['recorded_holds'], 'hold')}, {counted(test['readings'], 'reading')}"
    recorded = f"{many} in {test['duration_s'] / 60.0:.3g} min"
    unit = unit_read(test, "resolution")
    step = read(test, "resolution")
    steps = f", written in steps of {step:g} {unit}" if step else ""
    lines = [f"{name}: {recorded}{steps}; {test['length_mm']:g} mm of {test['material']}"]
    if test["temperature_C"]:
        lines.append("  temperature from {:.3g} to {:.3g} °C".format(*test["temperature_C"]))
    weights = test["control"] == "force"
    lines.append(f"  {'hold':>4} {'weight' if weights else 'displacement':>13} {'begins':>9} {'lasts':>9}  readings")
    for hold in test["holds"]:
        course = "none: held, not recorded"
        if hold["number"] is not None:
            first, last = read(hold, "first"), read(hold, "last")
            course = f"{hold['readings']} from {hold['first_s']:g} s on, {first:.4g} to {last:.4g} {unit}"
        place = f"{hold['tension_N']:g} N" if weights else f"{hold['displacement_mm']:g} mm"
        begins, lasts = (f"{hold[key]:.6g} s" for key in ("start_s", "duration_s"))
        number = "-" if hold["number"] is None else hold["number"]
        lines.append(f"  {number:>4} {place:>13} {begins:>9} {lasts:>9}  {course}")
    for source in ("data", "data and prior", "prior"):
        ranges = [
            f"{p} {_with_unit(range_)}" for p, range_ in test["parameters"].items() if range_["determined_by"] == source
        ]
        lines += _wrapped(f"parameters from the {source}", ranges)
    for shows, words in _SHOWS.items():
        effects = [(e, found) for e, found in test["effects"].items() if found["shows"] == shows]
        lines += _wrapped(words, [_size(e, found) for e, found in effects])
    if test["hold_ends"]:
        lines += wrap(test["hold_ends"]["sentence"], 110, initial_indent="  ", subsequent_indent="    ")
    count = len(test["warnings"])
    lines.append(f"  {counted(count, 'warning')}, on standard error" if count else "  nothing suspicious")
    return lines


_SHOWS = {
    "yes": "effects that would be detected, from this size on",
    "if unusually large": "effects that would be detected if unusually large",
    "no": "effects that it cannot show",
}


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
    return f"{name}, {many}: {', '.join(said)}; intervals hold 90 %."


def _size(effect: str, found: EffectSize) -> str:
    if found["amplitude_80"] is None:
        return f"{effect} ({found['reason']})"
    return f"{effect} {found['amplitude_80']:.2g}" + (f" {found['unit']}" if found["unit"] != "-" else "")


def _wrapped(title: str, items: list[str]) -> list[str]:
    """A list in lines that a terminal shows whole."""
    if not items:
        return []
    whole = [item.replace(" ", "\u00a0") for item in items]  # no item is broken
    lines = wrap(f"{title}: {', '.join(whole)}", 110, initial_indent="  ", subsequent_indent="    ")
    return [line.replace("\u00a0", " ") for line in lines]


def of_comparison(name: str, table: ComparedModels) -> str:
    """Of one experiment: which models predict what they have not seen best."""
    best, *others = [row["name"] for row in table["models"] if row["failed"] is None] or ["none"]
    return f"{name}: {best} predicts left-out holds best" + (f", then {', '.join(others[:2])}" if others else "")


def of_pose(found: PoseJson | PoseHistoryJson) -> list[str]:
    """Of a robot: how it hangs, and how far its platform moves, for each spread of specimens."""
    if not found["feasible"]:
        return [f"{found['robot']}: {found['sentence']}"]
    lines = _turned(cast(PoseJson, found)) if "orientation" in found else []
    if "plane" in found:
        lines.append(f"{found['robot']}: {cast(PoseJson, found)['plane']['sentence']}")
    drifts = []
    measured = "history" in found and cast(PoseHistoryJson, found)["history"]["kind"] == "measured"
    moved = "is away from where it is meant to be" if measured else "has drifted"
    for drift in found["drift"]:
        far, time = drift["distance_mm"], drift["times_s"][-1]
        if known_at_the_end(drift):
            drifts.append(
                f"{found['robot']}: after {time:g} s the platform {moved} by {far['q50'][-1]:.3g} mm "
                f"[{far['q05'][-1]:.3g}, {far['q95'][-1]:.3g}] (specimen spread {100 * drift['specimen_spread']:g} %)"
            )
    return lines + (drifts or [f"{found['robot']}: no draw of the wires could be solved"])


def _turned(found: PoseJson) -> list[str]:
    """The orientation that balance decided."""
    vector = ", ".join(f"{v:.4g}" for v in found["pose"]["rotation_vector_rad"])
    return [f"{found['robot']}: rotation vector ({vector}) rad; {found['orientation']['sentence']}"]


def of_calibration(found: CalibrateJson) -> list[str]:
    """Of a calibration: every wire's length."""
    known = found["with_creep_model"]
    if not known["converged"]:
        return [f"{found['robot']}: not converged, no lengths to use"]
    length = known["length_m"]
    rows = zip(length["mean"], length["q05"], length["q95"], strict=True)
    lengths = ", ".join(f"{mean:.5f} [{low:.5f}, {high:.5f}]" for mean, low, high in rows)
    lines = [f"{found['robot']}: zero-tension lengths in m: {lengths}"]
    points = found["exit_points_m"]
    if np.any(np.array(points["sd"], float) > 0):
        lines.append("  exit points in mm, ± standard error:")
        for i, (mean, errors) in enumerate(zip(points["mean"], points["sd"], strict=True)):
            place = ", ".join(f"{1e3 * m:.1f} ± {1e3 * sd:.2g}" for m, sd in zip(mean, errors, strict=True))
            lines.append(f"    wire {i + 1}: ({place})")
    open_ = found["identified"]["not_determined"]
    return lines + [f"  not determined: {text}" for text in open_[:_MOST_OPEN]]


_MOST_OPEN = 4  # combinations that are listed: a terminal is no table


def _with_unit(quantity: Parameter | ParameterRange) -> str:
    return f"{_band(quantity)} {unit_text(quantity['unit'])}".rstrip()


def _band(quantity: Quantiles | ParameterRange | None) -> str:
    return "-" if quantity is None else f"{quantity['q50']:.4g} [{quantity['q05']:.4g}, {quantity['q95']:.4g}]"


def known_at_the_end(drift: Drift) -> bool:
    """Whether any draw holds the platform at the last time."""
    middle = drift["distance_mm"]["q50"]
    return middle is not None and middle[-1] is not None


def fit_in_a_sentence(summary: SummaryJson) -> str:
    """How much the wire creeps and how stiff it is, with intervals.

    Parameters
    ----------
    summary : dict
    """
    derived, k1 = summary["derived"], summary["parameters"].get("k1")
    trusted = summary["converged"] and summary.get("model_check", {}).get("passed") is not False
    doubt = "" if trusted else "If the model were right: "
    creep = derived["creep_2min_mm"]
    if creep is None or k1 is None:
        return f"{doubt}{summary['experiment']}: the readings do not say how much this wire creeps."
    stretched = quantity(creep["q50"], creep["q05"], creep["q95"], "mm")
    stiff = quantity(k1["q50"], k1["q05"], k1["q95"], "N")
    tension = f"{short(derived['tension_N'])} N"
    return (
        f"{doubt}{summary['experiment']} creeps by {stretched} within two minutes under {tension}, and its "
        f"stiffness is {stiff} per unit of strain; intervals hold 90 %."
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
    effects = [effect.replace("_", " ") for effect in report["effects"]]
    are = "are" if effects[1:] else "is"
    candidates = likely(report, lambda effect: effect.replace("_", " "))
    what = {
        "nothing-missing": f"{_verdict_in_words(report)}: the plain model and its noise explain these readings",
        "unknown": f"{_verdict_in_words(report)}"
        + (f"; beside it most likely {candidates}, none of them established" if candidates else ""),
        "ambiguous": undecided(report, lambda effect: effect.replace("_", " ")),
        "named": f"{listed(effects)} {are} missing",
        "partial": f"{listed(effects)} {are} missing, and something else that no effect in the catalogue explains",
    }[report["verdict"]]
    sizes = [quantity(a["mean"], a["q05"], a["q95"], a["unit"]) for a in report["amplitudes"].values()]
    size = f", of size {listed(sizes)}" if sizes else ""
    held = report["held_out"]
    before, after = (read(held[model], "rmse") for model in ("plain", "final"))
    gain = ""
    if report["effects"] and before is not None and after is not None:
        gain = f"; with {'them' if effects[1:] else 'it'} the error on unused holds goes from {number(before)} to "
        gain += f"{number(after)} {unit_read(held['plain'])}"
    sure = f" ({p_in_words(report['p_global'], report['p_simulations'])})" if report["p_global"] is not None else ""
    return f"{name}: {what}{size}{gain}{sure}."


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

        against = f", by {number(gain['elpd'], 2)} ± {number(gain['se'], 2)} in elpd against {table['base']}"
        against += "" if meaningful(gain["elpd"], gain["se"]) else ", which may be chance"
    come = "come" if others[1:] else "comes"
    then = f"; then {come} {listed([row['name'] for row in others[:3]])}" if others else ""
    rest = f" and {len(others) - 3} more" if len(others) > 3 else ""
    return f"{name}: {best['name']} predicts left-out holds best{against}{then}{rest}."


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
    out += [f"Not fitted: {_some(failed)}."] if failed else []
    clean = [row["name"] for row in rows if row["verdict"] == "nothing-missing"]
    out += [f"Nothing is missing in {_count(len(clean), 'test')}."] if clean else []
    effects = Counter(effect for row in rows for effect in row["effects"])
    for effect, count in effects.most_common():
        where = [row["name"] for row in rows if effect in row["effects"]]
        out.append(f"{effect.replace('_', ' ').capitalize()}: in {_count(count, 'test')} ({_some(where)}).")
    unknown = [row["name"] for row in rows if row["verdict"] in ("unknown", "partial")]
    out += [f"Something without a name: in {_some(unknown)}."] if unknown else []
    refused = [row["name"] for row in rows if row["check"] == "failed" and row["verdict"] is None]
    out += [f"The model does not describe the readings of {_some(refused)}."] if refused else []
    out += [outlier["sentence"].rstrip(".") + "." for outlier in found["outliers"][:_MOST_LINES]]
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


_MOST_MATERIALS = 2  # whose stiffness a first sentence has room for


def _count(number_of: int, what: str) -> str:
    return f"one {what}" if number_of == 1 else f"{number_of} {what}s"


def _some(names: list[str], most: int = 6) -> str:
    """Names as a sentence lists them, the first of many."""
    more = [f"{len(names) - most} more"] if len(names) > most else []
    return listed([*names[:most], *more])


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
    spread = drift["specimen_spread"]
    alike = f"if wires cut from one line differ by {100 * spread:g} %" if spread else "if all wires are alike"
    return (
        f"The platform of {found['robot']} moves by {moved} and tilts by {turned} degrees within {number(time)} s of "
        f"standing still, {alike}; intervals hold 90 %."
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
        f"Do {best['name']}{what}: within {number(best['duration_min'])} min it would make known the creep after an "
        f"hour at {number(best['creep']['tension_N'])} N to ± {number(creep['sd'], 2)} mm (now ± "
        f"{number(creep['guess_sd'], 2)} mm, standard deviations)."
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
    return (
        f"The zero-tension lengths of {found['robot']}'s {len(sd)} wires are known to {span(min(sd), max(sd), 2)} mm "
        f"(standard errors), from {found['read']} of {counted(found['holds'], 'hold')}."
    )
