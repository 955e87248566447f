"""Lines as tension tests leave them: draws about known parameters."""

import numpy as np

from wirebayes.robot.mechanics.draws import WireDraws

CORE = {"k1": 800.0, "B": 0.3, "U": 0.8, "k2": 0.03, "N": 0.64}
STRONGER = CORE | {"U": 0.9}


def line_about(means, sd, count, seed=0, law="hooke"):
    """Draws with the same relative scatter of every parameter."""
    rng = np.random.default_rng(seed)
    return WireDraws({k: v * np.exp(sd * rng.standard_normal(count)) for k, v in means.items()}, 1000.0, law)
