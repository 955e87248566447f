"""Run the studies, resume, judge, draw: ``python -m analyses.calibration --output DIR``."""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np

from analyses.calibration.simulation_based_calibration import band, verdict
from analyses.calibration.study import BROKEN, STUDIES, Study
from wirebayes.io.run_folder import write_json
from wirebayes.processes.workers import executor


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--output", type=Path, default=Path("out/calibration"))
    parser.add_argument("--data-sets", type=int, default=300)
    parser.add_argument("--broken", type=int, default=100, help="data sets fitted with the setting error dropped, or 0")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    parser.add_argument("--scheduler", help="address of a Dask scheduler whose workers can import this checkout")
    names = [study.name for study in STUDIES]
    parser.add_argument("--only", nargs="+", choices=names, default=names, help="some studies, judged by themselves")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    wanted = [(study, options.data_sets) for study in STUDIES if study.name in options.only]
    wanted += [(BROKEN, options.broken)] if options.broken else []
    where = options.output, options.seed, options.workers, options.scheduler
    lines = {study.name: run(study, count, *where) for study, count in wanted}
    result = judged(lines, options.seed)
    write_json(options.output / "calibration.json", result)
    draw({name: shares(rows) for name, rows in lines.items()}, result, options.output / "calibration.png")
    print(summary(result))
    caught = result["broken"] is None or not result["broken"]["inside"]
    return 0 if result["inside"] and caught and result["share_not_converged"] <= 0.01 else 1


def run(
    study: Study, count: int, folder: Path, seed: int, workers: int, scheduler: str | None = None
) -> list[dict[str, Any]]:
    """The data sets of a study in order; those on file are not run again. One line of JSON each, written when done."""
    path = folder / f"{study.name}-seed{seed}.jsonl"
    done: dict[int, dict[str, Any]] = {}
    if path.exists():
        # a line that a kill cut short has no line feed and is run again
        complete = [line for line in path.read_text(encoding="utf-8").splitlines(keepends=True) if line.endswith("\n")]
        path.write_text("".join(complete), encoding="utf-8")
        done = {row["index"]: row for row in map(json.loads, complete)}
    missing = [i for i in range(count) if i not in done]
    with path.open("a", encoding="utf-8") as file, executor(scheduler, workers) as pool:
        for future in [pool.submit(study.data_set, seed, i) for i in missing]:
            row = future.result()
            done[row["index"]] = row
            file.write(json.dumps(row) + "\n")
            file.flush()
            if sys.stderr.isatty():
                print(f"\r{study.name}: {len(done)}/{count}", end="", file=sys.stderr)
    return [done[i] for i in range(count)]


def shares(rows: list[dict[str, Any]]) -> dict[str, Any]:
    return {name: np.array([row["share_below"][name] for row in rows]) for name in rows[0]["share_below"]}


def judged(lines: dict[str, list[dict[str, Any]]], seed: int) -> dict[str, Any]:
    """One band over all quantities of all studies; the broken likelihood by itself against a band of its own."""
    sound = {name: rows for name, rows in lines.items() if name != BROKEN.name}
    everything = {f"{name}: {q}": v for name, rows in sound.items() for q, v in shares(rows).items()}
    result = verdict(everything)
    broken = verdict(shares(lines[BROKEN.name])) if BROKEN.name in lines else None
    stopped = {name: [row["index"] for row in rows if not row["converged"]] for name, rows in lines.items()}
    count = sum(len(rows) for rows in sound.values())
    return {
        "seed": seed,
        "data_sets": {name: len(rows) for name, rows in lines.items()},
        **result,
        "not_converged": stopped,
        "share_not_converged": sum(len(stopped[name]) for name in sound) / count,
        "broken": broken,
    }


def summary(result: dict[str, Any]) -> str:
    worst = sorted(result["extremeness"].items(), key=lambda item: item[1])[:5]
    lines = [
        f"data sets: {result['data_sets']}",
        f"{result['quantities']} quantities, joint {result['joint']:.0%} band: "
        + ("all inside" if result["inside"] else f"outside: {', '.join(result['outside'])}"),
        f"threshold {result['threshold']}; the five most extreme: " + ", ".join(f"{k} {v:.2g}" for k, v in worst),
        f"not converged: {result['share_not_converged']:.2%} {result['not_converged']}",
    ]
    if result["broken"] is not None:
        caught = ", ".join(result["broken"]["outside"])
        lines.append("setting error dropped: " + (f"caught by {caught}" if caught else "NOT caught"))
    return "\n".join(lines)


def draw(lines: dict[str, dict[str, Any]], result: dict[str, Any], path: Path) -> None:
    """Empirical distribution minus uniform, a panel a study, with the joint band."""
    import matplotlib

    matplotlib.use("Agg")
    from matplotlib import pyplot as plt

    names = dict.fromkeys(quantity for quantities in lines.values() for quantity in quantities)
    colours = {quantity: f"C{number}" for number, quantity in enumerate(names)}
    columns = min(len(lines), 3)
    rows = -(-len(lines) // columns)
    size = (3.4 * columns, 2.8 * rows)
    figure, axes = plt.subplots(
        rows, columns, figsize=size, sharex=True, sharey=True, layout="constrained", squeeze=False
    )
    for axis in axes.flat[len(lines) :]:
        axis.set_axis_off()
    for axis, (name, quantities) in zip(axes.flat, lines.items(), strict=False):
        n = len(next(iter(quantities.values())))
        levels = result["threshold"] if str(n) in result["threshold"] else result["broken"]["threshold"]
        points, lower, upper = band(n, levels[str(n)])
        axis.fill_between(points, lower - points, upper - points, color="0.85", label="99 % band, joint")
        for quantity, values in quantities.items():
            counted = np.searchsorted(np.sort(values), points, side="right") / n
            axis.plot(points, counted - points, lw=1, label=quantity, color=colours[quantity])
        axis.axhline(0, color="0.4", lw=0.5)
        axis.set_title(f"{name}, {n} data sets", fontsize=9)
        axis.tick_params(labelbottom=True)
    figure.supxlabel("share of the posterior below the truth")
    figure.supylabel("empirical minus uniform distribution")
    handles, labels = axes.flat[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside right upper")
    figure.savefig(path, dpi=130, metadata={"Software": None})
    plt.close(figure)


if __name__ == "__main__":
    sys.exit(main())
