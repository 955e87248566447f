"""A posterior, and several by name."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal

from wirebayes.answers import terminal
from wirebayes.answers.headline import UNUSABLE
from wirebayes.errors import InputError
from wirebayes.io.next_hold import NEXT_HOLD, next_hold_of
from wirebayes.io.run_folder import CONFIGURATION, stored_results
from wirebayes.json_files.summary import SummaryJson
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice, NoticeJson, from_json, to_json
from wirebayes.results import read_back
from wirebayes.results.read_back import Stored
from wirebayes.sentences import unit_text
from wirebayes.strict.files import PathLike

if TYPE_CHECKING:
    import xarray as xr

from wirebayes.views.result import (
    NOTHING,
    Content,
    Given,
    Result,
    copy_results,
    figure,
    html_table,
    short_interval,
    typed,
)

POSTERIOR, SUMMARY = "posterior.nc", "summary.json"


@dataclass(frozen=True, eq=False, repr=False)
class Posterior(Result[SummaryJson]):
    """A posterior: draws of the parameters given the readings, of one experiment or of several fitted together.

    Attributes
    ----------
    name : str
        The experiment, or the material of experiments fitted together.
    within : str
        Its folder below the command's.
    alone : bool
        Whether it is all that the command stored.

    Examples
    --------
    >>> posterior.summary()["converged"]
    True
    >>> sorted(posterior.draws())
    ['B', 'N', 'U', 'k1', 'k2', 'preload', 'sensor_sd', 'setting_sd']
    >>> posterior.to_datatree()["posterior"]["k1"].attrs["units"]
    'N'
    """

    name: str = ""
    within: str = "."
    alone: bool = True

    _content: ClassVar[str] = SUMMARY

    @property
    def folder(self) -> Path:
        """The folder with ``posterior.nc`` and ``summary.json``."""
        return self.place.path / self.within

    @cached_property
    def experiments(self) -> tuple[str, ...]:
        """Names of the experiments whose parameters it holds."""
        return read_back.experiments_in(self.folder / POSTERIOR)

    def draws(self, experiment: str | None = None) -> dict[str, Floats]:
        """Draws of one experiment's parameters.

        Parameters
        ----------
        experiment : str, optional
            Needed where several were fitted together.

        Returns
        -------
        dict of name to (n,) array
        """
        return self.stored(experiment).draws

    def stored(self, experiment: str | None = None) -> Stored:
        """Draws, readings and model of one experiment, as the toolkit computes with them."""
        return read_back.load_posterior(self.folder, experiment, self.own_effects)

    def to_datatree(self) -> "xr.DataTree":
        """All groups of ``posterior.nc`` in memory, as ArviZ takes them."""
        return read_back.datatree(self.folder)

    def plot(self, experiment: str | None = None, axes: Any = None) -> Any:
        """Draw the readings, hold after hold, with the curve of the model through them and its 90 % band.

        Parameters
        ----------
        experiment : str, optional
            Needed where several were fitted together.
        axes : matplotlib.axes.Axes, optional
            Where to draw; new ones when left out.

        Returns
        -------
        matplotlib.axes.Axes

        Raises
        ------
        InputError
            It was fitted hold by hold, which has no curve from hold to hold.

        Examples
        --------
        >>> posterior.plot().get_ylabel()
        'tension, N'
        """
        from wirebayes.report.pictures.curve import on_axes  # matplotlib only where it is needed

        stored = self.stored(experiment)
        if stored.likelihood == "hold":
            raise InputError(f"{self.folder}: found a fit with likelihood hold, expected a chain: it has a curve")
        return on_axes(stored, axes)

    def save(self, folder: PathLike) -> Path:
        """Store the posterior, as ``fit`` would where it is all that was fitted, else its two files alone.

        Parameters
        ----------
        folder : str or Path
            A new or empty folder, or one that holds this posterior already.

        Returns
        -------
        Path

        Raises
        ------
        InputError
            The folder holds something else, or cannot be written.
        """
        if self.alone and (self.place.path / CONFIGURATION).is_file():
            return super().save(folder)
        target = Path(folder)
        present = sorted(p.name for p in target.iterdir()) if target.is_dir() else []
        here = (self.folder / POSTERIOR).read_bytes()
        if present and not (POSTERIOR in present and (target / POSTERIOR).read_bytes() == here):
            raise InputError(f"{target}: found {present[0]}, expected a new or empty folder")
        copy_results(self.folder, target)
        return target

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What is suspicious about the readings, and why the posterior should not be believed, if so."""
        name = self.within if self.within != "." else self.name
        with stored_results(self.folder / SUMMARY):
            return tuple(notice.of(name) for notice in from_json(self.summary()["warnings"]))

    def lines(self) -> list[str]:
        return terminal.of_fit(self.summary())

    def next_step(self, given: Given = NOTHING) -> str:
        return _after_fit(self, self.kinds, given)

    def _short_form(self) -> list[str]:
        s = self.summary()
        model = [s["likelihood"], s["elastic_law"], s["history"], *s["effects"]]
        sure = "converged" if s["converged"] else "NOT CONVERGED"
        check = s.get("model_check") or {"passed": None}
        passed = {True: ["model check passed"], False: ["MODEL CHECK FAILED"], None: []}[check["passed"]]
        return [self.name, " ".join(model), sure, *passed]

    def _repr_html_(self) -> str:
        rows = [
            [name, unit_text(p["unit"]), figure(p["mean"]), figure(p["sd"]), short_interval(p)]
            for name, p in self.summary()["parameters"].items()
        ]
        header = ["parameter", "unit", "mean", "sd", "90 % interval"]
        return html_table(repr(self), header, rows, self.messages)


