"""The page of ``wirebayes export``: the files for firmware and simulators, and how much a line creeps."""

import csv
from pathlib import Path

from wirebayes.io.run_folder import read_json
from wirebayes.json_files.export import ExportSummary
from wirebayes.report.blocks import (
    Configuration,
    Page,
    Picture,
    Pictures,
    Section,
    Table,
    Text,
    before_the_answer,
    beside_the_answer,
    files_beside,
    number,
    seed_of_page,
    span,
)
from wirebayes.report.drawn import drawn
from wirebayes.report.glossary import meaning
from wirebayes.report.pictures.creep_table import growth
from wirebayes.sentences import lasting

_FILES = (
    ("creep-table.csv", "growth of a new line under constant tension, with 90 % intervals"),
    ("reprapfirmware.g", "lines for config.g of RepRapFirmware"),
    ("klipper.cfg", "sections for printer.cfg of Klipper"),
    ("robot.xml", "the robot for MuJoCo"),
    ("robot.urdf", "its bodies and frames for ROS and others, without wires"),
    ("robot.sdf", "the same for Gazebo"),
    ("export.json", "the table and the warnings as JSON"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def export_page(folder: Path, configuration: Configuration) -> Page:
    """The content of ``creep-table.csv`` and links to what lies beside it."""
    with (folder / "creep-table.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    summary: ExportSummary = read_json(folder / "export.json")
    wires = list(dict.fromkeys(row.get("wire") for row in rows))  # None, once, where all legs hang on one line
    words = Text(
        "Firmware and simulators know springs but no creep. The files give them the line's spring constant; the table "
        "says how much longer each metre of line will be after a time, which has to be corrected for by other means."
    )
    pictures = []
    for wire in wires:
        own = [row for row in rows if row.get("wire") == wire]
        pictures.append(_growth(wire, own))
    creep = [*before_the_answer(summary), Pictures(pictures), *beside_the_answer(summary), words]
    header = _HEADER if wires == [None] else ("wire", *_HEADER)
    lines = [_line(row) for row in rows]
    table = Table(header, lines, "Growth of a new line under a tension held constant, in mm per metre of line.")
    sections = [
        Section("Creep of the line", creep),
        files_beside(folder, _FILES, "Files"),
        Section("Table of the creep", [table]),
        meaning(("90 % interval",), model=False),
    ]
    lead = _in_a_sentence(rows[-1])
    return Page("Settings for a robot", lead, sections, seed_of_page(configuration))


def _line(row: dict[str, str]) -> list[str]:
    """A row of the table as a page shows it."""
    wire = [row["wire"]] if "wire" in row else []
    return [*wire, number(float(row["tension_N"])), f"{float(row['time_s']):g}", *_grown(row)]


def _grown(row: dict[str, str]) -> list[str]:
    """Median and interval of the growth."""
    interval = span(float(row["q05_mm_per_m"]), float(row["q95_mm_per_m"]))
    return [number(float(row["q50_mm_per_m"])), interval]


def _in_a_sentence(row: dict[str, str]) -> str:
    grown, interval = _grown(row)
    tension = f"{float(row['tension_N']):g} N"
    time = lasting(float(row["time_s"]))
    return (
        f"A metre of the line grows by {grown} mm ({interval}) under {tension} within {time}; the interval holds 90 %."
    )


_HEADER = ("tension, N", "after, s", "growth, mm per m", "90 % interval")


def _growth(wire: str | None, rows: list[dict[str, str]]) -> Picture:
    """The picture of one line's growth."""
    numbers = [{key: float(value) for key, value in row.items() if key != "wire"} for row in rows]
    of = "a new line"
    caption = "Median and 90 % interval of the growth, a colour a tension."
    if wire is not None:
        of = f"new wire {wire}"
        caption = f"Wire {wire}: {caption[0].lower()}{caption[1:]}"
    return Picture(drawn(growth(numbers)), f"Growth of {of} against time at each tension.", caption)
