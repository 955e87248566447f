"""Synthetic tests with known truth, as files the other functions read."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from wirebayes._version import __version__
from wirebayes.commands.options import (
    Numbers,
    check_history,
    check_seed,
    check_whole,
    from_zero,
    model_spec,
    names_given,
    path_of,
    text_of,
)
from wirebayes.effects import catalogue, source_of
from wirebayes.errors import InputError, shown
from wirebayes.io.experiment_file import SHORTEST
from wirebayes.io.run_folder import check_run, open_run
from wirebayes.simulation.stated_truth import effect_option, finite_number, without_trace
from wirebayes.simulation.synthetic import Bench, Truth, draw, write_tests
from wirebayes.strict.files import PathLike
from wirebayes.strict.table import LARGEST
from wirebayes.views.result import ResultFolder
from wirebayes.views.simulated_tests import SimulatedTests
from wirebayes.wire.control import READ_UNIT
from wirebayes.wire.effect import Effect, EventEffect
from wirebayes.wire.laws import ElasticLaw, History
from wirebayes.wire.protocol import Control

DISPLACEMENTS_MM = tuple(range(1, 13))  # those of the paper


def simulate_tests(
    *,
    tests: int = 1,
    lengths: Numbers = (1000.0,),
    displacements: Numbers = DISPLACEMENTS_MM,
    weights: Numbers = (),
    unload: int = 0,
    times: Numbers = (0.0, 30.0, 60.0, 90.0, 120.0),
    unrecorded: Sequence[int] = (),
    temperature: Numbers = (),
    resolution: float = 0.01,
    parameters: Mapping[str, float] | None = None,
    effects: str | Sequence[str] | Mapping[str, float] = (),
    own_effects: PathLike | None = None,
    elastic_law: ElasticLaw = "hooke",
    history: History = "saturating",
    seed: int = 0,
    output: PathLike | None = None,
) -> SimulatedTests:
    """Simulate tests with known truth.

    Parameters
    ----------
    tests : int
        Number of lines tested, each with its own true parameters.
    lengths : sequence of float
        Zero-tension lengths, mm; one sample of each line for each length.
    displacements : sequence of float
        One a hold, mm.
    weights : sequence of float
        One a hold, N, in place of displacements: tensions are set, and displacements are read.
    unload : int
        Then so many holds back down through the same displacements or weights.
    times : sequence of float
        Reading times of a hold, s.
    unrecorded : sequence of int
        Holds without readings.
    temperature : sequence of float
        Temperatures at evenly spaced moments of the test, °C.
    resolution : float
        Rounding of the tensions, N, or of the displacements under weights, mm; 0 for none.
    parameters : mapping of name to value, optional
        Such as ``{"k1": 700}``; parameters not given are drawn from the prior. With several lengths ``B`` is that of
        their geometric mean, as in a fit of them together; ``truth.json`` has it for each.
    effects : mapping of ``NAME.p`` to value, or sequence of ``NAME.p=VALUE`` or ``NAME``
        Such as ``{"strain_stiffening.c": 12}`` or ``["grip_slip@7.w=0.2"]``; drawn from the prior without a value.
    own_effects : path, optional
        A Python file with effects of your own.
    elastic_law, history
        As in `fit`.
    seed : int
    output : path, optional
        Folder for the files; a temporary one when left out.

    Returns
    -------
    SimulatedTests
        ``experiments`` are the tests, `summary` is the content of ``truth.json``.

    Raises
    ------
    InputError
        Something that was given is wrong.

    Examples
    --------
    >>> made = wb.simulate_tests(displacements=[1, 2, 3], parameters={"k1": 700}, seed=1)
    >>> made.experiments[0].tension().shape
    (3, 5)
    >>> made.summary()["experiments"]["wire"]["parameters"]["k1"]
    700.0
    >>> hung = wb.simulate_tests(weights=[2, 4, 6], parameters={"k1": 700}, seed=1)
    >>> hung.experiments[0]
    Experiment(wire: 1000 mm of line-1, 3 holds, 15 readings, tensions set)
    """
    spec = model_spec(elastic_law, history)
    own = path_of(own_effects)
    seed = check_seed(seed)
    chosen = _parameters(parameters or {})
    found, amplitudes = _effects(effects, own)
    chosen |= amplitudes
    tests = check_whole("--tests", tests, 1)
    sizes = _numbers("--lengths", lengths)
    moments = _numbers("--times", times)
    control, path = _settings(displacements, weights, check_whole("--unload", unload, 0))
    gaps = frozenset(unrecorded)
    _check_protocol(control, path, sizes, moments, gaps)
    _check_effects(found, history, path, gaps)
    warmth = _temperatures(temperature)
    from_zero(("--resolution", resolution))
    alike = Bench(times_s=moments, unrecorded=gaps, temperatures_C=warmth).setting(control, path, float(resolution))
    benches = _benches(alike, tests, sizes)
    truth = Truth(chosen, tuple(found.values()), spec.law, spec.history)
    set_as = "weights_N" if control == "force" else "displacements_mm"
    configuration = {
        "command": "simulate",
        "version": __version__,
        "seed": seed,
        "tests": tests,
        "lengths_mm": sizes,
        set_as: path,
        "times_s": moments,
        "unrecorded": sorted(gaps),
        "temperatures_C": warmth,
        f"resolution_{READ_UNIT[control]}": float(resolution),
        "parameters": chosen,
        "effects": list(found),
        "own_effects": source_of(own),
        "elastic_law": elastic_law,
        "history": history,
    }
    place = ResultFolder.at(output)
    computed = _write(place.path, configuration, benches, truth)
    return SimulatedTests(place, own, computed=computed)


def _write(folder: Path, configuration: Mapping[str, Any], benches: Sequence[Bench], truth: Truth) -> bool:
    """Draw and write the tests, where that was not done before."""
    seed = configuration["seed"]
    if check_run(folder, configuration) == "new":
        _check_truth(benches, truth, seed)  # before a folder is made
    with open_run(folder, configuration) as run:
        if run.state != "done":
            write_tests(folder, benches, truth, seed)
            run.finish()
        return run.state != "done"


def _check_truth(benches: Sequence[Bench], truth: Truth, seed: int) -> None:
    """Refuse a truth that is impossible, or that has effects of which the tests show nothing."""
    made = draw(benches, truth, seed)
    for effect in without_trace(made, truth.effects):
        where = f" ({effect.shows})" if effect.shows else ""
        found = "tests that read the same without it"
        raise InputError(f"--effect {effect.key}: found {found}, expected some that can show it{where}")


def _parameters(given: Mapping[str, float]) -> dict[str, float]:
    if not isinstance(given, Mapping):
        raise InputError(f"parameters: found {shown(given)}, expected values by name")
    return {name: finite_number(f"--parameter {name}={value}", str(value)) for name, value in given.items()}


def _effects(
    effects: str | Sequence[str] | Mapping[str, float], own: Path | None
) -> tuple[dict[str, Effect], dict[str, float]]:
    """The effects by key, and the amplitudes that were given."""
    if isinstance(effects, Mapping):
        effects = [f"{key}={value}" for key, value in effects.items()]
    texts = names_given("effects", effects)
    found: dict[str, Effect] = {}
    given: dict[str, float] = {}
    known = catalogue(own)
    for text in texts:
        effect, amplitudes = effect_option(text, known)
        again = set(amplitudes) & set(given)
        if again:
            raise InputError(f"--effect {text}: found {min(again)} a second time, expected it once")
        found[effect.key] = effect
        given |= amplitudes
    return found, given


def _benches(alike: Bench, lines: int, lengths_mm: Sequence[float]) -> list[Bench]:
    """A test of each length of each line."""
    out = []
    for i in range(lines):
        for length in lengths_mm:
            name = _name(lines, lengths_mm, i, length)
            out.append(replace(alike, name=name, material=f"line-{i + 1}", length_mm=length))
    return out


def _settings(displacements: Numbers, weights: Numbers, unload: int) -> tuple[Control, list[float]]:
    """What is set in each hold, mm or N: up as given, then so many back down."""
    control: Control = "force" if text_of(weights) else "displacement"
    if control == "force" and _numbers("--displacements", displacements) != list(DISPLACEMENTS_MM):
        raise InputError("--weights: found --displacements beside it, expected one of the two")
    option, given = ("--weights", weights) if control == "force" else ("--displacements", displacements)
    path = _numbers(option, given)
    if unload >= len(path):
        raise InputError(f"--unload: found {unload}, expected fewer than the {len(path)} {option.removeprefix('--')}")
    return control, path + path[-2 : -2 - unload : -1]


def _check_effects(
    effects: Mapping[str, Effect], history: History, path: Sequence[float], unrecorded: frozenset[int]
) -> None:
    """Refuse what the history has no meaning for, and an event at a hold that no test has, or that is not read."""
    last = len(path)
    recorded = set(range(1, last + 1)) - unrecorded
    for key, effect in effects.items():
        check_history(effect, history)
        if isinstance(effect, EventEffect) and effect.hold not in recorded:
            raise InputError(f"--effect {key}: found hold {effect.hold}, expected a recorded one from 1 to {last}")


def _check_protocol(
    control: Control,
    path: Sequence[float],
    lengths: Sequence[float],
    times: Sequence[float],
    unrecorded: frozenset[int],
) -> None:
    """Refuse what no bench could do."""
    _check_lengths(lengths)
    least = min(path)
    shortest = min(lengths)
    if control == "force" and least <= 0:
        raise InputError(f"--weights: found {least:g}, expected more than 0 N")
    if control == "displacement" and least <= -shortest:
        raise InputError(f"--displacements: found {least:g}, expected more than -{shortest:g} mm, a length")
    is_rising = all(before < after for before, after in pairwise(times))
    if times[0] < 0 or not is_rising:
        raise InputError(f"--times: found {text_of(times)!r}, expected rising times from 0 s on")
    possible = range(1, len(path))
    if not unrecorded <= set(possible):
        raise InputError(f"--unrecorded: found {max(unrecorded)}, expected a hold from 1 to {len(path) - 1}")


def _check_lengths(lengths: Sequence[float]) -> None:
    """Refuse lengths that no wire has, and a length given twice."""
    shortest = min(lengths)
    longest = max(lengths)
    is_repeated = len(set(lengths)) < len(lengths)
    if shortest <= 0 or is_repeated:
        raise InputError(f"--lengths: found {text_of(lengths)!r}, expected different lengths above 0 mm")
    if shortest < SHORTEST or longest > LARGEST["displacement_mm"]:
        expected = f"lengths from {SHORTEST:.0e} to {LARGEST['displacement_mm']:.0e} mm"
        raise InputError(f"--lengths: found {text_of(lengths)!r}, expected {expected}")


def _name(tests: int, lengths: Sequence[float], test: int, length: float) -> str:
    name = f"wire-{test + 1}" if tests > 1 else "wire"
    return name if len(lengths) == 1 else f"{name}-{length:g}mm"


def _temperatures(values: Numbers) -> list[float]:
    """None where the option is left out."""
    return _numbers("--temperature", values) if text_of(values) else []


def _numbers(option: str, values: Numbers) -> list[float]:
    return [finite_number(option, word) for word in text_of(values).split(",")]
