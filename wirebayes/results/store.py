"""Results on disk: netCDF that ArviZ reads (`read_back` reads it, too), and a summary in JSON."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from wirebayes.inference.fit import Fit
from wirebayes.io.run_folder import write_bytes, write_json
from wirebayes.json_files.summary import SummaryJson
from wirebayes.model.sample import Sample
from wirebayes.results import netcdf
from wirebayes.results.content import groups_of
from wirebayes.results.summary import summary_of


def save_posterior(
    fit: Fit, folder: Path, provenance: Mapping[str, Any], *, seed: int = 0, sample: Sample | None = None
) -> SummaryJson:
    """Write ``posterior.nc`` and ``summary.json`` into an existing folder and return the summary.

    Parameters
    ----------
    provenance : mapping
        Data hash, configuration, seed: stored as attributes.
    seed : int
        For the draws of the predictive and prior groups.
    sample : Sample, optional
        Store the parameters of this sample alone, under their plain names; otherwise all samples, with a dimension
        ``experiment``. A problem of one sample needs none.
    """
    alone = _alone(fit, sample)
    groups = groups_of(fit, alone, provenance, np.random.default_rng(seed))
    about = groups["posterior"].attributes
    whole = {key: about[key] for key in ("wirebayes_version", "inference_library", "provenance")}
    write_bytes(folder / "posterior.nc", netcdf.content(groups, whole))
    return save_summary(fit, folder, sample=sample)


def save_summary(fit: Fit, folder: Path, *, sample: Sample | None) -> SummaryJson:
    """Write ``summary.json`` alone, the same as `save_posterior` does, and return it.

    Parameters
    ----------
    sample : Sample or None
        See `save_posterior`.
    """
    summary = summary_of(fit, _alone(fit, sample))
    write_json(folder / "summary.json", summary)
    return summary


def _alone(fit: Fit, sample: Sample | None) -> Sample | None:
    """The sample that is stored under plain names; None where several are stored together."""
    return fit.problem.samples[0] if sample is None and len(fit.problem.samples) == 1 else sample
