"""Whether a calibration's residuals, and its estimates against their priors, are as large as they should be."""

import numpy as np
from scipy.special import chdtrc

from wirebayes.json_files.calibrate import Interval
from wirebayes.numeric.linear_algebra import solve
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.sentences import short

# Of a session with nothing wrong one in a hundred is called unusable: a warning that is heeded costs another session,
# lengths that are wrong cost a crash.
SIGNIFICANT = 0.01
_LEAST = 1e-4  # probability: farther out, no error is known to be Gaussian
_UNLEARNT = 1e-6  # of a prior's variance: of a length of which the readings say less, there is nothing to be tested


def joint_test(cost: Floats, count: float, white: Floats, spread: Floats, count_alone: int) -> Floats:
    """Probability ``(m,)`` of readings and estimates that contradict model and priors at least as much.

    Under the model the least sum of squares, residuals and unknowns in units of their errors, is chi-squared with as
    many degrees of freedom as there are readings. Geometry that is wrong, but held exact, often hides in the reference
    lengths, which are few among them all; so those are tested alone too: the covariance of their estimates is what the
    readings took off that of their prior. The smaller of both probabilities counts, times two.

    Parameters
    ----------
    cost : (m,) array
        Sum of squares at the mode.
    count : float
        Number of readings, less what unknowns without a prior take up.
    white : (m, d) array
        Mode in units of the prior, references first.
    spread : (m, d, d) array
        Posterior covariance in these units.
    count_alone : int
        Number of first unknowns that are tested alone too.
    """
    reference = white[:, :count_alone, None]
    learnt = (1.0 + _UNLEARNT) * np.eye(count_alone) - spread[:, :count_alone, :count_alone]
    moved = (reference * solve(learnt, reference)).sum((1, 2))
    least = np.minimum(chdtrc(count, np.maximum(cost, 0.0)), chdtrc(count_alone, np.maximum(moved, 0.0)))
    return np.minimum(1.0, 2.0 * least)


def chance(p: float) -> str:
    """A probability as a message has it."""
    return f"p < {_LEAST:g}" if p < _LEAST else f"p = {p:.2g}"


def unlikely(p: float) -> Notice:
    """What to say of a calibration that did not pass."""
    return Notice(
        "misfit",
        f"readings and model do not belong together ({chance(p)}): something that is taken as exact, or a stated "
        "error, is wrong; do not use these values",
    )


def unlearnt(prior_mm: float) -> Notice:
    """What to say where readings determine nothing that was not known before.

    Parameters
    ----------
    prior_mm : float
        Standard deviation of a reference length before.
    """
    return Notice(
        "prior",
        f"the readings determine no combination of points and reference lengths beyond what was known before "
        f"(references: {short(prior_mm, 3)} mm): there is nothing to set; read tensions, measured poses or more poses",
    )


def interval_about(mean: Floats, sd: Floats, half: Floats | float) -> Interval:
    """Mean, standard deviation and an interval of `half` standard deviations to either side.

    Parameters
    ----------
    mean, sd : arrays
    half : array or float
    """
    return {"mean": mean, "sd": sd, "q05": mean - half * sd, "q95": mean + half * sd}
