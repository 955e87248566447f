"""The page of ``wirebayes fit``: each fit's readings, what they determine and what they do not."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wirebayes.answers.headline import USE, fit_in_a_sentence
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.summary import SummaryJson
from wirebayes.model.sample import Sample
from wirebayes.numeric.typing import Array
from wirebayes.prediction.predictive import PredictionRequest, draw_predictive
from wirebayes.report import figures
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
    as_sentence,
    before_the_answer,
    beside_the_answer,
    drawn_together,
    files_beside,
    number,
    seed_of_page,
    unit_text,
)
from wirebayes.report.glossary import SYMBOLS, meaning
from wirebayes.report.pictures.corner import corner
from wirebayes.report.pictures.curve import through_the_readings
from wirebayes.results.contraction import MOST, contraction
from wirebayes.results.parameters import unit_of
from wirebayes.results.read_back import Stored, load_with_priors
from wirebayes.sentences import counted, listed, middle_and_span
from wirebayes.wire.effect import Effect

_MOST_SENTENCES = 3  # at the head of a page; more hide its first picture
_DRAWS = 1000  # for bands in pictures: a 5 % quantile is then one between 3.6 % and 6.4 %
_FILES = (
    ("*/summary.json", "intervals, convergence and the model check as JSON"),
    ("*/posterior.nc", "all draws, opens with ArviZ"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def fit_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """One section for each experiment of each fit in the folder."""
    sections, effects, sentences = [], dict[str, Effect](), list[str]()
    for file in sorted(folder.glob("*/summary.json")):
        summary: SummaryJson = read_json(file)
        sentences.append(fit_in_a_sentence(summary))
        if configuration.get("own_effects"):
            sections.append(_of_summary(summary))
            continue
        for stored, prior in load_with_priors(file.parent):
            effects |= {effect.name: effect for effect in stored.sample.model.effects}
            sections.append(section(stored, prior, summary))
    lead = " ".join(sentences[:_MOST_SENTENCES])
    sections.append(files_beside(folder, _FILES))
    from_summaries = bool(configuration.get("own_effects"))  # without the table that explains each parameter
    sections.append(meaning(("hold", "90 % interval", "prior"), effects, effects, symbols=from_summaries))
    return Page("What the readings determine", lead, sections, seed_of_page(configuration))


def _of_summary(summary: SummaryJson) -> Section:
    """A fit with effects of the user's own, from its summary alone: a page never executes a user's code."""
    lines = [[name, *middle_and_span(s["q50"], s["q05"], s["q95"])] for name, s in summary["parameters"].items()]
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
    sample, draws = stored.sample, stored.draws
    sampled = [name for name in draws if name in prior and np.ptp(draws[name]) > 0]
    shrunk = {name: contraction(draws[name], prior[name]) for name in sampled}
    trusted = summary["converged"] and _passed(summary) is not False
    pictures = _pictures(stored, {name: draws[name] for name in sampled}, summary, trusted)
    blocks: list[Block] = _cautions(summary)
    if "curve" in pictures:
        blocks.append(Pictures([pictures["curve"]]))
    blocks.append(Text(_next(summary)))
    blocks.append(_parameters(draws, shrunk, sample))
    blocks.append(Columns([_measured(stored, summary), *_known(summary, shrunk, trusted)]))
    blocks.append(Pictures([pictures["measured"], pictures["residuals"]]))
    if "pairs" in pictures:
        blocks.append(Pictures([pictures["pairs"]]))
    blocks.append(_derived(summary))
    blocks.append(Pictures([pictures["ahead"]]))
    blocks.append(Text(_sampled(summary)))
    return Section(sample.name, blocks)


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
    sample, name = stored.sample, stored.sample.name
    weights = sample.protocol.control == "force"
    against = f"Displacement of {name} against weight." if weights else f"Tension of {name} against displacement."
    left = f"Measured minus predicted readings of {name}, hold after hold, inside the 90 % band."
    later = f"Creep of {name} from 10 s to a day: posterior, posterior with the prior at half weight, prior alone."
    ahead = summary["extrapolation"]
    # those that take longest come first, so that no core waits for one that began last
    figure_of: dict[str, Callable[[], Figure]] = {}
    if stored.likelihood == "chain":
        figure_of["curve"] = lambda: through_the_readings(stored, name)
    if len(sampled) > 1:
        figure_of["pairs"] = lambda: corner(sampled, sample.model.effects, sample.protocol.control)
    figure_of["residuals"] = lambda: _residuals(stored)
    figure_of["ahead"] = lambda: figures.creep_ahead(ahead, name)
    figure_of["measured"] = lambda: figures.measured(sample.protocol, sample.readings[..., 0], name)
    source = dict(zip(figure_of, drawn_together(list(figure_of.values())), strict=True))
    said = {
        "curve": (f"Readings of {name} with the fitted curve through them, hold after hold.", _CURVE, True),
        "measured": (against, _GREW if weights else _READ, False),
        "residuals": (left, _LEFT, False),
        "pairs": (f"Posterior of {name}, every pair of parameters.", _PAIRS, True),
        "ahead": (later, _continued(summary, trusted), False),
    }
    return {each: Picture(source[each], *said[each]) for each in source}


def _continued(summary: SummaryJson, trusted: bool) -> str:
    """What the picture of the creep that goes on says; how far that is stands with the numbers above it."""
    if trusted:
        return summary["extrapolation"]["sentence"]
    return "The model does not describe the readings, so that its creep later on may be another."


def _next(summary: SummaryJson) -> str:
    """What to do with this fit."""
    kinds = {notice["kind"] for notice in summary["warnings"]}
    if "model-check" in kinds:
        return "Next: wirebayes discover with the same file looks for what the model is missing."
    if "not-converged" in kinds:
        return "Next: settle the warnings above, then fit again; these numbers are not to be used."
    return USE


_CURVE = (
    "Above: every reading, and the curve that the model draws through them, with its 90 % band, given all readings. "
    "Below: what is left between reading and curve; nine in ten should lie in the band of the readings' own error."
)
_READ = "What was read at each displacement: blue when the hold begins, red later."
_GREW = "What was read under each weight: blue when the hold begins, red later."
_LEFT = (
    "Measured minus predicted readings. Where they lie outside the band, or show a pattern within it, the model misses "
    "something."
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
    if "model_check" not in summary:
        check = Text("The model was not checked against the readings: the check was left out.", strong=True)
    elif summary["model_check"]["passed"] is None:
        check = Text(summary["model_check"]["sentence"], strong=True)
    else:
        check = Text(summary["model_check"]["sentence"])
    said = "model-check" in [notice["kind"] for notice in summary["warnings"]]
    return [*before_the_answer(summary), *([] if said else [check]), *beside_the_answer(summary)]


def _sampled(summary: SummaryJson) -> str:
    effects = listed(summary["effects"]) if summary["effects"] else "none"
    state = "Converged" if summary["converged"] else "Not converged"
    return (
        f"{state} {summary['convergence'].removeprefix('not converged ')}. Likelihood {summary['likelihood']}, history "
        f"{summary['history']}, law {summary['elastic_law']}, effects {effects}; "
        f"{number(summary['likelihood_evaluations'])} likelihood evaluations."
    )


def _measured(stored: Stored, summary: SummaryJson) -> Points:
    ends = summary.get("hold_ends")
    warned = "hold-ends" in [notice["kind"] for notice in summary["warnings"]]
    protocol, read = stored.sample.protocol, stored.sample.readings[..., 0][stored.sample.protocol.mask]
    weights = protocol.control == "force"
    tension = protocol.setting[protocol.recorded] if weights else read
    holds = int(protocol.recorded.sum())
    unrecorded = len(protocol.recorded) - holds
    points = [
        f"{stored.sample.material}, {protocol.length_mm:g} mm.",
        f"{counted(holds, 'hold')}{f' and {unrecorded} not recorded' if unrecorded else ''}, "
        f"{counted(len(read), 'reading')}.",
        f"{'Weights' if weights else 'Tensions'} from {number(tension.min())} to {number(tension.max())} N.",
        f"The longest hold lasted {protocol.duration_s.max():g} s.",
        *([as_sentence(ends["sentence"])] if ends and not warned else []),
    ]
    return Points("What was measured", points)


def _known(summary: SummaryJson, shrunk: dict[str, float], trusted: bool) -> list[Points]:
    """What the readings determine and what they do not; only the model's own words where it is not to be trusted."""
    known: list[str] = []
    undetermined: list[str] = []
    for name, each in summary["identifiability"].items():
        (known if shrunk.get(name, 0.0) >= MOST else undetermined).append(each["sentence"])
    if not trusted:
        return [Points("What the readings would determine if the model were right", known + undetermined)]
    nothing = ["No parameter."]
    return [
        Points("What the readings determine", known or nothing),
        Points("What the prior still decides", undetermined or nothing),
    ]


