"""The page of ``wirebayes compare``: models side by side on readings they have not seen."""

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from wirebayes.answers.headline import comparison_in_words
from wirebayes.answers.terminal import options_of_base, options_of_best
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.comparison import ComparedModel, ComparedModels, ComparisonJson
from wirebayes.json_files.read_units import read_value, unit_read
from wirebayes.report.blocks import (
    Block,
    Configuration,
    Page,
    Pictures,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    pictures_in,
    seed_of_page,
)
from wirebayes.report.glossary import meaning
from wirebayes.sentences import spoken

_CAPTIONS = {
    "differences": "How much better (right) or worse (left) each model predicts left-out holds than the base, with two "
    "standard errors. Within the grey band the difference decides nothing.",
    "held-out-errors": "Typical error on the last holds, predicted from the first ones; farther left is better.",
    "held-out-free": "The held-out readings under the best model, predicted from earlier holds alone. Dots should lie "
    "in the bands as often as the bands say.",
    "held-out-given-first": "The same, each hold's first reading given.",
    "pit-free": "Whether the bands are right: the step should stay within the shaded region. On the left half, a step "
    "above the region means bands that are too narrow, one below it bands that are too wide.",
    "pit-given-first": "The same, each hold's first reading given.",
}
_FIRST = 2  # pictures before the table: how much better each model predicts, and how well
_MOST_SENTENCES = 3  # at the head of a page; more hide its first picture
_FILES = (
    ("comparison.json", "every number of this page, and every held-out reading with its predicted quantiles"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def compare_page(folder: Path, configuration: Configuration) -> Page:
    """One section an experiment, from ``comparison.json`` and the pictures beside it."""
    content: ComparisonJson = read_json(folder / "comparison.json")
    found = content["experiments"]
    sections = []
    sentences = []
    effects = []
    for name, table in found.items():
        sections.append(_section(folder, name, table))
        sentences.append(comparison_in_words(name, table))
        for row in table["models"]:
            effects += row["name"].split(" + ")
    lead = " ".join(sentences[:_MOST_SENTENCES])
    sections.append(files_beside(folder, _FILES))
    terms = ("hold", "held out", "rms", "elpd", "weight")
    sections.append(meaning(terms, effects))
    footer = seed_of_page(configuration)
    return Page("Models side by side", lead, sections, footer)


def _section(folder: Path, name: str, table: ComparedModels) -> Section:
    own = folder / name
    pictures = pictures_in(own, _CAPTIONS) if own.is_dir() else []
    first = pictures[:_FIRST]
    others = pictures[_FIRST:]
    scored = []
    failed = []
    for row in table["models"]:
        why = row.get("failed")
        if why is None:
            scored.append(row)
        else:
            failed.append([spoken(row["name"]), str(why)])
    blocks: list[Block] = before_the_answer(table)
    if first:
        blocks.append(Pictures(first))
    if scored:
        blocks.append(Text(_next(table)))
    blocks += beside_the_answer(table)
    blocks.append(_scores(scored, table["base"]))
    if others:
        blocks.append(Pictures(others))
    if failed:
        blocks.append(Table(["model", "why it was not scored"], failed))
    return Section(name, blocks)


def _next(table: ComparedModels) -> str:
    """What to do with the best model."""
    options = options_of_best(table)
    again = ""
    if options is not None:
        again = f"wirebayes fit {options}".rstrip() + " or "
    discover = f"wirebayes discover{options_of_base(table)}"
    return f"Next: {again}{discover}, with the same file; discover names what is missing."


def _scores(scored: Sequence[ComparedModel], base: str) -> Table:
    """How well each model predicts, in words and figures."""
    held_out = [row["held_out"]["given_first"] for row in scored if row["held_out"]]
    unit = unit_read(held_out[0] or {}) if held_out else "N"
    header = ["model", "weight", f"elpd − {base}", "standard error"]
    header += [f"held out: rms, {unit}", f"given first reading, {unit}", "meaning"]
    lines = [_line(row) for row in scored]
    caption = "Best first. The weight is the model's share in the mixture with the best predictions."
    return Table(header, lines, caption)


def _line(row: ComparedModel) -> list[str]:
    """One model's row of the table."""
    difference = row["difference"]
    elpd, error = (difference["elpd"], difference["se"]) if difference else (None, None)
    held = row["held_out"]
    free, given = (held["free"], held["given_first"]) if held else (None, None)
    return [
        spoken(row["name"]),
        _share(row.get("weight")),
        number(elpd, 2),
        number(error, 2),
        _rms(free),
        _rms(given),
        _plain(row.get("meaning") or ""),
    ]


def _rms(scores: Any) -> str:
    return number(read_value(scores, "rmse") if scores else None, 2)


def _share(weight: float | None) -> str:
    """A share of the mixture; what rounds to nothing is nothing."""
    rounded = None if weight is None else round(weight, 3)
    return number(rounded, 2)


def _plain(meaning: str) -> str:
    """What follows the figures, which have columns of their own."""
    return re.split("[:;] ", meaning, maxsplit=1)[-1]
