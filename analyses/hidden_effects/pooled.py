"""The table of targets over several runs together, as the docs include it.

    python -m analyses.hidden_effects.pooled out/clean/scores.json out/singles/scores.json > table.inc

What is found has its 90 % interval; a missed row is bold. The last column counts only cases of which a refit of the
plain model, whose noise is not known, leaves most to be seen.
"""

import argparse
import json
from pathlib import Path

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


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scores", type=Path, nargs="+")
    parser.add_argument("--answer", default="api", help="who was asked (default api)")
    options = parser.parse_args()
    every = [json.loads(path.read_text(encoding="utf-8"))[options.answer] for path in options.scores]
    rows = [row for scores in every for row in scores["rows"]]
    seen = targets([row for row in rows if row["visible"]])
    print(".. list-table::\n   :header-rows: 1\n   :widths: 40 14 24 22\n")
    lines = [["", "wanted", "found", "still visible after a refit"]]
    for row, same in zip(targets(rows), seen, strict=True):
        if not row["found"]:
            continue
        again = cell(same) if same["found"] and same["found"]["n"] != row["found"]["n"] else ""
        lines.append([row["target"], row["wanted"], cell(row, row["passed"] is False), again])
    for cells in lines:
        print(signed("   * - " + "\n     - ".join(cells).rstrip()))


if __name__ == "__main__":
    main()
