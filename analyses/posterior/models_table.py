"""The table of all models on all wires, as the docs include it, from a comparison's results.

    wirebayes compare data/paper/experiments.toml --output out/compare
    python analyses/posterior/models_table.py out/compare/comparison.json > docs/models-table.inc

Per wire: elpd against the plain model, leaving out each hold in turn, with its standard error (! where a sampling did
not converge; in brackets given each hold's first reading), and the rms error of the last third of the holds.
"""

import argparse
import json
from pathlib import Path
from typing import Any


def cell(model: dict[str, Any] | None) -> str:
    if model is None:
        return "–"
    if model["failed"]:
        return "failed"
    difference, given = model["difference"], model.get("given_first_difference")
    free = (model["held_out"] or {}).get("free")
    parts = []
    if difference:
        parts.append(_cell(difference) + ("" if model["converged"] else " !"))
    elif given:
        parts.append(f"({_cell(given)})")
    if free:
        parts.append(f"{free['rmse_N']:.3f} N")
    return "; ".join(parts) or "–"


def _cell(difference: dict[str, float]) -> str:
    return f"{difference['elpd']:+.1f} ± {difference['se']:.1f}".replace("-", "−")


def _best(models: list[dict[str, Any]], name: str) -> dict[str, Any] | None:
    """Of the forms and places that go by a name, the one that predicts best."""
    named = [m for m in models if m["name"].split("@")[0] == name]
    return max(named, key=lambda m: m["difference"]["elpd"] if m["difference"] else -1e9, default=None)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("comparison", type=Path)
    wires = json.loads(parser.parse_args().comparison.read_text(encoding="utf-8"))["experiments"]
    names = list(dict.fromkeys(m["name"].split("@")[0] for w in wires.values() for m in w["models"]))
    share = (100 - 24) // len(wires)
    print(".. list-table::\n   :header-rows: 1\n   :widths: " + " ".join(["24"] + [str(share)] * len(wires)) + "\n")
    for row in [["model", *wires]] + [
        [name.replace("_", " "), *(cell(_best(w["models"], name)) for w in wires.values())] for name in names
    ]:
        print("   * - " + "\n     - ".join(row))


if __name__ == "__main__":
    main()
