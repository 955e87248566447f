"""Many experiments, each by itself: fitted, searched for missing effects, in one table that marks outliers."""

import os
import shutil
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, Executor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

from wirebayes._version import __version__
from wirebayes.commands.one_experiment import QUANTITIES, BatchTask, Done, do, empty_row, first_columns, packed
from wirebayes.commands.options import (
    check_priors,
    check_seed,
    check_train_holds,
    data_of,
    model_spec,
    names_given,
    other_effort,
    path_of,
)
from wirebayes.discovery.search import catalogue_without
from wirebayes.discovery.settings import SIMULATIONS
from wirebayes.effects import catalogue, source_of
from wirebayes.errors import InputError
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.data_checks import copied_tests
from wirebayes.io.experiment import Experiment, folder_key
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.run_folder import check_run, open_run, read_json, write_bytes, write_csv, write_json, write_parquet
from wirebayes.json_files.batch import BatchJson, OutlierRow, Row
from wirebayes.model.sample import MATERIAL, SAMPLE
from wirebayes.processes.workers import as_finished, computing, executor
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import Notice, NoticeJson, from_json, notices_by_part, to_json
from wirebayes.results.outliers import outliers
from wirebayes.strict.files import PathLike
from wirebayes.views.batch import Batch
from wirebayes.views.result import ResultFolder
from wirebayes.wire.effect import Kinds
from wirebayes.wire.laws import ElasticLaw, History

TABLE, PARQUET = "summary.csv", "summary.parquet"
_ROW = "row.json"  # an experiment's row, written behind all its other files: with it, the experiment is done
_SCRATCH = ".computing"
_LISTED = 5  # unreadable files named in an error: as many as a person mends at once
_TRIES = 3  # times that a dead process may take the others of its pool with it; more is no accident
_FIRST = ("name", "material", "file", "length_mm", "control", "holds", "readings", "converged")
_LAST = ("verdict", "effects", "best_effect", "p_global", "check", "outlier", "warnings", "error")

Sources = PathLike | Experiment | Iterable[PathLike | Experiment]
_WithFile = tuple[Experiment, str]  # and the name of the file that it came from


def batch(
    sources: Sources,
    *,
    discover: bool = True,
    check: bool = True,
    posteriors: bool = True,
    keep_going: bool = False,
    train_holds: int | None = None,
    elastic_law: ElasticLaw = "hooke",
    history: History = "saturating",
    without: str | Sequence[str] = (),
    own_effects: PathLike | None = None,
    scheduler: str | None = None,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress | None = None,
    policy: Policy | None = None,
    simulations: int | None = None,
) -> Batch:
    """Fit and discover many experiments, each on its own, and tabulate them.

    Parameters
    ----------
    sources : path, Experiment, or sequence of them
        Experiment files, all of whose experiments count. Where several have one name, the name of the file is put
        before it.
    discover : bool
        Find what the plain model is missing in each; otherwise fit the plain model only.
    check : bool
        Where nothing is discovered: check each fit against refitted simulations. (A discovery includes the check.)
    posteriors : bool
        Store the draws of each experiment, some 3 MB a fit; otherwise only the summaries.
    keep_going : bool
        Give an unreadable file a row that says what is wrong with it; otherwise it is an error, before any work.
    train_holds : int, optional
        Use the first so many recorded holds only.
    elastic_law, history
        As in `fit`.
    without : sequence of str
        Effects to leave out of the catalogue.
    own_effects : path, optional
        A Python file with effects of your own; workers of a cluster must find it under the same path.
    scheduler : str, optional
        Address of a Dask scheduler whose workers do the work; the processes of this machine when left out.
    seed : int
        Every experiment has a seed of its own, made of this and its name: results do not depend on who computes what.
    output : path, optional
        Folder for the results, resumed or refused as by `fit`.
    progress : function of (name, done, total), optional
    policy : Policy, optional
        How many walkers and draws the fits have.
    simulations : int, optional
        Refitted data sets behind each p-value, half of them where these decide; 999 when left out.

    Returns
    -------
    Batch

    Raises
    ------
    InputError
        Something that was given is wrong; nothing was computed.

    Examples
    --------
    >>> tests = wb.simulate_tests(tests=2, displacements=range(1, 6), times=[0, 30, 60], seed=1)
    >>> many = wb.batch(tests.experiments, discover=False, check=False, policy=few, output="out/batch")
    >>> many
    Batch(2 experiments, 2 converged, 0 outliers, 0 failed)
    >>> [row["name"] for row in many.rows]
    ['wire-1', 'wire-2']
    """
    spec = model_spec(elastic_law, history)
    seed = check_seed(seed)
    train_holds = check_train_holds(train_holds)
    own = path_of(own_effects)
    left_out = names_given("without", without)
    catalogue_without(left_out, catalogue(own))
    read, unreadable = _read(sources, catalogue(own), train_holds, keep_going)
    experiments = [experiment for experiment, _ in read]
    effort = policy or DEFAULT
    checked = simulations or SIMULATIONS
    task = BatchTask(discover, check, spec, seed, effort, left_out, own, checked, posteriors)
    configuration = {
        "command": "batch",
        "version": __version__,
        "seed": seed,
        "discover": discover,
        "check": check,
        "posteriors": posteriors,
        "elastic_law": elastic_law,
        "history": history,
        "without": sorted(left_out),
        "own_effects": source_of(own),
        "train_holds": train_holds,
        **data_of(experiments),
        "unreadable": unreadable,
        **other_effort(policy, simulations),
    }
    place = ResultFolder.at(output)
    path = place.path
    if check_run(path, configuration) == "done":
        return Batch(place, own, computed=False)
    with computing():
        _compute(read, task, path, configuration, scheduler, progress or silent)
    with open_run(path, configuration) as run:
        rows = _rows(experiments, path)
        rows += [_empty(file, error) for file, error in unreadable.items()]
        _tabulate(rows, outliers(rows), path)
        run.finish()
    return Batch(place, own)


