"""What was understood of experiments."""

from dataclasses import dataclass
from typing import ClassVar

from wirebayes.answers import terminal
from wirebayes.json_files.check import CheckJson
from wirebayes.sentences import counted, unit_text
from wirebayes.views.result import NOTHING, Given, Result, figure, html_table, short_interval

CHECKED = "check.json"


@dataclass(frozen=True, eq=False, repr=False)
class Check(Result[CheckJson]):
    """What was understood of experiments, what is suspicious, and what such tests can determine.

    Examples
    --------
    >>> [warning.kind for warning in checked.warnings]
    []
    """

    _content: ClassVar[str] = CHECKED

    def lines(self) -> list[str]:
        found = self.summary()["experiments"]
        return [line for name, test in found.items() for line in terminal.of_check(name, test)]

    def next_step(self, given: Given = NOTHING) -> str:
        then = "  (once the warnings are settled)" if self.warnings else f", then wirebayes discover {given.file}"
        return f"wirebayes fit {given.file}{then}"

    def _short_form(self) -> list[str]:
        found = self.summary()["experiments"]
        return [
            f"{name}: {counted(test['recorded_holds'], 'hold')}, {counted(test['readings'], 'reading')}"
            for name, test in found.items()
        ]

    def _repr_html_(self) -> str:
        rows = [
            [name, parameter, unit_text(p["unit"]), figure(p["q50"]), short_interval(p), p["determined_by"]]
            for name, test in self.summary()["experiments"].items()
            for parameter, p in test["parameters"].items()
        ]
        header = ["experiment", "parameter", "unit", "median", "90 % interval", "determined by"]
        return html_table(repr(self), header, rows, self.messages)
