"""What other packagers are told agrees with pyproject.toml."""

import re
import tomllib
from pathlib import Path

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
