"""Lengths of a robot's wires, estimated from its own sensors."""

from dataclasses import dataclass
from typing import ClassVar

from wirebayes.answers.robot import of_calibration
from wirebayes.json_files.calibrate import CalibrateJson
from wirebayes.views.result import NOTHING, Given, Result, html_table, typed


@dataclass(frozen=True, eq=False, repr=False)
class Calibration(Result[CalibrateJson]):
    """Zero-tension lengths of a robot's wires, estimated from its own sensors.

    Examples
    --------
    >>> lengths
    Calibration(linear-7, 9 holds, converged)
    """

    _content: ClassVar[str] = "calibration.json"

    def lines(self) -> list[str]:
        return of_calibration(self.summary())

    def next_step(self, given: Given = NOTHING) -> str:
        robot = self.place.path / "robot.toml"
        lengths = self.place.path / "calibration.json"
        if not self.summary()["usable"]:
            again = "with more poses, or once readings, stated errors and --anchor-sd are checked"
            return f"wirebayes calibrate {given.file} {again}"
        if robot.is_file():
            settings = f"wirebayes export {typed(robot)}{given.wires}  (for controllers and simulators)"
            return f"{settings}, with the references of {lengths}"
        return f"set the lengths of {lengths} in the controller"

    def _short_form(self) -> list[str]:
        found = self.summary()
        sure = "converged" if found["with_creep_model"]["converged"] else "NOT CONVERGED"
        return [found["robot"], f"{found['holds']} holds", sure]

    def _repr_html_(self) -> str:
        lengths = self.summary()["with_creep_model"]["length_m"]
        rows = [
            [str(i + 1), f"{mean:.5f}", f"{low:.5f} to {high:.5f}"]
            for i, (mean, low, high) in enumerate(zip(lengths["mean"], lengths["q05"], lengths["q95"], strict=True))
        ]
        return html_table(repr(self), ["wire", "length, m", "90 % interval"], rows, self.messages)
