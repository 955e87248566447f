"""What the public functions return: views of folders of results, which say in short what they hold."""

import os
import shutil
import weakref
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from html import escape
from pathlib import Path
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any, ClassVar, Generic, TypeVar, cast

from wirebayes import answers
from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment, read_experiments
from wirebayes.io.run_folder import COMPLETE, CONFIGURATION, check_run, read_json, stored_results, write_bytes
from wirebayes.json_files.batch import BatchJson, OutlierRow, Row
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.check import CheckJson
from wirebayes.json_files.comparison import ComparisonJson
from wirebayes.json_files.discovery import DiscoveryJson
from wirebayes.json_files.export import ExportSummary
from wirebayes.json_files.imported import ImportJson
from wirebayes.json_files.plan import JudgedProtocol, PlanJson
from wirebayes.json_files.pose import PoseJson
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.json_files.summary import SummaryJson
from wirebayes.json_files.truth import TruthJson
from wirebayes.json_files.values import Quantiles
from wirebayes.notice import Notice, Warned, from_json
from wirebayes.numeric.typing import Floats
from wirebayes.results import store
from wirebayes.results.store import Stored
from wirebayes.robot.mechanics.draws import specimens_in_words
from wirebayes.sentences import counted, unit_text
from wirebayes.workflows.options import PathLike

if TYPE_CHECKING:
    import xarray as xr

POSTERIOR, SUMMARY = "posterior.nc", "summary.json"
IMPORTED, CHECKED = "import.json", "check.json"
Content = TypeVar("Content")  # what the JSON file of a result holds
_MESSAGES = 20  # lines on standard error: what a terminal shows at once
_FIGURES = 4  # digits that a short form shows


@dataclass(frozen=True)
class Place:
    """A folder of results; a temporary one is removed with the last object that holds it.

    Attributes
    ----------
    path : Path
    """

    path: Path

    @classmethod
    def at(cls, output: PathLike | None) -> "Place":
        """The folder named, or a temporary one."""
        if output is not None:
            if not isinstance(output, str | os.PathLike):
                raise InputError(f"output: found {output!r}, expected a path")
            return cls(Path(output))
        place = cls(Path(mkdtemp(prefix="wirebayes-")))
        weakref.finalize(place, shutil.rmtree, place.path, ignore_errors=True)
        return place


