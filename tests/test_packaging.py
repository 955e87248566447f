"""What other packagers are told agrees with pyproject.toml."""

import re
import tomllib
from pathlib import Path

import pytest

from wirebayes import __version__

ROOT = Path(__file__).parents[1]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))


def test_the_conda_recipe_asks_for_what_the_package_asks_for():
    recipe = (ROOT / "packaging" / "conda" / "meta.yaml").read_text(encoding="utf-8")
    run = dict(re.findall(r"^    - ([\w-]+) (>=[\d.]+)$", recipe.partition("  run:\n")[2], re.MULTILINE))
    asked: dict[str, str] = {}
    for line in PROJECT["project"]["dependencies"]:
        name, lowest = re.match(r"([\w-]+)(?:\[\w+\])?(>=[\d.]+)", line).groups()
        asked.setdefault(name, lowest)
    asked = {"matplotlib-base" if name == "matplotlib" else name: lowest for name, lowest in asked.items()}
    assert run == asked | {"python": PROJECT["project"]["requires-python"]}
    assert f'version = "{__version__}"' in recipe


def test_wheels_are_built_for_the_versions_that_are_promised():
    promised = re.findall(r"Python :: 3\.(\d+)", " ".join(PROJECT["project"]["classifiers"]))
    assert re.findall(r"cp3(\d+)", PROJECT["tool"]["cibuildwheel"]["build"]) == promised


def test_the_workflow_builds_wheels_on_every_system_with_a_pinned_builder():
    yaml = pytest.importorskip("yaml")
    jobs = yaml.safe_load((ROOT / ".github" / "workflows" / "wheels.yml").read_text(encoding="utf-8"))["jobs"]
    systems = {name.partition("-")[0] for name in jobs["wheels"]["strategy"]["matrix"]["os"]}
    assert systems == {"ubuntu", "macos", "windows"}
    steps = [step for job in jobs.values() for step in job["steps"]]
    assert all(re.search(r"@v\d+$", step["uses"]) for step in steps if "uses" in step)
    runs = [step["run"] for step in steps if "run" in step]
    assert any(re.search(r"cibuildwheel==\d+\.\d+", run) for run in runs)
    assert any("python -m cibuildwheel" in run for run in runs)


def test_the_container_has_the_tested_versions_and_starts_the_command():
    lines = (ROOT / "packaging" / "Containerfile").read_text(encoding="utf-8")
    python = {tuple(map(int, version.split("."))) for version in re.findall(r"^FROM python:([\d.]+)-slim", lines, re.M)}
    assert len(python) == 1 and min(python) >= (3, 11)
    assert "-c constraints.txt ." in lines and (ROOT / "constraints.txt").is_file()
    (made,), (copied,) = (re.findall(pattern, lines) for pattern in (r"-m venv (\S+)", r"--from=build (\S+)"))
    assert made == copied and f"PATH={made}/bin:$PATH" in lines
    assert 'ENTRYPOINT ["wirebayes"]' in lines
