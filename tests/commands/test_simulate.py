"""What ``wirebayes simulate`` says."""

import wirebayes as wb
from wirebayes.cli import main


def test_the_command_says_what_it_wrote_and_what_to_do_with_it(tmp_path, capsys):
    folder = tmp_path / "made"
    options = ["--tests", "2", "--displacements", "1,2,3", "--times", "0,60", "--unrecorded", "2"]
    assert main(["simulate", *options, "--output", str(folder)]) == 0
    first, where, following = capsys.readouterr().out.splitlines()
    names = [test.name for test in wb.read_experiments(folder / "experiments.toml")]
    assert all(name in first for name in names)
    assert "2 tests, 4 holds, 8 readings" in first
    assert where == f"Results: {folder}"
    assert following == f"Next: wirebayes fit {folder / 'experiments.toml'}"
