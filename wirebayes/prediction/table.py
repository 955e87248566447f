"""Predicted readings as a table: one row for each row of the protocol file."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from wirebayes.errors import InputError
from wirebayes.io.readings import READ, SET, Hold
from wirebayes.io.run_folder import read_json, writable, write_csv, write_json
from wirebayes.json_files.prediction import PredictionJson
from wirebayes.numeric.evenly import evenly
from wirebayes.numeric.typing import Bools, Floats
from wirebayes.prediction.mixture import Members, drawn_readings
from wirebayes.prediction.request import ProtocolRequest
from wirebayes.result_warnings import Notice
from wirebayes.results.read_back import Stored
from wirebayes.sentences import holds_in_words, short
from wirebayes.strict.files import PathLike
from wirebayes.wire.control import READ_UNIT, SET_UNIT
from wirebayes.wire.protocol import Control

FAR_OFF = 5.0  # standard deviations of a first reading: one in a million by chance, a wrong unit is at hundreds
FAR_UP = 2.0  # times the largest tested tension: nothing there was tested
# Times the longest tested hold. Of 180 simulated tests by holds of 90 s, whose creep went on by a logarithm or a power
# of time, or by a second and slow relaxation (113 of 120 passed their check), 90 % bands of rising holds and of rests
# had 83 to 97 % of the readings at up to 3 times these holds, 65 to 95 % at 5 times, 20 to 87 % at 10 times.
FAR_ON = 3.0
_FEW = 500  # draws, enough for a standard deviation
_ANSWERED = 0.5  # of the draws: where most of them have no reading, the quantiles of the others say little


def header(control: Control) -> tuple[str, ...]:
    """Columns: what is set, and figures of what is read in its unit."""
    unit = READ_UNIT[control]
    figures = [f"{name}_{unit}" for name in ("mean", "sd", "q05", "q50", "q95")]
    return ("experiment", "hold", SET[control], "time_s", *figures)


def mixture_table(drawn: Mapping[int, Floats], request: ProtocolRequest) -> list[list[Any]]:
    """Mean, sd and quantiles of the requested readings, in the file's order.

    Parameters
    ----------
    drawn : mapping of position to (R, n) array
        Readings of each requested hold, by `wirebayes.prediction.mixture.drawn_readings`. A draw that has none, because
        its wire cannot carry a weight, does not count; where most have none, the figures are NaN.
    request : ProtocolRequest
    """
    experiment = request.stored.sample.name
    rows: list[list[Any]] = []
    for hold, readings in _of_holds(drawn, request):
        answered = _answered(readings)
        enough = answered.mean() >= _ANSWERED
        here = readings[:, answered] if enough else np.full((len(readings), 2), np.nan)
        for time, values, figures in zip(hold.time_s, here, _figures(here), strict=True):
            mean, sd = _moments(values)
            rows.append([experiment, hold.number, hold.setting, float(time), mean, sd, *figures])
    return rows


def without_readings(drawn: Mapping[int, Floats], request: ProtocolRequest) -> list[Notice]:
    """A warning where draws have no reading, as under a weight that their wire cannot carry.

    Parameters
    ----------
    drawn, request
        As for `mixture_table`.
    """
    shares = {}
    for hold, readings in _of_holds(drawn, request):
        without = 1.0 - float(_answered(readings).mean())
        if without > 0.0:
            shares[hold.number] = (without, f"{hold.setting:g} {SET_UNIT[hold.control]}")
    if not shares:
        return []
    number = max(shares, key=lambda number: shares[number][0])
    most, setting = shares[number]
    text = (
        f"{holds_in_words(list(shares))}: in up to {100 * most:.3g} % of the draws (hold {number}, at {setting}) the "
        "model has no reading, for the wire cannot carry what is set: the figures are of the other draws"
    )
    if most > 1.0 - _ANSWERED:
        text += ", and left empty where these are the fewer"
    return [Notice("extrapolation", text)]


def _of_holds(drawn: Mapping[int, Floats], request: ProtocolRequest) -> Iterator[tuple[Hold, Floats]]:
    """Each requested hold with its readings (R, n)."""
    positions = np.flatnonzero(request.prediction.requested).tolist()
    for hold, position in zip(request.holds, positions, strict=True):
        yield hold, drawn[position][: len(hold.time_s)]


def _answered(readings: Floats) -> Bools:
    """(n,) which draws of readings (R, n) have all of them."""
    return np.all(np.isfinite(readings), axis=0)


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
    drawn = drawn_readings(blind, seed, _FEW)
    firsts = prediction.first[prediction.requested]
    out = []
    for (hold, readings), first in zip(_of_holds(drawn, request), firsts, strict=True):
        if not np.isfinite(first):
            continue
        answered = readings[0, _answered(readings)]
        doubt = _far_off(hold, first, answered)
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
    if len(drawn) < 2:
        return None
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
        is_known = np.isfinite(self[f"q50_{unit}"].values)
        holds = np.unique(self["hold"].values[is_known])
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
