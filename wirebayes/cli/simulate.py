"""``wirebayes simulate``: synthetic tests with known truth, as files the other commands read."""

from typing import Annotated

import typer

from wirebayes.cli.options import ElasticLawOption, HistoryOption, Output, OwnEffects, Seed


def simulate(
    output: Output,
    seed: Seed = 0,
    tests: Annotated[
        int, typer.Option("--tests", min=1, help="Number of lines tested, each with its own true parameters.")
    ] = 1,
    lengths: Annotated[
        str,
        typer.Option(
            "--lengths", metavar="MM,…", help="Zero-tension lengths; one sample of each line for each length."
        ),
    ] = "1000",
    displacements: Annotated[
        str, typer.Option("--displacements", metavar="MM,…", help="One displacement per hold.")
    ] = "1,2,3,4,5,6,7,8,9,10,11,12",
    unload: Annotated[
        int, typer.Option("--unload", min=0, metavar="K", help="Then K holds back down through the same displacements.")
    ] = 0,
    times: Annotated[str, typer.Option("--times", metavar="S,…", help="Reading times of a hold.")] = "0,30,60,90,120",
    unrecorded: Annotated[
        list[int] | None, typer.Option("--unrecorded", metavar="HOLD", help="A hold without readings; may be repeated.")
    ] = None,
    temperature: Annotated[
        str, typer.Option("--temperature", metavar="C,…", help="Temperatures at evenly spaced moments of the test.")
    ] = "",
    resolution: Annotated[
        float, typer.Option("--resolution", min=0.0, metavar="N", help="Rounding of the tensions; 0: unrounded.")
    ] = 0.01,
    parameter: Annotated[
        list[str] | None,
        typer.Option(
            "--parameter",
            metavar="NAME=VALUE",
            help="For example k1=700; parameters not given are drawn from the prior.",
        ),
    ] = None,
    effect: Annotated[
        list[str] | None,
        typer.Option(
            "--effect", metavar="NAME.p=VALUE", help="For example strain_stiffening.c=12 or grip_slip@7.w=0.2."
        ),
    ] = None,
    own_effects: OwnEffects = None,
    elastic_law: ElasticLawOption = "hooke",
    history: HistoryOption = "saturating",
) -> None:
    """Write synthetic tests: DIR/experiments.toml, a CSV for each test, and DIR/truth.json."""
    from wirebayes import __version__
    from wirebayes.effects import catalogue, source_of
    from wirebayes.errors import InputError
    from wirebayes.io.run_folder import check_run, open_run
    from wirebayes.simulation.synthetic import Bench, Truth, draw, effect_option, number, write

    chosen: dict[str, float] = {}
    for text in parameter or ():
        name, _, value = text.partition("=")
        chosen[name] = number(f"--parameter {text}", value)
    effects = {}
    known = catalogue(own_effects)
    for text in effect or ():
        found, amplitudes = effect_option(text, known)
        effects[found.key] = found
        chosen |= amplitudes
    path = _numbers("--displacements", displacements)
    if unload >= len(path):
        raise InputError(f"--unload: found {unload}, expected fewer than the {len(path)} displacements")
    path += path[-2 : -2 - unload : -1]
    sizes, moments = _numbers("--lengths", lengths), _numbers("--times", times)
    if min(sizes) <= 0 or len(set(sizes)) < len(sizes):
        raise InputError(f"--lengths: found {lengths!r}, expected different lengths above 0 mm")
    if min(path) <= -min(sizes):
        raise InputError(f"--displacements: found {min(path):g}, expected more than -{min(sizes):g} mm, a length")
    if moments[0] < 0 or any(b <= a for a, b in zip(moments, moments[1:], strict=False)):
        raise InputError(f"--times: found {times!r}, expected rising times from 0 s on")
    gaps = frozenset(unrecorded or ())
    if not gaps <= set(range(1, len(path))):
        raise InputError(f"--unrecorded: found {max(gaps)}, expected a hold from 1 to {len(path) - 1}")
    warmth = _numbers("--temperature", temperature) if temperature else []
    benches = [
        Bench(_name(tests, sizes, i, length), f"line-{i + 1}", length, resolution, path, moments, gaps, warmth)
        for i in range(tests)
        for length in sizes
    ]
    truth = Truth(chosen, tuple(effects.values()), elastic_law, history)
    configuration = {
        "command": "simulate", "version": __version__, "seed": seed, "tests": tests, "lengths_mm": sizes,
        "displacements_mm": path, "times_s": moments, "unrecorded": sorted(gaps), "temperatures_C": warmth,
        "resolution_N": resolution, "parameters": chosen, "effects": list(effects),
        "own_effects": source_of(own_effects),
        "elastic_law": elastic_law, "history": history,
    }  # fmt: skip
    if check_run(output, configuration) == "new":
        draw(benches, truth, seed)  # whatever is wrong with the truth is said before a folder is made
    run = open_run(output, configuration)
    if run.state != "done":
        write(output, benches, truth, seed)
        run.finish()


def _name(tests: int, lengths: list[float], test: int, length: float) -> str:
    name = f"wire-{test + 1}" if tests > 1 else "wire"
    return name if len(lengths) == 1 else f"{name}-{length:g}mm"


def _numbers(option: str, text: str) -> list[float]:
    from wirebayes.simulation.synthetic import number

    return [number(option, word) for word in text.split(",")]
