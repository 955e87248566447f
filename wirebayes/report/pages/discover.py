"""The page of ``wirebayes discover``: what is missing in the model, how sure that is, and what to measure next."""

from collections.abc import Mapping
from pathlib import Path

from wirebayes.answers.headline import USE, findings_in_a_sentence
from wirebayes.answers.terminal import in_other_tests
from wirebayes.answers.verdict import median_between
from wirebayes.effects.unknown import Discrepancy
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.discovery import AmplitudeEstimate, DiscoveryJson, ExperimentFindings
from wirebayes.json_files.read_units import error_grows, read_value, unit_read
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.report.blocks import (
    Block,
    Columns,
    Configuration,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    picture_file,
    pictures_in,
    seed_of_page,
)
from wirebayes.report.cells import NONE, median_and_interval, percent, unit_or_dash
from wirebayes.report.drawn import drawn, embedded
from wirebayes.report.glossary import SYMBOLS, meaning
from wirebayes.report.pictures.discover import waterfall
from wirebayes.results.mixture import members_of
from wirebayes.sentences import listed, p_in_words, quantity, said_beside, spoken


def discover_page(folder: Path, configuration: Configuration) -> Page:
    """One section an experiment, from ``discovery.json`` and the pictures beside it."""
    content: DiscoveryJson = read_json(folder / "discovery.json")
    found = content["experiments"]
    sections = []
    sentences = []
    named = list[str]()
    for name, v in found.items():
        sections.append(_section(folder, name, v))
        sentences.append(findings_in_a_sentence(name, v))
        named += v["effects"]
        named += v["probabilities"]
        named += v["power"]
        named += v.get("group", [])
    if len(found) > 1:
        summary = Section("Summary", [_overview(found)])
        sections.insert(0, summary)
    lead = " ".join(sentences[:_MOST_SENTENCES])
    sections.append(files_beside(folder, _FILES))
    explained = all(_has_parameters(folder / name) for name in found)
    sections.append(meaning(_TERMS, named, symbols=not explained))
    footer = seed_of_page(configuration)
    return Page("What the model is missing", lead, sections, footer)


def _overview(found: Mapping[str, ExperimentFindings]) -> Table:
    """The verdict on each experiment."""
    lines = []
    for name, v in found.items():
        effects = listed([spoken(effect) for effect in v["effects"]])
        closed = percent((v.get("held_out") or {}).get("gap_closed"))
        lines.append([name, v["verdict"].replace("-", " "), effects, _p(v), closed])
    return Table(["experiment", "verdict", "effects", "p of the plain model", "gap closed"], lines)


_FILES = (
    ("discovery.json", "every number of this page as JSON"),
    ("*/*/summary.json", "parameters of a model"),
    ("*/*/posterior.nc", "all draws of a model, opens with ArviZ"),
    ("configuration.json", "the options of this run, with version and seed"),
)
_MOST_SENTENCES = 3  # at the head of a page; more hide its first picture
_SPEAKS = 0.05  # p of a pattern that says something
_LEAST = 0.01  # probability of a candidate that is worth a row
_NEAREST = (
    "A name is that of the nearest effect in the catalogue: an effect that the catalogue lacks gets this name too, if "
    "it looks the same in this test."
)
_TERMS = ("hold", "90 % interval", "p", "held out", "rms", "elpd", "in the 90 % band", "gap closed")


def _section(folder: Path, name: str, found: ExperimentFindings) -> Section:
    hidden = []
    for sentence in found.get("not_identifiable", []):
        what, _, why = sentence.partition(": ")
        hidden.append([spoken(what), why])
    blocks: list[Block] = before_the_answer(found)
    blocks += _alone(found)
    blocks += beside_the_answer(found)
    blocks += _curves(folder, name)
    if found["verdict"] in ("named", "nothing-missing"):
        blocks.append(Text(USE))
    measure_next = found.get("next_measurement")
    if measure_next:
        blocks.append(Text(f"Measure next: {measure_next}"))
    own = folder / name
    blocks += _parameters(own, found)
    blocks.append(_within_a_minute(found, [what for what, _ in hidden]))
    blocks += _patterns(own, found)
    steps = found.get("steps", [])
    if len(steps) > 1 and read_value(steps[0], "rmse") is not None:
        blocks += _steps(found)
    if found.get("probabilities"):
        blocks.append(_candidates(found))
    if found.get("power"):
        blocks.append(_power(found))
    if hidden:
        caption = "What this test cannot show: the readings would be nearly the same with or without it."
        blocks.append(Table(["what", "why"], hidden, caption))
    return Section(name, blocks)


