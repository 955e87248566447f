"""What the plain model is missing in each experiment."""

from dataclasses import dataclass
from functools import cached_property
from typing import Any, ClassVar, Literal

from wirebayes.answers import terminal
from wirebayes.answers.verdict import median_between
from wirebayes.errors import InputError
from wirebayes.json_files.discovery import DiscoveryJson, ExperimentFindings
from wirebayes.sentences import p_in_words, quantity, spoken
from wirebayes.views.posterior import PlainAndFinal, Posterior, next_pose, next_prediction, own_effects_option
from wirebayes.views.result import NOTHING, Given, html_table


@dataclass(frozen=True, eq=False, repr=False)
class Findings(PlainAndFinal[DiscoveryJson]):
    """What the plain model is missing in each experiment of a file.

    Examples
    --------
    >>> findings.report["experiments"]["wire"]["verdict"]
    'nothing-missing'
    >>> findings.final["wire"].summary()["effects"]
    []
    """

    _content: ClassVar[str] = "discovery.json"

    @cached_property
    def report(self) -> DiscoveryJson:
        """The content of ``discovery.json``."""
        return self.summary()

    def plot(self, experiment: str | None = None, axes: Any = None) -> Any:
        """Draw an experiment's readings with the curves of the plain and of the final model through them.

        Parameters
        ----------
        experiment : str, optional
            Needed where several were judged.
        axes : matplotlib.axes.Axes, optional
            Where to draw; new ones when left out.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        InputError
            There are several experiments and none is named, or there is none of this name.

        Examples
        --------
        >>> findings.plot().get_legend().get_texts()[-1].get_text()
        'the plain model, 90 % band'
        """
        from wirebayes.report.pictures.curve import both_on_axes  # matplotlib only where it is needed

        names = sorted(self.plain)
        if experiment is None and len(names) == 1:
            experiment = names[0]
        if experiment not in names:
            raise InputError(f"experiment: found {experiment!r}, expected one of {', '.join(names)}")
        return both_on_axes(self.plain[experiment].stored(), self.final[experiment].stored(), axes)

    def _posteriors(self, model: Literal["plain", "final"]) -> dict[str, Posterior]:
        return {name: self._posterior(name, f"{name}/{model}") for name in self.report["experiments"]}

    def lines(self) -> list[str]:
        found = self.summary()["experiments"]
        return [line for name, report in found.items() for line in terminal.of_findings(name, report)]

    def next_step(self, given: Given = NOTHING) -> str:
        found = self.report["experiments"]
        if len(found) > 1:
            return "\n".join(f"{name}: {report['next_measurement']}" for name, report in found.items())
        ((name, report),) = found.items()
        measurement = report["next_measurement"]
        if report["verdict"] not in ("named", "nothing-missing"):
            return measurement
        place = self.place.path / name
        own = own_effects_option(self.own_effects)
        use = f"{next_prediction(self.place.path, place, own)}\n{next_pose(place / 'final', own)}"
        return use if report["verdict"] == "named" else f"{use}\n{measurement}"

    def _short_form(self) -> list[str]:
        return [
            " ".join([f"{name}: {found['verdict']}", ", ".join(found["effects"])]).strip()
            for name, found in self.report["experiments"].items()
        ]

    def _repr_html_(self) -> str:
        rows = [
            [name, found["verdict"], _sizes(found) or "-", p_in_words(found["p_global"], found["p_simulations"])]
            for name, found in self.report["experiments"].items()
        ]
        header = ["experiment", "verdict", "effects, 90 % interval", "p"]
        return html_table("What the plain model is missing", header, rows, self.messages)


def _sizes(found: ExperimentFindings) -> str:
    """The effects with their sizes."""
    sizes = found["amplitudes"].items()
    return ", ".join(f"{spoken(e)} {quantity(*median_between(a), a['unit'])}" for e, a in sizes)
