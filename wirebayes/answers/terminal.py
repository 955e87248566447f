"""The answer of every result in a few lines, with units: on a terminal, and in Python with `print`."""

from collections.abc import Iterable, Sequence
from typing import Literal

from wirebayes.answers.creep import creep_as_long_as_held, lengths_in_words
from wirebayes.answers.holds_table import holds_table
from wirebayes.answers.verdict import (
    better_beside,
    control_judged,
    lead_may_be_chance,
    median_between,
    models_ranked,
    verdict_in_words,
    what_it_is,
)
from wirebayes.json_files.batch import BatchJson, Row
from wirebayes.json_files.check import CheckedExperiment, EffectSize, ParameterRange
from wirebayes.json_files.comparison import ComparedModel, ComparedModels
from wirebayes.json_files.discovery import AmplitudeEstimate, ExperimentFindings
from wirebayes.json_files.imported import ImportedExperiment
from wirebayes.json_files.plan import JudgedProtocol
from wirebayes.json_files.read_units import error_grows, read_value, unit_read
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.json_files.values import Quantiles
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.result_warnings import warns_of
from wirebayes.sentences import (
    counted,
    lasting,
    likely,
    listed,
    p_in_words,
    said_beside,
    short,
    some_of,
    spoken,
    undecided,
    unit_text,
)
from wirebayes.wire.protocol import Control


def of_fit(summary: SummaryJson) -> list[str]:
    """Lines about a fit: its state, the parameters and the creep, with units and 90 % intervals."""
    name = summary["experiment"]
    state = "converged" if summary["converged"] else "NOT CONVERGED"
    checked = "model not checked"
    if "model_check" in summary:
        words = {True: "model check passed", False: "MODEL CHECK FAILED", None: "model not checked"}
        checked = words[summary["model_check"]["passed"]]
    time, elongation = creep_as_long_as_held(summary)
    creep = _band(elongation)
    tension = short(summary["derived"]["tension_N"])
    of_creep, of_amount = lengths_in_words(summary)
    effects = [key.split("@")[0] for key in summary["effects"]]
    lines = [f"{name}: {state}, {checked} (medians, 90 % intervals)"]
    lines += _parameters(summary, "stiffness", ("k1",))
    lines.append(f"  creep after {time} at {tension} N{of_creep}: {creep} mm")
    lines += _parameters(summary, f"creep law{of_amount}", ("B", "U", "k2", "N"))
    lines += _parameters(summary, "effects", effects)
    return lines


_SHOWN = ("k1", "B", "U", "k2", "N")


def _parameters(summary: SummaryJson, title: str, wanted: Sequence[str]) -> list[str]:
    """A line of parameters with their intervals, those of named effects too; none where nothing of it was sampled."""
    each = []
    for name, parameter in summary["parameters"].items():
        if name.split("[")[0].split(".")[0] in wanted:
            each.append(f"{name} {_with_unit(parameter)}")
    return _list(title, each)


def of_findings(name: str, report: ExperimentFindings) -> list[str]:
    """Lines about one experiment that something may be missing in: what, how large, and what it is worth."""
    verdict = report["verdict"]
    effects = report["effects"]
    sure = p_in_words(report["p_global"], report["p_simulations"])
    lines = [f"{name}: {_verdict(report)} ({sure})"]
    candidates = likely(report)
    if verdict == "unknown" and candidates:
        lines.append(f"  its largest part may be {candidates}")
    sentences = list(said_beside(report))
    for effect, size in report["amplitudes"].items():
        sentences.append(_effect_size(effect, size, control_judged(report)))
    sentences += in_other_tests(report)
    lines += [f"  {sentence}" for sentence in sentences]
    if verdict in ("named", "ambiguous"):
        named = (*effects, "unknown")
        alike = [spoken(other) for other in report["group"] if other not in named]
        lines += _list("hard to distinguish on this protocol", alike)
    gain = _gain(report)
    if effects and gain:
        lines.append(f"  {gain}")
    return lines


