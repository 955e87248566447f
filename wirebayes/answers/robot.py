"""The answer on a robot in a few lines, with units: how far its platform moves, and how long its wires are."""

from typing import cast

import numpy as np

from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.json_files.pose import PoseJson, known_at_the_end, stays
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.json_files.values import Band, MeanAndSd
from wirebayes.sentences import coordinates, lasting, short, specimens_are


def of_pose(found: PoseJson | PoseHistoryJson) -> list[str]:
    """Lines about a robot: how it hangs, and how far its platform moves, for each spread of specimens."""
    robot = found["robot"]
    if not found["feasible"]:
        return [f"{robot}: {found['sentence']}"]
    pose = cast(PoseJson, found)
    lines = _turned(pose) if "orientation" in found else []
    if "plane" in found:
        lines.append(f"{robot}: {pose['plane']['sentence']}")
    measured = "history" in found and cast(PoseHistoryJson, found)["history"]["kind"] == "measured"
    moved = "is away from where it is meant to be" if measured else "has drifted"
    if all(stays(drift) for drift in pose["drift"]):
        return [*lines, f"{robot}: {stays_in_words(pose)}"]
    drifts = []
    for drift in found["drift"]:
        if not known_at_the_end(drift):
            continue
        distance = _band_at_the_end(drift["distance_mm"])
        last = drift["times_s"][-1]
        time = lasting(last)
        alike = specimens_are(drift["specimen_spread"])
        drifts.append(f"{robot}: after {time} the platform {moved} by {distance} if {alike}")
    if not drifts:
        drifts.append(f"{robot}: no draw of the wires could be solved")
    return lines + drifts


def stays_in_words(found: PoseJson) -> str:
    """A clause about a platform that creep does not move, up to the last time that was asked for."""
    until = lasting(found["drift"][0]["times_s"][-1])
    why = "friction holds it, or its wires do not creep" if "plane" in found else "its wires do not creep"
    return f"within {until} the platform does not drift, for {why}"


def _band_at_the_end(band: Band) -> str:
    middle, low, high = (short(band[quantile][-1], 3) for quantile in ("q50", "q05", "q95"))
    return f"{middle} mm [{low}, {high}]"


def _turned(found: PoseJson) -> list[str]:
    """The orientation that balance decided."""
    vector = coordinates(found["pose"]["rotation_vector_rad"])
    return [f"{found['robot']}: rotation vector ({vector}) rad; {found['orientation']['sentence']}"]


def of_calibration(found: CalibrateJson) -> list[str]:
    """Lines about a calibration: every wire's length."""
    known = found["with_creep_model"]
    if not known["converged"]:
        return [f"{found['robot']}: not converged, no lengths to use"]
    length = known["length_m"]
    rows = zip(length["mean"], length["q05"], length["q95"], strict=True)
    lengths = ", ".join(f"{mean:.5f} [{low:.5f}, {high:.5f}]" for mean, low, high in rows)
    lines = [f"{found['robot']}: zero-tension lengths in m: {lengths}"]
    lines += _exit_points(found["exit_points_m"])
    lines += [f"  {text}" for text in drums_in_words(found)]
    open_ = found["identified"]["not_determined"]
    return lines + [f"  not determined: {text}" for text in open_[:_MOST_OPEN]]


def drums_in_words(found: CalibrateJson) -> list[str]:
    """A clause about the radii of the drums, if they were estimated."""
    if "drum_wider_percent" not in found:
        return []
    wider = found["drum_wider_percent"]
    pairs = zip(wider["mean"], wider["sd"], strict=True)
    each = ", ".join(f"{mean:+.2f} ± {short(sd, 2)}" for mean, sd in pairs)
    return [f"radii of the drums, % beyond those that the joint values were computed with: {each}"]


def _exit_points(points: MeanAndSd) -> list[str]:
    """A line for each exit point, if they were estimated."""
    if not np.any(np.array(points["sd"], float) > 0):
        return []
    lines = ["  exit points in mm, ± standard error:"]
    for wire, (means, errors) in enumerate(zip(points["mean"], points["sd"], strict=True), start=1):
        axes = zip(means, errors, strict=True)
        place = ", ".join(f"{1e3 * mean:z.1f} ± {short(1e3 * error, 2)}" for mean, error in axes)
        lines.append(f"    wire {wire}: ({place})")
    return lines


_MOST_OPEN = 4  # combinations that are listed: a terminal is no table
