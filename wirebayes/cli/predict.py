"""`wirebayes predict`: the readings a posterior expects of a protocol."""

import sys
from pathlib import Path
from typing import Annotated, Literal

import typer

from wirebayes.cli.options import AsJson, ExperimentName, Quiet, Seed

Folder = Annotated[Path, typer.Argument(metavar="DIR", help="A folder written by fit or discover.")]
ProtocolFile = Annotated[
    Path,
    typer.Argument(
        metavar="PROTOCOL.csv",
        help="With columns hold,displacement_mm,time_s[,temperature_C][,tension_N]; under weights, "
        "displacement_mm and tension_N swap roles.",
    ),
]
ModelOption = Annotated[
    Literal["plain", "final"] | None,
    typer.Option("--model", help="In a folder of discover: the plain model or the final one (the default)."),
]
Table = Annotated[
    Path | None,
    typer.Option(
        "--output",
        metavar="FILE.csv",
        help="The table, with a page beside it; default: named after PROTOCOL.",
    ),
]
Fresh = Annotated[
    bool, typer.Option("--fresh", help="Predict a fresh sample with no history instead of the tested one.")
]
OwnEffects = Annotated[
    Path | None, typer.Option("--own-effects", metavar="FILE.py", help="Your own effects, where the fit used them.")
]


def predict_command(
    folder: Folder,
    protocol: ProtocolFile,
    output: Table = None,
    experiment: ExperimentName = None,
    model: ModelOption = None,
    fresh: Fresh = False,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Predict the readings of holds not measured yet.

    Holds of the test are predicted as replicates. Holds with later numbers continue the test: they begin when its last
    hold ended and are predicted given all its readings, whether or not PROTOCOL repeats holds of the test. With
    --fresh, PROTOCOL is the whole history of a fresh sample, its preload as uncertain as the fit's. A first reading
    in tension_N conditions its hold and those after it.
    """
    from wirebayes.answers.lines import for_terminal
    from wirebayes.cli.answer import print_json
    from wirebayes.commands.predict import predict as run
    from wirebayes.report.pages.predict import in_a_sentence, write_beside

    table = protocol.with_name(f"{protocol.stem}-predicted.csv") if output is None else output
    predicted = run(
        folder,
        protocol,
        experiment=experiment,
        model=model,
        fresh=fresh,
        own_effects=own_effects,
        seed=seed,
        output=table,
    )
    page = write_beside(predicted, table)
    if as_json:
        print_json(predicted.summary())
    elif not quiet:
        typer.echo("\n".join(for_terminal([in_a_sentence(predicted)])))
    warnings = [f"warning: {warning}" for warning in predicted.attrs.get("warnings", [])]
    for line in for_terminal([*warnings, f"{protocol}: {predicted.attrs['prediction']}"], sys.stderr):
        typer.echo(line, err=True)
    if not (as_json or quiet):
        typer.echo(f"Results: {table} (open {page})")
