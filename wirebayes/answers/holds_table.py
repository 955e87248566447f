"""The holds of a test as they were understood, for a terminal."""

from wirebayes.json_files.check import CheckedExperiment, HoldUnderstood
from wirebayes.json_files.read_units import read_value
from wirebayes.sentences import short

NO_WEIGHT = 1e-5  # of the largest weight: as little stands for a wire that hangs free


def holds_table(test: CheckedExperiment, unit: str) -> list[str]:
    """A line for each hold: what was set, when it begins, how long it lasts, and what was read.

    Parameters
    ----------
    test : CheckedExperiment
    unit : str
        Of what was read.
    """
    weights = test["control"] == "force"
    setting = "weight" if weights else "displacement"
    lines = [f"  {'hold':>4} {setting:>13} {'begins':>9} {'lasts':>9}  readings"]
    largest = max((hold.get("tension_N", 0.0) for hold in test["holds"]), default=0.0)
    for hold in test["holds"]:
        number = "-" if hold["number"] is None else hold["number"]
        place = _weight(hold["tension_N"], largest) if weights else f"{hold['displacement_mm']:g} mm"
        begins = _to_the_second(hold["start_s"])
        lasts = _to_the_second(hold["duration_s"])
        lines.append(f"  {number:>4} {place:>13} {begins:>9} {lasts:>9}  {_course(hold, unit)}")
    return lines


def _weight(tension_N: float, largest_N: float) -> str:
    return f"{tension_N:g} N" if tension_N > NO_WEIGHT * largest_N else "no weight"


def _to_the_second(seconds: float) -> str:
    """A time of a test, to four digits and a second at least."""
    return f"{short(seconds, max(4, len(str(int(seconds)))))} s"


def _course(hold: HoldUnderstood, unit: str) -> str:
    """What was read in a hold."""
    if hold["number"] is None or hold["first_s"] is None:
        return "none: held, not recorded"
    first = read_value(hold, "first")
    last = read_value(hold, "last")
    return f"{hold['readings']} from {short(hold['first_s'])} s on, {short(first, 4)} to {short(last, 4)} {unit}"
