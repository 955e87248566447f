"""The answer of every result in a few lines, with units: on a terminal, and in Python with `print`."""

from collections import Counter
from collections.abc import Sequence
from typing import Literal, cast

import numpy as np

from wirebayes.answers.creep import creep_as_long_as_held
from wirebayes.answers.verdict import verdict_in_words, what_it_is
from wirebayes.json_files.batch import BatchJson, Row
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.check import CheckedExperiment, EffectSize, ParameterRange
from wirebayes.json_files.comparison import ComparedModel, ComparedModels
from wirebayes.json_files.discovery import AmplitudeEstimate, ExperimentFindings
from wirebayes.json_files.imported import ImportedExperiment
from wirebayes.json_files.plan import JudgedProtocol
from wirebayes.json_files.pose import PoseJson, known_at_the_end
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.json_files.read_units import error_grows, read_value, unit_read
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.json_files.values import Quantiles
from wirebayes.sentences import (
    coordinates,
    counted,
    lasting,
    likely,
    listed,
    p_in_words,
    said_beside,
    short,
    some_of,
    specimens_are,
    spoken,
    undecided,
    unit_text,
)


def of_fit(summary: SummaryJson) -> list[str]:
    """Of a fit: its state, the parameters and the creep, with units and 90 % intervals."""
    state = "converged" if summary["converged"] else "NOT CONVERGED"
    passed = summary["model_check"]["passed"] if "model_check" in summary else None
    checked = {True: "model check passed", False: "MODEL CHECK FAILED", None: "model not checked"}[passed]
    time, elongation = creep_as_long_as_held(summary)
    creep = f"creep after {time} at {short(summary['derived']['tension_N'])} N: {_band(elongation)} mm"
    return [
        f"{summary['experiment']}: {state}, {checked} (medians, 90 % intervals)",
        *_parameters(summary, "stiffness", ("k1",)),
        f"  {creep}",
        *_parameters(summary, "creep law", ("B", "U", "k2", "N")),
        *_parameters(summary, "effects", [key.split("@")[0] for key in summary["effects"]]),
    ]


_SHOWN = ("k1", "B", "U", "k2", "N")


def _parameters(summary: SummaryJson, title: str, wanted: Sequence[str]) -> list[str]:
    """A line of parameters with their intervals, those of named effects too; none where nothing of it was sampled."""
    names = [name for name in summary["parameters"] if name.split("[")[0].split(".")[0] in wanted]
    each = [f"{name} {_with_unit(summary['parameters'][name])}" for name in names]
    return [f"  {title}: {', '.join(each)}"] if each else []


def of_findings(name: str, report: ExperimentFindings) -> list[str]:
    """Of one experiment that something may be missing in: what, how large, and what it is worth."""
    verdict = report["verdict"]
    lines = [f"{name}: {_verdict(report)} ({p_in_words(report['p_global'], report['p_simulations'])})"]
    if verdict == "unknown" and likely(report):
        lines.append(f"  its largest part may be {likely(report)}; nothing is established")
    lines += [f"  {sentence}" for sentence in said_beside(report)]
    lines += [f"  {_effect_size(effect, size)}" for effect, size in report["amplitudes"].items()]
    lines += [f"  {elsewhere}" for elsewhere in in_other_tests(report)]
    like = [other for other in report["group"] if other not in (*report["effects"], "unknown")]
    if like and verdict in ("named", "ambiguous"):
        lines.append(f"  hard to distinguish on this protocol: {', '.join(map(spoken, like))}")
    return lines + ([f"  {_gain(report)}"] if report["effects"] and _gain(report) else [])


def _verdict(report: ExperimentFindings) -> str:
    """What is missing, in words."""
    if report["verdict"] == "ambiguous":
        return undecided(report)
    are = "are" if report["effects"][1:] else "is"
    named = f"{listed([spoken(effect) for effect in report['effects']])} {are} missing"
    beyond = ", and something that is not in the catalogue" if report["verdict"] == "partial" else ""
    return verdict_in_words(report) or named + beyond


def _effect_size(effect: str, size: AmplitudeEstimate) -> str:
    """How large an effect is, and what it is."""
    at = "" if size["hold"] is None else f" at hold {size['hold']}"
    middle, low, high = (short(size[q], 3) for q in ("mean", "q05", "q95"))
    return f"{spoken(effect)}{at} {middle} [{low}, {high}]{_unit_and_meaning(effect, size['unit'])}"


def _gain(report: ExperimentFindings) -> str:
    """What the effects take away of the error on holds that were kept out; empty where none was."""
    held = report["held_out"]
    before, after = (read_value(held[model], "rmse") for model in ("plain", "final"))
    if before is None or after is None:
        return ""
    worse = ": no better" if error_grows(held) else ""
    return f"error on holds kept out of the fit: {before:.3g} -> {after:.3g} {unit_read(held['plain'])} rms{worse}"


