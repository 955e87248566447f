"""Predicted readings as a table: one row for each row of the protocol file."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import ceil
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wirebayes.errors import InputError
from wirebayes.inference.fit import seed_of
from wirebayes.io.readings import READ, SET, Hold
from wirebayes.io.run_folder import read_json, writable, write_csv, write_json
from wirebayes.json_files.prediction import PredictionJson
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.log_sum import log_sum
from wirebayes.numeric.typing import Floats
from wirebayes.prediction.predictive import draw_unconditioned, given_first, log_density_of_given
from wirebayes.prediction.request import ProtocolRequest
from wirebayes.result_warnings import Notice
from wirebayes.results.read_back import Stored
from wirebayes.sentences import short
from wirebayes.strict.files import PathLike
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.protocol import Control

FAR_OFF = 5.0  # standard deviations of a first reading: one in a million by chance, a wrong unit is at hundreds
FAR_UP = 2.0  # times the largest tested tension: nothing there was tested
# Times the longest tested hold. Of 180 simulated tests by holds of 90 s, whose creep went on by a logarithm or a power
# of time, or by a second and slow relaxation (113 of 120 passed their check), 90 % bands of rising holds and of rests
# had 83 to 97 % of the readings at up to 3 times these holds, 65 to 95 % at 5 times, 20 to 87 % at 10 times.
FAR_ON = 3.0
_LEAST = 2  # draws of a model that hardly counts: one has no spread
_FEW = 500  # draws, enough for a standard deviation
Members = Sequence[tuple[float, ProtocolRequest]]  # of a mixture: probability and request, one or several
DRAWS = 4000  # a 5 % quantile is then one between 4.3 % and 5.7 %


def header(control: Control) -> tuple[str, ...]:
    """Columns: what is set, and figures of what is read in its unit."""
    unit = READ_UNIT[control]
    figures = [f"{name}_{unit}" for name in ("mean", "sd", "q05", "q50", "q95")]
    return ("experiment", "hold", SET[control], "time_s", *figures)


def mixture_table(members: Members, seed: int = 0, draws: int = DRAWS) -> list[list[Any]]:
    """Mean, sd and quantiles of the requested readings, in the file's order.

    Parameters
    ----------
    members : sequence of (probability, ProtocolRequest)
        One protocol requested of each model, as often among a hold's draws as it is probable given the first readings
        that condition the hold; the probabilities, which are those without them, sum to one.
    draws : int
        In all, evenly spread over the stored ones.
    """
    drawn = _drawn(members, seed, draws)
    _, request = members[0]
    experiment = request.stored.sample.name
    positions = np.flatnonzero(request.prediction.requested).tolist()
    rows: list[list[Any]] = []
    for hold, position in zip(request.holds, positions, strict=True):
        here = drawn[position][: len(hold.time_s)]
        for time, readings, figures in zip(hold.time_s, here, _figures(here), strict=True):
            mean, sd = _moments(readings)
            rows.append([experiment, hold.number, hold.setting, float(time), mean, sd, *figures])
    return rows


def _moments(readings: Floats) -> tuple[float, float]:
    """Mean and standard deviation, about the first: so that a given reading comes back to the last digit."""
    first = readings[0]
    about = readings - first
    return float(first + about.mean()), float(about.std(ddof=1))


def _figures(readings: Floats) -> list[list[float]]:
    """Quantiles of each of several readings (R, n)."""
    quantiles: Floats = np.quantile(readings, [0.05, 0.5, 0.95], axis=1)
    return quantiles.T.tolist()


def unlikely_readings(members: Members, seed: int) -> list[Notice]:
    """A warning for every given first reading that is far from what is expected where it is not given.

    Parameters
    ----------
    members : sequence of (probability, ProtocolRequest)
        As for `mixture_table`.
    """
    _, request = members[0]
    prediction = request.prediction
    given = np.isfinite(prediction.first) & prediction.requested
    if request.stored.likelihood == "hold" or not given.any():  # each hold starts from its own reading
        return []
    blind = [(probability, _blind(member)) for probability, member in members]
    drawn = _drawn(blind, seed, _FEW)
    positions = np.flatnonzero(prediction.requested).tolist()
    out = []
    for hold, position in zip(request.holds, positions, strict=True):
        if not given[position]:
            continue
        doubt = _far_off(hold, prediction.first[position], drawn[position][0])
        if doubt is not None:
            out.append(Notice("data", doubt))
    return out


def _blind(request: ProtocolRequest) -> ProtocolRequest:
    """The same request, given no first reading."""
    prediction = request.prediction
    unknown = np.full(len(prediction.first), np.nan)
    return replace(request, prediction=replace(prediction, first=unknown))


def _far_off(hold: Hold, read: float, drawn: Floats) -> str | None:
    """What speaks against a first reading that is far from its predicted draws (n,)."""
    mean = drawn.mean()
    sd = drawn.std(ddof=1)
    distance = abs(read - mean)
    if not distance > FAR_OFF * sd:
        return None
    unit = READ_UNIT[hold.control]
    return (
        f"hold {hold.number}: its first reading, {short(read, 4)} {unit}, is {distance / sd:.0f} standard "
        f"deviations from the {short(mean, 4)} {unit} expected there: check {READ[hold.control]} (in {unit}?) and "
        f"{SET[hold.control]}; what follows from it is not to be relied on"
    )


def beyond_tested(rows: Sequence[Sequence[Any]], stored: Stored) -> list[Notice]:
    """A warning where predicted tensions, and one where times, are far beyond what the posterior was learned from.

    Parameters
    ----------
    rows : sequence of rows
        Of a table.
    stored : Stored
        A posterior behind it.
    """
    protocol = stored.sample.protocol
    recorded = protocol.recorded
    tested = stored.sample.readings[..., 0][protocol.mask]
    tension_column = "q50_N"
    if protocol.control == "force":
        tested = protocol.setting[recorded]
        tension_column = "tension_N"
    highest = float(tested.max())
    longest = float(protocol.duration_s[recorded].max())
    columns = header(protocol.control)
    of_tension = columns.index(tension_column)
    of_time = columns.index("time_s")
    tension = max(row[of_tension] for row in rows)
    time = max(row[of_time] for row in rows)
    out = []
    if tension > FAR_UP * highest:
        out.append(
            f"tensions of up to {short(tension, 4)} N are predicted; none above {short(highest, 4)} N was tested"
        )
    if time > FAR_ON * longest:
        out.append(
            f"holds of up to {short(time, 4)} s are predicted; none longer than {short(longest, 4)} s was tested: the "
            "bands take creep to go on by the fitted law, and are too narrow where it does not"
        )
    return [Notice("extrapolation", text) for text in out]


def _drawn(members: Members, seed: int, draws: int) -> dict[int, Floats]:
    """The readings (R, n) of each requested hold by all models, each with as many draws as it is probable there."""
    _, first = members[0]
    asked = first.prediction
    rng = np.random.default_rng(seed_of(seed, "predict", first.stored.sample.name))
    # given readings may make any of them the only one that is left
    each = draws if np.isfinite(asked.first[asked.requested]).any() else 0
    readings = []
    log_weights = []
    for probability, request in members:
        stored = request.stored
        own_draws = max(each, ceil(probability * draws), _LEAST)
        theta = stored.theta[evenly(len(stored.theta), own_draws)]
        own = draw_unconditioned(stored.problem, theta, stored.sample, request.prediction, rng)
        with np.errstate(divide="ignore"):
            log_weight = np.full(len(own), np.log(probability))
        if stored.likelihood == "chain":
            log_weight += log_density_of_given(own, request.prediction)
            own = given_first(own, request.prediction)
        readings.append(own)
        log_weights.append(log_weight)
    shares = _shares(np.array(log_weights))
    positions = np.flatnonzero(asked.requested).tolist()
    return {j: _mixed([own[j] for own in readings], shares[:, j], draws) for j in positions}


def _shares(log_weight: Floats) -> Floats:
    """(m, H) probabilities of m models from log weights (m, H); all alike where no model predicts what was read."""
    possible = np.where(np.isfinite(log_weight).any(axis=0), log_weight, 0.0)
    return np.exp(possible - log_sum(possible))


def _mixed(readings: Sequence[Floats], share: Floats, draws: int) -> Floats:
    """Draws (R, n) of several models, each as often as its share says, as many as each of them has enough for."""
    with np.errstate(divide="ignore"):
        enough_for = [own.shape[1] / part for own, part in zip(readings, share, strict=True)]
    enough = min(draws, *enough_for)
    parts = []
    for own, part in zip(readings, share, strict=True):
        count = round(part * enough)
        parts.append(own[:, evenly(own.shape[1], count)])
    return np.concatenate(parts, axis=1)


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
        rows = []
        for cells in zip(*columns.values(), strict=True):
            rows.append(dict(zip(columns, cells, strict=True)))
        kinds = self.attrs.get("warning_kinds", ())
        texts = self.attrs.get("warnings", ())
        return {
            "experiment": self.attrs["experiment"],
            "prediction": self.attrs["prediction"],
            "seed": int(self.attrs["seed"]),
            "readings": rows,
            "warnings": [{"kind": kind, "text": text} for kind, text in zip(kinds, texts, strict=True)],
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
        target = Path(folder)
        found = self.summary()
        summary = target / "predicted.json"
        if target.exists() and not _may_receive(target, summary, found):
            raise InputError(f"{target}: found something else, expected a new or empty folder")
        columns = header(self._control)
        rows = []
        for reading in found["readings"]:
            figures = [reading[name] for name in columns[1:]]
            rows.append([found["experiment"], *figures])
        with writable(target):
            target.mkdir(parents=True, exist_ok=True)
            write_csv(target / "predicted.csv", columns, rows)
            write_json(summary, found)
        return target

    @property
    def _control(self) -> Control:
        return "displacement" if "mean_N" in self else "force"

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
        control = self._control
        unit = READ_UNIT[control]
        holds = np.unique(self["hold"].values)
        named = holds[evenly(len(holds), _MOST_NAMED)]
        for hold in holds:
            rows = self.isel(reading=np.flatnonzero(self["hold"].values == hold))
            setting = rows[SET[control]].values[0]
            label = f"hold {hold}, {setting:g} {SET_UNIT[control]}" if hold in named else None
            _draw_hold(axes, rows, unit, label)
        axes.set_xlabel("time in the hold, s")
        axes.set_ylabel(f"{_READ_WORD[control]}, {unit}")
        axes.set_title(f"{self.attrs['experiment']}: predicted, 90 % band", loc="left")
        axes.spines[["top", "right"]].set_visible(False)
        # the best place is looked for among all points of all lines
        place = "best" if len(holds) <= _MOST_NAMED else "upper right"
        axes.legend(frameon=False, loc=place)
        return axes


def _may_receive(target: Path, summary: Path, found: PredictionJson) -> bool:
    """Whether a folder is empty, or holds this prediction already."""
    if summary.is_file() and read_json(summary) == found:
        return True
    return target.is_dir() and not any(target.iterdir())


def _draw_hold(axes: Any, rows: xr.Dataset, unit: str, label: str | None) -> None:
    """Median and band of one hold."""
    time = rows["time_s"].values
    median = rows[f"q50_{unit}"].values
    low = rows[f"q05_{unit}"].values
    high = rows[f"q95_{unit}"].values
    (line,) = axes.plot(time, median, "o-", ms=3, label=label)
    axes.fill_between(time, low, high, color=line.get_color(), alpha=0.25, lw=0)


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
    table = {name: [row[i] for row in rows] for i, name in enumerate(header(control))}
    experiment = str(table.pop("experiment")[0])
    coordinate_units = {"hold": "1", SET[control]: SET_UNIT[control], "time_s": "s"}
    variables = {}
    for name, values in table.items():
        unit = coordinate_units.get(name, READ_UNIT[control])
        variables[name] = ("reading", np.array(values), {"units": unit})
    coords = {name: variables.pop(name) for name in coordinate_units}
    return Prediction(variables, coords, {"experiment": experiment, **attributes})
