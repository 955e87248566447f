"""Is every number that a user reads after a test true? From invented bench tests to a robot, with known truth.

Each test is a wire of its own with one or two hidden effects, on a bench of its own: odd reading times, uneven steps,
one in two with unloading. All holds but the last three are given to

- `fit` with the true effects (the oracle), and `discover`, whose final model is scored where it accepted just those;
- the figures derived from each posterior, `predict` for the last three holds, `export`'s creep table, and the drift
  of a robot (`pose`): 90 % intervals against the simulated truth, and widths beside the oracle's;
- the plain fit's model check: no figure of a wrong model without the warning (where there is none, its figures are
  scored too).

Coverage is averaged within a test first, so its interval is that of independent tests.

    python -m analyses.field.bench_to_robot --tests 100 --output out/bench-to-robot
"""

import json
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from analyses.hidden_effects.truth import draw_wire
from analyses.options import study_options
from analyses.resumable import records
from analyses.robots.bands import at_tension, mean_share
from wirebayes.commands.wire_draws import wire_draws
from wirebayes.discovery.investigation import final_models
from wirebayes.discovery.search import investigate
from wirebayes.discovery.settings import ALPHA, Settings
from wirebayes.effects import CATALOGUE
from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.inference.policy import Policy
from wirebayes.io.experiment import Experiment
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.readings import protocol_table
from wirebayes.io.run_folder import write_csv
from wirebayes.json_files.summary import CREEP_TIMES_S
from wirebayes.prediction.mixture import drawn_readings
from wirebayes.prediction.request import request_of
from wirebayes.prediction.table import mixture_table
from wirebayes.results.jobs import Job, one
from wirebayes.results.read_back import Stored, load_posterior
from wirebayes.robot.export import files
from wirebayes.robot.mechanics import schema
from wirebayes.robot.mechanics.draws import WireDraws, for_robot
from wirebayes.robot.motion import claim
from wirebayes.simulation.synthetic import Bench, Simulated, Truth, draw, write_tests
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.wire.fresh import FreshSample
from wirebayes.wire.model import Model
from wirebayes.wire.staircase import simulate

POLICY = Policy(walkers=64, round_draws=2048, ess=1000.0)
SIMULATIONS = 199  # behind p, here; the command makes 999
LATER = 3  # holds that are predicted
TIMES_S = (600.0, 86400.0)
VISIBLE = (10.0, 100.0)  # δ of every effect: smaller ones cannot be seen, larger ones nobody overlooks
KINDS = ("derived", "predict", "export", "pose")
DRAWS = 1000


