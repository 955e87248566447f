"""What public recordings of a tendon and of an elastomer tell, by the posterior and by a plain least squares.

``python -m analyses.posterior.real_files --elastomer 1d5.csv``. Of the files of ``tests/data/bench``, two are public
recordings. The tendon fascicle was held for three minutes, and is read twice: as `import` makes a hold of it, which
begins in the middle of the ramp and leaves out what followed the ramp too closely; and as somebody wrote it by hand,
from the end of the ramp. ``vhb_gbk.csv`` is the head of a pull at constant speed of a strip of VHB 4910, 80 mm long
(``uniaxial-loading-unloading/original_data/0d05_1d5_1.csv`` of github.com/Chongran-Zhao/VHB4910_data). It has no hold:
here it is a staircase of short ones, by the law with N = 1 and U = 1, to which it does not matter how time is divided.
The relaxation of such a strip, held at 40 mm for half an hour, is ``single-step-relaxation/original_data/1d5.csv``
there; it is not part of this repository, and left out where no file is given.

Least squares fits the same law without a preload; the posterior is given that (``preload = 0``) or not. Both are also
fitted, without a preload, to the readings of the first third of the time, and predict the others.
"""

import argparse
import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import least_squares

from wirebayes.commands.fit import fit
from wirebayes.commands.import_bench import import_bench
from wirebayes.inference.policy import Policy
from wirebayes.io.arrays import from_arrays
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.run_folder import write_json
from wirebayes.numeric.frozen import frozen
from wirebayes.numeric.typing import Array
from wirebayes.views.posterior import Posterior

BENCH = Path(__file__).parents[2] / "tests" / "data" / "bench"
TENDON, BY_HAND, PULL = (BENCH / name for name in ("tendon_fresh1.csv", "tendon-fresh1.toml", "vhb_gbk.csv"))
TENDON_MM, ELASTOMER_MM = 14.33, 80.0
FIRST = 1.0 / 3.0  # of the time: what is fitted to predict the rest
POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0, most_steps=800)
NAMES = ("k1", "k2", "N")
STEP_S = 0.2  # of the staircase in place of a pull: ten readings, a fiftieth of the pull
# N = 1, and creep in proportion to tension; one reading a step cannot tell its setting's error from its own
LINEAR = {name: {"fixed": value} for name, value in {"N": 1.0, "U": 1.0, "setting_sd": 0.0, "preload": 0.0}.items()}


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


def fitted(test: Experiment, *, check: bool = False) -> Posterior:
    """The posterior of the only test, as `wirebayes fit` finds it."""
    found = fit(test, check=check, policy=POLICY)
    assert isinstance(found, Posterior)
    return found


def known_preload(test: Experiment, *, preload: bool) -> Experiment:
    """A test whose preload is open, or nothing; of a single hold the setting error is a preload by another name."""
    return replace(test, priors={"setting_sd": {"fixed": 0.0}} | ({} if preload else {"preload": {"fixed": 0.0}}))


def predicted(posterior: Posterior, test: Experiment, time_s: Array) -> Array:
    """(readings, draws) at later times of the only hold of a test without a preload."""
    d = posterior.draws()
    stretched = test.length_mm + test.holds[0].setting
    first = d["k1"] * (stretched / test.length_mm - 1.0)
    parameters = d["k1"], d["B"] * first ** d["U"], d["k2"], d["N"]
    drawn = law(parameters, test.length_mm, stretched, time_s[:, None])
    return np.asarray(drawn + d["sensor_sd"] * np.random.default_rng(0).normal(size=drawn.shape))


def described(posteriors: Mapping[str, Posterior], names: Sequence[str]) -> dict[str, Any]:
    """Of fits, by what they are called: intervals, whether they converged, and what their check says."""
    out = {}
    for called, posterior in posteriors.items():
        summary, draws = posterior.summary(), posterior.draws()
        out[called] = {
            "converged": summary["converged"],
            "model_check": summary["model_check"]["p"],
            **{name: np.quantile(draws[name], [0.05, 0.5, 0.95]).tolist() for name in names},
        }
    return out


def study(test: Experiment) -> dict[str, Any]:
    """Everything that the page quotes of a file."""
    (hold,) = test.holds
    time, tension, stretched = hold.time_s, hold.readings, test.length_mm + hold.setting
    plain = by_least_squares(time, tension, test.length_mm, stretched)
    left = law(plain, test.length_mm, stretched, time) - tension
    early = time <= FIRST * hold.duration_s
    first = by_least_squares(time[early], tension[early], test.length_mm, stretched)
    part = replace(
        hold,
        time_s=frozen(time[early].tolist()),
        readings=frozen(tension[early].tolist()),
        duration_s=float(time[early][-1]),
    )
    of_part = fitted(known_preload(replace(test, holds=(part,)), preload=False))
    drawn = predicted(of_part, test, time[~early])
    whole = {
        f"preload_{word}": fitted(known_preload(test, preload=word == "open"), check=True) for word in ("known", "open")
    }
    return {
        "readings": len(time),
        "duration_s": hold.duration_s,
        "least_squares": {"k1": plain[0], "k2": plain[2], "N": plain[3], "rms_N": _rms(left)},
        "posterior": described(whole, NAMES),
        "later": {
            "converged": of_part.summary()["converged"],
            **_later(drawn, law(first, test.length_mm, stretched, time[~early]), tension[~early]),
        },
    }


