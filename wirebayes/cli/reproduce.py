"""``wirebayes reproduce``: the paper, with posteriors."""

import sys

from wirebayes.cli.options import Output, Seed


def reproduce(output: Output, seed: Seed = 0) -> None:
    """Everything the paper shows, on its own tables, with posteriors: DIR/report.html and what it is made of."""
    from wirebayes.cli.progress import progress
    from wirebayes.reproduce.run import reproduce as run

    with progress() as report:
        lines = run(output, seed, report)
    for line in lines:
        print(line, file=sys.stderr)
    print(f"{output / 'report.html'}")
