"""Every threshold of the sampler, in the order in which they act; what a user may choose is in `Policy`."""

import numpy as np

from wirebayes.inference.optimum import LEAST_CURVATURE

# The first proposal, of the modes that a search has found.
# of the covariance at a mode: too narrow a start misses what is bent, too wide a one costs some draws
OVERDISPERSED = 1.7
LEAST_EVIDENCE = 0.05  # of the largest, that every mode counts for: its evidence is only roughly known

# Walks, while hardly a draw of the proposal would be accepted.
USEFUL = 0.05  # acceptance from which on draws of the proposal teach more than a walk
WARM = (0.5, 0.6, 0.7, 0.8)  # powers of the density that burn-in walks, the longer the more often it has to
POOL_IN_BURN_IN = 4  # steps of which one does not trust the proposal: burn-in looks for what it leaves out

# Draws of a round.
IN_FULL, LEAST_DRAWS = 4, 1024  # the round from which on there are all draws; the fewest for each mode before
TO_FIND_MORE, FEW_ROUNDS = 4, 4  # times as many draws, and rounds, where places are hard to find
HOT = 0.4  # power of the density that the wide part of the proposal is fitted to
EFFECTIVE = 0.1  # of the places that a proposal is learned from

# Fit of the proposal.
POINTS = 12000  # that settle a mixture in a handful of dimensions; more only take time
PASSING_POINTS = 4000  # for a proposal that only the next round draws from
# times as wide: a normal density to the power 0.4 is 1.6 times as wide, those of the paper's wires, with effects of
# bent tails, up to 4 times, a funnel 6 to 400 times
ELSEWHERE = 5.0
# shares of the close part, the wide one, the plain one, the start's and that of the excess; without it the others share
# all
SHARES = (0.684, 0.114, 0.114, 0.038, 0.05)
EXPLORING_SHARES = (0.44, 0.16, 0.16, 0.04, 0.2)  # while it learns: draws of the other parts teach what lies far out
ROUGH_SHARES = (0.3, 0.1, 0.1, 0.5, 0.0)  # while nothing but the start is sure

# Its map, which straightens the points.
# points a term: a usual figure for regressions; with fewer the d³/6 bends are tried one by one instead of together
POINTS_A_TERM = 20
# of the information in all points: terms that say nearly the same stay solvable, and others lose a thousandth
RIDGE = 1e-3
CLEAR = 4.0  # standard errors of a bend
FEW, MOST_PAIRS = 12, 30  # dimensions in which rough points settle no bends; bends of a coordinate in more
ALTERNATIONS = 6  # of mean and scale; the map need not be the best one, because the sampler is exact with any
SETTLED = 0.02  # root mean square change of the log scale: two in a hundred of a width are no worse a map
# normal scores of the quantiles compared, 0.3 % to 99.7 %: further out a few points decide
SCORES = np.linspace(-2.8, 2.8, 15)
# tried in steps of 0.05; finer ones would gain nothing, as the sampler is exact with any map
SKEWNESSES = np.linspace(-2.0, 2.0, 81)
RESERVE = 0.1  # against a shape that is only noise

# Its mixtures.
DEGREES = 5.0  # of freedom: heavy enough to reach every tail of a posterior, light enough to be accepted
LIGHT_DEGREES = 40.0  # where the wide mixtures look after the tails
MOST_COMPONENTS = 24  # however many modes there are
MORE_COMPONENTS = 2  # times as many for a proposal that has proved too poor: arms that hold a hundredth of the mass
EM_STEPS, EM_GAIN = 60, 4e-3  # at most; nats a point that a step has to gain, for the mixture need not be the best one

# Its part for what the others make too little of.
REMEMBERED = 50_000  # places of all rounds
TAKEN_AS_IT_IS = 1.0  # nats over the typical ratio of posterior to proposal: less holds no walker for long
TOO_FEW = 5  # places of excess: they may be chance
EXCESS_COMPONENTS, WIDER = 4, 1.5  # two necks and two tails; wide, for places seen are fewer than there are

# The end of burn-in.
GOOD_ACCEPTANCE = 0.25  # burn-in goes on below it; with a quarter accepted, independent draws are some 7 steps apart
# steps; a proposal within `Policy.tail` (1.5 nats) needs 4.5, one that was given up on gets no more than 8
LONGEST_SETTLING = 8
POOL = 64  # steps of which one does not trust the frozen proposal; more gain little

# How far a run goes on before the next look.
LEAST_AHEAD = 0.125  # of the steps kept: each look judges all draws, so that many looks cost more than a few more steps

# What the frozen proposal overlooks.
# nats a coordinate from the density at a typical place of a normal hill to its mass, where it is as wide as the prior
WIDEST = 0.5 * float(1.0 + np.log(2.0 * np.pi / LEAST_CURVATURE))
NEXT_TO_NOTHING = float(np.log(1e-3))  # share of the mass: far less than shows in any summary
LOOKED_AT = 50_000  # kept draws, of more some evenly spread: fifty of them lie beyond the 99.9 % quantile
OUTWEIGHS = float(np.log(POOL / 2))  # nats: a place worth half a pool of typical ones keeps its walker for long

# The proposal learned again from kept draws.
USUAL, SLOW, POOR = 0.6, 0.35, 0.2  # effective draws per kept evaluation
FOR_MORE, MOST_AGAIN = 3, 8  # times that it may be, for more draws and for what it overlooks
LEAST_OF, CLIMBS = 0.002, 6  # share of the kept draws that climbs begin from, and how many begin there
# standard errors between draws of two proposals: thirty numbers of which all agree exceed it in two of a thousand cases
DISAGREE = 4.0
# nats over the typical ratio of posterior to proposal: walkers seldom find such places, or stay; and how much of the
# mass, found there later, says that too little had been found before
LITTLE, MISSED = 3.0, 0.01
