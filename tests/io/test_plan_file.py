"""The strict reader of plans: what it takes, and that every mistake is named by file, line and key."""

import pytest

from wirebayes.errors import InputError
from wirebayes.io.plan_file import is_plan, read_plan

PLAN = """material = "line"
budget_min = 30.0
aim = ["toe", "superposition"]

[guess]
k1 = 1500.0
U = { distribution = "normal", mean = 0.6, sd = 0.1 }

[[protocol]]
name = "steps"
length_mm = 1000.0
step_mm = 0.5
holds = 3
unload = 2
hold_s = 60.0
readings = 3

[[protocol]]
length_mm = 500.0
displacements_mm = [1, 2, 4]
times_s = [0, 10, 30]
temperatures_C = [20, 25]
"""
EFFECTS = ("toe", "superposition")


@pytest.fixture
def plan_file(tmp_path):
    def write(changes=()):
        text = PLAN
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path = tmp_path / "plan.toml"
        path.write_text(text)
        return path

    return write


def test_what_a_plan_says_is_read(plan_file):
    path = plan_file()
    assert is_plan(path)
    read = read_plan(path, EFFECTS)
    steps, other = read.tests
    assert steps.settings == (0.5, 1.0, 1.5, 1.0, 0.5)
    assert steps.times_s == (0.0, 30.0, 60.0)
    assert (other.name, other.length_mm, other.times_s, other.temperatures_C) == (
        "protocol-2",
        500.0,
        (0.0, 10.0, 30.0),
        (20.0, 25.0),
    )
    assert read.aim == ("toe", "superposition")
    assert read.guess_lines == {"k1": 6, "U": 7}
    assert (read.budget_min, read.posterior, read.robot) == (30.0, None, None)


def test_an_experiment_file_is_no_plan(experiment_file):
    assert not is_plan(experiment_file())


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("step_mm = 0.5", "step_mm = 0", "line 12, protocol steps, key step_mm: found 0, expected a step other than 0"),
        ("holds = 3", "holds = 2.5", "line 13, protocol steps, key holds: found 2.5, expected a whole number of holds"),
        ("unload = 2", "unload = 3", "line 14, protocol steps, key unload: found 3, expected a whole number of holds"),
        ("hold_s = 60.0", "hold_s = -1", "line 15, protocol steps, key hold_s: found -1, expected how long each hold"),
        ("readings = 3", "readings = 1", "line 16, protocol steps, key readings: found 1, expected a whole number"),
        ("length_mm = 500.0", "length_mm = 0", "line 19, protocol 2, key length_mm: found 0, expected"),
        ("[1, 2, 4]", "[1, 2, 4e7]", "line 20, protocol 2, key displacements_mm: found"),
        ("[0, 10, 30]", "[0, 30, 10]", "line 21, protocol 2, key times_s: found"),
        ("[20, 25]", "[-300]", "line 22, protocol 2, key temperatures_C: found"),
        ("[1, 2, 4]", "[1, 2]\nstep_mm = 1", "key step_mm: found step_mm beside displacements_mm, expected one way"),
        (
            "[1, 2, 4]\ntimes_s = [0, 10, 30]",
            "[1, 2]\ntimes_s = [0]",
            "key times_s: found 2 holds of 1, expected at least",
        ),
        ("readings = 3", "readings = 19000", "key readings: found 95000 readings in all, expected at most 20000"),
        ("length_mm = 500.0", 'name = "steps"\nlength_mm = 500.0', "key name: found 'steps' a second time"),
        ("k1 = 1500.0", "prelod = 1", "line 6, key guess.prelod: found an unknown parameter (did you mean preload?)"),
        ("k1 = 1500.0", "k1 = true", "line 6, key guess.k1: found True, expected a number, or a table"),
        ('["toe", "superposition"]', '"fame"', 'line 3, key aim: found \'fame\', expected "parameters", "creep"'),
        ('["toe", "superposition"]', '["toe", "toe"]', "line 3, key aim: found ['toe', 'toe'], expected"),
        (
            '["toe", "superposition"]',
            '["toe", "superpositio"]',
            "line 3, key aim: found 'superpositio' (did you mean superposition?)",
        ),
        ("budget_min = 30.0", "budget_min = 0", "line 2, key budget_min: found 0, expected a time budget above 0"),
        ('material = "line"', 'posterior = "nowhere"', "line 1, key posterior: found 'nowhere', which is no folder"),
        ('material = "line"', 'posterior = "."', "line 1, key posterior: found a posterior beside a [guess]"),
        ('material = "line"', 'stuff = "line"', "key stuff: found an unknown key"),
    ],
)
def test_a_mistake_is_named_by_its_place(plan_file, old, new, message):
    path = plan_file([(old, new)])
    with pytest.raises(InputError) as caught:
        read_plan(path, EFFECTS)
    assert message in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_a_plan_without_protocols_is_refused(tmp_path):
    (tmp_path / "plan.toml").write_text("budget_min = 3\n")
    with pytest.raises(InputError, match=r"key protocol: found no such key, expected at least one \[\[protocol\]\]"):
        read_plan(tmp_path / "plan.toml")
