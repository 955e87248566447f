"""Names and remainders over several runs together, by protocol, as the docs include them.

    python -m analyses.hidden_effects.several out/one/scores.json out/other/scores.json > tables.inc

The first table has the targets of names and remainders with 90 % intervals, the others the stated probabilities of a
remainder, of names and of families with 95 % intervals, as the cases are and as the prior expects them. A missed row is
bold.
"""

from collections.abc import Callable

from .cases import LONG
from .pooled import asked_rows, cell, signed
from .rates import Row
from .score import left_over
from .stated import Bins, families, names, prior_weights, remainders
from .target import Target
from .targets import targets

LEFT_OUT = (
    "false alarms",
    "clean data",
    "detected",
    "a test that knew",
    "true effect in",
    "gap closed",
    "size of",
    "members of",
)


def parts(rows: list[Row]) -> dict[str, list[Row]]:
    """All cases, those of the paper's protocol, and those of longer ones."""
    return {
        "all": rows,
        "paper's protocol": [r for r in rows if r["protocol"] == "paper"],
        "unloading, dense, uneven": [r for r in rows if r["protocol"] in LONG],
    }


def names_table(rows: list[Row]) -> list[list[str]]:
    """Cells of the table of names and remainders, its head first."""
    columns = [{row["target"]: row for row in targets(part)} for part in parts(rows).values()]
    table = [["", "target", *parts(rows)]]
    for name, row in columns[0].items():
        if row["found"] and not name.startswith(LEFT_OUT):
            table.append([name, row["wanted"], *(_found(column.get(name)) for column in columns)])
    return table


def _found(row: Target | None) -> str:
    return cell(row, row["passed"] is False) if row and row["found"] else ""


def stated_table(rows: list[Row], of: Callable[..., Bins], came_true: str) -> list[list[str]]:
    """Cells of the table of a stated probability, its head first.

    Parameters
    ----------
    of : one of `stated`'s functions.
    came_true : what happened where it did.
    """
    table = [["stated", "mean", came_true, "mean, as the prior expects", came_true]]
    for plain, expected in zip(of(rows), of(rows, prior_weights(rows)), strict=True):
        cells = [f"{plain['from']:g} to {plain['from'] + 0.2:g}"]
        for found in (plain, expected):
            if found["found"] is None:
                cells += ["", ""]
                continue
            outside = not found["found"]["low"] <= found["said"] <= found["found"]["high"]
            row: Target = {"target": "", "wanted": "in %", "found": found["found"], "passed": not outside}
            cells += [f"{100 * found['said']:.0f} %", cell(row, outside)]
        table.append(cells)
    return table


def left_lines(rows: list[Row]) -> list[str]:
    """What the best names leave of what is hidden, a sentence for each kind and number of names."""
    lines = []
    for kind in ("mixed", "without", "foreign"):
        for size, found in left_over([r for r in rows if r["kind"] == kind]).items():
            row: Target = {"target": "", "wanted": "in %", "found": found["too_little"], "passed": None}
            lines.append(
                f"{kind}, the best {size}: less than 3.3 left in {cell(row)}, power {100 * found['power']:.0f} %"
            )
    return lines


def listed(table: list[list[str]], widths: str) -> str:
    """A list-table of these cells."""
    lines = [".. list-table::", "   :header-rows: 1", f"   :widths: {widths}", ""]
    lines += [signed("   * - " + "\n     - ".join(cells)).replace(" \n", "\n").rstrip() for cells in table]
    return "\n".join(lines) + "\n"


def main() -> None:
    rows, left_only = asked_rows(__doc__, "--left", "print what the best names leave, and nothing else")
    if left_only:
        print("\n".join(left_lines(rows)))
        return
    print(listed(names_table(rows), "36 10 18 18 18"))
    tables = (
        stated_table(rows, remainders, "something was left"),
        stated_table(rows, names, "the effect was there"),
        stated_table(rows, families, "one of the family was there"),
    )
    print("\n".join(listed(table, "16 12 26 16 30") for table in tables), end="")


if __name__ == "__main__":
    main()
