"""The command line's own behaviour: help, usage, exit codes."""

import contextlib
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
import typer

from wirebayes import __version__
from wirebayes.cli import COMMANDS, Command, _application, command_function, main
from wirebayes.effects import CATALOGUE
from wirebayes.errors import InputError

DATA = Path(__file__).parent.parent / "data"


def run(*arguments: str, **options) -> subprocess.CompletedProcess:
    return subprocess.run(
        [sys.executable, "-m", "wirebayes", *arguments], capture_output=True, text=True, check=False, **options
    )


def test_help_names_every_command_and_loads_nothing_heavy():
    code = (
        "import sys; from wirebayes.cli import main; main(['--help']);"
        "sys.exit(', '.join(m for m in ('typer', 'numpy', 'scipy', 'matplotlib', 'xarray') if m in sys.modules))"
    )
    result = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert result.stderr.strip() == ""
    for name, command in COMMANDS.items():
        assert re.search(rf"^  {name} ", result.stdout, re.MULTILINE)
        assert command.summary.split()[0] in result.stdout


def test_reading_a_bench_file_loads_no_library_of_posteriors(tmp_path):
    bench = DATA.parent / "docs" / "example" / "bench.csv"
    code = (
        "import sys; from wirebayes.cli import main\n"
        f"assert main(['import', {str(bench)!r}, '--length-mm', '1200', '--material', 'x', '--output', 'w']) == 0\n"
        "print([m for m in ('pandas', 'xarray', 'arviz_base', 'arviz_stats') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=tmp_path)
    assert done.stdout.splitlines()[-1] == "[]"


def test_what_fits_load_holds_no_library_of_posteriors_and_statistics():
    """They would take a third of a fit's time, in the process of the command and in those of its check."""
    heavy = ("pandas", "xarray", "arviz_base", "arviz_stats", "scipy.stats", "scipy.optimize", "scipy.ndimage")
    code = (
        "import sys; import wirebayes.commands.fit, wirebayes.preloaded, wirebayes.report.pages.fit\n"
        f"print([m for m in {heavy} if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("columns", [50, 80, 200])
def test_help_is_what_typer_would_say(columns, monkeypatch, capsys):
    monkeypatch.setenv("COLUMNS", str(columns))
    assert main(["--help"]) == 0
    ours = capsys.readouterr().out
    with pytest.raises(SystemExit):
        typer.main.get_command(_application(None)).main(args=["--help"], prog_name="wirebayes")
    assert ours == capsys.readouterr().out


@pytest.mark.parametrize("command", [(), ("fit",)])
def test_h_is_short_for_help(command, capsys):
    assert main([*command, "-h"]) == 0
    short = capsys.readouterr().out
    assert main([*command, "--help"]) == 0
    assert short == capsys.readouterr().out and "-h, --help" in short


@pytest.mark.parametrize(
    ("typed", "completed"),
    [
        ("wirebayes comp", ["compare"]),
        ("wirebayes fit --lik", ["--likelihood"]),
        ("wirebayes plan --bud", ["--budget-min"]),
    ],
)
def test_a_shell_completes_commands_and_the_options_of_a_command(typed, completed):
    """As bash asks; the options are those of the command's own module, which is loaded for it alone."""
    asked = {"_WIREBAYES_COMPLETE": "complete_bash", "COMP_WORDS": typed, "COMP_CWORD": str(len(typed.split()) - 1)}
    answer = run(env=os.environ | asked)
    assert answer.stdout.split() == completed and answer.returncode == 0


def test_the_version_is_printed(capsys):
    assert main(["--version"]) == 0
    assert capsys.readouterr().out == f"wirebayes {__version__}\n"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fti"], "No such command 'fti'."),
        (["--colour"], "No such option"),
        *(
            [
                (["fit", "--together"], "--together"),
                (["fit"], "Missing argument"),
                (["fit", "a.toml", "--output", "o", "--likelihood", "series"], "'series' is not one of"),
                (["fit", "a.toml", "--output", "o", "--seed", "-1"], "'--seed': found -1, expected a whole number, 0"),
            ]
            if "fit" in COMMANDS
            else []
        ),
    ],
)
def test_wrong_usage_is_exit_code_2_and_plain_lines(arguments, message, tmp_path):
    result = run(*arguments, cwd=tmp_path)
    assert result.returncode == 2
    assert message in result.stderr
    assert "Traceback" not in result.stderr
    assert len(result.stderr.splitlines()) <= 5
    assert result.stdout == ""
    assert list(tmp_path.iterdir()) == []


