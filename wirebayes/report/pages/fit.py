"""The page of ``wirebayes fit``: each fit's readings, what they determine and what they do not."""

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from wirebayes.answers.headline import PREDICT, UNUSABLE, USE, fit_in_a_sentence
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.summary import SummaryJson
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array
from wirebayes.prediction.predictive import PredictionRequest, draw_predictive
from wirebayes.report import figures
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
    as_sentence,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    seed_of_page,
)
from wirebayes.report.cells import NONE, median_and_interval, percent, unit_or_dash
from wirebayes.report.drawn import drawn_together
from wirebayes.report.glossary import SYMBOLS, meaning
from wirebayes.report.pictures.corner import corner
from wirebayes.report.pictures.curve import through_the_readings
from wirebayes.result_warnings import warns_of
from wirebayes.results.contraction import MOST, contraction
from wirebayes.results.parameters import unit_of
from wirebayes.results.read_back import Stored, load_with_priors
from wirebayes.sentences import counted, lasting, listed, middle_and_span
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.effect import Effect
from wirebayes.wire.protocol import Control

_MOST_SENTENCES = 3  # at the head of a page; more hide its first picture
_DRAWS = 1000  # for bands in pictures: a 5 % quantile is then one between 3.6 % and 6.4 %
_FILES = (
    ("*/summary.json", "intervals, convergence and the model check as JSON"),
    ("*/posterior.nc", "all draws, opens with ArviZ"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def fit_page(folder: Path, configuration: Configuration) -> Page:
    """One section for each experiment of each fit in the folder."""
    sections = []
    sentences = []
    effects: dict[str, Effect] = {}
    from_summaries = bool(configuration.get("own_effects"))  # without the table that explains each parameter
    for file in sorted(folder.glob("*/summary.json")):
        summary: SummaryJson = read_json(file)
        sentences.append(fit_in_a_sentence(summary))
        if from_summaries:
            sections.append(_of_summary(summary))
            continue
        loaded = load_with_priors(file.parent)
        for stored, prior in loaded:
            effects |= {effect.name: effect for effect in stored.sample.model.effects}
            sections.append(section(stored, prior, summary))
    lead = " ".join(sentences[:_MOST_SENTENCES])
    sections.append(files_beside(folder, _FILES))
    terms = ("hold", "90 % interval", "prior")
    sections.append(meaning(terms, effects, effects, symbols=from_summaries))
    footer = seed_of_page(configuration)
    return Page("What the readings determine", lead, sections, footer)


def _of_summary(summary: SummaryJson) -> Section:
    """A fit with effects of the user's own, from its summary alone: a page never executes a user's code."""
    lines = [[name, *median_and_interval(parameter)] for name, parameter in summary["parameters"].items()]
    words = Text("Fitted with effects from a file of the user's own, so this section shows summary.json alone.")
    table = Table(["parameter", "median", "90 % interval"], lines)
    blocks = [*_cautions(summary), words, table, _derived(summary), Text(_sampled(summary))]
    return Section(summary["experiment"], blocks)


def section(stored: Stored, prior: dict[str, Array], summary: SummaryJson) -> Section:
    """Readings, verdict, intervals and residuals of one experiment.

    Parameters
    ----------
    stored : Stored
        The posterior of the experiment.
    prior : dict of name to (m,) array
        Draws of the prior.
    summary : dict
        The fit's ``summary.json``.
    """
    draws = stored.draws
    sampled = {name: values for name, values in draws.items() if name in prior and np.ptp(values) > 0}
    judged = summary["identifiability"]
    shrunk = {
        name: judged[name]["contraction"] if name in judged else contraction(values, prior[name])
        for name, values in sampled.items()
    }
    trusted = summary["converged"] and _passed(summary) is not False
    pictures = _pictures(stored, sampled, summary, trusted)
    known = Columns([_measured(stored, summary), *_known(summary, shrunk, trusted)])
    blocks: list[Block] = list(_cautions(summary))
    blocks += _shown(pictures, "curve")
    blocks.append(Text(_next(summary)))
    blocks.append(_parameters(draws, shrunk, stored.sample))
    blocks.append(known)
    blocks += _shown(pictures, "measured", "residuals")
    blocks += _shown(pictures, "pairs")
    blocks.append(_derived(summary))
    blocks += _shown(pictures, "ahead")
    blocks.append(Text(_sampled(summary)))
    return Section(stored.sample.name, blocks)


def _shown(pictures: Mapping[str, Picture], *names: str) -> list[Block]:
    """Some of the pictures side by side, those that there are."""
    there = [pictures[name] for name in names if name in pictures]
    return [Pictures(there)] if there else []


def _pictures(stored: Stored, sampled: dict[str, Array], summary: SummaryJson, trusted: bool) -> dict[str, Picture]:
    """All pictures of an experiment by name; no curve of holds by themselves, no pairs of a single parameter.

    Parameters
    ----------
    stored : Stored
    sampled : dict of name to (n,) array
        Draws of the parameters that vary.
    summary : dict
        The fit's ``summary.json``.
    trusted : bool
        Whether nothing speaks against the fit.
    """
    figure_of = _figures(stored, sampled, summary)
    sources = drawn_together(list(figure_of.values()))
    texts = _texts(stored.sample, summary, trusted)
    pictures = {}
    for each, source in zip(figure_of, sources, strict=True):
        alt, caption = texts[each]
        pictures[each] = Picture(source, alt, caption, wide=each in _WIDE)
    return pictures


def _figures(stored: Stored, sampled: dict[str, Array], summary: SummaryJson) -> dict[str, Callable[[], Figure]]:
    """What makes each picture; those that take longest come first, so that no core waits for one that began last."""
    sample = stored.sample
    figure_of: dict[str, Callable[[], Figure]] = {}
    if stored.likelihood == "chain":
        figure_of["curve"] = lambda: through_the_readings(stored, sample.name)
    if len(sampled) > 1:
        figure_of["pairs"] = lambda: corner(sampled, sample.model.effects, sample.protocol.control)
    figure_of["residuals"] = lambda: _residuals(stored)
    figure_of["ahead"] = lambda: figures.creep_ahead(summary["extrapolation"], sample.name)
    figure_of["measured"] = lambda: figures.measured(sample.protocol, sample.readings[..., 0], sample.name)
    return figure_of


def _texts(sample: Sample, summary: SummaryJson, trusted: bool) -> dict[str, tuple[str, str]]:
    """Each picture in words, and its caption."""
    name = sample.name
    if sample.protocol.control == "force":
        measured = f"Displacement of {name} against weight.", _GREW
    else:
        measured = f"Tension of {name} against displacement.", _READ
    left = f"Measured minus predicted readings of {name}, hold after hold, with their 90 % band."
    later = f"Creep of {name} from 10 s to a day: posterior, posterior with the prior at half weight, prior alone."
    return {
        "curve": (f"Readings of {name} with the fitted curve through them, hold after hold.", _CURVE),
        "measured": measured,
        "residuals": (left, _LEFT),
        "pairs": (f"Posterior of {name}, every pair of parameters.", _PAIRS),
        "ahead": (later, _continued(summary, trusted)),
    }


_WIDE = ("curve", "pairs")


def _continued(summary: SummaryJson, trusted: bool) -> str:
    """What the picture of the creep that goes on says; how far that is stands with the numbers above it."""
    if trusted:
        return summary["extrapolation"]["sentence"]
    return "The model does not describe the readings, so the wire's later creep may differ from this."


def _next(summary: SummaryJson) -> str:
    """What to do with this fit."""
    if warns_of(summary, "model-check"):
        return "Next: wirebayes discover with the same file looks for what the model is missing."
    if warns_of(summary, "not-converged"):
        return f"Next: {UNUSABLE}."
    return PREDICT if summary["likelihood"] == "hold" else USE  # a robot needs k1, which is not determined there


_CURVE = (
    "Above: every reading, and the curve that the model draws through them, with its 90 % band, given all readings. "
    "Below: what is left between reading and curve; nine in ten should lie in the band of the readings' own error. The "
    "curve has the error of each setting in it, and may pass through the readings of a model that is wrong."
)
_READ = "What was read at each displacement: blue when the hold begins, red later."
_GREW = "What was read under each weight: blue when the hold begins, red later."
_LEFT = (
    "Measured minus predicted readings, each setting as it was stated. Where they lie outside the band, or show a "
    "pattern within it, the model misses something."
)
_PAIRS = (
    "Every pair of parameters: half of the draws lie in the dark region, 90 % in the light one. A narrow ridge means "
    "that the readings determine a combination of the two better than either; parameters over several powers of "
    "ten have logarithmic axes."
)


def _passed(summary: SummaryJson) -> bool | None:
    """The result of the model check; None where it was left out."""
    return summary["model_check"]["passed"] if "model_check" in summary else None


def _cautions(summary: SummaryJson) -> list[Block]:
    """What a reader must know before anything else."""
    blocks = before_the_answer(summary)
    if not warns_of(summary, "model-check"):
        blocks.append(_check(summary))
    return blocks + beside_the_answer(summary)


def _check(summary: SummaryJson) -> Text:
    """What the model check says; what was not checked stands out."""
    if "model_check" not in summary:
        return Text("The model was not checked against the readings: the check was left out.", strong=True)
    check = summary["model_check"]
    return Text(check["sentence"], strong=check["passed"] is None)


def _sampled(summary: SummaryJson) -> str:
    effects = listed(summary["effects"]) if summary["effects"] else "none"
    state = "Converged" if summary["converged"] else "Not converged"
    return (
        f"{state} {summary['convergence'].removeprefix('not converged ')}. Likelihood {summary['likelihood']}, history "
        f"{summary['history']}, law {summary['elastic_law']}, effects {effects}; "
        f"{number(summary['likelihood_evaluations'])} likelihood evaluations."
    )


def _measured(stored: Stored, summary: SummaryJson) -> Points:
    sample = stored.sample
    protocol = sample.protocol
    read = sample.readings[..., 0][protocol.mask]
    pulled = "Tensions"
    tension = read
    if protocol.control == "force":
        pulled = "Weights"
        tension = protocol.setting[protocol.recorded]
    recorded = int(protocol.recorded.sum())
    unrecorded = len(protocol.recorded) - recorded
    holds = counted(recorded, "hold")
    if unrecorded:
        holds += f" and {unrecorded} not recorded"
    readings = counted(len(read), "reading")
    points = [
        f"{sample.material}, {protocol.length_mm:g} mm.",
        f"{holds}, {readings}.",
        f"{pulled} from {number(tension.min())} to {number(tension.max())} N.",
        f"The longest hold lasted {lasting(float(protocol.duration_s.max()))}.",
    ]
    ends = summary.get("hold_ends")
    if ends and not warns_of(summary, "hold-ends"):
        points.append(as_sentence(ends["sentence"]))
    return Points("What was measured", points)


def _known(summary: SummaryJson, shrunk: dict[str, float], trusted: bool) -> list[Points]:
    """What the readings determine and what they do not; only the model's own words where it is not to be trusted."""
    known: list[str] = []
    undetermined: list[str] = []
    for name, each in summary["identifiability"].items():
        sentences = known if shrunk.get(name, 0.0) >= MOST else undetermined
        sentences.append(each["sentence"])
    if not trusted:
        return [Points("What the readings would determine if the model were right", known + undetermined)]
    nothing = ["No parameter."]
    return [
        Points("What the readings determine", known or nothing),
        Points("What the prior still decides", undetermined or nothing),
    ]


def _parameters(draws: dict[str, Array], shrunk: dict[str, float], sample: Sample) -> Table:
    effects = sample.model.effects
    control = sample.protocol.control
    lines = []
    for name, values in draws.items():
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        interval = middle_and_span(middle, low, high)
        unit = unit_or_dash(unit_of(name, effects, (control,)))
        share = percent(shrunk.get(name))
        lines.append([name, unit, *interval, share, _means(name, effects, control)])
    caption = (
        "The interval contains the parameter with a probability of 90 %, if the model is right. "
        "Contraction is the share of the prior's variance that the readings took away (of its logarithm, for a "
        f"positive parameter); from {100 * MOST:.0f} % on the readings determine a parameter."
    )
    header = ["parameter", "unit", "median", "90 % interval", "contraction", "what it is"]
    return Table(header, lines, caption)


def _means(name: str, effects: tuple[Effect, ...], control: Control) -> str:
    """A parameter's meaning in a line."""
    for effect in reversed(effects):
        if name in effect.columns():
            return SYMBOLS.get(name) or effect.sentence_under(control).rstrip(".")
    return SYMBOLS.get(name, NONE)


def _derived(summary: SummaryJson) -> Table:
    derived = summary["derived"]
    final_creep = derived["final_creep_mm"]
    lines = [
        ["creep after 2 min, mm", *median_and_interval(derived["creep_2min_mm"])],
        ["creep after 1 h, mm", *median_and_interval(derived["creep_1h_mm"])],
        ["creep after 1 day, mm", *median_and_interval(derived["creep_1day_mm"])],
        ["final creep, mm", *(median_and_interval(final_creep) if final_creep else ["grows without end", NONE])],
        ["half of it after, s", *median_and_interval(derived["median_creep_time_s"])],
        ["stiffness there, N per unit strain", *median_and_interval(derived["stiffness_N"])],
    ]
    length = derived.get("length_mm")
    sample = "A fresh sample" if length is None else f"A fresh sample of {number(length)} mm"
    caption = (
        f"{sample} held at {derived['tension_N']:g} N, the tension at which one of the holds began. All fitted "
        "effects of the wire are included, those of the bench are not."
    )
    caption = f"{caption} {summary['extrapolation']['warning']}".strip()
    return Table(["quantity", "median", "90 % interval"], lines, caption)


def _residuals(stored: Stored) -> Figure:
    sample = stored.sample
    kind = stored.likelihood
    protocol = sample.protocol
    readings = sample.readings[..., 0]
    wanted = protocol.mask.copy()
    if kind == "hold":
        wanted[:, 0] = False
    replicates = _replicates(stored)[wanted]
    band = np.quantile(replicates, [0.05, 0.5, 0.95], axis=1)
    numbers = np.broadcast_to(protocol.number[:, None], wanted.shape)
    hold = numbers[wanted]
    time_s = protocol.time_s[wanted]
    measured = readings[wanted]
    title = f"{sample.name}, {figures.WORDS[kind]}"
    colour = figures.COLOURS[kind]
    unit = READ_UNIT[protocol.control]
    return figures.residual_figure(hold, time_s, measured, band, title, colour, unit=unit)


def _replicates(stored: Stored) -> Array:
    """Readings (H, R, n) of the same holds once more, each given its first reading where holds stand by themselves."""
    protocol = stored.sample.protocol
    first = stored.sample.readings[:, 0, 0]
    if stored.likelihood == "hold":
        request = PredictionRequest(protocol, 0, protocol.recorded, first)
    else:
        request = PredictionRequest(protocol, len(first), protocol.recorded, np.full(len(first), np.nan))
    draws = len(stored.theta)
    rows = np.linspace(0, draws - 1, min(draws, _DRAWS)).astype(int)
    rng = np.random.default_rng(0)
    return draw_predictive(stored.problem, stored.theta[rows], stored.sample, request, rng)
