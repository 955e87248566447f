"""The models behind an ambiguous answer: their probabilities and where their posteriors are stored."""

from collections.abc import Sequence
from pathlib import Path

from wirebayes.io.run_folder import read_json, stored_results, write_json
from wirebayes.json_files.mixture import Member, MixtureJson
from wirebayes.results import read_back
from wirebayes.results.read_back import Stored

FILE = "mixture.json"


def write_mixture(folder: Path, members: Sequence[tuple[str, float, Sequence[str]]]) -> None:
    """Write which models a final posterior is one of.

    Parameters
    ----------
    folder : Path
        Of the final posterior.
    members : sequence of (folder, probability, effects)
        Folders below `folder`, ``.`` for the final posterior itself; the probabilities sum to one.
    """
    rows: list[Member] = [{"folder": f, "probability": p, "effects": list(effects)} for f, p, effects in members]
    content: MixtureJson = {"members": rows}
    write_json(folder / FILE, content)


def members_of(folder: Path) -> list[tuple[float, Path]]:
    """Probability and folder of every model that a posterior stands for; itself alone where nothing is undecided.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    InputError
        The file that lists them is damaged.
    """
    path = folder / FILE
    if not path.is_file():
        return [(1.0, folder)]
    content: MixtureJson = read_json(path)
    with stored_results(path):
        first, *others = content["members"]
        return [(float(model["probability"]), folder / model["folder"]) for model in (first, *others)]


def load_models(
    folder: Path, experiment: str | None = None, own_effects: Path | None = None
) -> list[tuple[float, Stored]]:
    """The posterior of every model that a posterior stands for, with its probability.

    Parameters
    ----------
    folder : Path
        Of the final posterior.
    experiment, own_effects
        As for `wirebayes.results.read_back.load_posterior`.
    """
    models = []
    for probability, place in members_of(folder):
        models.append((probability, read_back.load_posterior(place, experiment, own_effects)))
    return models
