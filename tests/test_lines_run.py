"""The table of lines that the tests run."""

from analyses.project.lines_run import HOME, shares, table


class Half:
    """Four lines in every file, of which two were run."""

    def analysis2(self, file):
        return file, [1, 2, 3, 4], [], [3, 4], ""


def test_every_module_counts_in_its_package():
    found = shares(Half())
    assert sum(whole for _, whole in found.values()) == 4 * len(list(HOME.rglob("*.py")))
    assert found["wirebayes.wire"][0] == 2 * len(list((HOME / "wire").rglob("*.py")))
    assert found["wirebayes"][1] == 4 * len(list(HOME.glob("*.py")))


def test_a_line_a_package_and_all_of_them_last():
    lines = table({"wirebayes": (1, 4), "wirebayes.wire": (2000, 2000)}).splitlines()
    assert [line.split() for line in lines] == [
        ["wirebayes", "25.0", "%", "of", "4", "lines"],
        ["wirebayes.wire", "100.0", "%", "of", "2,000", "lines"],
        ["all", "99.9", "%", "of", "2,004", "lines"],
    ]
