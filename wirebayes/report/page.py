"""One self-contained page of whatever a folder of results holds."""

import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from wirebayes._version import __version__
from wirebayes.errors import InputError
from wirebayes.io.run_folder import CONFIGURATION, check_file, read_json, stored_results, writable, write_text
from wirebayes.report.blocks import Configuration, Page, View, as_sentence, with_fixed_spaces
from wirebayes.report.pages import PAGES


def write_page(folder: Path, output: Path | None = None) -> Path:
    """Write ``report.html`` and return its path.

    Parameters
    ----------
    folder : Path
        Of results.
    output : Path, optional
        Folder for the page; that of the results when left out.

    Raises
    ------
    InputError
        The folder is not one that a command of ours has written.
    """
    path = (folder if output is None else output) / "report.html"
    with stored_results(folder):
        page = page_of_folder(folder)
        content = render(page, "" if output is None else _way(output, folder))
    with writable(path.parent):
        path.parent.mkdir(parents=True, exist_ok=True)
    check_file(path)
    write_text(path, content)
    return path


def page_of_folder(folder: Path) -> Page:
    """The page of a folder, by the command that wrote it."""
    absent = f"{folder}: found no {CONFIGURATION}, expected a folder of results"
    configuration = read_json(folder / CONFIGURATION, absent)
    command = configuration.get("command") if isinstance(configuration, dict) else None
    if not isinstance(command, str) or command not in PAGES:
        known = ", ".join(PAGES)
        raise InputError(f"{folder / CONFIGURATION}, key command: found {command!r}, expected one of {known}")
    module, _, function = PAGES[command].partition(":")
    page_of: Callable[[Path, Configuration], Page] = getattr(import_module(module), function)
    with stored_results(folder):
        return page_of(folder, configuration)


def _way(start: Path, folder: Path) -> str:
    """What stands before the links of a page in one folder to files in another."""
    between = Path(os.path.relpath(folder.resolve(), start.resolve())).as_posix()
    return "" if between == "." else quote(between, errors="surrogateescape") + "/"


def render(page: Page, files_in: str = "") -> str:
    """The page as HTML with everything inside.

    Parameters
    ----------
    page : Page
    files_in : str
        What stands before the names of files that it links to, with a slash at its end; they lie beside it when empty.
    """
    environment = Environment(loader=PackageLoader("wirebayes.report", "."), undefined=StrictUndefined)
    environment.autoescape = environment.trim_blocks = environment.lstrip_blocks = True
    environment.filters["sentence"] = as_sentence
    environment.filters["with_fixed_spaces"] = with_fixed_spaces
    views = any(isinstance(block, View) for section in page.sections for block in section.blocks)
    template = environment.get_template("page.html.jinja")
    return template.render(page=page, views=views, version=__version__, files_in=files_in) + "\n"
