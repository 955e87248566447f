"""Do independent runs on the same posterior agree within the error they promise? Four wires, two likelihoods.

    python analyses/sampler_agreement.py

Scale parameters are compared as logarithms.
"""

import numpy as np

from wirebayes.inference.fit import fit
from wirebayes.io.paper import experiments
from wirebayes.model.problem import build

SEEDS = range(100, 112)


def main() -> None:
    print("wire, likelihood, spread of the means over their promised error: rms and largest over parameters, "
          "largest difference of two means in sd, largest ratio of two sd")  # fmt: skip
    for experiment in experiments():
        for likelihood in ("chain", "hold"):
            problem = build([experiment], likelihood=likelihood)
            logs = [name in problem.prior.logarithmic for name in problem.names]
            means, sds, errors = [], [], []
            for seed in SEEDS:
                fitted = fit(problem, seed)
                theta = fitted.flat.copy()
                theta[:, logs] = np.log(theta[:, logs])
                means.append(theta.mean(axis=0))
                sds.append(theta.std(axis=0))
                errors.append(sds[-1] / np.sqrt(fitted.chains.ess))
            ratio = np.std(means, axis=0, ddof=1) / np.mean(errors, axis=0)
            apart = (np.ptp(means, axis=0) / np.mean(sds, axis=0)).max()
            wider = (np.max(sds, axis=0) / np.min(sds, axis=0)).max()
            print(f"{experiment.name:15s} {likelihood:5s}  {np.sqrt((ratio**2).mean()):.2f} {ratio.max():.2f}  "
                  f"{apart:.3f}  {wider:.3f}", flush=True)  # fmt: skip


if __name__ == "__main__":
    main()
