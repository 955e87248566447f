"""What public recordings tell: a tendon's and an elastomer's relaxation by the posterior and by a plain least squares.

``python -m analyses.posterior.real_files --elastomer 1d5.csv``: the tendon fascicle of ``tests/data/bench``, one hold
of three minutes; and a strip of VHB 4910, 80 mm long, held at 40 mm for half an hour, which is not part of this
repository: ``single-step-relaxation/original_data/1d5.csv`` of github.com/Chongran-Zhao/VHB4910_data, left out where
no file is given. Least squares fits the same law without a preload; the posterior is given that (``preload = 0``) or
not. Both are also fitted, without a preload, to the readings of the first third of the time, and predict the others.
"""

import argparse
import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from wirebayes.commands.import_bench import import_bench
from wirebayes.inference.fit import fit
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import write_json
from wirebayes.model.build import build
from wirebayes.numeric.frozen import frozen
from wirebayes.numeric.typing import Array

TENDON = Path(__file__).parents[2] / "tests" / "data" / "bench" / "tendon_fresh1.csv"
TENDON_MM, ELASTOMER_MM = 14.33, 80.0
FIRST = 1.0 / 3.0  # of the time: what is fitted to predict the rest
POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)
NAMES = ("k1", "k2", "N")


def law(parameters: Any, length_mm: float, stretched_mm: Any, time_s: Array) -> Array:
    """Tension of a sample held at one stretched length, with the final creep as a parameter.

    Parameters
    ----------
    parameters : sequence of four
        k1, final creep in mm, k2 and N: numbers, or arrays that broadcast with `time_s`.
    length_mm : float
    stretched_mm : float or array
    time_s : array
    """
    k1, amount_mm, k2, N = parameters
    crept = amount_mm * -np.expm1(-k2 * time_s**N)
    return np.asarray(k1 * (stretched_mm / (length_mm + crept) - 1.0))


def by_least_squares(time_s: Array, tension_N: Array, length_mm: float, stretched_mm: float) -> Array:
    """(4,) k1, final creep, k2 and N, all found by their logarithms."""
    k1 = tension_N[0] / (stretched_mm / length_mm - 1.0)
    amount_mm = stretched_mm / (1.0 + tension_N[-1] / k1) - length_mm  # as if all creep were over at the end
    start = np.log([k1, amount_mm, 0.2, 0.5])

    def left(logs: Array) -> Array:
        return law(np.exp(logs), length_mm, stretched_mm, time_s) - tension_N

    found = least_squares(left, start, xtol=1e-12, ftol=1e-12)
    return np.asarray(np.exp(found.x))


def by_posterior(test: Experiment, *, preload: bool) -> dict[str, Array]:
    """Draws of the parameters, with the amount of creep at the first tension that the model has."""
    # of a single hold the setting error is a preload by another name
    priors = {"setting_sd": {"fixed": 0.0}} | ({} if preload else {"preload": {"fixed": 0.0}})
    known = replace(test, priors=priors)
    done = fit(build([known]), 0, policy=POLICY)
    draws = dict(zip(done.problem.names, done.flat.T, strict=True))
    zero = np.zeros(len(done.flat))
    stretched = test.length_mm + test.holds[0].setting + draws.get("preload", zero)
    first = draws["k1"] * (stretched / test.length_mm - 1.0)
    return draws | {"amount_mm": draws["B"] * first ** draws["U"], "stretched_mm": stretched}


def summarised(draws: dict[str, Array]) -> dict[str, list[float]]:
    """The 5, 50 and 95 % points."""
    return {name: np.quantile(draws[name], [0.05, 0.5, 0.95]).tolist() for name in NAMES}


def study(test: Experiment) -> dict[str, Any]:
    """Everything that the page quotes of a file."""
    (hold,) = test.holds
    time, tension, stretched = hold.time_s, hold.readings, test.length_mm + hold.setting
    plain = by_least_squares(time, tension, test.length_mm, stretched)
    left = law(plain, test.length_mm, stretched, time) - tension
    early = time <= FIRST * hold.duration_s
    first = by_least_squares(time[early], tension[early], test.length_mm, stretched)
    part = replace(
        hold, time_s=frozen(time[early].tolist()), readings=frozen(tension[early].tolist()),
        duration_s=float(time[early][-1]),
    )  # fmt: skip
    draws = by_posterior(replace(test, holds=(part,)), preload=False)
    later = time[~early][:, None]
    parameters = [draws[name] for name in ("k1", "amount_mm", "k2", "N")]
    drawn = law(parameters, test.length_mm, draws["stretched_mm"], later)
    drawn = drawn + draws["sensor_sd"] * np.random.default_rng(0).normal(size=drawn.shape)
    low, high = np.quantile(drawn, [0.05, 0.95], axis=1)
    error = law(first, test.length_mm, stretched, time[~early]) - tension[~early]
    return {
        "readings": len(time),
        "duration_s": hold.duration_s,
        "least_squares": {"k1": plain[0], "k2": plain[2], "N": plain[3], "rms_N": float(np.sqrt(np.mean(left**2)))},
        "posterior": summarised(by_posterior(test, preload=False)),
        "posterior_with_preload": summarised(by_posterior(test, preload=True)),
        "later": {
            "readings": int((~early).sum()),
            "in_band_90": int(((tension[~early] >= low) & (tension[~early] <= high)).sum()),
            "band_N": float(np.mean(high - low)),
            "least_squares_rms_N": float(np.sqrt(np.mean(error**2))),
            "posterior_rms_N": float(np.sqrt(np.mean((drawn.mean(axis=1) - tension[~early]) ** 2))),
        },
    }


def imported(raw: Path, length_mm: float, mapping: Sequence[str] = ()) -> Experiment:
    """The only test of a raw file."""
    (test,) = import_bench(raw, length_mm=length_mm, name="test", mapping=mapping).experiments
    return test


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elastomer", type=Path, metavar="FILE")
    parser.add_argument("--output", type=Path, default=Path("out/real_files.json"))
    options = parser.parse_args()
    found = {"tendon": study(imported(TENDON, TENDON_MM, ["Extension=displacement"]))}
    if options.elastomer:
        found["elastomer"] = study(imported(options.elastomer, ELASTOMER_MM))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_json(options.output, found)
    print(json.dumps(json.loads(options.output.read_text(encoding="utf-8")), indent=1))
