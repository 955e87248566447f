"""``wirebayes import-robot``: a robot of CASPR, WireX or a firmware, turned into a robot file."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import Quiet, Seed


def import_robot_command(
    files: Annotated[
        list[Path],
        typer.Argument(
            metavar="FILE…",
            help="CASPR's bodies and cables (the other is found beside one), WireX's XML, or a Hangprinter's config.g "
            "or printer.cfg.",
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="ROBOT.toml", help="The robot file to write.")],
    tension: Annotated[
        str | None, typer.Option(metavar="LOW,HIGH", help="Bounds of the tensions, in newtons; WireX has none.")
    ] = None,
    position: Annotated[
        str | None, typer.Option(metavar="X,Y,Z", help="Home position, in metres; WireX has none.")
    ] = None,
    cable_set: Annotated[
        str | None, typer.Option("--cable-set", metavar="ID", help="Which of CASPR's cable sets.")
    ] = None,
    pulleys: Annotated[
        bool,
        typer.Option("--pulleys/--no-pulleys", help="Keep the pulleys' radii, or let the wires leave from points."),
    ] = True,
    seed: Seed = 0,
    quiet: Quiet = False,
) -> None:
    """Turn a robot of CASPR or WireX, or the settings of a Hangprinter, into a robot file."""
    from wirebayes.commands.import_robot import holds_home
    from wirebayes.commands.import_robot import import_robot as run
    from wirebayes.commands.wires import read_robot

    file = run(files, output, tension=tension, position=position, cable_set=cable_set, pulleys=pulleys)
    robot = read_robot(file)
    if not holds_home(robot):
        typer.echo(
            "no tensions within the bounds hold the platform at its home pose; give another --position or --tension",
            err=True,
        )
    if quiet:
        return
    rolling = 0
    if robot.pulleys is not None:
        rolling = int((robot.pulleys.radius_m > 0).sum())
    over = f", {rolling} of them over pulleys" if rolling else ""
    print(f"Written: {file}: {robot.legs} wires{over}, {robot.mass_kg:g} kg")
    for sentence in robot.source.strip().splitlines():
        print(f"  {sentence}")
    print(f"Next: wirebayes pose {file} --wires DIR")
