"""What all results have in common: a folder, a summary, warnings, a few lines and the next step."""

import os
import shlex
import shutil
import weakref
from dataclasses import dataclass
from html import escape
from pathlib import Path
from tempfile import mkdtemp
from typing import ClassVar, Generic, TypeVar, cast

from wirebayes.answers.lines import for_terminal
from wirebayes.errors import InputError
from wirebayes.io.run_folder import COMPLETE, CONFIGURATION, check_run, read_json, stored_results, write_bytes
from wirebayes.json_files.values import Quantiles
from wirebayes.result_warnings import Notice, Warned, from_json
from wirebayes.strict.files import PathLike

Content = TypeVar("Content")  # what the JSON file of a result holds
_FIGURES = 4  # digits that a short form shows


@dataclass(frozen=True)
class Given:
    """What the command was given, so that the next one can be written out.

    Attributes
    ----------
    file : str
        The experiment file, or the robot, as `typed`.
    wires : str
        The options that say which wires, as they are typed.
    """

    file: str = "FILE.toml"
    wires: str = " --wires DIR"


NOTHING = Given()


def typed(argument: str | Path) -> str:
    """A file or folder as it is typed in a command: in quotes where it has spaces."""
    return shlex.quote(str(argument))


@dataclass(frozen=True)
class ResultFolder:
    """A folder of results; a temporary one is removed with the last object that holds it.

    Attributes
    ----------
    path : Path
    """

    path: Path

    @classmethod
    def at(cls, output: PathLike | None) -> "ResultFolder":
        """The folder named, or a temporary one."""
        if output is not None:
            if not isinstance(output, str | os.PathLike):
                raise InputError(f"output: found {output!r}, expected a path")
            return cls(Path(output))
        place = cls(Path(mkdtemp(prefix="wirebayes-")))
        weakref.finalize(place, shutil.rmtree, place.path, ignore_errors=True)
        return place


@dataclass(frozen=True, eq=False, repr=False)
class Result(Generic[Content]):
    """What all results have in common.

    Attributes
    ----------
    place : ResultFolder
        The folder of the whole command.
    own_effects : Path or None
        The user's file of effects, where the command was given one.
    computed : bool
        False where the folder held the finished results before.
    """

    place: ResultFolder
    own_effects: Path | None = None
    computed: bool = True

    _content: ClassVar[str]  # the file that `summary` reads

    @property
    def folder(self) -> Path:
        """Where the results lie; a temporary folder unless ``output`` was given."""
        return self.place.path

    @property
    def warnings(self) -> tuple[Notice, ...]:
        """What speaks against the results, gravest first: the same on a terminal, on the page and in the JSON."""
        with stored_results(self.folder):
            return from_json(cast(Warned, self.summary())["warnings"])

    @property
    def kinds(self) -> frozenset[str]:
        """Kinds of the warnings, on which it depends what to do next."""
        return frozenset(notice.kind for notice in self.warnings)

    @property
    def messages(self) -> tuple[str, ...]:
        """What the command says on standard error."""
        return tuple(f"warning: {notice.text}" for notice in self.warnings)

    def summary(self) -> Content:
        """The results as plain values, as they stand in the JSON file."""
        path = self.folder / self._content
        with stored_results(path):
            return cast(Content, dict(read_json(path)))

    def save(self, folder: PathLike) -> Path:
        """Store the results as the command would have stored them.

        Parameters
        ----------
        folder : str or Path
            A new or empty folder, or one that holds these results already.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        InputError
            The folder holds something else, or cannot be written.
        """
        target = Path(folder)
        state = check_run(target, read_json(self.place.path / CONFIGURATION))
        if state != "done":
            copy_results(self.place.path, target)
        return target

    def lines(self) -> list[str]:
        """The answer, a line or two for each experiment, model or wire, with units."""
        return [repr(self)]

    def next_step(self, given: Given = NOTHING) -> str:
        """What a person would do with this result, an alternative a line.

        Parameters
        ----------
        given : Given
            What the command was given.
        """
        return f"read {self.place.path}"

    def __str__(self) -> str:
        return "\n".join(for_terminal(self.lines()))

    def __repr__(self) -> str:
        return f"{type(self).__name__}({', '.join(self._short_form())})"

    def _short_form(self) -> list[str]:
        return [str(self.folder)]

    def _repr_html_(self) -> str:
        return f"<p>{escape(repr(self))}</p>" + "".join(f"<p>{escape(message)}</p>" for message in self.messages)


def html_table(title: str, header: list[str], rows: list[list[str]], notes: tuple[str, ...] = ()) -> str:
    """A small table for notebooks.

    Parameters
    ----------
    title : str
    header : list of str
    rows : list of list of str
        As long as the header. All text is escaped.
    notes : tuple of str
        Paragraphs below the table.

    Returns
    -------
    str
    """
    head = "".join(f"<th>{escape(cell)}</th>" for cell in header)
    body = "".join("<tr>" + "".join(f"<td>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows)
    below = "".join(f"<p>{escape(note)}</p>" for note in notes)
    return f"<table><caption>{escape(title)}</caption><tr>{head}</tr>{body}</table>{below}"


def figure(value: float | None) -> str:
    """A number as short forms show it; a dash for none."""
    return "-" if value is None else f"{value:.{_FIGURES}g}"


def short_interval(quantity: Quantiles) -> str:
    """The 90 % interval of a quantity in a short form."""
    return f"{figure(quantity['q05'])} to {figure(quantity['q95'])}"


def copy_results(source: Path, target: Path) -> None:
    """Copy a folder of results, whole files one by one, the mark that it is complete last."""
    files = [p for p in source.rglob("*") if p.is_file() and not p.name.startswith(".")]
    files.sort(key=lambda p: (p.name == COMPLETE, p.name != CONFIGURATION, str(p)))
    try:
        for path in files:
            copy = target / path.relative_to(source)
            copy.parent.mkdir(parents=True, exist_ok=True)
            write_bytes(copy, path.read_bytes())
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}), expected a writable folder") from None
