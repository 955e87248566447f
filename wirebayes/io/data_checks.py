"""Readings that a wire on a bench hardly gives: checks before a fit, each a sentence with what to change.

What is certainly wrong is refused where the file is read (`wirebayes.io.readings`); what is possible but unlikely gets
a warning here.
"""

from collections.abc import Callable, Mapping, Sequence, Set

import numpy as np

from wirebayes.io import gross_events
from wirebayes.io.checked_test import CheckedTest
from wirebayes.io.experiment import Experiment
from wirebayes.io.isolated_readings import ISOLATED, outlier
from wirebayes.io.readings import READ, times_run_on
from wirebayes.io.slack_by_preload import slack_by_preload
from wirebayes.io.zero_shifts import slack_below, zero_shift
from wirebayes.numeric.typing import Floats
from wirebayes.result_warnings import Notice
from wirebayes.sentences import short, some_of
from wirebayes.wire.protocol import Control, Protocol

RUN_ON = 0.01  # two holds of four readings: rarer orders of honest times are not worth a silence
NEGATIVE = 0.05  # share of the largest tension; sensors drift by less
FLAT = 3.0  # noise levels by which the holds' means must differ to say anything of stiffness
FALLS = -0.9  # correlation of displacement and tension: creep and friction bend the line, but do not turn it
LEAST_STRAIN = 5e-5  # 10 N/mm² in steel: benches that step so little cannot set their steps
LARGEST_STRAIN = 0.5  # lines and ropes break below; rubber is no wire of this model
RISING_HOLDS, RISING_SHARE, RISE = 5, 0.8, 2.0  # holds on loading, share that rise, rise in noise levels: not by chance
SHRINKING_HOLDS = 4  # no wire shrinks under a load: fewer are enough, if all of them do
JUMP, JUMP_STAYS = 2.0, 0.2  # times the changes before and after it; share of it that is left to the hold's end
FASTER = 5.0  # times the speed of the changes before and after it, which neither creep gains and loses nor a misprint
# Different readings that agree one by one, and not by chance: in two holds of a test, whose levels a step keeps apart;
# and in two tests of the same settings, whose levels agree as well, so that coarse readings of few values may, too.
COPIED_HOLD, COPIED_TEST = 3, 4
OFF_GRID = 0.5  # share of the changes between readings that are smaller than half the resolution

ONE_SETTING = 0.01  # of the setting: with .3 % between holds k1 is as open as with none
_OPEN = (
    "not tell k1 and the preload apart: the priors decide both; state what is known, as preload_mm (0 where "
    "displacements count from the zero-tension length), [prior.preload] or [prior.k1]"
)
ONE_HOLD = f"one hold does {_OPEN}"


def warnings(protocol: Protocol, values: Floats, resolution: float) -> list[Notice]:
    """What is suspicious about the readings of one test.

    Parameters
    ----------
    values : (H, R) array
        What was read.
    resolution : float
        Of what was read, 0 where it is not stated.

    Returns
    -------
    list of Notice
        What, where, what to change; empty for readings as a bench gives them.
    """
    events = gross_events.of_readings(protocol, values, resolution)
    gross = [Notice(event.kind, event.text) for event in events]
    protocol, values = gross_events.readings_left(protocol, values, events)
    if not protocol.mask.any():
        return gross
    readings = CheckedTest(protocol, values, resolution)
    found = (check(readings) for check in CHECKS[protocol.control])
    suspicious = [Notice("data", sentence) for sentence in found if sentence]
    slack = [Notice("slack", sentence) for sentence in [slack_holds(readings)] if sentence]
    return [*gross, *slack, *suspicious]


def of_experiment(experiment: Experiment) -> list[Notice]:
    """The warnings of one test."""
    protocol, readings = experiment.protocol(), experiment.readings()
    preload_mm = experiment.priors.get("preload", {}).get("fixed")
    found = slack_by_preload(protocol, readings, experiment.resolution, preload_mm)
    found += warnings(protocol, readings, experiment.resolution)
    return [*found, *one_setting(protocol, set(experiment.priors))]


