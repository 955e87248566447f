"""What is installed: the paper's data come along, from a checkout and from a wheel."""

import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

from wirebayes import __version__
from wirebayes.cli import COMMANDS
from wirebayes.io import paper

ROOT = Path(__file__).parent.parent
USE = (
    "import wirebayes.io.paper as p; from pathlib import Path;"
    "print([int(e.protocol().mask.sum()) for e in p.experiments()], p.published()['table_4']['nylon-1.5m']['k1'],"
    "(p.FOLDER.parent / 'robots').is_dir(), p.FOLDER)"
)


def test_the_papers_data_are_at_hand():
    assert [experiment.name for experiment in paper.experiments()] == list(paper.published()["table_4"])
    assert paper.published()["table_4"]["kite-1.5m"] == {
        "k1": 7049.85,
        "B": 0.4681,
        "U": 0.5123,
        "k2": 0.05855,
        "N": 0.41,
    }


def test_the_package_reads_the_checkouts_files_not_a_copy():
    assert paper.FOLDER.resolve() == (ROOT / "data" / "paper").resolve()


def test_the_version_is_told_once_and_cited():
    assert "version" in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dynamic"]
    assert f"\nversion: {__version__}\n" in (ROOT / "CITATION.cff").read_text()
    assert f"## {__version__}" in (ROOT / "CHANGELOG.md").read_text()


def test_constraints_pin_versions_and_name_no_place():
    for line in (ROOT / "constraints.txt").read_text().splitlines():
        assert line.startswith("# ") or "==" in line
        assert "/" not in line
        assert not line.startswith("-")


@pytest.mark.slow
def test_a_wheel_works_outside_the_checkout(tmp_path):
    """Built and installed as people do it, then used from an empty folder by another interpreter."""

    def run(*command: str | Path) -> str:
        done = subprocess.run([str(c) for c in command], capture_output=True, text=True, check=False, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        return done.stdout

    # built from a copy, so that neither the checkout gets a build folder nor an old one gets into the wheel
    shutil.copytree(ROOT / "data", tmp_path / "source" / "data")
    shutil.copytree(ROOT / "wirebayes", tmp_path / "source" / "wirebayes", symlinks=True)
    for file in ("pyproject.toml", "README.md", "LICENSE"):
        shutil.copy(ROOT / file, tmp_path / "source")
    pip = [sys.executable, "-m", "pip", "--disable-pip-version-check"]
    run(*pip, "wheel", "--quiet", "--no-deps", "--wheel-dir", tmp_path, tmp_path / "source")
    (wheel,) = tmp_path.glob("*.whl")
    inside = zipfile.ZipFile(wheel).namelist()
    source = tmp_path / "source"
    carried = {f"wirebayes/{file.relative_to(source).as_posix()}" for file in (source / "data").rglob("*.*")}
    ours = {
        file.relative_to(source).as_posix()
        for file in (source / "wirebayes").rglob("*.*")
        if file.suffix not in (".pyx", ".c")
    }  # what the compiled module is made of travels in the source archive
    assert {name for name in carried | ours if "__pycache__" not in name} <= set(inside)
    assert not [name for name in inside if not name.startswith("wirebayes") or name.endswith((".pyx", ".c"))]
    run(sys.executable, "-m", "venv", "--system-site-packages", tmp_path / "venv")
    python = tmp_path / "venv" / "bin" / "python"
    # the dependencies are those of this environment: what is tested is the package, not the network
    sites = run(sys.executable, "-c", "import numpy, pathlib; print(pathlib.Path(numpy.__file__).parents[1])").strip()
    run(python, "-m", "pip", "--disable-pip-version-check", "install", "--quiet", "--no-deps", "--no-index", wheel)
    packages = run(python, "-c", "import sysconfig; print(sysconfig.get_paths()['purelib'])").strip()
    (Path(packages) / "dependencies.pth").write_text(f"{sites}\n")
    shown = run(python, "-c", USE)
    assert shown.startswith("[60, 60, 55, 40] 1545.245 True ")
    assert str(tmp_path) in shown
    run(python, "-m", "wirebayes", "--help")
    for name in COMMANDS:
        run(python, "-m", "wirebayes", name, "--help")


def test_the_paper_cites_what_its_bibliography_holds():
    text = (ROOT / "docs" / "paper" / "paper.md").read_text(encoding="utf-8")
    entries = re.findall(r"^@\w+\{(\w+),", (ROOT / "docs" / "paper" / "paper.bib").read_text(encoding="utf-8"), re.M)
    assert set(re.findall(r"(?<![\w.])@(\w+)", text)) == set(entries)
    assert text.startswith("---\ntitle:") and "\nbibliography: paper.bib\n" in text
    for heading in ("Summary", "Statement of need", "References"):
        assert f"\n# {heading}\n" in text


def test_the_paper_claims_only_what_the_documentation_shows():
    """Every figure of its measured part, as digits, stands in the README or the documentation too."""
    text = (ROOT / "docs" / "paper" / "paper.md").read_text(encoding="utf-8")
    measured = text.partition("# Measured behaviour")[2].partition("# Limits")[0]
    shown = " ".join(p.read_text(encoding="utf-8") for p in [ROOT / "README.md", *(ROOT / "docs").glob("*.*st")])
    shown += " ".join(p.read_text(encoding="utf-8") for p in (ROOT / "docs").glob("*.inc"))
    digits = {number.lstrip("0") for number in re.findall(r"\d[\d,]*\.?\d*(?:e-\d+)?", shown.replace(" .", " 0."))}
    digits |= {number.rstrip(".,") for number in digits}
    for number in re.findall(r"\d[\d,]*\.?\d*(?:e-\d+)?", measured):
        assert number.rstrip(".,").lstrip("0") in digits, number
