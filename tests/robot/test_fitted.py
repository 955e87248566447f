"""The commands on real, if short, fits whose wires have effects: from the catalogue and from a user's file."""

from pathlib import Path

import numpy as np
import pytest

from tests.light import POLICY
from wirebayes.cli import main
from wirebayes.effects import catalogue
from wirebayes.inference.fit import fit_problem
from wirebayes.io import paper
from wirebayes.io.run_folder import read_json
from wirebayes.model.build import build
from wirebayes.results import read_back, store
from wirebayes.robot.mechanics import rotation, schema

OWN = Path(__file__).parents[2] / "docs" / "own_effect.py"


def strain_of_power(load, p):
    """Inverse of s (s / 0.001)^p, by hand."""
    return (load * 0.001**p) ** (1 / (1 + p))


def strain_of_stiffening(load, c):
    """Inverse of s (1 + c s), by hand."""
    return (np.sqrt(1 + 4 * c * load) - 1) / (2 * c)


EFFECTS = {"strain_stiffening": ("c", None, strain_of_stiffening), "own_power": ("p", OWN, strain_of_power)}


@pytest.fixture(scope="module")
def fitted(tmp_path_factory):
    """Folders of nylon fits: the plain one, and one with each effect."""
    nylon = paper.experiments()[2]
    folders = {}
    for name in ("plain", *EFFECTS):
        folders[name] = tmp_path_factory.mktemp(name)
        effects = [] if name == "plain" else [catalogue(EFFECTS[name][1])[name]()]
        store.save_posterior(fit_problem(build([nylon], effects), 1, policy=POLICY), folders[name], {})
    return folders


# `test_drift` follows effects of the catalogue into a robot, too
@pytest.mark.parametrize("effect", [pytest.param("strain_stiffening", marks=pytest.mark.slow), "own_power"])
def test_pose_bends_the_wires_as_the_fitted_effect_does(fitted, tmp_path, effect):
    column, own, strain = EFFECTS[effect]
    out = tmp_path / "out"
    arguments = ["pose", "cogiro-desk", "--wires", str(fitted[effect]), "--other-fit", str(fitted["plain"])]
    arguments += ["--output", str(out), "--times", "0,60", "--draws", "50"]
    arguments += ["--tolerance", "1e-6"]  # left at once: for how long the pose is within it is not asked here
    assert main([*arguments, *(["--own-effects", str(own)] if own else [])]) == 0
    message = read_json(out / "pose.json")
    assert message["wires"]["effects"] == [effect]
    robot = schema.read_robot_file("cogiro-desk")
    points = robot.platform_m @ rotation.matrix(robot.home_rotation_rad).T
    stretched = np.linalg.norm(robot.home_m + points - robot.exit_m, axis=1) + robot.beyond_m
    sample = read_back.load_posterior(fitted[effect], own_effects=own).draws
    pick = np.linspace(0, len(sample["k1"]) - 1, 50).round().astype(int)
    k1, amplitude = sample["k1"][pick, None], sample[f"{effect}.{column}"][pick, None]
    zero = stretched / (1 + strain(np.array(message["inverse"]["tension_N"]) / k1, amplitude))
    np.testing.assert_allclose(message["inverse"]["zero_tension_length_m"]["mean"], zero.mean(0), rtol=1e-12)
    assert message["forward"]["solved"] == 1.0
    named = {row["controller"] for row in message["pose_error"]}
    assert named == {"hooke_only", "creep_aware", "creep_aware_other_fit"}
    assert f"{effect}.{column}" in message["variance_shares"]["shared_draw"]


@pytest.mark.parametrize("command", [["pose", "linear-6"], ["export", "hangprinter-4"]])
def test_an_effect_of_ones_own_needs_its_file(fitted, tmp_path, capsys, command):
    arguments = [*command, "--wires", str(fitted["own_power"]), "--output", str(tmp_path / "out")]
    assert main(arguments) == 2
    line = capsys.readouterr().err.strip()
    assert "own_power" in line
    assert "\n" not in line
    assert not (tmp_path / "out").exists()
    if command[0] == "export":
        assert main([*arguments, "--own-effects", str(OWN)]) == 0


def test_another_effects_file_is_another_configuration(fitted, tmp_path, capsys):
    arguments = ["export", "hangprinter-4", "--wires", str(fitted["own_power"]), "--output", str(tmp_path / "out")]
    assert main([*arguments, "--own-effects", str(OWN)]) == 0
    other = tmp_path / "other.py"
    other.write_text(OWN.read_text() + "\n# changed\n")
    assert main([*arguments, "--own-effects", str(other)]) == 2
    assert "own_effects" in capsys.readouterr().err