def _power(found: ExperimentFindings) -> Table:
    """How small an effect such a test would show."""
    lines = []
    for effect, power in found["power"].items():
        lines.append([spoken(effect), number(power["amplitude_80"]), unit_or_dash(power["unit"])])
    caption = "The smallest size of each effect that four of five such tests would show; a dash: none, or no unit."
    return Table(["effect", "size", "unit"], lines, caption)


def _curves(folder: Path, name: str) -> list[Block]:
    file = picture_file(folder, name)
    if file is None:
        return []
    alt = f"Readings of {name} with each model's curve through them, and what it does not explain, hold after hold."
    return [Pictures([Picture(embedded(file), alt, _BEFORE_AND_AFTER, wide=True)])]


def _within_a_minute(found: ExperimentFindings, hidden: list[str]) -> Columns:
    """Where model and measurement disagree, what is known, and what is not."""
    known = [f"{line[0].upper()}{line[1:]}." for line in said_beside(found)]
    known += [*_held_out(found), *_sizes(found)]
    unknown = [_NEAREST] if found.get("effects") else []
    if hidden:
        unknown.append(f"This test cannot show {listed(hidden)}.")
    return Columns(
        [
            Points("Where model and measurement disagree", _disagreements(found)),
            Points("What is known", known or ["Nothing had to be added to the plain model."]),
            Points("What is not known", unknown or ["Nothing to report."]),
        ]
    )


def _disagreements(found: ExperimentFindings) -> list[str]:
    """The residual patterns that chance alone would rarely make, and what they amount to where nothing is missing."""
    patterns = [pattern["sentence"] for pattern in found.get("where", []) if pattern["p"] <= _SPEAKS]
    if not patterns:
        return ["No pattern stands out."]
    if found["verdict"] == "nothing-missing":
        patterns.append(f"One pattern of several may stand out by chance; the global test decides ({_p(found)}).")
    return patterns


def _steps(found: ExperimentFindings) -> list[Block]:
    """How well held-out holds are predicted, by the plain model and with each effect in turn."""
    steps = found["steps"]
    falling = (
        "Rms error on held-out holds: of the plain model, by how much each named effect reduces it in turn, and "
        "what is left above the noise."
    )
    lines = []
    for i, step in enumerate(steps):
        name = spoken(step["model"])
        if i:
            name = f"+ {name}"
        error = number(read_value(step, "rmse"))
        lines.append([name, error, number(step["elpd"]), percent(step["coverage_90"])])
    header = ["model", f"rms error ({unit_read(steps[0])})", "elpd", "readings in 90 % bands"]
    caption = "Prediction of the held-out holds from the others, by the plain model and with each effect in turn."
    picture = Picture(drawn(waterfall(found)), falling, falling)
    return [Pictures([picture]), Table(header, lines, caption)]


def _candidates(found: ExperimentFindings) -> Table:
    """The probability of each effect to be missing, the most probable first."""
    inclusion = found.get("inclusion", {})
    probabilities = found["probabilities"].items()
    ranked = sorted(probabilities, key=lambda item: -item[1])
    lines = []
    for effect, p in ranked:
        if max(p, inclusion.get(effect, 0.0)) >= _LEAST:
            lines.append([spoken(effect), percent(p), percent(inclusion.get(effect))])
    caption = (
        "First column: probability of having the largest share of the misfit, given that something is missing. "
        "Second: probability of being missing at all, alone or beside others."
    )
    rest = found.get("remainder", {}).get("probability")
    if rest is not None:
        caption += f" Something that none of them explains remains with a probability of {percent(rest)}."
    return Table(["candidate", "largest share", "missing at all"], lines, caption)


def _p(found: ExperimentFindings) -> str:
    return "–" if found["p_global"] is None else p_in_words(found["p_global"], found["p_simulations"])


def _alone(found: ExperimentFindings) -> list[Block]:
    """A note that other effects look alike here, if they do: a headline that hides them would promise too much."""
    if found["verdict"] not in ("named", "ambiguous"):
        return []
    named = {*found["effects"], *found["set"], "unknown"}
    alike = [spoken(effect) for effect in found.get("group", []) if effect not in named]
    if not alike:
        return []
    return [Text(f"On this protocol hard to distinguish from {listed(alike)}.", strong=True)]


def _means(name: str) -> str:
    """A parameter's meaning in a line; of one of an effect, which it is."""
    if name in SYMBOLS:
        return SYMBOLS[name]
    effect, dot, _ = name.partition(".")
    return f"of the effect {spoken(effect)}" if dot else NONE


def _has_parameters(folder: Path) -> bool:
    """Whether an experiment's models are there to be compared."""
    return all((folder / model / "summary.json").is_file() for model in ("plain", "final"))


