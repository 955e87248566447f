"""Draws the pictures of the paper reproduced, and keeps an index that says what each shows."""

from collections.abc import Mapping, Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from numpy.random import Generator

from wirebayes.io.experiment import Experiment
from wirebayes.io.run_folder import write_bytes, write_json
from wirebayes.model.build import build
from wirebayes.model.replicate import readings as replicate
from wirebayes.model.spec import ModelSpec
from wirebayes.numeric.means import root_mean_square
from wirebayes.numeric.typing import Array
from wirebayes.paper import figures as paper_figures
from wirebayes.paper.held_out import Forecast, last_hold_course, published_course, some
from wirebayes.paper.least_squares import at, tension_residuals
from wirebayes.report import figures
from wirebayes.report.blocks import number
from wirebayes.report.drawn import svg
from wirebayes.results.read_back import Stored
from wirebayes.wire.laws import creep_fraction

_ByKind = Mapping[str, Mapping[str, Array]]  # draws of each parameter, hold by hold and of the chain
INDEX = "index.json"


class Gallery:
    """Pictures of one run, written as they are drawn; `finish` writes the index."""

    def __init__(self, directory: Path) -> None:
        self.folder = directory / "figures"
        self.folder.mkdir(exist_ok=True)
        self.index: list[dict[str, str]] = []

    def add(self, section: str, name: str, figure: Figure, alt: str, caption: str = "") -> None:
        """Write one picture and its entry in the index.

        Parameters
        ----------
        section : str
            Part of the page that shows it; the file's name begins with it.
        name : str
            Unique within the section.
        alt : str
            What the picture shows, for those who cannot see it.
        """
        file = f"{section}-{name}.svg"
        write_bytes(self.folder / file, svg(figure))
        self.index.append({"section": section, "file": file, "alt": alt, "caption": caption})

    def finish(self) -> None:
        """Write the index."""
        write_json(self.folder / INDEX, self.index)

    def measured(self, experiment: Experiment) -> None:
        """The test as it was read."""
        title = f"{experiment.name}: {experiment.material}, {experiment.length_mm:g} mm"
        figure = figures.measured(experiment.protocol(), experiment.tension(), title)
        holds = len(experiment.recorded_holds)
        alt = f"Tension of {experiment.name} against displacement: {holds} holds, each losing tension while it lasts."
        self.add("measured", experiment.name, figure, alt)

    def intervals(self, experiment: Experiment, rows: Sequence[Mapping[str, Any]]) -> None:
        """What is known of each parameter, beside the published value."""
        alt = (
            f"90 % intervals of the parameters of {experiment.name} before and after the test, in multiples of Table 4."
        )
        self.add("known", experiment.name, paper_figures.intervals(rows, experiment.name), alt)

    def last_hold(self, experiment: Experiment, published: dict[str, float], first: Stored, rng: Generator) -> None:
        """The paper's figures 1 to 4: the last hold of a wire, with the paper's curve and the predicted band.

        Parameters
        ----------
        published : dict of name to float
            The wire's row of Table 4.
        first : Stored
            Posterior of the first holds, hold by hold.
        """
        hold = experiment.recorded_holds[-1]
        times = np.linspace(0.0, hold.duration_s, 49)
        drawn = last_hold_course(first, experiment, times, rng)
        curve = published_course(published, experiment, times)
        title = f"{experiment.name}: last hold, {hold.displacement_mm:g} mm"
        figure = paper_figures.last_hold(times, drawn, curve, (hold.time_s, hold.tension_N), title)
        missed = np.interp(hold.time_s[1:], times, curve) - hold.tension_N[1:]
        alt = f"The last hold of {experiment.name}: measured tension, the paper's curve and the predicted band."
        caption = f"The paper's curve misses these readings by {number(root_mean_square(missed), 2)} N (rms)."
        self.add("figures-1-to-4", experiment.name, figure, alt, caption)

    def unused_holds(self, experiment: Experiment, published: dict[str, float], seen: Mapping[str, Forecast]) -> None:
        """All unused holds, hold by hold and as one chain.

        Parameters
        ----------
        published : dict of name to float
            The wire's row of Table 4; its curve is drawn hold by hold.
        seen : mapping of likelihood to Forecast
        """
        for likelihood, out in seen.items():
            spoken = figures.WORDS[likelihood]
            curve = _published_at(experiment, published, out) if likelihood == "hold" else None
            title = f"{experiment.name}, {spoken}"
            colour = figures.COLOURS[likelihood]
            figure = figures.residual_figure(out.hold, out.time_s, out.measured_N, out.band_N, title, colour, curve)
            alt = f"Measured minus predicted tension in the unused holds of {experiment.name}, {spoken}."
            caption = f"rms {number(out.rms_N, 2)} N; {100 * out.coverage:.0f} % of the readings lie in the 90 % band."
            self.add(f"unused-{likelihood}", experiment.name, figure, alt, caption)

    def ridges(self, experiment: Experiment, published: Mapping[str, float], full: Mapping[str, Stored]) -> None:
        """What hold by hold cannot distinguish: stiffness and amount, amount and rate.

        Parameters
        ----------
        published : mapping of name to float
            The wire's row of Table 4, marked in the pictures.
        full : mapping of likelihood to Stored
            Posteriors of all holds, ``hold`` and ``chain``.
        """
        draws = {}
        for kind in ("hold", "chain"):
            draws[kind] = {name: some(values) for name, values in full[kind].draws.items()}
        self._stiffness_and_amount(experiment, published, draws, full["hold"].draws)
        self._amount_and_rate(experiment, published, draws, full["hold"].draws)

    def _stiffness_and_amount(
        self, experiment: Experiment, published: Mapping[str, float], draws: _ByKind, by_hold: Mapping[str, Array]
    ) -> None:
        stiffness = published["k1"]
        k1 = {kind: own["k1"] for kind, own in draws.items()}
        amount = {kind: own["B"] for kind, own in draws.items()}
        xlabel = figures.axis_label("k1")
        ylabel = figures.axis_label("B")
        mark = (stiffness, published["B"])
        figure = figures.joint(k1, amount, xlabel, ylabel, experiment.name, mark)
        low, high = np.quantile(by_hold["k1"], [0.05, 0.95])
        span = f"{number(low, 2)} to {number(high, 2)} N"
        caption = f"Hold by hold, k1 may be anything from {span} if B changes with it."
        caption += _near_the_stiffest_step(experiment, stiffness)
        alt = f"Posterior draws of k1 and B of {experiment.name}: a long ridge hold by hold, a small cloud as a chain."
        self.add("ridge", experiment.name, figure, alt, caption)

    def _amount_and_rate(
        self, experiment: Experiment, published: Mapping[str, float], draws: _ByKind, by_hold: Mapping[str, Array]
    ) -> None:
        rate = {kind: own["k2"] for kind, own in draws.items()}
        amount = {kind: own["k1"] * own["B"] for kind, own in draws.items()}
        mark = (published["k2"], published["k1"] * published["B"])
        xlabel = figures.axis_label("k2")
        figure = figures.joint(rate, amount, xlabel, "k1·B, N mm N⁻ᵁ", experiment.name, mark)
        log_amount = np.log(by_hold["k1"] * by_hold["B"])
        log_rate = np.log(by_hold["k2"])
        correlations = np.corrcoef(log_amount, log_rate)
        correlation = number(float(correlations[0, 1]), 3)
        time_s = experiment.recorded_holds[-1].duration_s
        percent = 100 * _published_fraction(published, time_s)
        caption = (
            f"Correlation hold by hold {correlation} (of logarithms). By the paper's own numbers a hold of "
            f"{time_s:g} s shows {percent:.0f} % of the final creep."
        )
        alt = f"Posterior draws of k2 and k1 B of {experiment.name}: much slow creep looks like little fast creep."
        self.add("amount-and-rate", experiment.name, figure, alt, caption)

    def prior(self, experiment: Experiment, rng: Generator) -> None:
        """What the prior expects of this test."""
        problem = build([experiment])
        sample = problem.samples[0]
        theta = problem.prior.rvs(4000, rng)
        drawn = replicate(problem, theta, sample, rng)
        figure = paper_figures.prior_predictive(sample.protocol, drawn, experiment.tension(), experiment.name)
        alt = f"First tensions and first hold of {experiment.name}: what the prior expects, and the readings."
        self.add("prior", experiment.name, figure, alt)


