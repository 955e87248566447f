"""The command line: a table of commands, each loaded only when it is called.

Bad input ends with exit code 2 and plain lines on stderr; whatever else goes wrong is a bug and shows its traceback.
"""

import atexit
import gc
import os
import shutil
import sys
import textwrap
from collections.abc import Callable, Sequence
from importlib import import_module
from typing import TYPE_CHECKING, Annotated, NamedTuple

from wirebayes._version import __version__
from wirebayes.cli.streams import open_standard_streams
from wirebayes.errors import InputError
from wirebayes.processes.interrupt import watch

if TYPE_CHECKING:
    import typer


class Command(NamedTuple):
    """Where a command's function lives, and what ``--help`` says of it without loading it."""

    module: str
    summary: str
    example: str


COMMANDS = {
    "reproduce": Command(
        "wirebayes.cli.reproduce",
        "Reproduce the paper from its own tables, with posteriors.",
        "wirebayes reproduce --output out/reproduce",
    ),
    "import": Command(
        "wirebayes.cli.import_bench",
        "Turn files of test benches (CSV, xlsx) into experiment files.",
        'wirebayes import raw.csv --output wire --length-mm 1200 --map "Kraft [N]=tension"',
    ),
    "init": Command(
        "wirebayes.cli.new_experiment",
        "Write a commented experiment file and a small CSV to replace.",
        "wirebayes init wire",
    ),
    "check": Command(
        "wirebayes.cli.check",
        "Report what was understood of an experiment file and what such a test can determine.",
        "wirebayes check data/paper/experiments.toml --experiment nylon-1.5m",
    ),
    "fit": Command(
        "wirebayes.cli.fit",
        "Estimate the posterior of a wire's parameters.",
        "wirebayes fit data/paper/experiments.toml --experiment roc-line-1m --output out/fit",
    ),
    "compare": Command(
        "wirebayes.cli.compare",
        "Compare laws, histories, likelihoods and effects on readings that the fits have not seen.",
        "wirebayes compare data/paper/experiments.toml --experiment nylon-1.5m --output out/compare",
    ),
    "discover": Command(
        "wirebayes.cli.discover",
        "Find which physical effect the model is missing.",
        "wirebayes discover data/paper/experiments.toml --output out/discover",
    ),
    "batch": Command(
        "wirebayes.cli.batch",
        "Fit many experiments and find what each model is missing, in one table.",
        "wirebayes batch lot-1.toml lot-2.toml --output out/batch",
    ),
    "plan": Command(
        "wirebayes.cli.plan",
        "Predict what a test would teach before it is done.",
        "wirebayes plan plan.toml --budget-min 60 --output out/plan",
    ),
    "predict": Command(
        "wirebayes.cli.predict",
        "Predict readings of holds not measured yet.",
        "wirebayes predict out/fit protocol.csv --output predicted.csv",
    ),
    "effects": Command(
        "wirebayes.cli.effects",
        "List the effects that a model may be missing.",
        "wirebayes effects strain_stiffening",
    ),
    "simulate": Command(
        "wirebayes.cli.simulate",
        "Write synthetic tests with known truth.",
        "wirebayes simulate --output out/simulated --seed 1",
    ),
    "import-robot": Command(
        "wirebayes.cli.import_robot",
        "Turn a robot of CASPR or WireX into a robot file.",
        "wirebayes import-robot CoGiRo_bodies.xml CoGiRo_cables.xml --output cogiro.toml",
    ),
    "pose": Command(
        "wirebayes.cli.robot",
        "Predict the pose of a robot on creeping wires: kinematics, drift and their uncertainty.",
        "wirebayes pose linear-7 --wires out/fit/roc-line-1m --output out/pose",
    ),
    "calibrate": Command(
        "wirebayes.cli.robot",
        "Estimate the zero-tension lengths of a robot's wires from readings at several poses.",
        "wirebayes calibrate linear-7 session.csv --wires out/fit/roc-line-1m --output out/calibrate",
    ),
    "export": Command(
        "wirebayes.cli.robot",
        "Export a robot with its wires: firmware settings, creep table, MuJoCo model.",
        "wirebayes export hangprinter-4 --wires out/fit/roc-line-1m --output out/export",
    ),
    "app": Command(
        "wirebayes.cli.app",
        "Do the same in a browser on this machine: drop a file, see the answer.",
        "wirebayes app --port 8137",
    ),
    "report": Command(
        "wirebayes.cli.report",
        "Write one self-contained page from a folder of results.",
        "wirebayes report out/reproduce",
    ),
}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line and return its exit code.

    Parameters
    ----------
    arguments : sequence of str, optional
        Without the program's name; those of the process when not given. Then Ctrl-C and SIGTERM end the process, too
        (`wirebayes.processes.interrupt`).

    Returns
    -------
    int
        0 done, 2 bad input or usage.
    """
    if arguments is None:
        arguments = sys.argv[1:]
        open_standard_streams()
        watch(arguments)
        from wirebayes.processes.workers import SELDOM

        gc.set_threshold(*SELDOM)
        # The end of the process frees all at once; Python would free each object before it, for half a second.
        atexit.register(gc.freeze)
    try:
        code = _exit_code(list(arguments))
        sys.stdout.flush()  # here, where a full disk is an error like others
    except InputError as error:
        print(_one_line(str(error)), file=sys.stderr)
        return 2
    return code


def _exit_code(arguments: list[str]) -> int:
    called = next((word for word in _typed(arguments) if not word.startswith("-")), None)
    if called is None and arguments in (["-h"], ["--help"]):
        print(overview(shutil.get_terminal_size().columns))  # typer alone takes twice as long to load as all else
        return 0

    import typer  # only now: Ctrl-C is welcome during imports, too

    from wirebayes.processes.workers import one_thread_each

    one_thread_each()  # small matrices: more threads only fight over them
    try:
        typer.main.get_command(_application(called)).main(args=arguments, prog_name="wirebayes")
    except SystemExit as stop:
        return stop.code if isinstance(stop.code, int) else int(stop.code is not None)
    return 0


_ABOUT = "A Bayesian toolkit for wires that creep: posteriors, missing effects, robot drift."
_OPTIONS = {
    "--version": "Print the version and stop.",
    "--install-completion": "Install completion for the current shell.",
    "--show-completion": "Show completion for the current shell, to copy it or customize the installation.",
    "-h, --help": "Show this message and exit.",
}
_NARROWEST, _WIDEST = 50, 80  # columns: those of typer, too


def overview(columns: int) -> str:
    """What ``wirebayes --help`` says, word for word as typer would say it.

    Parameters
    ----------
    columns : int
        Of the terminal.
    """
    width = max(min(columns, _WIDEST) - 2, _NARROWEST)
    options = _listed(_OPTIONS, width)
    commands = _listed({name: command.summary for name, command in COMMANDS.items()}, width)
    about = textwrap.wrap(_ABOUT, width, initial_indent="  ", subsequent_indent="  ")
    usage = "Usage: wirebayes [OPTIONS] COMMAND [ARGS]..."
    return "\n".join([usage, "", *about, "", "Options:", *options, "", "Commands:", *commands])


def _listed(rows: dict[str, str], width: int) -> list[str]:
    """Names with what they mean beside them, the meanings wrapped below each other."""
    column = max(map(len, rows)) + 4
    lines = []
    for name, meaning in rows.items():
        first = f"  {name}".ljust(column)
        lines += textwrap.wrap(meaning, width, initial_indent=first, subsequent_indent=" " * column)
    return lines


def _typed(arguments: Sequence[str]) -> Sequence[str]:
    """The arguments; a shell that asks how to complete a line has them in a variable of its own instead."""
    if "_WIREBAYES_COMPLETE" not in os.environ:
        return arguments
    return os.environ.get("COMP_WORDS", os.environ.get("_TYPER_COMPLETE_ARGS", "")).split()[1:]


def command_function(name: str) -> Callable[..., object]:
    """The function of a command: ``import_robot_command`` of ``import-robot``."""
    function: Callable[..., object] = getattr(import_module(COMMANDS[name].module), f"{name.replace('-', '_')}_command")
    return function


def _application(called: str | None) -> "typer.Typer":
    """The whole command line, with only the called command's module loaded."""
    import typer

    # rich_markup_mode None: errors are plain lines, also for a program that reads them
    application = typer.Typer(
        no_args_is_help=True, rich_markup_mode=None, context_settings={"help_option_names": ["-h", "--help"]}
    )

    def print_version(wanted: bool) -> None:
        if wanted:
            print(f"wirebayes {__version__}")
            raise typer.Exit

    shown = typer.Option("--version", is_eager=True, callback=print_version, help="Print the version and stop.")

    def top(version: Annotated[bool, shown] = False) -> None:
        pass

    application.callback(help=_ABOUT)(top)
    for name, command in COMMANDS.items():
        function: Callable[..., object] = _unloaded
        if name == called:
            function = command_function(name)
        # \b keeps the example on its own line, unwrapped
        application.command(name, short_help=command.summary, epilog=f"\b\nExample:\n  {command.example}")(function)
    return application


def _one_line(text: str) -> str:
    """What was found may be long or hold line feeds and control characters: a terminal gets one plain line."""
    line = "".join(c if c.isprintable() else " " for c in text)
    return line if len(line) <= _LONGEST_LINE else f"{line[: _LONGEST_LINE // 2]} … {line[-_LONGEST_LINE // 2 :]}"


_LONGEST_LINE = 2000  # characters, some 25 lines of a terminal: a longer message hides what it says


def _unloaded() -> None:
    raise AssertionError("only the called command is run, and that one is loaded")
