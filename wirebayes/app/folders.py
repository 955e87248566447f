"""Folders of the app: one for each test, with the files as they were dropped and the results of each step."""

import json
import re
import shutil
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from wirebayes.errors import InputError
from wirebayes.io.run_folder import write_json

RAW, ABOUT = "raw", "about.json"
ROBOTS = "robots"  # a folder for each robot of the user's own, with its file and a table of poses
READ = "read"  # the step that turns raw files into an experiment file
STEPS = (READ, "check", "fit", "discover")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{0,80}")
_SUFFIXES = (".nc", ".json", ".csv", ".toml", ".html", ".svg")  # of what a user takes away, results first
_OTHERS = "undecided"  # folder of models that share the probability with the final one: they come last
_OWN = {"configuration.json", "complete.json"}  # of the folder of a result, not for a user


@dataclass(frozen=True)
class Test:
    """One test: what was dropped together, and everything that was done with it.

    Attributes
    ----------
    folder : Path
    """

    folder: Path

    @property
    def name(self) -> str:
        """The folder's name, which no other test has."""
        return self.folder.name

    @property
    def raw(self) -> list[Path]:
        """The files as they were dropped."""
        return sorted((self.folder / RAW).iterdir())

    @property
    def is_experiment_file(self) -> bool:
        """Whether an experiment file was dropped, beside its tables."""
        return any(path.suffix.lower() == ".toml" for path in self.raw)

    def about(self) -> dict[str, Any]:
        """What the user said of the sample and of the columns."""
        return _read(self.folder / ABOUT) or {}

    def say(self, about: dict[str, Any]) -> None:
        """Keep ``length_mm``, ``material``, ``area_mm2``, ``control``, and ``options`` as the command line has them."""
        write_json(self.folder / ABOUT, about)

    def place_for_robot(self, names: list[str]) -> Path:
        """An empty folder for files that were dropped together, named after the robot; an earlier one is replaced."""
        robot = next((name for name in names if name.lower().endswith(".toml")), names[0])
        place = self.folder / ROBOTS / _bare(Path(robot).stem, "robot")
        shutil.rmtree(place, ignore_errors=True)
        place.mkdir(parents=True)
        return place

    def record(self, step: str) -> dict[str, Any] | None:
        """What the page shows of a step; None before it is done."""
        return _read(self.folder / f"{step}.json")

    def steps(self) -> list[str]:
        """What is done, in order; poses of robots last."""
        poses = sorted(path.stem for path in self.folder.glob("pose-*.json"))
        return [step for step in (*STEPS, *poses) if (self.folder / f"{step}.json").is_file()]

    def files(self, step: str) -> list[str]:
        """Files of a step to take away, by their path within the test's folder; results first."""
        found = [path for path in (self.folder / step).rglob("[!.]*") if path.suffix in _SUFFIXES]
        ranked = sorted(found, key=lambda path: (_OTHERS in path.parts, _SUFFIXES.index(path.suffix), str(path)))
        return [str(path.relative_to(self.folder)) for path in ranked if path.name not in _OWN]


class Shelf:
    """All tests of a folder.

    Parameters
    ----------
    root : Path
        Created where it is missing.
    """

    def __init__(self, root: Path) -> None:
        self.root = root
        try:
            root.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise InputError(f"{root}: cannot be a folder ({error.strerror}), expected one to write in") from None

    def tests(self) -> list[Test]:
        """The newest first."""
        folders = [path.parent for path in self.root.glob(f"*/{RAW}") if _NAME.fullmatch(path.parent.name)]
        return [Test(path) for path in sorted(folders, key=lambda path: -path.stat().st_mtime)]

    def get(self, name: str) -> Test | None:
        """The test of a name that may come from anywhere."""
        known = _NAME.fullmatch(name) and (self.root / name / RAW).is_dir()
        return Test(self.root / name) if known else None

    def new(self, title: str) -> Test:
        """An empty test, named after a file; the second of one name has a number behind it."""
        bare = _bare(title, "test")
        count = 1
        while True:
            folder = self.root / (bare if count == 1 else f"{bare}-{count}")
            try:
                folder.mkdir()
            except FileExistsError:  # also where another tab was faster
                count += 1
                continue
            (folder / RAW).mkdir()
            return Test(folder)


def _bare(title: str, otherwise: str) -> str:
    """A title as the name of a folder and as part of an address."""
    return re.sub(r"[^A-Za-z0-9._-]+", "-", title).strip("-._")[:60] or otherwise


def _read(path: Path) -> dict[str, Any] | None:
    try:
        return dict(json.loads(path.read_text(encoding="utf-8")))
    except (OSError, ValueError):  # not there, or damaged: as if it had not been done
        return None
