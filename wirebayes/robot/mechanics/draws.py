"""Posterior draws of wires as the robot takes them: plain arrays, and which draw goes to which leg.

Bench quantities, instrument effects and one-off events are dropped here and go no further.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Bools, Floats, Indices
from wirebayes.result_warnings import Notice
from wirebayes.robot.mechanics.description import GivenWire, Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.statics import geometry
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.wire import laws
from wirebayes.wire.away_from_bench import steady_hold
from wirebayes.wire.effect import OF_THE_BENCH, ONE_NEWTON_AND_SECOND, Effect, Placed, Typical

CORE = ("k1", "B", "U", "k2", "N")
DIFFER = ("k1", "B", "k2")  # what a stated spread lets differ from specimen to specimen
LENGTH_EXPONENT = "length_exponent"  # creep elongation grows as length to this power; 1, a strain, unless fitted


@dataclass(frozen=True)
class UndecidedModels:
    """Models between which the readings of a line leave it undecided.

    Attributes
    ----------
    models : tuple of tuple of str
        The effects of each that a robot's wires show too, by their keys; the most probable model first.
    of_draw : (n,) int array
        Which of them each draw is of.
    """

    models: tuple[tuple[str, ...], ...]
    of_draw: Indices


@dataclass(frozen=True)
class WireDraws:
    """Joint posterior draws of one line.

    Attributes
    ----------
    parameters : mapping of name to (n,) array
        ``k1`` (N), ``B`` (mm N^-U), ``U``, ``k2`` (s^-N), ``N`` and ``effect_name.parameter``; ``length_exponent``
        where samples of two lengths determined it.
    length_mm : float
        Zero-tension length of the tested sample; `B` refers to it.
    law : {"hooke", "modified"}
    history : {"saturating", "additive"}
    effects : tuple of Effect
        Only the material ones are used.
    tension_range_N, time_range_s : (low, high) or None
        What was tested; outside, the answer is an extrapolation and is said to be one.
    tension_ref_N : float
    typical : Typical
        Tension and hold of the tests that it was fitted to.
    name : str
        Of the wire in the robot's file that it is; "default" are the legs that name none.
    others : mapping of name to WireDraws
        Lines of legs with other names, as many draws each, independent of these.
    spread : mapping of name to (n,) array
        Standard deviations of the logarithms of `CORE` from specimen to specimen, where several were tested; the
        parameters are then the line's. Those of B and k2 are of the creep at the typical tension and of the hazard
        after a typical hold. Empty: a stated spread is used.
    specimens : int
        How many were tested.
    undecided : UndecidedModels or None
        Where draws are of several models; `effects` are those of all, neutral in the draws of models without them.
    doubts : tuple of Notice
        What the fits say against using them.
    """

    parameters: Mapping[str, Floats]
    length_mm: float
    law: laws.ElasticLaw = "hooke"
    history: laws.History = "saturating"
    effects: tuple[Effect, ...] = ()
    tension_range_N: tuple[float, float] | None = None
    time_range_s: tuple[float, float] | None = None
    tension_ref_N: float = 1.0
    typical: Typical = ONE_NEWTON_AND_SECOND
    name: str = "default"
    others: Mapping[str, "WireDraws"] = field(default_factory=dict)
    spread: Mapping[str, Floats] = field(default_factory=dict)
    specimens: int = 1
    undecided: UndecidedModels | None = None
    doubts: tuple[Notice, ...] = ()

    @property
    def count(self) -> int:
        """Number of draws."""
        return len(self.parameters["k1"])

    def material(self) -> tuple[Effect, ...]:
        """The effects that the robot's wires show too."""
        return material(self.effects)

    def part(self, index: Indices | slice) -> "WireDraws":
        """Some of the draws, each with all its parameters."""
        others = {name: line.part(index) for name, line in self.others.items()}
        parameters = {name: values[index] for name, values in self.parameters.items()}
        spread = {name: values[index] for name, values in self.spread.items()}
        undecided = self.undecided and replace(self.undecided, of_draw=self.undecided.of_draw[index])
        return replace(self, parameters=parameters, spread=spread, others=others, undecided=undecided)

    def centre(self) -> "WireDraws":
        """One wire with the mean of every parameter, under the most probable model."""
        others = {name: line.centre() for name, line in self.others.items()}
        best = self.undecided.of_draw == 0 if self.undecided else np.ones(self.count, bool)
        parameters = {name: np.array([values[best].mean()]) for name, values in self.parameters.items()}
        spread = {name: np.array([values[best].mean()]) for name, values in self.spread.items()}
        return replace(self, parameters=parameters, spread=spread, others=others, undecided=None)

    @property
    def each(self) -> dict[str, "WireDraws"]:
        """This line and the others by name."""
        return {self.name: self} | dict(self.others)


