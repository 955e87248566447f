"""Posterior draws of wires as the robot takes them: plain arrays, and which draw goes to which leg.

Bench quantities, instrument effects and one-off events are dropped here and go no further.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from wirebayes.errors import InputError
from wirebayes.json_files.pose import Specimens, WiresUsed
from wirebayes.notice import Notice
from wirebayes.numeric.typing import Bools, Floats, Indices
from wirebayes.robot.mechanics.description import GivenWire, Robot
from wirebayes.robot.mechanics.rotation import matrix
from wirebayes.robot.mechanics.statics import geometry
from wirebayes.robot.mechanics.wires import Wires
from wirebayes.wire import laws
from wirebayes.wire.effect import OF_THE_BENCH, Effect, Placed, steady_hold

CORE = ("k1", "B", "U", "k2", "N")
DIFFER = ("k1", "B", "k2")  # what a stated spread lets differ from specimen to specimen
LENGTH_EXPONENT = "length_exponent"  # creep elongation grows as length to this power; 1, a strain, unless fitted


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
    name : str
        Of the wire in the robot's file that it is; "default" are the legs that name none.
    others : mapping of name to WireDraws
        Lines of legs with other names, as many draws each, independent of these.
    spread : mapping of name to (n,) array
        Standard deviations of the logarithms of `CORE` from specimen to specimen, where several were tested; the
        parameters are then the line's. Empty: a stated spread is used.
    specimens : int
        How many were tested.
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
    name: str = "default"
    others: Mapping[str, "WireDraws"] = field(default_factory=dict)
    spread: Mapping[str, Floats] = field(default_factory=dict)
    specimens: int = 1
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
        parts = ({k: v[index] for k, v in values.items()} for values in (self.parameters, self.spread))
        return replace(self, parameters=next(parts), spread=next(parts), others=others)

    def centre(self) -> "WireDraws":
        """One wire with the posterior mean of every parameter: what a controller would use."""
        others = {name: line.centre() for name, line in self.others.items()}
        means = ({k: np.array([v.mean()]) for k, v in values.items()} for values in (self.parameters, self.spread))
        return replace(self, parameters=next(means), spread=next(means), others=others)

    @property
    def each(self) -> dict[str, "WireDraws"]:
        """This line and the others by name."""
        return {self.name: self} | dict(self.others)


def material(effects: Sequence[Effect]) -> tuple[Effect, ...]:
    """Those effects that a wire shows wherever it hangs."""
    return tuple(e for e in effects if e.scope == "material" and e.place not in OF_THE_BENCH)


def given(wire: GivenWire) -> WireDraws:
    """A wire of stated parameters as one draw without uncertainty."""
    return WireDraws({k: np.array([v]) for k, v in wire.parameters.items()}, wire.length_mm)


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
    n = line.count
    effects = _united(line)
    names = CORE + tuple(c for e in effects for c in e.columns())
    by_length = [e for e in effects if e.place == "sample"]
    scaled = any(LENGTH_EXPONENT in one.parameters for one in lines)
    theta: dict[str, Floats]
    if spread == 0 and not robot.given and not line.others and not scaled and not by_length:  # shared by all legs
        theta = {name: line.parameters[name][None] for name in names}
    else:
        theta = {name: _of_legs([_value(wire, name, effects) for wire in lines], n) for name in names}
    if spread > 0:
        if rng is None:
            raise ValueError("a specimen spread needs a random generator")
        for name in differing(line):
            sd = _of_legs([spread_of(one, name, spread) for one in lines], n)
            theta[name] = theta[name] * np.exp(sd * rng.standard_normal((robot.legs, n)))
    length = np.array([wire.length_mm for wire in lines])[:, None]
    longer = np.where(_is_given(robot), 1.0, 1e3 * nominal_length(robot)[:, None] / length)
    if scaled:
        exponent = _of_legs([one.parameters.get(LENGTH_EXPONENT, np.ones(1)) for one in lines], n)
        theta["B"] = theta["B"] * longer ** (exponent - 1.0)
    reference = _reference_tension(line, lines)
    hold = steady_hold(theta, length * longer, reference, length_ref_mm=length)
    theta = dict(Placed(by_length, theta).change("sample", theta, hold))
    others = tuple(e for e in effects if e.place != "sample")
    return Wires(line.law, line.history, theta, length, others, reference)


def _reference_tension(line: WireDraws, lines: Sequence[WireDraws]) -> Any:
    """Reference tension of effects: one, or a leg's own where lines differ."""
    if any(one.tension_ref_N != line.tension_ref_N for one in line.others.values()):
        return _by_leg([one.tension_ref_N for one in lines])
    return line.tension_ref_N


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


def specimens_in_words(wires: WiresUsed) -> list[str]:
    """A sentence for each line whose spread was estimated, of `wires_summary`'s content.

    Parameters
    ----------
    wires : WiresUsed
        ``wires`` of ``pose.json``.
    """
    sentences = []
    for name, one in wires.get("specimens", {}).items():
        shares = []
        for parameter in CORE:
            low, middle, high = (100 * one["spread"][parameter][key] for key in ("q05", "q50", "q95"))
            shares.append(f"{parameter} by {middle:.2g} % ({low:.2g} to {high:.2g} %)")
        sentences.append(f"Specimens of {name} differ as estimated from {one['tests']} tests: {', '.join(shares)}.")
    return sentences


