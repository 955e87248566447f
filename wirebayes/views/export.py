"""A robot with its wires for other programs."""

from dataclasses import dataclass
from typing import ClassVar

from wirebayes.io.run_folder import COMPLETE, CONFIGURATION
from wirebayes.json_files.export import ExportSummary
from wirebayes.sentences import counted, listed
from wirebayes.views.result import Result, figure, html_table


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

    def _short_form(self) -> list[str]:
        return list(self.files)

    def _repr_html_(self) -> str:
        table = self.summary()["creep_table"]
        rows = [[value if isinstance(value, str) else figure(value) for value in row.values()] for row in table]
        return html_table(repr(self), list(table[0]), rows, self.messages)