def copied_tests(tests: Mapping[str, CheckedTest]) -> dict[str, list[Notice]]:
    """What is said of each of several tests, by name, whose settings and readings are those of an earlier one.

    Judged or compared together, they count twice.
    """
    names: dict[tuple[bytes, bytes], str] = {}
    found: dict[str, list[Notice]] = {}
    for name, test in tests.items():
        read = test.values[test.protocol.mask]
        settings = test.protocol.setting[test.protocol.recorded]
        first = names.setdefault((settings.tobytes(), read.tobytes()), name)
        if first != name and np.unique(read).size >= COPIED_TEST:
            text = (
                f"its readings are those of experiment {first} once more: judged or compared together they count "
                "twice, and what is said of both is surer than it may be; leave one of the two out"
            )
            found[name] = [Notice("data", text)]
    return found


def one_setting(protocol: Protocol, stated: Set[str]) -> list[Notice]:
    """What holds of one setting leave open: the stiffness or the preload, unless one of them is stated.

    Parameters
    ----------
    stated : set of str
        Parameters with a prior of the user's own.
    """
    settings = protocol.setting[protocol.recorded]
    if not settings.size or np.ptp(settings) > ONE_SETTING * settings.max() or stated & {"k1", "preload"}:
        return []
    if settings.size == 1:
        return [Notice("prior", ONE_HOLD)]
    which = "holds of one weight" if protocol.control == "force" else "holds at one displacement"
    return [Notice("prior", f"{which} do {_OPEN}")]


def run_on_times(readings: CheckedTest) -> str:
    """Time of the test in place of time in the hold, where there are too few readings to be certain."""
    p = readings.protocol
    if times_run_on([row[mask] for row, mask in zip(p.time_s, p.mask, strict=True)]) >= RUN_ON:
        return ""
    return (
        "the reading times of every hold begin after those of the hold before: time_s counts from the beginning of "
        "each hold, so subtract the moment each hold began if these are times of the whole test"
    )


def negative_tension(readings: CheckedTest) -> str:
    """Tensions below zero by more than a sensor's noise and offset."""
    lowest = np.array([row.min() for row in readings.each])
    worst = int(lowest.argmin())
    largest = max(float(np.abs(row).max()) for row in readings.each)
    spread = FLAT * max(readings.noise, float(np.ptp(readings.each[worst])))  # too few readings may hide the noise
    if -lowest[worst] <= max(NEGATIVE * largest, spread):
        return ""
    return (
        f"tension falls to {short(lowest[worst], 4)} N in hold {readings.number[worst]}, while a wire only pulls and "
        "a slack one reads 0 N: check the sign of tension_N and where it was zeroed"
    )


def slack_holds(readings: CheckedTest) -> str:
    """Holds in which the wire pulls with next to nothing; where it does so throughout, another check says it."""
    if readings.protocol.control == "force":
        return ""
    least = slack_below(readings)
    nothing = [bool(np.abs(row).min() <= least) for row in readings.each]  # far below zero is another mistake
    numbers = [str(number) for number, slack in zip(readings.number, nothing, strict=True) if slack]
    largest = max(float(row.max()) for row in readings.each)
    if not numbers or largest <= least:
        return ""
    return (
        f"the wire pulls with next to nothing in hold{'s' * (len(numbers) > 1)} {some_of(numbers)} "
        f"({short(least, 2)} N or less): a slack wire shows neither stiffness nor creep, and where it goes slack "
        "within a hold, intervals are too narrow; test it where it stays taut"
    )


def falls(setting: Floats, readings: Floats) -> bool:
    """Whether the readings of holds, each (H,), fall as what is set rises."""
    changes = np.ptp(setting) > 0 and np.ptp(readings) > 0
    return bool(changes and np.corrcoef(setting, readings)[0, 1] < FALLS)