def _unit(name: str, sample: Sample) -> str:
    return unit_text(unit_of(name, sample.model.effects, (sample.protocol.control,)))


def _parameters(draws: dict[str, Array], shrunk: dict[str, float], sample: Sample) -> Table:
    lines = []
    for name, values in draws.items():
        low, middle, high = np.quantile(values, [0.05, 0.5, 0.95])
        share = f"{100 * shrunk[name]:.0f} %" if name in shrunk else "–"
        unit = _unit(name, sample) or "–"
        lines.append([name, unit, *middle_and_span(middle, low, high), share, _means(name, sample.model.effects)])
    caption = (
        "The interval contains the parameter with a probability of 90 %, if the model is right. "
        "Contraction is the share of the prior's variance that the readings took away, of the logarithm where a "
        f"quantity is positive; from {100 * MOST:.0f} % on the readings determine a parameter."
    )
    return Table(["parameter", "unit", "median", "90 % interval", "contraction", "what it is"], lines, caption)


def _means(name: str, effects: tuple[Effect, ...]) -> str:
    """A parameter's meaning in a line."""
    sentences = {c: e.sentence.rstrip(".") for e in effects for c in e.columns()}
    return SYMBOLS.get(name) or sentences.get(name, "–")


def _derived(summary: SummaryJson) -> Table:
    derived = summary["derived"]
    rows = [
        ("creep after 2 min, mm", derived["creep_2min_mm"], "–"),
        ("creep after 1 h, mm", derived["creep_1h_mm"], "–"),
        ("creep after 1 day, mm", derived["creep_1day_mm"], "–"),
        ("final creep, mm", derived["final_creep_mm"], "grows without end"),
        ("half of it after, s", derived["median_creep_time_s"], "–"),
        ("stiffness there, N per unit strain", derived["stiffness_N"], "–"),
    ]
    lines = [
        [name, *middle_and_span(band["q50"], band["q05"], band["q95"])] if band else [name, otherwise, "–"]
        for name, band, otherwise in rows
    ]
    caption = (
        f"A fresh sample held at {derived['tension_N']:g} N, the tension at which one of the holds began. All fitted "
        "effects of the wire are included, those of the bench are not."
    )
    caption = f"{caption} {summary['extrapolation']['warning']}".strip()
    return Table(["quantity", "median", "90 % interval"], lines, caption)


def _residuals(stored: Stored) -> Any:
    protocol, readings = stored.sample.protocol, stored.sample.readings[..., 0]
    alone = stored.likelihood == "hold"
    first = readings[:, 0] if alone else np.full(len(readings), np.nan)
    request = PredictionRequest(protocol, 0 if alone else len(readings), protocol.recorded, first)
    rows = np.linspace(0, len(stored.theta) - 1, min(len(stored.theta), _DRAWS)).astype(int)
    replicates = draw_predictive(stored.problem, stored.theta[rows], stored.sample, request, np.random.default_rng(0))
    wanted = protocol.mask.copy()
    if alone:
        wanted[:, 0] = False
    band = np.quantile(replicates[wanted], [0.05, 0.5, 0.95], axis=1)
    number_of = np.broadcast_to(protocol.number[:, None], wanted.shape)[wanted]
    kind = stored.likelihood
    title = f"{stored.sample.name}, {figures.WORDS[kind]}"
    return figures.residual_figure(
        number_of, protocol.time_s[wanted], readings[wanted], band, title, figures.COLOURS[kind]
    )
