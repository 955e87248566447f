"""The robot's commands: `pose`, `calibrate` and `export`."""

from pathlib import Path
from typing import Annotated

import typer

from wirebayes.cli.options import AsJson, ExperimentName, Output, OwnEffects, Quiet, Seed, folder_for

RobotFile = Annotated[str, typer.Argument(metavar="ROBOT.toml", help="A robot's file, or the name of a shipped robot.")]
Wires = Annotated[
    list[str] | None,
    typer.Option(
        "--wires",
        metavar="FOLDER",
        help="A folder with a posterior.nc, or several of one line with commas between; NAME=FOLDER for each of "
        "several wires. Not needed if the robot's file gives the parameters of all.",
    ),
]
Draws = Annotated[int, typer.Option("--draws", min=1, help="Posterior draws used, evenly thinned.")]
TensionError = Annotated[
    float, typer.Option("--tension-sd", metavar="N", help="Standard error of a tension, in newtons.")
]
Spread = Annotated[float, typer.Option("--specimen-spread", help="Relative difference between wires of one line.")]
Position = Annotated[str | None, typer.Option(metavar="X,Y,Z", help="Pose in metres; default: the file's.")]
Rotation = Annotated[
    str | None,
    typer.Option(metavar="X,Y,Z", help="Rotation vector in radians; free for what balance decides: free,free,0.2."),
]
Times = Annotated[str, typer.Option(metavar="T,T,…", help="Times in seconds.")]
Tolerance = Annotated[float, typer.Option("--tolerance", metavar="MM", help="Allowed pose error.")]
TiltTolerance = Annotated[float, typer.Option("--tolerance-tilt", metavar="DEG", help="Allowed rotation.")]
MapHeights = Annotated[
    str | None, typer.Option("--map-heights", metavar="Z,Z,…", help="Heights of the mapped slices, in metres.")
]
MapRotation = Annotated[
    list[str] | None,
    typer.Option("--map-rotation", metavar="X,Y,Z", help="Rotation vector of a mapped platform; repeatable."),
]
OtherFit = Annotated[
    Path | None,
    typer.Option("--other-fit", metavar="FOLDER", help="Another fit of the wire, used by one more controller."),
]
JointsFile = Annotated[
    Path | None,
    typer.Option("--joints", metavar="FILE.csv", help="Joint values over time: where was the platform?"),
]
TrajectoryFile = Annotated[
    Path | None,
    typer.Option("--trajectory", metavar="FILE.csv", help="Commanded poses and loads over time: where does it go?"),
]
Payload = Annotated[
    float | None, typer.Option("--payload", metavar="KG", help="Mass that is carried beside the platform's own.")
]
PayloadAt = Annotated[
    str | None,
    typer.Option("--payload-at", metavar="X,Y,Z", help="Centre of --payload in the platform's frame, metres."),
]
TiltError = Annotated[
    float, typer.Option("--tilt-sd", metavar="RAD", help="Standard error of roll and pitch in --joints.")
]
ReferenceLengthError = Annotated[
    float, typer.Option("--reference-sd", metavar="MM", help="Standard error of the lengths that joints stand for.")
]
CalibrationFolder = Annotated[
    Path | None,
    typer.Option(
        "--calibration", metavar="FOLDER", help="What calibrate found; --joints and --trajectory go on from there."
    ),
]
MostDraws = Annotated[
    int | None, typer.Option("--draws", min=1, help="Posterior draws used; default: 1000, 200 over time.")
]


