"""The page of ``wirebayes compare``: models side by side on readings they have not seen."""

import re
from pathlib import Path
from typing import Any

from wirebayes.answers.headline import comparison_in_words
from wirebayes.answers.terminal import options_of_best
from wirebayes.io.run_folder import read_json
from wirebayes.json_files.comparison import ComparedModels, ComparisonJson
from wirebayes.json_files.read_units import read_value, unit_read
from wirebayes.report.blocks import (
    Block,
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


def compare_page(folder: Path, configuration: dict[str, Any]) -> Page:
    """One section an experiment, from ``comparison.json`` and the pictures beside it."""
    content: ComparisonJson = read_json(folder / "comparison.json")
    found = content["experiments"]
    sections = [_section(folder, name, table) for name, table in found.items()]
    lead = " ".join(comparison_in_words(name, table) for name, table in list(found.items())[:_MOST_SENTENCES])
    sections.append(files_beside(folder, _FILES))
    effects = [effect for table in found.values() for row in table["models"] for effect in row["name"].split(" + ")]
    sections.append(meaning(("hold", "held out", "rms", "elpd", "weight"), effects))
    return Page("Models side by side", lead, sections, seed_of_page(configuration))


def _section(folder: Path, name: str, table: ComparedModels) -> Section:
    rows = table["models"]
    good = [r for r in rows if r.get("failed") is None]
    blocks: list[Block] = before_the_answer(table)
    pictures = pictures_in(folder / name, _CAPTIONS) if (folder / name).is_dir() else []
    blocks += [Pictures(pictures[:_FIRST])] if pictures else []
    if good:
        options = options_of_best(table)
        again = "" if options is None else f"{f'wirebayes fit FILE.toml {options}'.rstrip()}, or "
        blocks.append(Text(f"Next: {again}wirebayes discover FILE.toml, which names what is missing."))
    blocks += beside_the_answer(table)
    scored = [r["held_out"]["given_first"] for r in good if r["held_out"]]
    unit = unit_read(scored[0] or {}) if scored else "N"
    header = ["model", "weight", f"elpd − {table['base']}", "standard error", f"held out: rms, {unit}"]
    header += [f"given first reading, {unit}", "meaning"]
    lines = []
    for r in good:
        difference, held = r["difference"], r["held_out"]
        both = (held["free"], held["given_first"]) if held else (None, None)
        errors = (number(s and read_value(s, "rmse"), 2) for s in both)
        scores = (number(v, 2) for v in ((difference["elpd"], difference["se"]) if difference else (None, None)))
        lines.append([spoken(r["name"]), _share(r.get("weight")), *scores, *errors, _plain(r.get("meaning") or "")])
    blocks.append(
        Table(header, lines, "Best first. The weight is the model's share in the mixture with the best predictions.")
    )
    blocks += [Pictures(pictures[_FIRST:])] if pictures[_FIRST:] else []
    failed = [[spoken(r["name"]), str(r["failed"])] for r in rows if r.get("failed") is not None]
    if failed:
        blocks.append(Table(["model", "why it was not scored"], failed))
    return Section(name, blocks)


def _share(weight: float | None) -> str:
    """A share of the mixture; what rounds to nothing is nothing."""
    return number(weight if weight is None else round(weight, 3), 2)


def _plain(meaning: str) -> str:
    """What follows the figures, which have columns of their own."""
    return re.split("[:;] ", meaning, maxsplit=1)[-1]
