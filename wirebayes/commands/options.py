"""The arguments of the public functions, checked and brought into one form."""

import os
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any, get_args

import numpy as np

from wirebayes.errors import InputError, shown
from wirebayes.inference.policy import Policy
from wirebayes.io import gross_events
from wirebayes.io.experiment import ENOUGH, Experiment, enough, folder_key, holds_and_readings
from wirebayes.io.experiment_file import SAME_FOLDER, read_experiments, select
from wirebayes.model.build import build
from wirebayes.model.prior_names import check_prior_names
from wirebayes.model.sample import Likelihood
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.strict.files import PathLike, given_path
from wirebayes.strict.hint import hint
from wirebayes.wire.effect import Effect, Kinds
from wirebayes.wire.laws import ElasticLaw, History

Source = PathLike | Experiment | Sequence[Experiment]
Numbers = (
    str | float | Sequence[float] | Sequence[float | None]
)  # text is what the command line was given: it stands in the configuration


def path_of(value: PathLike | None, option: str = "own_effects") -> Path | None:
    """A path, where there is one."""
    return None if value is None else given_path(option, value)


def names_given(option: str, value: str | Iterable[str] | None) -> tuple[str, ...]:
    """Names, of which one may stand alone.

    Parameters
    ----------
    option : str
        Its name, for the message.
    value : str, or iterable of str, or None

    Raises
    ------
    InputError
        Something among them is no text.
    """
    if value is None:
        return ()
    if isinstance(value, str) or not isinstance(value, Iterable):
        value = (value,)
    names = tuple(value)
    for name in names:
        if not isinstance(name, str):
            raise InputError(f"{option}: found {shown(name)}, expected a name or several")
    return names


def experiments_of(
    source: Source, name: str | None = None, *, train_holds: int | None = None, drop_breaks: bool = False
) -> list[Experiment]:
    """The experiments of a file, or those given, or the named one of them.

    Parameters
    ----------
    source : path, Experiment, or sequence of Experiment
    name : str, optional
    train_holds : int, optional
        How many of the first recorded holds are kept; all when left out.
    drop_breaks : bool
        Whether readings of breaks, limits and dropouts are left out.

    Raises
    ------
    InputError
        The file is wrong, there is no such experiment, or two have one name; what is left out leaves too few readings.
    """
    experiments = _experiments_of(source, name)
    if drop_breaks:
        experiments = [without_breaks(e) for e in experiments]
    return experiments if train_holds is None else [e.first(train_holds) for e in experiments]


def data_of(experiments: Iterable[Experiment]) -> dict[str, dict[str, Any]]:
    """What a configuration says of the experiments: the priors of their files, and hashes of what was read."""
    experiments = list(experiments)
    return {
        "priors": {e.name: e.priors for e in experiments},
        "data_sha256": {e.name: e.data_hash for e in experiments},
    }


def check_priors(
    experiments: Sequence[Experiment], kinds: Kinds, effects: Sequence[Effect] = (), spec: ModelSpec = PLAIN_SPEC
) -> None:
    """Refuse priors of a file that are malformed, or name nothing.

    Parameters
    ----------
    experiments : sequence of Experiment
        Of one fit.
    kinds : mapping of name to Effect
        All effects that a model may have: a prior may be of one that this fit has not.
    effects : sequence of Effect
        Those that this fit has.
    spec : ModelSpec

    Raises
    ------
    InputError
        With file, line and key.
    """
    check_prior_names(experiments, kinds)
    build(experiments, effects, spec)


def other_effort(policy: Policy | None, simulations: int | None = None) -> dict[str, Any]:
    """What a configuration says of the numbers of draws and simulations, where they are not the command's own."""
    found: dict[str, Any] = {} if policy is None else {"policy": vars(policy)}
    return found if simulations is None else found | {"simulations": simulations}


def without_breaks(experiment: Experiment) -> Experiment:
    """The experiment without the readings of its gross events.

    Raises
    ------
    InputError
        There are too few others.
    """
    kept = gross_events.without_gross_events(experiment, gross_events.gross_events_of(experiment))
    if not enough(kept.holds):
        found = f"{holds_and_readings(kept.holds)} beside breaks, limits and dropouts"
        raise InputError(f"{experiment.source}, experiment {experiment.name}: found {found}, expected {ENOUGH}")
    return kept


def _experiments_of(source: Source, name: str | None) -> list[Experiment]:
    if isinstance(source, str | os.PathLike):
        read = read_experiments(Path(source))
        return select(read, name)
    if isinstance(source, Experiment):
        return select([source], name)
    experiments = list(source) if isinstance(source, Iterable) else [source]
    for value in experiments:
        if not isinstance(value, Experiment):
            raise InputError(f"source: found {type(value).__name__}, expected the path of a file or Experiments")
    names = [e.name for e in experiments]
    if not names or len(set(names)) < len(names):
        found = ", ".join(names) or "nothing"
        raise InputError(f"source: found {found}, expected experiments of different names")
    if len(set(map(folder_key, names))) < len(names):
        raise InputError(f"source: found {', '.join(names)}, expected names that differ more: {SAME_FOLDER}")
    return select(experiments, name)


def check_seed(seed: int) -> int:
    """The seed as a Python integer, 0 or more."""
    return check_whole("seed", seed, 0)


