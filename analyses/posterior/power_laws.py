"""What does a fit cost whose readings follow a power law of time, which the law approaches only at the ends of its
priors?

``python -m analyses.posterior.power_laws``: the toolkit's law approaches a power law of the time only at the far ends
of k2 and N, so that these posteriors lie against priors. A row each: likelihood evaluations of the fit, whether it
converged, its smallest effective sample size, and the middle of N. ``--only NAME`` (repeatable) takes some of them.
"""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from wirebayes.inference.fit import fit_problem
from wirebayes.io.arrays import from_arrays
from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import write_json
from wirebayes.model.build import build
from wirebayes.numeric.typing import Array

STRAIN = 0.02  # of a step; of the first reading under weights
CREPT = 0.1  # of the first reading, after a hundredth of a hold
BEGINS = 1e-3  # of a hold: from then on a tension relaxes, and of readings in the logarithm of time the second one


@dataclass(frozen=True)
class Test:
    """One simulated test of a material that is linear, so that the responses to all steps add up.

    Attributes
    ----------
    name : str
    creep : bool
        Weights are set, and elongations grow as ``t^exponent``; else tensions fall as ``(1 + t / t1)^-exponent``.
    exponent : float
    noise : float
        Standard deviation of a reading, as a share of the first one.
    holds : int
        Steps are equal, and holds equally long.
    length_mm, step_N, hold_s : float
        Length of the sample; tension, or weight, of a step; duration of a hold.
    readings : int
        Of each hold.
    even : bool
        Readings are evenly spaced in time; else in its logarithm, after a first one at 0 s.
    """

    name: str
    creep: bool
    exponent: float
    noise: float
    holds: int = 1
    length_mm: float = 1000.0
    step_N: float = 20.0
    hold_s: float = 3600.0
    readings: int = 60
    even: bool = False

    def relative_times(self) -> Array:
        """(r,) when a hold is read, in durations."""
        if self.even:
            return np.linspace(0.0, 1.0, self.readings)
        return np.append(0.0, np.geomspace(BEGINS, 1.0, self.readings - 1))

    def response(self, time: Array) -> Array:
        """To one step of one, at times in durations."""
        if self.creep:
            return np.asarray(1.0 + CREPT * (time / 0.01) ** self.exponent)
        return np.asarray((1.0 + time / BEGINS) ** -self.exponent)

    def experiment(self) -> Experiment:
        """The test as it was read."""
        time, number = self.relative_times(), np.arange(1, self.holds + 1)
        read = np.concatenate([sum(self.response(time + before) for before in range(n)) for n in number])
        read = read + self.noise * np.random.default_rng(0).normal(size=len(read))
        hold = np.repeat(number, len(time))
        stretch, tension = (hold, read) if not self.creep else (read, hold)
        return from_arrays(
            hold,
            STRAIN * self.length_mm * stretch,
            np.tile(self.hold_s * time, self.holds),
            self.step_N * tension,
            length_mm=self.length_mm,
            name=self.name,
            material=self.name,
            control="force" if self.creep else "displacement",
        )


TESTS = (
    Test("creep-0.2", True, 0.2, 1e-3),
    Test("creep-0.2-quiet", True, 0.2, 1e-4),
    Test("creep-0.2-even", True, 0.2, 1e-3, even=True),
    Test("creep-0.05-fibre", True, 0.05, 1e-3, length_mm=20.0, step_N=0.01),
    Test("creep-0.1-rope", True, 0.1, 1e-2, length_mm=10_000.0, step_N=50_000.0, hold_s=86_400.0),
    Test("creep-0.3-three", True, 0.3, 1e-3, holds=3),
    Test("creep-0.15-six", True, 0.15, 3e-4, holds=6, readings=20),
    Test("relax-0.05", False, 0.05, 1e-3),
    Test("relax-0.1-quiet", False, 0.1, 1e-4),
    Test("relax-0.2-even", False, 0.2, 1e-3, even=True),
    Test("relax-0.3-tissue", False, 0.3, 1e-2, length_mm=15.0, step_N=2.0, hold_s=180.0),
    Test("relax-0.05-rope", False, 0.05, 1e-4, length_mm=10_000.0, step_N=50_000.0, hold_s=86_400.0),
    Test("relax-0.1-four", False, 0.1, 1e-3, holds=4, readings=30),
    Test("relax-0.1-eight", False, 0.1, 3e-4, holds=8, readings=12),
    Test("relax-0.2-eight", False, 0.2, 3e-4, holds=8, readings=12),
)


def row(test: Test) -> dict[str, float | str | bool]:
    """What the fit of a test cost."""
    done = fit_problem(build([test.experiment()]))
    at = done.problem.names.index("N")
    return {
        "test": test.name,
        "evaluations": done.chains.evaluations,
        "converged": done.converged,
        "ess": float(done.chains.ess.min()),
        "N": float(np.median(done.flat[:, at])),
        "why": done.why,
    }


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--only", action="append", choices=[test.name for test in TESTS])
    parser.add_argument("--output", type=Path, default=Path("out/power_laws.json"))
    options = parser.parse_args()
    rows = []
    for each in TESTS:
        if options.only is None or each.name in options.only:
            rows.append(row(each))
            print(*rows[-1].values(), sep="  ", flush=True)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    write_json(options.output, rows)
