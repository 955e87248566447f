"""``wirebayes reproduce``: the paper, with posteriors."""

import sys

from wirebayes.cli.options import Output, Seed


def reproduce(output: Output, seed: Seed = 0) -> None:
    """Reproduce the paper from its own tables, with posteriors: DIR/report.html, its tables and pictures."""
    from wirebayes.workers import load_early

    load_early()
    from wirebayes.cli.progress import progress
    from wirebayes.workflows.reproduce_paper import reproduce_paper

    with progress() as report:
        paper = reproduce_paper(output, seed=seed, progress=report)
    for line in paper.messages:
        print(line, file=sys.stderr)
    print(f"{output / 'report.html'}")
