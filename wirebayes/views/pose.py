"""A pose of a robot on creeping wires, or poses over time."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, cast

from wirebayes.answers.robot import of_pose
from wirebayes.json_files.pose import PoseJson, known_at_the_end, stays
from wirebayes.json_files.pose_history import PoseHistoryJson
from wirebayes.robot.mechanics.wires_used import specimens_in_words, undecided_in_words
from wirebayes.sentences import coordinates, lasting
from wirebayes.views.result import NOTHING, Given, Result, figure, html_table


@dataclass(frozen=True, eq=False, repr=False)
class Pose(Result[PoseJson | PoseHistoryJson]):
    """A pose of a robot on creeping wires: kinematics, drift and pose error with bands.

    Examples
    --------
    >>> held.summary()["feasible"]
    True
    """

    _content: ClassVar[str] = "pose.json"

    @property
    def messages(self) -> tuple[str, ...]:
        """The models that are undecided, the estimated spread of specimens, and the warnings."""
        wires = self.summary()["wires"]
        return (*undecided_in_words(wires), *specimens_in_words(wires), *super().messages)

    def lines(self) -> list[str]:
        return of_pose(self.summary())

    def next_step(self, given: Given = NOTHING) -> str:
        return _after_pose(self.summary(), self.place.path, given)

    def _short_form(self) -> list[str]:
        found = self.summary()
        if not found["feasible"]:
            return [found["robot"], found["sentence"]]
        drift = found["drift"][0]
        middle = drift["distance_mm"]["q50"][-1]
        return [found["robot"], f"drift {figure(middle)} mm after {lasting(drift['times_s'][-1])}"]

    def _repr_html_(self) -> str:
        found = self.summary()
        if not found["feasible"]:
            return super()._repr_html_()
        drift = found["drift"][0]
        far = drift["distance_mm"]
        rows = [
            [figure(t), _mm(far["q50"][i]), f"{_mm(far['q05'][i])} to {_mm(far['q95'][i])}"]
            for i, t in enumerate(drift["times_s"])
        ]
        return html_table(repr(self), ["time, s", "drift, mm", "90 % interval"], rows, self.messages)


# kinds of warnings that say that readings and joint values contradict one another: corrections lead anywhere then
_CONTRADICTED = ("misfit", "not-converged")


def _mm(value: float | None) -> str:
    """A distance; what rounding of numbers leaves of none is none."""
    return figure(value if value is None else round(value, 6))


def _after_pose(found: PoseJson | PoseHistoryJson, folder: Path, given: Given) -> str:
    """What to do with a pose, or where there is none."""
    lost = "drift" in found and not any(known_at_the_end(drift) for drift in found["drift"])
    corrections = folder / "corrections.csv"
    if corrections.is_file():
        if any(warning["kind"] in _CONTRADICTED for warning in found["warnings"]):
            return "check the log's columns, signs and units, the payload and the standard errors"
        if lost:
            where = f"the column held of {folder / 'poses.csv'} says where the platform is lost"
            return f"check joint values or poses, their units and the payload; {where}"
        if not _has_corrections(corrections):
            return (
                "other commanded poses, or other bounds of the tension in the robot's file: nothing holds these poses"
            )
        return f"give the controller the joint values of {corrections}"
    if any(warning["kind"] == "uncarried" for warning in found["warnings"]):
        return "[plane] in the robot's file, if a table or a rail carries the platform; else another pose"
    nearest = cast(PoseJson, found).get("nearest_position_m")
    if nearest is not None:
        near = coordinates(nearest, 5).replace(" ", "")
        return f"wirebayes pose {given.file}{given.wires} --position={near}, where the platform hangs"
    if lost or not found.get("feasible", True):
        return "another pose or payload, or other bounds of the tension in the robot's file"
    calibrate = f"wirebayes calibrate {given.file} READINGS.csv{given.wires}"
    drifts = cast(PoseJson, found).get("drift", [])
    if drifts and all(map(stays, drifts)):
        return f"{calibrate}  (finds the lengths of its wires)"
    return f"{calibrate}  (when it drifts too far)"


def _has_corrections(path: Path) -> bool:
    """Whether any row has one: none has where no tensions hold the poses to which they should lead."""
    with path.open(encoding="utf-8", newline="") as file:
        return any(row["change_1_mm"] for row in csv.DictReader(file))
