"""Predicted readings as a table: one row for each row of the protocol file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.io.readings import READ, SET
from wirebayes.io.run_folder import read_json, writable, write_csv, write_json
from wirebayes.json_files.prediction import PredictionJson
from wirebayes.notice import Notice
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Floats
from wirebayes.prediction.predictive import draw_predictive
from wirebayes.prediction.request import ProtocolRequest
from wirebayes.results.read_back import Stored
from wirebayes.strict.files import PathLike
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.protocol import Control

FAR_OFF = 5.0  # standard deviations of a first reading: one in a million by chance, a wrong unit is at hundreds
FAR_UP, FAR_ON = 2.0, 10.0  # times the largest tested tension, and the longest tested hold: nothing there was tested
_FEW = 500  # draws, enough for a standard deviation
DRAWS = 4000  # a 5 % quantile is then one between 4.3 % and 5.7 %


def header(control: Control) -> tuple[str, ...]:
    """Columns: what is set, and figures of what is read in its unit."""
    figures = (f"{name}_{READ_UNIT[control]}" for name in ("mean", "sd", "q05", "q50", "q95"))
    return ("experiment", "hold", SET[control], "time_s", *figures)


def mixture_table(
    members: Sequence[tuple[float, ProtocolRequest]], seed: int = 0, draws: int = DRAWS
) -> list[list[Any]]:
    """Mean, sd and quantiles of the requested readings, in the file's order.

    Parameters
    ----------
    members : sequence of (probability, ProtocolRequest)
        One protocol requested of each model, as often among the draws as it is probable; the probabilities sum to one.
    draws : int
        In all, evenly spread over the stored ones.
    """
    drawn = _drawn(members, seed, draws)
    request = members[0][1]
    stored, prediction = request.stored, request.prediction
    rows: list[list[Any]] = []
    for hold, at in zip(request.holds, np.flatnonzero(prediction.requested), strict=True):
        here = drawn[at, : len(hold.time_s)]
        quantiles = np.quantile(here, [0.05, 0.5, 0.95], axis=1)
        for k, time in enumerate(hold.time_s):
            about = here[k] - here[k, 0]  # so that a given reading comes back to the last digit
            figures = [here[k, 0] + about.mean(), about.std(ddof=1), *quantiles[:, k]]
            rows.append([stored.sample.name, hold.number, hold.setting, float(time), *map(float, figures)])
    return rows


def unlikely_readings(members: Sequence[tuple[float, ProtocolRequest]], seed: int = 0) -> list[Notice]:
    """A warning for every given first reading that is far from what is expected where it is not given.

    Parameters
    ----------
    members : sequence of (probability, ProtocolRequest)
        As for `mixture_table`.
    """
    request = members[0][1]
    given = np.isfinite(request.prediction.first) & request.prediction.requested
    if request.stored.likelihood == "hold" or not given.any():  # each hold starts from its own reading
        return []
    blind = [(p, replace(r, prediction=replace(r.prediction, first=np.full(len(given), np.nan)))) for p, r in members]
    first = _drawn(blind, seed, _FEW)[:, 0]
    out = []
    for hold, at in zip(request.holds, np.flatnonzero(request.prediction.requested), strict=True):
        read, mean, sd = request.prediction.first[at], first[at].mean(), first[at].std(ddof=1)
        if given[at] and abs(read - mean) > FAR_OFF * sd:
            unit = READ_UNIT[hold.control]
            text = (
                f"hold {hold.number}: its first reading, {read:.4g} {unit}, is {abs(read - mean) / sd:.0f} standard "
                f"deviations from the {mean:.4g} {unit} expected there: check {READ[hold.control]} (in {unit}?) and "
                f"{SET[hold.control]}; what follows from it is not to be relied on"
            )
            out.append(Notice("data", text))
    return out


def beyond_tested(rows: Sequence[Sequence[Any]], stored: Stored) -> list[Notice]:
    """A warning where predicted tensions, and one where times, are far beyond what the posterior was learned from.

    Parameters
    ----------
    rows : sequence of rows
        Of a table.
    stored : Stored
        A posterior behind it.
    """
    protocol, readings = stored.sample.protocol, stored.sample.readings[..., 0]
    names, longest = header(protocol.control), float(protocol.duration_s[protocol.recorded].max())
    weights = protocol.control == "force"
    highest = float((protocol.setting[protocol.recorded] if weights else readings[protocol.mask]).max())
    tension = max(row[names.index("tension_N" if weights else "q50_N")] for row in rows)
    time = max(row[names.index("time_s")] for row in rows)
    out = []
    if tension > FAR_UP * highest:
        out.append(f"tensions of up to {tension:.4g} N are predicted; none above {highest:.4g} N was tested")
    if time > FAR_ON * longest:
        out.append(f"holds of up to {time:.4g} s are predicted; none longer than {longest:.4g} s was tested")
    return [Notice("extrapolation", text) for text in out]


def _drawn(members: Sequence[tuple[float, ProtocolRequest]], seed: int, draws: int) -> Floats:
    """Readings (H, R, n) of all models, each with as many draws as it is probable."""
    rng = np.random.default_rng(seed_of(seed, "predict", members[0][1].stored.sample.name))
    parts = []
    for probability, request in members:
        stored, n = request.stored, max(round(probability * draws), 2)
        theta = stored.theta
        theta = theta[evenly(len(theta), n)]
        parts.append(draw_predictive(stored.problem, theta, stored.sample, request.prediction, rng))
    return np.concatenate(parts, axis=-1)


class Prediction(xr.Dataset):  # type: ignore[no-untyped-call]  # xarray's __init_subclass__
    """Predicted readings with their units: an `xarray.Dataset` that draws itself.

    Examples
    --------
    >>> predicted = wb.predict(posterior, {"hold": [7, 7], "displacement_mm": [7, 7], "time_s": [0, 60]})
    >>> predicted["mean_N"].attrs["units"], predicted.plot().get_ylabel()
    ('N', 'tension, N')
    """

    __slots__ = ()

    def summary(self) -> PredictionJson:
        """The prediction as plain values: what was predicted, a row for each reading, and the warnings."""
        columns = {str(name): values.values.tolist() for name, values in self.reset_coords().data_vars.items()}
        rows = [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]
        warned = zip(self.attrs.get("warning_kinds", ()), self.attrs.get("warnings", ()), strict=True)
        return {
            "experiment": self.attrs["experiment"],
            "prediction": self.attrs["prediction"],
            "seed": int(self.attrs["seed"]),
            "readings": rows,
            "warnings": [{"kind": kind, "text": text} for kind, text in warned],
        }

    def save(self, folder: PathLike) -> Path:
        """Store the table as ``predict`` writes it, ``predicted.csv``, and the summary, ``predicted.json``.

        Parameters
        ----------
        folder : str or Path
            A new or empty folder, or one that holds this prediction already.

        Returns
        -------
        Path
            The folder.

        Raises
        ------
        InputError
            The folder holds something else, or cannot be written.
        """
        target, found = Path(folder), self.summary()
        summary = target / "predicted.json"
        kept = summary.is_file() and read_json(summary) == found
        if target.exists() and not (kept or (target.is_dir() and not any(target.iterdir()))):
            raise InputError(f"{target}: found something else, expected a new or empty folder")
        columns = header("displacement" if "mean_N" in self else "force")
        rows = [[found["experiment"], *(row[name] for name in columns[1:])] for row in found["readings"]]
        with writable(target):
            target.mkdir(parents=True, exist_ok=True)
            write_csv(target / "predicted.csv", columns, rows)
            write_json(summary, found)
        return target

    def plot(self, axes: Any = None) -> Any:  # type: ignore[override]  # xarray's own draws no bands
        """Draw the median and the 90 % band against the time in the hold, a colour for each hold.

        Parameters
        ----------
        axes : matplotlib.axes.Axes, optional
            Where to draw; new ones when left out.

        Returns
        -------
        matplotlib.axes.Axes
        """
        if axes is None:
            import matplotlib.pyplot as plt  # only where it is needed

            axes = plt.subplots()[1]
        control: Control = "displacement" if "mean_N" in self else "force"
        unit, setting = READ_UNIT[control], SET[control]
        holds = np.unique(self["hold"].values)
        named = holds[evenly(len(holds), _MOST_NAMED)]
        for hold in holds:
            rows = self.isel(reading=np.flatnonzero(self["hold"].values == hold))
            time = rows["time_s"].values
            label = f"hold {hold}, {rows[setting].values[0]:g} {SET_UNIT[control]}" if hold in named else None
            (line,) = axes.plot(time, rows[f"q50_{unit}"].values, "o-", ms=3, label=label)
            low, high = rows[f"q05_{unit}"].values, rows[f"q95_{unit}"].values
            axes.fill_between(time, low, high, color=line.get_color(), alpha=0.25, lw=0)
        axes.set_xlabel("time in the hold, s")
        axes.set_ylabel(f"{_READ_WORD[control]}, {unit}")
        axes.set_title(f"{self.attrs['experiment']}: predicted, 90 % band", loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        # the best place is looked for among all points of all lines
        axes.legend(frameon=False, loc="best" if len(holds) <= _MOST_NAMED else "upper right")
        return axes


_MOST_NAMED = 12  # holds that a legend has room for; of more, some evenly spaced ones are named
_READ_WORD = {"displacement": "tension", "force": "displacement"}


def dataset(
    rows: Sequence[Sequence[Any]], attributes: Mapping[str, Any], control: Control = "displacement"
) -> Prediction:
    """The rows of `mixture_table` with units, along the dimension ``reading``.

    Parameters
    ----------
    rows : sequence of rows
    attributes : mapping
        Of the dataset; the experiment's name joins them.
    control : {"displacement", "force"}
    """
    columns = {name: [row[i] for row in rows] for i, name in enumerate(header(control))}
    experiment = str(columns.pop("experiment")[0])
    units = {"hold": "1", SET[control]: SET_UNIT[control], "time_s": "s"}
    variables = {
        name: ("reading", np.array(c), {"units": units.get(name, READ_UNIT[control])}) for name, c in columns.items()
    }
    coords = {name: variables.pop(name) for name in units}
    return Prediction(variables, coords, {"experiment": experiment, **attributes})