@dataclass(frozen=True, eq=False, repr=False)
class Result(Generic[Content]):
    """What all results have in common.

    Attributes
    ----------
    place : Place
        The folder of the whole command.
    own_effects : Path or None
        The user's file of effects, where the command was given one.
    computed : bool
        False where the folder held the finished results before.
    """

    place: Place
    own_effects: Path | None = None
    computed: bool = True

    _content: ClassVar[str]  # the file that `summary` reads

    @property
    def folder(self) -> Path:
        """Where the results lie; a temporary folder unless ``output`` was given."""
        return self.place.path

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What speaks against the results, gravest first: the same on a terminal, on the page and in the JSON."""
        with stored_results(self.folder):
            return from_json(cast(Warned, self.summary())["warnings"])

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds of the warnings, on which it depends what to do next."""
        return frozenset(notice.kind for notice in self.warnings)

    @property
    def messages(self) -> tuple[str, ...]:
        """What the command says on standard error."""
        return tuple(f"warning: {notice.text}" for notice in self.warnings)

    def summary(self) -> Content:
        """The results as plain values, as they stand in the JSON file."""
        path = self.folder / self._content
        with stored_results(path):
            return cast(Content, dict(read_json(path)))

    def save(self, folder: PathLike) -> Path:
        """Store the results as the command would have stored them.

        Parameters
        ----------
        folder : str or Path
            A new or empty folder, or one that holds these results already.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        InputError
            The folder holds something else, or cannot be written.
        """
        target = Path(folder)
        state = check_run(target, read_json(self.place.path / CONFIGURATION))
        if state != "done":
            _copy(self.place.path, target)
        return target

    def lines(self) -> list[str]:
        """The answer, a line or two for each experiment, model or wire, with units."""
        return [repr(self)]

    def __str__(self) -> str:
        return "\n".join(self.lines())

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self._short_form())})"

    def _short_form(self) -> list[str]:
        return [str(self.folder)]

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>" + "".join(f"<p>{escape(message)}</p>" for message in self.messages)


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
        return store.experiments_in(self.folder / POSTERIOR)

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
        return store.load(self.folder, experiment, self.own_effects)

    def to_datatree(self) -> "xr.DataTree":
        """All groups of ``posterior.nc`` in memory, as ArviZ takes them."""
        return store.datatree(self.folder)

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
        _copy(self.folder, target)
        return target

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What is suspicious about the readings, and why the posterior should not be believed, if so."""
        name = self.within if self.within != "." else self.name
        with stored_results(self.folder / SUMMARY):
            return tuple(notice.of(name) for notice in from_json(self.summary()["warnings"]))

    def lines(self) -> list[str]:
        return answers.of_fit(self.summary())

    def _short_form(self) -> list[str]:
        s = self.summary()
        model = [s["likelihood"], s["elastic_law"], s["history"], *s["effects"]]
        sure = "converged" if s["converged"] else "NOT CONVERGED"
        check = s.get("model_check") or {"passed": None}
        passed = {True: ["model check passed"], False: ["MODEL CHECK FAILED"], None: []}[check["passed"]]
        return [self.name, " ".join(model), sure, *passed]

    def _repr_html_(self) -> str:
        rows = [
            [name, unit_text(p["unit"]), _figure(p["mean"]), _figure(p["sd"]), _interval(p)]
            for name, p in self.summary()["parameters"].items()
        ]
        header = ["parameter", "unit", "mean", "sd", "90 % interval"]
        return html_table(repr(self), header, rows, self.messages)


@dataclass(frozen=True, eq=False, repr=False)
class Posteriors(Result[dict[str, SummaryJson]], Mapping[str, Posterior]):
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

    def summary(self) -> dict[str, SummaryJson]:
        """The summary of each, by name."""
        return {name: posterior.summary() for name, posterior in self.members.items()}

    def to_datatree(self) -> "xr.DataTree":
        """One tree with a branch for each."""
        return store.datatrees({name: posterior.folder for name, posterior in self.members.items()})

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """Of all of them."""
        return tuple(notice for posterior in self.members.values() for notice in posterior.warnings)

    def lines(self) -> list[str]:
        return [line for posterior in self.members.values() for line in posterior.lines()]

    def _short_form(self) -> list[str]:
        return [repr(posterior) for posterior in self.members.values()]

    def _repr_html_(self) -> str:
        return "".join(posterior._repr_html_() for posterior in self.members.values())


@dataclass(frozen=True, eq=False, repr=False)
class Findings(Result[DiscoveryJson]):
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

    @cached_property
    def plain(self) -> dict[str, Posterior]:
        """Posteriors of the plain model, by experiment."""
        return self._posteriors("plain")

    @cached_property
    def final(self) -> dict[str, Posterior]:
        """Posteriors of the model with what was found missing, by experiment."""
        return self._posteriors("final")

    def to_datatree(self) -> "xr.DataTree":
        """One tree with a branch ``NAME/plain`` and ``NAME/final`` for each experiment."""
        both = [*self.plain.values(), *self.final.values()]
        return store.datatrees({posterior.within: posterior.folder for posterior in both})

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

    def _posteriors(self, model: str) -> dict[str, Posterior]:
        return {
            name: Posterior(self.place, self.own_effects, self.computed, name, f"{name}/{model}", alone=False)
            for name in self.report["experiments"]
        }

    def lines(self) -> list[str]:
        found = self.summary()["experiments"]
        return [line for name, report in found.items() for line in answers.of_findings(name, report)]

    def _short_form(self) -> list[str]:
        return [
            " ".join([f"{name}: {found['verdict']}", ", ".join(found["effects"])]).strip()
            for name, found in self.report["experiments"].items()
        ]

    def _repr_html_(self) -> str:
        rows = [
            [name, found["verdict"], ", ".join(found["effects"]) or "-", _figure(found["p_global"])]
            for name, found in self.report["experiments"].items()
        ]
        return html_table("What the plain model is missing", ["experiment", "verdict", "effects", "p"], rows)


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
        return store.datatrees({posterior.within: posterior.folder for posterior in both})

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
        return answers.of_batch(self.summary())

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
        return [line for row in self.protocols for line in answers.of_plan(row)]

    def _short_form(self) -> list[str]:
        return [f"{len(self.protocols)} protocols", f"best {self.best['name']}"]

    def _repr_html_(self) -> str:
        rows = [
            [row["name"], _figure(row["duration_min"]), _figure(row["information_bits"])]
            + [_figure(row["parameters"][n]["sd"] if n in row["parameters"] else None) for n in ("k1", "B", "k2")]
            for row in self.protocols
        ]
        header = ["protocol", "minutes", "bits", "sd of k1, N", "sd of B", "sd of k2"]
        return html_table(repr(self), header, rows, self.messages)


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
        return [answers.of_comparison(name, table) for name, table in found.items()]

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


@dataclass(frozen=True, eq=False, repr=False)
class Pose(Result[PoseJson | PoseHistoryJson]):
    """A pose of a robot on creeping wires: kinematics, drift and pose error with bands.

    Examples
    --------
    >>> held.summary()["feasible"]
    True
    """

    _content: ClassVar[str] = "pose.json"

    @property
    def messages(self) -> tuple[str, ...]:
        """The estimated spread of specimens, and the warnings."""
        return (*specimens_in_words(self.summary()["wires"]), *super().messages)

    def lines(self) -> list[str]:
        return answers.of_pose(self.summary())

    def _short_form(self) -> list[str]:
        found = self.summary()
        if not found["feasible"]:
            return [found["robot"], found["sentence"]]
        drift = found["drift"][0]
        middle = drift["distance_mm"]["q50"][-1]
        return [found["robot"], f"drift {_figure(middle)} mm after {_figure(drift['times_s'][-1])} s"]

    def _repr_html_(self) -> str:
        found = self.summary()
        if not found["feasible"]:
            return super()._repr_html_()
        drift = found["drift"][0]
        far = drift["distance_mm"]
        rows = [
            [_figure(t), _figure(far["q50"][i]), f"{_figure(far['q05'][i])} to {_figure(far['q95'][i])}"]
            for i, t in enumerate(drift["times_s"])
        ]
        return html_table(repr(self), ["time, s", "drift, mm", "90 % interval"], rows, self.messages)


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result[CalibrateJson]):
    """Zero-tension lengths of a robot's wires, estimated from its own sensors.

    Examples
    --------
    >>> lengths
    Calibration(linear-7, 9 holds, converged)
    """

    _content: ClassVar[str] = "calibration.json"

    def lines(self) -> list[str]:
        return answers.of_calibration(self.summary())

    def _short_form(self) -> list[str]:
        found = self.summary()
        sure = "converged" if found["with_creep_model"]["converged"] else "NOT CONVERGED"
        return [found["robot"], f"{found['holds']} holds", sure]

    def _repr_html_(self) -> str:
        lengths = self.summary()["with_creep_model"]["length_m"]
        rows = [
            [str(i + 1), f"{mean:.5f}", f"{low:.5f} to {high:.5f}"]
            for i, (mean, low, high) in enumerate(zip(lengths["mean"], lengths["q05"], lengths["q95"], strict=True))
        ]
        return html_table(repr(self), ["wire", "length, m", "90 % interval"], rows, self.messages)


@dataclass(frozen=True, eq=False, repr=False)
class Export(Result[ExportSummary]):
    """A robot with its wires for other programs: firmware settings, creep table, MuJoCo model.

    Examples
    --------
    >>> exported.files["klipper.cfg"].splitlines()[2]
    '[printer]'
    """

    _content: ClassVar[str] = "export.json"

    @property
    def files(self) -> dict[str, str]:
        """Content of each file by name."""
        own = (CONFIGURATION, COMPLETE, self._content)
        paths = sorted(path for path in self.folder.iterdir() if path.is_file() and path.name not in own)
        return {path.name: path.read_text(encoding="utf-8") for path in paths}

    def _short_form(self) -> list[str]:
        return list(self.files)

    def _repr_html_(self) -> str:
        table = self.summary()["creep_table"]
        rows = [[value if isinstance(value, str) else _figure(value) for value in row.values()] for row in table]
        return html_table(repr(self), list(table[0]), rows, self.messages)


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

    def _short_form(self) -> list[str]:
        return [e.name for e in self.experiments]

    def _repr_html_(self) -> str:
        truth = self.summary()["experiments"]
        rows = [[name, p, _figure(v)] for name, t in truth.items() for p, v in t["parameters"].items()]
        return html_table(repr(self), ["test", "parameter", "true value"], rows)


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
        return [line for name, test in found.items() for line in answers.of_import(name, test)]

    def _short_form(self) -> list[str]:
        found = self.summary()["experiments"]
        return [
            f"{name}: {counted(each['holds'], 'hold')}, {counted(each['readings'], 'reading')}"
            for name, each in found.items()
        ]

    def _repr_html_(self) -> str:
        rows = [[name, note] for name, each in self.summary()["experiments"].items() for note in each["notes"]]
        return html_table(repr(self), ["experiment", "what was understood"], rows, self.messages)


@dataclass(frozen=True, eq=False, repr=False)
class Check(Result[CheckJson]):
    """What was understood of experiments, what is suspicious, and what such tests can determine.

    Examples
    --------
    >>> checked.messages
    ()
    """

    _content: ClassVar[str] = CHECKED

    def lines(self) -> list[str]:
        found = self.summary()["experiments"]
        return [line for name, test in found.items() for line in answers.of_check(name, test)]

    def _short_form(self) -> list[str]:
        found = self.summary()["experiments"]
        return [
            f"{name}: {counted(test['recorded_holds'], 'hold')}, {counted(test['readings'], 'reading')}"
            for name, test in found.items()
        ]

    def _repr_html_(self) -> str:
        rows = [
            [name, parameter, unit_text(p["unit"]), _figure(p["q50"]), _interval(p), p["determined_by"]]
            for name, test in self.summary()["experiments"].items()
            for parameter, p in test["parameters"].items()
        ]
        header = ["experiment", "parameter", "unit", "median", "90 % interval", "determined by"]
        return html_table(repr(self), header, rows, self.messages)


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
        return store.datatrees({name: posterior.folder for name, posterior in self.posteriors.items()})

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """Fits that did not converge."""
        return tuple(Notice("not-converged", line) for line in self.not_converged)

    def _short_form(self) -> list[str]:
        return [str(self.folder / "report.html"), f"{len(self.posteriors)} fits"]


def html_table(title: str, header: list[str], rows: list[list[str]], notes: tuple[str, ...] = ()) -> str:
    """A small table for notebooks.

    Parameters
    ----------
    title : str
    header : list of str
    rows : list of list of str
        As long as the header. All text is escaped.
    notes : tuple of str
        Paragraphs below the table.

    Returns
    -------
    str
    """
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    below = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<table><caption>{escape(title)}</caption><tr>{head}</tr>{body}</table>{below}"


def _figure(value: float | None) -> str:
    return "-" if value is None else f"{value:.{_FIGURES}g}"


def _interval(quantity: Quantiles) -> str:
    return f"{_figure(quantity['q05'])} to {_figure(quantity['q95'])}"


def _copy(source: Path, target: Path) -> None:
    """Copy a folder of results, whole files one by one, the mark that it is complete last."""
    files = [p for p in source.rglob("*") if p.is_file() and not p.name.startswith(".")]
    files.sort(key=lambda p: (p.name == COMPLETE, p.name != CONFIGURATION, str(p)))
    try:
        for path in files:
            copy = target / path.relative_to(source)
            copy.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(copy, path.read_bytes())
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}), expected a writable folder") from None