def _rows(experiments: Sequence[Experiment], folder: Path) -> list[Row]:
    """The row of each experiment, with what is said of readings that another one has, too."""
    tests = {e.name: CheckedTest(e.protocol(), e.readings(), e.resolution) for e in experiments}
    copied = copied_tests(tests)
    rows = []
    for experiment in experiments:
        row: Row = read_json(folder / experiment.name / _ROW)
        row["warnings"] = to_json([*copied.get(experiment.name, ()), *from_json(row["warnings"])])
        rows.append(row)
    return rows


def _read(
    sources: Sources, kinds: Kinds, train_holds: int | None, keep_going: bool
) -> tuple[list[_WithFile], dict[str, str]]:
    """Every experiment with the file it came from, and what is wrong with the files that cannot be read."""
    given = list(sources) if isinstance(sources, Iterable) and not isinstance(sources, str) else [sources]
    read: list[_WithFile] = []
    wrong: dict[str, str] = {}
    for source in given:
        if isinstance(source, Experiment):
            file = source.source.name
        elif isinstance(source, str | os.PathLike):
            file = str(source)
        else:
            raise InputError(f"sources: found {type(source).__name__}, expected paths of files or Experiments")
        try:
            found = _experiments(source, kinds, train_holds)
        except InputError as error:
            wrong[file] = str(error)
            continue
        read += [(experiment, file) for experiment in found]
    if wrong and not (keep_going and read):
        errors = list(wrong.values())
        listed = "; ".join(errors[:_LISTED])
        if len(errors) > _LISTED:
            listed += f"; and {len(errors) - _LISTED} more files"
        raise InputError(listed)
    if not read:
        raise InputError("sources: found no experiments, expected one or more")
    return _distinct(read), wrong


def _experiments(source: PathLike | Experiment, kinds: Kinds, train_holds: int | None) -> list[Experiment]:
    """The experiments of a file, checked."""
    found = [source] if isinstance(source, Experiment) else read_experiments(Path(source))
    if train_holds is not None:
        found = [experiment.first(train_holds) for experiment in found]
    for experiment in found:
        check_priors([experiment], kinds)
    return found


def _distinct(read: list[_WithFile]) -> list[_WithFile]:
    """The experiments, those whose folders would be one with the name of their file before their own."""
    times = Counter(folder_key(experiment.name) for experiment, _ in read)
    distinct = []
    by_folder: dict[str, str] = {}
    for experiment, file in read:
        name = experiment.name
        if times[folder_key(name)] > 1:
            stem = Path(file).stem
            name = f"{stem}.{name}"
            experiment = replace(experiment, name=name)
        taken = ""
        if folder_key(name) in by_folder:
            taken = f"a second time (first in {by_folder[folder_key(name)]})"
        elif name in (TABLE, PARQUET):
            taken = "which is a file of the results"
        if taken:
            raise InputError(f"{file}: found the experiment {name} {taken}, expected another name")
        by_folder[folder_key(name)] = file
        distinct.append((experiment, file))
    return distinct


