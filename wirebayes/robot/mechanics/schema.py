"""Reads a robot's TOML file, strictly: every key known, every number finite, every error one line."""

import math
import os
import tomllib
from collections.abc import Callable
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats
from wirebayes.robot.mechanics.description import Drums, GivenWire, Plane, Pulleys, Robot, TensionRule
from wirebayes.robot.mechanics.shipped import shipped as shipped
from wirebayes.robot.mechanics.tensions import CHOICES
from wirebayes.strict.files import read_text

_GIVEN = {"k1_N": "k1", "B_mm": "B", "U": "U", "k2": "k2", "N": "N"}


def read(name_or_file: str | Path) -> Robot:
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
        Naming the file and the key, what was found and what was expected.
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
        As `read`.
    """
    try:
        table = tomllib.loads(text)
    except (ValueError, RecursionError) as error:  # also what Python refuses: an integer of thousands of digits
        raise InputError(f"{where}: found no valid TOML ({error}), expected the description of a robot") from None
    return _robot(_Table(table, where, ""))


def text_of(name_or_file: str | Path) -> str:
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


class _Table:
    """One table of the file; remembers which keys were read, so that the others can be refused."""

    def __init__(self, content: Any, where: str, path: str) -> None:
        self.where, self.path = where, path
        if not isinstance(content, dict):
            raise InputError(f"{where}: {path or 'file'}: expected a table, found {_kind(content)}")
        self.content, self.known = content, set[str]()

    def fail(self, key: str, found: str, expected: str) -> InputError:
        """The error for one key of the table; the caller raises it.

        Parameters
        ----------
        key : str
        found, expected : str
            As the message shows them.
        """
        path = f"{self.path}.{key}" if self.path else key
        return InputError(f"{self.where}: {path}: {found}, expected {expected}")

    def take(self, key: str, expected: str, default: Any = None) -> Any:
        """The value of a key, which counts as known from then on.

        Parameters
        ----------
        key : str
        expected : str
            What the message says is expected.
        default : any, optional
            For a key that is missing; without a default that is an error.
        """
        self.known.add(key)
        if key not in self.content:
            if default is None:
                raise self.fail(key, "found nothing", expected)
            return default
        return self.content[key]

    def number(
        self, key: str, default: float | None = None, above: float = -math.inf, least: float = -math.inf
    ) -> float:
        """A finite number within limits.

        Parameters
        ----------
        key : str
        default : float, optional
            For a key that is missing; without a default that is an error.
        above : float
            The number must be greater.
        least : float
            The number must not be less.
        """
        bound = f" above {above:g}" if above > -math.inf else f" of at least {least:g}" if least > -math.inf else ""
        value = self.take(key, f"a number{bound}", default)
        if not _is_number(value) or not value > above or not value >= least:
            raise self.fail(key, f"found {_shown(value)}", f"a number{bound}, below {_LARGEST:.0e} in size")
        return float(value)

    def triple(self, key: str, default: list[float] | None = None) -> Floats:
        value = self.take(key, "three numbers", default)
        if not isinstance(value, list) or len(value) != 3 or not all(_is_number(v) for v in value):
            raise self.fail(key, f"found {_shown(value)}", f"a list of three numbers below {_LARGEST:.0e} in size")
        return np.array(value, float)

    def unit(self, key: str) -> Floats:
        value = self.triple(key)
        length = float(np.linalg.norm(value))
        if not length > 0:
            raise self.fail(key, f"found {value.tolist()}", "a direction, not all zero")
        return value / length

    def text(self, key: str, default: str | None = None, among: tuple[str, ...] = ()) -> str:
        """A text, one of some where there is a choice.

        Parameters
        ----------
        key : str
        default : str, optional
            For a key that is missing; without a default that is an error.
        among : tuple of str
            The texts allowed; empty for any.
        """
        expected = "one of " + ", ".join(among) if among else "a text"
        value = self.take(key, expected, default)
        if not isinstance(value, str) or (among and value not in among):
            raise self.fail(key, f"found {_shown(value)}", expected)
        return value

    def table(self, key: str, default: dict[str, Any] | None = None) -> "_Table":
        path = f"{self.path}.{key}" if self.path else key
        return _Table(self.take(key, "a table", default), self.where, path)

    def finish(self) -> None:
        for key in self.content:
            if key not in self.known:
                raise self.fail(key, "found an unknown key", "one of " + ", ".join(sorted(self.known)))


def _robot(t: _Table) -> Robot:
    version = t.take("version", "the number 1")
    if version != 1 or isinstance(version, bool):
        raise t.fail("version", f"found {_shown(version)}", "the number 1")
    name, description = t.text("name"), t.text("description")
    source = t.text("source")
    freedom = t.text("freedom", "pose", ("pose", "position"))
    platform = t.table("platform")
    mass, centre = platform.number("mass_kg", above=0), platform.triple("centre_of_mass_m", [0.0, 0.0, 0.0])
    platform.finish()
    rule, home, space = t.table("tension"), t.table("pose"), t.table("workspace")
    tension = TensionRule(
        rule.text("choice", among=tuple(CHOICES)), rule.number("lowest_N", least=0), rule.number("highest_N", above=0)
    )
    if tension.highest_N <= tension.lowest_N:
        raise rule.fail("highest_N", f"found {tension.highest_N:g}", f"more than lowest_N ({tension.lowest_N:g})")
    position, turn = home.triple("position_m"), home.triple("rotation_vector_rad", [0.0, 0.0, 0.0])
    lower, upper = space.triple("lower_m"), space.triple("upper_m")
    if np.any(upper < lower):
        raise space.fail("upper_m", f"found {upper.tolist()}", f"at least lower_m ({lower.tolist()}) on every axis")
    sensors = t.table("sensors", {})
    bias = sensors.number("tension_bias_N", 0.0, least=0)
    plane = _plane(t)
    given, declared, masses = _wires(t)
    legs = _legs(t, declared)
    mass_kg_m = np.array([masses.get(leg["wire"], 0.0) for leg in legs])
    for table in (rule, home, space, sensors, t):
        table.finish()
    stack: Callable[[str], Any] = lambda key: np.array([leg[key] for leg in legs])  # noqa: E731
    return Robot(
        name, description, source, "pose" if freedom == "pose" else "position", mass, centre,
        stack("exit"), stack("platform"), stack("lines"), stack("beyond"), tuple(leg["actuator"] for leg in legs),
        stack("ratio"), stack("wire_m"), tuple(leg["wire"] for leg in legs), given, tension,
        position, turn, lower, upper, _pulleys(stack("pulley"), stack("axis")),
        _drums(*(stack(key) for key in _DRUM)), bias, mass_kg_m if mass_kg_m.any() else None, plane,
    )  # fmt: skip


def _plane(t: _Table) -> Plane | None:
    """The plane that carries the platform, where the file has one."""
    if "plane" not in t.content:
        t.known.add("plane")
        return None
    plane = t.table("plane")
    contact = plane.text("contact", "table", ("table", "rail"))
    out = Plane(
        plane.unit("normal"),
        "rail" if contact == "rail" else "table",
        plane.number("friction_coefficient", 0.0, least=0),
        plane.number("contact_radius_m", 0.0, least=0),
    )
    plane.finish()
    return out


def _pulleys(radius_m: Floats, axis: Floats) -> Pulleys | None:
    return Pulleys(radius_m, axis) if radius_m.any() else None


def _drums(radius_m: Floats, *rest: Floats) -> Drums | None:
    return Drums(radius_m, *rest) if radius_m.any() else None


def _wires(t: _Table) -> tuple[dict[str, GivenWire], set[str], dict[str, float]]:
    """Wires of stated parameters, the names of all, and their masses by length where they are given."""
    tables, given, masses = t.table("wires", {}), {}, {}
    for name in tables.content:
        wire = tables.table(name)
        masses[name] = wire.number("mass_kg_m", 0.0, least=0)
        fitted = wire.take("fitted", "true or no key", False) if name != "default" else True
        if not isinstance(fitted, bool):
            raise wire.fail("fitted", f"found {_shown(fitted)}", "true or no key")
        if not fitted:  # a posterior comes with the command
            values = {short: wire.number(key, above=0) for key, short in _GIVEN.items()}
            given[name] = GivenWire(values, wire.number("length_mm", above=0))
        wire.finish()
    return given, set(tables.content), masses


def _legs(t: _Table, given: set[str]) -> list[dict[str, Any]]:
    value = t.take("leg", "at least two [[leg]] tables")
    if not isinstance(value, list) or len(value) < 2:
        raise t.fail("leg", f"found {_kind(value)}", "at least two [[leg]] tables")
    out = []
    for i, content in enumerate(value):
        leg = _Table(content, t.where, f"leg[{i}]")
        actuator = leg.text("actuator", "drum", ("drum", "linear"))
        row: dict[str, Any] = {
            "exit": leg.triple("exit_point_m"),
            "platform": leg.triple("platform_point_m"),
            "lines": leg.number("lines", 1.0, least=1),
            "beyond": leg.number("beyond_exit_m", 0.0, least=0),
            "actuator": actuator,
            "wire": leg.text("wire", "default"),
            "ratio": 0.0,
            "wire_m": 0.0,
            "pulley": 0.0,
            "axis": np.array([0.0, 0.0, 1.0]),
        }
        if row["lines"] != int(row["lines"]):
            raise leg.fail("lines", f"found {row['lines']:g}", "a whole number")
        if actuator == "linear":
            row["ratio"] = leg.number("pulley_ratio", above=0)
            row["wire_m"] = leg.number("wire_length_m", above=0)
        if "pulley_radius_m" in leg.content:
            row["pulley"] = leg.number("pulley_radius_m", above=0)
            row["axis"] = leg.unit("swivel_axis")
        row |= _drum(leg) if actuator == "drum" else _drum(None)
        if row["wire"] != "default" and row["wire"] not in given:
            raise leg.fail("wire", f"found {_shown(row['wire'])}", "the name of a table under [wires], or no key")
        leg.finish()
        out.append(row)
    return out


_DRUM = ("drum_radius", "drum_pitch", "drum_turns", "drum_layer", "drum_wire", "gear")
_MOST_LAYERS = 10_000  # more wire than any drum holds: a slip of the unit


def _drum(leg: _Table | None) -> dict[str, float]:
    """What is known of a leg's drum."""
    row = dict(zip(_DRUM, (0.0, 0.0, math.inf, 0.0, 0.0, 1.0), strict=True))
    if leg is None or "drum_radius_m" not in leg.content:
        return row
    row["drum_radius"] = leg.number("drum_radius_m", above=0)
    row["drum_pitch"] = leg.number("drum_pitch_m", 0.0, least=0)
    row["gear"] = leg.number("gear_ratio", 1.0, above=0)
    if "drum_layer_turns" in leg.content:
        row["drum_turns"] = leg.number("drum_layer_turns", least=1)
        row["drum_layer"] = leg.number("drum_layer_height_m", above=0)
        row["drum_wire"] = leg.number("wire_length_m", above=0)
        layers = row["drum_wire"] / (2 * math.pi * row["drum_radius"] * row["drum_turns"])
        if layers > _MOST_LAYERS:
            raise leg.fail("wire_length_m", f"{layers:.3g} layers on the drum", f"no more than {_MOST_LAYERS}")
    return row


def _is_number(value: Any) -> bool:
    if not isinstance(value, (int, float)) or isinstance(value, bool):
        return False
    return -_LARGEST < value < _LARGEST  # an integer may be too large for any float


_LARGEST = 1e12  # no length, mass or stiffness comes near, and its square does not overflow


def _kind(value: Any) -> str:
    if isinstance(value, list):
        return f"a list of {len(value)}"
    return f"{type(value).__name__} {_shown(value)}"


def _shown(value: Any) -> str:
    try:
        text = repr(value)
    except (ValueError, RecursionError):  # Python does not write integers of thousands of digits
        return f"a huge {type(value).__name__}"
    return text if len(text) <= 60 else text[:57] + "..."
