"""The packages of wirebayes and what each imports, as the picture in CONTRIBUTING.md.

    python -m analyses.project.layers_picture

An arrow that follows from others is left out. The layers are those that `tests/test_import_layers.py` holds.
"""

from pathlib import Path

import matplotlib

matplotlib.use("svg")
import matplotlib.pyplot as plt

from tests.test_import_layers import LAYERS, imports

OUT = Path(__file__).parents[2] / "docs" / "images" / "layers.svg"
ABOUT = {
    "numeric": "arithmetic",
    "strict": "strict readers",
    "processes": "workers, locks",
    "wire": "physics of one wire",
    "io": "files",
    "effects": "the catalogue",
    "model": "priors, likelihoods",
    "simulation": "tests with known truth",
    "inference": "modes, sampling",
    "results": "posteriors on disk",
    "prediction": "later holds",
    "comparison": "models side by side",
    "discovery": "what is missing",
    "planning": "the next test",
    "robot": "statics, drift, calibration",
    "report": "pages, pictures",
    "paper": "its reproduction",
    "views": "what functions return",
    "commands": "one module a command",
    "cli": "parses and prints",
}


def reduced(uses: dict[str, set[str]]) -> list[tuple[str, str]]:
    """The arrows that do not follow from others."""

    def reachable(start: str, without: str) -> set[str]:
        seen: set[str] = set()
        todo = [name for name in uses[start] if name != without]
        while todo:
            name = todo.pop()
            if name not in seen:
                seen.add(name)
                todo += uses[name]
        return seen

    return [(user, used) for user in uses for used in uses[user] if used not in reachable(user, used)]


# Where a package stands across the page; its layer says how high.
ACROSS = {
    "paper": -2.3, "report": 0.9, "planning": 2.6, "comparison": -2.3, "discovery": 1.3, "prediction": -0.6,
    "inference": -1.9, "simulation": 2.9, "effects": -1.9, "io": 1.9, "robot": 4.6, "strict": 0.5, "numeric": -1.2,
    "processes": 3.2, "views": 3.6,
}  # fmt: skip
layers = [[name for name in sorted(layer) if name in ABOUT] for layer in LAYERS]
layers = [layer for layer in layers if layer]
layers[next(i for i, layer in enumerate(layers) if "results" in layer)].append("robot")
uses: dict[str, set[str]] = {name: set() for name in ABOUT}
for user, used, _ in imports():
    if user in uses and used in uses:
        uses[user].add(used)

figure = plt.figure(figsize=(7.6, 9.0), dpi=72)  # as an SVG is drawn: the boxes are where they were measured
axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
place = {name: (ACROSS.get(name, 0.0), 1.5 * row) for row, layer in enumerate(layers) for name in layer}
boxes = {}
for name, (x, y) in place.items():
    box = {"boxstyle": "round,pad=0.35", "facecolor": "white", "edgecolor": "#1f5f8b"}
    text = f"{name}\n{ABOUT[name]}"
    boxes[name] = axes.text(x, y, text, ha="center", va="center", fontsize=8, bbox=box, linespacing=1.3, zorder=5)
axes.set_xlim(-3.4, 6.0)
axes.set_ylim(-0.7, max(y for _, y in place.values()) + 0.7)
axes.axis("off")
figure.canvas.draw()  # the boxes have their size only then, and arrows end at them
for user, used in reduced(uses):
    ends = {"patchA": boxes[user].get_bbox_patch(), "patchB": boxes[used].get_bbox_patch()}
    arrow = {
        "arrowstyle": "-|>,head_width=0.25,head_length=0.6",
        "color": "0.35",
        "lw": 1.0,
        "shrinkA": 0,
        "shrinkB": 2,
    }
    axes.annotate("", place[used], place[user], arrowprops=arrow | ends, zorder=4)
figure.savefig(OUT, metadata={"Date": None, "Creator": None})