def material(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """The effects that a wire shows wherever it hangs."""
    return tuple(e for e in effects if e.scope == "material" and e.place not in OF_THE_BENCH)


def given(wire: GivenWire) -> WireDraws:
    """A wire of stated parameters as one draw without uncertainty."""
    return WireDraws({k: np.array([v]) for k, v in wire.parameters.items()}, wire.length_mm)


def stated_line(robot: Robot, count: int) -> WireDraws:
    """As many draws as asked for of a line that no leg hangs on: a robot's file gives the parameters of all wires.

    Parameters
    ----------
    robot : Robot
    count : int

    Raises
    ------
    InputError
        A leg's wire has no parameters in the robot's file.
    """
    for leg, name in enumerate(robot.wire, start=1):
        if name not in robot.given:
            found = "no --wires, and a wire whose parameters the file does not give"
            raise InputError(f"{robot.name}, leg {leg}: found {found}, expected --wires FOLDER or [wires.NAME] k1_N")
    return WireDraws({name: np.ones(count) for name in CORE}, 1e3, name="")


def for_robot(robot: Robot, line: WireDraws, spread: float = 0.0, rng: np.random.Generator | None = None) -> Wires:
    """Wires of all legs: one joint draw for all legs of one line, and a spread from specimen to specimen.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        For every leg whose wire is not given in the robot's file.
    spread : float
        Relative standard deviation of stiffness k1, creep amount B and rate k2 from leg to leg (log-normal, the three
        independent), beside the shared draw; 0: wires of one line are alike. Of a line whose spread was estimated,
        each draw's own spread of each parameter is taken.
    rng : numpy Generator
        Needed when `spread` is not zero.

    Returns
    -------
    Wires
        With ``(1, n)`` parameters when all legs share everything, else ``(w, n)``.
    """
    lines = lines_of(robot, line)
    theta = _of_all_legs(robot, line, lines, spread > 0)
    if spread > 0:
        if rng is None:
            raise ValueError("a specimen spread needs a random generator")
        _spread_specimens(theta, robot, line, spread, rng)
    length = np.array([wire.length_mm for wire in lines])[:, None]
    longer = _times_as_long(robot, length)
    if _grows_with_length(lines):
        exponents = [one.parameters.get(LENGTH_EXPONENT, np.ones(1)) for one in lines]
        theta["B"] = theta["B"] * longer ** (_of_legs(exponents, line.count) - 1.0)
    reference = _reference_tension(line, lines)
    typical = typical_of_legs(line, lines)
    hold = steady_hold(theta, length * longer, reference, length_ref_mm=length, typical=typical)
    effects = _united(line)
    at_sample = Placed(_at_sample(effects), theta)
    theta = dict(at_sample.change("sample", theta, hold))
    others = tuple(effect for effect in effects if effect.place != "sample")
    return Wires(line.law, line.history, theta, length, others, reference)


def differing_by(theta: Mapping[str, Floats], factors: Mapping[str, Floats], typical: Typical) -> dict[str, Floats]:
    """Parameters of specimens that differ from those of their line by factors.

    B and k2 differ as the creep at the typical tension and the hazard after a typical hold do, for which of the tests
    these were does not depend on units: where U or N differs, too, they follow.

    Parameters
    ----------
    theta : mapping of name to (w, n) or (1, n) array
        Of the line.
    factors : mapping of name to (w, n) array
    typical : Typical
        Of the tests of each leg's line.
    """
    out = {name: theta[name] * factor for name, factor in factors.items()}
    for name, exponent, scale in (("B", "U", typical.tension_N), ("k2", "N", typical.hold_s)):
        if exponent in out:
            out[name] = out.get(name, theta[name]) * scale ** (theta[exponent] - out[exponent])
    return out


def _times_as_long(robot: Robot, length_mm: Floats) -> Floats:
    """(w, 1) how many times as long each wire hangs as the one tested (w, 1); 1 for a wire that the file gives."""
    hung = 1e3 * nominal_length(robot)[:, None] / length_mm
    return np.where(_is_given(robot), 1.0, hung)


def _spread_specimens(
    theta: dict[str, Floats], robot: Robot, line: WireDraws, spread: float, rng: np.random.Generator
) -> None:
    """Let parameters differ from leg to leg."""
    lines = lines_of(robot, line)
    differs = {}
    for name in differing(line):
        sd = _of_legs([spread_of(one, name, spread) for one in lines], line.count)
        noise = rng.standard_normal((robot.legs, line.count))
        differs[name] = np.exp(sd * noise)
    theta |= differing_by(theta, differs, typical_of_legs(line, lines))


def _of_all_legs(robot: Robot, line: WireDraws, lines: Sequence[WireDraws], spread: bool) -> dict[str, Floats]:
    """All parameters: ``(1, n)`` where all legs share them, else ``(w, n)``."""
    effects = _united(line)
    names = list(CORE)
    for effect in effects:
        names += effect.columns()
    several = spread or robot.given or line.others
    if not several and not _grows_with_length(lines) and not _at_sample(effects):
        return {name: line.parameters[name][None] for name in names}
    return {name: _of_legs([_value(wire, name, effects) for wire in lines], line.count) for name in names}


def _grows_with_length(lines: Sequence[WireDraws]) -> bool:
    return any(LENGTH_EXPONENT in one.parameters for one in lines)


def _at_sample(effects: Sequence[Effect]) -> list[Effect]:
    """Effects that follow a wire's length."""
    return [effect for effect in effects if effect.place == "sample"]


def _reference_tension(line: WireDraws, lines: Sequence[WireDraws]) -> Any:
    """Reference tension of effects: one, or a leg's own where lines differ."""
    if any(one.tension_ref_N != line.tension_ref_N for one in line.others.values()):
        return _by_leg([one.tension_ref_N for one in lines])
    return line.tension_ref_N


def typical_of_legs(line: WireDraws, lines: Sequence[WireDraws]) -> Typical:
    """What is typical of the tests of every leg's line: two numbers, or a leg's own where lines differ.

    Parameters
    ----------
    line : WireDraws
    lines : sequence of WireDraws
        As `lines_of` returned them.
    """
    if any(one.typical != line.typical for one in line.others.values()):
        return Typical(*(_by_leg([one.typical[i] for one in lines]) for i in range(2)))
    return line.typical


def _of_legs(values: Sequence[Floats | float], n: int) -> Floats:
    """Values of ``w`` legs, each of one draw or of ``n``, as ``(w, n)``."""
    return np.stack([np.broadcast_to(value, (n,)) for value in values])


def differing(line: WireDraws) -> tuple[str, ...]:
    """The parameters in which specimens of a line, or of one beside it, differ."""
    return CORE if any(one.spread for one in line.each.values()) else DIFFER


def spread_of(line: WireDraws, name: str, stated: float) -> Floats | float:
    """Spread of a parameter from specimen to specimen: each draw's, where it was estimated.

    Parameters
    ----------
    line : WireDraws
    name : str
        One of `CORE`.
    stated : float
        Relative spread of a line whose own was not estimated.
    """
    if line.spread:
        return line.spread[name]
    return stated if name in DIFFER else 0.0


def typical_spread(line: WireDraws, stated: float) -> float:
    """The spread that stands for all: the estimated one's root mean square over k1, B and k2, or the stated one."""
    if not line.spread:
        return stated
    return round(float(np.sqrt(np.mean([line.spread[name] ** 2 for name in DIFFER]))), 4)


def lines_of(robot: Robot, line: WireDraws) -> list[WireDraws]:
    """The line of every leg's wire.

    Raises
    ------
    InputError
        A leg's wire has neither parameters in the robot's file nor a posterior.
    """
    out = []
    is_of_every_leg = not line.others and line.name not in robot.wire  # whatever it is called
    for i, name in enumerate(robot.wire):
        if name in robot.given:
            out.append(given(robot.given[name]))
        elif name in line.each or (name == "default" and is_of_every_leg):
            out.append(line.each.get(name, line))
        else:
            known = " or ".join(line.each)
            raise InputError(
                f"{robot.name}: leg {i + 1}, key wire: found {name!r} and posteriors of {known}, expected one more, "
                f"--wires {name}=FOLDER"
            )
    return out


def _united(line: WireDraws) -> tuple[Effect, ...]:
    """The effects of all lines, each once."""
    effects: dict[str, Effect] = {}
    for one in line.each.values():
        effects |= {effect.key: effect for effect in one.material()}
    return tuple(effects.values())


def _by_leg(values: list[float]) -> Any:
    """A value a leg where the physics of one wire has a number: effects compute with either."""
    return np.array(values)[:, None]


def nominal_length(robot: Robot) -> Floats:
    """Length of each leg's wire, (w,) m: all of a linear actuator's, a drum's at the home pose."""
    shape = geometry(robot, robot.home_m[:, None], matrix(robot.home_rotation_rad)[..., None])
    free = robot.lines * shape.distance_m[:, 0] + robot.beyond_m
    return np.where(robot.is_linear, robot.wire_m, free)


def _is_given(robot: Robot) -> Bools:
    return np.array([[name in robot.given] for name in robot.wire])


def _value(wire: WireDraws, name: str, effects: tuple[Effect, ...]) -> Floats:
    """A parameter, or the neutral value of an effect that this leg's wire does not have."""
    if name in wire.parameters:
        return wire.parameters[name]
    for effect in effects:
        for amplitude, column in zip(effect.amplitudes, effect.columns(), strict=True):
            if column == name:
                return np.array([amplitude.neutral])
    raise KeyError(name)