def unresponsive_tension(readings: CheckedTest) -> str:
    """Tension that does not follow the displacement, or follows it the wrong way."""
    means, place, noise = readings.means, readings.setting, readings.noise
    span = np.ptp(place)
    if span == 0 and len(place) > 1:
        return "all holds have the same displacement_mm: without a step the stiffness cannot be known"
    largest = max(row.max() for row in readings.each)
    if largest <= FLAT * noise:
        return (
            f"no reading stands out from the scatter within the holds ({short(noise, 2)} N): the wire was slack "
            "throughout, or rows of other tests are mixed in"
        )
    if len(means) > 1 and np.ptp(means) <= FLAT * noise:
        return (
            f"tension stays at {short(means.mean(), 4)} N while the displacement changes by {span:g} mm: "
            "check that tension_N is this wire's, and the wire's clamps"
        )
    begins = np.array([row[0] for row in readings.each])
    ends = np.array([row[-1] for row in readings.each])
    jumps = begins[1:] - ends[:-1]
    moves = np.diff(place)
    if (jumps * moves).sum() < 0 and len(means) > 2 and falls(place, means):
        return "tension falls as the displacement rises: check the sign of displacement_mm and of tension_N"
    return ""


def elongation(readings: CheckedTest) -> str:
    """Displacements that do not follow the weights, or follow them the wrong way."""
    means, weights = readings.means, readings.setting
    if np.ptp(weights) == 0 and len(weights) > 1:
        return "all holds have the same tension_N: without another weight the stiffness cannot be known"
    if falls(weights, means):
        return "the displacement falls as the weight rises: check the sign of displacement_mm"
    if len(means) > 1 and np.ptp(means) <= FLAT * readings.noise:
        return (
            f"the displacement stays at {short(means.mean(), 4)} mm while the weight changes by {np.ptp(weights):g} N: "
            "check that displacement_mm is this wire's, and the gauge"
        )
    return ""


def strain_scale(readings: CheckedTest) -> str:
    """Displacements so small or large beside the length that one of the two is in another unit."""
    place = readings.means if readings.protocol.control == "force" else readings.setting
    strain = np.ptp(place) / readings.protocol.length_mm
    if np.ptp(readings.setting) == 0.0 or strain == 0.0 or LEAST_STRAIN <= strain <= LARGEST_STRAIN:
        return ""
    much = "only " if strain < LEAST_STRAIN else ""
    return (
        f"the displacements differ by {much}{short(strain, 2)} of the wire's length of "
        f"{readings.protocol.length_mm:g} mm: check that displacement_mm and length_mm are both in mm"
    )


def rising(readings: CheckedTest) -> str:
    """Tension that rises within holds on loading, where creep lets it fall."""
    each, noise = readings.each, readings.noise
    rises = []
    for j, row in enumerate(each):
        # a hold that begins below the end of the one before has creep to give back
        goes_up = j == 0 or (_is_furthest(readings.setting, j) and row[0] > each[j - 1][-1])
        is_taut = len(row) > 1 and row[0] > FLAT * noise
        if goes_up and is_taut:
            rises.append(row[-1] - row[0])
    if len(rises) < RISING_HOLDS:
        return ""
    found = _in_most(rises, noise)
    if found is None:
        return ""
    holds, middle = found
    return (
        f"tension rises within {holds} of {len(rises)} holds on loading, by {short(middle, 3)} N in "
        "the middle, while a held wire relaxes: check that time_s runs forward, and the sensor and the room for drift"
    )


def _is_furthest(setting: Floats, j: int) -> bool:
    """Whether the setting of a hold is above those of all before it."""
    return j == 0 or bool(setting[j] > setting[:j].max())


def _in_most(changes: Sequence[float], noise: float) -> tuple[int, float] | None:
    """The number of holds in which something grows, and the middle growth; None where it grows in few, or by little."""
    grown = sum(change > 0 for change in changes)
    middle = float(np.median(changes))
    if grown / len(changes) < RISING_SHARE or middle <= RISE * noise:
        return None
    return int(grown), middle


def creeping_back(readings: CheckedTest) -> str:
    """Displacement that falls within holds of ever larger weights, under which a wire creeps on."""
    falls = []
    for j, row in enumerate(readings.each):
        if len(row) > 1 and _is_furthest(readings.setting, j):
            falls.append(row[0] - row[-1])
    if len(falls) < SHRINKING_HOLDS:
        return ""
    found = _in_most(falls, readings.noise)
    if found is None:
        return ""
    holds, middle = found
    return (
        f"the displacement falls within {holds} of {len(falls)} holds under ever larger weights, by "
        f"{short(middle, 3)} mm in the middle, while a loaded wire creeps on: check that displacement and "
        "tension are not interchanged, that time_s runs forward, and the gauge and the room for drift"
    )


