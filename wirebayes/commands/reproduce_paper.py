"""The paper, with posteriors."""

from wirebayes.commands.options import check_seed
from wirebayes.inference.policy import DEFAULT, Policy
from wirebayes.processes.workers import computing
from wirebayes.progress import Progress, silent
from wirebayes.strict.files import PathLike, given_path
from wirebayes.views.reproduction import Reproduction
from wirebayes.views.result import ResultFolder


def reproduce_paper(
    output: PathLike, *, seed: int = 0, progress: Progress | None = None, policy: Policy | None = None
) -> Reproduction:
    """Everything the paper shows, on its own tables, with posteriors.

    Parameters
    ----------
    output : path
        Folder for the page ``report.html``, the tables, the pictures and a folder for each fit.
    seed : int
    progress : function of (name, done, total), optional
    policy : Policy, optional
        How many walkers and draws; what the command uses when left out.

    Returns
    -------
    Reproduction
        ``posteriors`` holds every fit; `summary` the rows of each table.

    Raises
    ------
    InputError
        The folder belongs to something else.

    Examples
    --------
    >>> paper = wb.reproduce_paper("out/reproduce")  # doctest: +SKIP
    >>> paper.posteriors["nylon-1.5m/chain"].summary()["converged"]  # doctest: +SKIP
    True
    """
    from wirebayes.paper.run import reproduce  # matplotlib only where it is needed

    place = ResultFolder(given_path("output", output))
    with computing():
        lines = reproduce(place.path, check_seed(seed), progress or silent, policy or DEFAULT)
    return Reproduction(place, not_converged=tuple(lines))
