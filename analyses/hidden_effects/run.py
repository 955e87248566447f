"""Run the benchmark: make the cases, ask, judge, score; every stage resumes where it stopped."""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterable
from concurrent.futures import as_completed
from pathlib import Path
from typing import Any

from wirebayes.processes.workers import executor

from . import cases as case_list
from .ask import ANSWERERS, BASELINES, ask
from .cases import KINDS, SIZES, Spec, build, seal, specs
from .catalogue import EFFECTS
from .files import write_json
from .fitting import held_out_mask, last_third, oracle
from .optimal import judge
from .truth import PROTOCOLS

Job = tuple[Spec, str, str, int | None]  # of asking the simulations, of judging the draws


def read_lines(path: Path) -> dict[str, dict[str, Any]]:
    """Records of a JSON-lines file by key; a line cut short by an interruption is ignored."""
    found: dict[str, dict[str, Any]] = {}
    if path.exists():
        for line in path.read_text(encoding="utf-8").splitlines():
            try:
                record = json.loads(line)
            except json.JSONDecodeError:
                continue
            found[record["key"]] = record
    return found


def append_line(path: Path, record: dict[str, Any]) -> None:
    """Append one record in a single write, on a line of its own even after an interrupted one."""
    path.parent.mkdir(parents=True, exist_ok=True)
    torn = path.exists() and path.stat().st_size > 0 and not path.read_bytes().endswith(b"\n")
    data = ("\n" if torn else "") + json.dumps(record) + "\n"
    handle = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        os.write(handle, data.encode())
    finally:
        os.close(handle)


def _seal(job: Job) -> dict[str, Any]:
    spec, folder, *_ = job
    return {"key": spec.key, "within_reach": seal(spec, Path(folder) / "cases", Path(folder) / "sealed")}


def _ask(job: Job) -> dict[str, Any]:
    spec, folder, how, simulations = job
    return ask(spec, Path(folder) / "cases", how, simulations)


def _judge(job: Job) -> dict[str, Any]:
    spec, *_, draws = job
    case = build(spec)
    assert case is not None
    result = judge(case) if draws is None else judge(case, draws)
    held = last_third(case.rig)
    result["held_out_holds"] = held
    if spec.kind in ("clean", "single"):
        result["held_out"] = oracle(
            case.rig, case.readings, case.hidden, held_out_mask(case.rig, held), result["bench"]
        )
    return result


def work(
    stage: str,
    jobs: list[Job],
    done: Iterable[str],
    path: Path,
    do: Callable[[Job], dict[str, Any]],
    workers: int,
    scheduler: str | None = None,
) -> None:
    """Do the jobs not done yet, in parallel, appending each record as it comes."""
    finished = set(done)
    todo = [job for job in jobs if job[0].key not in finished]
    if not todo:
        return
    begin, shown = time.monotonic(), 0.0
    with executor(scheduler, min(workers, len(todo))) as pool:
        for i, future in enumerate(as_completed([pool.submit(do, job) for job in todo]), 1):
            append_line(path, future.result())
            now = time.monotonic() - begin
            if sys.stderr.isatty() or now - shown > 60 or i == len(todo):
                shown = now
                left = now / i * (len(todo) - i)
                print(f"{stage}: {i}/{len(todo)}, {now:.0f} s, {left:.0f} s to go", file=sys.stderr)


