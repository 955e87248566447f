"""The paper, with posteriors."""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from wirebayes.io.run_folder import COMPLETE, CONFIGURATION, read_json
from wirebayes.result_warnings import Notice
from wirebayes.results import read_back

if TYPE_CHECKING:
    import xarray as xr

from wirebayes.views.posterior import POSTERIOR, Posterior
from wirebayes.views.result import Result


@dataclass(frozen=True, eq=False, repr=False)
class Reproduction(Result[dict[str, Any]]):
    """The paper's tables and figures, with posteriors.

    Attributes
    ----------
    not_converged : tuple of str
        A line for each such fit.

    Examples
    --------
    >>> paper = wb.load("out/reproduce")  # doctest: +SKIP
    >>> paper.posteriors["nylon-1.5m/chain"].summary()["converged"]  # doctest: +SKIP
    True
    """

    not_converged: tuple[str, ...] = ()

    def summary(self) -> dict[str, Any]:
        """Rows of each table by its name."""
        own = (CONFIGURATION, COMPLETE)
        return {p.stem: read_json(p) for p in sorted(self.folder.glob("*.json")) if p.name not in own}

    @cached_property
    def posteriors(self) -> dict[str, Posterior]:
        """Every fit, by its folder below this one."""
        found = sorted(path.parent for path in self.folder.glob(f"*/*/{POSTERIOR}"))
        within = [path.relative_to(self.folder).as_posix() for path in found]
        return {name: Posterior(self.place, None, self.computed, name, name, alone=False) for name in within}

    def to_datatree(self) -> "xr.DataTree":
        """One tree with a branch for each fit."""
        return read_back.datatrees({name: posterior.folder for name, posterior in self.posteriors.items()})

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """Fits that did not converge."""
        return tuple(Notice("not-converged", line) for line in self.not_converged)

    def _short_form(self) -> list[str]:
        return [str(self.folder / "report.html"), f"{len(self.posteriors)} fits"]
