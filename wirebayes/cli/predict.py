"""`wirebayes predict`: the readings a posterior expects of a protocol."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from wirebayes.cli.options import ExperimentName, Seed

if TYPE_CHECKING:
    from wirebayes.results.store import Stored

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by fit or discover.")]
ProtocolFile = Annotated[
    Path, typer.Argument(metavar="PROTOCOL.csv", help="hold,displacement_mm,time_s[,temperature_C][,tension_N]")
]
ModelOption = Annotated[
    Literal["plain", "final"] | None,
    typer.Option("--model", help="In a folder of discover: the plain model or the final one (the default)."),
]
Table = Annotated[Path, typer.Option("--output", metavar="FILE.csv", help="The table to write.")]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Predict a fresh sample with no history instead of the tested one.")
]
OwnEffects = Annotated[
    Path | None, typer.Option("--own-effects", metavar="FILE.py", help="Your own effects, where the fit used them.")
]


def predict(
    folder: Folder,
    protocol: ProtocolFile,
    output: Table,
    experiment: ExperimentName = None,
    model: ModelOption = None,
    fresh: Fresh = False,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
) -> None:
    """Predict the readings of holds not measured yet.

    Holds of the training are answered as replicates. Holds with later numbers continue the tested sample: they begin
    when the last trained hold ended and are predicted given all training readings, whether or not PROTOCOL repeats
    training holds. With --fresh, PROTOCOL is the whole history of a fresh sample, its preload as uncertain as the
    fit's. A first reading in tension_N conditions its hold and those after it.
    """
    from wirebayes.io.run_folder import check_file, write_csv
    from wirebayes.prediction.request import read_question
    from wirebayes.prediction.table import HEADER, table

    stored = find_posterior(folder, experiment, model, own_effects)
    asked = read_question(protocol, stored, fresh=fresh)
    check_file(output)
    write_csv(output, HEADER, table(asked, seed))
    typer.echo(f"{protocol}: {asked.sentence}", err=True)


def find_posterior(
    folder: Path, experiment: str | None = None, model: str | None = None, own_effects: Path | None = None
) -> "Stored":
    """The posterior of an experiment in a folder of fit or discover, or in the folder that holds it itself.

    Raises
    ------
    InputError
        When there is none, several to choose from, or not the one asked for.
    """
    from wirebayes.errors import InputError
    from wirebayes.results.store import experiments_in, load

    if not folder.is_dir():
        raise InputError(f"{folder}: found no such folder, expected one written by fit or discover")
    found: dict[str, list[Path]] = {}
    levels = ("posterior.nc", "*/posterior.nc", "*/*/posterior.nc")
    for path in sorted(path for level in levels for path in folder.glob(level)):
        for name in experiments_in(path):
            found.setdefault(name, []).append(path.parent)
    if not found:
        raise InputError(f"{folder}: found no posterior.nc in it, expected a folder written by fit or discover")
    if experiment is None and len(found) > 1:
        raise InputError(f"{folder}: found {', '.join(sorted(found))}; expected one of them as --experiment")
    name = experiment or next(iter(found))
    if name not in found:
        raise InputError(f"--experiment {name}: not in {folder}, expected one of {', '.join(sorted(found))}")
    places = {place.name: place for place in found[name]}
    if model is None:
        if len(places) == 1:
            return load(next(iter(places.values())), name, own_effects)
        model = "final"
    if model not in places:
        raise InputError(f"--model {model}: {folder} has no such posterior of {name}; discover writes plain and final")
    return load(places[model], name, own_effects)
