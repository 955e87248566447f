"""The page of ``wirebayes discover``: what is missing in the model, how sure that is, and what to measure next."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from wirebayes.answers.headline import USE, findings_in_a_sentence
from wirebayes.answers.terminal import in_other_tests
from wirebayes.effects.unknown import Discrepancy
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.discovery import AmplitudeEstimate, DiscoveryJson, ExperimentFindings
from wirebayes.json_files.read_units import error_grows, read_value, unit_read
from wirebayes.json_files.summary import Parameter, SummaryJson
from wirebayes.report.blocks import (
    Block,
    Columns,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    drawn,
    embedded,
    files_beside,
    number,
    picture_file,
    pictures_in,
    seed_of_page,
    unit_text,
)
from wirebayes.report.glossary import SYMBOLS, meaning
from wirebayes.report.pictures.discover import waterfall
from wirebayes.sentences import listed, middle_and_span, p_in_words, quantity, said_beside, spoken


def discover_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """One section an experiment, from ``discovery.json`` and the pictures beside it."""
    content: DiscoveryJson = read_json(folder / "discovery.json")
    found = content["experiments"]
    overview = Table(
        ["experiment", "verdict", "effects", "p of the plain model", "gap closed"],
        [
            [name, _spoken(v), listed([spoken(e) for e in v["effects"]]), _p(v), _gap_closed(v)]
            for name, v in found.items()
        ],
    )
    sections = [_section(folder, name, v) for name, v in found.items()]
    if len(found) > 1:
        sections.insert(0, Section("Summary", [overview]))
    sentences = [findings_in_a_sentence(name, v) for name, v in found.items()]
    lead = " ".join(sentences[:_MOST_SENTENCES])
    named = [e for v in found.values() for e in (*v["effects"], *v["probabilities"], *v["power"], *v.get("group", []))]
    sections.append(files_beside(folder, _FILES))
    explained = all(_has_parameters(folder / name) for name in found)
    sections.append(meaning(_TERMS, named, symbols=not explained))
    return Page("What the model is missing", lead, sections, seed_of_page(configuration))


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
    "A name is that of the nearest effect in the catalogue: an effect that the catalogue lacks gets it too, where it "
    "looks alike in this test."
)
_TERMS = ("hold", "90 % interval", "p", "held out", "rms", "elpd", "in the 90 % band", "gap closed")


def _section(folder: Path, name: str, v: ExperimentFindings) -> Section:
    hidden = [sentence.partition(": ")[::2] for sentence in v.get("not_identifiable", [])]
    blocks: list[Block] = [*before_the_answer(v), *_alone(v), *beside_the_answer(v)]
    blocks += _curves(folder, name)
    if v["verdict"] in ("named", "nothing-missing"):
        blocks.append(Text(USE))
    if v.get("next_measurement"):
        blocks.append(Text(f"Measure next: {v['next_measurement']}"))
    blocks += _parameters(folder / name, v)
    blocks.append(_within_a_minute(v, [what for what, _ in hidden]))
    if (folder / name).is_dir() and (others := pictures_in(folder / name, _patterns(v))):
        blocks.append(Pictures(others))
    if len(v.get("steps", [])) > 1 and read_value(v["steps"][0], "rmse") is not None:
        blocks += _steps(v)
    if v.get("probabilities"):
        blocks.append(_candidates(v))
    if v.get("power"):
        lines = [[spoken(e), number(p["amplitude_80"]), unit_text(p["unit"]) or "–"] for e, p in v["power"].items()]
        caption = "The smallest size of each effect that four of five such tests would show; a dash: none, or no unit."
        blocks.append(Table(["effect", "size", "unit"], lines, caption))
    if hidden:
        caption = "What this test cannot show: the readings would be nearly the same with or without it."
        blocks.append(Table(["what", "why"], [[spoken(what), why] for what, why in hidden], caption))
    return Section(name, blocks)


def _curves(folder: Path, name: str) -> list[Block]:
    file = picture_file(folder, name)
    if file is None:
        return []
    alt = f"Readings of {name} with each model's curve through them, and what it does not explain, hold after hold."
    return [Pictures([Picture(embedded(file), alt, _BEFORE_AND_AFTER, wide=True)])]


def _within_a_minute(v: ExperimentFindings, hidden: list[str]) -> Columns:
    """Where model and measurement disagree, what is known, and what is not."""
    beside = [f"{line[0].upper()}{line[1:]}." for line in said_beside(v)]
    known = [point for point in (*beside, _held_out(v), *_sizes(v)) if point]
    unknown = [_NEAREST] if v.get("effects") else []
    unknown += [f"This test cannot show {listed([spoken(what) for what in hidden])}."] if hidden else []
    return Columns(
        [
            Points("Where model and measurement disagree", _disagreements(v)),
            Points("What is known", known or ["Nothing had to be added to the plain model."]),
            Points("What is not known", unknown or ["Nothing to report."]),
        ]
    )


def _disagreements(v: ExperimentFindings) -> list[str]:
    """The residual patterns that chance alone would rarely make, and what they amount to where nothing is missing."""
    patterns = [w["sentence"] for w in v.get("where", []) if w["p"] <= _SPEAKS]
    if not patterns:
        return ["No pattern stands out."]
    if v["verdict"] == "nothing-missing":
        patterns.append(f"One pattern of several may stand out by chance; the global test decides ({_p(v)}).")
    return patterns


def _steps(v: ExperimentFindings) -> list[Block]:
    """How well held-out holds are predicted, by the plain model and with each effect in turn."""
    steps = v["steps"]
    falling = (
        "Rms error on held-out holds: of the plain model, by how much each named effect reduces it in turn, and "
        "what is left above the noise."
    )
    names = [spoken(steps[0]["model"]), *(f"+ {spoken(step['model'])}" for step in steps[1:])]
    scores = [[number(read_value(s, "rmse")), number(s["elpd"]), _percent(s["coverage_90"])] for s in steps]
    header = ["model", f"rms error ({unit_read(steps[0])})", "elpd", "readings in 90 % bands"]
    lines = [[name, *score] for name, score in zip(names, scores, strict=True)]
    caption = "Prediction of the held-out holds from the others, by the plain model and with each effect in turn."
    return [Pictures([Picture(drawn(waterfall(v)), falling, falling)]), Table(header, lines, caption)]


def _candidates(v: ExperimentFindings) -> Table:
    """The probability of each effect to be missing, the most probable first."""
    inclusion = v.get("inclusion", {})
    ranked = sorted(v["probabilities"].items(), key=lambda item: -item[1])
    lines = []
    for effect, p in ranked:
        if max(p, inclusion.get(effect, 0.0)) >= _LEAST:
            included = _probability(inclusion[effect]) if effect in inclusion else "–"
            lines.append([spoken(effect), _probability(p), included])
    caption = (
        "First column: probability of having the largest share of the misfit, given that something is missing. "
        "Second: probability of being missing at all, alone or beside others."
    )
    rest = v.get("remainder", {}).get("probability")
    if rest is not None:
        caption += f" Something that none of them explains remains with a probability of {_probability(rest)}."
    return Table(["candidate", "largest share", "missing at all"], lines, caption)


def _probability(p: float) -> str:
    return f"{100 * p:.0f} %"


def _percent(share: float | None) -> str:
    return "–" if share is None else f"{100 * share:.0f} %"


def _p(v: ExperimentFindings) -> str:
    return "–" if v["p_global"] is None else p_in_words(v["p_global"], v["p_simulations"])


def _alone(v: ExperimentFindings) -> list[Block]:
    """That other effects look alike here, if so: a headline that hides them would promise too much."""
    like = _alike(v) if v["verdict"] in ("named", "ambiguous") else ""
    return [Text(f"{like[2:3].upper()}{like[3:]}.", strong=True)] if like else []


def _means(name: str) -> str:
    """A parameter's meaning in a line; of one of an effect, which it is."""
    effect, _, _ = name.partition(".")
    return SYMBOLS.get(name) or (f"of the effect {spoken(effect)}" if effect != name else "–")