def check_whole(option: str, value: int, least: int, most: float = float("inf")) -> int:
    """A whole number as a Python integer.

    Parameters
    ----------
    option : str
        Its name, for the message.
    value, least : int
        What was given, and the smallest that it may be.
    most : number
        The largest.
    """
    if isinstance(value, bool) or not isinstance(value, int | np.integer) or not least <= value <= most:
        allowed = f", {least} or more" if most == float("inf") else f" from {least} to {most}"
        raise InputError(f"{option}: found {value!r}, expected a whole number{allowed}")
    return int(value)


def check_train_holds(holds: int | None) -> int | None:
    """How many holds to learn from, as a Python integer."""
    if holds is not None and (isinstance(holds, bool) or not isinstance(holds, int | np.integer)):
        raise InputError(f"train_holds: found {holds!r}, expected a whole number of holds or None")
    return None if holds is None else int(holds)


def check_choice(option: str, value: str, known: Sequence[str]) -> None:
    """Refuse a value that an option does not have.

    Parameters
    ----------
    option : str
        Its name, for the message.
    value : str
    known : sequence of str
        The values that it may have.

    Raises
    ------
    InputError
        With the nearest known value as a hint.
    """
    if value not in known:
        meant = hint(value, known) if isinstance(value, str) else ""
        raise InputError(f"{option}: found {value!r}{meant}, expected {' or '.join(known)}")


def model_spec(elastic_law: ElasticLaw, history: History, likelihood: Likelihood = "chain") -> ModelSpec:
    """The model that is asked for.

    Parameters
    ----------
    elastic_law, history, likelihood : str
        As the user spells them.

    Raises
    ------
    InputError
        One is not among the values that it may have.
    """
    check_choice("elastic_law", elastic_law, get_args(ElasticLaw))
    check_choice("history", history, get_args(History))
    check_choice("likelihood", likelihood, get_args(Likelihood))
    return ModelSpec(elastic_law, history, likelihood)


def check_history(effect: Effect, history: History) -> None:
    """Refuse an effect that needs a total of the creep beside a history that has none."""
    if effect.needs_saturation and history == "additive":
        why = "creep that is added anew in every hold has no total"
        raise InputError(f"--effect {effect.key}: found --history additive, expected saturating: {why}")


def text_of(values: Numbers) -> str:
    """Numbers as the command line spells them."""
    if isinstance(values, str):
        return values
    return ",".join(map(_spelled, np.atleast_1d(np.asarray(values, dtype=object))))


def _spelled(value: Any) -> str:
    """A number as the command line has it; anything else as it shows itself, for the message that refuses it."""
    try:
        return repr(float(value)).removesuffix(".0")
    except (TypeError, ValueError):
        return str(value)


def numbers(option: str, values: Numbers, count: int | None = None) -> Any:
    """Finite numbers, `count` of them where it is given; text has commas between them.

    Parameters
    ----------
    option : str
        Its name, for the message.
    values : str, number or sequence of numbers
    count : int, optional

    Returns
    -------
    (count,) array

    Raises
    ------
    InputError
    """
    text = text_of(values)
    try:
        found = np.array([float(word) for word in text.split(",")])
    except ValueError:
        found = np.array([np.nan])
    if not np.isfinite(found).all() or (count is not None and len(found) != count):
        raise InputError(f"{option}: found {text!r}, expected {count or 'some'} finite numbers separated by commas")
    return found


def rising_times(values: Numbers) -> Any:
    """Seconds that rise, from ``times``."""
    found = numbers("--times", values)
    if found[0] < 0 or np.any(np.diff(found) <= 0):
        raise InputError(f"--times: found {text_of(values)!r}, expected rising times from 0 on")
    return found


def check_spread(value: float, *, alike: bool = True) -> float:
    """A relative difference between specimens, below 1; above 0 where they may not be `alike`."""
    expected = f"a number {'from 0' if alike else 'above 0'} and below 1, 0.05 for 5 %"
    value = one_number("--specimen-spread", value, expected)
    if not 0.0 <= value < 1.0 or (value == 0.0 and not alike):
        raise InputError(f"--specimen-spread: found {value:g}, expected {expected}")
    return value


def one_number(option: str, value: float, expected: str) -> float:
    """A number as a Python float, finite or not.

    Parameters
    ----------
    option : str
        Its name, for the message.
    value : float
    expected : str
        What it may be, for the message.

    Raises
    ------
    InputError
        It is no number.
    """
    try:
        if not isinstance(value, str | bool):
            return float(value)
    except (TypeError, ValueError):
        pass
    raise InputError(f"{option}: found {shown(value)}, expected {expected}")


def above_zero(*options: tuple[str, float]) -> list[float]:
    """The values as Python floats; what is not a finite number above zero is refused."""
    expected = "a finite number above 0"
    values = [one_number(name, value, expected) for name, value in options]
    for (name, _), value in zip(options, values, strict=True):
        if not 0 < value < float("inf"):
            raise InputError(f"{name}: found {value:g}, expected {expected}")
    return values


def from_zero(*options: tuple[str, float]) -> list[float]:
    """The values as Python floats; what is not a finite number of at least zero is refused."""
    expected = "a finite number of at least 0"
    values = [one_number(name, value, expected) for name, value in options]
    for (name, _), value in zip(options, values, strict=True):
        if not 0 <= value < float("inf"):
            raise InputError(f"{name}: found {value:g}, expected {expected}")
    return values
