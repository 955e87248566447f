"""Is what a continuous recording teaches true? Recorded tests with known truth, imported and fitted.

Wires like the paper's on benches of their own: 1 to 20 readings a second, moves at 0.1 to 5 mm/s that are steady,
settle slowly at their end or are jumps, noise in both channels, one test in two with a way back. The wire creeps while
it moves: each small part of a move is followed by its part of the hold's creep. Posteriors are those of a short run of
the sampler.

    python -m analyses.field.recordings [--tests 60] [--seed 1]
"""

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy import stats

from analyses.options import study_options
from wirebayes.inference.fit import seed_of
from wirebayes.inference.laplace_fit import fitted
from wirebayes.inference.rough_draws import draws
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import Converted, convert
from wirebayes.io.bench.undecided import Choices
from wirebayes.model.scales import NATURAL
from wirebayes.model.spec import PLAIN_SPEC
from wirebayes.numeric.typing import Floats
from wirebayes.processes.workers import workers
from wirebayes.wire.laws import LAWS, creep_fraction, creep_target

WIRES = {
    "k1": stats.lognorm(0.5, scale=900.0),
    "B": stats.lognorm(0.5, scale=0.3),
    "U": stats.lognorm(0.3, scale=0.6),
    "k2": stats.lognorm(0.5, scale=0.03),
    "N": stats.lognorm(0.25, scale=0.65),
    "preload": stats.norm(0.5, 0.2),
    "sensor_sd": stats.lognorm(0.4, scale=0.015),
    "setting_sd": stats.lognorm(0.5, scale=0.015),
}
PARTS = 400  # of a move
SHAPES: dict[str, Callable[[Floats], Floats]] = {  # when a share of a move is done, in times that a steady one takes
    "steady": lambda share: share,
    "settling": lambda share: -0.3 * np.log1p(-share),
    "jump": lambda share: 0.0 * share,
}


@dataclass(frozen=True)
class Drive:
    """How a bench moves and records: readings a second, mm/s, seconds, mm."""

    rate: float = 10.0
    speed: float = 0.5
    shape: str = "steady"
    lasts: float = 120.0
    noise_mm: float = 0.005
    before: float = 2.0


def record(
    wire: dict[str, float], length_mm: float, levels_mm: list[float], drive: Drive, rng: np.random.Generator
) -> tuple[Floats, Floats, Floats]:
    """Times, displacements and tensions of a whole test."""
    share = (np.arange(PARTS) + 0.5) / PARTS
    moves = np.abs(np.diff(levels_mm, prepend=0.0)) / drive.speed
    starts = drive.before + np.concatenate([[0.0], np.cumsum(moves + drive.lasts)])
    time = np.arange(rng.uniform(0.0, 1.0 / drive.rate), starts[-1], 1.0 / drive.rate)
    k2, N = np.array(wire["k2"]), np.array(wire["N"])
    base, creep, place, there = length_mm + wire["preload"], 0.0, 0.0, 0.0
    x, stretch, crept = np.zeros_like(time), np.zeros_like(time), np.zeros_like(time)
    for j, (level, move) in enumerate(zip(levels_mm, moves, strict=True)):
        parts = starts[j] + move * SHAPES[drive.shape](share)
        now = (time >= starts[j]) & (time < starts[j + 1])
        done = np.searchsorted(parts, time[now], "right") / PARTS
        setting = level + rng.normal(0.0, wire["setting_sd"])
        x[now], stretch[now] = there + done * (level - there), place + done * (setting - place)
        tension = wire["k1"] * LAWS["hooke"].strain(np.array(base + setting), np.array(length_mm + creep))
        amount = creep_target(np.maximum(tension, 0.0), np.array(wire["B"]), np.array(wire["U"])) - creep

        def at(t: Floats, parts: Floats = parts, k2: Floats = k2, N: Floats = N) -> Floats:
            since = t[:, None] - parts
            return np.asarray(np.where(since > 0, creep_fraction(np.maximum(since, 0.0), k2, N), 0.0).mean(axis=1))

        crept[now] = creep + amount * at(time[now])
        creep += float(amount) * float(at(starts[j + 1 : j + 2])[0])
        place, there = setting, level
    tension = wire["k1"] * np.maximum(LAWS["hooke"].strain(base + stretch, length_mm + crept), 0.0)
    measured = x + rng.normal(0.0, drive.noise_mm, len(x)) if drive.noise_mm else x
    return time, measured, tension + rng.normal(0.0, wire["sensor_sd"], len(x))


def imported(folder: Path, recorded: tuple[Floats, Floats, Floats], length_mm: float) -> Converted:
    """What `wirebayes import` makes of a recording."""
    path = folder / "recording.csv"
    rows = (f"{t:.3f},{x:.4f},{f:.4f}\n" for t, x, f in zip(*recorded, strict=True))
    path.write_text('"Time (s)","Displacement (mm)","Force (N)"\n' + "".join(rows))
    (only,) = convert(path, About("wire", "line", length_mm), Choices())
    return only


def invented(rng: np.random.Generator) -> tuple[dict[str, float], float, list[float], Drive]:
    """A wire, its length, where it is held, and the bench."""
    wire = {name: float(distribution.rvs(random_state=rng)) for name, distribution in WIRES.items()}
    levels = [*range(1, 11), *(8, 6, 4)] if rng.uniform() < 0.5 else [*range(1, 13)]
    drive = Drive(
        rate=float(np.exp(rng.uniform(np.log(1.0), np.log(20.0)))),
        speed=float(np.exp(rng.uniform(np.log(0.1), np.log(5.0)))),
        shape=str(rng.choice(list(SHAPES))),
        lasts=float(rng.uniform(60.0, 180.0)),
        noise_mm=float(rng.choice([0.0, 0.002, 0.01])),
    )
    return wire, float(rng.uniform(800.0, 2000.0)), [float(level) for level in levels], drive


def one(job: tuple[int, int]) -> dict[str, tuple[float, float]] | None:
    """Of one recording: each parameter's error in posterior standard deviations, and the truth's rank."""
    seed, number = job
    rng = np.random.default_rng(seed_of(seed, "recording", str(number)))
    wire, length_mm, levels, drive = invented(rng)
    with tempfile.TemporaryDirectory() as folder:
        experiment = imported(Path(folder), record(wire, length_mm, levels, drive, rng), length_mm).experiment
    if len(experiment.holds) != len(levels):
        return None
    found = fitted([experiment], (), PLAIN_SPEC, rng)
    problem = found.target.problem
    theta = problem.theta_in(NATURAL, draws(found.target, found.modes, rng, 2000))
    columns = dict(zip(problem.names, theta.T, strict=True))
    return {n: (float((v.mean() - wire[n]) / v.std()), float((v < wire[n]).mean())) for n, v in columns.items()}


def main() -> None:
    options = study_options(__doc__, tests=60, seed=1).parse_args()
    with workers() as parallel_map:
        results = list(parallel_map(one, [(options.seed, number) for number in range(options.tests)]))
    whole = [result for result in results if result is not None]
    print(f"{options.tests} recordings, all holds found in {len(whole)}")
    for name in WIRES:
        error, rank = np.array([result[name] for result in whole]).T
        inside = int(((rank > 0.05) & (rank < 0.95)).sum())
        mean, se = error.mean(), error.std(ddof=1) / np.sqrt(len(error))
        print(f"{name:10} inside the 90 % interval {inside:3}, mean error {mean:+.2f} ± {se:.2f} posterior sd")


if __name__ == "__main__":
    main()