def test_no_arguments_show_the_help(capsys):
    assert main([]) == 2
    assert "Usage: wirebayes" in "".join(capsys.readouterr())


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_shows_an_example_that_it_accepts(name, capsys):
    command = COMMANDS[name]
    assert callable(command_function(name))
    assert main([name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert f"  {command.example}\n" in shown
    words = command.example.split()
    assert words[:2] == ["wirebayes", name]
    for option in (word for word in words if word.startswith("--")):
        assert option in shown
    for file in (word for word in words if word.startswith("data/")):
        assert (DATA.parent / file).is_file()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_takes_output_and_seed(name, capsys):
    assert main([name, "--help"]) == 0
    shown = capsys.readouterr().out
    assert "--output" in shown
    assert "--seed" in shown


def test_init_takes_its_folder_as_an_option_too_but_one_folder(tmp_path, capsys):
    assert main(["init", "--output", str(tmp_path / "a"), "--seed", "3"]) == 0
    assert sorted(path.name for path in (tmp_path / "a").iterdir()) == ["my-wire.csv", "my-wire.toml"]
    assert main(["init"]) == 2 and "found 0 folders" in capsys.readouterr().err
    assert main(["init", str(tmp_path / "b"), "--output", str(tmp_path / "c")]) == 2
    assert "found 2 folders, expected one" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["a"]


def test_effects_are_written_as_they_are_printed(tmp_path, capsys):
    assert main(["effects", "toe", "--output", str(tmp_path / "new" / "folder"), "--seed", "1"]) == 0
    assert (tmp_path / "new" / "folder" / "effects.txt").read_text(encoding="utf-8") == capsys.readouterr().out
    (tmp_path / "file").write_text("")
    assert main(["effects", "--output", str(tmp_path / "file")]) == 2
    shown = capsys.readouterr()
    assert shown.out == "" and "file: cannot be written" in shown.err


def test_an_input_error_is_its_text_and_exit_code_2(monkeypatch, capsys):
    def refuse() -> None:
        raise InputError("a.csv, line 3: found x, expected y")

    monkeypatch.setitem(COMMANDS, "fit", Command("somewhere", "", ""))
    monkeypatch.setattr(
        "wirebayes.cli.import_module", lambda _: type("module", (), {"fit_command": staticmethod(refuse)})
    )
    assert main(["fit"]) == 2
    assert capsys.readouterr() == ("", "a.csv, line 3: found x, expected y\n")


def test_a_bug_is_not_dressed_up_as_bad_input(monkeypatch):
    def fail() -> None:
        raise ZeroDivisionError

    monkeypatch.setitem(COMMANDS, "fit", Command("somewhere", "", ""))
    monkeypatch.setattr(
        "wirebayes.cli.import_module", lambda _: type("module", (), {"fit_command": staticmethod(fail)})
    )
    with pytest.raises(ZeroDivisionError):
        main(["fit"])


def test_no_progress_bar_in_a_pipe(capsys):
    from wirebayes.cli.progress import progress

    with progress() as report:
        report("sampling", 1, 2)
    assert capsys.readouterr() == ("", "")


@pytest.mark.skipif(os.name != "posix", reason="a pseudo-terminal is asked for")
def test_a_progress_bar_on_a_terminal():
    import pty

    parent, child = pty.openpty()
    code = "from wirebayes.cli.progress import progress\nwith progress() as report: report('sampling', 2, 2)"
    subprocess.run([sys.executable, "-c", code], stderr=child, check=True, env={**os.environ, "TERM": "xterm"})
    os.close(child)
    written = b""
    with contextlib.suppress(OSError):  # a terminal that nobody holds any more has no end of file
        while chunk := os.read(parent, 100_000):
            written += chunk
    os.close(parent)
    shown = written.decode()
    assert "sampling" in shown
    assert "100%" in shown


def test_effects_lists_the_catalogue_and_describes_one(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["effects"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line.split()[0] for line in lines] == list(CATALOGUE)
    for name in CATALOGUE:  # as the list has it, also where a model needs a hold or a parameter: grip_slip@7
        assert main(["effects", name]) == 0
        assert capsys.readouterr().out.splitlines()[0] == name
    assert main(["effects", "strain_stiffening"]) == 0
    shown = capsys.readouterr().out
    assert "k1 s (1 + c s)" in shown and "strain_stiffening.c in 1, neutral value 0" in shown
    assert main(["effects", "sensor_drift"]) == 0
    assert "  weights    The gauge drifts with time." in capsys.readouterr().out
    assert main(["effects", "stiffening"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert "stiffening" in line and "strain_stiffening" in line
