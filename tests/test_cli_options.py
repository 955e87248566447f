"""The options of a command are the parameters of its function: same names, defaults and choices, each handed on.

They stand in two places so that ``COMMAND --help``, a wrong option and a shell that completes one load no numpy
(CONTRIBUTING); these tests hold the two together.
"""

from collections.abc import Callable
from functools import cache
from importlib import import_module
from inspect import Parameter, signature
from pathlib import Path
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

import pytest

from wirebayes.cli import COMMANDS, command_function
from wirebayes.cli.options import as_typed, folder_for
from wirebayes.commands.load import _KINDS
from wirebayes.commands.options import text_of
from wirebayes.report.pages import PAGES

# command -> module and name of its function
FUNCTIONS = {
    "import": "import_bench.import_bench",
    "check": "check.check",
    "fit": "fit.fit",
    "compare": "compare.plan_comparison",
    "discover": "discover.discover",
    "batch": "batch.batch",
    "plan": "plan.plan",
    "predict": "predict.predict",
    "simulate": "simulate_tests.simulate_tests",
    "import-robot": "import_robot.import_robot",
    "pose": "pose.pose",
    "calibrate": "calibrate.calibrate",
    "export": "export.export",
}
# these have options that their functions do not have, or no function
NOT_COMPARED = {"init", "app", "reproduce", "report", "effects"}
RENAMED = {  # the singular of what may be repeated, a file of what may be an object, too
    "file": "source",
    "folder": "posterior",
    "effect": "effects",
    "parameter": "parameters",
    "map_rotation": "map_rotations",
    "spread": "specimen_spread",
}
ON_THE_TERMINAL = {"as_json", "quiet"}
READ_FIRST = {"wires", "aim", "parameter"}  # text that the command takes apart
GIVEN = {
    "wires": ["<wires>"],
    "parameter": ["k1=700"],
    "aim": "creep",
    "raw": [Path("<raw>")],
    "files": [Path("<files>")],
    "protocol": Path("<protocol>"),
    "output": Path("<output>"),
}
ONLY_IN_PYTHON = {"progress", "policy", "simulations", "ask", "tests"}


class Called(Exception):
    """What a function was called with."""


def command_of(name: str) -> Callable[..., object]:
    return command_function(name)


@cache  # the function itself, also while another one stands in its place
def function_of(name: str) -> Callable[..., object]:
    module, _, function = FUNCTIONS[name].partition(".")
    found: Callable[..., object] = getattr(import_module(f"wirebayes.commands.{module}"), function)
    return found


def called(name: str, monkeypatch: pytest.MonkeyPatch, given: dict[str, Any]) -> dict[str, Any]:
    """What a command hands on to its function."""
    function = function_of(name)

    def recorded(*args: Any, **options: Any) -> None:
        raise Called(signature(function).bind(*args, **options).arguments)

    module, _, place = FUNCTIONS[name].partition(".")
    monkeypatch.setattr(import_module(f"wirebayes.commands.{module}"), place, recorded)
    with pytest.raises(Called) as stopped:
        command_of(name)(**given)
    found: dict[str, Any] = stopped.value.args[0]
    return found


def parameters(name: str) -> dict[str, Parameter]:
    """Those of a command; files that are imported have nothing random."""
    own = signature(command_of(name)).parameters
    return {p: v for p, v in own.items() if p not in ON_THE_TERMINAL and (name.split("-")[0], p) != ("import", "seed")}


def renamed(name: str, parameter: str) -> str:
    other = RENAMED.get(parameter, parameter)
    known = signature(function_of(name)).parameters
    if parameter == "files" and "sources" in known:
        return "sources"
    return parameter if parameter in known else other


