"""A known test written as benches write: in any dialect of text, or as a workbook."""

import csv
import io
from dataclasses import dataclass
from pathlib import Path

import openpyxl

from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import Converted
from wirebayes.io.bench.convert import convert as convert_all
from wirebayes.io.bench.undecided import Choices

Hold = tuple[int, float, list[float], list[float]]  # number, displacement in mm, times in s, tensions in N

NAMES = {
    "en": {"hold": "Hold", "displacement": "Displacement", "time": "Time", "tension": "Force"},
    "de": {"hold": "Stufe", "displacement": "Traversenweg", "time": "Prüfzeit", "tension": "Zugkraft"},
    "fr": {"hold": "Palier", "displacement": "Déplacement", "time": "Temps", "tension": "Force"},
    "es": {"hold": "Paso", "displacement": "Desplazamiento", "time": "Tiempo", "tension": "Fuerza"},
    "it": {"hold": "Passo", "displacement": "Spostamento", "time": "Tempo", "tension": "Forza"},
}
FACTORS = {"mm": 1.0, "cm": 10.0, "m": 1000.0, "in": 25.4, "s": 1.0, "min": 60.0, "h": 3600.0, "ms": 0.001,
           "N": 1.0, "kN": 1000.0, "mN": 0.001, "kgf": 9.80665, "gf": 0.00980665, "lbf": 4.4482216152605,
           "kg": 9.80665}  # fmt: skip


@dataclass(frozen=True)
class Dialect:
    """How a bench writes."""

    delimiter: str = ","
    decimal: str = "."
    thousands: str = ""
    encoding: str = "utf-8"
    newline: str = "\n"
    language: str = "en"
    units: str = "bracket"  # or slash, underscore, row
    displacement: str = "mm"
    time: str = "s"
    tension: str = "N"
    preamble: tuple[str, ...] = ()
    absolute: bool = False
    numbered: bool = True
    quoted: bool = False
    reverse: bool = False
    move_s: float = 7.0


def number(value: float, dialect: Dialect, places: int = 9) -> str:
    text = f"{value:,.{places}f}" if dialect.thousands else f"{value:.{places}f}"
    text = text.replace(",", "T").replace(".", "D")
    text = text.rstrip("0").rstrip("D") if "D" in text else text
    if "D" not in text:
        text += "D0"
    return text.replace("T", dialect.thousands).replace("D", dialect.decimal)


def columns(holds: list[Hold], dialect: Dialect) -> dict[str, list[float]]:
    """The columns in the dialect's units."""
    out: dict[str, list[float]] = {name: [] for name in ("hold", "displacement", "time", "tension")}
    start = 0.0
    for n, x, times, tensions in holds:
        for time, tension in zip(times, tensions, strict=True):
            out["hold"].append(n)
            out["displacement"].append(x / FACTORS[dialect.displacement])
            out["time"].append((start + time if dialect.absolute else time) / FACTORS[dialect.time])
            out["tension"].append(tension / FACTORS[dialect.tension])
        start += times[-1] - times[0] + dialect.move_s
    if not dialect.numbered:
        del out["hold"]
    names = list(out)[::-1] if dialect.reverse else list(out)
    return {name: out[name] for name in names}


def header(names: list[str], dialect: Dialect) -> list[list[str]]:
    """One or two lines of names and units."""
    words = [NAMES[dialect.language][name] for name in names]
    units = ["" if name == "hold" else getattr(dialect, name) for name in names]
    if dialect.units == "row":
        return [words, [f"[{unit}]" if unit else "" for unit in units]]
    forms = {"bracket": "{} [{}]", "slash": "{} / {}", "underscore": "{}_{}"}
    form = forms[dialect.units]
    return [[form.format(word, unit) if unit else word for word, unit in zip(words, units, strict=True)]]


def write_text(path: Path, holds: list[Hold], dialect: Dialect) -> Path:
    """The test as a text file."""
    data = columns(holds, dialect)
    target = io.StringIO()
    quoting = csv.QUOTE_ALL if dialect.quoted else csv.QUOTE_MINIMAL
    writer = csv.writer(target, delimiter=dialect.delimiter, lineterminator=dialect.newline, quoting=quoting)
    for line in dialect.preamble:
        target.write(line + dialect.newline)
    for line in header(list(data), dialect):
        writer.writerow(line)
    for row in zip(*data.values(), strict=True):
        cells = zip(data, row, strict=True)
        writer.writerow([str(v) if name == "hold" else number(v, dialect) for name, v in cells])
    path.write_bytes(target.getvalue().encode(dialect.encoding))
    return path


def write_workbook(path: Path, holds: list[Hold], dialect: Dialect) -> Path:
    """The test as an xlsx workbook."""
    data = columns(holds, dialect)
    book = openpyxl.Workbook()
    sheet = book.active
    for line in dialect.preamble:
        sheet.append([line])
    for line in header(list(data), dialect):
        sheet.append(line)
    for row in zip(*data.values(), strict=True):
        sheet.append(list(row))
    book.save(path)
    return path


def convert(path: Path, about: About, choices: Choices) -> Converted:
    """The only experiment of a file."""
    (only,) = convert_all(path, about, choices)
    return only
