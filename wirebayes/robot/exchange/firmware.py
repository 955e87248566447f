"""Hangprinters as their firmware knows them: ``config.g`` of RepRapFirmware, ``printer.cfg`` of Klipper.

RepRapFirmware: anchors in M669; lines (parts of a wire, U, and wires on a spool, O), masses, forces and wire beyond the
anchors in M666, in millimetres; of a letter given twice the last counts, as when the file is run. Klipper: anchors in
the sections of its winches, the rest under ``[printer]`` as the Hangprinter branch has it. Spools and springs are left
out: zero-tension lengths need neither.
"""

import re
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from wirebayes.errors import InputError
from wirebayes.numeric.typing import Floats, Indices
from wirebayes.robot.exchange.imported import ImportedRobot
from wirebayes.sentences import short
from wirebayes.strict.files import read_text

SUFFIXES = (".g", ".cfg")
_WORD = re.compile(r"([A-Z])\s*((?:[-+]?[0-9.]+)(?::[-+]?[0-9.]+)*)")
_ANCHORS = "ABCDI"
_STEPPERS = "abcdefghi"
_MOST_ON_SPOOL = 9  # lines: a printer has two or three
_SMALLEST_MM = 20.0  # no printer's anchors lie so near to one another; those of metres do


@dataclass
class _Settings:
    """Values by name, with the line they were found in, and the file's own word for them."""

    values: dict[str, list[float]] = field(default_factory=dict)
    line: dict[str, int] = field(default_factory=dict)
    word: dict[str, str] = field(default_factory=dict)

    def put(self, name: str, text: str, separator: str, where: str, line: int) -> None:
        """Keep numbers under a name.

        Parameters
        ----------
        name : str
        text : str
            Numbers as the file has them.
        separator : str
            Between them.
        where : str
            The file.
        line : int
            Its line, from 1.
        """
        parts = [part.strip() for part in text.split(separator)]
        try:
            self.values[name] = [float(part) for part in parts]
        except ValueError:
            raise InputError(f"{where}, line {line}, {name}: found {text!r}, expected numbers") from None
        self.line[name] = line
        self.word[name] = name

    def rename(self, word: str, name: str) -> None:
        """Find what stands under a word of the file by another name, too."""
        if word in self.values:
            self.values[name] = self.values[word]
            self.line[name] = self.line[word]
            self.word[name] = word

    def where(self, name: str) -> str:
        """The line and the word of a value."""
        return f"line {self.line[name]}, {self.word[name]}"


def robot_of_firmware(path: Path) -> ImportedRobot:
    """A robot from the settings of a Hangprinter.

    Parameters
    ----------
    path : Path
        ``….g`` of RepRapFirmware or ``….cfg`` of Klipper.

    Raises
    ------
    InputError
        It cannot be read, or has no anchors, with the line.
    """
    text = read_text(path, "the settings of a firmware")
    if path.suffix == ".g":
        return _of(path, "RepRapFirmware", *_reprapfirmware(text, str(path)))
    return _of(path, "Klipper", *_klipper(text, str(path)))


def _reprapfirmware(text: str, where: str) -> tuple[list[list[float]], _Settings]:
    found = _codes(text, where)
    count = int(found.values.get("M669 N", [4])[0])
    names = [f"M669 {letter}" for letter in _ANCHORS[:count]]
    anchors = _anchors(found, names, where, "M669 with A, B, C, D")
    renamed = {"U": "lines", "O": "on spool", "W": "mass", "Y": "beyond", "I": "least", "X": "most"}
    for letter, name in renamed.items():
        found.rename(f"M666 {letter}", name)
    return anchors, found


def _codes(text: str, where: str) -> _Settings:
    """The letters of all M669 and M666."""
    found = _Settings()
    for number, line in enumerate(text.splitlines(), 1):
        code = line.split(";")[0].strip().upper()
        command = code.split(" ")[0]
        if command in ("M669", "M666"):
            for letter, value in _WORD.findall(code[len(command) :]):
                found.put(f"{command} {letter}", value, ":", where, number)
    return found


def _klipper(text: str, where: str) -> tuple[list[list[float]], _Settings]:
    found, section = _Settings(), ""
    renamed = {
        "winch_mechanical_advantage": "lines",
        "winch_mover_weight": "mass",
        "winch_guy_wire_lengths": "beyond",
        "winch_min_force": "least",
        "winch_max_force": "most",
    }
    for number, line in enumerate(text.splitlines(), 1):
        bare = line.split("#")[0].strip()
        if bare.startswith("["):
            section = bare.strip("[] ")
        key, _, value = (part.strip() for part in bare.replace("=", ":", 1).partition(":"))
        if section.startswith("stepper_") and key.startswith("anchor_"):
            found.put(f"{section} {key}", value, ",", where, number)
        elif section == "printer" and key in renamed:
            found.put(key, value, ",", where, number)
    for key, name in renamed.items():
        found.rename(key, name)
    anchors = []
    for letter in _STEPPERS:
        names = [f"stepper_{letter} anchor_{axis}" for axis in "xyz"]
        if not any(name in found.values for name in names):
            break
        missing = [name for name in names if name not in found.values]
        if missing:
            raise InputError(f"{where}: found no {missing[0]}, expected the anchor's three coordinates in mm")
        anchors.append([found.values[name][0] for name in names])
    if len(anchors) < 2:
        raise InputError(f"{where}: found {len(anchors)} anchors, expected [stepper_a] with anchor_x and so on")
    return anchors, found


