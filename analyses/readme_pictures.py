"""The pictures of the README, from a folder that ``wirebayes reproduce`` wrote.

python analyses/readme_pictures.py out/reproduce [--wire kite-1.5m]
"""

import argparse
import json
from pathlib import Path

import numpy as np

from wirebayes.io import paper
from wirebayes.report import figures
from wirebayes.report.pictures import paper_figures
from wirebayes.reproduce.held_out import held_out
from wirebayes.results.store import load

IMAGES = Path(__file__).parent.parent / "docs" / "images"

parser = argparse.ArgumentParser(description=__doc__)
parser.add_argument("run", type=Path)
parser.add_argument("--wire", default="kite-1.5m")
options = parser.parse_args()

wire = next(e for e in paper.experiments() if e.name == options.wire)
training = paper.published()["identification"]["training_holds"]
rows = json.loads((options.run / "posterior.json").read_text(encoding="utf-8"))
forecast = held_out(load(options.run / wire.name / f"chain-first-{training}"), wire, np.random.default_rng(0))

pictures = {
    "measured": figures.measured(wire.protocol(), wire.tension(), "What was measured"),
    "known": paper_figures.intervals([r for r in rows if r["experiment"] == wire.name], "What is known, what is not"),
    "unused": figures.residuals(
        forecast.hold, forecast.time_s, forecast.measured_N, forecast.band_N, "Where the plain model fails"
    ),
}
IMAGES.mkdir(parents=True, exist_ok=True)
for name, figure in pictures.items():
    figure.set_size_inches(4.7, 3.6)
    figure.savefig(IMAGES / f"{name}.png", dpi=130, metadata={"Software": None})
    print(IMAGES / f"{name}.png", (IMAGES / f"{name}.png").stat().st_size, "bytes")
