"""What a plan takes from the folder of a fit or a discover: guess, laws, priors, and what is undecided."""

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from wirebayes.commands.predict import find_posterior
from wirebayes.errors import InputError
from wirebayes.io.experiment import Experiment
from wirebayes.io.readings import Hold
from wirebayes.io.run_folder import CONFIGURATION, read_json
from wirebayes.json_files.discovery import DiscoveryJson
from wirebayes.model.sample import Sample
from wirebayes.model.spec import PLAIN_SPEC, ModelSpec
from wirebayes.numeric.frozen import frozen
from wirebayes.planning.guess import GuessedWire, from_posterior
from wirebayes.result_warnings import Notice
from wirebayes.results import read_back
from wirebayes.results.mixture import load_models
from wirebayes.results.read_back import Stored
from wirebayes.sentences import spoken
from wirebayes.wire.effect import Effect


def earlier_posterior(folder: Path, name: str | None, own: Path | None) -> tuple[Stored, Path]:
    """The posterior of a fit, or the plain one of what discover found, and where it lies.

    Parameters
    ----------
    folder : Path
        That `fit` or `discover` wrote.
    name : str or None
        Of the experiment; may be left out where there is one.
    own : Path or None
        File of a user's own effects.

    Raises
    ------
    InputError
        There is no such posterior, or it is of single holds.
    """
    which, place = find_posterior(folder, name, "plain" if _discovered(folder) else None)
    stored = read_back.load_posterior(place, which, own)
    if stored.likelihood == "hold":
        message = "found a fit with --likelihood hold, which knows no preload and no setting error, expected a chain"
        raise InputError(f"{folder}: {message}")
    return stored, place


def decided_posterior(
    folder: Path, name: str | None, own: Path | None, aim: Sequence[str]
) -> tuple[Stored, Path] | None:
    """The final posterior of what discover found, and where it lies; None where a test is to decide on its effects.

    Parameters
    ----------
    folder, name, own
        As for `earlier_posterior`.
    aim : sequence of str
        Effects between which tests are to decide, if they are.
    """
    if not _discovered(folder):
        return None
    which, place = find_posterior(folder, name, "final")
    models = load_models(place, which, own)
    _, final = models[0]
    effects = final.sample.model.effects
    if len(models) == 1 and all(lasts(effect) and effect.name not in aim for effect in effects):
        return final, place
    return None


def _discovered(folder: Path) -> bool:
    return any(folder.glob("**/plain/posterior.nc"))


def lasts(effect: Effect) -> bool:
    """Whether another test would show it, too: what happened once does not happen again."""
    return effect.scope in ("material", "instrument")


def guess_by(stored: Stored, folder: Path, n: int, effects: tuple[Effect, ...]) -> GuessedWire:
    """The guess by a posterior.

    Parameters
    ----------
    stored : Stored
    folder : Path
        Where it comes from, for people.
    n : int
        Number of draws.
    effects : tuple of Effect
        Those of the fit that tests are planned with; a notice says which are left out.
    """
    sample = stored.sample
    source = f"the posterior of {sample.name} in {folder.name}"
    if effects:
        names = ", ".join(spoken(effect.name) for effect in effects)
        source = f"{source}, with {names}"
    model = replace(sample.model, effects=effects)
    guess = from_posterior(stored.draws, sample.protocol.length_mm, source, n, model)
    doubts = (*stored.doubts, *_left_out(sample, effects))
    return replace(guess, doubts=doubts, control=sample.protocol.control)


def _left_out(sample: Sample, kept: tuple[Effect, ...]) -> list[Notice]:
    """That tests are planned without some effects of the fit, if they are."""
    left = [effect for effect in sample.model.effects if effect not in kept]
    if not left:
        return []
    effects = ", ".join(spoken(effect.name) for effect in left)
    text = (
        f"{sample.name} was fitted with {effects}: the plan simulates and fits without, and a fit of the whole model "
        "may know the parameters several times less well than is said"
    )
    return [Notice("left-out", text)]


def spec_of_fit(sample: Sample, asked: ModelSpec, folder: Path) -> ModelSpec:
    """The plain model of an earlier fit, which its draws belong to.

    Parameters
    ----------
    sample : Sample
        What was fitted.
    asked : ModelSpec
        Laws that were asked for.
    folder : Path
        Of the fit, for messages.

    Raises
    ------
    InputError
        Other laws were asked for.
    """
    model = sample.model
    options = (
        ("--elastic-law", asked.law, PLAIN_SPEC.law, model.law),
        ("--history", asked.history, PLAIN_SPEC.history, model.history),
    )
    for option, wanted, left_out, fitted in options:
        if wanted not in (left_out, fitted):
            raise InputError(f"{option}: found {wanted}, expected {fitted}, with which {folder} was fitted")
    return replace(asked, law=model.law, history=model.history)


def priors_of_fit(place: Path, name: str) -> dict[str, dict[str, Any]]:
    """What was stated before a fit whose posterior lies here: its configuration is there or just above."""
    here = place.absolute()
    for folder in (here, *list(here.parents)[:2]):
        file = folder / CONFIGURATION
        if file.is_file():
            priors: dict[str, dict[str, dict[str, Any]]] = read_json(file).get("priors", {})
            return priors.get(name, {})
    return {}


def undecided_effects(findings: Path, name: str) -> list[str]:
    """The effects between which a discovery did not decide, each once."""
    if not findings.is_file():
        return []
    report: DiscoveryJson = read_json(findings)
    if name not in report["experiments"]:
        return []
    found = report["experiments"][name]
    return list(dict.fromkeys([*found["set"], *found["group"]]))


def experiment_measured(sample: Sample, folder: Path) -> Experiment:
    """The experiment of a stored posterior, without its readings' temperatures."""
    protocol = sample.protocol
    holds = tuple(_hold(sample, row) for row in range(len(protocol.mask)))
    return Experiment(
        sample.name, sample.material, protocol.length_mm, sample.resolution, holds, folder, control=protocol.control
    )


def _hold(sample: Sample, row: int) -> Hold:
    """One hold of a stored posterior."""
    protocol = sample.protocol
    mask = protocol.mask[row]
    recorded = bool(mask.any())
    number = int(protocol.number[row]) if recorded else None
    times = protocol.time_s[row][mask]
    readings = sample.readings[row, :, 0][mask]
    temperatures = None
    if protocol.warming_K is not None and protocol.reference_C is not None and recorded:
        warm = protocol.warming_K[row][mask] + protocol.reference_C
        temperatures = frozen(warm.tolist())
    return Hold(
        number,
        float(protocol.setting[row]),
        float(protocol.duration_s[row]),
        frozen(times.tolist()),
        frozen(readings.tolist()),
        temperatures,
        float(protocol.start_s[row]),
        protocol.control,
    )
