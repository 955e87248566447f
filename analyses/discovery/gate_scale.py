"""How much does the p of the global test depend on which simulations were drawn, and on how surprises are read off?

A few files are simulated 8,000 times at their fits. From these, lots of 499 and of 999 are drawn again and again, and
the test is made with each: its p in the mean, the standard deviation of the logarithm of p, and how often other
simulations, taken for readings, have p <= 0.04. Each for several ways to read off how surprising a value is.

    python -m analyses.discovery.gate_scale --cases 0 3 11
"""

from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

import numpy as np
from scipy import stats

from analyses.options import study_options
from analyses.speed.checkouts import benchmark_files
from analyses.speed.gate_cost import experiments_of, plain_fits
from wirebayes.discovery import screening, surprise
from wirebayes.discovery.linear_scan import expand, scan
from wirebayes.discovery.settings import ABOVE_COUNT, ALPHA, ONE_NAT, UPPER
from wirebayes.effects import CATALOGUE
from wirebayes.numeric.typing import Array

ALL, LOTS, TRIED = 8000, 60, 500
WAYS = {
    "as it is": (UPPER, ONE_NAT, ABOVE_COUNT),
    "a tenth": (0.1, ONE_NAT, ABOVE_COUNT),
    "free slopes": (UPPER, 1e-6, ABOVE_COUNT),
    "half a nat above the count": (UPPER, ONE_NAT, 0.5),
    "no limit": (UPPER, ONE_NAT, 1e9),
}


def values(case: str, seed: int) -> tuple[dict[str, Array], dict[str, Array]]:
    """Each name's log Bayes factor in the readings (1,) of a file, and in the simulations (n,)."""
    blocks, rng = plain_fits(experiments_of(case), seed)
    trials, candidates = screening.candidate_probes(blocks, CATALOGUE)
    data = [scan(expand(b.target, b.z, trials)) for b in blocks]
    null = [screening.replicated(b, trials, ALL, rng).scan for b in blocks]
    return screening.by_name(candidates, data), screening.by_name(candidates, null)


def by_counting(data: dict[str, Array], chance: dict[str, Array]) -> float:
    """p where all simulations are counted, as often as a value is exceeded."""
    null = [np.log(len(v)) - np.log(stats.rankdata(-v, method="max")) for v in chance.values()]
    found = max(float(surprise.empirical_surprise(data[name][0], v)) for name, v in chance.items())
    return float((1 + (np.max(null, axis=0) >= found).sum()) / (1 + len(null[0])))


def spread(data: dict[str, Array], chance: dict[str, Array], lot: int, way: str) -> tuple[list[float], float]:
    """p of the readings with each lot of simulations, and the share of others with p up to the level."""
    rng, found, low = np.random.default_rng(0), [], []
    for _ in range(LOTS):
        order = rng.permutation(ALL)
        drawn = {name: v[order[:lot]] for name, v in chance.items()}
        if way == "counted":
            found.append(by_counting(data, drawn))
            continue
        test = screening.global_test([], data, drawn)  # type: ignore[arg-type]
        found.append(test.p)
        others = [test.scales[name].surprise(v[order[lot : lot + TRIED]]) for name, v in chance.items()]
        as_surprising = len(test.null) - np.searchsorted(np.sort(test.null), np.max(others, axis=0))
        low.append(float(((1 + as_surprising) / (1 + len(test.null)) <= ALPHA).mean()))
    return found, float(np.mean(low)) if low else float("nan")


def main() -> None:
    """Print a line for each file, lot and way."""
    parser = study_options(__doc__)
    parser.add_argument("--cases", nargs="+", type=int, default=[0, 3, 11], help="of the benchmark of hidden effects")
    options = parser.parse_args()
    with TemporaryDirectory() as folder:
        found = {name: values(*case) for name, case in benchmark_files(options.cases, Path(folder)).items()}
    for name, (data, chance) in found.items():
        for lot in (499, 999):
            for way in ("counted", *WAYS):
                upper, one_nat, above = WAYS.get(way, WAYS["as it is"])
                with (
                    patch.multiple(surprise, UPPER=upper, ONE_NAT=one_nat, ABOVE_COUNT=above),
                    patch.object(screening, "by_name", lambda candidates, scans: scans),
                ):
                    p, low = spread(data, chance, lot, way)
                print(
                    f"{name:13s} {lot} simulations, {way:26s}: p {np.mean(p):.4f}, "
                    f"sd of log p {np.std(np.log(p)):.2f}, others with p <= {ALPHA}: {100 * low:.1f} %",
                    flush=True,
                )


if __name__ == "__main__":
    main()
