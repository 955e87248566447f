"""The page of ``wirebayes pose --joints`` and ``--trajectory``: a robot over time."""

from pathlib import Path

from wirebayes.answers.robot import of_pose
from wirebayes.json_files.pose import stays
from wirebayes.json_files.pose_history import HistoryOfRobot, HistoryReadings, PoseHistoryJson
from wirebayes.json_files.values import Band, Numbers
from wirebayes.report.blocks import (
    Block,
    Columns,
    Configuration,
    Page,
    Picture,
    Pictures,
    Points,
    Section,
    Table,
    before_the_answer,
    beside_the_answer,
    captioned,
    files_beside,
    number,
    picture_file,
    seed_of_page,
    span,
)
from wirebayes.report.cells import NONE, at_row
from wirebayes.report.glossary import meaning
from wirebayes.report.pages.wires_known import wires_known
from wirebayes.robot.mechanics.wires_used import specimens_in_words, undecided_in_words
from wirebayes.sentences import counted, from_to, lasting

_CAPTIONS = {
    "motion": "The whole history: where the platform is meant to be (blue) and, enlarged, where it is (red).",
    "poses": "The robot at a few times: where the platform is meant to be (blue) and, enlarged, where it is (red).",
    "drift": "How far the platform is from where it is meant to be. Line: median, band: 90 % of the draws.",
    "rotation": "How far it has turned from there.",
    "corrections": "Change of each joint value that brings it back. Every row: corrections.csv.",
}
_FILES = (
    ("pose.json", "every number of this page as JSON"),
    ("poses.csv", "the pose at every row, with bands"),
    ("corrections.csv", "the joint values that bring the platform back, at every row"),
)
_FIRST = ("drift", "rotation")  # the answer as a picture
_WIDE = ("poses",)
_ROWS = 12  # of the tables on the page
_SMALLEST_MM = 1e-4  # less is shown as nothing: a tenth of what a dial gauge resolves, and often only rounding


def pose_history_page(folder: Path, configuration: Configuration, pose: PoseHistoryJson) -> Page:
    """The content of ``pose.json`` and the pictures beside it.

    Parameters
    ----------
    configuration : dict
        Content of ``configuration.json``.
    pose : PoseHistoryJson
        Content of ``pose.json``.
    """
    measured = pose["history"]["kind"] == "measured"
    about = "by its measured joint values" if measured else "on its commanded way"
    still = pose["feasible"] and stays(pose["drift"][0])
    condition = "" if still else f", {about}; the interval holds 90 %"
    lead = f"{of_pose(pose)[-1]}{condition}."
    title = f"Robot {pose['robot']}"
    if not pose["feasible"]:
        return Page(title, lead, [Section("Summary", before_the_answer(pose))])
    pictures = _pictures(folder)
    shown = [pictures.pop(name) for name in _FIRST if name in pictures]
    more = [Pictures([pictures.pop(name)]) for name in _WIDE if name in pictures]
    if pictures:
        more.append(Pictures(list(pictures.values())))
    first = before_the_answer(pose)
    if shown:
        first.append(Pictures(shown))
    first += beside_the_answer(pose)
    computed = Points("What was computed", _requested(pose))
    first.append(Columns([computed, *_answers(pose)]))
    sections = [
        Section("Summary", first),
        Section("More pictures", more),
        Section("Poses", _poses(pose)),
        Section("Corrections", _corrections(pose)),
        files_beside(folder, _FILES),
        meaning(("90 % interval", "drift", "specimen spread"), pose["wires"]["effects"]),
    ]
    filled = [section for section in sections if section.blocks]
    footer = seed_of_page(configuration)
    return Page(title, lead, filled, footer)


def _pictures(folder: Path) -> dict[str, Picture]:
    """The pictures of a history that are there, by name."""
    pictures = {}
    for name, caption in _CAPTIONS.items():
        file = picture_file(folder, name)
        if file is not None:
            pictures[name] = captioned(file, caption, wide=name in _WIDE)
    return pictures


def _requested(pose: PoseHistoryJson) -> list[str]:
    history = pose["history"]
    wires = pose["wires"]
    kind = "measured joint values" if history["kind"] == "measured" else "commanded poses"
    duration = number(float(history["duration_s"]))
    rows = counted(history["rows"], "row")
    platform = f"platform of {pose['mass_kg']:g} kg"
    payload = history["highest_payload_kg"]
    if payload:
        platform += f", payload up to {payload:g} kg"
    spread = f"Specimens of one line differ by {100 * history['specimen_spread']:g} %."
    known = wires_known(wires)
    began = _began(history)
    out = [f"{rows} of {kind} over {duration} s; {platform}."]
    out.append(f"{known} {spread} {began}")
    out += undecided_in_words(wires)
    out += specimens_in_words(wires)
    out.append(_restarted(history))
    readings = pose.get("readings")
    if readings:
        out.append(_read(readings))
    return out


def _restarted(history: HistoryOfRobot) -> str:
    """How often the wires' clocks started, and when."""
    started = f"The wires' clocks started {counted(history['holds'], 'time')}"
    if history["restart_share"] is None:
        return f"{started}, as the column hold says."
    return (
        f"{started}: when a command or a load had changed a tension by "
        f"more than {100 * history['restart_share']:g} % of the mean tension."
    )


def _read(readings: HistoryReadings) -> str:
    """What was read beside the joint values, and what it is worth."""
    return (
        f"{counted(readings['tensions'], 'tension')} (standard error {readings['tension_sd_N']:g} N) and "
        f"{counted(readings['tilts'], 'inclination')} ({readings['tilt_sd_rad']:g} rad) were read; "
        f"mean squared residual {number(readings['misfit'])}. Given them, the draws are worth "
        f"{number(readings['effective_draws'], 2)} independent ones."
    )