@dataclass(frozen=True, eq=False, repr=False)
class Posteriors(Result[dict[str, SummaryJson | list[NoticeJson]]], Mapping[str, Posterior]):
    """The posteriors of several experiments by name.

    Attributes
    ----------
    members : dict of name to Posterior

    Examples
    --------
    >>> both = wb.fit([kite.first(5), made.experiments[0]], check=False, policy=few)
    >>> list(both)
    ['kite-1.5m', 'wire']
    >>> both["wire"]
    Posterior(wire, chain hooke saturating, converged)
    """

    members: Mapping[str, Posterior] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Posterior:
        return self.members[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self.members)

    def __len__(self) -> int:
        return len(self.members)

    def summary(self) -> dict[str, SummaryJson | list[NoticeJson]]:
        """The summary of each, by name, and the ``warnings`` of all of them."""
        found: dict[str, SummaryJson | list[NoticeJson]] = {name: each.summary() for name, each in self.members.items()}
        return found | {"warnings": to_json(self.warnings)}

    def to_datatree(self) -> "xr.DataTree":
        """One tree with a branch for each."""
        return read_back.datatrees({name: posterior.folder for name, posterior in self.members.items()})

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """The warnings of all posteriors."""
        return tuple(notice for posterior in self.members.values() for notice in posterior.warnings)

    def lines(self) -> list[str]:
        return [line for posterior in self.members.values() for line in posterior.lines()]

    def next_step(self, given: Given = NOTHING) -> str:
        return _after_fit(next(iter(self.values())), self.kinds, given)

    def _short_form(self) -> list[str]:
        return [repr(posterior) for posterior in self.members.values()]

    def _repr_html_(self) -> str:
        return "".join(posterior._repr_html_() for posterior in self.members.values())


class PlainAndFinal(Result[Content]):
    """Results whose experiments have a posterior of the plain model and one of the model with what was missing."""

    @cached_property
    def plain(self) -> dict[str, Posterior]:
        """Posteriors of the plain model, by experiment; none where the draws were not kept."""
        return self._posteriors("plain")

    @cached_property
    def final(self) -> dict[str, Posterior]:
        """Posteriors of the model with what was found missing, by experiment; none where nothing was looked for."""
        return self._posteriors("final")

    def to_datatree(self) -> "xr.DataTree":
        """One tree with a branch ``NAME/plain`` and ``NAME/final`` for each experiment."""
        both = [*self.plain.values(), *self.final.values()]
        return read_back.datatrees({posterior.within: posterior.folder for posterior in both})

    def _posteriors(self, model: Literal["plain", "final"]) -> dict[str, Posterior]:
        raise NotImplementedError

    def _posterior(self, name: str, within: str) -> Posterior:
        """The one of an experiment, in this folder."""
        return Posterior(self.place, self.own_effects, self.computed, name, within, alone=False)


def _after_fit(posterior: Posterior, kinds: frozenset[str], given: Given) -> str:
    """What to do with the posteriors of a command, of which one is given with the kinds of the warnings of all."""
    if "model-check" in kinds:
        return f"wirebayes discover {given.file}  (what is the model missing?)"
    if "not-converged" in kinds:
        return UNUSABLE
    own = own_effects_option(posterior.own_effects)
    steps = _next_predictions(posterior, own)
    if posterior.summary()["likelihood"] != "hold":  # else k1 is not determined, which a robot needs
        steps.append(next_pose(posterior.folder, own))
    return "\n".join(steps)


def _next_predictions(posterior: Posterior, own: str) -> list[str]:
    """The commands that predict the examples beside a fit: the first test's, and one of every other kind."""
    first, *others = posterior.experiments
    several = not posterior.alone or others
    whose = f" --experiment {first}" if several else ""
    results = posterior.place.path
    folder = posterior.folder
    commands = [next_prediction(results, folder, whose + own)]
    for name in others:
        file = next_hold_of(name)
        if (folder / file).is_file():
            commands.append(next_prediction(results, folder, f" --experiment {name}{own}", file))
    return commands


def own_effects_option(file: Path | None) -> str:
    """What a command is given beside results that hold effects of the user's own."""
    return "" if file is None else f" --own-effects {typed(file)}"


def next_prediction(results: Path, around: Path, options: str, file: str = NEXT_HOLD) -> str:
    """The command that predicts the example of a hold to come.

    Parameters
    ----------
    results : Path
        What `predict` reads.
    around : Path
        The folder with the example.
    options : str
        Those that name one of several experiments, and the user's own effects.
    file : str
        The example's name.
    """
    command = f"wirebayes predict {typed(results)} {typed(around / file)}{options}"
    return f"{command}  (one hold more: edit the file for others)"


def next_pose(posterior: Path, options: str) -> str:
    """The command that hangs a robot on such wires."""
    return f"wirebayes pose linear-7 --wires {typed(posterior)}{options}  (or the file of your own robot)"
