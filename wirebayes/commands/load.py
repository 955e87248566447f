"""What a command or a function wrote, read back."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

from wirebayes.commands.fit import fits_in
from wirebayes.commands.options import path_of
from wirebayes.errors import InputError
from wirebayes.io.run_folder import COMPLETE, CONFIGURATION, read_json
from wirebayes.json_files.summary import SummaryJson
from wirebayes.strict.files import PathLike, given_path
from wirebayes.views.batch import Batch
from wirebayes.views.calibration import Calibration
from wirebayes.views.check import Check
from wirebayes.views.comparison import Comparison
from wirebayes.views.export import Export
from wirebayes.views.findings import Findings
from wirebayes.views.imported_tests import ImportedTests
from wirebayes.views.plan import Plan
from wirebayes.views.pose import Pose
from wirebayes.views.posterior import POSTERIOR, SUMMARY, Posterior
from wirebayes.views.reproduction import Reproduction
from wirebayes.views.result import Result, ResultFolder
from wirebayes.views.simulated_tests import SimulatedTests

_KINDS: dict[str, type[Result[Any]]] = {
    "batch": Batch,
    "compare": Comparison,
    "discover": Findings,
    "plan": Plan,
    "pose": Pose,
    "calibrate": Calibration,
    "export": Export,
    "simulate": SimulatedTests,
    "import": ImportedTests,
    "check": Check,
    "reproduce": Reproduction,
}


def load(folder: PathLike, *, own_effects: PathLike | None = None) -> Any:
    """Read back what a command wrote.

    Parameters
    ----------
    folder : path
        The ``--output`` of a command, or a folder with a ``posterior.nc``.
    own_effects : path, optional
        The Python file with effects of your own, where the command was given one and draws are computed with.

    Returns
    -------
    Posterior, Posteriors or another result
        What the function of the same name returns.

    Raises
    ------
    InputError
        There are no results of ours, or they are not finished.

    Examples
    --------
    >>> folder = posterior.save("my-fit")
    >>> wb.load(folder)
    Posterior(kite-1.5m, chain hooke saturating, converged)
    """
    place = ResultFolder(given_path("folder", folder))
    own = path_of(own_effects)
    path = place.path
    if (path / POSTERIOR).is_file():
        summary: SummaryJson = read_json(path / SUMMARY)
        name = str(summary["experiment"])
        return Posterior(place, own, computed=False, name=name)
    absent = f"{path}: found no {CONFIGURATION}, expected a folder of results"
    file = path / CONFIGURATION
    configuration = read_json(file, absent)
    command = None
    if isinstance(configuration, dict):
        command = configuration.get("command")
    if command != "fit" and command not in _KINDS:
        known = ", ".join(["fit", *_KINDS])
        raise InputError(f"{file}, key command: found {command!r}, expected one of {known}")
    if not (path / COMPLETE).is_file():
        raise InputError(f"{path}: found unfinished results, expected finished ones; run the same command again")
    if command == "fit":
        order = list(configuration.get("data_sha256", ()))
        return fits_in(place, _folders_of_fits(path, order), own)
    kind: Callable[..., Result[Any]] = _KINDS[str(command)]
    return kind(place, own, computed=False)


def _folders_of_fits(path: Path, order: list[str]) -> list[str]:
    """The folders with a posterior, in the order in which their experiments were given."""
    folders = [file.parent.name for file in sorted(path.glob(f"*/{POSTERIOR}"))]
    return sorted(folders, key=lambda name: order.index(name) if name in order else 0)
