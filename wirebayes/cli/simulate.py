"""``wirebayes simulate``: synthetic tests with known truth, as files the other commands read."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import ElasticLawOption, HistoryOption, OutputOfNoFile, OwnEffects, Seed


def simulate_command(
    output: OutputOfNoFile = None,
    seed: Seed = 0,
    tests: Annotated[
        int, typer.Option("--tests", min=1, help="Number of lines tested, each with its own true parameters.")
    ] = 1,
    lengths: Annotated[
        str,
        typer.Option(
            "--lengths", metavar="MM,…", help="Zero-tension lengths; one sample of each line for each length."
        ),
    ] = "1000",
    displacements: Annotated[
        str, typer.Option("--displacements", metavar="MM,…", help="One displacement per hold.")
    ] = "1,2,3,4,5,6,7,8,9,10,11,12",
    weights: Annotated[
        str,
        typer.Option(
            "--weights", metavar="N,…", help="One weight per hold, in place of displacements, which are read then."
        ),
    ] = "",
    unload: Annotated[
        int,
        typer.Option("--unload", min=0, metavar="K", help="Add K holds that go back down through the same settings."),
    ] = 0,
    times: Annotated[
        str, typer.Option("--times", metavar="S,…", help="Times of the readings of a hold, in seconds.")
    ] = "0,30,60,90,120",
    unrecorded: Annotated[
        list[int] | None, typer.Option("--unrecorded", metavar="HOLD", help="A hold without readings; may be repeated.")
    ] = None,
    temperature: Annotated[
        str, typer.Option("--temperature", metavar="C,…", help="Temperatures at evenly spaced moments of the test.")
    ] = "",
    resolution: Annotated[
        float,
        typer.Option("--resolution", min=0.0, metavar="N", help="Rounding of what is read, N or mm; 0: unrounded."),
    ] = 0.01,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter",
            metavar="NAME=VALUE",
            help="A true value, for example k1=700; others are drawn from the prior. With several lengths B is that of "
            "their geometric mean.",
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect",
            metavar="NAME.p=VALUE",
            help="An effect to add, for example strain_stiffening.c=12 or grip_slip@7.w=0.2.",
        ),
    ] = None,
    own_effects: OwnEffects = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
) -> None:
    """Write synthetic tests: DIR/experiments.toml, a CSV for each test, and DIR/truth.json."""
    from wirebayes.cli.answer import print_answer
    from wirebayes.commands.simulate_tests import simulate_tests
    from wirebayes.errors import InputError
    from wirebayes.simulation.stated_truth import finite_number

    chosen = {}
    for text in parameter or ():
        name, _, value = text.partition("=")
        if name in chosen:
            raise InputError(f"--parameter {text}: found {name} a second time, expected it once")
        chosen[name] = finite_number(f"--parameter {text}", value)
    made = simulate_tests(
        tests=tests,
        lengths=lengths,
        displacements=displacements,
        weights=weights,
        unload=unload,
        times=times,
        unrecorded=unrecorded or (),
        temperature=temperature,
        resolution=resolution,
        parameters=chosen,
        effects=effect or (),
        own_effects=own_effects,
        elastic_law=elastic_law,
        history=history,
        seed=seed,
        output=Path("simulated") if output is None else output,
    )
    print_answer(made)
