"""The readings that a posterior expects of a protocol."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, Literal

from wirebayes.commands.options import check_choice, check_seed, path_of
from wirebayes.errors import InputError
from wirebayes.io.arrays import protocol_of_columns
from wirebayes.io.readings import protocol_table
from wirebayes.io.run_folder import check_file, write_csv
from wirebayes.prediction.given_back import let_back
from wirebayes.prediction.mixture import drawn_readings
from wirebayes.prediction.request import ProtocolRequest, request_of
from wirebayes.prediction.table import (
    Prediction,
    beyond_tested,
    dataset,
    header,
    mixture_table,
    unlikely_readings,
    without_readings,
)
from wirebayes.result_warnings import Notice, to_json
from wirebayes.results import read_back
from wirebayes.results.mixture import load_models
from wirebayes.results.read_back import Stored
from wirebayes.strict.columns import is_table
from wirebayes.strict.files import PathLike
from wirebayes.strict.table import CsvTable
from wirebayes.views.findings import Findings
from wirebayes.views.posterior import Posterior, Posteriors
from wirebayes.wire.protocol import Control


def predict(
    posterior: PathLike | Posterior | Posteriors | Findings,
    protocol: Any,
    *,
    experiment: str | None = None,
    model: Literal["plain", "final"] | None = None,
    fresh: bool = False,
    own_effects: PathLike | None = None,
    seed: int = 0,
    output: PathLike | None = None,
) -> Prediction:
    """Predict the readings of holds not measured yet.

    Holds of the training are predicted as replicates. Holds with later numbers continue the tested sample: they begin
    when the last trained hold ended and are predicted given all training readings.

    Parameters
    ----------
    posterior : Posterior, Findings, or path of a folder written by fit or discover
    protocol : path of a CSV, DataFrame, or mapping of name to (r,) array
        Columns ``hold``, ``displacement_mm``, ``time_s``, with ``temperature_C`` where the training data had it, and
        optionally ``tension_N``: a first reading of a hold, which conditions the prediction, else NaN. Of a test under
        weights ``tension_N`` and ``displacement_mm`` change places.
    experiment : str, optional
        Which one, where there are several.
    model : {"plain", "final"}, optional
        Of findings: the plain model, or the final one, which is the default.
    fresh : bool
        The protocol is the whole history of a fresh sample instead.
    own_effects : path, optional
        A Python file with effects of your own, where the fit used one and was read from a folder.
    seed : int
    output : path, optional
        A CSV file to write, with a row for each row of the protocol.

    Returns
    -------
    Prediction
        An `xarray.Dataset` whose ``plot()`` draws medians and bands. Dimension ``reading``, a row of the protocol
        each; variables ``mean_N``, ``sd_N``, ``q05_N``, ``q50_N``, ``q95_N`` (``mean_mm`` … under weights) with units
        as attributes. The attribute ``prediction`` says which sample was predicted, given what; ``warnings``, where
        there is one, what speaks against the posterior, what lies far beyond the tested range, and which given readings
        are far from what was expected; ``warning_kinds`` has the kind of each.

    Raises
    ------
    InputError
        The protocol does not follow from the training, with the row or line and the column; or no such posterior.

    Examples
    --------
    >>> protocol = {"hold": [7, 7], "displacement_mm": [7, 7], "time_s": [0, 60]}
    >>> predicted = wb.predict(posterior, protocol)
    >>> predicted["mean_N"].dims, predicted["mean_N"].attrs["units"]
    (('reading',), 'N')
    >>> bool(predicted["mean_N"][0] > predicted["mean_N"][1])  # the wire creeps
    True
    """
    own = path_of(own_effects)
    if model is not None:
        check_choice("model", model, ("plain", "final"))
    members = stored_posteriors(posterior, experiment, model, own)
    _, first = members[0]
    control = first.sample.protocol.control
    cells = _cells(protocol, control)
    requests = [(probability, request_of(cells, stored, fresh=fresh)) for probability, stored in members]
    seed = check_seed(seed)
    file = path_of(output, "output")
    if file is not None:
        _check_output(file, protocol)
    drawn = drawn_readings(requests, seed)
    _, asked = requests[0]
    rows = mixture_table(drawn, asked)
    if file is not None:
        write_csv(file, header(control), rows)
    doubts = [doubt for _, stored in members for doubt in stored.doubts]
    doubts += beyond_tested(rows, first)
    doubts += without_readings(drawn, asked)
    doubts += let_back(rows, first, fresh=fresh)
    doubts += unlikely_readings(requests, seed)
    attributes = {"prediction": _sentence(requests), "seed": seed, **_warnings(doubts)}
    return dataset(rows, attributes, control)


def _warnings(doubts: Sequence[Notice]) -> dict[str, Any]:
    """What speaks against a prediction, in two attributes because netCDF holds text but no mappings."""
    notices = to_json(doubts)
    if not notices:
        return {}
    return {
        "warnings": [notice["text"] for notice in notices],
        "warning_kinds": [notice["kind"] for notice in notices],
    }


def _sentence(requests: Sequence[tuple[float, ProtocolRequest]]) -> str:
    """What is predicted, and of how many models."""
    _, asked = requests[0]
    models = len(requests)
    if models == 1:
        return asked.sentence
    averaged = f"averaged over the {models} models that the readings leave undecided, weighted by probability"
    return f"{asked.sentence}; {averaged}"


def _cells(protocol: Any, control: Control) -> CsvTable:
    """The table of a protocol, from columns or a file."""
    if is_table(protocol):
        return protocol_of_columns(protocol, control)
    if isinstance(protocol, str | os.PathLike):
        return protocol_table(Path(protocol), control)
    raise InputError(f"protocol: found {type(protocol).__name__}, expected a file, a DataFrame or columns by name")


def _check_output(output: Path, protocol: Any) -> None:
    """Refuse a file that cannot be written, or that is the protocol."""
    check_file(output)
    if isinstance(protocol, str | os.PathLike) and output.exists() and output.samefile(protocol):
        raise InputError(f"--output {output}: found the protocol itself, expected another file")


def stored_posteriors(
    posterior: PathLike | Posterior | Posteriors | Findings,
    experiment: str | None,
    model: str | None,
    own_effects: Path | None,
) -> list[tuple[float, Stored]]:
    """Draws and models of one experiment with their probabilities, from what `predict` is given.

    More than one where `discover` left undecided which effects are missing.

    Parameters
    ----------
    posterior : path, Posterior, Posteriors or Findings
        A folder that `fit` or `discover` wrote, or what they returned.
    experiment : str or None
        May be left out where there is one.
    model : {"plain", "final"} or None
        Of what `discover` found; final when left out.
    own_effects : Path or None
        File of a user's own effects, for a folder.

    Returns
    -------
    list of (probability, Stored)

    Raises
    ------
    InputError
        If there is no such posterior, or several to choose from.
    """
    if isinstance(posterior, str | os.PathLike):
        name, folder = find_posterior(Path(posterior), experiment, model)
        return load_models(folder, name, own_effects)
    if isinstance(posterior, Posterior):
        return load_models(posterior.folder, experiment, posterior.own_effects)
    if isinstance(posterior, Findings):
        several: Mapping[str, Posterior] = posterior.plain if model == "plain" else posterior.final
    elif isinstance(posterior, Posteriors):
        several = posterior
    else:
        raise InputError(f"posterior: found {type(posterior).__name__}, expected a Posterior, Findings or a folder")
    one = one_of(several, experiment)
    return load_models(one.folder, None, one.own_effects)


def one_of(posteriors: Mapping[str, Posterior], experiment: str | None) -> Posterior:
    """The posterior of the named experiment, or the only one."""
    if experiment is None and len(posteriors) > 1:
        raise InputError(f"experiment: found none, expected one of {', '.join(posteriors)}")
    name = next(iter(posteriors)) if experiment is None else experiment
    if name not in posteriors:
        raise InputError(f"experiment: found {name!r}, expected one of {', '.join(posteriors)}")
    return posteriors[name]


def _folders_by_experiment(folder: Path) -> dict[str, list[Path]]:
    """Where the posteriors of each experiment lie in a folder."""
    found: dict[str, list[Path]] = {}
    files = [file for level in _LEVELS for file in folder.glob(level)]
    for file in sorted(files):
        for name in read_back.experiments_in(file):
            folders = found.setdefault(name, [])
            folders.append(file.parent)
    return found


def find_posterior(folder: Path, experiment: str | None, model: str | None) -> tuple[str, Path]:
    """Find the posterior of one experiment in a folder.

    Parameters
    ----------
    folder : Path
        What `fit` or `discover` wrote, or the folder of one posterior itself.
    experiment : str or None
        May be left out where there is one.
    model : {"plain", "final"} or None
        Of what `discover` found; final when left out.

    Returns
    -------
    name : str
        Of the experiment.
    folder : Path
        The one that holds ``posterior.nc``.

    Raises
    ------
    InputError
        If there is none, several to choose from, or not the one requested.
    """
    if not folder.is_dir():
        raise InputError(f"{folder}: found no such folder, expected one written by fit or discover")
    found = _folders_by_experiment(folder)
    if not found:
        raise InputError(f"{folder}: found no posterior.nc in it, expected a folder written by fit or discover")
    listed = ", ".join(sorted(found))
    if experiment is None and len(found) > 1:
        raise InputError(f"{folder}: found {listed}, expected one of them as --experiment")
    name = experiment or next(iter(found))
    if name not in found:
        raise InputError(f"--experiment {name}: not in {folder}, expected one of {listed}")
    if model is None and folder in found[name]:
        return name, folder
    places = {place.name: place for place in found[name]}
    if model is None and len(places) == 1:
        (only,) = places.values()
        return name, only
    model = model or "final"
    if model not in places:
        raise InputError(f"--model {model}: {folder} has no such posterior of {name}; discover writes plain and final")
    return name, places[model]


_LEVELS = ("posterior.nc", "*/posterior.nc", "*/*/posterior.nc")