def test_every_command_is_compared_with_its_function_or_known_to_differ() -> None:
    assert set(COMMANDS) == set(FUNCTIONS) | NOT_COMPARED, "a command needs a row in FUNCTIONS"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_what_keeps_a_folder_can_be_loaded_and_has_a_page(name: str) -> None:
    module, _, _ = FUNCTIONS[name].partition(".")
    keeps_a_folder = hasattr(import_module(f"wirebayes.commands.{module}"), "open_run")
    if keeps_a_folder and name != "fit":  # which `load` finds by itself
        assert name in _KINDS, f"{name} needs a row in _KINDS of wirebayes/commands/load.py"
    assert not keeps_a_folder or name in PAGES, f"{name} needs a row in PAGES of wirebayes/report/pages/__init__.py"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_every_option_is_handed_on_under_its_name(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    given = {p: GIVEN.get(p, f"<{p}>") for p in parameters(name)}
    found = called(name, monkeypatch, given)
    kept = [p for p in given if p not in READ_FIRST and (name, p) != ("compare", "output")]  # compare writes later on
    assert {p: found[renamed(name, p)] for p in kept} == {p: given[p] for p in kept}
    assert {renamed(name, p) for p in given} >= set(found) - ONLY_IN_PYTHON


@pytest.mark.parametrize("name", FUNCTIONS)
def test_options_that_are_left_out_have_the_defaults_of_the_function(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    needed = {p: GIVEN.get(p, f"<{p}>") for p, v in parameters(name).items() if v.default is Parameter.empty}
    found = called(name, monkeypatch, needed)
    own = signature(function_of(name)).parameters
    left_out = {p: v for p, v in found.items() if p not in {renamed(name, q) for q in needed}}
    for p, value in left_out.items():
        if p not in ONLY_IN_PYTHON | {"output"} and own[p].default is not Parameter.empty:
            assert alike(value, own[p].default), f"{p}: {value!r} is not {own[p].default!r}"


def alike(value: Any, default: Any) -> bool:
    """Whether two defaults are one: numbers may be spelled, and nothing is None, no text or an empty list."""
    if value == default or (not value and not default and value != 0 and default != 0):
        return True
    return isinstance(value, str) and not isinstance(default, str) and value == text_of(default)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_an_option_has_the_choices_of_the_function(name: str) -> None:
    options, own = get_type_hints(command_of(name)), get_type_hints(function_of(name))
    for p in parameters(name):
        if choices(options[p]):
            assert choices(options[p]) == choices(own[renamed(name, p)]), p


def choices(hint: Any) -> tuple[str, ...]:
    """The words of a Literal, alone or beside None."""
    if get_origin(hint) is Literal:
        return get_args(hint)
    if get_origin(hint) in (Union, UnionType):
        return next(filter(None, map(choices, get_args(hint))), ())
    return ()


def test_defaults_that_differ_are_seen() -> None:
    assert alike(None, ()) and alike("", ()) and alike("1,2", (1, 2)) and alike(0.05, 0.05)
    assert not alike(0.05, 0.1) and not alike(0, None) and not alike(0.0, ()) and not alike("1,2", (1, 3))
    assert choices(Literal["a", "b"] | None) == ("a", "b") and choices(str | None) == ()


@pytest.mark.parametrize(
    ("experiment", "output", "folder"),
    [
        (None, None, "lines-fit"),
        ("kite", None, "lines-kite-fit"),
        ("lines", None, "lines-fit"),
        ("kite", Path("out"), "out"),
    ],
)
def test_results_of_one_experiment_have_a_folder_of_their_own(
    experiment: str | None, output: Path | None, folder: str
) -> None:
    assert folder_for("fit", Path("data/lines.toml"), output, experiment) == Path(folder)


@pytest.mark.parametrize(
    ("options", "typed"),
    [
        ({}, "'my lines.toml'"),
        (
            {"elastic_law": "hooke", "history": "saturating", "experiment": None, "drop_breaks": False},
            "'my lines.toml'",
        ),
        ({"experiment": "kite 1", "train_holds": 1}, "'my lines.toml' --experiment 'kite 1' --train-holds 1"),
        ({"history": "additive", "drop_breaks": True}, "'my lines.toml' --history additive --drop-breaks"),
        ({"own_effects": Path("my effects.py")}, "'my lines.toml' --own-effects 'my effects.py'"),
    ],
)
def test_the_next_command_keeps_the_options_that_were_given(options: dict[str, Any], typed: str) -> None:
    assert as_typed(Path("my lines.toml"), **options) == typed
