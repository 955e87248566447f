"""Whether a calibration's residuals, and its estimates against their priors, are as large as they should be."""

from collections.abc import Sequence

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


def joint_test(cost: Floats, count: float, white: Floats, spread: Floats, alone: Sequence[slice]) -> Floats:
    """Probability ``(m,)`` of readings and estimates that contradict model and priors at least as much.

    Under the model the least sum of squares, residuals and unknowns in units of their errors, is chi-squared with as
    many degrees of freedom as there are readings. Geometry that is wrong, but held exact, often hides in the reference
    lengths, and a stiffness that is wrong in the wires' deviations from their line. Both are few among them all; so
    each is tested alone too (`beyond_prior`). The smallest of the probabilities counts, times how many there are.

    Parameters
    ----------
    cost : (m,) array
        Sum of squares at the mode.
    count : float
        Number of readings, less what unknowns without a prior take up.
    white : (m, d) array
        Mode in units of the prior.
    spread : (m, d, d) array
        Posterior covariance in these units.
    alone : sequence of slice
        Unknowns that are tested alone too.
    """
    tests = [chdtrc(count, np.maximum(cost, 0.0))]
    for part in alone:
        moved = beyond_prior(white[:, part], spread[:, part, part])
        tests.append(chdtrc(part.stop - part.start, moved))
    return np.minimum(1.0, len(tests) * np.min(tests, axis=0))


def beyond_prior(white: Floats, spread: Floats) -> Floats:
    """Squared distance ``(m,)`` of estimates from their prior mean, in standard deviations that they have by chance.

    The covariance of estimates about the prior's mean is what the readings took off that of the prior. So much, too,
    would the sum of squares fall if nothing had been known of them.

    Parameters
    ----------
    white : (m, d) array
        In units of the prior.
    spread : (m, d, d) array
        Posterior covariance in these units.
    """
    estimate = white[..., None]
    learnt = (1.0 + _UNLEARNT) * np.eye(white.shape[1]) - spread
    moved = (estimate * solve(learnt, estimate)).sum((1, 2))
    return np.asarray(np.maximum(moved, 0.0))


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
