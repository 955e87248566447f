"""``wirebayes reproduce``: the paper, with posteriors."""

import sys

from wirebayes.cli.options import Output, Seed


def reproduce(output: Output, seed: Seed = 0) -> None:
    """Reproduce the paper from its own tables, with posteriors: DIR/report.html and all that it shows."""
    from wirebayes.cli.progress import progress
    from wirebayes.reproduce.run import reproduce as run

    with progress() as report:
        lines = run(output, seed, report)
    for line in lines:
        print(line, file=sys.stderr)
    print(f"{output / 'report.html'}")
