"""Section 4 of the paper, the robot: the one place where reproduce and the robot meet."""

from pathlib import Path


def write(directory: Path, seed: int) -> None:
    """Add what the paper says of the robot's drift to a folder of reproduced fits.

    Called when all fits are stored and before the page is written. Tables go beside the others, pictures into the
    index of ``figures`` under the section ``robot``.
    """
