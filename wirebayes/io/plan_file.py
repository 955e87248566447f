"""A plan, read from TOML: tests that could be done, a guess of the wire, and the aim."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.io import mistaken_table
from wirebayes.io.experiment import ENOUGH, LEAST_READINGS
from wirebayes.io.experiment_file import control_of, length_of, refuse_second
from wirebayes.io.readings import READ, STRETCH
from wirebayes.strict.files import read_text
from wirebayes.strict.hint import hint
from wirebayes.strict.table import LARGEST
from wirebayes.strict.toml_keys import Keys, read_toml
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.protocol import Control

KIND = "protocol"
GUESSED = ("k1", "B", "U", "k2", "N", "preload", "sensor_sd", "setting_sd")
MOST_READINGS = 20_000  # of a protocol: a plan simulates it hundreds of times
_TOP = ("material", "budget_min", "robot", "aim", "posterior", "guess", "prior", KIND)
_KEYS = ("name", "length_mm", "control", "holds", "unload", "times_s", "hold_s", "readings", "temperatures_C")
_SET = {
    "displacement": ("displacements_mm", "step_mm", "resolution_N"),
    "force": ("weights_N", "step_N", "resolution_mm"),
}


@dataclass(frozen=True)
class PlannedTest:
    """One test that could be done.

    Attributes
    ----------
    name : str
    length_mm : float
    control : {"displacement", "force"}
    settings : tuple of float
        One a hold, the way back included: displacements, mm, or weights, N.
    resolution : float
        Of what is read, N or mm.
    times_s : tuple of float
        Reading times of each hold.
    temperatures_C : tuple of float
        At evenly spaced moments of the test; empty for none.
    """

    name: str
    length_mm: float
    control: Control
    settings: tuple[float, ...]
    resolution: float
    times_s: tuple[float, ...]
    temperatures_C: tuple[float, ...] = ()


@dataclass(frozen=True)
class PlanFile:
    """The content of a plan file.

    Attributes
    ----------
    source : Path
    tests : tuple of PlannedTest
        Empty where the file leaves the choice to the toolkit.
    material : str
    guess : dict of name to table
        As written: a distribution as in ``[prior]``, or a number.
    guess_lines : dict of name to line
    posterior : Path or None
        Folder of an earlier fit whose draws are the guess.
    priors : dict of name to table
        Of the fit to come.
    prior_lines : dict of name to line
    budget_min : float or None
    robot : str or None
        Name or file of a robot.
    aim : tuple of str
        ``("parameters",)``, ``("creep",)``, or two effects to distinguish.
    """

    source: Path
    tests: tuple[PlannedTest, ...]
    material: str = "line"
    guess: dict[str, Any] = field(default_factory=dict)
    guess_lines: dict[str, int] = field(default_factory=dict)
    posterior: Path | None = None
    priors: dict[str, dict[str, Any]] = field(default_factory=dict)
    prior_lines: dict[str, int] = field(default_factory=dict)
    budget_min: float | None = None
    robot: str | None = None
    aim: tuple[str, ...] = ("parameters",)


def is_plan(path: Path) -> bool:
    """Whether a TOML file has no ``[[experiment]]``, so that it is read as a plan."""
    try:
        return "experiment" not in read_toml(path, read_text(path, "TOML of a plan, or of experiments"))
    except InputError as error:
        raise mistaken_table.complaint(path, error) from None


def read_plan(path: Path, effects: Sequence[str] = ()) -> PlanFile:
    """Read a plan file.

    Parameters
    ----------
    effects : sequence of str
        Effects that an aim may name.

    Raises
    ------
    InputError
        On anything wrong, with the file, the line, the key, what was found and what was expected.
    """
    text = read_text(path, "TOML with [[protocol]] tables")
    top = Keys.of_file(path, text)
    top.only(_TOP)
    tests: list[PlannedTest] = []
    for index, keys in enumerate(top.tables(KIND)):
        test = _planned(keys, index)
        refuse_second(keys, test.name, [other.name for other in tests])
        tests.append(test)
    guess = _guess(top)
    posterior = _posterior_folder(top)
    if posterior is not None and guess:
        raise top.complain("posterior", "a posterior beside a [guess]", "one of them")
    expected = "a time budget above 0 min"
    budget = top.number("budget_min", expected, above=0.0) if "budget_min" in top.table else None
    robot = top.string("robot", "a robot's name or file") if "robot" in top.table else None
    if robot is not None and os.path.isfile(path.parent / robot):
        robot = str(path.parent / robot)
    material = top.string("material", "a name", "line")
    priors = top.priors()
    _check_units(top, tests, {"guess": guess, "prior": priors})
    return PlanFile(
        path,
        tuple(tests),
        material,
        guess,
        {n: top.line(f"guess.{n}") for n in guess},
        posterior,
        priors,
        {n: top.line(f"prior.{n}") for n in priors},
        budget,
        robot,
        _aim(top, effects),
    )


def _check_units(top: Keys, tests: Sequence[PlannedTest], stated: Mapping[str, Mapping[str, Any]]) -> None:
    """Refuse an error of the bench that would be in N for some of the tests, and in mm for others."""
    if len({test.control for test in tests}) < 2:
        return
    for table, values in stated.items():
        for name in ("sensor_sd", "setting_sd"):
            if name in values:
                found = "one number for tests by steps and for tests under weights, where its units differ"
                raise top.complain(f"{table}.{name}", found, "none, or tests of one kind")


def _planned(keys: Keys, index: int) -> PlannedTest:
    control = control_of(keys)
    by_weights = control == "force"
    of_settings, step, of_resolution = _SET[control]
    keys.only((*_KEYS, of_settings, step, of_resolution))
    name = keys.string("name", "a name", f"protocol-{index + 1}")
    length = length_of(keys)
    resolution = 0.01
    if of_resolution in keys.table:
        expected = f"a step of 0 {READ_UNIT[control]} or more"
        resolution = keys.number(of_resolution, expected, least=0.0, most=LARGEST[READ[control]])
    path = _weights(keys) if by_weights else _displacements(keys, length)
    if "unload" in keys.table:
        most = len(path) - 1
        back = keys.whole("unload", f"a whole number of holds on the way back, 0 to {most}", 0, most)
        path += path[-2 : -2 - back : -1]
    times = _times(keys)
    _check_count(keys, len(path), len(times))
    warmth = _warmth(keys)
    return PlannedTest(name, length, control, tuple(path), resolution, tuple(times), tuple(warmth))


def _check_count(keys: Keys, holds: int, times: int) -> None:
    """Refuse fewer readings than a fit needs, or more than it can hold."""
    key = "times_s" if "times_s" in keys.table else "readings"
    count = holds * times
    if count < LEAST_READINGS:
        raise keys.complain(key, f"{holds} holds of {times}", ENOUGH)
    if count > MOST_READINGS:
        raise keys.complain(key, f"{count} readings in all", f"at most {MOST_READINGS}")


def _warmth(keys: Keys) -> list[float]:
    """The temperatures at which the test is to be made; none where they are not said."""
    if "temperatures_C" not in keys.table:
        return []
    expected = "a list of temperatures above -273.15 °C"
    warmth = keys.numbers("temperatures_C", expected)
    if not warmth or min(warmth) <= -273.15:
        raise keys.complain("temperatures_C", shown(warmth), expected)
    return warmth


def _displacements(keys: Keys, length: float) -> list[float]:
    expected = f"a list of displacements above -{length:g} mm, the wire's length, and of at most {STRETCH:g} times it"
    path, key = _settings(keys, "displacement", expected)
    if not path or min(path) <= -length or max(path) > STRETCH * length:
        raise keys.complain(key, shown(keys.table[key]), expected)
    return path


def _weights(keys: Keys) -> list[float]:
    expected = f"a list of weights above 0 N, of at most {LARGEST['tension_N']:.0e} N"
    path, key = _settings(keys, "force", expected)
    if not path or min(path) <= 0 or max(path) > LARGEST["tension_N"]:
        raise keys.complain(key, shown(keys.table[key]), expected)
    return path


def _settings(keys: Keys, control: Control, expected: str) -> tuple[list[float], str]:
    """What is set in each hold on the way up, listed or as steps, and the key that says it."""
    of_settings, of_step, _ = _SET[control]
    if of_settings in keys.table:
        _check_said_once(keys, of_settings, (of_step, "holds"))
        return keys.numbers(of_settings, expected), of_settings
    unit = SET_UNIT[control]
    step = keys.number(of_step, f"a step other than 0 {unit}, or {of_settings}")
    if step == 0:
        raise keys.complain(of_step, "0", f"a step other than 0 {unit}")
    count = keys.whole("holds", "a whole number of holds, 1 or more", 1, MOST_READINGS)
    return [step * (i + 1) for i in range(count)], of_step


def _check_said_once(keys: Keys, key: str, others: Sequence[str]) -> None:
    """Refuse a key beside those that say the same in another way."""
    for other in others:
        if other in keys.table:
            raise keys.complain(other, f"{other} beside {key}", "one way to say it")


def _times(keys: Keys) -> list[float]:
    longest = LARGEST["time_s"]
    if "times_s" in keys.table:
        _check_said_once(keys, "times_s", ("hold_s", "readings"))
        expected = "a list of rising times from 0 s on"
        times = keys.numbers("times_s", expected)
        if not times or times[0] < 0 or times[-1] > longest or (np.diff(times) <= 0).any():
            raise keys.complain("times_s", shown(keys.table["times_s"]), expected)
        return times
    expected = f"how long each hold lasts, above 0 s and at most {longest:.0e} s, or times_s"
    duration = keys.number("hold_s", expected, above=0.0, most=longest)
    count = 5  # the paper's
    if "readings" in keys.table:
        count = keys.whole("readings", "a whole number of readings in a hold, 2 or more", 2, MOST_READINGS)
    return np.linspace(0.0, duration, count).tolist()


def _guess(top: Keys) -> dict[str, Any]:
    inner = top.inside("guess", {}, "a table of parameters")
    for name, value in inner.table.items():
        if name not in GUESSED:
            raise inner.complain(name, f"an unknown parameter{hint(name, GUESSED)}", ", ".join(GUESSED))
        if isinstance(value, bool) or not isinstance(value, int | float | dict):
            raise inner.complain(name, shown(value), 'a number, or a table such as { distribution = "normal", … }')
    return inner.table


def _posterior_folder(top: Keys) -> Path | None:
    """The folder that the plan names; None where it names none."""
    if "posterior" not in top.table:
        return None
    expected = "the folder of a fit"
    stated = top.string("posterior", expected)
    folder = top.source.parent / stated
    if not os.path.isdir(folder):
        raise top.complain("posterior", f"{shown(stated)}, which is no folder there", expected)
    return folder


def _aim(top: Keys, effects: Sequence[str]) -> tuple[str, ...]:
    aim = top.table.get("aim", "parameters")
    if aim in ("parameters", "creep"):
        return (str(aim),)
    expected = '"parameters", "creep", or a list of two different effects to distinguish'
    if not (isinstance(aim, list) and all(isinstance(name, str) for name in aim) and len(set(aim)) == len(aim) == 2):
        raise top.complain("aim", shown(aim), expected)
    for name in aim:
        if name not in effects:
            raise top.complain("aim", f"{shown(name)}{hint(name, effects)}", expected)
    return tuple(aim)
