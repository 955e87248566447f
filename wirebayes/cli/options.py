"""Options that several commands share, named and explained once.

Use them as annotations: ``def fit(file: ExperimentFile, output: Output, seed: Seed = 0) -> None``.
"""

from pathlib import Path
from typing import Annotated, Literal

import typer


def _seed(value: int) -> int:
    if value < 0:
        raise typer.BadParameter(f"found {value}, expected a whole number, 0 or more")
    return value


ExperimentFile = Annotated[
    Path, typer.Argument(metavar="FILE.toml", help="Experiments; their CSV files lie in the same folder.")
]
Output = Annotated[
    Path | None,
    typer.Option(
        "--output", metavar="DIR", help="Folder for the results; default: named after the file and the command."
    ),
]
OutputOfNoFile = Annotated[
    Path | None,
    typer.Option("--output", metavar="DIR", help="Folder for the results; default: named after the command."),
]
Seed = Annotated[
    int,
    typer.Option(
        "--seed", callback=_seed, help="Seed of all random numbers; the same seed gives the same bytes on one machine."
    ),
]
ExperimentName = Annotated[str | None, typer.Option("--experiment", metavar="NAME", help="This experiment only.")]
TrainHolds = Annotated[
    int | None, typer.Option("--train-holds", metavar="K", help="Fit the first K recorded holds only.")
]
ElasticLawOption = Annotated[
    Literal["hooke", "modified"],
    typer.Option("--elastic-law", help="Strain relative to zero-tension length, eq (1), or stretched length, eq (3)."),
]
HistoryOption = Annotated[
    Literal["saturating", "additive"],
    typer.Option("--history", help="Creep saturates towards one total amount, or adds a new amount in every hold."),
]
LikelihoodOption = Annotated[
    Literal["chain", "hold"],
    typer.Option("--likelihood", help="Treat the holds as one history, or each hold separately."),
]
OwnEffects = Annotated[
    Path | None, typer.Option("--own-effects", metavar="FILE.py", help="A Python file with effects of your own.")
]
DropBreaks = Annotated[
    bool, typer.Option("--drop-breaks", help="Leave out readings of breaks, of a sensor at its limit, and of dropouts.")
]
AsJson = Annotated[bool, typer.Option("--json", help="Print the summary as JSON instead of a few lines.")]
Quiet = Annotated[bool, typer.Option("--quiet", help="Print nothing on standard output.")]
Without = Annotated[
    list[str] | None,
    typer.Option("--without", metavar="EFFECT", help="Leave an effect out of the catalogue; may be repeated."),
]
Scheduler = Annotated[
    str | None,
    typer.Option("--scheduler", metavar="ADDRESS", help="Compute on the workers of this Dask scheduler."),
]
_USUAL = {"elastic_law": "hooke", "history": "saturating"}  # of options that every fit has


def folder_for(command: str, file: Path | str, output: Path | None, experiment: str | None = None) -> Path:
    """The folder of a command's results: as asked for, or named after what it reads and what it does.

    Parameters
    ----------
    command : str
    file : Path or str
        The experiment file, or the robot.
    output : Path or None
    experiment : str, optional
        The only one of the file's experiments that is read.
    """
    if output is not None:
        return output
    stem = Path(file).stem
    read = stem if experiment in (None, stem) else f"{stem}-{experiment}"
    return Path(f"{read}-{command}")


def as_typed(file: Path, **options: str | int | Path | None) -> str:
    """An experiment file as it is typed for the next command, with the options that are to stay.

    Parameters
    ----------
    file : Path
    options : of str, int, Path, bool or None
        By their names in Python. Those that were not given, or have the value that they have when left out, are not
        typed.
    """
    from wirebayes.views.result import typed

    words = [typed(file)]
    for name, value in options.items():
        flag = f"--{name.replace('_', '-')}"
        if value is True:
            words.append(flag)
        elif value not in (None, False, _USUAL.get(name)):
            words.append(f"{flag} {typed(str(value))}")
    return " ".join(words)