def _published_at(experiment: Experiment, published: Mapping[str, float], out: Forecast) -> Array:
    """The paper's prediction of the unused readings, hold by hold."""
    left = tension_residuals(experiment, at(published), ModelSpec(likelihood="hold"))[..., 0]
    wanted = np.isfinite(left) & np.isin(experiment.protocol().number, out.hold)[:, None]
    return (experiment.tension() - left)[wanted]


def _near_the_stiffest_step(experiment: Experiment, stiffness: float) -> str:
    """A sentence that a published stiffness is that of the stiffest single step; empty where it is not."""
    jump = stiffest_step(experiment)
    if abs(jump / stiffness - 1) >= 0.02:
        return ""
    nearest = f"{number(stiffness, 4)} N is within 2 % of the stiffest single step between two holds"
    return f" The published {nearest}, {number(jump, 4)} N."


def _published_fraction(published: Mapping[str, float], time_s: float) -> float:
    """The share of the final creep that shows after a time, by the paper's numbers."""
    rate = np.asarray(published["k2"])
    shape = np.asarray(published["N"])
    return float(creep_fraction(np.asarray(time_s), rate, shape))


def stiffest_step(experiment: Experiment) -> float:
    """Largest tension gained in one step between two neighbouring holds, per unit strain, N."""
    steps = []
    for before, after in pairwise(experiment.holds):
        moved_mm = after.displacement_mm - before.displacement_mm
        if before.recorded and after.recorded and moved_mm != 0:
            gained_N = after.tension_N[0] - before.tension_N[-1]
            steps.append(gained_N * experiment.length_mm / moved_mm)
    return float(max(steps))
