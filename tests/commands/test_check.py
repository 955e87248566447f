"""``check`` and ``init``: what is said, what is written, and the exit codes."""

import json

import pytest

import wirebayes as wb
from wirebayes.cli import main


@pytest.fixture(scope="module")
def start(tmp_path_factory):
    """The files of ``wirebayes init``."""
    folder = tmp_path_factory.mktemp("start") / "wire"
    assert main(["init", str(folder)]) == 0
    return folder / "my-wire.toml"


def test_a_start_is_valid_commented_and_written_once(start):
    assert len(wb.read_experiments(start)[0].recorded_holds) == 8
    text = start.read_text()
    assert text.count("#") > 10
    assert sorted(path.name for path in start.parent.iterdir()) == ["my-wire.csv", "my-wire.toml"]
    assert main(["init", str(start.parent)]) == 0  # it is done already
    assert start.read_text() == text


@pytest.mark.parametrize("file", ["my-wire.toml", "my-wire.csv"])
def test_a_start_that_somebody_edited_is_never_overwritten(file, tmp_path, capsys):
    assert main(["init", str(tmp_path)]) == 0
    edited = (tmp_path / file).read_bytes() + b"\n"
    (tmp_path / file).write_bytes(edited)
    assert main(["init", str(tmp_path)]) == 2
    assert f"{file}: found a file of this name" in capsys.readouterr().err
    assert (tmp_path / file).read_bytes() == edited


def test_every_commented_line_of_the_start_is_right(start, tmp_path):
    """A user takes the signs off: the keys are spelled as the reader wants them."""
    lines = []
    for line in start.read_text().splitlines():
        bare = line.removeprefix("# ")
        is_key = bare.startswith(("unrecorded_holds", "[experiment.prior", "distribution", "median", "sd_log"))
        lines.append(bare if is_key else line)
    (tmp_path / "my-wire.toml").write_text("\n".join(lines))
    (tmp_path / "my-wire.csv").write_bytes(start.with_suffix(".csv").read_bytes())
    (read,) = wb.read_experiments(tmp_path / "my-wire.toml")
    assert read.priors["k1"]["median"] == 1500.0
    assert len(read.holds) == 9


def test_check_says_what_was_understood(start, tmp_path, capsys):
    assert main(["check", str(start), "--output", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr()
    assert shown.err == ""
    for message in (
        "8 holds, 40 readings in 16 min",
        "0.5 mm",
        "1.08 to 0.78 N",
        "parameters from the data: k1",
        "thermal expansion (follows the logged temperature)",
        "nothing suspicious",
        "Next: wirebayes fit",
    ):
        assert message in shown.out
    *_, then = shown.out.splitlines()
    assert then.startswith("Next: ")
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    assert names == ["check.json", "complete.json", "configuration.json", "my-wire.svg"]
    stored = json.loads((tmp_path / "out" / "check.json").read_text())
    assert main(["check", str(start), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == stored
    assert main(["check", str(start), "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")
    assert wb.load(tmp_path / "out").summary() == stored


def test_check_warns_and_still_ends_well(start, tmp_path, capsys):
    rows = [row.split(",") for row in start.with_suffix(".csv").read_text().splitlines()]
    tension = {(hold, time): value for hold, _, time, value in rows[1:]}
    copied = [[h, x, t, tension["3", t] if h == "4" else f] for h, x, t, f in rows[1:]]
    (tmp_path / "my-wire.toml").write_bytes(start.read_bytes())
    (tmp_path / "my-wire.csv").write_text("\n".join(",".join(row) for row in [rows[0], *copied]))
    assert main(["check", str(tmp_path / "my-wire.toml")]) == 0
    shown = capsys.readouterr()
    assert "warning: my-wire: holds 3 and 4 have the same 5 readings at two displacements" in shown.err
    assert shown.out.splitlines()[-2] == "  1 warning"


def test_check_of_a_bad_file_is_exit_code_2(start, tmp_path, capsys):
    (tmp_path / "my-wire.toml").write_text(start.read_text().replace("1200.0", "-1200.0"))
    (tmp_path / "my-wire.csv").write_bytes(start.with_suffix(".csv").read_bytes())
    assert main(["check", str(tmp_path / "my-wire.toml"), "--output", str(tmp_path / "out")]) == 2
    assert "key length_mm: found -1200.0" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["check", "fit", "discover", "compare", "plan", "batch"])
def test_a_wrong_prior_is_refused_before_anything_is_written(command, start, tmp_path, capsys):
    text = start.read_text(encoding="utf-8")
    wrong = start.with_name("wrong.toml")
    wrong.write_text(f'{text}\n[experiment.prior]\nk9 = {{ distribution = "normal", mean = 3.0, sd = 1.0 }}\n')
    assert main([command, str(wrong), "--output", str(tmp_path / "out")]) == 2
    assert "k9" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("command", ["check", "fit", "discover", "compare", "batch", "plan"])
def test_every_command_refuses_a_prior_of_a_misspelt_effect(command, start, tmp_path, capsys):
    (tmp_path / "my-wire.csv").write_bytes(start.with_suffix(".csv").read_bytes())
    path = tmp_path / "my-wire.toml"
    path.write_text("[prior.toes.w]\nfixed = 0.1\n\n" + start.read_text())
    assert main([command, str(path), "--output", str(tmp_path / "out")]) == 2
    found = f"{path}, line 1: prior.toes.w: found no such parameter (did you mean toe.w?), expected"
    assert found in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
