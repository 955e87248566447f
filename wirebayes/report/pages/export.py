"""The page of ``wirebayes export``: the files for firmware and simulators, and how much a line creeps."""

import csv
from pathlib import Path
from typing import Any

from wirebayes.report.blocks import Page, Picture, Pictures, Section, Table, Text, drawn, files_beside, number, span
from wirebayes.report.glossary import meaning
from wirebayes.report.pictures.creep_table import growth

_FILES = (
    ("creep-table.csv", "growth of a new line under constant tension, with 90 % intervals"),
    ("reprapfirmware.g", "lines for config.g of RepRapFirmware"),
    ("klipper.cfg", "sections for printer.cfg of Klipper"),
    ("robot.xml", "the robot for MuJoCo"),
    ("robot.urdf", "the robot for ROS and other simulators"),
    ("robot.sdf", "the robot for Gazebo"),
    ("robot.urdf", "its bodies and frames for ROS and others, without wires"),
    ("robot.sdf", "the same for Gazebo"),
    ("configuration.json", "the options of this run, with version and seed"),
)


def page(folder: Path, configuration: dict[str, Any]) -> Page:
    """The content of ``creep-table.csv`` and links to what lies beside it."""
    with (folder / "creep-table.csv").open(encoding="utf-8", newline="") as file:
        rows = [{key: float(value) for key, value in row.items()} for row in csv.DictReader(file)]
    lines = [
        [
            number(r["tension_N"]),
            f"{r['time_s']:g}",
            number(r["q50_mm_per_m"]),
            span(r["q05_mm_per_m"], r["q95_mm_per_m"]),
        ]
        for r in rows
    ]
    caption = "Growth of a new line under a tension held constant, in mm per metre of line."
    words = Text(
        "Firmware and simulators know springs but no creep. The files give them the line's spring constant; this table "
        "says how much longer each metre of line will be after a time, which has to be corrected for by other means."
    )
    alt = "Growth of a new line against time at each tension."
    picture = Picture(drawn(growth(rows)), alt, "Median and 90 % interval of the growth, a colour a tension.")
    sections = [
        Section("Files", [files_beside(folder, _FILES)]),
        Section("Creep of the line", [words, Pictures([picture]), Table(_HEADER, lines, caption)]),
        meaning(("90 % interval",), model=False),
    ]
    lead = "A fitted line as settings for firmware and simulators."
    return Page("Settings for a robot", lead, sections, f"Seed {configuration.get('seed')}.")


_HEADER = ("tension, N", "after, s", "growth, mm per m", "90 % interval")