def parser() -> argparse.ArgumentParser:
    """Command line."""
    p = argparse.ArgumentParser(
        prog="python -m analyses.hidden_effects",
        description="Hide effects in simulated tests, ask for them, score the answers.",
        epilog="example: python -m analyses.hidden_effects --size small --answer api bic --output out/hidden_effects",
    )
    p.add_argument("--size", choices=SIZES, default="small", help="how many cases (default small)")
    p.add_argument("--answer", nargs="+", choices=ANSWERERS, default=["api", *BASELINES], help="who is asked")
    p.add_argument("--kinds", nargs="+", choices=KINDS, default=list(KINDS), metavar="KIND", help="parts of the list")
    p.add_argument("--protocols", nargs="+", choices=PROTOCOLS, default=list(PROTOCOLS), metavar="PROTOCOL")
    p.add_argument("--effects", nargs="+", choices=list(EFFECTS), default=list(EFFECTS), metavar="EFFECT")
    p.add_argument("--deltas", nargs="+", type=float, help="sizes of the single effects instead of the plan's")
    p.add_argument("--clean", type=int, help="number of clean cases instead of the plan's")
    p.add_argument("--repeats", type=int, help="repeats of each single effect, protocol and delta")
    p.add_argument("--stage", choices=("cases", "ask", "score", "all"), default="all", help="stop after this stage")
    p.add_argument("--output", type=Path, default=Path("out/hidden_effects"))
    p.add_argument("--workers", type=int, default=2)
    p.add_argument("--simulations", type=int, help="refitted data sets behind a p-value instead of the usual number")
    p.add_argument("--judge-draws", type=int, help="data sets that the ideal judge sees of a case instead of 200")
    p.add_argument("--scheduler", help="address of a Dask scheduler; its workers share this checkout and --output")
    p.add_argument(
        "--seed",
        nargs="+",
        type=int,
        default=[0],
        help="another seed makes other cases of the same plan; several add up",
    )
    return p


def chosen_specs(options: argparse.Namespace) -> list[Spec]:
    """Specifications the command line asks for."""
    plan = SIZES[options.size]
    fields = dict(plan.__dict__)
    if options.clean is not None:
        fields["clean"] = options.clean
    if options.deltas:
        fields["single_deltas"] = tuple(options.deltas)
    if options.repeats:
        fields["repeats"] = options.repeats
    plan = case_list.Plan(**fields)
    parts = tuple(options.kinds), tuple(options.protocols), tuple(options.effects)
    return [spec for seed in options.seed for spec in specs(plan, seed, *parts)]


def main(arguments: list[str] | None = None) -> int:
    """Run the stages asked for and print the table of targets; returns the exit status."""
    from .page import table, write_page
    from .score import score

    for name in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS"):
        os.environ.setdefault(name, "1")
    options = parser().parse_args(arguments)
    folder: Path = options.output
    wanted = chosen_specs(options)
    jobs: list[Job] = [(spec, str(folder), "", None) for spec in wanted]
    reach = folder / "reach.jsonl"
    work("cases", jobs, read_lines(reach), reach, _seal, options.workers, options.scheduler)
    within = {key for key, record in read_lines(reach).items() if record["within_reach"]}
    jobs = [job for job in jobs if job[0].key in within]
    if options.stage == "cases":
        print(f"{len(jobs)} cases in {folder / 'cases'}, {len(wanted) - len(jobs)} out of reach")
        return 0
    for how in options.answer:
        path = folder / "answers" / f"{how}.jsonl"
        answered = [key for key, record in read_lines(path).items() if record["error"] is None]
        work(
            how,
            [(s, f, how, options.simulations) for s, f, *_ in jobs],
            answered,
            path,
            _ask,
            options.workers,
            options.scheduler,
        )
    if options.stage == "ask":
        return 0
    judged = folder / "judged.jsonl"
    jobs = [(s, f, how, options.judge_draws) for s, f, how, _ in jobs]
    work("judge", jobs, read_lines(judged), judged, _judge, options.workers, options.scheduler)
    keys = [spec.key for spec, *_ in jobs]
    truths = {key: json.loads((folder / "sealed" / f"{key}.json").read_text(encoding="utf-8")) for key in keys}
    lost = [spec for spec in wanted if spec.key not in within]
    results = {
        how: score(truths, read_lines(judged), read_lines(folder / "answers" / f"{how}.jsonl"))
        for how in options.answer
    }
    write_json(folder / "scores.json", {"out_of_reach": [s.__dict__ | {"key": s.key} for s in lost], **results})
    write_page(folder / "page.html", results, lost)
    for how, result in results.items():
        print(table(how, result))
    print(f"page: {folder / 'page.html'}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
