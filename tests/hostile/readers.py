"""Every reader of a user's text files, with a valid file for each, small enough to be read ten thousand times."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tests.conftest import CSV, TOML
from wirebayes.commands.import_robot import import_robot
from wirebayes.io import plan_file
from wirebayes.io.bench.about import About
from wirebayes.io.bench.convert import convert
from wirebayes.io.bench.undecided import Choices
from wirebayes.io.experiment_file import read_experiments
from wirebayes.io.readings import protocol_holds, protocol_table
from wirebayes.model.build import build
from wirebayes.robot.mechanics import schema
from wirebayes.robot.self_calibration import session_file

ROOT = Path(__file__).parents[2]
PRIOR = """
[experiment.prior]
k1 = { distribution = "log-normal", median = 2000.0, sd_log = 0.5 }
U = { fixed = 0.1 }
"""
PLAN = """material = "line"
budget_min = 60.0
aim = ["superposition", "toe"]

[guess]
k1 = 1500.0
B = { distribution = "log-normal", median = 100.0, sd_log = 0.5 }

[[protocol]]
name = "steps"
length_mm = 1000.0
resolution_N = 0.01
step_mm = 1.0
holds = 5
unload = 2
hold_s = 120.0
readings = 5

[[protocol]]
length_mm = 500.0
displacements_mm = [1.0, 2.0, 1.0]
times_s = [0.0, 30.0, 120.0]
temperatures_C = [20.0, 21.0]
"""
WARM = "".join(f"{a},{b}\n" for a, b in zip(CSV.split(), ["temperature_C", *"123456"], strict=True))
PROTOCOL = "hold,displacement_mm,time_s,tension_N,temperature_C\n5,5,0,2.5,20\n5,5,60,,20\n6,6,0,,20.5\n"
BENCH = """Prüfstand 3;Probe 7
Datum;2024-03-05
Stufe;Weg;Zeit;Kraft;Temp.
;mm;s;N;°C
1;1,0;0;2,120;20,1
1;1,0;30;1,910;20,1
1;1,0;60;1,862;20,2
2;2,0;0;2,504;20,2
2;2,0;45;2,270;20,2
2;2,0;90;2,215;20,3
3;3,0;0;3,050;20,3
3;3,0;60;2,800;20,3
"""
RECORDED = "elapsed [s],position [mm],force [lbf]\n" + "".join(
    f"{t / 2:.1f},{1 + t // 40},{(1 + t // 40) * (0.5 - 0.02 * np.log1p(t % 40)):.4f}\n" for t in range(200)
)
ROLLING = (ROOT / "data/robots/hangprinter-4.toml").read_text(encoding="utf-8").replace("lines = 2", """lines = 2
pulley_radius_m = 0.02
swivel_axis = [0.0, 0.0, 1.0]
drum_radius_m = 0.03
drum_pitch_m = 0.001
drum_layer_turns = 7
drum_layer_height_m = 0.0006
wire_length_m = 12.0
gear_ratio = 12.75""").replace("[workspace]", """[sensors]
tension_bias_N = 0.1

[workspace]""")  # fmt: skip


@dataclass(frozen=True)
class Reader:
    """What is damaged, what must lie beside it, and how it is read."""

    file: str
    content: bytes
    beside: dict[str, bytes]
    read: Callable[[Path], Any]


def experiments(path: Path) -> None:
    for e in read_experiments(path):
        build([e])


def beside(path: Path) -> None:
    """Readings, through the experiment file beside them."""
    experiments(path.parent / "e.toml")


def protocol(path: Path) -> None:
    protocol_holds(protocol_table(path), 1000.0)


def bench(path: Path) -> None:
    convert(path, About("bench", "line", 1000.0), Choices())


def session(path: Path) -> None:
    session_file.read_session(path, schema.read_robot_file("linear-7"), 1.0, 0.01)


def robot(path: Path) -> None:
    """A robot of CASPR; damage that leaves one makes a robot file that is read."""
    written = path.with_suffix(".toml")
    written.unlink(missing_ok=True)
    schema.read_robot_file(import_robot(path, written))


def _example(name: str) -> bytes:
    return (ROOT / "docs" / "example" / name).read_bytes()


READERS = {
    "experiment": Reader("e.toml", (TOML + PRIOR).encode(), {"a.csv": CSV.encode()}, experiments),
    "readings": Reader("a.csv", CSV.encode(), {"e.toml": TOML.encode()}, beside),
    "warm readings": Reader("a.csv", WARM.encode(), {"e.toml": TOML.encode()}, beside),
    "plan": Reader("plan.toml", PLAN.encode(), {}, lambda path: plan_file.read_plan(path, ("superposition", "toe"))),
    "protocol": Reader("protocol.csv", PROTOCOL.encode(), {}, protocol),
    "robot": Reader("robot.toml", (ROOT / "data/robots/linear-7.toml").read_bytes(), {}, schema.read_robot_file),
    "drums": Reader("robot.toml", (ROOT / "data/robots/hangprinter-4.toml").read_bytes(), {}, schema.read_robot_file),
    "session": Reader("session.csv", (ROOT / "docs/example/linear-7-session.csv").read_bytes(), {}, session),
    "pulleys": Reader("robot.toml", ROLLING.encode(), {}, schema.read_robot_file),
    "caspr": Reader(
        "desk_cables.xml", _example("desk_cables.xml"), {"desk_bodies.xml": _example("desk_bodies.xml")}, robot
    ),
    "caspr bodies": Reader(
        "desk_bodies.xml", _example("desk_bodies.xml"), {"desk_cables.xml": _example("desk_cables.xml")}, robot
    ),
    "bench": Reader("raw.csv", BENCH.encode(), {}, bench),
    "bench in cp1252": Reader("raw.txt", BENCH.encode("cp1252"), {}, bench),
    "recording": Reader("raw.csv", RECORDED.encode(), {}, bench),
}