def _verdict(report: ExperimentFindings) -> str:
    """What is missing, in words."""
    if report["verdict"] == "ambiguous":
        return undecided(report)
    nameless = verdict_in_words(report)
    if nameless:
        return nameless
    are = "are" if report["effects"][1:] else "is"
    named = f"{listed([spoken(effect) for effect in report['effects']])} {are} missing"
    return f"{named}, and something that is not in the catalogue" if report["verdict"] == "partial" else named


def _effect_size(effect: str, size: AmplitudeEstimate, control: Control) -> str:
    """How large an effect is, and what it is."""
    hold = "" if size["hold"] is None else f" at hold {size['hold']}"
    middle, low, high = (short(value, 3) for value in median_between(size))
    return f"{spoken(effect)}{hold} {middle} [{low}, {high}]{_unit_and_meaning(effect, size['unit'], control)}"


def _gain(report: ExperimentFindings) -> str:
    """What the effects take away of the error on holds that were kept out; empty where none was."""
    held = report["held_out"]
    before = read_value(held["plain"], "rmse")
    after = read_value(held["final"], "rmse")
    if before is None or after is None:
        return ""
    worse = ": no better" if error_grows(held) else ""
    change = f"{short(before, 3)} -> {short(after, 3)} {unit_read(held['plain'])}"
    return f"error on holds kept out of the fit: {change} rms{worse}"


def _unit_and_meaning(effect: str, unit: str, control: Control) -> str:
    """What stands behind the size of an effect."""
    known = what_it_is(effect, control)
    size = "" if unit == "-" else f" {unit}"
    return f"{size}: {known}" if known else size


def in_other_tests(report: ExperimentFindings) -> list[str]:
    """The accepted effects that belong to other tests: an event there, or an instrument that reads only those."""
    others = [effect for effect in report.get("accepted", []) if effect not in report["amplitudes"]]
    return [f"{spoken(effect)}: in other tests of the same material, not in this one" for effect in others]


def of_import(name: str, test: ImportedExperiment) -> list[str]:
    """Lines about a raw file: what was found in it and what was done."""
    sample = f"{test['length_mm']:g} mm of {test['material']}"
    first = f"{name}: {counted(test['holds'], 'hold')}, {counted(test['readings'], 'reading')}, {sample}"
    return [first, *(f"  {note}" for note in test["notes"])]


def of_batch(found: BatchJson) -> list[str]:
    """Lines about many experiments: how many, what was found, and which stand apart."""
    rows = found["experiments"]
    far = found["outliers"]
    failed = sum(row["error"] is not None for row in rows)
    converged = sum(bool(row["converged"]) for row in rows)
    lines = [f"{counted(len(rows), 'experiment')}: {converged} converged, {failed} failed"]
    lines += [f"  {sentence}" for sentence in missing_in(rows)]
    lines += [f"  apart: {outlier['sentence']}" for outlier in far[:MOST_OUTLIERS]]
    if len(far) > MOST_OUTLIERS:
        lines.append(f"  and {len(far) - MOST_OUTLIERS} more outliers")
    return lines


def missing_in(rows: Sequence[Row]) -> list[str]:
    """What is missing in which experiments of a batch, a sentence a finding."""
    out = []
    clean = [row["name"] for row in rows if row["verdict"] == "nothing-missing"]
    if clean:
        out.append(f"In {_tests(clean)} nothing is missing that the readings can show.")
    for effect, names in _decided_in(rows).items():
        what = spoken(effect).capitalize()
        where = _tests(names)
        out.append(f"{what} is missing in {where}.")
    for effects, names in _undecided_in(rows).items():
        one_of_these = listed([spoken(effect) for effect in effects], "or")
        what = one_of_these.capitalize()
        where = _tests(names)
        out.append(f"{what} is missing in {where}; these readings do not tell which.")
    nameless = [row["name"] for row in rows if row["verdict"] in ("unknown", "partial")]
    if nameless:
        where = _tests(nameless)
        out.append(f"Something that has no established name is missing in {where}.")
    return out


def _decided_in(rows: Sequence[Row]) -> dict[str, list[str]]:
    """Names of the experiments that each effect is missing in, the most frequent effect first."""
    out = dict[str, list[str]]()
    for row in rows:
        if row["verdict"] != "ambiguous":
            for effect in row["effects"]:
                out.setdefault(effect, []).append(row["name"])
    return dict(sorted(out.items(), key=lambda item: -len(item[1])))


