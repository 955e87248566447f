"""The global test that precedes every verdict: fit, exclude gross errors, and test whether anything is missing at all.

Its p-value comes from data sets simulated at the fit and refitted. `discover` and the check at the end of every fit
both use it, so they give the same answer for the same readings.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import repeat

from numpy.random import Generator
from scipy.special import bdtr, bdtrc

from wirebayes.discovery import gross_errors, residual_patterns, screening
from wirebayes.discovery.continuation import Continuation
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.noise_integral import Expansion
from wirebayes.discovery.probes import Probe
from wirebayes.discovery.scans import Scan
from wirebayes.discovery.screening import Candidate, GlobalTest, Replicates
from wirebayes.discovery.settings import ALPHA, BY_LARGER
from wirebayes.errors import InputError
from wirebayes.inference.laplace_fit import LaplaceFit, fitted
from wirebayes.json_files.discovery import GrossError
from wirebayes.processes.workers import ParallelMap
from wirebayes.progress import Progress, silent
from wirebayes.wire.effect import Kinds

CLOSE = 0.00135  # risk on either side that a p on the level itself gives so few, or so many, exceedances
_AT_ONCE = 100  # simulations of one piece: a tenth of a second or two, beside which what is sent hardly counts
MOST_TIMES = 4  # as many simulations at most, in units of the requested number


@dataclass(frozen=True)
class Gate:
    """Fitted blocks and the global test on them.

    Attributes
    ----------
    blocks : list of LaplaceFit
        Gross errors struck out.
    struck : list of dict
        What was struck out: experiment, hold, reading, log Bayes factor.
    trials, candidates
        See `wirebayes.discovery.screening.candidate_probes`.
    patterns : list
        See `wirebayes.discovery.residual_patterns.patterns`, a block each.
    expansions, data, nulls : list of Expansion, Scan and Scan
        Of the readings, and of the simulations, a block each.
    test : GlobalTest
    """

    blocks: list[LaplaceFit]
    struck: list[GrossError]
    trials: list[Probe]
    candidates: list[Candidate]
    patterns: list[list[residual_patterns.Pattern]]
    expansions: list[Expansion]
    data: list[Scan]
    nulls: list[Scan]
    test: GlobalTest


def examine(
    blocks: Sequence[LaplaceFit],
    kinds: Kinds,
    simulations: int,
    rng: Generator,
    *,
    alpha: float = ALPHA,
    report: Progress = silent,
    parallel_map: ParallelMap = map,
) -> Gate:
    """Test whether fitted blocks leave anything unexplained.

    Parameters
    ----------
    blocks : sequence of LaplaceFit
        Fitted, with whatever effects they have already.
    kinds : mapping of name to effect class
        Which effects the test looks for, beside a smooth discrepancy.
    simulations : int
        Refitted data sets behind the p-value; half as many where they decide, up to `MOST_TIMES` as many where p is too
        close to `alpha`.
    rng : numpy Generator
    alpha : float
        The level p will be compared with.
    report : function of (what, done, total)
    parallel_map : function, optional
        The built-in `map`, or one over processes; the result is the same.

    Raises
    ------
    InputError
        If no effect could show in these holds.
    """
    blocks = list(blocks)
    trials, candidates = screening.candidate_probes(blocks, kinds)
    if not candidates:
        raise InputError("no effect of the catalogue could show in these holds; at least one must be left to look for")
    blocks, struck = _without_gross_errors(blocks, trials, candidates, rng)
    patterns, expansions = _expanded(blocks, trials)
    data = [scan(x) for x in expansions]
    simulated: list[Replicates] = []
    larger: Continuation | None = None
    while True:
        report("simulations", len(simulated), len(blocks))
        made = len(simulated[0].z) if simulated else 0
        total = _next_total(made, simulations)
        simulated = with_more(simulated, blocks, trials, total - made, rng, parallel_map)
        nulls = [s.scan for s in simulated]
        test = screening.global_test(candidates, data, nulls)
        by_larger = 1.0
        if _larger_effects_could_decide(test, alpha):
            report("larger effects", 0, 1)
            larger = larger or Continuation(blocks, trials, candidates, data, parallel_map)
            test = larger.test(simulated, test)
            by_larger = larger.p
            report("larger effects", 1, 1)
        if not is_open(test, alpha, by_larger, total, simulations):
            break
    report("simulations", len(blocks), len(blocks))
    return Gate(blocks, struck, trials, candidates, patterns, expansions, data, nulls, test)


def _expanded(
    blocks: Sequence[LaplaceFit], trials: Sequence[Probe]
) -> tuple[list[list[residual_patterns.Pattern]], list[Expansion]]:
    """The patterns of each block that the residuals may have, and it linearised with these and all probes."""
    patterns = []
    expansions = []
    for block in blocks:
        listed, columns = residual_patterns.patterns(block.target.problem)
        patterns.append(listed)
        expansions.append(expand(block.target, block.z, trials, columns=columns))
    return patterns, expansions


def _larger_effects_could_decide(test: GlobalTest, alpha: float) -> bool:
    """They only make p smaller: nothing is gained where it can be no smaller, or is below the level beyond doubt."""
    could_be_smaller = test.p > 1.0 / (1 + len(test.null))
    return could_be_smaller and (test.p > alpha or is_close(test.p, alpha, len(test.null)))


def _next_total(made: int, simulations: int) -> int:
    """How many simulations the next look has: half of those asked for, which decide most tests, all, then doubled."""
    if not made:
        return (simulations + 1) // 2
    return simulations if made < simulations else 2 * made


def is_open(test: GlobalTest, alpha: float, by_larger: float, made: int, simulations: int) -> bool:
    """Whether more simulations are to be made: where p is close to the level, or larger effects count, or nearly do.

    How surprising a value along a path is, is read off the simulations' tail, which half of them may not have shown:
    until all are made it decides nothing.

    Parameters
    ----------
    test : GlobalTest
    alpha : float
        The level.
    by_larger : float
        p as the paths to larger effects have it, which counts up to `BY_LARGER`; 1 where they were not asked.
    made, simulations : int
        How many there are, and how many were asked for.
    """
    if made >= MOST_TIMES * simulations:
        return False
    trials = len(test.null)
    may_count = by_larger <= BY_LARGER or is_close(by_larger, BY_LARGER, trials)
    return is_close(test.p, alpha, trials) or (made < simulations and may_count)


def is_close(p: float, alpha: float, simulations: int) -> bool:
    """Whether a p-value from so many simulations is too close to a level to say on which side it is.

    Parameters
    ----------
    p : float
        As the test reported it: one more than the simulations at least as surprising, over one more than all.
    alpha : float
        The level.
    simulations : int
    """
    larger = round(p * (1 + simulations)) - 1
    at_most = bdtr(larger, simulations, alpha)
    at_least = bdtrc(larger - 1, simulations, alpha) if larger > 0 else 1.0
    return bool(min(at_most, at_least) > CLOSE)


def simulated_with_patterns(block: LaplaceFit, trials: Sequence[Probe], n: int, rng: Generator) -> Replicates:
    """Data sets simulated at a block's fit and refitted, scanned for probes and for residual patterns.

    Parameters
    ----------
    block : LaplaceFit
    trials : sequence of Probe
    n : int
        Number of data sets.
    rng : numpy.random.Generator

    Returns
    -------
    Replicates
        Its scan has the probes first and the residual patterns behind them.
    """
    return screening.replicated(block, trials, n, rng, residual_patterns.patterns(block.target.problem)[1])


def with_more(
    simulated: Sequence[Replicates],
    blocks: Sequence[LaplaceFit],
    trials: Sequence[Probe],
    n: int,
    rng: Generator,
    parallel_map: ParallelMap,
) -> list[Replicates]:
    """What was simulated for each block, with more data sets (see `simulated_with_patterns`).

    Parameters
    ----------
    simulated : sequence of Replicates
        One a block; empty where nothing was simulated yet.
    blocks, trials, rng
        As for `simulated_with_patterns`; every block has a generator of its own.
    n : int
        How many more.
    parallel_map : function
        The built-in `map`, or one over processes.

    Returns
    -------
    list of Replicates
    """
    sizes = _pieces(n)
    each_block = [block for block in blocks for _ in sizes]
    each_size = sizes * len(blocks)
    generators = rng.spawn(len(each_block))
    pieces = list(parallel_map(simulated_with_patterns, each_block, repeat(trials), each_size, generators))
    out = []
    for i in range(len(blocks)):
        own = pieces[i * len(sizes) : (i + 1) * len(sizes)]
        more = screening.joined_replicates(own)
        earlier = [simulated[i]] if simulated else []
        out.append(screening.joined_replicates([*earlier, more]))
    return out


def _pieces(n: int) -> list[int]:
    """Sizes of nearly equal pieces of n simulations, which processes share: as many whatever the number of cores."""
    count = max(1, -(-n // _AT_ONCE))
    return [n // count + (number < n % count) for number in range(count)]


def _without_gross_errors(
    blocks: Sequence[LaplaceFit], trials: list[Probe], candidates: list[Candidate], rng: Generator
) -> tuple[list[LaplaceFit], list[GrossError]]:
    """The blocks refitted without their gross errors, and these."""
    refitted = []
    struck = []
    for i, block in enumerate(blocks):
        kept, gone = _strike_gross_errors(block, trials, candidates, i, rng)
        refitted.append(kept)
        struck += gone
    return refitted, struck


def _strike_gross_errors(
    block: LaplaceFit, trials: list[Probe], candidates: list[Candidate], i: int, rng: Generator
) -> tuple[LaplaceFit, list[GrossError]]:
    """The block refitted without its gross errors, and these; `i` is its number among all."""
    own = [c.probe for c in candidates if i in c.blocks]
    struck: list[GrossError] = []
    share = gross_errors.MOST * gross_errors.readings_of(block.experiments)
    most = max(1, int(share))
    while len(struck) < most:
        rival = _best_rival(block, trials, own)
        found = gross_errors.suspect(block, rival)
        if found is None:
            break
        name, hold, place, value = found
        block = _refitted_without(block, name, hold, place, rng)
        gone = [one["reading"] for one in struck if one["experiment"] == name and one["hold"] == hold]
        reading = gross_errors.place_in_file(place, gone)
        struck.append({"experiment": name, "hold": hold, "reading": reading, "log_bayes": value})
    return block, struck


def _refitted_without(block: LaplaceFit, name: str, hold: int, reading: int, rng: Generator) -> LaplaceFit:
    """The block without one reading of an experiment."""
    members = [gross_errors.without(e, hold, reading) if e.name == name else e for e in block.experiments]
    return fitted(members, block.effects, block.spec, rng, scales=block.scales)


def _best_rival(block: LaplaceFit, trials: list[Probe], own: Sequence[int]) -> float:
    """Log Bayes factor of the best effect, by the probes of some numbers, or of a smooth remainder, if larger."""
    here = scan(expand(block.target, block.z, trials))
    by_effect = max((float(here.effects[0, k]) for k in own), default=0.0)
    return max(by_effect, float(here.flexible[0]))
