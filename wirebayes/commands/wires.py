"""Inputs of the robot's commands: fitted wires, the robot's description, and the configuration of the run."""

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, replace
from hashlib import sha256
from pathlib import Path
from typing import Any, TypeGuard

import numpy as np

from wirebayes._version import __version__
from wirebayes.commands.options import check_whole
from wirebayes.commands.predict import one_of, stored_posteriors
from wirebayes.commands.wire_draws import draws_of_models, draws_of_specimens, read_wires
from wirebayes.effects import source_of
from wirebayes.errors import InputError
from wirebayes.json_files.plain import plain
from wirebayes.results.mixture import members_of
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.description import Robot
from wirebayes.robot.mechanics.draws import WireDraws, lines_of, stated_line
from wirebayes.robot.motion.hanging import at_home
from wirebayes.strict.files import PathLike, given_path
from wirebayes.views.findings import Findings
from wirebayes.views.posterior import POSTERIOR, Posterior, Posteriors

RobotLike = PathLike | Robot
Line = PathLike | Posterior | Posteriors | Findings
Specimens = Line | Sequence[Line]  # a line, known from one test or from several of one material
Wires = Specimens | Mapping[str, Specimens]  # for all legs, or by the names that legs have in the robot's file


def read_robot(name_or_file: PathLike) -> Robot:
    """Read a robot from a TOML file, or a shipped one by its name.

    Parameters
    ----------
    name_or_file : str or Path
        ``linear-7``, for example; `wirebayes.robot.mechanics.schema.shipped` lists the names.

    Returns
    -------
    Robot

    Raises
    ------
    InputError
        There is no such robot, or its file is wrong.

    Examples
    --------
    >>> robot = wb.read_robot("linear-7")
    >>> robot.legs, robot.degrees
    (7, 6)
    """
    return schema.read_robot_file(str(given_path("robot", name_or_file)))


def robot_of(robot: RobotLike) -> Robot:
    """The robot given, or the one read; its home orientation in balance where fewer wires than freedoms decide it."""
    return at_home(robot if isinstance(robot, Robot) else read_robot(robot))


def content_of(wires: Wires | None, experiment: str | None) -> str:
    """What tells the posteriors of wires from others; empty where the robot's file gives the wires.

    Parameters
    ----------
    wires : line, several specimens of it, mapping of wire name to one of them, or None
    experiment : str or None
    """
    if wires is None:
        return ""
    if _several(wires):
        return hash_of({name: content_of(line, experiment) for name, line in wires.items()})
    if not _is_sample(wires):
        return _content_of_models(folder_of(wires, experiment))
    each = {}
    for i, one in enumerate(wires):
        each[str(i)] = content_hash(folder_of(one, experiment) / POSTERIOR)
    return hash_of(each)


def _content_of_models(folder: Path) -> str:
    """What tells a posterior from others, with the models that are undecided beside it."""
    models = members_of(folder)
    if len(models) == 1:
        return content_hash(folder / POSTERIOR)
    return hash_of({content_hash(place / POSTERIOR): probability for probability, place in models})


def _is_sample(wires: Wires) -> TypeGuard[Sequence[Line]]:
    """Whether several tests of one line were given."""
    return isinstance(wires, list | tuple) and not isinstance(wires, Posteriors)


def _several(wires: Wires) -> TypeGuard[Mapping[str, Line]]:
    return isinstance(wires, Mapping) and not isinstance(wires, Posteriors)


def folder_of(wires: Wires, experiment: str | None = None) -> Path:
    """The folder with the posterior of a line; of findings, the final one."""
    if isinstance(wires, Findings):
        return one_of(wires.final, experiment).folder
    if isinstance(wires, Posteriors):
        return one_of(wires, experiment).folder
    if isinstance(wires, Posterior):
        return wires.folder
    if not isinstance(wires, str | os.PathLike):
        raise InputError(f"wires: found {type(wires).__name__}, expected a Posterior or a folder with a posterior.nc")
    return _only_one_in(Path(wires), experiment)


def _only_one_in(folder: Path, experiment: str | None) -> Path:
    """The folder of the one posterior, or of the final one, of results or of one experiment; else the folder itself."""
    if (folder / POSTERIOR).is_file():
        return folder
    below = [path.parent for path in folder.glob(f"*/**/{POSTERIOR}")]
    below = [place for place in below if experiment in place.relative_to(folder).parts] or below
    last = below if len(below) == 1 else [place for place in below if place.name == "final"]
    return last[0] if len(last) == 1 else folder


def draws_of(wires: Wires, count: int, experiment: str | None = None, own_effects: Path | None = None) -> WireDraws:
    """Draws of a fitted line in the form that the robot takes.

    Parameters
    ----------
    wires : path, Posterior, Posteriors, Findings, or mapping of wire name to one of them
        A folder with a ``posterior.nc``, or what `fit` or `discover` returned.
    count : int
        Largest number of draws.
    experiment : str or None
        May be left out where there is one.
    own_effects : Path or None
        File of a user's own effects, for a folder.

    Raises
    ------
    InputError
        If there is no posterior, or its model cannot be used on a robot.
    """
    if _several(wires):
        lines = {name: draws_of(line, count, experiment, own_effects) for name, line in wires.items()}
        return _together(lines)
    if _is_sample(wires):
        folders = [folder_of(line, experiment) for line in wires]
        return draws_of_specimens(folders, count, experiment, own_effects)
    folder = folder_of(wires, experiment)
    if isinstance(wires, Posterior | Posteriors | Findings):
        models = stored_posteriors(wires, experiment, None, own_effects)
        return draws_of_models(models, str(folder), count)
    return read_wires(folder, count, experiment, own_effects)