def written_by_hand(file: Path) -> Experiment:
    """A test of one hold, without the reading at displacement zero before it."""
    (test,) = read_experiments(file)
    return replace(test, holds=test.holds[-1:])


def pulled(file: Path, length_mm: float) -> Experiment:
    """A staircase in place of a pull at constant speed: in the middle of every step is a reading, where both agree."""
    cells = np.genfromtxt(file, delimiter=",", skip_header=3, dtype=str, encoding="gb18030")
    time, displacement, tension = np.char.strip(cells, '"').astype(float).T
    every = round(STEP_S / (time[1] - time[0]))
    middle = slice(every, None, every)
    shown = np.column_stack([tension[middle], np.full(len(tension[middle]), np.nan)])  # nothing is read at its end
    steps = len(shown)
    return from_arrays(
        np.repeat(np.arange(1, steps + 1), 2),
        np.repeat(displacement[middle], 2),
        np.tile([STEP_S / 2.0, STEP_S], steps),
        shown.ravel(),
        length_mm=length_mm,
        name="pull",
        material="VHB-4910",
    )


def staircase(parameters: Any, length_mm: float, settings_mm: Array) -> Array:
    """(..., steps) tensions in the middle of steps by the linear law.

    Parameters
    ----------
    parameters : sequence of three
        k1, B and k2: numbers or (...) arrays.
    length_mm : float
    settings_mm : (steps,) array
    """
    k1, B, k2 = parameters
    crept, out = 0.0 * k1, []
    half, whole = (-np.expm1(-k2 * span) for span in (STEP_S / 2.0, STEP_S))
    for setting in settings_mm:
        begins = k1 * ((length_mm + setting) / (length_mm + crept) - 1.0)
        to_come = B * begins - crept
        out.append(k1 * ((length_mm + setting) / (length_mm + crept + to_come * half) - 1.0))
        crept = crept + to_come * whole
    return np.stack(out, axis=-1)


def study_of_pull(test: Experiment) -> dict[str, Any]:
    """Everything that the page quotes of a pull."""
    settings = np.array([hold.setting for hold in test.holds])
    tension = np.array([hold.readings[0] for hold in test.holds])
    early = np.arange(len(settings)) < FIRST * len(settings)

    def by_squares(shown: Array) -> Array:
        def left(logs: Array) -> Array:
            return staircase(np.exp(logs), test.length_mm, settings[shown]) - tension[shown]

        start = np.log([tension[0] / settings[0] * test.length_mm, test.length_mm / 4.0, 0.5])
        return np.asarray(np.exp(least_squares(left, start, xtol=1e-12, ftol=1e-12).x))

    everything = np.ones(len(settings), dtype=bool)
    plain, first = by_squares(everything), by_squares(early)
    known = replace(test, priors=LINEAR)
    of_part = fitted(replace(known, holds=known.holds[: int(early.sum())]))
    d = of_part.draws()
    drawn = staircase([d[name] for name in ("k1", "B", "k2")], test.length_mm, settings)[:, ~early].T
    drawn = drawn + d["sensor_sd"] * np.random.default_rng(0).normal(size=drawn.shape)
    left = staircase(plain, test.length_mm, settings) - tension
    return {
        "readings": len(settings),
        "duration_s": STEP_S * len(settings),
        "least_squares": {"k1": plain[0], "k2": plain[2], "rms_N": _rms(left)},
        "posterior": described({"linear": fitted(known, check=True)}, ("k1", "k2")),
        "later": {
            "converged": of_part.summary()["converged"],
            **_later(drawn, staircase(first, test.length_mm, settings)[~early], tension[~early]),
        },
    }


def _later(drawn: Array, by_squares: Array, read: Array) -> dict[str, float]:
    """How (readings, draws) predictions and those of least squares agree with what was read."""
    low, high = np.quantile(drawn, [0.05, 0.95], axis=1)
    return {
        "readings": len(read),
        "in_band_90": int(((read >= low) & (read <= high)).sum()),
        "band_N": float(np.mean(high - low)),
        "least_squares_rms_N": _rms(by_squares - read),
        "posterior_rms_N": _rms(drawn.mean(axis=1) - read),
    }


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def imported(raw: Path, length_mm: float, mapping: Sequence[str] = ()) -> Experiment:
    """The only test of a raw file."""
    (test,) = import_bench(raw, length_mm=length_mm, name="test", mapping=mapping).experiments
    return test


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--elastomer", type=Path, metavar="FILE")
    parser.add_argument("--output", type=Path, default=Path("out/real_files.json"))
    options = parser.parse_args()
    found = {
        "tendon": study(imported(TENDON, TENDON_MM, ["Extension=displacement"])),
        "tendon_by_hand": study(written_by_hand(BY_HAND)),
        "pull": study_of_pull(pulled(PULL, ELASTOMER_MM)),
    }
    if options.elastomer:
        found["elastomer"] = study(imported(options.elastomer, ELASTOMER_MM))
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_json(options.output, found)
    print(json.dumps(json.loads(options.output.read_text(encoding="utf-8")), indent=1))