def _undecided_in(rows: Sequence[Row]) -> dict[tuple[str, ...], list[str]]:
    """Names of the experiments that leave the same effects undecided."""
    out = dict[tuple[str, ...], list[str]]()
    for row in rows:
        if row["verdict"] == "ambiguous":
            out.setdefault(tuple(sorted(row["effects"])), []).append(row["name"])
    return out


def _tests(names: list[str]) -> str:
    """How many tests, and the names of the first."""
    many = "one test" if len(names) == 1 else f"{len(names)} tests"
    return f"{many} ({some_of(names)})"


def _expected(row: JudgedProtocol) -> list[str]:
    """Standard deviations of parameters and creep after a planned test."""
    known = []
    parameters = row["parameters"]
    for parameter in _SHOWN:
        if parameter in parameters:
            width = parameters[parameter]
            unit = unit_text(width["unit"])
            known.append(f"{parameter} {short(width['sd'], 2)} {unit}".rstrip())
    creep = row["creep"]
    creep_sd = creep["creep_1h_mm"]["sd"]
    known.append(f"creep after 1 h at {short(creep['tension_N'], 3)} N {short(creep_sd, 2)} mm")
    return known


def of_plan(row: JudgedProtocol) -> list[str]:
    """Lines about a planned test: its rank and length, and what would be known afterwards."""
    budget = "" if row["within_budget"] else ", longer than the available time"
    name = f"{row['rank']}. {row['name']}"
    minutes = short(row["duration_min"], 3)
    bits = short(row["information_bits"], 3)
    lines = [f"{name}: {minutes} min{budget}, {bits} bits"]
    expected = ", ".join(_expected(row))
    lines.append(f"  expected sd: {expected}")
    drift_sd = row["robot"] and row["robot"]["drift_sd_mm"]
    if drift_sd is not None:
        lines.append(f"  drift of the robot after 1 h: sd {short(drift_sd, 2)} mm")
    return lines


MOST_OUTLIERS = 10  # of outliers, on a terminal


def of_check(name: str, test: CheckedExperiment) -> list[str]:
    """Lines about a test that is not fitted yet: its holds, and what it can determine."""
    unit = unit_read(test, "resolution")
    recorded = _recorded(test, unit)
    wire = f"{test['length_mm']:g} mm of {test['material']}"
    lines = [f"{name}: {recorded}; {wire}"]
    if test["temperature_C"]:
        coldest, warmest = test["temperature_C"]
        lines.append(f"  temperature from {short(coldest, 3)} to {short(warmest, 3)} °C")
    lines += holds_table(test, unit)
    lines += _determined(test)
    lines += _shown(test)
    ends = test["hold_ends"]
    if ends and not warns_of(test, "hold-ends"):
        lines.append(f"  {ends['sentence']}")
    warnings = len(test["warnings"])
    suspicious = counted(warnings, "warning") if warnings else "nothing suspicious"
    lines.append(f"  {suspicious}")
    return lines


def _shown(test: CheckedExperiment) -> list[str]:
    """The effects that the test would show, and those that it would not."""
    lines = []
    for shows, words in _SHOWS.items():
        sizes = [_size(effect, found) for effect, found in test["effects"].items() if found["shows"] == shows]
        lines += _list(words, sizes)
    return lines


def _recorded(test: CheckedExperiment, unit: str) -> str:
    """How many holds and readings, how long, and how finely they were written."""
    many = f"{counted(test['recorded_holds'], 'hold')}, {counted(test['readings'], 'reading')}"
    step = read_value(test, "resolution")
    steps = f", written in steps of {step:g} {unit}" if step else ""
    return f"{many} in {lasting(test['duration_s'])}{steps}"


def _determined(test: CheckedExperiment) -> list[str]:
    """What each parameter is known from."""
    lines = []
    for source in ("data", "data and prior", "prior"):
        ranges = []
        for name, parameter in test["parameters"].items():
            if parameter["determined_by"] == source:
                ranges.append(f"{name} {_with_unit(parameter)}")
        lines += _list(f"parameters from the {source}", ranges)
    return lines