def bench(rng: np.random.Generator) -> Bench:
    """A test of its own: 0.5 to 3 m, 11 to 16 holds, steps and times of its own, one in two with a way back."""
    length = round(float(rng.uniform(500.0, 3000.0)), 0)
    count = int(rng.integers(11, 17))
    steps = rng.uniform(0.4, 1.8, count)
    if rng.uniform() < 0.5:
        turn = int(rng.integers(count // 2, count - 2))
        steps[turn:] *= -0.5
    readings = int(rng.integers(4, 10))
    times = np.concatenate([[0.0], np.cumsum(rng.uniform(3.0, 90.0, readings))]).round(1)
    resolution = float(rng.choice([0.01, 0.001]))
    return Bench("wire", "line", length, resolution, tuple(np.cumsum(steps).round(2).tolist()), tuple(times.tolist()))


def amplitude(effect: Effect, rng: np.random.Generator) -> dict[str, float]:
    """Amplitudes from the middle of their priors."""
    return {
        column: float(a.prior.ppf(rng.uniform(0.2, 0.95)))
        for column, a in zip(effect.columns(), effect.amplitudes, strict=True)
    }


def invent(index: int) -> tuple[Bench, Truth, int, Simulated]:
    """Bench, truth, seed and the simulated test of a number."""
    rng = np.random.default_rng(seed_of(7, "bench to robot", str(index)))
    while True:
        made = bench(rng)
        protocol = made.experiment().protocol()
        kinds = [k for k in CATALOGUE.values() if not issubclass(k, EventEffect)]
        forms = [form for kind in kinds for form in kind.variants([protocol])]
        picked = rng.choice(len(forms), int(rng.integers(1, 3)), replace=False)
        effects = tuple(forms[i] for i in picked)
        wire = draw_wire(rng, made.length_mm)
        values = {"k1": wire.k1, "B": wire.B, "U": wire.U, "k2": wire.k2, "N": wire.N}
        top = wire.k1 * max(made.displacements_mm) / made.length_mm
        values |= {"preload": float(rng.uniform(0.1, 1.0)), "setting_sd": float(np.exp(rng.uniform(-6.0, -3.5)))}
        values["sensor_sd"] = float(np.clip(top * np.exp(rng.uniform(-7.5, -6.0)), 0.003, 0.04))
        for effect in effects:
            values |= amplitude(effect, rng)
        truth, seed = Truth(values, effects), int(rng.integers(2**31))
        try:
            simulated = draw([made], truth, seed)
        except InputError:  # a constant that no fit of such a protocol may have, as a period longer than it
            continue
        if is_sound(simulated):
            return made, truth, seed, simulated


def is_sound(simulated: Simulated) -> bool:
    """Taut throughout, tensions of a bench, most of the stretch elastic, and every effect neither absent nor absurd."""
    sample = simulated.problem.samples[0]
    mask, readings = sample.protocol.mask, sample.readings[..., 0]
    if readings[mask].min() < 0.1 or not 1.0 < readings[mask].max() < 100.0:
        return False
    if (readings[:, mask.sum(axis=1)[0] - 1] < 0.5 * readings[:, 0]).any():
        return False
    return all(VISIBLE[0] < delta(simulated, effect) < VISIBLE[1] for effect in sample.model.effects)


def delta(simulated: Simulated, effect: Effect) -> float:
    """Length of what an effect adds to the readings, whitened, less what the plain parameters could absorb."""
    sample = simulated.problem.samples[0]
    own, mask = simulated.problem.parameters(simulated.theta, sample), sample.protocol.mask
    fewer = replace(sample.model, effects=tuple(e for e in sample.model.effects if e is not effect))

    def readings(model: Model, changed: dict[str, Any], setting_mm: Any = None) -> Any:
        return simulate(sample.protocol, own | changed, model, setting_mm)[..., 0][mask]

    def slope(change: Any, step: float) -> Any:
        return (change(step) - change(-step)) / (2.0 * step)

    shift = np.eye(len(mask))[..., None]
    by_setting = [slope(lambda h, j=j: readings(fewer, {}, h * shift[j]), 1e-4) for j in range(len(mask))]
    variance = own["sensor_sd"][0] ** 2 + sample.resolution**2 / 12.0
    jacobian = np.array(by_setting).T * own["setting_sd"][0]
    whiten = np.linalg.inv(np.linalg.cholesky(variance * np.eye(len(jacobian)) + jacobian @ jacobian.T))
    by_parameter = [
        slope(lambda h, name=name: readings(fewer, {name: own[name] + h}), 1e-5 * max(abs(own[name][0]), 0.1))
        for name in ("k1", "B", "U", "k2", "N", "preload")
    ]
    absorbed = np.linalg.qr(whiten @ np.array(by_parameter).T)[0]
    added = whiten @ (readings(sample.model, {}) - readings(fewer, {}))
    return float(np.linalg.norm(added - absorbed @ (absorbed.T @ added)))


def fitted(experiment: Experiment, keys: tuple[str, ...], near: dict[str, float] | None, seed: int) -> tuple[Any, bool]:
    """The stored posterior, and whether its fit converged."""
    with TemporaryDirectory() as folder:
        job = Job("fit", (experiment,), keys, near=near)
        one(job, Path(folder), seed, POLICY)
        summary = json.loads((Path(folder) / "fit" / "summary.json").read_text())
        return load_posterior(Path(folder) / "fit"), bool(summary["converged"])


def true_line(simulated: Simulated, training: Stored) -> WireDraws:
    """The true wire as one draw, in the terms of a fit's draws."""
    sample = simulated.problem.samples[0]
    own = simulated.problem.parameters(simulated.theta, sample)
    line = wire_draws(training, 1)
    model = sample.model
    return replace(
        line, parameters=dict(own), effects=model.effects, tension_ref_N=model.tension_ref_N, typical=model.typical
    )


def figures(stored: Stored, simulated: Simulated, folder: Path) -> list[dict[str, Any]]:
    """Every figure: its kind, name, truth and 90 % interval."""
    out: list[dict[str, Any]] = []
    sample, truth = stored.sample, simulated.problem.samples[0]
    own = simulated.problem.parameters(simulated.theta, truth)
    length, tension = sample.protocol.length_mm, sample.model.tension_ref_N

    def add(kind: str, name: str, true: float, low: float, high: float) -> None:
        out.append({"kind": kind, "name": name, "truth": true, "q05": low, "q95": high})

    wires = [FreshSample(stored.draws, sample.model, length), FreshSample(own, truth.model, length)]
    times = np.array(list(CREEP_TIMES_S.values()))
    believed, true = (w.creep_mm(tension, times) for w in wires)
    for name, row, value in zip(CREEP_TIMES_S, believed, true[:, 0], strict=True):
        add("derived", name, float(value), *map(float, np.quantile(row, [0.05, 0.95])))
    stiff, value = (w.stiffness_N(tension) for w in wires)
    add("derived", "stiffness_N", float(value[0]), *map(float, np.quantile(stiff, [0.05, 0.95])))

    request = request_of(protocol_table(folder / "later.csv"), stored)
    rows = mixture_table(drawn_readings([(1.0, request)]), request)
    measured = truth.readings[-LATER:, :, 0][truth.protocol.mask[-LATER:]]
    for row, reading in zip(rows, measured, strict=True):
        add("predict", f"hold {row[1]}", float(reading), row[6], row[8])

    line, real = wire_draws(stored, DRAWS), true_line(simulated, stored)
    robot = schema.read_robot_file("hangprinter-4")
    low, high = line.tension_range_N or (1.0, 1.0)
    loads = [float(np.sqrt(low * high)), high]
    tables = [files.creep_table(robot, line, loads, TIMES_S), files.creep_table(robot, real, loads, TIMES_S)]
    for row, exact in zip(*tables, strict=True):
        add("export", f"{row[1]:g} s", exact[5], row[4], row[6])

    robot = at_tension(schema.read_robot_file("linear-7"), float(np.sqrt(low * high)))
    for time in (60.0, 600.0, 3600.0):
        drift = [claim.over_workspace(robot, for_robot(robot, w), robot.home_m[None], time) for w in (line, real)]
        believed, true = (1e3 * d.distance_m[0] for d in drift)
        add("pose", f"{time:g} s", float(true[0]), *map(float, np.nanquantile(believed, [0.05, 0.95])))
    return out


def case(index: int) -> dict[str, Any]:
    """One test through everything."""
    made, truth, seed, simulated = invent(index)
    keys = tuple(e.key for e in truth.effects)
    with TemporaryDirectory() as place:
        folder = Path(place)
        write_tests(folder, [made], truth, seed)
        (whole,) = read_experiments(folder / "experiments.toml")
        training = whole.train(len(whole.holds) - LATER)
        rows = [[h.number, h.displacement_mm, t] for h in whole.holds[-LATER:] for t in h.time_s]
        write_csv(folder / "later.csv", ["hold", "displacement_mm", "time_s"], rows)
        oracle, converged = fitted(training, keys, None, index)
        out: dict[str, Any] = {"index": index, "effects": keys, "oracle_converged": converged}
        out["oracle"] = figures(oracle, simulated, folder)
        found = investigate([training], Settings(simulations=SIMULATIONS), index)
        report = found.report["experiments"]["wire"]
        accepted = set(report["accepted"])
        out |= {
            "verdict": report["verdict"],
            "accepted": sorted(accepted),
            "p": report["p_global"],
            "set": report["set"],
        }
        out["right"] = accepted == {key.split("@")[0] for key in keys}
        if report["p_global"] > ALPHA:
            plain, _ = fitted(training, (), None, index)
            out["unwarned"] = figures(plain, simulated, folder)
        if out["right"]:
            (model,) = final_models(found)
            final, out["final_converged"] = fitted(
                model.experiments[0], tuple(e.key for e in model.effects), model.near, index
            )
            out["final"] = figures(final, simulated, folder)
    return out


def coverage(tests: Sequence[Sequence[dict[str, Any]]]) -> str:
    """Share of intervals that hold the truth, with a 95 % interval over tests."""
    return mean_share([[f["q05"] <= f["truth"] <= f["q95"] for f in figs] for figs in tests if figs], "tests")


def table(records: Sequence[dict[str, Any]]) -> str:
    """Coverage by kind of figure, widths against the oracle's, and what the plain model's check said."""
    lines = [f"{len(records)} tests, verdict right in {sum(r['right'] for r in records)}"]
    for who in ("oracle", "final", "unwarned"):
        for kind in (*KINDS, "all"):
            figs = [[f for f in r[who] if kind in (f["kind"], "all")] for r in records if who in r]
            lines.append(f"{who:8} {kind:8} {coverage(figs)}")
    for kind in KINDS:
        ratios = [
            (f["q95"] - f["q05"]) / (o["q95"] - o["q05"])
            for r in records
            if "final" in r
            for f, o in zip(r["final"], r["oracle"], strict=True)
            if f["kind"] == kind and o["q95"] > o["q05"]
        ]
        if ratios:
            low, mid, high = np.quantile(ratios, [0.05, 0.5, 0.95])
            lines.append(f"width over the oracle's, {kind}: median {mid:.2f} [{low:.2f}, {high:.2f}]")
    warned = sum(r["p"] <= ALPHA for r in records)
    lines.append(f"plain fits with the warning: {warned} of {len(records)}")
    lines += [f"  without: {', '.join(r['effects'])} (p = {r['p']:.2g})" for r in records if r["p"] > ALPHA]
    away = sum(not r["oracle_converged"] for r in records)
    lines.append(f"oracle fits not converged: {away}")
    return "\n".join(lines)


def main() -> None:
    """Run what is not done yet, a line a test, and print the table."""
    options = study_options(__doc__, tests=100, workers=2, output=Path("out/bench-to-robot")).parse_args()
    cases = [(index,) for index in range(options.tests)]
    print(table(records(options.output / "tests.jsonl", case, cases, workers=options.workers)))


if __name__ == "__main__":
    main()
