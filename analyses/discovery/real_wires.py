"""The paper's four wires: what `discover` names, alone and together, and the gap on holds it did not see.

Run with ``python analyses/discovery/real_wires.py [--together] [--output FILE.json]``. Names are chosen on the first
eight holds (kite: five), and the models are then asked for the rest; then on all holds, each wire by itself.
"""

import argparse
import json
from pathlib import Path

import numpy as np

from wirebayes.discovery import held_out
from wirebayes.discovery.investigation import final_models
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import Settings
from wirebayes.inference.laplace_fit import fitted
from wirebayes.io import paper
from wirebayes.model.spec import PLAIN_SPEC

TRAIN = {"roc-line-1m": 8, "roc-line-1.71m": 8, "nylon-1.5m": 8, "kite-1.5m": 5}


def unseen(experiment, holds, seed=0):
    """What is named on the first holds, and both models' error on the rest."""
    trained = experiment.train(holds)
    findings = investigate([trained], Settings(), seed)
    verdict = findings.report["experiments"][experiment.name]
    effects = final_models(findings)[0].effects
    rng = np.random.default_rng(seed)
    block = fitted([trained], (), PLAIN_SPEC, rng)
    plain, final = (held_out.predicted([experiment], [holds], chosen, block, rng)[0] for chosen in ((), effects))
    return {
        "verdict": verdict["verdict"],
        "set": verdict["set"],
        "accepted": verdict["accepted"],
        "p": verdict["p_global"],
        "plain_rmse_N": plain.rmse_N,
        "final_rmse_N": final.rmse_N,
        "reduction": 1 - final.rmse_N / plain.rmse_N,
        "plain_elpd": float(plain.elpd.sum()),
        "final_elpd": float(final.elpd.sum()),
        "plain_inside_90": plain.inside,
        "final_inside_90": final.inside,
        "gap_closed": held_out.gap_closed(plain, final),
    }


def said(report):
    """What a report says of a wire: verdict, names, established families, a remainder, and the screw."""
    families = [
        {key: family[key] for key in ("name", "members", "inclusion", "leave_one_hold_out")}
        for family in report["families"]
        if family["established"]
    ]
    return {
        "verdict": report["verdict"],
        "set": report["set"],
        "accepted": report["accepted"],
        "p": report["p_global"],
        "families": families,
        "remainder": report["remainder"]["probability"],
        "screw_error": report["inclusion"].get("screw_error"),
        "shared_with": report["shared_with"],
        "parameters": report["parameters"],
    }


def main():
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--output", type=Path)
    options.add_argument(
        "--together", action="store_true", help="also judge all wires, and both Roc lines, as one file"
    )
    chosen = options.parse_args()
    wires = paper.experiments()
    results = {"first holds to the rest": {w.name: unseen(w, TRAIN[w.name]) for w in wires}}
    for name, r in results["first holds to the rest"].items():
        print(
            f"{name:16s} {r['verdict']:16s} {'+'.join(r['accepted']) or '-':34s} "
            f"rmse {r['plain_rmse_N']:.3f} -> {r['final_rmse_N']:.3f} N ({100 * r['reduction']:.0f} % less), "
            f"90 % band holds {100 * r['plain_inside_90']:.0f} -> {100 * r['final_inside_90']:.0f} %"
        )
    reductions = [r["reduction"] for r in results["first holds to the rest"].values()]
    print(f"median reduction {100 * np.median(reductions):.0f} %")
    groups = {"all holds": [[w] for w in wires]}
    if chosen.together:
        groups |= {"two Roc lines": [wires[:2]], "all four": [wires]}
    for title, files in groups.items():
        reports = [investigate(file, Settings(), 0).report["experiments"] for file in files]
        results[title] = {name: said(report) for found in reports for name, report in found.items()}
        for name, r in results[title].items():
            shared = f", shared with {', '.join(r['shared_with'])}" if r["shared_with"] else ""
            families = ", ".join(f"{f['name']} {f['inclusion']:.2f}" for f in r["families"]) or "no family established"
            print(
                f"{title}: {name:16s} {r['verdict']:16s} set {r['set']}, accepted {r['accepted']}, {families}{shared}"
            )
    if chosen.output:
        chosen.output.write_text(json.dumps(results, indent=1, default=float) + "\n")


if __name__ == "__main__":
    main()
