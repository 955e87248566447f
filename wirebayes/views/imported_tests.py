"""Experiments out of raw files of a bench."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from wirebayes.answers import terminal
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.json_files.imported import ImportJson
from wirebayes.sentences import counted
from wirebayes.views.result import NOTHING, Given, Result, html_table, typed

IMPORTED = "import.json"


@dataclass(frozen=True, eq=False, repr=False)
class ImportedTests(Result[ImportJson]):
    """Experiments out of raw files of a bench.

    Examples
    --------
    >>> imported.summary()["experiments"]["bench"]["notes"][0]
    "semicolons between cells, decimal comma; displacement from 'Weg [mm]', time from 'Zeit [s]' and tension from
    'Kraft [N]'"
    """

    _content: ClassVar[str] = IMPORTED

    @cached_property
    def experiments(self) -> list[Experiment]:
        """The tests as `read_experiments` reads the files that were written."""
        return [e for name in self.summary()["experiments"] for e in read_experiments(self.folder / f"{name}.toml")]

    def lines(self) -> list[str]:
        found = self.summary()["experiments"]
        return [line for name, test in found.items() for line in terminal.of_import(name, test)]

    def next_step(self, given: Given = NOTHING) -> str:
        names = list(self.summary()["experiments"])
        file = names[0] if len(names) == 1 else "experiments"
        check = f"wirebayes check {typed(self.place.path / f'{file}.toml')}"
        return f"look at {self.place.path / names[0]}.svg, then {check}"

    def _short_form(self) -> list[str]:
        found = self.summary()["experiments"]
        return [
            f"{name}: {counted(each['holds'], 'hold')}, {counted(each['readings'], 'reading')}"
            for name, each in found.items()
        ]

    def _repr_html_(self) -> str:
        rows = [[name, note] for name, each in self.summary()["experiments"].items() for note in each["notes"]]
        return html_table(repr(self), ["experiment", "what was understood"], rows, self.messages)