def _compute(
    read: Sequence[_WithFile],
    task: BatchTask,
    folder: Path,
    configuration: Mapping[str, Any],
    scheduler: str | None,
    progress: Progress,
) -> None:
    """Do whatever has no row yet; a process that dies takes no result with it."""
    for left in reversed(range(_TRIES)):
        todo = [(experiment, file) for experiment, file in read if not (folder / experiment.name / _ROW).is_file()]
        if not todo:
            return
        already = len(read) - len(todo)
        try:
            # the folder is opened when there is somebody to do the work
            with (
                executor(scheduler, len(todo)) as pool,
                open_run(folder, configuration),
                _scratch(folder, scheduler) as scratch,
            ):
                progress("experiments", already, len(read))
                results = _results(pool, todo, replace(task, scratch=scratch))
                for done, (name, result) in enumerate(results, already + 1):
                    _store(result, folder / name)
                    progress("experiments", done, len(read))
            return
        except BrokenProcessPool:
            if not left:
                lost = "processes died again and again, perhaps for want of memory"
                raise InputError(f"{folder}: {lost}; run the same command again to go on") from None
        except CancelledError:
            lost = f"the scheduler {scheduler} is gone"
            raise InputError(f"{folder}: {lost}; start another and run the same command again to go on") from None


@contextmanager
def _scratch(folder: Path, scheduler: str | None) -> Iterator[Path | None]:
    """Where processes of this machine compute, so that what they leave when they are killed is found and removed."""
    path = folder.absolute() / _SCRATCH
    shutil.rmtree(path, ignore_errors=True)
    if scheduler is not None:
        yield None
        return
    path.mkdir()
    try:
        yield path
    finally:
        shutil.rmtree(path, ignore_errors=True)


def _results(pool: Executor, todo: Sequence[_WithFile], task: BatchTask) -> Iterator[tuple[str, Done]]:
    """Name and result of each experiment as they end."""
    work = (((experiment, file), packed(experiment, file, task)) for experiment, file in todo)
    for (experiment, file), future in as_finished(pool, do, work):
        error = future.exception()
        if error is None:
            yield experiment.name, future.result()
        elif type(error).__name__ == "KilledWorker":  # Dask's, for work whose workers died again and again
            row = first_columns(experiment, file) | {"error": f"KilledWorker: {error}"}
            yield experiment.name, Done(row, {})
        else:
            raise error


def _store(done: Done, folder: Path) -> None:
    folder.mkdir(exist_ok=True)
    for name, content in done.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, content)
    write_json(folder / _ROW, done.row)


def _empty(file: str, error: str) -> Row:
    """The row of a file that could not be read."""
    return {**empty_row(Path(file).stem, file), "error": error}


def _tabulate(rows: Sequence[Row], far: Sequence[OutlierRow], folder: Path) -> None:
    """``batch.json``, ``summary.csv`` and, where pyarrow is installed, ``summary.parquet``."""
    measured = {name for row in rows for name in row["parameters"]}
    names = [name for name in (*MATERIAL, *SAMPLE) if name in measured]
    columns = [f"{name}_{quantile}" for name in names for quantile in QUANTITIES]
    header = [*_FIRST, *columns, *_LAST]
    table = [_line(row, far, names) for row in rows]
    write_csv(folder / TABLE, header, table)
    write_parquet(folder / PARQUET, header, table)
    warnings = _warnings(rows)
    content: BatchJson = {"version": 1, "experiments": list(rows), "outliers": list(far), "warnings": warnings}
    write_json(folder / Batch._content, content)


def _warnings(rows: Sequence[Row]) -> list[NoticeJson]:
    """What could not be computed, and what each experiment's own warnings are."""
    failed = [Notice("failed", f"{row['name']}: {row['error']}") for row in rows if row["error"]]
    by_name = {row["name"]: row for row in rows}
    return to_json([*failed, *from_json(notices_by_part(by_name))])


def _line(row: Row, far: Sequence[OutlierRow], names: Sequence[str]) -> list[Any]:
    """The cells of an experiment."""
    cells = _cells(row, far)
    parameters: dict[str, Any] = dict(row["parameters"])
    line = [cells[key] for key in _FIRST]
    for name in names:
        of_parameter = parameters.get(name, {})
        line += [of_parameter.get(quantile) for quantile in QUANTITIES]
    line += [cells[key] for key in _LAST]
    return line


def _cells(row: Row, far: Sequence[OutlierRow]) -> dict[str, Any]:
    """What an experiment's row says, lists as texts."""
    outliers_in = [outlier["parameter"] for outlier in far if outlier["experiment"] == row["name"]]
    warned = [notice["text"] for notice in row["warnings"]]
    texts = {"effects": row["effects"], "outlier": outliers_in, "warnings": warned}
    return {**row, **{key: "; ".join(items) or None for key, items in texts.items()}}