def _has_parameters(folder: Path) -> bool:
    """Whether an experiment's models are there to be compared."""
    return all((folder / model / "summary.json").is_file() for model in ("plain", "final"))


def _parameters(folder: Path, v: ExperimentFindings) -> list[Block]:
    """Every parameter before and after what was found joined the model."""
    if not _has_parameters(folder):
        return []
    summaries: list[SummaryJson] = [read_json(folder / model / "summary.json") for model in ("plain", "final")]
    plain, final = (summary["parameters"] for summary in summaries)
    if v["verdict"] == "nothing-missing":
        return [_plain_parameters(plain)]
    rows = []
    for name, after in final.items():
        if name.startswith(f"{Discrepancy.name}."):
            continue  # heights of a curve, a dozen of them
        before = plain.get(name)
        rows.append(
            [
                name,
                unit_text(after["unit"]) or "–",
                *(middle_and_span(before["q50"], before["q05"], before["q95"]) if before else ["–", "–"]),
                *middle_and_span(after["q50"], after["q05"], after["q95"]),
                _means(name),
            ]
        )
    header = ["parameter", "unit", "plain", "90 %", "with what was found", "90 %", "what it is"]
    curve = " The smooth curve that stands for what has no name is left out." if len(rows) < len(final) else ""
    return [Table(header, rows, f"Each parameter before and after, both on all holds.{curve}")]


