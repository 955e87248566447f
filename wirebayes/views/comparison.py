"""Models side by side."""

from dataclasses import dataclass
from typing import ClassVar

from wirebayes.answers import terminal
from wirebayes.json_files.comparison import ComparisonJson
from wirebayes.views.result import NOTHING, Given, Result, html_table


@dataclass(frozen=True, eq=False, repr=False)
class Comparison(Result[ComparisonJson]):
    """Models side by side on readings that their fits have not seen.

    Examples
    --------
    >>> comparison
    Comparison(wire: 2 models, best exponential)
    """

    _content: ClassVar[str] = "comparison.json"

    def lines(self) -> list[str]:
        found = self.summary()["experiments"]
        return [line for name, table in found.items() for line in terminal.of_comparison(name, table)]

    def next_step(self, given: Given = NOTHING) -> str:
        tables = list(self.summary()["experiments"].values())
        options = terminal.options_of_best(tables[0]) if len(tables) == 1 else None
        discover = f"wirebayes discover {given.file}{terminal.options_of_base(tables[0])}"
        return discover if options is None else f"{f'wirebayes fit {given.file} {options}'.rstrip()}\n{discover}"

    def _short_form(self) -> list[str]:
        return [
            f"{name}: {len(table['models'])} models, best {table['models'][0]['name']}"
            for name, table in self.summary()["experiments"].items()
        ]

    def _repr_html_(self) -> str:
        tables = []
        for name, table in self.summary()["experiments"].items():
            rows = [[row["name"], row["meaning"]] for row in table["models"]]
            tables.append(html_table(name, ["model", "meaning"], rows))
        return "".join(tables)
