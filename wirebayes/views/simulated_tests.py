"""Synthetic tests with known truth."""

from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.json_files.truth import TruthJson
from wirebayes.sentences import counted, some_of
from wirebayes.views.result import NOTHING, Given, Result, figure, html_table, typed


@dataclass(frozen=True, eq=False, repr=False)
class SimulatedTests(Result[TruthJson]):
    """Synthetic tests with known truth.

    Examples
    --------
    >>> [test.name for test in made.experiments]
    ['wire']
    """

    _content: ClassVar[str] = "truth.json"

    @cached_property
    def experiments(self) -> list[Experiment]:
        """The tests as `read_experiments` reads them."""
        return read_experiments(self.folder / "experiments.toml")

    def lines(self) -> list[str]:
        names = [test.name for test in self.experiments]
        recorded = [hold for test in self.experiments for hold in test.holds if hold.number is not None]
        readings = counted(sum(len(hold.time_s) for hold in recorded), "reading")
        what = f"{counted(len(names), 'test')}, {counted(len(recorded), 'hold')}, {readings}"
        return [f"Simulated: {some_of(names)} ({what}); the true parameters are in {self._content}"]

    def next_step(self, given: Given = NOTHING) -> str:
        return f"wirebayes fit {typed(self.place.path / 'experiments.toml')}"

    def _short_form(self) -> list[str]:
        return [e.name for e in self.experiments]

    def _repr_html_(self) -> str:
        truth = self.summary()["experiments"]
        rows = [[name, p, figure(v)] for name, t in truth.items() for p, v in t["parameters"].items()]
        return html_table(repr(self), ["test", "parameter", "true value"], rows)
