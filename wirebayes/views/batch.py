"""Many experiments, each fitted and discovered on its own."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar, Literal

from wirebayes.answers import terminal
from wirebayes.json_files.batch import BatchJson, OutlierRow, Row
from wirebayes.views.posterior import POSTERIOR, PlainAndFinal, Posterior, next_prediction, own_effects_option
from wirebayes.views.result import NOTHING, Given, html_table

_MESSAGES = 20  # lines on standard error: what a terminal shows at once


@dataclass(frozen=True, eq=False, repr=False)
class Batch(PlainAndFinal[BatchJson]):
    """Many experiments, each fitted and discovered on its own.

    Examples
    --------
    >>> many.rows[0]["name"], many.rows[0]["converged"]
    ('wire-1', True)
    >>> many.plain["wire-1"]
    Posterior(wire-1, chain hooke saturating, converged)
    >>> many.outliers
    []
    """

    _content: ClassVar[str] = "batch.json"

    @cached_property
    def rows(self) -> list[Row]:
        """What ``summary.csv`` says, a row an experiment."""
        return list(self.summary()["experiments"])

    @cached_property
    def outliers(self) -> list[OutlierRow]:
        """Parameters of specimens that lie far from those of their material's others, farthest first."""
        return list(self.summary()["outliers"])

    @property
    def messages(self) -> tuple[str, ...]:
        """The gravest warnings, where there are many."""
        lines = [f"warning: {notice.text}" for notice in self.warnings]
        more = f"and {len(lines) - _MESSAGES} more warnings: see summary.csv, columns warnings and error"
        return (*lines[:_MESSAGES], *([more] if len(lines) > _MESSAGES else []))

    def _posteriors(self, model: Literal["plain", "final"]) -> dict[str, Posterior]:
        found = {}
        for name in [row["name"] for row in self.rows if row["parameters"]]:
            fitted_alone = [name] if model == "plain" else []  # where nothing was looked for
            for within in [*fitted_alone, f"{name}/{model}"]:
                if (self.folder / within / POSTERIOR).is_file():
                    found[name] = self._posterior(name, within)
        return found

    def lines(self) -> list[str]:
        return terminal.of_batch(self.summary())

    def next_step(self, given: Given = NOTHING) -> str:
        place = self.place.path
        look = f"look at {place / 'summary.csv'}"
        first = next(iter(self.plain), None)
        if first is None:
            return look
        options = f" --experiment {first}{own_effects_option(self.own_effects)}"
        return f"{look}\n{next_prediction(place, place / first, options)}"

    def _short_form(self) -> list[str]:
        failed = sum(row["error"] is not None for row in self.rows)
        converged = sum(bool(row["converged"]) for row in self.rows)
        outlying = len({outlier["experiment"] for outlier in self.outliers})
        return [f"{len(self.rows)} experiments", f"{converged} converged", f"{outlying} outliers", f"{failed} failed"]

    def _repr_html_(self) -> str:
        rows = [
            [row["name"], row["material"] or "-", row["verdict"] or row["error"] or "-", row["check"] or "-"]
            for row in self.rows
        ]
        return html_table(repr(self), ["experiment", "material", "verdict", "check"], rows, self.messages)
