"""The page of ``wirebayes pose``: where the platform goes, how sure that is, and where the doubt comes from."""

from pathlib import Path
from typing import Any

from wirebayes.report.blocks import (
    Block,
    Columns,
    Page,
    Pictures,
    Points,
    Section,
    Table,
    Text,
    number,
    pictures_in,
    span,
)
from wirebayes.report.page import read_json


def page(folder: Path, configuration: dict[str, Any]) -> Page:
    """Tell ``pose.json`` and show the pictures beside it."""
    pose = read_json(folder / "pose.json")
    blocks: list[Block] = [Columns([_asked(pose), *_answers(pose)])]
    if not pose.get("feasible", True):
        blocks.insert(0, Text("No tensions within the stated bounds hold the platform at this pose.", strong=True))
    pictures = pictures_in(folder)
    sections = [Section("In a minute", blocks), Section("Pictures", [Pictures(pictures)] if pictures else [])]
    sections += [Section("Drift", _drift(pose)), Section("Pose error", _errors(pose)), Section("Doubts", _doubts(pose))]
    lead = "A platform on wires that creep: the pose it was sent to, and where it will be."
    return Page(f"Robot {pose['robot']}", lead, [s for s in sections if s.blocks], f"Seed {configuration.get('seed')}.")


def _asked(pose: dict[str, Any]) -> Points:
    place = ", ".join(number(float(x)) if x else "0" for x in pose["pose"]["position_m"])
    wires = pose.get("wires", {})
    points = [f"Platform of {pose['mass_kg']:g} kg at ({place}) m."]
    if wires:
        tested = f"{wires['tested_length_mm']:g} mm"
        points.append(f"Wires known from {wires['draws']} posterior draws of a sample of {tested}.")
    return Points("What was asked", points)


def _answers(pose: dict[str, Any]) -> list[Points]:
    known, loose = [], []
    for entry in pose.get("drift", []):
        last = entry["times_s"][-1]
        if entry["distance_mm"]["q50"]:
            low, middle, high = (entry["distance_mm"][q][-1] for q in ("q05", "q50", "q95"))
            spread = f"{100 * entry['specimen_spread']:g} %"
            moved = f"{number(middle)} mm ({span(low, high)})"
            known.append(f"After {last:g} s the platform has moved {moved}, specimens of one line spread by {spread}.")
    claim = pose.get("claim")
    if claim:
        limits = f"less than {claim['distance_mm']:g} mm and tilts less than {claim['tilt_deg']:g}°"
        for entry in claim["holds"]:
            spread, chance = f"{100 * entry['specimen_spread']:g} %", number(entry["probability"], 2)
            known.append(f"It moves {limits} within {claim['time_s']:g} s: probability {chance} (spread {spread}).")
    loose += [warning[:1].upper() + warning[1:] + "." for warning in pose.get("warnings", [])]
    loose.append("How much specimens of one line differ is assumed, not measured, unless three or more were tested.")
    return [Points("What is known", known or ["Nothing: the pose is not held."]), Points("What is not", loose)]


def _drift(pose: dict[str, Any]) -> list[Block]:
    lines = []
    for entry in pose.get("drift", []):
        for i, time in enumerate(entry["times_s"]):
            if entry["distance_mm"]["q50"] and time > 0:
                cells = []
                for key in ("distance_mm", "tilt_deg"):
                    low, middle, high = (entry[key][q][i] for q in ("q05", "q50", "q95"))
                    cells += [number(middle), span(low, high)]
                lines.append([f"{100 * entry['specimen_spread']:g} %", f"{time:g}", *cells])
    header = ["specimen spread", "after, s", "moved, mm", "90 %", "tilt, degrees", "90 %"]
    return [Table(header, lines)] if lines else []


def _errors(pose: dict[str, Any]) -> list[Block]:
    lines = []
    for entry in pose.get("pose_error", []):
        if entry["distance_mm"]["q50"]:
            low, middle, high = (entry["distance_mm"][q][-1] for q in ("q05", "q50", "q95"))
            within = entry.get("longest_time_within_s")
            who = [entry["controller"].replace("_", " "), f"{100 * entry['specimen_spread']:g} %"]
            lines.append([*who, f"{entry['times_s'][-1]:g}", number(middle), span(low, high), number(within)])
    header = ["controller", "specimen spread", "after, s", "pose error, mm", "90 %", "longest time within tolerance, s"]
    return [Table(header, lines)] if lines else []


def _doubts(pose: dict[str, Any]) -> list[Block]:
    shares = pose.get("variance_shares", {}).get("shared_draw")
    if not shares:
        return []
    lines = [[name, f"{100 * share:.0f} %"] for name, share in shares.items()]
    caption = f"Which parameter the variance of the drift after {pose['variance_shares']['time_s']:g} s comes from."
    return [Table(["parameter", "share"], lines, caption)]
