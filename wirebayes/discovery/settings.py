"""The settings of a search for the missing effect, and every threshold behind its verdict.

docs/thresholds.rst says how each number was set.
"""

from dataclasses import dataclass, field

from wirebayes.effects import CATALOGUE
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.wire.effect import Kinds

ALPHA = 0.04  # level of the global test: one clean file in twenty-five is called incomplete
BY_LARGER = 0.02  # p up to which what only larger effects show counts
SIMULATIONS = 999  # half of them where these decide, more where p is close to the level
# How surprising a value of a name is, from simulations.
UPPER = 0.2  # share of them that a line is fitted to
ONE_NAT = 100.0  # of these that the prior of its slope is worth, one nat to a factor of e
ABOVE_COUNT = 1.0  # nats that the line may lie above the count, as where one exceeds a value that three should

# Prior over models. A single family of effects has weight 1, which its members share.
UNKNOWN_WEIGHT = 1.0  # a remainder and no effect, to one family: a person who finds a gap is as ready for either
# One thing more than what is missing already, to nothing more: all further families together, or a remainder.
MORE = 0.5
# Lengths of a remainder's processes, in steps of three: neighbours explain nearly the same.
HOLD_LENGTHS = (1.5, 4.0, 10.0)  # holds: from what one shares with the next to the whole test
TIME_LENGTHS = (0.7, 2.0, 50.0)  # of the logarithm of time: from a part of a hold to all of it

# Which sets are looked at.
MOST_EFFECTS = 4  # more than four did not pay in any simulated test
REACH = 4.0  # nats below the best: a set further down holds less than 2 % of its weight
WORTH_A_REFIT = 1.3  # log Bayes factor by the linear scan, of an effect beside others
WORTH_ADDING = 2.0  # the same, refitted
SAME_EVIDENCE = 0.3  # nats by which two orders of refits may differ where both found the best parameters
# Nats by which a set's own fit, a normal approximation, may fall short of the refits that led to it: with a skew
# amplitude it does by 2 at most, and at a kink of its density by 10.
FALLS_SHORT = 2.0
MOST_BESIDE = 6  # effects refitted beside a set: what it leaves over is small, and the linear scan nearly right
FIRST_LOOK, MOST_LOOKS = 3, 7  # sets fitted in full: at first, and in all

# A remainder that is not smooth, seen by what further effects, or the global test, find beside an effect.
LEFT_OVER = 8.0  # nats: the most that a further effect may explain of what one unknown form leaves over beside a name
LEFT_OVER_WEIGHT = 0.1  # of such a remainder, to a further effect
RETESTS = 299  # simulations of the second global test
ALPHA_AFTER = 0.03  # its p at which a remainder is as likely as none
# nats below the best set, and sets, among which one that passes that test is looked for
GIVE_WAY, MOST_RETESTS = 2.0, 4
P_SLOPE = 0.8  # below it the odds grow as p to the power -0.8, the density of p where more is missing than was added

# What may be called established.
KEEP_ELPD = 4.0  # gain of leaving out one hold at a time that an effect must bring
LEAST_HOLDS = 3  # of a test, below which leaving one out, or predicting the last from the others, says nothing
INCLUSION = 0.9  # probability that one of a family is missing
REMAINS = 0.5  # probability of a remainder from which the verdict says so
IN_FAMILY = 0.9  # of a family's probability, that one of its members must have to be its name
IN_SET = 0.9  # probability that the set of possible names holds together
LEAST_ALTERNATIVE = 0.05  # probability below which a model's remainder, or its part in a family's gain, is not asked
MIXED = 0.99  # of the probability of undecided models that those in the predictions hold: quantiles move by .01 at most


@dataclass(frozen=True)
class Settings:
    """The settings of a search.

    Attributes
    ----------
    spec : ModelSpec
        The plain model.
    kinds : mapping of name to effect class
        The effects searched.
    simulations : int
        Refitted data sets behind the p-value: half of them where these decide, more where it is too close to the level.
    """

    spec: ModelSpec = PLAIN_SPEC
    kinds: Kinds = field(default_factory=lambda: CATALOGUE)
    simulations: int = SIMULATIONS