def _plain_parameters(parameters: Mapping[str, Parameter]) -> Table:
    """Those of the plain model, to which nothing had to be added."""
    rows = [
        [name, unit_text(p["unit"]) or "–", *middle_and_span(p["q50"], p["q05"], p["q95"]), _means(name)]
        for name, p in parameters.items()
    ]
    header = ["parameter", "unit", "median", "90 % interval", "what it is"]
    return Table(header, rows, "Of the plain model: nothing had to be added.")


def _spoken(v: ExperimentFindings) -> str:
    return str(v["verdict"]).replace("-", " ")


_BEFORE_AND_AFTER = (
    "Above: every reading with the curve of each model. Below: measured minus predicted readings. Shaded holds were "
    "kept out of a first fit to test the models; all holds are fitted here."
)


def _patterns(v: ExperimentFindings) -> dict[str, str]:
    """What the picture of each pattern shows; what is to be seen in it stands under where the two disagree."""
    return {
        f"where-{w['covariate'].replace(' ', '-')}": f"Residuals of the plain model by {w['covariate']}."
        for w in v.get("where", [])
    }


def _alike(v: ExperimentFindings) -> str:
    """The near-equivalents of what is named: a headline that hides them would promise too much."""
    like = [spoken(e) for e in v.get("group", []) if e not in (*v["effects"], *v["set"], "unknown")]
    return f"; on this protocol hard to distinguish from {listed(like)}" if like else ""


def _gap_closed(v: ExperimentFindings) -> str:
    closed = (v.get("held_out") or {}).get("gap_closed")
    return "–" if closed is None else f"{100 * closed:.0f} %"


def _held_out(v: ExperimentFindings) -> str:
    held = v.get("held_out") or {}
    if not held.get("plain") or not held.get("final") or v["verdict"] == "nothing-missing":
        return ""
    if not held["holds"]:
        return "No hold was held out: that needs three recorded holds of every test."
    plain, final = (read_value(held[model], "rmse") for model in ("plain", "final"))
    goes = "grows" if error_grows(held) else "falls"
    holds, unit = listed([str(h) for h in held["holds"]]), unit_read(held["plain"])
    text = f"On the held-out holds {holds} the rms error {goes} from {number(plain, 2)} to {number(final, 2)} {unit}"
    if v["verdict"] == "partial":
        text += " with a smooth discrepancy beside the named effects"
    if v.get("accepted") and (flexible := held.get("flexible")):
        text += f"; a smooth curve instead of a named effect reaches {number(read_value(flexible, 'rmse'), 2)}"
    return text + "."


def _sizes(v: ExperimentFindings) -> list[str]:
    """How large each effect is here, and which are those of other tests."""
    here = [_amplitude(effect, a) for effect, a in v.get("amplitudes", {}).items()]
    return here + [f"{sentence}." for sentence in in_other_tests(v)]


def _amplitude(effect: str, a: AmplitudeEstimate) -> str:
    at = "" if a.get("hold") is None else f", from hold {a['hold']} on"
    return f"{spoken(effect)}: {quantity(a['mean'], a['q05'], a['q95'], a['unit'])}{at}."