def lines_of(robot: Robot, line: WireDraws) -> list[WireDraws]:
    """The line of every leg's wire.

    Raises
    ------
    InputError
        A leg's wire has neither parameters in the robot's file nor a posterior.
    """
    out = []
    for i, name in enumerate(robot.wire):
        if name in robot.given:
            out.append(given(robot.given[name]))
        elif name in line.each or (name == "default" and not line.others):
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


def wires_summary(robot: Robot, line: WireDraws) -> WiresUsed:
    """Which wires an answer is for, as ``pose.json`` says it."""
    kept = line.material()
    used: WiresUsed = {
        "draws": line.count,
        "tested_length_mm": line.length_mm,
        "elastic_law": line.law,
        "history": line.history,
        "effects": [e.key for e in kept],
        "left_out": [e.key for e in line.effects if e not in kept],
        "legs": list(robot.wire),
        "lines": list(line.each),
    }
    several = {name: _specimens(one) for name, one in line.each.items() if one.spread}
    if several:
        used["specimens"] = several
    return used


def _specimens(line: WireDraws) -> Specimens:
    """How many were tested, and how much they differ."""
    spread = {name: np.quantile(draws, [0.05, 0.5, 0.95]).tolist() for name, draws in line.spread.items()}
    return {
        "tests": line.specimens,
        "spread": {name: {"q05": low, "q50": middle, "q95": high} for name, (low, middle, high) in spread.items()},
    }


def doubts(robot: Robot, line: WireDraws) -> list[Notice]:
    """What the fits of the lines that legs hang on say against using them."""
    of_leg = lines_of(robot, line)
    used = {name: one for name, one in line.each.items() if any(leg is one for leg in of_leg)}
    return [doubt.of(f"wire {name}") if line.others else doubt for name, one in used.items() for doubt in one.doubts]


def wire_warnings(robot: Robot, line: WireDraws, tension_N: Floats, time_s: float, zero_m: Floats) -> list[Notice]:
    """A warning for each doubt about a line's fit, and for each way in which a use leaves what was tested.

    Parameters
    ----------
    robot : Robot
    line : WireDraws
        Knows the tensions, hold durations and length that were tested.
    tension_N : (..., w) array
        Tensions of the use; slack and failed ones do not count.
    time_s : float
        Longest time of the use.
    zero_m : (..., w) array
        Zero-tension lengths of the use.

    Returns
    -------
    list of Notice
    """
    out = doubts(robot, line)
    if not line.others and not robot.given:
        return out + _of_one(line, tension_N, time_s, zero_m)
    of_leg = lines_of(robot, line)
    for name, one in line.each.items():
        own = np.array([leg is one for leg in of_leg])
        if own.any():  # a wire that the robot's file gives was not tested at all
            found = _of_one(one, tension_N[..., own], time_s, zero_m[..., own])
            out += [notice.of(f"wire {name}") for notice in found] if line.others else found
    return out


def _span(values: Floats, form: str) -> str:
    """The least and the largest of positive values, once where they look alike; 0 for one that vanishes beside it."""
    least, largest = float(values.min()), float(values.max())
    ends = [format(end if end >= _VANISHES * largest else 0.0, form) for end in (least, largest)]
    return " to ".join(dict.fromkeys(ends))


_VANISHES = 1e-3  # share of the largest value: its third digit


def _of_one(line: WireDraws, tension_N: Floats, time_s: float, zero_m: Floats) -> list[Notice]:
    beyond, dropped = list[str](), list[str]()
    loads = tension_N[np.isfinite(tension_N) & (tension_N > 0)]
    if line.tension_range_N is not None and loads.size:
        low, high = line.tension_range_N
        if loads.min() < low or loads.max() > high:
            beyond.append(f"tensions {_span(loads, '.3g')} N leave the tested range {low:.3g} to {high:.3g} N")
    if line.time_range_s is not None and time_s > line.time_range_s[1]:
        beyond.append(f"{time_s:.4g} s is longer than the longest tested hold, {line.time_range_s[1]:.4g} s")
    lengths = 1e3 * zero_m[np.isfinite(zero_m)]
    if lengths.size and (lengths.min() < 0.5 * line.length_mm or lengths.max() > 2.0 * line.length_mm):
        rule = "is taken to be a strain of the whole wire"
        if LENGTH_EXPONENT in line.parameters:
            rule = "grows with length by the exponent fitted to the tested lengths"
        beyond.append(f"wires of {_span(lengths, '.0f')} mm, tested at {line.length_mm:.0f} mm: creep {rule}")
    kept = line.material()
    dropped.extend(
        f"the robot knows no temperature: the effect {e.name} sees none, as at the first reading of the test"
        for e in kept
        if e.place == "zero_length"
    )
    dropped.extend(
        f"the material effect {e.name} has no place in the robot and is left out"
        for e in line.effects
        if e.scope == "material" and e not in kept
    )
    if any(e.name == "discrepancy" for e in line.effects):
        dropped.append("what the fit could not name is not in the robot: its wires follow the named model only")
    return [Notice("extrapolation", text) for text in beyond] + [Notice("left-out", text) for text in dropped]
