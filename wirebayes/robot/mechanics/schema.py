"""Reads a robot's TOML file, strictly: every key known, every number finite, every error one line."""

import math
import os
from dataclasses import replace
from importlib import resources
from pathlib import Path
from typing import Any, NamedTuple, cast, get_args

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.mechanics.description import Drums, Freedom, GivenWire, Plane, Pulleys, Robot, TensionRule
from wirebayes.robot.mechanics.free_turning import turns_freely
from wirebayes.robot.mechanics.shipped import shipped as shipped
from wirebayes.robot.mechanics.tensions import CHOICES
from wirebayes.sentences import short
from wirebayes.strict.files import read_text
from wirebayes.strict.toml_keys import LARGEST_NUMBER, Keys

_GIVEN = {"k1_N": "k1", "B_mm": "B", "U": "U", "k2": "k2", "N": "N"}
_NO_CREEP = {"B": 0.0, "U": 1.0, "k2": 1.0, "N": 1.0}  # no share of any tension; how it would go on is all the same
_ANY_LENGTH_MM = 1000.0  # what no elongation refers to


def read_robot_file(name_or_file: str | Path) -> Robot:
    """Read a robot from a TOML file, or a shipped one by its name.

    Parameters
    ----------
    name_or_file : str or Path

    Returns
    -------
    Robot

    Raises
    ------
    InputError
        Naming the file, the line and the key, what was found and what was expected.
    """
    return parse(*_text(str(name_or_file)))


def parse(text: str, where: str) -> Robot:
    """Read a robot from the text of a file, which errors call `where`.

    Parameters
    ----------
    text, where : str

    Returns
    -------
    Robot

    Raises
    ------
    InputError
        As `read_robot_file`.
    """
    return _robot(Keys.of_file(Path(where), text))


def robot_text(name_or_file: str | Path) -> str:
    """The text of a robot's file, or of a shipped one."""
    return _text(str(name_or_file))[0]


def _text(name: str) -> tuple[str, str]:
    if name in shipped():
        entry = resources.files("wirebayes") / "data" / "robots" / f"{name}.toml"
        return entry.read_text(encoding="utf-8"), f"{name} (shipped)"
    path = Path(name)
    if not os.path.lexists(path):
        raise InputError(
            f"{name}: found no such file and no shipped robot of that name, expected a file or {', '.join(shipped())}"
        )
    return read_text(path, "the description of a robot"), name


def _triple(keys: Keys, key: str, default: list[float] | None = None) -> Floats:
    return np.array(keys.numbers(key, f"a list of three numbers of at most {LARGEST_NUMBER:.0e} in size", 3, default))


def _direction(keys: Keys, key: str) -> Floats:
    value = _triple(keys, key)
    length = float(np.linalg.norm(value))
    if not length > 0:
        raise keys.complain(key, shown(value.tolist()), "a direction, not all zero")
    return value / length


def _robot(top: Keys) -> Robot:
    if "experiment" in top.table:
        raise top.complain("experiment", "a file of tests", "a robot with [[leg]]; tests are read by wirebayes fit")
    _check_version(top)
    name, description, source = (top.string(key) for key in ("name", "description", "source"))
    freedom = cast(Freedom, top.string("freedom", default="pose", among=get_args(Freedom)))
    mass, centre = _platform(top.inside("platform"))
    tension = _tension(top.inside("tension"))
    home = _home(top.inside("pose"))
    lower, upper = _workspace(top.inside("workspace"))
    bias = _bias(top.inside("sensors", {}))
    plane = _plane(top)
    _check_wires_pull(top, plane, tension)
    given, declared, masses = _wires(top)
    legs, winch = _legs(top, declared)
    top.finish()
    if freedom == "orientation":
        _check_ball_joint(top, plane, np.array([lower, upper]) - home.position_m, len(legs))

    def stack(key: str) -> Any:
        return np.array([leg[key] for leg in legs])

    robot = Robot(
        name=name,
        description=description,
        source=source,
        freedom=freedom,
        mass_kg=mass,
        centre_of_mass_m=centre,
        exit_m=stack("exit"),
        platform_m=stack("platform"),
        lines=stack("lines"),
        beyond_m=stack("beyond"),
        actuator=tuple(leg["actuator"] for leg in legs),
        ratio=stack("ratio"),
        wire_m=stack("wire_m"),
        wire=tuple(leg["wire"] for leg in legs),
        given=given,
        rule=tension,
        home_m=home.position_m,
        home_rotation_rad=home.rotation_rad,
        lower_m=lower,
        upper_m=upper,
        pulleys=_pulleys(stack("pulley"), stack("axis")),
        drums=_drums(*(stack(key) for key in _DRUM)),
        tension_bias_N=bias,
        mass_kg_m=_or_none(np.array([masses.get(leg["wire"], 0.0) for leg in legs])),
        plane=plane,
        winch=winch,
        joint_offset_m=_or_none(stack("joint_offset")),
        home_rotation_is_stated=home.rotation_is_stated,
    )
    _check_turning(top, robot)
    return robot


