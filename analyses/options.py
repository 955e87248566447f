"""What studies take from the command line."""

import argparse
from pathlib import Path


def study_options(
    doc: str | None, **usual: int | float | Path | tuple[int | float | Path, str]
) -> argparse.ArgumentParser:
    """A parser whose help begins with a study's docstring, with an option for each number or path.

    Parameters
    ----------
    doc : str
    usual
        By the option's name, what it is when left out, which says its type; with what the help says of it, or alone.
    """
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    for name, given in usual.items():
        default, text = given if isinstance(given, tuple) else (given, None)
        kind = Path if isinstance(default, Path) else type(default)
        parser.add_argument(f"--{name.replace('_', '-')}", type=kind, default=default, help=text)
    return parser