def pose_command(
    robot: RobotFile,
    wires: Wires = None,
    output: Output = None,
    position: Position = None,
    rotation: Rotation = None,
    times: Times = "0,10,30,60,120,300,600,1800,3600",
    tolerance: Tolerance = 0.3,
    tolerance_tilt: TiltTolerance = 0.055,
    spread: Spread = 0.05,
    map_heights: MapHeights = None,
    map_rotation: MapRotation = None,
    other_fit: OtherFit = None,
    joints: JointsFile = None,
    trajectory: TrajectoryFile = None,
    payload: Payload = None,
    payload_at: PayloadAt = None,
    tension_sd: TensionError = 0.02,
    tilt_sd: TiltError = 1e-3,
    reference_sd: ReferenceLengthError = 0.0,
    calibration: CalibrationFolder = None,
    draws: MostDraws = None,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Predict how far the platform of a robot drifts on creeping wires, and its pose error, with uncertainty bands.

    Without a table it predicts a single pose. Over time, --joints takes measured joint values and finds the poses, and
    --trajectory takes commanded poses and finds the drift. Give the final fit of discover as --wires and its plain one
    as --other-fit to see what the effects are worth.
    """
    from wirebayes.cli.answer import conclude
    from wirebayes.cli.progress import progress
    from wirebayes.commands.pose import pose as run
    from wirebayes.commands.wires import named_lines
    from wirebayes.views.result import Given, typed

    with progress() as report:
        found = run(
            robot,
            named_lines(wires),
            position=position,
            rotation=rotation,
            times=times,
            tolerance=tolerance,
            tolerance_tilt=tolerance_tilt,
            specimen_spread=spread,
            map_heights=map_heights,
            map_rotations=map_rotation,
            other_fit=other_fit,
            joints=joints,
            trajectory=trajectory,
            payload=payload,
            payload_at=payload_at,
            tension_sd=tension_sd,
            tilt_sd=tilt_sd,
            reference_sd=reference_sd,
            calibration=calibration,
            draws=draws,
            experiment=experiment,
            own_effects=own_effects,
            seed=seed,
            output=folder_for("pose", robot, output),
            progress=report,
        )
    conclude(found, Given(typed(robot), _typed_options(wires)), as_json=as_json, quiet=quiet)


def calibrate_command(
    robot: RobotFile,
    readings: Annotated[Path, typer.Argument(metavar="READINGS.csv", help="Poses, joints and tensions, in order.")],
    wires: Wires = None,
    output: Output = None,
    tension_sd: TensionError = 0.02,
    tilt_sd: Annotated[
        float, typer.Option("--tilt-sd", metavar="RAD", help="Standard error of the platform's normal.")
    ] = 1e-3,
    reference_sd: Annotated[
        float, typer.Option("--reference-sd", metavar="MM", help="Standard error of the reference lengths; 0: exact.")
    ] = 5.0,
    anchor_sd: Annotated[
        float, typer.Option("--anchor-sd", metavar="MM", help="Standard error of the exit points; 0: exact.")
    ] = 0.0,
    platform_sd: Annotated[
        float, typer.Option("--platform-sd", metavar="MM", help="Standard error of the platform points; 0: exact.")
    ] = 0.0,
    pose_sd: Annotated[
        float | None,
        typer.Option("--pose-sd", metavar="MM", help="Standard error of the poses that the readings state; 0: exact."),
    ] = None,
    drum_sd: Annotated[
        float, typer.Option("--drum-sd", metavar="PERCENT", help="Standard error of the drums' radii; 0: exact.")
    ] = 0.0,
    joint_sd: Annotated[
        float | None,
        typer.Option("--joint-sd", metavar="MM", help="Standard error of a joint value; default: estimated."),
    ] = None,
    next_poses: Annotated[int, typer.Option("--next-poses", metavar="N", help="Poses to propose for next time.")] = 5,
    tension_bias: Annotated[
        float | None,
        typer.Option(
            "--tension-bias",
            metavar="N",
            help="Estimate a bias of each tension sensor, with this prior standard deviation.",
        ),
    ] = None,
    spread: Spread = 0.05,
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
    as_json: AsJson = False,
    quiet: Quiet = False,
) -> None:
    """Estimate lengths, anchors and poses of a robot from its joint values and tensions, without external sensors.

    A row whose pose is empty is a hold at a pose that nobody knows; a row without tensions was not read. With
    --anchor-sd and the like the robot's geometry is estimated too, and robot.toml holds what was found:
    wirebayes calibrate robot.toml log.csv --wires DIR --anchor-sd 50 --output out/anchors
    """
    from wirebayes.cli.answer import conclude
    from wirebayes.cli.progress import progress
    from wirebayes.commands.calibrate import calibrate as run
    from wirebayes.commands.wires import named_lines
    from wirebayes.views.result import Given, typed

    with progress() as report:
        found = run(
            robot,
            readings,
            named_lines(wires),
            tension_sd=tension_sd,
            tilt_sd=tilt_sd,
            reference_sd=reference_sd,
            tension_bias=tension_bias,
            anchor_sd=anchor_sd,
            platform_sd=platform_sd,
            pose_sd=pose_sd,
            drum_sd=drum_sd,
            joint_sd=joint_sd,
            next_poses=next_poses,
            specimen_spread=spread,
            draws=draws,
            experiment=experiment,
            own_effects=own_effects,
            seed=seed,
            output=folder_for("calibrate", robot, output),
            progress=report,
        )
    conclude(found, Given(typed(robot), _typed_options(wires)), as_json=as_json, quiet=quiet)


def export_command(
    robot: RobotFile,
    wires: Wires = None,
    output: Output = None,
    tensions: Annotated[
        str, typer.Option(metavar="N,N,…", help="Tensions of the creep table, in newtons.")
    ] = "1,2,4,8",
    times: Annotated[
        str, typer.Option(metavar="T,T,…", help="Times of the creep table, in seconds.")
    ] = "60,600,3600,86400",
    draws: Draws = 1000,
    experiment: ExperimentName = None,
    own_effects: OwnEffects = None,
    seed: Seed = 0,
) -> None:
    """Write spring constants and creep in firmware units (Hangprinter), and the robot as a MuJoCo model."""
    from wirebayes.cli.answer import print_answer
    from wirebayes.commands.export import export as run
    from wirebayes.commands.wires import named_lines
    from wirebayes.views.result import Given, typed

    exported = run(
        robot,
        named_lines(wires),
        tensions=tensions,
        times=times,
        draws=draws,
        experiment=experiment,
        own_effects=own_effects,
        seed=seed,
        output=folder_for("export", robot, output),
    )
    print_answer(exported, Given(typed(robot), _typed_options(wires)))


def _typed_options(wires: list[str] | None) -> str:
    """``--wires`` as it was given."""
    from wirebayes.views.result import typed

    if wires is None:
        return ""
    return "".join(f" --wires {typed(one)}" for one in wires)
