"""Robots of other programs, CASPR, WireX and the firmware of Hangprinters, turned into robot files."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from wirebayes.commands.options import Numbers, numbers
from wirebayes.errors import InputError
from wirebayes.io.run_folder import write_text
from wirebayes.robot.exchange import caspr, firmware, wirex
from wirebayes.robot.exchange.imported import ImportedRobot, robot_file
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.motion import inverse
from wirebayes.strict.files import PathLike, given_path
from wirebayes.strict.xml_file import Element, read_xml

_PARTS = {"bodies_system": "bodies", "links": "bodies", "cables": "cables", "models": "models"}


def import_robot(
    files: PathLike | Sequence[PathLike],
    output: PathLike,
    *,
    tension: Numbers | None = None,
    position: Numbers | None = None,
    cable_set: str | None = None,
    pulleys: bool = True,
) -> Path:
    """Turn a robot of CASPR or WireX, or the settings of a Hangprinter, into a robot file.

    Parameters
    ----------
    files : path or sequence of paths
        CASPR's ``…_bodies.xml`` and ``…_cables.xml`` (one of them, with the other beside it), the XML of WireX,
        ``config.g`` of RepRapFirmware or ``printer.cfg`` of Klipper.
    output : path
        The robot file to be written (TOML); never overwritten.
    tension : (lowest, highest), optional
        Bounds of the tensions, N; the file's when left out. WireX has none.
    position : (3,) array, optional
        Of the home pose, m; the file's when left out. WireX has none.
    cable_set : str, optional
        Which of CASPR's sets of cables; the file's own choice when left out.
    pulleys : bool
        Whether radii of pulleys are meant, where a file has them.

    Returns
    -------
    Path
        Of the robot file.

    Raises
    ------
    InputError
        A file cannot be read or describes no platform on wires, with file and line; something is missing.

    Examples
    --------
    >>> file = wb.import_robot("desk_cables.xml", "desk.toml")
    >>> wb.read_robot(file).legs
    6
    """
    names = [files] if isinstance(files, str) or not isinstance(files, Sequence) else list(files)
    found = _read([given_path("files", name) for name in names], cable_set, pulleys)
    bounds = found.tension_N if tension is None else tuple(numbers("--tension", tension, 2).tolist())
    where = found.home_m if position is None else numbers("--position", position, 3)
    first = names[0]
    if bounds is None:
        raise InputError(f"{first}: found no bounds of the tensions, expected --tension LOWEST,HIGHEST in newtons")
    if position is not None and found.freedom == "orientation":
        raise InputError("--position: found one for a platform on a ball joint, expected none: the joint is its place")
    if where is None:
        raise InputError(f"{first}: found no pose, expected --position X,Y,Z of the home pose in metres")
    lowest, highest = bounds
    if not 0 <= lowest < highest:
        raise InputError(f"--tension: found {lowest:g},{highest:g}, expected 0 <= LOWEST < HIGHEST in newtons")
    target = given_path("output", output)
    if target.exists():
        raise InputError(f"{target}: found a file of this name, expected none; nothing is overwritten")
    text = robot_file(found, (lowest, highest), np.asarray(where))
    schema.parse(text, f"{first}, turned into a robot file")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        write_text(target, text)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}), expected a writable folder") from None
    return target


def holds_home(robot: Robot) -> bool:
    """Whether tensions within the bounds hold the platform at its home pose.

    Parameters
    ----------
    robot : Robot
    """
    pose = robot.home_m[None], matrix(robot.home_rotation_rad)[None]
    return bool(np.isfinite(inverse.tensions(robot, *pose)).all())


def _read(paths: list[Path], cable_set: str | None, pulleys: bool) -> ImportedRobot:
    settings = [path for path in paths if path.suffix in firmware.SUFFIXES]
    if settings:
        if len(paths) > 1 or cable_set is not None:
            raise InputError(f"{settings[0]}: found files or a cable set beside it, expected these settings alone")
        return firmware.robot_of_firmware(settings[0])
    parts: dict[str, Element] = {}
    for path in paths:
        root = read_xml(path)
        part = _PARTS.get(root.tag)
        if part is None:
            raise root.fail("this root", "<bodies_system> or <cables> of CASPR, or <models> of WireX")
        if part in parts:
            raise root.fail("a second file of this kind", "one robot")
        parts[part] = root
    models = parts.get("models")
    if models is not None:
        if len(parts) > 1 or cable_set is not None:
            raise models.fail("files or a cable set of CASPR beside it", "the file of WireX alone")
        return wirex.robot_of_wirex(models, pulleys)
    for here, other in (("bodies", "cables"), ("cables", "bodies")):
        if other not in parts:
            beside = _beside(Path(parts[here].file), here, other)
            root = read_xml(beside)
            if _PARTS.get(root.tag) != other:
                raise root.fail("this root", f"the {other} of CASPR")
            parts[other] = root
    found = caspr.robot_of_caspr(parts["bodies"], parts["cables"], cable_set)
    return found if pulleys else _without_pulleys(found)


def _beside(path: Path, here: str, other: str) -> Path:
    """CASPR's other file, by its name."""
    beside = path.with_name(path.name.replace(f"_{here}.", f"_{other}."))
    if beside == path or not beside.is_file():
        raise InputError(f"{path}: found {here} only, expected a file with the {other} too, as CASPR has both")
    return beside


def _without_pulleys(found: ImportedRobot) -> ImportedRobot:
    return replace(found, pulley_m=np.zeros(len(found.pulley_m)), notes=(*found.notes, "Its pulleys are left out."))