def _unit_and_meaning(effect: str, unit: str) -> str:
    """What stands behind the size of an effect."""
    known = what_it_is(effect)
    size = "" if unit == "-" else f" {unit}"
    return f"{size}: {known}" if known else size


def in_other_tests(report: ExperimentFindings) -> list[str]:
    """Which accepted effects are those of other tests: an event there, or an instrument that reads only those."""
    others = [effect for effect in report.get("accepted", []) if effect not in report["amplitudes"]]
    return [f"{spoken(effect)}: in other tests of the same material, not in this one" for effect in others]


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
    lines += [f"  {sentence}" for sentence in missing_in(rows)]
    lines += [f"  apart: {outlier['sentence']}" for outlier in far[:MOST_OUTLIERS]]
    return lines + ([f"  and {len(far) - MOST_OUTLIERS} more outliers"] if len(far) > MOST_OUTLIERS else [])


def missing_in(rows: Sequence[Row]) -> list[str]:
    """What is missing in which experiments of a batch, a sentence a finding."""
    clean = [row["name"] for row in rows if row["verdict"] == "nothing-missing"]
    out = [f"In {_tests(clean)} nothing is missing that the readings can show."] if clean else []
    decided = [row for row in rows if row["verdict"] != "ambiguous"]
    for effect, _ in Counter(effect for row in decided for effect in row["effects"]).most_common():
        of_these = [row["name"] for row in decided if effect in row["effects"]]
        out.append(f"{spoken(effect).capitalize()} is missing in {_tests(of_these)}.")
    for effects, of_these in _undecided_in(rows).items():
        what = listed([spoken(effect) for effect in effects], "or")
        where = f"in {_tests(of_these)}; these readings do not tell which"
        out.append(f"{what.capitalize()} is missing {where}.")
    nameless = [row["name"] for row in rows if row["verdict"] in ("unknown", "partial")]
    return out + (
        [f"Something that no effect in the catalogue explains is missing in {_tests(nameless)}."] if nameless else []
    )


def _undecided_in(rows: Sequence[Row]) -> dict[tuple[str, ...], list[str]]:
    """Names of the experiments that leave the same effects undecided."""
    out = dict[tuple[str, ...], list[str]]()
    for row in rows:
        if row["verdict"] == "ambiguous":
            out.setdefault(tuple(sorted(row["effects"])), []).append(row["name"])
    return out


def _tests(names: list[str]) -> str:
    """How many tests, and the names of the first."""
    return f"{'one test' if len(names) == 1 else f'{len(names)} tests'} ({some_of(names)})"


def of_plan(row: JudgedProtocol) -> list[str]:
    """Of a planned test: its rank and length, and what would be known afterwards."""
    budget = "" if row["within_budget"] else ", longer than the available time"
    lines = [f"{row['rank']}. {row['name']}: {row['duration_min']:.3g} min{budget}, {row['information_bits']:.3g} bits"]
    known = [
        f"{name} {row['parameters'][name]['sd']:.2g} {unit_text(row['parameters'][name]['unit'])}".rstrip()
        for name in _SHOWN
        if name in row["parameters"]
    ]
    creep = row["creep"]
    known.append(f"creep after 1 h at {creep['tension_N']:.3g} N {creep['creep_1h_mm']['sd']:.2g} mm")
    lines.append(f"  expected sd: {', '.join(known)}")
    if row["robot"] is not None and row["robot"]["drift_sd_mm"] is not None:
        lines.append(f"  drift of the robot after 1 h: sd {row['robot']['drift_sd_mm']:.2g} mm")
    return lines


MOST_OUTLIERS = 10  # of outliers, on a terminal


def of_check(name: str, test: CheckedExperiment) -> list[str]:
    """Of a test that is not fitted yet: its holds, and what it can determine."""
    many = f"{counted(test['recorded_holds'], 'hold')}, {counted(test['readings'], 'reading')}"
    recorded = f"{many} in {test['duration_s'] / 60.0:.3g} min"
    unit = unit_read(test, "resolution")
    step = read_value(test, "resolution")
    steps = f", written in steps of {step:g} {unit}" if step else ""
    lines = [f"{name}: {recorded}{steps}; {test['length_mm']:g} mm of {test['material']}"]
    if test["temperature_C"]:
        lines.append("  temperature from {:.3g} to {:.3g} °C".format(*test["temperature_C"]))
    lines += _holds_table(test, unit)
    for source in ("data", "data and prior", "prior"):
        ranges = [
            f"{p} {_with_unit(range_)}" for p, range_ in test["parameters"].items() if range_["determined_by"] == source
        ]
        lines += _list(f"parameters from the {source}", ranges)
    for shows, words in _SHOWS.items():
        effects = [(e, found) for e, found in test["effects"].items() if found["shows"] == shows]
        lines += _list(words, [_size(e, found) for e, found in effects])
    if test["hold_ends"] and "hold-ends" not in [notice["kind"] for notice in test["warnings"]]:
        lines.append(f"  {test['hold_ends']['sentence']}")
    count = len(test["warnings"])
    lines.append(f"  {counted(count, 'warning')}" if count else "  nothing suspicious")
    return lines


