"""What each of several tests would teach."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from wirebayes.answers import terminal
from wirebayes.json_files.plan import JudgedProtocol, PlanJson
from wirebayes.views.result import NOTHING, Given, Result, figure, html_table


@dataclass(frozen=True, eq=False, repr=False)
class Plan(Result[PlanJson]):
    """What each of several tests would teach, the best first.

    Examples
    --------
    >>> [row["name"] for row in planned.protocols][0] == planned.best["name"]
    True
    """

    _content: ClassVar[str] = "plan.json"

    @cached_property
    def protocols(self) -> list[JudgedProtocol]:
        """Each test with its expected widths and what it would show, the best first."""
        return list(self.summary()["protocols"])

    @property
    def best(self) -> JudgedProtocol:
        """The first of them."""
        return self.protocols[0]

    def lines(self) -> list[str]:
        return [line for row in self.protocols for line in terminal.of_plan(row)]

    def next_step(self, given: Given = NOTHING) -> str:
        best = self.best["words"] or f"do the test {self.best['name']}"
        return f"{best}; then wirebayes discover with its file"

    def _short_form(self) -> list[str]:
        return [f"{len(self.protocols)} protocols", f"best {self.best['name']}"]

    def _repr_html_(self) -> str:
        rows = [
            [row["name"], figure(row["duration_min"]), figure(row["information_bits"])]
            + [figure(row["parameters"][n]["sd"] if n in row["parameters"] else None) for n in ("k1", "B", "k2")]
            for row in self.protocols
        ]
        header = ["protocol", "minutes", "bits", "sd of k1, N", "sd of B", "sd of k2"]
        return html_table(repr(self), header, rows, self.messages)