def jump_within_a_hold(readings: CheckedTest) -> str:
    """A change from one reading to the next out of its hold's course, which stays: no wire does that by itself."""
    control = readings.protocol.control
    for j, (row, time) in enumerate(zip(readings.each, readings.times_s, strict=True)):
        at = _jump(row, time, readings.noise)
        if at is None:
            continue
        moved = (
            "if the wire was tightened or let out, begin a new hold there, with the displacement it then had; if the "
            "sensor was zeroed, correct the readings from there on"
            if control == "displacement"
            else "if the gauge or the hook was touched, correct the readings from there on"
        )
        return (
            f"{READ[control].split('_')[0]} jumps from {short(row[at], 5)} to {short(row[at + 1], 5)} "
            f"{readings.unit} between {time[at]:g} and {time[at + 1]:g} s of hold {readings.number[j]}, out of the "
            f"hold's course, and stays there: {moved}"
        )
    return ""


def _jump(row: Floats, time_s: Floats, noise: float) -> int | None:
    """The reading of a hold (r,) after which it jumps, if it does: against the hold's course, or faster than that goes.

    Creep may be over after the first reading, and the last one may be a misprint.
    """
    change = np.diff(row)
    sizes, way = np.abs(change), np.sign(change)
    speed = sizes / np.diff(time_s)
    for i in range(1, len(change) - 1):
        beside = [i - 1, i + 1]
        usual = max(ISOLATED * noise, JUMP * sizes[beside].max())
        if sizes[i] <= usual:
            continue
        others = change.sum() - change[i]
        against = others * way[i] <= FLAT * noise
        # after a burst of readings a pause shows more change than they do, and is no faster
        faster = 1.0 if against else FASTER
        if speed[i] <= faster * speed[beside].max():
            continue
        later = (row[i + 1 :] - row[i]) * way[i]
        stays = later > JUMP_STAYS * sizes[i]
        if stays.all():
            return i
    return None


def off_grid(readings: CheckedTest) -> str:
    """Readings finer than the resolution they are said to have."""
    resolution = readings.resolution
    changes = np.concatenate([np.abs(np.diff(row)) for row in readings.each])
    if not resolution or len(changes) < 3:
        return ""
    finer = (changes > 0.01 * resolution) & (changes < 0.5 * resolution)
    span = np.ptp(np.concatenate(readings.each))
    in_a_step = 0.0 < span <= resolution
    if finer.mean() <= OFF_GRID and not in_a_step:
        return ""
    key = f"resolution_{readings.unit}"
    column = READ[readings.protocol.control]
    return (
        f"readings change by less than {key} = {resolution:g}: check {key}, and that both it and "
        f"{column} are in {readings.unit}"
    )


def repeated(readings: CheckedTest) -> str:
    """The same readings at two displacements, as rows that were copied and not changed leave them."""
    known: dict[tuple[float, ...], int] = {}
    for j, row in enumerate(readings.each):
        if len(set(row.tolist())) < COPIED_HOLD:
            continue
        first = known.setdefault(tuple(row.tolist()), j)
        if readings.setting[first] != readings.setting[j]:
            a, b = readings.number[first], readings.number[j]
            what = "weights" if readings.protocol.control == "force" else "displacements"
            return f"holds {a} and {b} have the same {len(row)} readings at two {what}: check that none is a copy"
    return ""


CHECKS: dict[Control, tuple[Callable[[CheckedTest], str], ...]] = {
    "displacement": (
        run_on_times,
        negative_tension,
        unresponsive_tension,
        strain_scale,
        outlier,
        jump_within_a_hold,
        zero_shift,
        rising,
        off_grid,
        repeated,
    ),
    "force": (
        run_on_times,
        elongation,
        strain_scale,
        outlier,
        jump_within_a_hold,
        zero_shift,
        creeping_back,
        off_grid,
        repeated,
    ),
}