def _check_turning(top: Keys, robot: Robot) -> None:
    """A platform whose turn nothing decides hangs in no stable balance, wherever it is."""
    about = turns_freely(robot)
    if about:
        instead = 'points that hold its turn, or freedom = "position", which asks for its position alone'
        found = f"{shown(robot.freedom)} and a platform that turns freely about {about}"
        raise top.complain("freedom", found, "points that hold it" if robot.freedom == "orientation" else instead)


def _check_ball_joint(top: Keys, plane: Plane | None, corners_m: Floats, legs: int) -> None:
    """A ball joint is the home position, which the platform does not leave; corners count from there."""
    if plane is not None:
        raise top.complain("plane", "one beside a ball joint", 'none, or another freedom than "orientation"')
    if corners_m.any():
        raise top.complain("workspace", "corners beside the ball joint", "both at pose.position_m, where it is")
    if legs < _TURNING:
        raise top.complain("leg", f"{legs} legs", f"at least {_TURNING}, to hold a platform about its ball joint")


def _check_wires_pull(top: Keys, plane: Plane | None, rule: TensionRule) -> None:
    """On a level plane no weight pulls at the wires: at no tension they hold the platform nowhere."""
    level = plane is not None and not plane.normal[:2].any()
    if level and rule.choice == "minimum_norm" and not rule.lowest_N:
        expected = "a number above 0: a level plane carries the weight, and wires that do not pull hold no place on it"
        raise top.inside("tension").complain("lowest_N", "0", expected)


def _check_version(top: Keys) -> None:
    version = top.value("version", "the number 1")
    if version != 1 or isinstance(version, bool):
        raise top.complain("version", shown(version), "the number 1")


def _platform(keys: Keys) -> tuple[float, Floats]:
    """Mass, and where its centre is."""
    mass, centre = keys.number("mass_kg", above=0), _triple(keys, "centre_of_mass_m", [0.0, 0.0, 0.0])
    keys.finish()
    return mass, centre


class _Home(NamedTuple):
    """The home pose of a robot's file."""

    position_m: Floats
    rotation_rad: Floats
    rotation_is_stated: bool


def _home(keys: Keys) -> _Home:
    home = _Home(
        _triple(keys, "position_m"),
        _triple(keys, "rotation_vector_rad", [0.0, 0.0, 0.0]),
        "rotation_vector_rad" in keys.table,
    )
    keys.finish()
    return home


def _bias(keys: Keys) -> float:
    """Standard deviation of a tension sensor's bias."""
    bias = keys.number("tension_bias_N", default=0.0, least=0)
    keys.finish()
    return bias


def _tension(keys: Keys) -> TensionRule:
    """How the tensions of a redundant robot are chosen."""
    choice = keys.string("choice", among=tuple(CHOICES))
    lowest, highest = keys.number("lowest_N", least=0), keys.number("highest_N", above=0)
    if highest <= lowest:
        raise keys.complain("highest_N", f"{highest:g}", f"more than lowest_N ({lowest:g})")
    keys.finish()
    return TensionRule(choice, lowest, highest)


