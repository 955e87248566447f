"""Many experiments, each fitted and discovered on its own."""

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, ClassVar

from wirebayes.answers import terminal
from wirebayes.json_files.batch import BatchJson, OutlierRow, Row
from wirebayes.results import read_back

if TYPE_CHECKING:
    import xarray as xr

from wirebayes.views.posterior import POSTERIOR, Posterior, next_prediction
from wirebayes.views.result import NOTHING, Given, Result, html_table

_MESSAGES = 20  # lines on standard error: what a terminal shows at once


@dataclass(frozen=True, eq=False, repr=False)
class Batch(Result[BatchJson]):
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

    @cached_property
    def plain(self) -> dict[str, Posterior]:
        """Posteriors of the plain model, by experiment; none where the draws were not kept."""
        return self._posteriors(".") | self._posteriors("plain")

    @cached_property
    def final(self) -> dict[str, Posterior]:
        """Posteriors of the model with what was found missing, by experiment; none where nothing was discovered."""
        return self._posteriors("final")

    def to_datatree(self) -> "xr.DataTree":
        """One tree with a branch for each stored posterior."""
        both = [*self.plain.values(), *self.final.values()]
        return read_back.datatrees({posterior.within: posterior.folder for posterior in both})

    @property
    def messages(self) -> tuple[str, ...]:
        """The gravest warnings, where there are many."""
        lines = [f"warning: {notice.text}" for notice in self.warnings]
        more = f"and {len(lines) - _MESSAGES} more warnings: see summary.csv, columns warnings and error"
        return (*lines[:_MESSAGES], *([more] if len(lines) > _MESSAGES else []))

    def _posteriors(self, model: str) -> dict[str, Posterior]:
        within = {row["name"]: (Path(row["name"]) / model).as_posix() for row in self.rows if row["parameters"]}
        return {
            name: Posterior(self.place, self.own_effects, self.computed, name, folder, alone=False)
            for name, folder in within.items()
            if (self.folder / folder / POSTERIOR).is_file()
        }

    def lines(self) -> list[str]:
        return terminal.of_batch(self.summary())

    def next_step(self, given: Given = NOTHING) -> str:
        place = self.place.path
        look = f"look at {place / 'summary.csv'}"
        first = next(iter(self.plain), None)
        return f"{look}\n{next_prediction(place, place / first, f' --experiment {first}')}" if first else look

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