_SHOWS = {
    "yes": "effects that would be detected, from this size on",
    "if unusually large": "effects that would be detected if unusually large",
    "no": "effects that it cannot show",
}


def _size(effect: str, found: EffectSize) -> str:
    name = spoken(effect)
    if found["amplitude_80"] is None:
        return f"{name} ({found['reason']})"
    unit = "" if found["unit"] == "-" else f" {found['unit']}"
    return f"{name} {short(found['amplitude_80'], 2)}{unit}"


def _list(title: str, items: list[str]) -> list[str]:
    """A line for what there is of something; none where there is nothing."""
    return [f"  {title}: {', '.join(items)}"] if items else []


def of_comparison(name: str, table: ComparedModels) -> list[str]:
    """Lines about one experiment: the models that best predict what they have not seen, and with which error."""
    rows = models_ranked(table)
    if not rows:
        return [f"{name}: no model could be judged"]
    shown, rest = rows[:3], rows[3:]
    best, *others = [spoken(row["name"]) for row in shown]
    then = f", then {listed(others)}" if others else ""
    if lead_may_be_chance(table):
        then = f", which may be chance; then {listed(others)}"
    shown += [row for row in rest if row["name"] == table["base"]]
    errors = [_error_ahead(row) for row in shown]
    scored = [error for error in errors if error]
    beside = [f"  {sentence}" for sentence in better_beside(table)]
    first = f"{name}: {best} predicts left-out holds best{then}"
    return [first, *_list("rms error on the last holds", scored), *beside]


def _error_ahead(row: ComparedModel) -> str:
    """A model with its rms error on the last holds; empty where it was not scored on them."""
    held = row.get("held_out")
    free = held["free"] if held else None
    error = read_value(free, "rmse") if free else None
    if not free or not error:
        return ""
    return f"{spoken(row['name'])} {short(error, 2)} {unit_read(free)}"


def options_of_best(table: ComparedModels) -> str | None:
    """What `wirebayes fit` needs for the model that predicts best; None for one that options alone do not describe.

    Where its lead may be chance, for the one that all are compared with.
    """
    rows = {row["name"]: row for row in table["models"] if row["failed"] is None}
    base = rows.get(table["base"])
    if base is None:
        return None
    best = base if lead_may_be_chance(table) else next(iter(rows.values()))
    effects = best.get("effects", [])
    if not all(what_it_is(effect) for effect in effects):
        return None
    is_of_options = bool(effects) or any(best[key] != base[key] for key in _USUAL)
    if best is not base and not is_of_options:
        return None
    options = [f"--effect {effect}" for effect in effects]
    return " ".join([*options, *_unusual(best, _USUAL)])


def options_of_base(table: ComparedModels) -> str:
    """What `wirebayes discover` needs to search beside the model that all are compared with, after a space."""
    base = next(row for row in table["models"] if row["name"] == table["base"])
    return "".join(f" {option}" for option in _unusual(base, ("elastic_law", "history")))


_Choice = Literal["elastic_law", "history", "likelihood"]
_USUAL: dict[_Choice, str] = {
    "elastic_law": PLAIN_SPEC.law,
    "history": PLAIN_SPEC.history,
    "likelihood": PLAIN_SPEC.likelihood,
}


def _unusual(row: ComparedModel, choices: Iterable[_Choice]) -> list[str]:
    """The options of a model that commands do not take by themselves."""
    options = []
    for key in choices:
        if row[key] != _USUAL[key]:
            option = key.replace("_", "-")
            options.append(f"--{option} {row[key]}")
    return options


def _with_unit(quantity: Parameter | ParameterRange) -> str:
    return f"{_band(quantity)} {unit_text(quantity['unit'])}".rstrip()


def _band(quantity: Quantiles | ParameterRange | None) -> str:
    if quantity is None:
        return "-"
    middle, low, high = (short(quantity[quantile]) for quantile in ("q50", "q05", "q95"))
    return f"{middle} [{low}, {high}]"
