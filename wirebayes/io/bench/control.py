"""What was set in each hold: the displacement, as a machine does, or the tension, as weights do.

Under steps the tension relaxes while the displacement stays; under weights the displacement creeps while the tension
stays. Which of the two drifts within holds decides, in steps of the test: no scatter is taken for a drift.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import fdtrc, stdtr

from wirebayes.io.bench.undecided import Undecided
from wirebayes.numeric.typing import Floats, Ints
from wirebayes.wire.protocol import Control

Rows = Ints

BY_CHANCE = 1e-3  # that scatter alone has such a trend: files without creep are common, and then steps are the rule
BY_CHANCE_CONSTANT = 0.01  # where every hold has one tension to the last digit, which no relaxing wire has
MORE = 3.0  # times as much of a step the one that is read must drift: less may be the compliance of a frame
SEEN = 0.02  # of a step: smaller drifts of both are a machine's settling
BLOCKS = 12  # means of a hold in which a trend is looked for: noise of a drive is no independent noise
ROUNDING = 1e-6  # of what the trend explains: numbers without any noise are a computer's
MOVED = (
    0.5  # of pairs of readings in which a displacement changes, where a coarse load cell may show no change of its own
)
THIRD = 3  # the drift of a hold is from the mean of its first third to that of its last


def recognised(by_tension: Sequence[Rows], displacement: Floats, tension: Floats, is_mass: bool, place: str) -> Control:
    """What was set.

    Parameters
    ----------
    by_tension : sequence of (k,) arrays of int
        Rows of each stretch of three readings or more in which the tension stays.
    displacement, tension : (r,) array
    is_mass : bool
        Whether tensions are given as masses.
    place : str
        Where the columns stand, for the question.

    Raises
    ------
    Undecided
        Both drift alike.
    """
    if not by_tension:
        return "displacement"
    creeps = trend_by_chance(by_tension, displacement)
    relaxes = trend_by_chance(by_tension, tension)
    constant = all(np.ptp(tension[rows]) == 0.0 for rows in by_tension)
    moves = np.ptp(displacement[by_tension[0]]) > 0
    if constant and moves and (is_mass or creeps < BY_CHANCE_CONSTANT):
        return "force"
    if creeps > BY_CHANCE:
        return "displacement"
    of_displacement = drift(by_tension, displacement)
    of_tension = drift(by_tension, tension)
    if of_displacement > MORE * of_tension:
        return "force"
    if of_tension > MORE * of_displacement or relaxes > BY_CHANCE or of_displacement < SEEN:
        return "displacement"
    raise _which_was_set(place, "displacement and tension that both drift within holds")


def recognised_of_pairs(
    pairs: Sequence[Rows], displacement: Floats, tension: Floats, is_mass: bool, place: str
) -> Control:
    """What was set in a test of two readings a hold, as people write it down, which show a change and no scatter.

    Parameters
    ----------
    pairs : sequence of (k,) arrays of int
        Rows of each stretch of two readings or more in which the tension stays.
    displacement, tension, is_mass, place
        As for `recognised`.

    Raises
    ------
    Undecided
        Tensions stay to the last digit, as weights do, and are not given as masses.
    """
    stay = all(np.ptp(tension[rows]) == 0.0 for rows in pairs)
    moved = [np.ptp(displacement[rows]) > 0.0 for rows in pairs]
    if not (stay and any(moved)):
        return "displacement"
    if is_mass:
        return "force"
    if np.mean(moved) <= MOVED:
        return "displacement"
    raise _which_was_set(place, "tensions that stay within holds to the last digit, and displacements that do not")


def _which_was_set(place: str, found: str) -> Undecided:
    answers = {"--control displacement": "the displacement", "--control force": "the tension, by weights or a machine"}
    return Undecided(f"{place}: found {found}", "which was set", answers)


def trend_by_chance(groups: Sequence[Rows], values: Floats) -> float:
    """How likely readings without a trend show as much of one as these.

    Creep and relaxation are fast at first and slow down, so a trend is a straight line over the logarithm of the place
    in the hold; what is left beside it is the noise.

    Parameters
    ----------
    groups : sequence of (k,) arrays of int
        Rows of each hold.
    values : (r,) array

    Returns
    -------
    float
        The smaller probability of two tests, times two: of trends that go one way, and of any in each hold.
    """
    along, squares = [], []
    left, free = 0.0, 0
    for rows in groups:
        blocks = _block_means(values[rows])
        place = np.log1p(np.arange(len(blocks)))
        place -= place.mean()
        away = blocks - blocks.mean()
        slope = float(place @ away)
        square = float(place @ place)
        left += float(away @ away) - slope**2 / square
        free += len(blocks) - 2
        along.append(slope)
        squares.append(square)
    explained = np.array(along) ** 2 / np.array(squares)
    total = float(explained.sum())
    if total == 0.0:
        return 1.0
    variance = max(left, ROUNDING * total) / free
    error = np.sqrt(sum(squares) * variance)
    student = abs(sum(along)) / error
    one_way = 2.0 * float(stdtr(free, -student))
    fisher = explained.mean() / variance
    either = float(fdtrc(len(groups), free, fisher))
    return min(1.0, 2.0 * min(one_way, either))


def _block_means(values: Floats) -> Floats:
    """Means of neighbouring readings of a hold, of which there are no more than `BLOCKS`."""
    count = min(len(values), BLOCKS)
    return np.array([block.mean() for block in np.array_split(values, count)])


def drift(groups: Sequence[Rows], values: Floats) -> float:
    """The share of a step by which values drift in a hold, counted along the step that led to it, on average."""
    levels = np.array([np.median(values[rows]) for rows in groups])
    if len(groups) == 1:
        steps = levels
        size = abs(float(levels[0]))
    else:
        before_first = levels[0] - np.sign(levels[-1] - levels[0])
        steps = np.diff(levels, prepend=before_first)
        size = float(np.median(np.abs(steps[1:])))
    if not size:
        return 0.0
    changes = []
    for rows in groups:
        third = max(1, len(rows) // THIRD)
        begin = np.mean(values[rows[:third]])
        end = np.mean(values[rows[-third:]])
        changes.append(end - begin)
    along = np.sign(steps) * changes
    mean = float(np.mean(along))
    return abs(mean) / size