def _parameters(folder: Path, found: ExperimentFindings) -> list[Block]:
    """Every parameter before and after what was found joined the model."""
    if not _has_parameters(folder):
        return []
    plain = _parameters_of(folder / "plain")
    final = _parameters_of(folder / "final")
    if found["verdict"] == "nothing-missing":
        return [_plain_parameters(plain)]
    rows = []
    for name, after in final.items():
        if name.startswith(f"{Discrepancy.name}."):
            continue  # heights of a curve, a dozen of them
        unit = unit_or_dash(after["unit"])
        figures = [*median_and_interval(plain.get(name)), *median_and_interval(after)]
        rows.append([name, unit, *figures, _means(name)])
    header = ["parameter", "unit", "plain", "90 %", "with what was found", "90 %", "what it is"]
    caption = "Each parameter before and after, both on all holds."
    if len(rows) < len(final):
        caption += " The smooth curve that stands for what has no name is left out."
    return [Table(header, rows, caption + _of_several(folder / "final", found))]


def _of_several(final: Path, found: ExperimentFindings) -> str:
    """Of how many undecided models the parameters are those of the most probable one; nothing where it is the only."""
    models = members_of(final)
    if len(models) == 1:
        return ""
    with_effects = " and ".join(spoken(name) for name in found["accepted"]) or "none"
    share = percent(models[0][0])
    text = (
        f"After: those of the most probable of {len(models)} models that stay undecided, with {with_effects} ({share})"
    )
    return f" {text}; predict and pose use them all."


def _parameters_of(folder: Path) -> dict[str, Parameter]:
    """Parameters of one model of an experiment."""
    summary: SummaryJson = read_json(folder / "summary.json")
    return summary["parameters"]


def _plain_parameters(parameters: Mapping[str, Parameter]) -> Table:
    """The parameters of the plain model, to which nothing had to be added."""
    rows = []
    for name, parameter in parameters.items():
        rows.append([name, unit_or_dash(parameter["unit"]), *median_and_interval(parameter), _means(name)])
    header = ["parameter", "unit", "median", "90 % interval", "what it is"]
    return Table(header, rows, "Of the plain model: nothing had to be added.")


_BEFORE_AND_AFTER = (
    "Above: every reading with the curve of each model. Below: measured minus predicted readings. Shaded holds were "
    "kept out of a first fit to test the models; all holds are fitted here."
)


def _patterns(folder: Path, found: ExperimentFindings) -> list[Block]:
    """The picture of each pattern; what is to be seen in it stands under where the two disagree."""
    if not folder.is_dir():
        return []
    captions = {}
    for pattern in found.get("where", []):
        covariate = pattern["covariate"]
        captions[f"where-{covariate.replace(' ', '-')}"] = f"Residuals of the plain model by {covariate}."
    pictures = pictures_in(folder, captions)
    return [Pictures(pictures)] if pictures else []


def _held_out(found: ExperimentFindings) -> list[str]:
    """How much the error on held-out holds changes; nothing where it says nothing."""
    held = found.get("held_out") or {}
    plain = held.get("plain")
    final = held.get("final")
    if not plain or not final or found["verdict"] == "nothing-missing":
        return []
    if not held["holds"]:
        return ["No hold was held out: that needs three recorded holds of every test."]
    before = number(read_value(plain, "rmse"), 2)
    after = number(read_value(final, "rmse"), 2)
    goes = "grows" if error_grows(held) else "falls"
    holds = listed([str(hold) for hold in held["holds"]])
    unit = unit_read(plain)
    text = f"On the held-out holds {holds} the rms error {goes} from {before} to {after} {unit}"
    if found["verdict"] == "partial":
        text += " with a smooth discrepancy beside the named effects"
    flexible = held.get("flexible")
    if found.get("accepted") and flexible:
        reached = number(read_value(flexible, "rmse"), 2)
        text += f"; a smooth curve instead of a named effect reaches {reached} {unit}"
    return [f"{text}."]


def _sizes(found: ExperimentFindings) -> list[str]:
    """How large each effect is here, and which are those of other tests."""
    here = [_amplitude(effect, amplitude) for effect, amplitude in found.get("amplitudes", {}).items()]
    elsewhere = [f"{sentence}." for sentence in in_other_tests(found)]
    return here + elsewhere


def _amplitude(effect: str, amplitude: AmplitudeEstimate) -> str:
    size = quantity(*median_between(amplitude), amplitude["unit"])
    since = "" if amplitude.get("hold") is None else f", from hold {amplitude['hold']} on"
    return f"{spoken(effect)}: {size}{since}."