def draws_for(
    robot: Robot, wires: Wires | None, count: int, experiment: str | None, own_effects: Path | None
) -> WireDraws:
    """`draws_of` for a robot, whose legs must fit the lines.

    Parameters
    ----------
    robot : Robot
    wires : path, Posterior, Posteriors, Findings or None
        As for `draws_of`; None where the robot's file gives the parameters of all wires.
    count : int
        Largest number of draws.
    experiment : str or None
        May be left out where there is one.
    own_effects : Path or None
        File of a user's own effects, for a folder.

    Raises
    ------
    InputError
        If there is no posterior, or the lines and the robot's legs do not fit together.
    """
    count = check_whole("--draws", count, 1)
    line = stated_line(robot, count) if wires is None else draws_of(wires, count, experiment, own_effects)
    lines_of(robot, line)
    idle = [name for name in line.each if name not in robot.wire]
    if line.others and idle:
        expected = ", ".join(sorted({*robot.wire}))
        raise InputError(f"--wires: found {idle[0]}, expected one of the legs' wires: {expected}")
    return line


def _together(lines: dict[str, WireDraws]) -> WireDraws:
    """Lines of differently named wires, as many draws of each; draws of two lines have nothing to do with another."""
    if not lines:
        raise InputError("wires: found no line, expected one or more")
    name, first = next(iter(lines.items()))
    count = min(line.count for line in lines.values())
    rng = np.random.default_rng(0)
    others = {}
    for other, line in lines.items():
        _check_alike(name, first, other, line)
        if other == name:
            continue
        order = rng.permutation(line.count)
        part = line.part(order[:count])
        others[other] = replace(part, name=other)
    own = first.part(slice(0, count))
    return replace(own, name=name, others=others)


def _check_alike(name: str, first: WireDraws, other: str, line: WireDraws) -> None:
    """Refuse lines that were fitted with different laws."""
    for option, one, another in (("elastic-law", first.law, line.law), ("history", first.history, line.history)):
        if one != another:
            found = f"{name} fitted with --{option} {one} and {other} with {another}"
            raise InputError(f"--wires: found {found}, expected one for all wires")


def named_lines(texts: Sequence[str] | None) -> Wires | None:
    """What ``--wires`` was given: a line, or several times ``NAME=LINE``; a line is a folder, or some with commas."""
    if not texts:
        return None
    if len(texts) == 1 and ("=" not in texts[0] or Path(texts[0]).exists()):
        return _folders(texts[0])
    pairs = []
    for text in texts:
        name, _, folder = text.partition("=")
        if not (name and folder):
            raise InputError(f"--wires: found {text!r} beside others, expected NAME=FOLDER for each")
        pairs.append((name, folder))
    names = [name for name, _ in pairs]
    if len(set(names)) < len(names):
        raise InputError(f"--wires: found {', '.join(names)}, expected each name once")
    return {name: _folders(folder) for name, folder in pairs}


def _folders(text: str) -> Path | list[Path]:
    """A folder, or several with commas between."""
    if "," not in text or Path(text).exists():
        return Path(text)
    return [Path(part) for part in text.split(",") if part]


def configuration(
    command: str,
    robot: RobotLike,
    content: str,
    draws: int,
    seed: int,
    own_effects: Path | None,
    options: Mapping[str, Any],
) -> dict[str, Any]:
    """Everything that decides the results; files by their content, not by where they lie.

    Parameters
    ----------
    command : str
    robot : Robot or path
    content : str
        Of the wires' posteriors, as `content_of` tells them from others.
    draws, seed : int
    own_effects : Path or None
    options : mapping of name to value
        The command's own. Their order is fixed: folders made before the names were stored have the values alone.

    Returns
    -------
    dict
        What ``configuration.json`` holds: another one is refused in the same folder.
    """
    return {
        "command": command,
        "version": __version__,
        "robot": identity_of(robot),
        "wires": content,
        "own_effects": source_of(own_effects),
        "draws": draws,
        "seed": seed,
        "options": dict(options),
    }


def identity_of(robot: RobotLike) -> str:
    """The hash of what describes a robot, or of its file."""
    return hash_of(asdict(robot)) if isinstance(robot, Robot) else content_hash(Path(robot))


def content_hash(path: Path) -> str:
    """The hash of a file, or the name where there is none."""
    return sha256(path.read_bytes()).hexdigest() if path.is_file() else str(path)


def hash_of(value: Mapping[str, Any]) -> str:
    """The hash of plain values."""
    return sha256(json.dumps(plain(value)).encode()).hexdigest()
