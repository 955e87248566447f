"""The README's picture of the gap shrinking, from a folder that ``wirebayes discover`` wrote.

wirebayes discover data/paper/experiments.toml --experiment roc-line-1m --train-holds 8 --output out/roc
python analyses/waterfall.py out/roc
"""

import argparse
import json
from pathlib import Path

from wirebayes.report.pictures.discover import waterfall

TARGET = Path(__file__).parent.parent / "docs" / "images" / "waterfall.png"

parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
parser.add_argument("run", type=Path)
options = parser.parse_args()
found = json.loads((options.run / "discovery.json").read_text(encoding="utf-8"))["experiments"]
(verdict,) = found.values()
waterfall(verdict).savefig(TARGET, dpi=110, metadata={"Software": None})