def _began(history: HistoryOfRobot) -> str:
    """What the wires were at the first row."""
    known = history.get("calibration")
    if known is None:
        return "They were new at the first row."
    sd = known["reference_error_mm"]["sd"]
    return (
        f"The history goes on where a calibration of {counted(known['holds'], 'hold')} and "
        f"{lasting(known['duration_s'])} ended: its posterior gives the wires, their creep so far and their "
        f"reference lengths, which it knows to {from_to(min(sd), max(sd))} mm (standard error, errors of points "
        "included)."
    )


def _answers(pose: PoseHistoryJson) -> list[Points]:
    (drift,) = pose["drift"]
    time = number(float(drift["times_s"][-1]))
    away = _last(drift["distance_mm"], _SMALLEST_MM)
    known = [f"After {time} s the platform is {away} mm {_from_where(pose['history'])}."]
    if pose.get("rotation_vector_rad"):
        known.append(f"It has turned by {_last(drift['rotation_deg'])} degrees.")
    left = pose["corrections"]["left_mm"]
    if left["q50"] and left["q50"][-1] is not None:
        still_away = _last(left, _SMALLEST_MM)
        known.append(f"Corrected joint values (corrections.csv) bring it back; they leave {still_away} mm.")
    return [Points("What is known", known), Points("What is not known", _unknown(pose))]


def _from_where(history: HistoryOfRobot) -> str:
    """What the distance of the platform is measured from."""
    if history.get("target") != "without creep":
        return "from the commanded pose"
    if "calibration" in history:
        return "from where it would be without creep, the wires as long as the joint values say"
    return "from where it would be without creep"


def _unknown(pose: PoseHistoryJson) -> list[str]:
    clock = pose["clock"]
    history = pose["history"]
    unknown = [
        "A test cannot show when a moving wire's clock restarts. If it started once and ran on, the pose would "
        f"differ by {_mm(clock['largest_mm'])} mm at most, {_mm(clock['at_the_end_mm'])} mm at the end."
    ]
    if "at_stops_largest_mm" in clock:
        largest = _mm(clock["at_stops_largest_mm"])
        at_the_end = _mm(clock["at_stops_at_the_end_mm"])
        unknown[0] += f" If it restarted at every stop: {largest} mm at most, {at_the_end} mm at the end."
    exact = "calibration" not in history and not history.get("reference_sd_mm")
    if exact and history["kind"] == "measured":
        unknown.append("Joint values and the robot's geometry are taken to be exact; --reference-sd says otherwise.")
    return unknown


def _last(band: Band, least: float = 0.0) -> str:
    """The last value of a band, with its interval; nothing where no draw is above the least that is shown."""
    low, middle, high = at_row(band, -1)
    if high is not None and high <= least:
        return "0"
    return f"{number(middle)} ({span(low, high)})"


def _shown(times: Numbers) -> list[int]:
    step = max(1, -(-len(times) // _ROWS))
    return sorted({*range(0, len(times), step), len(times) - 1})


def _poses(pose: PoseHistoryJson) -> list[Block]:
    (drift,) = pose["drift"]
    lines = []
    for row in _shown(drift["times_s"]):
        low, far, high = at_row(drift["distance_mm"], row)
        time = _seconds(drift["times_s"][row])
        lines.append([time, *_place(pose["position_m"], row), _mm(far), f"{_mm(low)} … {_mm(high)}"])
    header = ["time, s", "x, m", "sd, mm", "y, m", "sd, mm", "z, m", "sd, mm", "distance, mm", "90 %"]
    return [Table(header, lines, "Some of the rows; all of them, with bands and rotations: poses.csv.")]


def _place(position_m: Band, row: int) -> list[str]:
    """Each coordinate of a row, and its standard deviation."""
    if position_m["q50"] is None or position_m["sd"] is None:
        return [NONE] * 6
    cells = []
    for middle, sd in zip(position_m["q50"][row], position_m["sd"][row], strict=True):
        cells.append(_metres(middle))
        cells.append(_mm(None if sd is None else 1e3 * sd))
    return cells


def _metres(value: float | None) -> str:
    """A coordinate to a micrometre, beyond which rounding speaks."""
    return "–" if value is None else f"{value:z.6f}".replace("-", "−")


def _mm(value: float | None) -> str:
    is_nothing = value is not None and abs(value) < _SMALLEST_MM
    return number(0.0 if is_nothing else value)


def _seconds(time: float) -> str:
    """A row's time without zeros that nobody wrote."""
    return f"{time:,.3f}".rstrip("0").rstrip(".").replace(",", "\u202f")


def _corrections(pose: PoseHistoryJson) -> list[Block]:
    corrections = pose["corrections"]
    change = corrections["change_mm"]
    if not change["mean"]:
        return []
    times = corrections["times_s"]
    lines = []
    for i in _shown(times):
        joints = zip(change["mean"][i], change["sd"][i], strict=True)
        cells = [f"{_mm(mean)} ± {_mm(sd)}" for mean, sd in joints]
        lines.append([_seconds(times[i]), *cells])
    header = ["time, s"]
    for j, _ in enumerate(change["mean"][0], 1):
        header.append(f"joint {j}, mm")
    caption = "Change of each joint value, mean and standard deviation: corrections.csv."
    return [Table(header, lines, caption)]