def _anchors(found: _Settings, names: list[str], where: str, expected: str) -> list[list[float]]:
    missing = [name for name in names if name not in found.values]
    if missing:
        raise InputError(f"{where}: found no {missing[0]}, expected {expected}")
    out = [found.values[name] for name in names]
    for name, value in zip(names, out, strict=True):
        if len(value) != 3:
            raise InputError(f"{where}, {found.where(name)}: found {len(value)} numbers, expected x:y:z in mm")
    return out


def _of(path: Path, firmware: str, anchors: list[list[float]], found: _Settings) -> ImportedRobot:
    legs = len(anchors)
    settings = found.values

    def each(name: str, missing: float) -> Floats:
        value = settings.get(name, [missing])
        if len(value) not in (1, legs):
            raise InputError(
                f"{path}, {found.where(name)}: found {len(value)} numbers, expected one, or one of each of {legs} wires"
            )
        return np.broadcast_to(np.array(value, float), legs).copy()

    extent = float(np.ptp(anchors, axis=0).max())
    if extent < _SMALLEST_MM:
        raise InputError(f"{path}: found anchors within {short(extent, 3)} of one another, expected millimetres")
    mass = _mass(path, found)
    bounds = None
    if "least" in settings and "most" in settings:
        lowest = each("least", 0.0).max()
        highest = each("most", 0.0).min()
        bounds = float(lowest), float(highest)
    notes = ["Spools, motors and the spring constant of the line are left out."]
    beyond, said = _beyond(each("beyond", 0.0), np.array(anchors), "beyond" in settings)
    notes += said
    winch = None
    on_spools = _on_spools(path, found, each("on spool", 1.0))
    leg = np.repeat(np.arange(legs), on_spools)
    if len(leg) > legs:
        names = _ANCHORS if firmware == "RepRapFirmware" else _STEPPERS.upper()
        winch = tuple(names[i] for i in leg)
        notes.append(
            "The lines of a spool begin and end at one point, all that the firmware knows; give each its exit and "
            "platform point."
        )
    origin = np.zeros(3)
    zero = np.zeros((len(leg), 3))
    return ImportedRobot(
        path.stem,
        f"Imported from {path.name} of {firmware}.",
        "position",
        mass,
        origin,
        np.array(anchors)[leg] / 1000,
        zero,
        np.zeros(len(leg)),
        zero + [0.0, 0.0, 1.0],
        bounds,
        origin,
        origin,
        tuple(notes),
        each("lines", 1.0)[leg],
        beyond[leg] / 1000,
        winch=winch,
        on_bed=True,
    )


def _mass(path: Path, found: _Settings) -> float:
    """Of the mover, kg."""
    if "mass" not in found.values:
        raise InputError(f"{path}: found no weight of the mover, expected M666 W or winch_mover_weight in kg")
    mass = found.values["mass"][0]
    if mass <= 0.0:  # by which the firmware knows that it is not to compensate for stretch
        raise InputError(f"{path}, {found.where('mass')}: found {mass:g}, expected the weight of the mover in kg")
    return mass


def _beyond(given_mm: Floats, anchors_mm: Floats, is_stated: bool) -> tuple[Floats, list[str]]:
    """(w,) wire between anchors (w, 3) and spools, mm, and what is to be said of it."""
    if not is_stated:
        return given_mm, ["The settings do not say how much wire lies between anchors and spools: none is assumed."]
    if (given_mm >= 0.0).all():
        return given_mm, []
    to_last = np.linalg.norm(anchors_mm - anchors_mm[-1], axis=1)
    return to_last, ["A negative length beyond the anchors is the firmware's word for spools at the last anchor."]


def _on_spools(path: Path, found: _Settings, count: Floats) -> Indices:
    """How many lines each spool winds."""
    if not ((count >= 1) & (count <= _MOST_ON_SPOOL) & (count == np.round(count))).all():
        given = ":".join(f"{value:g}" for value in found.values["on spool"])
        expected = f"whole numbers from 1 to {_MOST_ON_SPOOL}, lines on each spool"
        raise InputError(f"{path}, {found.where('on spool')}: found {given}, expected {expected}")
    return count.astype(int)
