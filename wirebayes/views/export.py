"""A robot with its wires for other programs."""

from dataclasses import dataclass
from typing import ClassVar

from wirebayes.io.run_folder import COMPLETE, CONFIGURATION
from wirebayes.json_files.export import ExportSummary
from wirebayes.sentences import counted, listed
from wirebayes.views.result import NOTHING, Given, Result, figure, html_table, typed

_FIRMWARE = {"reprapfirmware.g": "config.g", "klipper.cfg": "printer.cfg"}  # and where their lines belong
_MODEL = "robot.xml"  # MuJoCo's


@dataclass(frozen=True, eq=False, repr=False)
class Export(Result[ExportSummary]):
    """A robot with its wires for other programs: firmware settings, creep table, MuJoCo model.

    Examples
    --------
    >>> exported.files["klipper.cfg"].splitlines()[2]
    '[printer]'
    """

    _content: ClassVar[str] = "export.json"

    @property
    def files(self) -> dict[str, str]:
        """Content of each file by name."""
        own = (CONFIGURATION, COMPLETE, self._content)
        paths = sorted(path for path in self.folder.iterdir() if path.is_file() and path.name not in own)
        return {path.name: path.read_text(encoding="utf-8") for path in paths}

    def lines(self) -> list[str]:
        return [f"{counted(len(self.files), 'file')}: {listed(list(self.files))}"]

    def next_step(self, given: Given = NOTHING) -> str:
        folder = self.place.path
        there = self.files
        settings = {name: goal for name, goal in _FIRMWARE.items() if name in there}
        steps = [f"put the lines of {folder / name} into the printer's {goal}" for name, goal in settings.items()]
        if _MODEL in there:
            steps.append(f"python -m mujoco.viewer --mjcf={typed(folder / _MODEL)}")
        return "\n".join(steps) or f"read {folder}"

    def _short_form(self) -> list[str]:
        return list(self.files)

    def _repr_html_(self) -> str:
        table = self.summary()["creep_table"]
        rows = [[value if isinstance(value, str) else figure(value) for value in row.values()] for row in table]
        return html_table(repr(self), list(table[0]), rows, self.messages)