def _holds_table(test: CheckedExperiment, unit: str) -> list[str]:
    """A line for each hold: what was set, when it begins, how long it lasts, and what was read, in `unit`."""
    weights = test["control"] == "force"
    lines = [f"  {'hold':>4} {'weight' if weights else 'displacement':>13} {'begins':>9} {'lasts':>9}  readings"]
    for hold in test["holds"]:
        course = "none: held, not recorded"
        if hold["number"] is not None:
            first, last = read_value(hold, "first"), read_value(hold, "last")
            course = f"{hold['readings']} from {hold['first_s']:g} s on, {first:.4g} to {last:.4g} {unit}"
        place = f"{hold['tension_N']:g} N" if weights else f"{hold['displacement_mm']:g} mm"
        begins, lasts = (f"{hold[key]:.6g} s" for key in ("start_s", "duration_s"))
        number = "-" if hold["number"] is None else hold["number"]
        lines.append(f"  {number:>4} {place:>13} {begins:>9} {lasts:>9}  {course}")
    return lines


_SHOWS = {
    "yes": "effects that would be detected, from this size on",
    "if unusually large": "effects that would be detected if unusually large",
    "no": "effects that it cannot show",
}


def _size(effect: str, found: EffectSize) -> str:
    if found["amplitude_80"] is None:
        return f"{spoken(effect)} ({found['reason']})"
    return f"{spoken(effect)} {short(found['amplitude_80'], 2)}" + (f" {found['unit']}" if found["unit"] != "-" else "")


def _list(title: str, items: list[str]) -> list[str]:
    """A line for what there is of something; none where there is nothing."""
    return [f"  {title}: {', '.join(items)}"] if items else []


def of_comparison(name: str, table: ComparedModels) -> list[str]:
    """Of one experiment: which models predict what they have not seen best, and with which error."""
    rows = [row for row in table["models"] if row["failed"] is None]
    if not rows:
        return [f"{name}: no model could be judged"]
    best, *others = [spoken(row["name"]) for row in rows[:3]]
    then = f", then {listed(others)}" if others else ""
    base = [row for row in rows[3:] if row["name"] == table["base"]]
    errors = [error for row in [*rows[:3], *base] if (error := _error_ahead(row))]
    return [f"{name}: {best} predicts left-out holds best{then}", *_list("rms error on the last holds", errors)]


def _error_ahead(row: ComparedModel) -> str:
    """A model with its rms error on the last holds; empty where it was not scored on them."""
    held = row.get("held_out")
    free = held["free"] if held else None
    error = read_value(free, "rmse") if free else None
    return f"{spoken(row['name'])} {short(error, 2)} {unit_read(free)}" if free and error else ""


def options_of_best(table: ComparedModels) -> str | None:
    """What `wirebayes fit` needs for the model that predicts best; None for one that options alone do not describe."""
    rows = {row["name"]: row for row in table["models"] if row["failed"] is None}
    best, base = next(iter(rows.values()), None), rows.get(table["base"])
    if best is None or base is None or any(not what_it_is(effect) for effect in best.get("effects", [])):
        return None
    choices = {f"--{key.replace('_', '-')} {best[key]}": best[key] != base[key] for key in _CHOICES}
    options = [*(f"--effect {effect}" for effect in best.get("effects", [])), *(o for o, new in choices.items() if new)]
    return " ".join(options) if options or best is base else None


_CHOICES: tuple[Literal["elastic_law", "history", "likelihood"], ...] = ("elastic_law", "history", "likelihood")


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
            middle, low, high = (short(far[q][-1], 3) for q in ("q50", "q05", "q95"))
            drifts.append(
                f"{found['robot']}: after {lasting(time)} the platform {moved} by {middle} mm [{low}, {high}] "
                f"if {specimens_are(drift['specimen_spread'])}"
            )
    return lines + (drifts or [f"{found['robot']}: no draw of the wires could be solved"])


def _turned(found: PoseJson) -> list[str]:
    """The orientation that balance decided."""
    vector = coordinates(found["pose"]["rotation_vector_rad"])
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
            place = ", ".join(f"{1e3 * m:z.1f} ± {1e3 * sd:.2g}" for m, sd in zip(mean, errors, strict=True))
            lines.append(f"    wire {i + 1}: ({place})")
    open_ = found["identified"]["not_determined"]
    return lines + [f"  not determined: {text}" for text in open_[:_MOST_OPEN]]


_MOST_OPEN = 4  # combinations that are listed: a terminal is no table


def _with_unit(quantity: Parameter | ParameterRange) -> str:
    return f"{_band(quantity)} {unit_text(quantity['unit'])}".rstrip()


def _band(quantity: Quantiles | ParameterRange | None) -> str:
    if quantity is None:
        return "-"
    middle, low, high = (short(quantity[q]) for q in ("q50", "q05", "q95"))
    return f"{middle} [{low}, {high}]"
