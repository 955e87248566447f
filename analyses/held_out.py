"""The last holds predicted from the first, on every wire of the paper: freely, and given each hold's first reading.

    python analyses/held_out.py [--output out/held-out]

Trained on 5 holds (as the paper did), 8, and two thirds. Prints one table; with --output also one picture a wire and
training size.
"""

import argparse
from pathlib import Path

import numpy as np

from wirebayes.comparison.compare import scores_dict
from wirebayes.inference.fit import fit, seed_of
from wirebayes.io.paper import experiments
from wirebayes.model.problem import build
from wirebayes.prediction.held_out import Scores, held_out, train_counts
from wirebayes.report.blocks import save
from wirebayes.report.pictures import compare as pictures

SEED = 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--output", type=Path)
    output = parser.parse_args().output
    print("wire, holds trained on, likelihood, held-out readings, rmse N, within 50 %, 90 %, 99 %, "
          "mean residual sd, p of the transform, elpd")  # fmt: skip
    for experiment in experiments():
        for trained in train_counts(len(experiment.recorded_holds)):
            for likelihood in ("chain", "hold"):
                words = (experiment.name, str(trained), likelihood)
                fitted = fit(build([experiment.train(trained)], likelihood=likelihood), seed_of(SEED, *words))
                rng = np.random.default_rng(seed_of(SEED, *words, "predict"))
                result = held_out(fitted, experiment, rng)
                ways: dict[pictures.Way, Scores | None] = {"free": result.free, "given_first": result.given}
                for way, scores in ways.items():
                    if scores is None:
                        continue
                    coverage = "  ".join(f"{100 * share:3.0f}" for share in scores.coverage().values())
                    print(f"{experiment.name:15s} {trained:2d}  {likelihood:5s}  {way.replace('_', ' '):11s} "
                          f"{scores.rmse_N:7.4f}   {coverage}  {scores.residual_sd.mean():+6.1f}  {scores.pit_p:6.3f}  "
                          f"{scores.elpd.sum():8.1f}" + ("" if fitted.chains.converged else "  not converged"),
                          flush=True)  # fmt: skip
                    if output is not None:
                        output.mkdir(parents=True, exist_ok=True)
                        name = f"{experiment.name}-{trained}-{likelihood}-{way.replace('_', '-')}"
                        title = f"{experiment.name}, {trained} holds, {pictures.WORDS[way]}"
                        save(pictures.bands(title, scores_dict(scores)), output / f"{name}.svg")
                        save(pictures.pit(title, scores_dict(scores)), output / f"{name}-pit.svg")


if __name__ == "__main__":
    main()