def _workspace(keys: Keys) -> tuple[Floats, Floats]:
    """Opposite corners."""
    lower, upper = _triple(keys, "lower_m"), _triple(keys, "upper_m")
    if np.any(upper < lower):
        expected = f"at least lower_m ({lower.tolist()}) on every axis"
        raise keys.complain("upper_m", shown(upper.tolist()), expected)
    keys.finish()
    return lower, upper


def _plane(top: Keys) -> Plane | None:
    """The plane that carries the platform, where the file has one."""
    if top.value("plane", "a table", ()) == ():  # no such key
        return None
    keys = top.inside("plane")
    contact = keys.string("contact", default="table", among=("table", "rail"))
    plane = Plane(
        _direction(keys, "normal"),
        "rail" if contact == "rail" else "table",
        keys.number("friction_coefficient", default=0.0, least=0),
        keys.number("contact_radius_m", default=0.0, least=0),
    )
    keys.finish()
    return plane


def _pulleys(radius_m: Floats, axis: Floats) -> Pulleys | None:
    return Pulleys(radius_m, axis) if radius_m.any() else None


def _drums(radius_m: Floats, *rest: Floats) -> Drums | None:
    return Drums(radius_m, *rest) if radius_m.any() else None


def _wires(top: Keys) -> tuple[dict[str, GivenWire], set[str], dict[str, float]]:
    """Wires of stated parameters, the names of all, and their masses by length where they are given."""
    tables, given, masses = top.inside("wires", {}), {}, {}
    for name in tables.table:
        wire = tables.inside(name)
        masses[name] = wire.number("mass_kg_m", default=0.0, least=0)
        if name == "default" and "k1_N" in wire.table:
            expected = 'a name of its own, as [wires.belt], and wire = "belt" in every leg that has it'
            raise wire.complain("k1_N", "the stiffness of legs that name no wire", expected)
        if not _is_fitted(wire, name):
            given[name] = _given_wire(wire)
        wire.finish()
    return given, set(tables.table), masses


def _given_wire(wire: Keys) -> GivenWire:
    """A wire of stated parameters; one of a stiffness alone does not creep."""
    of_creep = [key for key in (*_GIVEN, "length_mm") if key != "k1_N"]
    if not any(key in wire.table for key in of_creep):
        return GivenWire({"k1": wire.number("k1_N", above=0), **_NO_CREEP}, _ANY_LENGTH_MM)
    values = {name: wire.number(key, above=0) for key, name in _GIVEN.items()}
    return GivenWire(values, wire.number("length_mm", above=0))


def _is_fitted(wire: Keys, name: str) -> bool:
    """Whether a posterior of the wire comes with the command."""
    fitted = wire.value("fitted", "true or no key", False) if name != "default" else True
    if not isinstance(fitted, bool):
        raise wire.complain("fitted", shown(fitted), "true or no key")
    return fitted


def _or_none(values: Floats) -> Floats | None:
    """Values of the legs; None where all are zero."""
    return values if values.any() else None


def _legs(top: Keys, declared: set[str]) -> tuple[list[dict[str, Any]], Indices | None]:
    """All legs, and the number of each one's winch."""
    tables = [replace(leg, name=str(number)) for number, leg in enumerate(top.tables("leg", least=2), 1)]
    legs = [_leg(leg, declared) for leg in tables]
    exits = np.array([leg["exit"] for leg in legs])
    if not np.ptp(exits, axis=0).any():  # the robot's own measure of length would be zero
        found = f"{shown(exits[0].tolist())} in every leg"
        raise tables[-1].complain("exit_point_m", found, "exit points that lie apart")
    return legs, _winches(tables, legs)


