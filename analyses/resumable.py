"""Studies of many cases that write a line of JSON for each, so that an interrupted run goes on where it ended."""

import argparse
import json
import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import Any

from wirebayes.io.run_folder import write_json

Record = dict[str, Any]
Case = tuple[Any, ...]


def records(
    path: Path, run: Callable[..., Record], cases: Iterable[Case], keys: Sequence[str] = ("index",), workers: int = 1
) -> list[Record]:
    """The records of all cases: those that the file holds, then the others as they are computed.

    Parameters
    ----------
    path : Path
        A line for each record; its folder is made where there is none.
    run : function
        Takes a case's values and returns its record; with several workers one that can be pickled.
    cases : iterable of tuples
    keys : sequence of str
        Where a record holds the values of its case.
    workers : int
        Processes; 1 computes in this one.
    """
    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    path.parent.mkdir(parents=True, exist_ok=True)
    found: list[Record] = [json.loads(line) for line in path.read_text().splitlines()] if path.exists() else []
    done = {tuple(record[key] for key in keys) for record in found}
    with path.open("a") as file:
        for record in _computed(run, [case for case in cases if case not in done], workers):
            found.append(record)
            file.write(json.dumps(record) + "\n")
            file.flush()
    return found


def study(
    doc: str | None,
    name: str,
    counted: tuple[str, int],
    one: Callable[[int, int], Record],
    summary: Callable[[Sequence[Record]], Record],
) -> None:
    """The command of a study of numbered cases: its options, its records, and their summary, printed and written.

    Parameters
    ----------
    doc : str
        What ``--help`` says.
    name : str
        Of its folder in ``out`` and of the file of its summary.
    counted : (str, int)
        What is counted, which is the option of its number, and how many there are when it is left out.
    one : function of seed and number
        Computes a case; its record has the number as ``index``.
    summary : function of records
    """
    what, usual = counted
    folder = Path("out") / name
    parser = argparse.ArgumentParser(description=doc, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument(f"--{what}", type=int, default=usual, dest="count")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--rows", type=Path, default=folder, help="where an interrupted run goes on")
    parser.add_argument("--output", type=Path, default=folder / f"{name}.json")
    options = parser.parse_args()
    path = options.rows / f"rows-seed{options.seed}.jsonl"
    cases = [(index,) for index in range(options.count)]
    rows = records(path, partial(one, options.seed), cases, workers=options.workers)
    result = summary(sorted(rows, key=lambda row: row["index"])[: options.count])
    write_json(options.output, result)
    print(json.dumps(result, indent=1))


def _computed(run: Callable[..., Record], cases: Sequence[Case], workers: int) -> Iterator[Record]:
    if workers == 1:
        yield from (run(*case) for case in cases)
        return
    with ProcessPoolExecutor(workers, get_context("spawn")) as pool:
        for future in [pool.submit(run, *case) for case in cases]:
            yield future.result()
