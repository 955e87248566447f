"""What was understood of an experiment file, what is suspicious in it, and what such a test can determine."""

import numpy as np

from wirebayes._version import __version__
from wirebayes.commands.options import Source, check_priors, check_seed, data_of, experiments_of, path_of
from wirebayes.discovery.preview import preview
from wirebayes.effects import catalogue, source_of
from wirebayes.inference.fit import seed_of
from wirebayes.io import data_checks
from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import Hold
from wirebayes.io.run_folder import open_run, write_json
from wirebayes.json_files.check import CheckedExperiment, CheckJson, HoldUnderstood, Understood
from wirebayes.json_files.read_units import in_unit
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
from wirebayes.result_warnings import notices_by_part, to_json
from wirebayes.results.hold_ends import hold_ends_notice
from wirebayes.strict.files import PathLike
from wirebayes.views.check import CHECKED, Check
from wirebayes.views.result import ResultFolder
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.effect import Kinds


def check(
    source: Source,
    *,
    experiment: str | None = None,
    own_effects: PathLike | None = None,
    drop_breaks: bool = False,
    seed: int = 0,
    output: PathLike | None = None,
    progress: Progress | None = None,
) -> Check:
    """Say what was understood of an experiment, what is suspicious, and what such a test can and cannot determine.

    The plain model is fitted roughly, in a few seconds an experiment; `fit` and `discover` give the numbers to rely on.

    Parameters
    ----------
    source : path, Experiment, or sequence of Experiment
        What was measured; a path names an experiment file.
    experiment : str, optional
        This experiment only.
    own_effects : path, optional
        A Python file with effects of your own.
    drop_breaks : bool
        Leave out the readings of breaks, of sensors at their limit, and of dropouts.
    seed : int
    output : path, optional
        Folder for ``check.json`` and a picture of each experiment, ``NAME.svg``; a temporary one when left out.
    progress : function of (name, done, total), optional
        Called as the work goes on.

    Returns
    -------
    Check

    Raises
    ------
    InputError
        The file is bad: says where, what was found and what was expected.

    Examples
    --------
    >>> checked = wb.check("experiments.toml", experiment="kite-1.5m")
    >>> checked
    Check(kite-1.5m: 8 holds, 40 readings)
    >>> found = checked.summary()["experiments"]["kite-1.5m"]
    >>> found["holds"][0]["displacement_mm"], found["unrecorded_holds"], found["duration_s"]
    (1.0, 1, 1080.0)
    >>> found["parameters"]["k1"]["determined_by"]
    'data'
    >>> found["effects"]["guide_friction"]["shows"]  # needs unloading
    'no'
    """
    seed = check_seed(seed)
    own = path_of(own_effects)
    report = progress or silent
    experiments = experiments_of(source, experiment, drop_breaks=drop_breaks)
    kinds = catalogue(own)
    for one in experiments:
        check_priors([one], kinds)
    configuration = {
        "command": "check",
        "version": __version__,
        "seed": seed,
        "own_effects": source_of(own),
        **data_of(experiments),
    }
    place = ResultFolder.at(output)
    with open_run(place.path, configuration) as run:
        if run.state != "done":
            from wirebayes.report.pictures.bench import understood  # matplotlib only where it is needed

            found: dict[str, CheckedExperiment] = {}
            for done, one in enumerate(experiments):
                report("check", done, len(experiments))
                name = one.name
                found[name] = _checked(one, kinds, seed_of(seed, name))
                understood(one, place.path / f"{name}.svg")
            report("check", len(experiments), len(experiments))
            content: CheckJson = {"experiments": found, "warnings": notices_by_part(found)}
            write_json(place.path / CHECKED, content)
            run.finish()
    return Check(place, own, computed=run.state != "done")


def _checked(experiment: Experiment, kinds: Kinds, seed: int) -> CheckedExperiment:
    """What was understood of a test, what it can determine, and what is suspicious."""
    with computing():
        previewed = preview(experiment, kinds, np.random.default_rng(seed))
    of_readings = data_checks.of_experiment(experiment)
    of_ends = hold_ends_notice(previewed.hold_ends)
    return {
        **_understood(experiment),
        "warnings": to_json([*of_readings, *previewed.warnings, *of_ends]),
        "parameters": previewed.parameters,
        "effects": previewed.effects,
        "hold_ends": previewed.hold_ends,
    }


def _understood(experiment: Experiment) -> Understood:
    """What the files say, as plain values."""
    recorded = experiment.recorded_holds
    measured = [hold.temperature_C for hold in recorded if hold.temperature_C is not None]
    extremes = None
    if measured:
        temperatures = np.concatenate(measured)
        extremes = [float(temperatures.min()), float(temperatures.max())]
    found: Understood = {
        "material": experiment.material,
        "length_mm": experiment.length_mm,
        "control": experiment.control,
        "resolution_N": experiment.resolution or None,
        "holds": [_hold(hold) for hold in experiment.holds],
        "recorded_holds": len(recorded),
        "unrecorded_holds": len(experiment.holds) - len(recorded),
        "readings": sum(hold.time_s.size for hold in recorded),
        "duration_s": sum(hold.duration_s for hold in experiment.holds),
        "temperature_C": extremes,
    }
    return in_unit(found, READ_UNIT[experiment.control])


def _hold(hold: Hold) -> HoldUnderstood:
    first_s = first = last = None
    if hold.recorded:
        first_s = float(hold.time_s[0])
        first = float(hold.readings[0])
        last = float(hold.readings[-1])
    out: HoldUnderstood = {
        "number": hold.number,
        "start_s": hold.start_s,
        "duration_s": hold.duration_s,
        "readings": int(hold.time_s.size),
        "first_s": first_s,
        "first_N": first,
        "last_N": last,
    }
    if hold.control == "force":
        out["tension_N"] = hold.setting
    else:
        out["displacement_mm"] = hold.setting
    return out
