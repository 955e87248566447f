"""``wirebayes reproduce``: the paper, with posteriors."""

import sys
from pathlib import Path

from wirebayes.cli.options import OutputOfNoFile, Seed


def reproduce_command(output: OutputOfNoFile = None, seed: Seed = 0) -> None:
    """Reproduce the paper from its own tables, with posteriors: DIR/report.html, its tables and pictures."""
    from wirebayes.cli.progress import progress
    from wirebayes.commands.reproduce_paper import reproduce_paper

    folder = Path("reproduce") if output is None else output
    with progress() as report:
        paper = reproduce_paper(folder, seed=seed, progress=report)
    for line in paper.messages:
        print(line, file=sys.stderr)
    print(f"{folder / 'report.html'}")
