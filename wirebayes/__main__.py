"""``python -m wirebayes`` is the command line."""

import sys

from wirebayes.cli import main

if __name__ == "__main__":
    sys.exit(main())
