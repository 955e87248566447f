"""A file to start from for one's own measurements."""

from pathlib import Path

from wirebayes.errors import InputError
from wirebayes.io.run_folder import check_links, write_text
from wirebayes.io.start import CSV, NAME, TOML
from wirebayes.strict.files import PathLike, given_path


def new_experiment(folder: PathLike) -> Path:
    """Write a commented experiment file and a small CSV, to be replaced by one's own.

    Both are valid as they stand.

    Parameters
    ----------
    folder : path
        Made where it is absent.

    Returns
    -------
    Path
        Of the TOML file.

    Raises
    ------
    InputError
        One of the files is there already and says something else, or the folder cannot be written.

    Examples
    --------
    >>> file = wb.new_experiment("my-test")
    >>> file.name
    'my-wire.toml'
    >>> wb.read_experiments(file)[0].tension().shape
    (8, 5)
    """
    target = given_path("folder", folder)
    toml = target / f"{NAME}.toml"
    readings = target / f"{NAME}.csv"
    contents = {readings: CSV, toml: TOML}
    for path, content in contents.items():
        if path.exists() and not _holds(path, content):
            raise InputError(f"{path}: found a file of this name, expected a folder without it; nothing is overwritten")
    check_links(target)
    try:
        target.mkdir(parents=True, exist_ok=True)
        for path, content in contents.items():
            write_text(path, content)
    except OSError as error:
        raise InputError(f"{target}: cannot be written ({error.strerror}), expected a writable folder") from None
    return toml


def _holds(path: Path, content: str) -> bool:
    """Whether a file is one of ours as it was written."""
    return path.is_file() and path.read_bytes() == content.encode("utf-8")