def _leg(leg: Keys, declared: set[str]) -> dict[str, Any]:
    """One leg; `declared` are the names under ``[wires]``."""
    actuator = leg.string("actuator", default="drum", among=("drum", "linear"))
    row: dict[str, Any] = {
        "exit": _triple(leg, "exit_point_m"),
        "platform": _triple(leg, "platform_point_m"),
        "lines": leg.number("lines", default=1.0, least=1),
        "beyond": leg.number("beyond_exit_m", default=0.0, least=0),
        "actuator": actuator,
        "wire": leg.string("wire", default="default"),
        "winch": leg.string("winch") if "winch" in leg.table else "",
        "joint_offset": 0.0,
        "ratio": 0.0,
        "wire_m": 0.0,
        "pulley": 0.0,
        "axis": np.array([0.0, 0.0, 1.0]),
    }
    if row["lines"] != int(row["lines"]):
        raise leg.complain("lines", f"{row['lines']:g}", "a whole number")
    if actuator == "linear":
        row["ratio"] = leg.number("pulley_ratio", above=0)
        row["wire_m"] = leg.number("wire_length_m", above=0)
    else:
        row["joint_offset"] = leg.number("joint_offset_m", default=0.0)
    if "pulley_radius_m" in leg.table:
        row["pulley"] = leg.number("pulley_radius_m", above=0)
        row["axis"] = _direction(leg, "swivel_axis")
    row |= _drum(leg) if actuator == "drum" else _drum(None)
    if row["wire"] != "default" and row["wire"] not in declared:
        raise leg.complain("wire", shown(row["wire"]), "the name of a table under [wires], or no key")
    leg.finish()
    return row


def _winches(tables: list[Keys], legs: list[dict[str, Any]]) -> Indices | None:
    """Number of each leg's winch in the order of the legs; None where each has its own.

    Legs of one winch turn together: what their joint value means must be the same.
    """
    number: dict[object, int] = {}
    numbers = []
    for i, leg in enumerate(legs):
        numbers.append(number.setdefault(leg["winch"] or i, len(number)))
    if len(number) == len(legs):
        return None
    shared = {"actuator": "actuator", "ratio": "pulley_ratio", **_DRUM}
    for i, leg in enumerate(legs):
        first = legs[numbers.index(numbers[i])]
        for key, name in shared.items():
            if leg[key] != first[key]:
                expected = f"that of the first leg of winch {leg['winch']}, {first[key]}"
                raise tables[i].complain(name, str(leg[key]), expected)
    return np.array(numbers)


_TURNING = 3  # wires that turn a platform every way
_DRUM = {
    "drum_radius": "drum_radius_m", "drum_pitch": "drum_pitch_m", "drum_turns": "drum_layer_turns",
    "drum_layer": "drum_layer_height_m", "drum_wire": "wire_length_m", "gear": "gear_ratio",
}  # fmt: skip
_MOST_LAYERS = 10_000  # more wire than any drum holds: a slip of the unit


def _drum(leg: Keys | None) -> dict[str, float]:
    """What is known of a leg's drum."""
    row = dict(zip(_DRUM, (0.0, 0.0, math.inf, 0.0, 0.0, 1.0), strict=True))
    if leg is None or "drum_radius_m" not in leg.table:
        return row
    row["drum_radius"] = leg.number("drum_radius_m", above=0)
    row["drum_pitch"] = leg.number("drum_pitch_m", default=0.0, least=0)
    row["gear"] = leg.number("gear_ratio", default=1.0, above=0)
    if "drum_layer_turns" in leg.table:
        row |= _layers(leg, row["drum_radius"])
    return row


def _layers(leg: Keys, radius_m: float) -> dict[str, float]:
    """What is known of the layers of a leg's drum."""
    turns = leg.number("drum_layer_turns", least=1)
    height = leg.number("drum_layer_height_m", above=0)
    wire = leg.number("wire_length_m", above=0)
    layers = wire / (2 * math.pi * radius_m * turns)
    if layers > _MOST_LAYERS:
        expected = f"wire for no more than {_MOST_LAYERS} layers on the drum"
        raise leg.complain("wire_length_m", f"{wire:g}, {short(layers, 3)} layers", expected)
    return {"drum_turns": turns, "drum_layer": height, "drum_wire": wire}
