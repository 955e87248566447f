"""The table of targets over several runs together, as the docs include it.

    python -m analyses.hidden_effects.pooled out/clean/scores.json out/singles/scores.json > table.inc
    python -m analyses.hidden_effects.pooled out/singles/scores.json --stated > stated.inc

What is found has its 90 % interval; a missed row is bold. The last column counts only cases of which a refit of the
plain model, whose noise is not known, leaves most to be seen. With --stated: the probabilities that were stated, in
five bins, and how often what they were of was there.
"""

import json
from pathlib import Path
from typing import Any

from analyses.options import study_options

from . import stated
from .rates import Row
from .target import Target
from .targets import targets

SIGNS = {">= ": "≥ ", "<= ": "≤ ", "delta ": "δ = "}


def cell(row: Target, bold: bool = False) -> str:
    """What was found, as a share or, where no share is wanted, as a number."""
    found = row["found"]
    assert found
    share, digits = ("%", 0) if "%" in row["wanted"] else ("", 3)
    scale = 100.0 if share else 1.0
    if found["value"] < 0.1 and share:
        digits = 1
    value, low, high = (f"{scale * found[key]:.{digits}f}".replace("-", "−") for key in ("value", "low", "high"))
    text = f"{value}{' %' if share else ''}"
    text = f"**{text}**" if bold else text
    return text if low == high else f"{text} [{low}, {high}] of {found['n']}"


def signed(text: str) -> str:
    """With signs for what the targets write in letters."""
    for plain, sign in SIGNS.items():
        text = text.replace(plain, sign)
    return text


def asked_rows(doc: str | None, flag: str, text: str) -> tuple[list[Row], bool]:
    """Rows of all scores that the command line names, and whether it has a flag, of which its help says a text."""
    parser = study_options(doc)
    parser.add_argument("scores", type=Path, nargs="+")
    parser.add_argument("--answer", default="api", help="who was asked (default api)")
    parser.add_argument(flag, action="store_true", dest="flag", help=text)
    options = parser.parse_args()
    every = [json.loads(path.read_text(encoding="utf-8"))[options.answer] for path in options.scores]
    return [row for scores in every for row in scores["rows"]], options.flag


def main() -> None:
    rows, stated_only = asked_rows(__doc__, "--stated", "stated probabilities instead of the targets")
    print_table(*(stated_lines(rows) if stated_only else target_lines(rows)))


def target_lines(rows: list[Row]) -> tuple[str, list[list[str]]]:
    """Widths and cells of the table of targets."""
    seen = targets([row for row in rows if row["visible"]])
    lines = [["", "wanted", "found", "still visible after a refit"]]
    for row, same in zip(targets(rows), seen, strict=True):
        if not row["found"]:
            continue
        again = cell(same) if same["found"] and same["found"]["n"] != row["found"]["n"] else ""
        lines.append([row["target"], row["wanted"], cell(row, row["passed"] is False), again])
    return _without_empty_column("40 14 24 22", lines)


def _without_empty_column(widths: str, lines: list[list[str]]) -> tuple[str, list[list[str]]]:
    """Widths and cells without the last column, where no row but the header says anything in it."""
    if any(cells[-1] for cells in lines[1:]):
        return widths, lines
    return widths.rpartition(" ")[0], [cells[:-1] for cells in lines]


def stated_lines(rows: list[Row]) -> tuple[str, list[list[str]]]:
    """Widths and cells of the table of stated probabilities, a line a bin: what was said, what was found."""
    lines = [
        [
            "said, and found [95 % interval]: inclusion or probability of",
            *(f"{low:.1f} to {low + stated.WIDTH:.1f}" for low in stated.BINS),
        ]
    ]
    for of, bins in stated.apart(rows).items():
        lines.append([of, *map(_said_and_found, bins)])
    return "30 14 14 14 14 14", lines


def _said_and_found(one: dict[str, Any]) -> str:
    if one["said"] is None:
        return ""
    found = one["found"]
    return f"{one['said']:.2f}: {found['value']:.2f} [{found['low']:.2f}, {found['high']:.2f}]"


def print_table(widths: str, lines: list[list[str]]) -> None:
    print(f".. list-table::\n   :header-rows: 1\n   :widths: {widths}\n")
    for cells in lines:
        print(signed("   * - " + "\n     - ".join(cells).rstrip()))


if __name__ == "__main__":
    main()
