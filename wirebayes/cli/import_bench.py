"""``wirebayes import``: files of test benches, turned into experiment files."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from wirebayes.cli.options import AsJson, DropBreaks, Output, Quiet, Seed

if TYPE_CHECKING:
    from wirebayes.io.bench.undecided import Undecided


def import_command(
    raw: Annotated[
        list[Path],
        typer.Argument(metavar="RAW…", help="Files of a bench or folders of them, text or xlsx; one experiment each."),
    ],
    length_mm: Annotated[
        float, typer.Option("--length-mm", metavar="L", help="Zero-tension length of the sample before the test.")
    ],
    output: Output = None,
    material: Annotated[
        str | None,
        typer.Option("--material", metavar="M", help="Samples of one material may be fitted together; default: N."),
    ] = None,
    name: Annotated[
        str | None,
        typer.Option(
            "--name", metavar="N", help="Name of the experiment, where it is the only one; default: that of its file."
        ),
    ] = None,
    mapping: Annotated[
        list[str] | None,
        typer.Option(
            "--map",
            metavar="HEADER=COLUMN",
            help="COLUMN is hold, displacement, time, tension, temperature or ignore; the unit is read from HEADER, or "
            "given: 'Kraft=tension [N]' (a minus changes the sign: [-N]). May be repeated.",
        ),
    ] = None,
    decimal: Annotated[
        Literal["point", "comma"] | None, typer.Option("--decimal", help="The decimal sign, where it is not evident.")
    ] = None,
    time_since: Annotated[
        Literal["hold", "test"] | None,
        typer.Option("--time-since", help="What times count from, where it is not evident."),
    ] = None,
    sheet: Annotated[
        str | None,
        typer.Option("--sheet", metavar="NAME", help="The sheet to read, where a workbook has readings in several."),
    ] = None,
    zero_mm: Annotated[
        float | None,
        typer.Option("--zero-mm", metavar="MM", help="Displacement at which the wire has its zero-tension length."),
    ] = None,
    area_mm2: Annotated[
        float | None,
        typer.Option("--area-mm2", metavar="A", help="Cross-section of the sample, for stresses."),
    ] = None,
    control: Annotated[
        Literal["displacement", "force"] | None,
        typer.Option("--control", help="What was set in each hold, where it is not evident; force: weights."),
    ] = None,
    specimens: Annotated[
        Literal["several", "one"] | None,
        typer.Option(
            "--specimens",
            help="Whether columns side by side, or tests one below another, are of several specimens or of one.",
        ),
    ] = None,
    each_file: Annotated[
        str | None,
        typer.Option(
            "--each-file",
            metavar="WHAT",
            help="What each of several files is: test, a hold of one test, or what was set in each: '1 mm, 2 mm'.",
        ),
    ] = None,
    drop_breaks: DropBreaks = False,
    seed: Seed = 0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Turn files of test benches into experiment files: DIR/N.toml, DIR/N.csv, and DIR/N.svg to look at.

    Each file is one experiment, named N after it, or one for each of the specimens in it; several also stand
    together in DIR/experiments.toml. With --each-file hold they are holds of one test.
    Delimiter, decimal comma, encoding, preamble, units and columns are recognised, times of the whole test and
    continuous recordings are divided into holds. Ambiguous input leads to a question on a terminal and to an error
    elsewhere.
    """
    from wirebayes.cli.answer import print_answer
    from wirebayes.commands.import_bench import import_bench as run

    imported = run(
        raw,
        length_mm=length_mm,
        material=material,
        name=name,
        mapping=mapping or (),
        decimal=decimal,
        time_since=time_since,
        sheet=sheet,
        zero_mm=zero_mm,
        area_mm2=area_mm2,
        control=control,
        specimens=specimens,
        each_file=each_file,
        drop_breaks=drop_breaks,
        output=Path(raw[0].stem) if output is None else output,
        ask=_ask if sys.stdin.isatty() and sys.stderr.isatty() else None,
    )
    print_answer(imported, as_json=as_json, quiet=quiet)


def _ask(question: "Undecided") -> str:
    """Ask a person on the terminal; the number chosen is the answer's."""
    from wirebayes.io.bench.undecided import quoted

    options = list(question.answers)
    typer.echo(f"{question.found}. Please say {question.question}:", err=True)
    for i, (option, meaning) in enumerate(question.answers.items(), start=1):
        typer.echo(f"  {i}  {meaning}  ({quoted(option)})", err=True)
    while True:
        number = typer.prompt("Number", type=int, err=True)
        if 1 <= number <= len(options):
            return options[number - 1]
