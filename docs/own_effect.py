"""An effect of one's own: tension grows as a power of the strain."""

import numpy as np
from scipy import stats

from wirebayes.inference.fit import fit_problem
from wirebayes.io import paper
from wirebayes.model.build import build
from wirebayes.wire.effect import Amplitude, Effect


class OwnPower(Effect):
    """s -> s (s / 0.001)^p; p = 0 is the plain wire."""

    name, place, scope = "own_power", "strain", "material"
    amplitudes = (Amplitude("p", "-", 0.0, stats.norm(0.0, 0.3)),)
    sentence = "The tension grows as a power of the strain."

    def apply(self, value, own, hold):
        taut = np.where(value.real > 0, value, 1.0)
        return np.where(value.real > 0, value * (taut / 0.001) ** own["p"], value)


def main():
    nylon = paper.experiments()[2]
    result = fit_problem(build([nylon], [OwnPower()]), seed=1)
    p = result.flat[:, result.problem.names.index("own_power.p")]
    print(f"p = {p.mean():.2f}, standard deviation {p.std():.2f}, converged: {result.chains.converged}")


if __name__ == "__main__":
    main()
