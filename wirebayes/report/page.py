"""One self-contained page of whatever a folder of results holds."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined

from wirebayes._version import __version__
from wirebayes.errors import InputError
from wirebayes.io.run_folder import CONFIGURATION, check_file, read_json, stored_results, write_text
from wirebayes.report.blocks import Page, View, as_sentence
from wirebayes.report.pages import PAGES


def write_page(folder: Path) -> Path:
    """Write ``report.html`` into a folder of results and return its path.

    Raises
    ------
    InputError
        The folder is not one that a command of ours has written.
    """
    path = folder / "report.html"
    with stored_results(folder):
        content = render(page_of_folder(folder))
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
    page_of: Callable[[Path, dict[str, Any]], Page] = getattr(import_module(module), function)
    with stored_results(folder):
        return page_of(folder, configuration)


def render(page: Page) -> str:
    """The page as HTML with everything inside."""
    environment = Environment(loader=PackageLoader("wirebayes.report", "."), undefined=StrictUndefined)
    environment.autoescape = environment.trim_blocks = environment.lstrip_blocks = True
    environment.filters["sentence"] = as_sentence
    views = any(isinstance(block, View) for section in page.sections for block in section.blocks)
    return environment.get_template("page.html.jinja").render(page=page, views=views, version=__version__) + "\n"
