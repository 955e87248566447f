"""How long a README is, and how far below its head the first result stands, against other projects of the field.

    python -m analyses.project.readmes > docs/readmes.inc

Ours is counted. The others were read by eye, at the commits below: a result is the first output, or the first picture
of one, that the code above it makes; commands are the statements, or the lines after a prompt, that lead to it.
"""

from dataclasses import dataclass
from pathlib import Path

README = Path(__file__).parents[2] / "README.md"
PROMPT = "$ "


@dataclass(frozen=True)
class Readme:
    """Of a project, with the commit and day of what was read; no result where nothing is shown."""

    project: str
    lines: int
    result: int | None
    commands: int | None
    commit: str = ""


OTHERS = (
    Readme("pyhf", 405, 63, 7, "b3dc4bb2, 2026-08-14"),
    Readme("ruptures", 128, 70, 9, "ee1c8ff, 2026-05-26"),
    Readme("PINTS", 102, 36, None, "8312b9a4, 2026-03-06"),
    Readme("lmfit", 143, None, None, "fe389bbb, 2026-08-03"),
    Readme("emcee", 57, None, None, "8ab6c0f, 2026-03-15"),
    Readme("ArviZ", 133, 67, None, "dbd191cf, 2026-08-17"),
)


def ours() -> Readme:
    """The first result of this README is what its first ``wirebayes fit`` prints."""
    lines = README.read_text(encoding="utf-8").splitlines()
    fit = next(i for i, line in enumerate(lines) if line.startswith(f"{PROMPT}wirebayes fit"))
    commands = sum(line.startswith(PROMPT) for line in lines[: fit + 1])
    return Readme("wirebayes", len(lines), fit + 2, commands)


def table() -> str:
    """The table as the docs include it."""
    out = [".. list-table::", "   :header-rows: 1", ""]
    header = ("README of", "lines", "first result at line", "commands to it", "read at")
    rows = [header, *(_cells(readme) for readme in (ours(), *OTHERS))]
    for row in rows:
        out += [f"   {'*' if i == 0 else ' '} - {cell}".rstrip() for i, cell in enumerate(row)]
    return "\n".join(out) + "\n"


def _cells(readme: Readme) -> tuple[str, ...]:
    shown = "none" if readme.result is None else str(readme.result)
    commands = "none shown" if readme.commands is None else str(readme.commands)
    return readme.project, str(readme.lines), shown, commands, readme.commit or "this version"


if __name__ == "__main__":
    print(table(), end="")
