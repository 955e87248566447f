"""Table 4 beside our own least squares: published and refitted parameters in every interpretation of the model."""

from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from wirebayes.inference.fit import seed_of
from wirebayes.io.experiment import Experiment
from wirebayes.model.spec import ModelSpec
from wirebayes.paper.least_squares import VARIANTS, LeastSquaresFit, at, identify, leading, rms, tension_residuals
from wirebayes.processes.workers import ParallelMap

Row = dict[str, Any]


def identification_rows(
    experiments: Sequence[Experiment],
    published: Mapping[str, Mapping[str, float]],
    training_holds: int,
    seed: int,
    parallel_map: ParallelMap,
) -> list[Row]:
    """One row for each wire, variant and source of the parameters.

    Parameters
    ----------
    experiments : sequence of Experiment
    published : mapping of experiment name to parameters
    training_holds : int
        Both are adjusted to these first holds: all parameters, or the preload that the published ones lack.
    parallel_map : function
        The built-in `map`, or one over processes.

    Returns
    -------
    list of dict
        Parameters, and the rms of what each predicts on the training holds, on the rest and on all, in N.
    """
    of_wire = partial(_rows_of_wire, training_holds=training_holds, seed=seed)
    own = [dict(published[experiment.name]) for experiment in experiments]
    rows = []
    for found in parallel_map(of_wire, experiments, own):
        rows += found
    return rows


def _rows_of_wire(experiment: Experiment, published: dict[str, float], training_holds: int, seed: int) -> list[Row]:
    first = experiment.train(training_holds)
    cut = leading(experiment, training_holds)
    out = []
    for variant in VARIANTS:
        words = ("least squares", experiment.name, variant.likelihood, variant.history, variant.law)
        for source, known in (("published", published), ("refitted", None)):
            rng = np.random.default_rng(seed_of(seed, *words))
            found = identify(first, variant, rng, known)
            out.append(_row(experiment, variant, source, found, cut))
    return out


def _row(experiment: Experiment, variant: ModelSpec, source: str, found: LeastSquaresFit, cut: int) -> Row:
    left = tension_residuals(experiment, at(found.parameters), variant)
    parameters = {column: found.parameters.get(name) for name, column in _COLUMNS.items()}
    return {
        "experiment": experiment.name,
        "likelihood": variant.likelihood,
        "history": variant.history if variant.likelihood == "chain" else "",
        "elastic_law": variant.law,
        "parameters": source,
        **parameters,
        "rms_first_N": rms(left[:cut]),
        "rms_rest_N": rms(left[cut:]),
        "rms_all_N": rms(left),
        "not_held_back": " ".join(found.not_held_back),
    }


_COLUMNS = {"k1": "k1_N", "B": "B", "U": "U", "k2": "k2", "N": "N", "preload": "preload_mm"}
